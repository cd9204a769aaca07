//! The noise of observables without stated errors, of all samples of a data set together.

use super::Sample;
use super::layout::Layout;
use crate::fit::robust::Losses;
use crate::likelihood::prediction::difference;
use crate::likelihood::whitening::{EstimatedSd, Whitening};
use crate::measurement::observable::Observable;

/// An estimated standard deviation below this part of its value is an exact fit.
const EXACT: f64 = 1e-9;

/// Of one observable of a data set.
#[derive(Clone, Copy)]
struct Sum {
    observable: Observable,
    /// Σd², each with the square of its shot's weight less what that takes of normal errors.
    square: f64,
    /// What the errors of the inputs add to Σd².
    from_inputs: f64,
    count: usize,
}

/// The sums of each data set.
fn sums(
    samples: &[Sample],
    layout: &Layout,
    x: &[f64],
    whitening: &[Whitening],
    scale: &dyn Fn(usize, usize) -> f64,
) -> Vec<Vec<Sum>> {
    let plain = Whitening::none();
    let datasets = samples.iter().map(|sample| sample.dataset + 1).max().unwrap_or(0);
    let mut all: Vec<Vec<Sum>> = vec![Vec::new(); datasets];
    for (i, sample) in samples.iter().enumerate() {
        let at = layout.coefficients(i, x);
        let whitening = whitening.get(i).unwrap_or(&plain);
        for (number, shot) in sample.fitted.iter().enumerate() {
            if shot.plan.rows().iter().all(|row| row.measured.sd.is_some()) {
                continue;
            }
            let predicted = whitening.predict(number, &shot.plan, &sample.model, &at);
            let Ok(prediction) = predicted else { continue };
            let scale = scale(i, number);
            for (row, measurement) in shot.plan.rows().iter().enumerate() {
                if measurement.measured.sd.is_some() {
                    continue;
                }
                let observable = measurement.observable;
                let d = difference(observable, prediction.values[row], measurement.measured.value);
                let g = prediction.by_inputs.row(row).transpose();
                let own = &mut all[sample.dataset];
                let index = own.iter().position(|known| known.observable == observable);
                let index = index.unwrap_or_else(|| {
                    own.push(Sum { observable, square: 0.0, from_inputs: 0.0, count: 0 });
                    own.len() - 1
                });
                own[index].square += scale * d * d;
                own[index].from_inputs += g.component_mul(&g).dot(shot.plan.variance_in());
                own[index].count += 1;
            }
        }
    }
    all
}

/// Root mean squares of the residuals where a fit starts, for each sample.
pub(super) fn first(samples: &[Sample], layout: &Layout, x: &[f64]) -> Vec<EstimatedSd> {
    let sd = |sum: &Sum| if sum.square > 0.0 { (sum.square / sum.count as f64).sqrt() } else { 1.0 };
    let of_dataset: Vec<EstimatedSd> = sums(samples, layout, x, &[], &|_, _| 1.0)
        .iter()
        .map(|sums| sums.iter().map(|sum| (sum.observable, sd(sum))).collect())
        .collect();
    samples.iter().map(|sample| of_dataset[sample.dataset].clone()).collect()
}

/// σ² = Σd²/(n − p) less what the inputs add, the `parameters` p counted to the observations in proportion. With a
/// robust loss Σw²d² instead, less what the weights take (Huber 1964, proposal 2). Returns the largest relative change.
pub(super) fn reweigh(
    samples: &[Sample],
    layout: &Layout,
    x: &[f64],
    whitening: &[Whitening],
    sds: &mut [EstimatedSd],
    parameters: usize,
    robust: Option<(&[&Losses], &[Vec<f64>])>,
) -> f64 {
    if sds.iter().all(Vec::is_empty) {
        return 0.0;
    }
    let scale = |sample: usize, shot: usize| {
        robust.map_or(1.0, |(losses, weights)| {
            weights[sample][shot].powi(2) / losses[sample].of(&samples[sample].fitted[shot]).consistency
        })
    };
    let all = sums(samples, layout, x, whitening, &scale);
    let total: usize = samples.iter().flat_map(|s| &s.fitted).map(|shot| shot.plan.rows().len()).sum();
    let left = 1.0 - parameters as f64 / total as f64;
    let mut changed = 0.0_f64;
    for (sample, sds) in samples.iter().zip(sds) {
        for (observable, sd) in sds.iter_mut() {
            let sum = all[sample.dataset].iter().find(|known| known.observable == *observable);
            let Some(Sum { square, from_inputs, count, .. }) = sum else { continue };
            let n = *count as f64;
            let variance = square / (n * left).max(f64::MIN_POSITIVE) - from_inputs / n;
            let new = variance.max((EXACT * *sd).powi(2)).sqrt();
            changed = changed.max((new / *sd - 1.0).abs());
            *sd = new;
        }
    }
    changed
}
