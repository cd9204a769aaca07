//! What the tests of these files share.

use nalgebra::DVector;

/// Rounding of a handful of operations on numbers of order 1.
pub const ROUNDING: f64 = 1e-14;

pub fn vector(values: &[f64]) -> DVector<f64> {
    DVector::from_row_slice(values)
}
