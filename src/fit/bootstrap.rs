//! The bootstrap over shots, on request: how the estimates scatter when shots are drawn again, with
//! replacement, from those that were measured. It does not rest on the model or the stated noise.
//!
//! - Efron, B. (1987). Better bootstrap confidence intervals. J. Am. Stat. Assoc. 82, 171–185.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::measurement::parameter::Parameter;
use crate::name::ByName;
use crate::problem::{Id, ShotInfluence, Solution};

/// Intervals from resampled shots.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Bootstrap {
    /// Number of samples.
    pub(crate) replicates: usize,
    /// Seed of the random numbers.
    pub(crate) seed: u64,
    /// Number of samples that could not be fitted or do not determine a parameter; they are left
    /// out.
    pub(crate) failed: usize,
    /// Results by the name of the parameter, in its unit.
    pub(crate) parameters: ByName<Resampled>,
}

/// A parameter over the samples of a bootstrap.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Resampled {
    /// Standard deviation of the estimates.
    pub(crate) std_error: f64,
    /// Mean of the estimates less the estimate of all shots.
    pub(crate) bias: f64,
    /// 95 % interval between percentiles of the estimates: lower and upper end.
    #[serde(rename = "interval_95_percentile")]
    #[schemars(with = "[Option<f64>; 2]")]
    pub(crate) percentile: [f64; 2],
    /// 95 % interval, bias-corrected and accelerated: lower and upper end.
    #[serde(rename = "interval_95_bca")]
    #[schemars(with = "[Option<f64>; 2]")]
    pub(crate) bca: [f64; 2],
}

/// Draws and fits `replicates` samples of the shots, in parallel; `done` is called after each.
pub(in crate::fit) fn draw(
    solution: &Solution,
    free: &[Parameter],
    (replicates, seed): (usize, u64),
    done: &(dyn Fn() + Sync),
) -> Bootstrap {
    let ids: Vec<Id> = free.iter().map(|parameter| Id::from(*parameter)).collect();
    let fit_replicate = |number: usize| {
        let values = solution.resampled(&ids, (seed, number as u64 + 1));
        done();
        values
    };
    let all: Vec<_> = (0..replicates).into_par_iter().map(fit_replicate).collect();
    let failed = all.iter().filter(|x| x.is_none()).count();
    let influence = solution.influence();
    let parameters = free.iter().zip(&ids).enumerate().filter_map(|(column, (parameter, id))| {
        let mut values: Vec<f64> = all.iter().flatten().map(|x| x[column]).collect();
        values.sort_by(f64::total_cmp);
        let change = |shot: &Option<ShotInfluence>| shot.as_ref().map_or(0.0, |shot| shot.change(*id));
        let jackknife: Vec<f64> = influence.iter().map(change).collect();
        Some((parameter.name().to_owned(), summary(&values, solution.value(*id), &jackknife)?))
    });
    Bootstrap { replicates, seed, failed, parameters: parameters.collect() }
}

/// Summarises sorted replicates; `None` with fewer than two.
fn summary(sorted: &[f64], estimate: f64, jackknife: &[f64]) -> Option<Resampled> {
    let n = sorted.len() as f64;
    if sorted.len() < 2 {
        return None;
    }
    let mean = sorted.iter().sum::<f64>() / n;
    let std_error = (sorted.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let percentile = [0.025, 0.975].map(|part| quantile(sorted, part));
    let normal = Normal::standard();
    let (below, ties) = sorted.iter().fold((0.0, 0.0), |(below, ties), v| {
        (below + f64::from(u8::from(*v < estimate)), ties + f64::from(u8::from(*v == estimate)))
    });
    // if all lie on one side, the correction would be infinite
    let part = ((below + 0.5 * ties) / n).clamp(0.5 / n, 1.0 - 0.5 / n);
    let z0 = normal.inverse_cdf(part);
    let centre = jackknife.iter().sum::<f64>() / jackknife.len().max(1) as f64;
    let moment = |power: i32| jackknife.iter().map(|v| (centre - v).powi(power)).sum::<f64>();
    let (second, third) = (moment(2), moment(3));
    let acceleration = if second > 0.0 { third / (6.0 * second.powf(1.5)) } else { 0.0 };
    let bca = [0.025, 0.975].map(|part| {
        let z = z0 + normal.inverse_cdf(part);
        quantile(sorted, normal.cdf(z0 + z / (1.0 - acceleration * z)))
    });
    Some(Resampled { std_error, bias: mean - estimate, percentile, bca })
}

/// Interpolated between neighbours.
fn quantile(sorted: &[f64], part: f64) -> f64 {
    let at = part.clamp(0.0, 1.0) * (sorted.len() - 1) as f64;
    let (below, above) = (at.floor() as usize, at.ceil() as usize);
    sorted[below] + (at - at.floor()) * (sorted[above] - sorted[below])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symmetric_replicates_need_no_correction() {
        let values: Vec<f64> = (-500..=500).map(|i| f64::from(i) / 500.0).collect();
        let result = summary(&values, 0.0, &[-0.1, 0.1, 0.0]).unwrap();
        assert!((result.percentile[1] - 0.95).abs() < 1e-12 && result.bias.abs() < 1e-12);
        assert!((result.bca[0] + 0.95).abs() < 1e-9 && (result.bca[1] - 0.95).abs() < 1e-9);
    }

    #[test]
    fn a_skewed_jackknife_moves_the_interval() {
        let values: Vec<f64> = (-500..=500).map(|i| f64::from(i) / 500.0).collect();
        // a shot that raises the estimate much: leaving it out lowers it, and the interval reaches
        // further up
        let result = summary(&values, 0.0, &[-0.5, 0.1, 0.1, 0.1, 0.1, 0.1]).unwrap();
        assert!(result.bca[0] > result.percentile[0] && result.bca[1] > result.percentile[1], "{result:?}");
    }
}
