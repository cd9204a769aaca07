//! The spin of the cue ball before an impact, as far as it is known.

use crate::physics::ball::Vec3;

/// The cue ball's spin before the impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spin {
    Stun,
    NaturalRoll,
    /// rad/s, in the table frame for `impacts` and in the collision frame for `angles`.
    Measured {
        spin: Vec3,
        sd: [Option<f64>; 3],
    },
    Unknown,
}
