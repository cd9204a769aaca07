//! Numerical methods that know no balls.
#[cfg(feature = "fit")]
pub mod least_squares;
#[cfg(feature = "fit")]
pub(crate) mod optimal_design;
pub(crate) mod quadrature;
#[cfg(feature = "fit")]
pub(crate) mod small_products;

/// The median; of an even number of values the upper of both in the middle, of none NaN.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { f64::NAN } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}
