//! Inputs that describe no collision.

/// The reason why an input describes no collision.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NotACollision {
    /// A number that is out of its range or not finite.
    #[error("{name} is {value}; expected {expected}")]
    OutOfRange {
        /// The name of the number, as in the columns of a file of cases: `mu`, `radius_m`,
        /// `omega_x`, …
        name: &'static str,
        /// The number, in the SI unit of its name.
        value: f64,
        /// The range in words.
        expected: &'static str,
    },
    /// A line of centres (x, y), table frame, without length or not finite.
    #[error("the line of centres ({0}, {1}) has no direction; expected a finite vector other than 0")]
    NoDirection(f64, f64),
    /// A cue ball that does not move towards the object ball; with its velocity along the line of
    /// centres, m/s.
    #[error(
        "the cue ball does not approach: its velocity along the line of centres is {} m/s; expected more than 0", .0 + 0.0
    )]
    NotApproaching(f64),
    /// A μ_s that is negative or not below the second number, 2 + ν of equal balls: from there on
    /// 2β_z ≤ 0, and the cloth would drive the slip that it brakes.
    #[error("mu_s is {0}; expected 0 or more, below {1}")]
    MuSOutOfRange(f64, f64),
    /// A μ·μ_s that is with topspin not below the second number, 1 + m_object/m_cue: the impact would
    /// never end, as dv_x/dq ≥ 1 + m_object/m_cue − μ_s μ.
    #[error(
        "mu·mu_s is {0}; expected less than {1} with topspin (1 + object ball's mass over cue ball's), or the balls jam"
    )]
    Jams(f64, f64),
    /// An integration that takes too many steps: a contact oscillates as often as 1/√κ.
    #[error(
        "the integration did not reach the end of the impact at a tolerance of {tolerance:e} and a kappa of {kappa}; expected a larger tolerance or kappa, or the fidelity full (rigid along the surface)"
    )]
    NotIntegrated {
        /// The tolerance of the model.
        tolerance: f64,
        /// The tangential compliance κ.
        kappa: f64,
    },
}
