//! Shots that fit no collision that fits the others.

use super::Rejected;

/// χ²/dof over the usual one, with the noise that is usual of the other shots: a shot whose noise is estimated from its own
/// residuals hides a misfit in it. Below this the noise of a shot may well be twice that of the others.
pub(super) const WORSE: f64 = 6.0;

/// By chance less often than this.
pub(super) const NO_CHANCE: f64 = 1e-9;

/// At most this part of the shots: if there are more, the model may be wrong and not the shots…
pub(super) const FEW: f64 = 0.15;
/// …unless the others, without them, fit as well as their noise lets them.
pub(super) const MINORITY: f64 = 0.4;

/// What a collision adds to χ², of each number that it ties: about 1 where only noise does.
pub(super) const POOR: f64 = 3.0;

/// Rounds of weighting until gross errors no longer count.
pub(super) const ROUNDS: usize = 40;
/// A shot that is left out.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Odd {
    /// Its place among the shots.
    pub place: usize,
    /// Why it is left out.
    pub reason: String,
}

impl Odd {
    pub(crate) fn rejected(&self, shot: &str) -> Rejected {
        Rejected { shot: shot.to_owned(), reason: self.reason.clone() }
    }
}
