//! From the unknowns of a shot to its numbers.

use nalgebra::{SMatrix, SVector, Vector2};
use num_dual::{DualNum, DualSVec64};

use super::choices::Unpredictable;
use super::shot::{Gradient, OWN, RowShot, SPEED};
use crate::measurement::dataset::{Dataset, Shot};
use crate::measurement::observable::{Axis, Observable};
use crate::numerics::wrap;
use crate::physics::ball::{BallState, Vec3};
use crate::physics::collision::{Coefficients, Input, Model, NotACollision};
use crate::physics::friction_law::Law;
use crate::problem::film::dual::{SMOOTH_SPEED, constant, gradient};
use crate::problem::film::impact::Contact;
use crate::problem::unknowns::{Id, Own, Shared};

/// Steps until an unknown speed before the impact gives the measured one afterwards, and the relative
/// difference at which they end.
const STEPS: usize = 20;
const SAME_SPEED: f64 = 1e-14;

/// Number of components of an outcome.
const AFTER: usize = 12;

/// Number of quantities that an observation depends on: the inputs, the outcome, and the ratio of the radii.
const SEEN: usize = OWN + AFTER + 1;

/// A number with its derivatives by these quantities.
type Seen = DualSVec64<SEEN>;

/// The cue ball before the impact in the collision frame, and where that is on the table.
pub(super) struct Approach {
    /// m/s
    pub(crate) velocity: [Seen; 2],
    /// Rω, m/s.
    pub(crate) spin: [Seen; 3],
    /// Direction of the line of centres on the table; (1, 0) of angles.
    pub(crate) cos: Seen,
    pub(crate) sin: Seen,
    /// Cut angle, rad, and speed, m/s.
    pub(crate) cut: Seen,
    pub(crate) speed: Seen,
}

impl Approach {
    pub fn state(&self, radius: f64) -> BallState {
        let [v_x, v_y] = self.velocity.map(|v| v.re);
        let [w_x, w_y, w_z] = self.spin.map(|spin| spin.re / radius);
        BallState { velocity: Vec3::new(v_x, v_y, 0.0), spin: Vec3::new(w_x, w_y, w_z) }
    }

    /// Returns the derivatives of velocity and spin, as inputs of a collision, by those of the shot.
    fn motion_by_inputs(&self, radius: f64) -> SMatrix<f64, 5, OWN> {
        let [v_x, v_y] = self.velocity;
        let [w_x, w_y, w_z] = self.spin.map(|spin| spin / radius);
        SMatrix::from_rows(&[v_x, v_y, w_x, w_y, w_z].map(|number| by_inputs(&number).transpose()))
    }
}

/// Returns the derivatives of a number by the inputs.
fn by_inputs(number: &Seen) -> SVector<f64, OWN> {
    gradient(number).fixed_rows::<OWN>(0).into_owned()
}

/// Both balls after an impact, as an observer on the table sees them.
struct View<'a> {
    approach: &'a Approach,
    /// Velocity and angular velocity of the cue ball, then of the object ball.
    after: [Seen; AFTER],
    /// Sign of the measured cut angle.
    side: f64,
    /// m
    radii: [Seen; 2],
    inertia: f64,
}

impl<'a> View<'a> {
    fn new(shot: &RowShot, approach: &'a Approach, after: &SVector<f64, AFTER>, radius_ratio: f64) -> Self {
        let ratio = constant::<SEEN>(radius_ratio).derivative(OWN + AFTER);
        Self {
            approach,
            after: std::array::from_fn(|i| constant::<SEEN>(after[i]).derivative(OWN + i)),
            side: shot.side,
            radii: [constant(shot.radius), ratio.recip() * shot.radius],
            inertia: shot.inertia,
        }
    }

