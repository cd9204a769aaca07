//! The effect of a difference on the table, by a typical shot.

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

/// The change of a shot of 2 m/s by the second of two values instead of the first.
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
    pub fn new(quantity: Quantity, ball: Ball, at: &Coefficients, values: [f64; 2]) -> Option<Self> {
        let velocity = |cut_deg: f64| cue_velocity(SPEED, cut_deg.to_radians());
        let play =
            |cue: BallState, at: Coefficients| Model::new(Fidelity::Full, ball).collide(&cue, &at).ok();
        let both = |cue: BallState, with: fn(Coefficients, f64) -> Coefficients| -> Option<[Outcome; 2]> {
            let [first, second] = values.map(|value| play(cue, with(*at, value)));
            Some([first?, second?])
        };
        let along = |[first, second]: [BallState; 2]| second.velocity.x - first.velocity.x;
        Some(match quantity {
            Quantity::Parameter(Parameter::Mu) => {
                let cue = BallState::stun(velocity(HALF_BALL_DEG));
                let outcomes = both(cue, |at, mu| Coefficients { mu, ..at })?;
                let [first, second] = outcomes.map(|o| o.object.velocity.y.atan2(o.object.velocity.x));
                Self::Throw(second - first)
            }
            Quantity::Parameter(Parameter::MuS) => {
                let cue = BallState::natural_roll(velocity(0.0), ball.radius);
                let outcomes = both(cue, |at, mu_s| Coefficients { mu_s, ..at })?;
                Self::FullRoll {
                    object: along(outcomes.map(|outcome| outcome.object)),
                    cue: along(outcomes.map(|outcome| outcome.cue)),
                }
            }
            Quantity::Parameter(Parameter::E) => {
                let outcomes = both(BallState::stun(velocity(0.0)), |at, e| Coefficients { e, ..at })?;
                Self::FullStun(along(outcomes.map(|outcome| outcome.cue)))
            }
            Quantity::Sliding => {
                // a ball that starts without spin slides 12 v²/(49 μ_k g) until it rolls
                let [first, way] = values.map(|mu_k| 12.0 * SPEED * SPEED / (49.0 * mu_k * GRAVITY));
                Self::Slide { further: way - first, way }
            }
            Quantity::Parameter(_) => return None,
        })
    }
}
