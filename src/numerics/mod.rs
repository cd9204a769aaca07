//! Numbers and numerical methods that know no balls.
#[cfg(feature = "fit")]
pub mod bounded_step;
#[cfg(feature = "fit")]
pub(crate) mod dense;
pub(crate) mod dormand_prince;
#[cfg(feature = "fit")]
pub mod least_squares;
#[cfg(feature = "fit")]
pub(crate) mod number;

/// Median absolute deviation of a normal distribution, in units of its standard deviation.
pub(crate) const NORMAL_MEDIAN: f64 = 0.6745;

/// Standard errors from which on a deviation is not chance: probability 6e-7.
pub(crate) const SIGNIFICANT: f64 = 5.0;

/// Relative difference of numbers that are equal but for roundings.
pub(crate) const EXACT: f64 = 1e-12;

/// Returns the median: the upper of both middle values if their number is even, NaN without values.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { f64::NAN } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// Returns the same angle within (−π, π], rad.
pub(crate) fn wrap(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let turned = angle.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}

/// Returns the standard error of a median over that of a mean, of many normal numbers.
pub(crate) fn median_error() -> f64 {
    std::f64::consts::FRAC_PI_2.sqrt()
}
