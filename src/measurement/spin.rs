//! The spin of the cue ball before an impact, as far as it is known.

use crate::name::by_name;
use crate::physics::ball::Vec3;

/// The cue ball's spin before the impact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Spin {
    /// The ball slides without any spin.
    Stun,
    /// The ball rolls on the cloth without slip.
    NaturalRoll,
    /// The spin was measured, table frame; collision frame for `angles`.
    Measured {
        /// The angular velocity, rad/s.
        spin: Vec3,
        /// The standard deviations, rad/s. A spin without one errs in a film as one that a word states,
        /// in a table as the spins after the impact if these have none, either, and else is exact.
        sd: [Option<f64>; 3],
    },
    /// The spin is unknown.
    #[default]
    Unknown,
}

impl Spin {
    /// The spins that have no numbers.
    pub const WORDS: [Self; 3] = [Self::Stun, Self::NaturalRoll, Self::Unknown];

    /// The name in dataset.toml and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stun => "stun",
            Self::NaturalRoll => "natural-roll",
            Self::Measured { .. } => "measured",
            Self::Unknown => "unknown",
        }
    }
}

// One of [`Spin::WORDS`] by its name; a measured spin takes its numbers.
by_name!(Spin, "spin", WORDS, name);
