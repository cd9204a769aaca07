//! How many shots, and of which kinds.

use schemars::JsonSchema;
use serde::Serialize;

use super::information::{Information, covariance, std_errors};
use super::{ByCoefficient, Expected, Kind, by_coefficient};
use crate::measurement::parameter::Parameter;
use crate::simulate::MAX_SHOTS;

/// Rounds after which the sum of all shots is within 0.1 % of the least (four designs).
const ROUNDS: usize = 300;

/// Factors to the shots that a search found, which may be a little too few.
const SPARE: [f64; 4] = [1.0, 1.001, 1.01, 1.1];

/// A mixture of shots with the fewest that reach what is wanted.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct FewestShots {
    /// The parameter, or all.
    r#for: &'static str,
    /// Number of shots.
    total: u64,
    /// Number of shots of each kind, the most first.
    shots: Vec<CountedShots>,
    /// Standard errors of the mixture.
    std_error: ByCoefficient<Option<f64>>,
}

/// Shots of a kind.
#[derive(Clone, Debug, Serialize, JsonSchema)]
struct CountedShots {
    /// Name of the kind.
    kind: String,
    /// Number of shots.
    shots: u64,
}

/// Returns the largest variance over what is wanted.
fn excess(information: &Information, wanted: &[Option<f64>; 3]) -> f64 {
    let both = std_errors(information).into_iter().zip(wanted);
    let variances =
        both.filter_map(|(error, wanted)| Some((error.unwrap_or(f64::INFINITY) / (*wanted)?).powi(2)));
    variances.fold(0.0, f64::max)
}

/// Returns the number of shots of one kind that reach all that is wanted, if there is one.
pub(super) fn needed(information: &Information, wanted: &[Option<f64>; 3]) -> Option<u64> {
    Some(fewest_shots(std::slice::from_ref(information), wanted)?.iter().map(|(_, shots)| shots).sum())
}

/// Returns the mixtures for each wanted parameter, and for all wanted ones that are determined.
pub(super) fn mixtures(expected: &Expected, kinds: &[Kind]) -> Vec<FewestShots> {
    let informations: Vec<Information> = kinds.iter().map(|kind| kind.information).collect();
    let errors = std_errors(&informations.iter().sum());
    let mixture = |parameter: Option<Parameter>| {
        let is_meant = |i: usize| errors[i].is_some() && parameter.is_none_or(|p| p as usize == i);
        let wanted = std::array::from_fn(|i| expected.wanted[i].filter(|_| is_meant(i)));
        let shots = fewest_shots(&informations, &wanted)?;
        let named =
            |(i, shots): &(usize, u64)| CountedShots { kind: kinds[*i].planned.name.clone(), shots: *shots };
        Some(FewestShots {
            r#for: parameter.map_or("all", Parameter::name),
            total: shots.iter().map(|(_, shots)| shots).sum(),
            std_error: by_coefficient(std_errors(&sum(&informations, &shots))),
            shots: shots.iter().map(named).collect(),
        })
    };
    Parameter::COEFFICIENTS.map(Some).into_iter().chain([None]).filter_map(mixture).collect()
}

/// Returns the information of numbers of shots.
fn sum(informations: &[Information], shots: &[(usize, u64)]) -> Information {
    shots.iter().map(|(index, n)| informations[*index] * *n as f64).sum()
}

/// Returns the index and the number of shots of each that is used, the most first: the real-valued
/// optimum, rounded up, without the shots that are then not needed.
fn fewest_shots(informations: &[Information], wanted: &[Option<f64>; 3]) -> Option<Vec<(usize, u64)>> {
    let relaxed = least_shots(informations, wanted)?;
    let is_enough = |shots: &[(usize, u64)]| excess(&sum(informations, shots), wanted) <= 1.0;
    let rounded_up = |spare: f64| -> Vec<(usize, u64)> {
        relaxed.iter().map(|n| (spare * n).ceil() as u64).enumerate().collect()
    };
    let mut shots = SPARE.map(rounded_up).into_iter().find(|shots| is_enough(shots))?;
    shots.sort_by_key(|(_, n)| *n);
    for i in 0..shots.len() {
        while shots[i].1 > 0 && is_enough(&shots) {
            shots[i].1 -= 1;
        }
        shots[i].1 += u64::from(!is_enough(&shots));
    }
    shots.retain(|(_, n)| *n > 0);
    shots.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    Some(shots)
}

/// Returns the real numbers n_k of shots with the least sum whose variances reach what is wanted,
/// V_jj ≤ t_j with V⁻¹ = Σ n_k I_k + prior; `None` without such numbers.
///
/// There, λ_j ≥ 0 exist with Σ_j λ_j (V I_k V)_jj = 1 for all n_k > 0 and at most 1 for the others,
/// λ_j = 0 if V_jj < t_j. Each n_k is multiplied by the root of its sum and each λ_j by the
/// root of V_jj/t_j until both hold (multiplicative algorithm: Silvey, Titterington and Torsney
/// 1978, Commun. Stat. A 7, 1379).
fn least_shots(informations: &[Information], wanted: &[Option<f64>; 3]) -> Option<Vec<f64>> {
    let targets = wanted.iter().enumerate().filter_map(|(j, wanted)| Some((j, (*wanted)?.powi(2))));
    let mut targets: Vec<(usize, f64, f64)> =
        targets.map(|(j, target)| (j, target, target.recip())).collect();
    let mut shots = vec![1.0; informations.len()];
    for _ in 0..ROUNDS {
        let weighted = shots.iter().zip(informations).map(|(n, information)| information * *n);
        let covariance = covariance(&weighted.sum()).map(|value| if value.is_nan() { 0.0 } else { value });
        let mut useful = vec![0.0; shots.len()];
        for (j, target, weight) in &mut targets {
            let column = covariance.column(*j);
            *weight *= (column[*j] / *target).sqrt();
            for (useful, information) in useful.iter_mut().zip(informations) {
                *useful += *weight * column.dot(&(information * column));
            }
        }
        shots.iter_mut().zip(useful).for_each(|(n, useful)| *n *= useful.max(0.0).sqrt());
    }
    let total: f64 = shots.iter().sum();
    (!targets.is_empty() && total <= MAX_SHOTS as f64).then_some(shots)
}
