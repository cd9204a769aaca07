//! The uncertainty of a fit: covariance, scores of held unknowns, conflicts with priors, and the
//! direction of the unknowns in which χ² changes least.

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::evaluation::{Evaluation, Reduced};
use super::policy::{POLICY, STALL};
use super::problem::Problem;
use super::sums::Part;
use super::unknowns::{Id, Mode, Unknown};
use crate::numerics::EXACT;
use crate::words::symbol;

/// Part of the information on an unknown that other unknowns must leave, so that what is left is
/// more than roundings.
pub(super) const OWN_PART: f64 = 1e-6;

/// Estimates with their covariance. Unknowns at a bound, and those that the frames do not depend
/// on, are not among them.
#[derive(Clone)]
pub(crate) struct Estimates {
    pub(crate) columns: Vec<usize>,
    pub(crate) covariance: DMatrix<f64>,
}

/// An unknown against what was assumed of it, if that is left out, to first order: a tested one
/// against the value that it is held at, another one against its prior.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Suspect {
    pub(crate) id: Id,
    pub(crate) estimate: f64,
    /// Difference in its standard deviations, the root of the decrease of χ².
    pub(crate) size: f64,
}

impl Estimates {
    /// Returns the covariance at a minimum; `None` if the frames do not determine an unknown.
    pub fn new(problem: &Problem, at: &Evaluation) -> Option<Self> {
        Self::of_columns(at.reduced()?, problem.inside(&at.state))
    }

    /// Returns the covariance of some unknowns, those at bounds taken for free, without those that
    /// the data do not depend on.
    pub(crate) fn of_columns(reduced: &Reduced, mut columns: Vec<usize>) -> Option<Self> {
        columns.retain(|column| reduced.informs(*column));
        let matrix = reduced.matrix(&columns);
        // scaled to a unit diagonal: units differ by 1e6
        let scale = DVector::from_fn(columns.len(), |i, _| matrix[(i, i)].sqrt().recip());
        if !scale.iter().all(|s| s.is_finite()) {
            return None;
        }
        let n = columns.len();
        let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.cholesky()?.inverse();
        let covariance = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        Some(Self { columns, covariance })
    }

    pub fn position(&self, column: usize) -> Option<usize> {
        self.columns.iter().position(|other| *other == column)
    }

    pub fn sd(&self, column: usize) -> Option<f64> {
        self.position(column).map(|i| self.covariance[(i, i)].sqrt())
    }

    /// Returns the covariance of some unknowns of the first sample; NaN for one without an error.
    pub(crate) fn between(&self, ids: &[Id]) -> DMatrix<f64> {
        let places: Vec<Option<usize>> = ids.iter().map(|id| self.position(*id as usize)).collect();
        DMatrix::from_fn(ids.len(), ids.len(), |i, j| match (places[i], places[j]) {
            (Some(i), Some(j)) => self.covariance[(i, j)],
            _ => f64::NAN,
        })
    }

    /// Returns the variance of a number of shot `i` of a sample with these derivatives by its own
    /// unknowns and the shared ones.
    pub(crate) fn variance(&self, reduced: &Reduced, (sample, i): (usize, usize), by: &DVector<f64>) -> f64 {
        let own = &reduced.own[sample][i];
        // own unknowns follow the shared ones
        let followed = own.response.tr_mul(&by.select_rows(&own.places));
        let mut by_shared = DVector::zeros(self.columns.len());
        for (by_local, column) in followed.iter().zip(&reduced.kept[sample]) {
            if let Some(place) = self.position(*column) {
                by_shared[place] -= by_local;
            }
        }
        for (by_local, column) in by.iter().skip(own.count).zip(&reduced.columns[sample]) {
            if let Some(place) = self.position(*column) {
                by_shared[place] += by_local;
            }
        }
        own.variance(by) + by_shared.dot(&(&self.covariance * &by_shared))
    }

    /// Returns half of d²χ²/dx² and of dχ²/dx of other unknowns if the estimates follow them.
    pub fn condition(&self, reduced: &Reduced, columns: &[usize]) -> (DMatrix<f64>, DVector<f64>) {
        let (n, count) = (self.columns.len(), columns.len());
        let all = [&self.columns[..], columns].concat();
        let (matrix, gradient) = (reduced.matrix(&all), reduced.gradient(&all));
        let beside = matrix.view((0, n), (n, count));
        let answer = &self.covariance * beside;
        let left = matrix.view((n, n), (count, count)) - beside.tr_mul(&answer);
        (left, gradient.rows(n, count) - answer.tr_mul(&gradient.rows(0, n)))
    }

    /// Returns the number of unknowns without a prior.
    pub(crate) fn count_without_prior(&self, problem: &Problem) -> usize {
        self.columns.iter().filter(|column| problem.unknowns[**column].active_prior().is_none()).count()
    }

