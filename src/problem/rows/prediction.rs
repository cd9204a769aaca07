//! Prediction of the numbers of a shot from its unknowns.

use nalgebra::{DMatrix, DVector};
use num_dual::DualNum;

use super::shot::{INPUTS, Row, RowShot, SPEED, Unpredictable};
use crate::measurement::dataset::{Dataset, Measurement, Shot};
use crate::measurement::observable::{Axis, Observable};
use crate::numerics::{EXACT, wrap};
use crate::physics::ball::BallState;
use crate::physics::collision::{Coefficients, Model, NotACollision};
use crate::physics::friction_law::Law;
use crate::problem::film::dual::{Dual, DualVector, constant, gradient, norm, with_gradient};
use crate::problem::film::impact::{Contact, Parting, Side};
use crate::problem::film::own::{MOVING, SCATTERED};
use crate::problem::unknowns::{Own, Shared};

/// Steps until an unknown speed before the impact gives the measured one afterwards.
const STEPS: usize = 20;

/// The cue ball before the impact in the collision frame, and the direction of this frame.
pub(super) struct Approach {
    pub(crate) cue: Side,
    /// Direction of the line of centres on the table; (1, 0) of angles.
    pub(crate) cos: Dual,
    pub(crate) sin: Dual,
    /// Cut angle, rad, and speed, m/s.
    pub(crate) cut: Dual,
    pub(crate) speed: Dual,
}

impl Approach {
    /// Returns what is measured of the balls after the impact, rad, m/s or rad/s; angles are
    /// counted from the side of the measured cut angle, which is 1 or −1.
    fn observe(&self, observable: Observable, Parting { balls, radii, .. }: &Parting, side: f64) -> Dual {
        let [cue, object] = balls.each_ref().map(|ball| ball.velocity);
        let rolling = |ball: usize| roll(&balls[ball]);
        let against_incoming = |velocity: &DualVector| turn(&((direction(velocity) - self.cut) * side));
        let on_table = |[x, y, z]: [Dual; 3], axis: Axis| match axis {
            Axis::X => x * self.cos - y * self.sin,
            Axis::Y => x * self.sin + y * self.cos,
            Axis::Z => z,
        };
        let velocity = |ball: usize| [balls[ball].velocity.x, balls[ball].velocity.y, balls[ball].rise];
        let spin = |ball: usize| balls[ball].spin.map(|spin| spin / radii[ball]);
        match observable {
            Observable::Throw => direction(&object) * side,
            Observable::CueTurn => against_incoming(&cue),
            Observable::CueTurnRolling => against_incoming(&rolling(0)),
            Observable::ObjectAngleRolling => -against_incoming(&rolling(1)),
            Observable::Separation => {
                let angle = turn(&(direction(&cue) - direction(&object)));
                if angle.re < 0.0 { -angle } else { angle }
            }
            Observable::ObjectSpeed => norm(&object),
            Observable::CueSpeed => norm(&cue),
            Observable::ObjectSpeedRolling => norm(&rolling(1)),
            Observable::CueSpeedRolling => norm(&rolling(0)),
            Observable::ObjectSpeedRatio => norm(&object) / self.speed,
            Observable::CueVelocity(axis) => on_table(velocity(0), axis),
            Observable::CueSpin(axis) => on_table(spin(0), axis),
            Observable::ObjectVelocity(axis) => on_table(velocity(1), axis),
            Observable::ObjectSpin(axis) => on_table(spin(1), axis),
            // of discs, which are another kind of data
            Observable::Restitution | Observable::ImpulseRatio => constant(f64::NAN),
        }
    }
}

/// Returns the velocity of a ball once it rolls: V − s ν/(1 + ν) with its slip s on the cloth,
/// whether or not it flies first.
fn roll(ball: &Side) -> DualVector {
    ball.velocity - ball.slip() * constant(ball.inertia / (1.0 + ball.inertia))
}

/// Returns the error of an input.
pub(super) fn input_error(own: &Own, place: usize) -> Dual {
    constant(own[place]).derivative(place)
}

fn direction(v: &DualVector) -> Dual {
    v.y.atan2(v.x)
}

/// Returns the same angle within (−π, π].
fn turn(angle: &Dual) -> Dual {
    *angle + (wrap(angle.re) - angle.re)
}

/// Residuals of a shot.
pub(crate) struct Residuals {
    /// Predicted numbers less the measured ones.
    pub(crate) rows: Vec<Dual>,
    pub(crate) sticks: bool,
    pub(super) approach: Approach,
}

impl RowShot {
    /// Returns the cue ball before the impact.
    fn approach(&self, [first, second, third, w_x, w_y, w_z]: [Dual; INPUTS]) -> Approach {
        let (sin, cos) = if self.is_cut { (constant(0.0), constant(1.0)) } else { first.sin_cos() };
        let turn = |x: Dual, y: Dual| DualVector::new(x * cos + y * sin, y * cos - x * sin);
        let velocity = if self.is_cut {
            DualVector::new(second * first.cos(), second * first.sin())
        } else {
            turn(second, third)
        };
        let w = turn(w_x, w_y);
        // ω = (−U_y, U_x, 0)/R of natural roll
        let spin = [
            w.x * self.radius - velocity.y * self.roll,
            w.y * self.radius + velocity.x * self.roll,
            w_z * self.radius,
        ];
        Approach {
            cue: Side { velocity, rise: constant(0.0), spin, inertia: self.inertia },
            cos,
            sin,
            cut: if self.is_cut { first } else { direction(&velocity) },
            speed: if self.is_cut { second } else { norm(&velocity) },
        }
    }

