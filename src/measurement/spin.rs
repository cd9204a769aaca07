//! The spin of the cue ball before an impact, as far as it is known.

use crate::physics::ball::Vec3;

/// The cue ball's spin before the impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spin {
    /// The ball slides without any spin.
    Stun,
    /// The ball rolls on the cloth without slip.
    NaturalRoll,
    /// The spin was measured: in the table frame for `impacts` and tracks, in the collision frame for `angles`.
    Measured {
        /// The angular velocity, rad/s.
        spin: Vec3,
        /// The standard deviation of each component, rad/s; a component without one counts as exact.
        sd: [Option<f64>; 3],
    },
    /// Nothing is known of the spin.
    Unknown,
}
