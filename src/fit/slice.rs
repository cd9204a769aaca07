//! A part of the least-squares problem of a search.

use nalgebra::DVector;

use crate::fit::samples::Search;
use crate::likelihood::problem::{Best, Problem};
use crate::likelihood::sample::Unknown;
use crate::likelihood::whitening::Whitening;
use crate::numerics::least_squares::Bounds;

/// The problem within some bounds, with the weights of the minimum.
#[derive(Clone)]
pub(crate) struct Slice<'a> {
    pub search: &'a Search<'a>,
    pub free: &'a [Unknown],
    pub bounds: Bounds,
    pub whitening: &'a [Whitening],
    /// Columns that take the value of the first of them, which alone is minimised over; empty if all differ.
    equal: Vec<usize>,
    /// Where its shots are at a point nearby, if that is known.
    best: Vec<Best>,
}

impl<'a> Slice<'a> {
    pub(crate) fn new(
        search: &'a Search<'a>,
        free: &'a [Unknown],
        bounds: Bounds,
        whitening: &'a [Whitening],
    ) -> Self {
        Self { search, free, bounds, whitening, equal: Vec::new(), best: Vec::new() }
    }

    /// For points near this one.
    pub(in crate::fit) fn near(mut self, x: &DVector<f64>) -> Self {
        self.best = self.problem().found_at(x);
        self
    }

    pub(in crate::fit) fn problem(&self) -> Problem<'a> {
        self.search.problem(self.free, self.whitening).with_equal(&self.equal).beginning(&self.best)
    }

    /// Returns the problem with one value for several columns, within the bounds of all of them.
    pub(crate) fn with_equal(mut self, columns: &[usize]) -> Self {
        if let Some(&first) = columns.first() {
            for &column in columns {
                self.bounds.lower[first] = self.bounds.lower[first].max(self.bounds.lower[column]);
                self.bounds.upper[first] = self.bounds.upper[first].min(self.bounds.upper[column]);
            }
        }
        self.equal = columns.to_vec();
        self
    }

    /// The same with some of its unknowns held.
    pub(in crate::fit) fn holding(&self, held: &[(usize, f64)]) -> Self {
        let mut slice = self.clone();
        for &(column, value) in held {
            slice.bounds.lower[column] = value;
            slice.bounds.upper[column] = value;
        }
        slice
    }
}
