//! What a difference of a quantity means on the table: what a typical shot does otherwise.

use super::quantity::Quantity;
use crate::measurement::parameter::Parameter;
use crate::physics::ball::{Ball, BallState};
use crate::physics::cloth_motion::GRAVITY;
use crate::physics::collision::{Coefficients, Fidelity, Model, Outcome};
use crate::physics::contact_frame::cue_velocity;

/// Speed of the shots: a firm shot, m/s.
const SPEED: f64 = 2.0;

/// Cut angle of a half-ball hit, degrees.
const HALF_BALL_DEG: f64 = 30.0;

/// What a shot of 2 m/s does otherwise with the second of two values than with the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Effect {
    /// The throw of the object ball on a half-ball stun shot is larger by this angle, rad.
    Throw(f64),
    /// The balls are faster after a full hit in natural roll.
    FullRoll {
        /// By how much the object ball is, m/s.
        object: f64,
        /// By how much the cue ball is, m/s.
        cue: f64,
    },
    /// The cue ball is faster by this after a full stun hit, and the object ball as much slower, m/s.
    FullStun(f64),
    /// A ball without spin slides further before it rolls.
    Slide {
        /// How much further, m.
        further: f64,
        /// How far, m.
        way: f64,
    },
}

impl Effect {
    /// Returns the effect of the `second` value of a quantity against the first, all else as in `at`;
    /// `None` if no such shot can be computed.
    #[must_use]
    pub fn new(quantity: Quantity, ball: Ball, at: &Coefficients, values: [f64; 2]) -> Option<Self> {
        let [first, second] = values;
        let shot = |value, cut_deg, rolls| play(quantity, ball, *at, value, cut_deg, rolls);
        Some(match quantity {
            Quantity::Parameter(Parameter::Mu) => {
                let throw = |value| {
                    let object = shot(value, HALF_BALL_DEG, false)?.object.velocity;
                    Some(object.y.atan2(object.x))
                };
                Self::Throw(throw(second)? - throw(first)?)
            }
            Quantity::Parameter(Parameter::MuS) => {
                let (a, b) = (shot(first, 0.0, true)?, shot(second, 0.0, true)?);
                Self::FullRoll {
                    object: b.object.velocity.x - a.object.velocity.x,
                    cue: b.cue.velocity.x - a.cue.velocity.x,
                }
            }
            Quantity::Parameter(Parameter::E) => {
                let (a, b) = (shot(first, 0.0, false)?, shot(second, 0.0, false)?);
                Self::FullStun(b.cue.velocity.x - a.cue.velocity.x)
            }
            Quantity::Sliding => {
                // a ball that starts without spin slides 12 v²/(49 μ_k g) until it rolls
                let way = |mu_k: f64| 12.0 * SPEED * SPEED / (49.0 * mu_k * GRAVITY);
                Self::Slide { further: way(second) - way(first), way: way(second) }
            }
            Quantity::Parameter(_) => return None,
        })
    }
}

/// Returns the outcome of a shot with one value of a quantity.
fn play(
    quantity: Quantity,
    ball: Ball,
    mut at: Coefficients,
    value: f64,
    cut_deg: f64,
    rolls: bool,
) -> Option<Outcome> {
    match quantity {
        Quantity::Parameter(Parameter::Mu) => at.mu = value,
        Quantity::Parameter(Parameter::MuS) => at.mu_s = value,
        Quantity::Parameter(Parameter::E) => at.e = value,
        Quantity::Sliding | Quantity::Parameter(_) => {}
    }
    let velocity = cue_velocity(SPEED, f64::to_radians(cut_deg));
    let cue = if rolls { BallState::natural_roll(velocity, ball.radius) } else { BallState::stun(velocity) };
    Model::new(Fidelity::Full, ball).collide(&cue, &at).ok()
}