    /// Returns the number of unknowns that the data determine: each counts by the part of its
    /// information that is not its prior's.
    pub(crate) fn count_data(&self, problem: &Problem) -> f64 {
        let part = |(i, column): (usize, &usize)| {
            let prior = problem.unknowns[*column].active_prior();
            prior.map_or(1.0, |prior| 1.0 - self.covariance[(i, i)] / (prior.sd * prior.sd))
        };
        self.columns.iter().enumerate().map(part).sum()
    }

    /// Returns each tested unknown and each prior against what the data show without it.
    pub(crate) fn suspects(&self, problem: &Problem, at: &Evaluation) -> Vec<Suspect> {
        let reduced = at.reduced();
        let suspect = |(column, unknown): (usize, &Unknown)| {
            let (id, x) = (unknown.id, at.state.shared.0[column]);
            if unknown.mode == Mode::Tested {
                let (information, slope) = self.condition(reduced?, &[column]);
                let by = -slope[0] / information[0];
                return Some(Suspect { id, estimate: x + by, size: by * information[0].sqrt() });
            }
            let (prior, variance) = (unknown.active_prior()?, self.sd(column)?.powi(2));
            let information = 1.0 / variance - prior.sd.powi(-2);
            let estimate = (x / variance - prior.mean * prior.sd.powi(-2)) / information;
            let size = (estimate - prior.mean) / (1.0 / information + prior.sd * prior.sd).sqrt();
            // what a search that stalls leaves of a pull is not a conflict
            let least = STALL / POLICY.conflict.powi(2);
            (information > least / variance).then_some(Suspect { id, estimate, size })
        };
        let suspects = problem.unknowns.iter().enumerate().filter_map(suspect);
        suspects.filter(|suspect| suspect.size.is_finite()).collect()
    }
}

/// Largest part of the information in a direction that one shot has, when its scatter is made
/// whole.
const MOST_OF_ITSELF: f64 = 0.99;

/// Returns the covariance H⁻¹BH⁻¹ of estimates by a robust loss for any scatter, with the curvature H
/// and the scatter B of the slopes of the shots (Huber 1967); `None` if all losses are least
/// squares, or there are too few shots. A shot scatters less about a fit that it takes part in: if
/// CCᵀ = H⁻¹ and its own curvature is N = CᵀHᵢC, its slope Cᵀg has the variance N(1 − N) and counts
/// as (1 − N)^(−1/2) Cᵀg (Bell and McCaffrey 2002, Surv. Methodol. 28, 169).
pub(crate) fn robust_covariance(
    problem: &Problem,
    at: &Evaluation,
    estimates: &Estimates,
) -> Option<DMatrix<f64>> {
    let n = estimates.columns.len();
    let count = at.shots.iter().map(Vec::len).sum::<usize>() as f64;
    if !problem.is_robust() || count <= estimates.count_data(problem) {
        return None;
    }
    let mut curvature = DMatrix::<f64>::zeros(n, n);
    let mut slopes = Vec::new();
    for (number, sample) in problem.samples.iter().enumerate() {
        let local = |id: &Id| estimates.position(sample.columns[*id as usize]);
        let (ids, places): (Vec<Id>, Vec<usize>) =
            Id::ALL.into_iter().filter_map(|id| Some((id, local(&id)?))).unzip();
        for i in 0..at.shots[number].len() {
            let shot = problem.contribute(&at.state, (number, i));
            // of the weighted sums: g = w Jᵀr, H = w JᵀJ + (w'/s)(Jᵀr)(Jᵀr)ᵀ
            let (matrix, slope) = shot.reduced(&ids)?;
            let bend = |Part { loss, distance }: Part| {
                loss.slope(distance) / (distance * loss.weight(distance).powi(2))
            };
            let bend = shot.sums.part.filter(|part| part.distance > 0.0).map_or(0.0, bend);
            let curvature_of_shot = matrix + &slope * slope.transpose() * bend;
            let whole = DMatrix::identity(n, n).select_rows(&places);
            curvature += whole.tr_mul(&(&curvature_of_shot * &whole));
            slopes.push((places.clone(), curvature_of_shot, slope));
        }
    }
    let prior = |i: usize| problem.unknowns[estimates.columns[i]].active_prior();
    let precision = |i: usize| prior(i).map_or(0.0, |prior| prior.sd.powi(-2));
    let precision = DMatrix::from_diagonal(&DVector::from_fn(n, |i, _| precision(i)));
    let root = (curvature + &precision).cholesky()?.inverse().cholesky()?.l();
    let mut scatter = root.transpose() * precision * &root;
    for (places, own, slope) in slopes {
        let rows = root.select_rows(&places);
        let parts = (rows.transpose() * own * &rows).symmetric_eigen();
        let by_part = parts.eigenvectors.transpose() * (rows.transpose() * slope);
        let left = parts.eigenvalues.map(|part| (1.0 - part.clamp(0.0, MOST_OF_ITSELF)).sqrt());
        let whole = &parts.eigenvectors * by_part.component_div(&left);
        scatter += &whole * whole.transpose();
    }
    Some(&root * scatter * root.transpose())
}

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
