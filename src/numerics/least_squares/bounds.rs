//! Bounds of the parameters.
use nalgebra::DVector;

use super::{OptimiseError, expect_length};

/// The box lower ≤ x ≤ upper.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    /// n lower bounds; −∞ for an unbounded parameter.
    pub lower: DVector<f64>,
    /// n upper bounds; ∞ for an unbounded parameter. A parameter whose bounds are equal is fixed.
    pub upper: DVector<f64>,
}

/// Position of a parameter within its bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Activity {
    /// Between its bounds.
    Free,
    /// Exactly at its lower bound, or fixed.
    AtLower,
    /// Exactly at its upper bound.
    AtUpper,
}

impl Bounds {
    /// Returns bounds that leave `n` parameters any value.
    #[must_use]
    pub fn none(n: usize) -> Self {
        Self::new(DVector::repeat(n, f64::NEG_INFINITY), DVector::repeat(n, f64::INFINITY))
    }

    /// Returns the box from `lower` to `upper`, which is checked when a minimisation starts.
    #[must_use]
    pub fn new(lower: DVector<f64>, upper: DVector<f64>) -> Self {
        Self { lower, upper }
    }

    /// Returns the point of the box nearest to `x`.
    #[must_use]
    pub fn clamp(&self, x: &DVector<f64>) -> DVector<f64> {
        x.zip_zip_map(&self.lower, &self.upper, |x, lower, upper| x.max(lower).min(upper))
    }

    /// Returns the position of each parameter of `x` within its bounds.
    #[must_use]
    pub fn activity(&self, x: &DVector<f64>) -> Vec<Activity> {
        let position = |j: usize| match x[j] {
            value if value == self.lower[j] => Activity::AtLower,
            value if value == self.upper[j] => Activity::AtUpper,
            _ => Activity::Free,
        };
        (0..x.len()).map(position).collect()
    }

    pub(super) fn contain(&self, x: &DVector<f64>) -> bool {
        (0..x.len()).all(|j| self.lower[j] <= x[j] && x[j] <= self.upper[j])
    }

    /// Checks that `start` is finite and lies within the bounds.
    pub(super) fn check(&self, start: &DVector<f64>) -> Result<(), OptimiseError> {
        expect_length("lower bounds", start.len(), self.lower.len())?;
        expect_length("upper bounds", start.len(), self.upper.len())?;
        for (index, &value) in start.iter().enumerate() {
            let (lower, upper) = (self.lower[index], self.upper[index]);
            if !(value.is_finite() && lower <= value && value <= upper) {
                return Err(OptimiseError::Start { index, value, lower, upper });
            }
        }
        Ok(())
    }
}
