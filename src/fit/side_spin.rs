//! Side spins that nobody saw are integrated over, not only minimised over.
//!
//! With V = Σ ln(σ²/p) of [`Problem::log_volume`](crate::likelihood::problem::Problem::log_volume), −2 log L is χ² + V, of which
//! least squares minimise the first. With r′ = r + Jv, H = JᵀJ and Hv = ½∂V/∂θ, the minimum of |r′|² has Jᵀr + ½∂V/∂θ = 0: that of
//! both. Jv is taken where the last round of weighting ended.
//!
//! - Tierney, L. and Kadane, J. B. (1986), J. Am. Stat. Assoc. 81, 82–86: Laplace's method.

use nalgebra::DVector;

use super::minimum::covariance;
use super::noise;
use super::noise::Group;
use super::samples::Search;
use crate::likelihood::sample::Unknown;
use crate::likelihood::whitening::Whitening;
use crate::numerics::least_squares::{Activity, Solution};

/// Derivatives of V are taken over this part of a standard error: it is smooth over far more.
const STEP: f64 = 0.1;

/// The weights of a round, with Jv of the solution of the last one.
pub(super) fn integrated_over(
    search: &Search,
    free: &[Unknown],
    (whitening, groups): (Vec<Whitening>, &[Group]),
    last: &Solution,
) -> Vec<Whitening> {
    let Some(shift) = shift(search, free, (&whitening, groups), last) else { return whitening };
    let mut rest = shift.as_slice();
    let shifted = |(mut whitening, sample): (Whitening, &crate::likelihood::sample::Sample)| {
        let (own, others) = rest.split_at(sample.rows());
        rest = others;
        whitening.shift = own.to_vec();
        whitening
    };
    whitening.into_iter().zip(&search.samples).map(shifted).collect()
}

/// Jv; `None` where the unknowns are not determined.
fn shift(
    search: &Search,
    free: &[Unknown],
    (whitening, groups): (&[Whitening], &[Group]),
    last: &Solution,
) -> Option<DVector<f64>> {
    let Solution { x, jacobian, active, .. } = last;
    let noise: Vec<_> =
        search.samples.iter().map(|sample| noise::of_dataset(groups, sample.dataset)).collect();
    // what is at a bound stays there, and what the shots share besides hardly tells of the side spins
    let inside = |column: &usize| active.get(*column).is_none_or(|active| *active == Activity::Free);
    let open: Vec<usize> = (0..x.len()).filter(inside).collect();
    let inverse = covariance(&jacobian.select_columns(&open))?;
    let volume = |column: usize, by: f64| {
        let mut there = x.clone();
        there[column] += by;
        search.problem(free, whitening).log_volume(&there, &noise)
    };
    let half_slope = |(k, column): (usize, &usize)| {
        let step = STEP * inverse[(k, k)].sqrt();
        let slope = (volume(*column, step) - volume(*column, -step)) / (2.0 * step);
        if *column < free.len() && slope.is_finite() { 0.5 * slope } else { 0.0 }
    };
    let slopes = DVector::from_iterator(open.len(), open.iter().enumerate().map(half_slope));
    let v = inverse * slopes;
    let shift = jacobian.select_columns(&open) * v;
    shift.iter().all(|shift| shift.is_finite()).then_some(shift)
}
