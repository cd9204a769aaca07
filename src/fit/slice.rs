//! A part of the least-squares problem of a search.

use crate::fit::samples::Search;
use crate::likelihood::problem::Problem;
use crate::likelihood::sample::Unknown;
use crate::likelihood::whitening::Whitening;
use crate::numerics::least_squares::Constraints;

/// Within some constraints, with the weights of the minimum.
#[derive(Clone)]
pub(crate) struct Slice<'a> {
    pub search: &'a Search<'a>,
    pub free: &'a [Unknown],
    pub constraints: Constraints,
    pub whitening: &'a [Whitening],
}

impl<'a> Slice<'a> {
    pub(in crate::fit) fn problem(&self) -> Problem<'a> {
        self.search.problem(self.free, self.whitening)
    }

    /// The same with some of its unknowns held.
    pub(in crate::fit) fn holding(&self, held: &[(usize, f64)]) -> Self {
        let mut slice = self.clone();
        for &(column, value) in held {
            slice.constraints.lower[column] = value;
            slice.constraints.upper[column] = value;
        }
        slice
    }
}