    /// Returns what is measured of the balls after the impact, rad, m/s or rad/s.
    fn observe(&self, observable: Observable) -> Seen {
        let [cue, object] = [0, 1].map(|ball| self.velocity(ball));
        let against_incoming =
            |velocity: &Vector2<Seen>| turn((direction(velocity) - self.approach.cut) * self.side);
        match observable {
            Observable::Throw => direction(&object) * self.side,
            Observable::CueTurn => against_incoming(&cue),
            Observable::CueTurnRolling => against_incoming(&self.rolling(0)),
            Observable::ObjectAngleRolling => -against_incoming(&self.rolling(1)),
            Observable::Separation => {
                let angle = turn(direction(&cue) - direction(&object));
                if angle.re < 0.0 { -angle } else { angle }
            }
            Observable::ObjectSpeed => length(&object),
            Observable::CueSpeed => length(&cue),
            Observable::ObjectSpeedRolling => length(&self.rolling(1)),
            Observable::CueSpeedRolling => length(&self.rolling(0)),
            Observable::ObjectSpeedRatio => length(&object) / self.approach.speed,
            Observable::CueVelocity(axis) => self.on_table(0, axis),
            Observable::CueSpin(axis) => self.on_table(3, axis),
            Observable::ObjectVelocity(axis) => self.on_table(6, axis),
            Observable::ObjectSpin(axis) => self.on_table(9, axis),
            // of discs, which are another kind of data
            Observable::Restitution | Observable::ImpulseRatio => constant(f64::NAN),
        }
    }

    fn velocity(&self, ball: usize) -> Vector2<Seen> {
        Vector2::new(self.after[6 * ball], self.after[6 * ball + 1])
    }

    /// Returns the velocity of a ball once it rolls: V − s ν/(1 + ν) with its slip s on the cloth, whether
    /// or not it flies first.
    fn rolling(&self, ball: usize) -> Vector2<Seen> {
        let velocity = self.velocity(ball);
        let [w_x, w_y] = [3, 4].map(|i| self.after[6 * ball + i] * self.radii[ball]);
        let part = self.inertia / (1.0 + self.inertia);
        Vector2::new(velocity.x - (velocity.x - w_y) * part, velocity.y - (velocity.y + w_x) * part)
    }

    /// Returns a component on the table of the vector whose components begin at `first`.
    fn on_table(&self, first: usize, axis: Axis) -> Seen {
        let [x, y, z] = [0, 1, 2].map(|i| self.after[first + i]);
        let Approach { cos, sin, .. } = self.approach;
        match axis {
            Axis::X => x * cos - y * sin,
            Axis::Y => x * sin + y * cos,
            Axis::Z => z,
        }
    }
}

fn length(v: &Vector2<Seen>) -> Seen {
    (v.x * v.x + v.y * v.y + SMOOTH_SPEED * SMOOTH_SPEED).sqrt()
}

fn direction(v: &Vector2<Seen>) -> Seen {
    v.y.atan2(v.x)
}

/// Returns the same angle within (−π, π].
fn turn(angle: Seen) -> Seen {
    angle + (wrap(angle.re) - angle.re)
}

/// A predicted number less the measured one, with its derivatives.
#[derive(Clone, Copy)]
pub(crate) struct Residual {
    pub(crate) value: f64,
    pub(crate) by: Gradient,
}

/// Residuals of a shot.
pub(crate) struct Residuals {
    pub(crate) rows: Vec<Residual>,
    pub(crate) sticks: bool,
    pub(super) approach: Approach,
}

impl RowShot {
    /// Returns the cue ball before the impact.
    pub(super) fn approach(&self, own: &Own) -> Approach {
        let values = self.inputs + self.sds.component_mul(&own.fixed_rows::<OWN>(0));
        let inputs: [Seen; OWN] = std::array::from_fn(|i| constant::<SEEN>(values[i]).derivative(i));
        let [first, second, third, w_x, w_y, w_z] = inputs;
        let (sin, cos) = if self.is_cut { (constant(0.0), constant(1.0)) } else { first.sin_cos() };
        let turn = |x: Seen, y: Seen| [x * cos + y * sin, y * cos - x * sin];
        let velocity =
            if self.is_cut { [second * first.cos(), second * first.sin()] } else { turn(second, third) };
        let [w_x, w_y] = turn(w_x, w_y);
        // ω = (−U_y, U_x, 0)/R of natural roll
        let spin = [
            w_x * self.radius - velocity[1] * self.roll,
            w_y * self.radius + velocity[0] * self.roll,
            w_z * self.radius,
        ];
        let vector = Vector2::from(velocity);
        Approach {
            velocity,
            spin,
            cos,
            sin,
            cut: if self.is_cut { first } else { direction(&vector) },
            speed: if self.is_cut { second } else { length(&vector) },
        }
    }

