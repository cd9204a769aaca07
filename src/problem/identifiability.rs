//! Identifiability: the direction of the unknowns in which χ² changes least, and its part that the
//! data do determine.

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::evaluation::Evaluation;
use super::solution::Solution;
use super::uncertainty::Estimates;
use super::unknowns::{Id, Mode};
use crate::numerics::EXACT;
use crate::words::symbol;

/// Condition number from which on a direction is weakly determined (Belsley, Kuh and Welsch,
/// Regression Diagnostics, 1980, ch. 3).
const WEAK: f64 = 30.0;

/// Part of a direction from which on an unknown belongs to it, and within which relative changes of
/// two unknowns are opposite or equal, so that their product or their ratio stays.
const SHARE: f64 = 0.1;

/// A combination of unknowns that is determined badly: the direction in which χ² changes least.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Combination {
    /// The combination as a sentence, once it is said of a fit.
    pub(crate) words: String,
    /// How each unknown moves along the combination by one standard error, in its unit;
    /// undetermined: 1 for the one that goes farthest.
    #[serde(rename = "one_standard_error_along", serialize_with = "by_name")]
    #[schemars(with = "std::collections::BTreeMap<String, Option<f64>>")]
    pub(crate) terms: Vec<(Id, f64)>,
    /// Whether it is determined, but badly: the condition number is beyond 30.
    pub(crate) weak: bool,
    /// Whether the data do not determine it.
    pub(crate) undetermined: bool,
    /// The combination that is determined instead, or null.
    pub(crate) determined: Option<Determined>,
    /// Roots of the eigenvalues of the normal matrix scaled to a diagonal of 1, the largest first.
    #[serde(skip)]
    pub(crate) singular_values: Vec<f64>,
}

/// A combination of parameters that is determined.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Determined {
    /// The combination, as in the product μ·μ_s.
    pub(crate) name: String,
    /// Its value.
    pub(crate) estimate: f64,
    /// Its standard error.
    #[schemars(with = "Option<f64>")]
    pub(crate) std_error: f64,
}

fn by_name<S: Serializer>(terms: &[(Id, f64)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(terms.iter().map(|(id, step)| (id.name(), step)))
}

impl Solution {
    /// Returns whether the data depend on an unknown of the only sample, if that was free.
    pub(crate) fn is_informed(&self, id: Id) -> bool {
        let is_free = self.problem.unknown(id).mode == Mode::Free;
        is_free && self.at.slopes_by(id as usize)
    }
}

/// Returns the worst determined direction of some unknowns of the only sample, `others` of its
/// columns eliminated; `None` of fewer than two, or if the others are not determined.
pub(crate) fn worst_direction(at: &Evaluation, ids: &[Id], others: Vec<usize>) -> Option<Combination> {
    let (reduced, columns) = (at.reduced()?, ids.iter().map(|id| *id as usize).collect::<Vec<_>>());
    let (matrix, _) = Estimates::of_columns(reduced, others)?.condition(reduced, &columns);
    let norms = matrix.diagonal().map(f64::sqrt);
    let n = ids.len();
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] / (norms[i] * norms[j]));
    if n < 2 || !scaled.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let eigen = scaled.symmetric_eigen();
    let (values, least) = (&eigen.eigenvalues, eigen.eigenvalues.imin());
    // χ² does not change along the direction: products of derivatives, each exact but for roundings
    let is_undetermined = values[least] <= n as f64 * EXACT;
    let direction = eigen.eigenvectors.column(least).component_div(&norms);
    let length = if is_undetermined { direction.amax() } else { values[least].sqrt() };
    let named = (0..n).filter(|i| eigen.eigenvectors[(*i, least)].abs() > SHARE);
    let terms: Vec<(usize, f64)> = named.map(|i| (i, direction[i] / length)).collect();
    // variance of a function of this gradient, without the part that is not determined
    let variance = |gradient: &DVector<f64>| -> f64 {
        let scaled = gradient.component_div(&norms);
        let part = |i: usize| eigen.eigenvectors.column(i).dot(&scaled).powi(2) / values[i];
        (0..n).filter(|i| *i != least || !is_undetermined).map(part).sum()
    };
    let x = |i: usize| at.state.shared[ids[i]];
    let determined = match terms[..] {
        [(i, step_i), (j, step_j)] if x(i) > 0.0 && x(j) > 0.0 => {
            let ratio = (step_i / x(i)) / (step_j / x(j));
            let [first, second] = [i, j].map(|i| symbol(ids[i].name()));
            let determined = |name: String, estimate: f64, by: [f64; 2]| {
                let mut gradient = DVector::zeros(n);
                (gradient[i], gradient[j]) = (by[0], by[1]);
                Determined { name, estimate, std_error: variance(&gradient).sqrt() }
            };
            if (ratio + 1.0).abs() < SHARE {
                Some(determined(format!("the product {first}·{second}"), x(i) * x(j), [x(j), x(i)]))
            } else if (ratio - 1.0).abs() < SHARE {
                let by = [x(j).recip(), -x(i) / x(j).powi(2)];
                Some(determined(format!("the ratio {first}/{second}"), x(i) / x(j), by))
            } else {
                None
            }
        }
        _ => None,
    };
    let mut singular_values: Vec<f64> = values.iter().map(|value| value.max(0.0).sqrt()).collect();
    singular_values.sort_by(|a, b| b.total_cmp(a));
    Some(Combination {
        words: String::new(),
        terms: terms.into_iter().map(|(i, step)| (ids[i], step)).collect(),
        weak: is_undetermined || singular_values[0] > WEAK * singular_values[n - 1],
        undetermined: is_undetermined,
        determined,
        singular_values,
    })
}
