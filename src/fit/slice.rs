//! A part of the least-squares problem of a search.

use nalgebra::DVector;

use crate::fit::samples::Search;
use crate::likelihood::problem::{Best, Problem};
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
    /// Where its shots are at a point nearby, if that is known.
    best: Vec<Best>,
}

impl<'a> Slice<'a> {
    pub(crate) fn new(
        search: &'a Search<'a>,
        free: &'a [Unknown],
        constraints: Constraints,
        whitening: &'a [Whitening],
    ) -> Self {
        Self { search, free, constraints, whitening, best: Vec::new() }
    }

    /// For points near this one.
    pub(in crate::fit) fn near(mut self, x: &DVector<f64>) -> Self {
        self.best = self.problem().found_at(x);
        self
    }

    pub(in crate::fit) fn problem(&self) -> Problem<'a> {
        self.search.problem(self.free, self.whitening).beginning(&self.best)
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
