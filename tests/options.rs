//! Choices of fits and comparisons that a test can afford: those of the program also draw regions, which takes ten times as long.

use crate::prelude::*;

/// The exact solution, with profiles.
pub fn of_fit() -> Options {
    Options { fidelity: Fidelity::Full.into(), depth: Depth::Intervals, ..Options::default() }
}

/// The exact solution.
pub fn of_comparison() -> compare::Options {
    compare::Options { fidelity: Fidelity::Full.into(), ..compare::Options::default() }
}

/// The first fit of a data set.
pub fn fitted_with(dataset: &Dataset, options: &Options) -> Fit {
    fit::fit(dataset, options).unwrap().remove(0)
}

/// The first fit of a data set, to a depth.
pub fn fitted(dataset: &Dataset, depth: Depth) -> Fit {
    fitted_with(dataset, &Options { depth, ..of_fit() })
}
