//! Choices of fits and comparisons that a test can afford: those of the program also compare other models, which takes ten times as long.

use caromfit::physics::collision::Fidelity;
use caromfit::{compare, fit};

/// The exact solution, with profiles.
pub fn of_fit() -> fit::Options {
    fit::Options { fidelity: Fidelity::Full.into(), depth: fit::Depth::Intervals, ..fit::Options::default() }
}

/// The exact solution.
pub fn of_comparison() -> compare::Options {
    compare::Options { fidelity: Fidelity::Full.into(), ..compare::Options::default() }
}
