//! What is known of one shot before its unknowns are: its balls, the cue ball's spin, and in what it departs from what is stated.

use super::scene::Scene;
use super::unknowns::Unknowns;
use super::unknowns::unknown::{BEFORE, DIRECTION, ROLL};
use crate::measurement::spin::Spin;
use crate::measurement::track::Viewpoint;
use crate::physics::ball::{Ball, BallState, Vec3};
use crate::physics::cloth_motion::{Number, Path};

/// An unknown spin, over the natural roll's: no spin, give or take as much as rolling.
pub(crate) const ROLL_PRIOR: (f64, f64) = (0.0, 1.0);

/// What is known of a shot besides its unknowns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShotScene {
    /// The cue ball and the object ball.
    pub ball: Ball,
    pub object: Ball,
    pub spin: Spin,
    pub bounce: f64,
    /// A cue ball that slips less than this on the cloth (m/s) rolls, for all that its measured spin says.
    pub rolls_within: f64,
    /// Standard deviation of side spin that nobody saw, of a shot that is stated as stun or natural roll: of Rω_z/U. 0 where there is
    /// none.
    pub side_sd: f64,
    /// In what the shot differs from what is stated.
    pub departure: Departure,
    /// Where the camera sees balls that hop.
    pub viewpoint: Viewpoint,
}

/// In what a shot may differ from what its data set states, to find out what explains its residuals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Departure {
    /// Gravity in the film's units of length and time, over g: (stated frame rate / true one)².
    pub gravity: f64,
    /// Topspin besides that of a stun or natural-roll shot, over the natural roll's.
    pub topspin: f64,
    /// Acceleration of a body that slides without friction down the table, table frame, m/s².
    pub tilt: [f64; 2],
}

impl Departure {
    pub(crate) const NONE: Self = Self { gravity: 1.0, topspin: 0.0, tilt: [0.0; 2] };
}

/// Standard deviations of a measured spin within which a ball that rolls may seem to slip.
const ROLLS_ERRORS: f64 = 4.0;

/// Which ball the vertical friction between the balls lifts off the cloth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lifted {
    /// Neither ball leaves the cloth: a stun shot.
    Neither,
    /// The cue ball, with topspin.
    Cue,
    /// The object ball, with draw.
    Object,
}

impl ShotScene {
    pub(crate) fn of(spin: Spin, scene: &Scene) -> Self {
        let bounce = scene.cloth.bounce;
        let sd = match spin {
            Spin::Measured { sd: [x, y, _], .. } => x.unwrap_or(0.0).max(y.unwrap_or(0.0)),
            _ => 0.0,
        };
        let rolls_within = ROLLS_ERRORS * sd * scene.ball.radius;
        let side_sd = if matches!(spin, Spin::Stun | Spin::NaturalRoll) { scene.side_sd } else { 0.0 };
        let Scene { ball, object, viewpoint, .. } = *scene;
        Self { ball, object, spin, bounce, rolls_within, side_sd, departure: Departure::NONE, viewpoint }
    }

    /// Where the camera sees a ball on a path.
    pub(crate) fn seen<T: Number>(&self, path: Path<T>) -> Path<T> {
        if self.viewpoint.is_overhead() {
            return path;
        }
        path.seen(self.departure.gravity, |place| self.viewpoint.displacement(place))
    }

    /// How far apart the centres of the balls are on the table where they touch: 2√(R_c R_o).
    pub(crate) fn contact_distance(&self) -> f64 {
        self.ball.contact_distance(&self.object)
    }

    /// Spin in the collision frame; `unknown` is its part of the natural roll where it is unknown, and Rω_z/U where the side
    /// spin is.
    pub(crate) fn spin<T: Number>(&self, direction: [T; 2], before: [T; 2], unknown: T) -> [T; 3] {
        let zero = T::from(0.0);
        let rolling = [-before[1] / self.ball.radius, before[0] / self.ball.radius, zero];
        let [x, y, z] = match self.spin {
            Spin::Stun => rolling.map(|spin| spin * self.departure.topspin),
            Spin::NaturalRoll => rolling.map(|spin| spin * (1.0 + self.departure.topspin)),
            Spin::Unknown => rolling.map(|spin| spin * unknown),
            Spin::Measured { spin, .. } => {
                let [cos, sin] = direction;
                [cos * spin.x + sin * spin.y, cos * spin.y - sin * spin.x, T::from(spin.z)]
            }
        };
        if self.side_sd > 0.0 {
            let speed = (before[0] * before[0] + before[1] * before[1]).sqrt();
            [x, y, z + unknown * speed / self.ball.radius]
        } else {
            [x, y, z]
        }
    }

    /// The cue ball at the impact, collision frame.
    pub(crate) fn cue(&self, z: &Unknowns) -> BallState {
        let (sin, cos) = z[DIRECTION].sin_cos();
        let before = [z[BEFORE], z[BEFORE + 1]];
        BallState {
            velocity: Vec3::new(before[0], before[1], 0.0),
            spin: self.spin([cos, sin], before, z[ROLL]).into(),
        }
    }

    /// |sin θ₀| of the friction's first direction.
    pub(crate) fn vertical(&self, z: &Unknowns) -> f64 {
        let (sin, cos) = z[DIRECTION].sin_cos();
        let spin = self.spin([cos, sin], [z[BEFORE], z[BEFORE + 1]], z[ROLL]);
        let (v_y, v_z) = (-z[BEFORE + 1] - self.ball.radius * spin[2], self.ball.radius * spin[1]);
        let slip = v_y.hypot(v_z);
        if slip > 0.0 { v_z.abs() / slip } else { 0.0 }
    }

    /// The part of the closing speed that is vertical in the slip of the contact, v_z/|v|, positive with topspin.
    pub(super) fn upward<T: Number>(&self, before: [T; 2], spin: [T; 3]) -> T {
        let (v_y, v_z) = (-before[1] - spin[2] * self.ball.radius, spin[1] * self.ball.radius);
        let slip = (v_y * v_y + v_z * v_z).sqrt();
        if slip.re() > 0.0 { before[0] * v_z / slip } else { T::from(0.0) }
    }

    pub(crate) fn lift(&self, z: &Unknowns) -> Lifted {
        let (sin, cos) = z[DIRECTION].sin_cos();
        let topspin = self.spin([cos, sin], [z[BEFORE], z[BEFORE + 1]], z[ROLL])[1];
        // the rounding of a measured spin is no spin
        let least = 1e-3 * z[BEFORE] / self.ball.radius;
        if topspin > least {
            Lifted::Cue
        } else if topspin < -least {
            Lifted::Object
        } else {
            Lifted::Neither
        }
    }
}
