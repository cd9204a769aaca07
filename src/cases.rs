//! Collisions asked for in a file: `caromfit collide --cases`.

use crate::ball::{BallState, Vec3};
use crate::collision::{Coefficients, Model, NotACollision, Outcome};
use crate::contact;

/// One collision to compute, in the units of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    pub name: String,
    /// m/s.
    pub speed: f64,
    /// Between −90 and 90.
    pub cut_deg: f64,
    /// Cue ball's spin in the collision frame, rad/s.
    pub spin: Vec3,
    pub mu: f64,
    pub mu_s: f64,
    pub e: f64,
    /// m.
    pub radius: f64,
}

/// Why a case is no collision.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BadCase {
    #[error("the speed is {0} m/s; expected more than 0")]
    Speed(f64),
    #[error("the cut angle is {0}°; expected more than −90° and less than 90°")]
    Cut(f64),
    #[error(transparent)]
    NotACollision(#[from] NotACollision),
}

impl Case {
    /// # Errors
    /// A speed that is not positive, a cut angle of 90° or more, and what [`Model::collide`] refuses.
    pub fn collide(&self, model: &Model) -> Result<Outcome, BadCase> {
        if !(self.speed > 0.0 && self.speed.is_finite()) {
            return Err(BadCase::Speed(self.speed));
        }
        if self.cut_deg.is_nan() || self.cut_deg.abs() >= 90.0 {
            return Err(BadCase::Cut(self.cut_deg));
        }
        let cue = BallState {
            velocity: contact::cue_velocity(self.speed, self.cut_deg.to_radians()),
            spin: self.spin,
        };
        let coefficients = Coefficients { mu: self.mu, mu_s: self.mu_s, e: self.e };
        Ok(model.collide(&cue, &coefficients)?)
    }
}
