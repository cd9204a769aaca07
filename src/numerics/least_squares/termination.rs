//! Why a minimisation ended.
use std::fmt;

/// Why a minimisation ended: an outcome, not an error. The solution is the best point met.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Termination {
    /// The residuals are zero, or no larger than the rounding of the parameters makes them.
    ZeroResidual,
    /// The residuals are orthogonal to every direction that the bounds leave open: the relative
    /// offset ‖J s‖/‖r‖ of Bates and Watts, s the Gauss–Newton step, is within the tolerance.
    Orthogonal,
    /// The last full step changed no parameter by more than its rounding.
    SmallStep,
    /// The gain that a full step promises is below the rounding of the sum of squares, and the
    /// steps have stopped becoming shorter.
    SmallReduction,
    /// The iteration limit was reached first.
    MaxIterations,
    /// No step, however short, gives the reduction that the Jacobian promises: the Jacobian is
    /// wrong, or the residuals are noisy or not smooth here.
    Stalled,
    /// The residuals or their Jacobian are not finite right next to the solution, in the direction
    /// that reduces them.
    NotFinite,
}

impl Termination {
    /// Returns whether the solution is a (local) minimum.
    #[must_use]
    pub fn converged(&self) -> bool {
        match self {
            Self::ZeroResidual | Self::Orthogonal | Self::SmallStep | Self::SmallReduction => true,
            Self::MaxIterations | Self::Stalled | Self::NotFinite => false,
        }
    }
}

impl fmt::Display for Termination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reason = match self {
            Self::ZeroResidual => "the residuals are zero to rounding",
            Self::Orthogonal => "the residuals are orthogonal to the Jacobian",
            Self::SmallStep => "the step changes no parameter",
            Self::SmallReduction => "the sum of squares cannot be reduced further",
            Self::MaxIterations => "iteration limit reached",
            Self::Stalled => "no step gives the reduction that the Jacobian promises",
            Self::NotFinite => "the residuals are not finite beyond this point",
        };
        let outcome = if self.converged() { "converged" } else { "not converged" };
        write!(f, "{outcome}: {reason}")
    }
}