    /// Returns the predicted numbers less the measured ones.
    pub(super) fn differences(
        &self,
        own: &Own,
        shared: &Shared,
        contact: &Contact,
    ) -> Result<Residuals, NotACollision> {
        let approach = self.approach(own);
        let response = contact.respond(&approach.state(self.radius), shared, &self.offset)?;
        let view = View::new(self, &approach, &response.after, shared[Id::RadiusRatio]);
        let motion_by_inputs = approach.motion_by_inputs(self.radius);
        let difference = |row: &super::shot::Row| {
            let seen = view.observe(row.observable);
            let slope = gradient(&seen);
            let by_collision = response.by.tr_mul(&slope.fixed_rows::<AFTER>(OWN));
            let by_motion = by_collision.fixed_rows::<5>(Input::VelocityX as usize);
            let by_inputs = slope.fixed_rows::<OWN>(0) + motion_by_inputs.tr_mul(&by_motion);
            let mut by = Gradient::zeros();
            by.fixed_rows_mut::<OWN>(0).copy_from(&self.sds.component_mul(&by_inputs));
            for input in Input::ALL {
                if let Some(id) = input.shared() {
                    by[OWN + id as usize] += by_collision[input as usize];
                }
            }
            by[OWN + Id::RadiusRatio as usize] += slope[OWN + AFTER];
            let value = seen.re - row.value;
            Residual { value: if row.observable.is_angle() { wrap(value) } else { value }, by }
        };
        let rows = self.rows.iter().map(difference).collect();
        Ok(Residuals { rows, sticks: response.sticks, approach })
    }
}

/// The numbers of a shot as a model has them.
#[derive(Clone, Debug)]
pub struct Prediction {
    /// The cue ball before the impact in the collision frame.
    pub cue: BallState,
    /// The observables of the shot; a speed that determines an unknown one before is not among it.
    pub observables: Vec<Observable>,
    /// Predicted numbers, SI and radians.
    pub values: Vec<f64>,
}

/// Predicts the numbers of a shot from its measured inputs.
///
/// # Errors
/// A shot whose inputs are not all known, or that is no collision.
pub fn predict(shot: &Shot, model: &Model, coefficients: &Coefficients) -> Result<Prediction, Unpredictable> {
    let bare = Dataset::new("", model.ball, Vec::new());
    let made = RowShot::new(shot, &bare, model.law != Law::Constant || model.e_slope.is_some())?;
    let spent = made.spent_row();
    let mut own = Own::zeros(OWN);
    let mut steps = 0;
    loop {
        let approach = made.approach(&own);
        let cue = approach.state(model.ball.radius);
        let after = model.collide(&cue, coefficients)?.components();
        let view = View::new(&made, &approach, &after, model.ball.radius / model.object_ball().radius);
        let values: Vec<f64> = made.rows.iter().map(|row| view.observe(row.observable).re).collect();
        // speeds afterwards are nearly in proportion to the one before
        let part = spent.map_or(1.0, |row| made.rows[row].value / values[row]);
        if (part - 1.0).abs() > SAME_SPEED && steps < STEPS {
            own[SPEED] = (1.0 + own[SPEED]) * part - 1.0;
            steps += 1;
            continue;
        }
        let kept: Vec<usize> = (0..values.len()).filter(|row| spent != Some(*row)).collect();
        return Ok(Prediction {
            cue,
            observables: kept.iter().map(|row| made.rows[*row].observable).collect(),
            values: kept.iter().map(|row| values[*row]).collect(),
        });
    }
}
