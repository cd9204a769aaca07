//! Noises and leverages of the numbers of a table.

use nalgebra::DVector;

use super::block::{Pool, RowsBlock};
use crate::measurement::observable::Observable;
use crate::problem::film::dual::gradient;
use crate::problem::problem::{Evaluation, Problem, Reduced, Sample};
use crate::problem::sums::NoiseSums;
use crate::problem::uncertainty::Estimates;

/// Degrees of freedom below which a noise is not estimated.
const LEAST_DOF: f64 = 0.5;

/// Noise over its least value at which residuals vanish.
const VANISHES: f64 = 1.0 + 1e-6;

/// Noise of the numbers of a table whose errors are not stated.
#[derive(Clone, Debug)]
pub(crate) struct TableNoise {
    pub(crate) observables: Vec<Observable>,
    /// Standard deviation, SI or radians.
    pub(crate) sd: f64,
    /// Standard deviation of the rounding of the columns, which is the least that `sd` can be.
    pub(crate) rounding: f64,
    /// Sum of their squared residuals over the variance.
    pub(crate) square: f64,
    /// Numbers less what they spend on unknowns.
    pub(crate) dof: f64,
    /// Whether residuals or a rounding show its size.
    pub(crate) is_known: bool,
}

/// Returns what is known of the noises that were estimated.
pub(super) fn list_noises(problem: &Problem, at: &Evaluation, estimates: &Estimates) -> Vec<TableNoise> {
    let (Some(rows), Some(reduced)) = (problem.rows(), at.eliminate(problem, 0.0)) else { return Vec::new() };
    let spent = rows.leverages(at, (&reduced, estimates), (0, &problem.samples[0]));
    let sums = at.noises(0);
    let of_pool = |(which, pool): (usize, &Pool)| {
        let (NoiseSums { count, weighted, .. }, sd) = (sums[which], rows.noises[which].sd);
        let dof = count - spent[which];
        TableNoise {
            observables: pool.observables.clone(),
            sd,
            rounding: pool.rounding,
            square: weighted,
            dof,
            is_known: dof >= LEAST_DOF && (pool.rounding > 0.0 || sd > VANISHES * pool.least()),
        }
    };
    rows.pools.iter().enumerate().map(of_pool).collect()
}

impl RowsBlock {
    /// Returns the part of each noise that its numbers spend on unknowns: the sum of their
    /// leverages.
    pub(crate) fn leverages(
        &self,
        at: &Evaluation,
        (reduced, estimates): (&Reduced, &Estimates),
        (number, sample): (usize, &Sample),
    ) -> Vec<f64> {
        let mut sums = vec![0.0; self.noises.len()];
        if sums.is_empty() {
            return sums;
        }
        let shared = sample.gather(&at.state.shared);
        for (i, own) in at.state.own[number].iter().enumerate() {
            let Some(predicted) = self.predict(i, own, &shared) else { continue };
            let weight = at.shots[number][i].weight();
            for (residual, row) in predicted.rows.iter().zip(&self.shots[i].rows) {
                let Some(noise) = row.noise else { continue };
                let by = DVector::from_column_slice(gradient(residual).as_slice());
                let variance = estimates.variance(reduced, (number, i), &by);
                sums[noise] += weight * variance;
            }
        }
        sums
    }
}