    /// Returns the balls before and after the impact; a speed before it that is not measured is the
    /// one that the measured speed afterwards follows from.
    fn strike(
        &self,
        own: &Own,
        collide: impl Fn(&Side) -> Result<Parting, NotACollision>,
    ) -> Result<(Approach, Parting), NotACollision> {
        let input = |place: usize| {
            let Row { number: Measurement { measured, .. }, noise } = self.inputs[place];
            let exact = constant(measured.value);
            let is_exact = noise.is_none() && measured.sd.unwrap_or(0.0) == 0.0;
            if is_exact { exact } else { exact + input_error(own, place) }
        };
        let mut inputs: [Dual; INPUTS] = std::array::from_fn(input);
        if let Some(observable) = self.speed_after {
            let measured = inputs[SPEED];
            let mut speed = measured.re;
            for _ in 0..STEPS {
                inputs[SPEED] = constant(speed).derivative(SPEED);
                let approach = self.approach(inputs);
                let after = approach.observe(observable, &collide(&approach.cue)?, self.side);
                // a step of Newton's method gives the derivatives by the other inputs
                let mut by_others = gradient(&after);
                let slope = std::mem::take(&mut by_others[SPEED]);
                inputs[SPEED] = constant(speed);
                if slope != 0.0 {
                    inputs[SPEED] += (measured - with_gradient(after.re, &by_others)) / slope;
                }
                // speeds afterwards are nearly in proportion to the one before
                let part = measured.re / after.re;
                if (part - 1.0).abs() <= EXACT {
                    break;
                }
                speed *= part;
            }
        }
        let approach = self.approach(inputs);
        let after = collide(&approach.cue)?;
        Ok((approach, after))
    }

    /// Returns the predicted numbers less the measured ones.
    pub(super) fn differences(
        &self,
        own: &Own,
        shared: &Shared,
        contact: &Contact,
    ) -> Result<Residuals, NotACollision> {
        let offsets = [0.0; SCATTERED.len()];
        let correction = self.offset.as_deref();
        let (approach, after) = self.strike(own, |cue| contact.collide(cue, shared, &offsets, correction))?;
        let difference = |row: &Row| {
            let Measurement { observable, measured } = row.number;
            let off = approach.observe(observable, &after, self.side) - measured.value;
            if observable.is_angle() { turn(&off) } else { off }
        };
        let rows = self.rows.iter().map(difference).collect();
        Ok(Residuals { rows, sticks: after.sticks, approach })
    }
}

/// The numbers of a shot as a model has them.
#[derive(Clone, Debug)]
pub struct Prediction {
    /// The cue ball before the impact in the collision frame.
    pub(crate) cue: BallState,
    /// The observables of the shot; a speed that determines an unknown one before is not among it.
    pub observables: Vec<Observable>,
    /// Predicted numbers, SI and radians.
    pub values: Vec<f64>,
}

/// Predicts the numbers of a shot from its measured inputs.
///
/// # Errors
/// A shot whose inputs are not all known, or that is not a collision.
pub fn predict(shot: &Shot, model: &Model, coefficients: &Coefficients) -> Result<Prediction, Unpredictable> {
    let bare = Dataset::new("", model.ball, Vec::new());
    let made = RowShot::new(shot, &bare, model.law != Law::Constant || model.e_slope.is_some())?;
    let radii = [model.ball.radius, model.object_ball().radius];
    let (approach, after) = made.strike(&Own::zeros(MOVING), |cue| {
        let after = model.collide(&cue.state(radii[0]), coefficients)?.components();
        Ok(Parting::new(|i| constant(after[i]), &radii.map(constant), made.inertia))
    })?;
    let value = |row: &Row| approach.observe(row.number.observable, &after, made.side).re;
    Ok(Prediction {
        cue: approach.cue.state(radii[0]),
        observables: made.rows.iter().map(|row| row.number.observable).collect(),
        values: made.rows.iter().map(value).collect(),
    })
}

/// Numbers of one shot less their prediction from its measured inputs.
pub(crate) struct Deviations {
    pub(crate) observables: Vec<Observable>,
    /// Measured numbers, SI and radians.
    pub(crate) measured: Vec<f64>,
    /// Measured less predicted.
    pub(crate) values: DVector<f64>,
    /// Covariance of `values`, errors of the inputs included.
    pub(crate) covariance: DMatrix<f64>,
    /// Derivatives of the prediction by the unknowns, of a table those that move the balls, in the
    /// order of [`Id`].
    pub(crate) by: DMatrix<f64>,
    /// Direction of the line of centres: cosine and sine.
    pub(crate) normal: [f64; 2],
    /// Cut angle, rad.
    pub(crate) cut: f64,
    /// Speed of the cue ball before the impact, m/s; `None` if it is not known.
    pub(crate) speed: Option<f64>,
    /// Topspin and side spin of the cue ball before the impact over those of natural roll; NaN if
    /// not known.
    pub(crate) spins: [f64; 2],
}
