//! Why a minimisation stopped.
use std::fmt;

/// Why a minimisation stopped: an outcome, not an error. The solution beside it is the best feasible point
/// found in every case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Termination {
    /// The residuals are zero, or no larger than the rounding of the parameters makes them.
    ZeroResidual,
    /// The residuals are orthogonal to every direction the constraints leave open: the relative offset
    /// ‖J s‖/‖r‖ of Bates and Watts, s the Gauss–Newton step, is within the tolerance.
    Orthogonal,
    /// The last full step changed no parameter by more than its rounding.
    SmallStep,
    /// What a full step promises to gain is lost in the rounding of the sum of squares, and the steps
    /// have stopped getting shorter: the minimum to the digits that the residuals have.
    SmallReduction,
    /// The iteration limit was reached first.
    MaxIterations,
    /// No step, however short, gave the reduction that the Jacobian promises: the Jacobian is not that
    /// of the residuals, or they are noisy or not smooth here.
    Stalled,
    /// The residuals or their Jacobian cannot be evaluated, or are not finite, right next to the
    /// solution in the direction that reduces them.
    NotFinite,
}

impl Termination {
    /// Whether the solution is a (local) minimum.
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
        f.write_str(match self {
            Self::ZeroResidual => "converged: the residuals are zero to rounding",
            Self::Orthogonal => "converged: the residuals are orthogonal to the Jacobian",
            Self::SmallStep => "converged: the step changes no parameter",
            Self::SmallReduction => "converged: the sum of squares cannot be reduced further",
            Self::MaxIterations => "not converged: iteration limit reached",
            Self::Stalled => "not converged: no step gives the reduction that the Jacobian promises",
            Self::NotFinite => "not converged: the residuals are not finite beyond this point",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_words_agree_with_converged() {
        for termination in [
            Termination::ZeroResidual,
            Termination::Orthogonal,
            Termination::SmallStep,
            Termination::SmallReduction,
            Termination::MaxIterations,
            Termination::Stalled,
            Termination::NotFinite,
        ] {
            assert_eq!(termination.to_string().starts_with("converged"), termination.converged());
        }
    }
}
