//! Why a shot cannot be predicted.

use crate::physics::collision::NotACollision;

/// Why a shot cannot be predicted.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Unpredictable {
    /// The state before the impact is no collision.
    #[error(transparent)]
    NotACollision(#[from] NotACollision),
    /// The cue ball's spin is unknown.
    #[error("its spin is unknown; give spin columns, or cue_spin stun or natural-roll")]
    UnknownSpin,
    /// The spin is given in rad/s, but no speed to compare it with.
    #[error("its spin is given in rad/s but no speed is: give speed_m_s or a speed after the impact")]
    SpinWithoutSpeed,
    /// The friction or the restitution depends on the speed, which is not known.
    #[error(
        "the friction or e depends on the speed, but the shot has none: give speed_m_s or a speed after the \
         impact"
    )]
    FallsWithoutSpeed,
    /// No speed before the impact gives the speed that was measured after it.
    #[error("no incoming speed gives the {column} of {value}")]
    NoSpeed {
        /// The column of the speed that was measured.
        column: &'static str,
        /// Its value, m/s.
        value: f64,
    },
    /// The only observable serves to find the speed before the impact, so that none is left to fit.
    #[error("its only observable, {column}, serves to find the incoming speed: nothing is left to fit")]
    NothingLeft {
        /// The column of that observable.
        column: &'static str,
    },
}
