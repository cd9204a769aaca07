//! Identifiability: the direction of the unknowns in which χ² changes least, and what the data do
//! determine of it.

use nalgebra::{DMatrix, DVector};

use super::problem::{Evaluation, Problem, Reduced};
use super::solution::Solution;
use super::uncertainty::Estimates;
use super::unknowns::{Id, Mode};

/// Eigenvalue of the normal matrix, scaled to a diagonal of 1, below which χ² does not change along its
/// direction: products of derivatives are exact to 1e-12.
const NULL: f64 = 1e-11;

/// Condition number from which on a direction is weakly determined (Belsley, Kuh and Welsch, Regression
/// Diagnostics, 1980, ch. 3).
const WEAK: f64 = 30.0;

/// Part of a direction from which on an unknown belongs to it.
const SHARE: f64 = 0.1;

/// Part within which relative changes of two unknowns are opposite or equal, so that their product or
/// ratio stays.
const INVARIANT: f64 = 0.15;

/// A function of two unknowns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Invariant {
    /// x·y
    Product,
    /// x/y
    Ratio,
}

/// A function of a direction's unknowns that the data determine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Remains {
    /// Which function of the direction's two unknowns.
    pub(crate) invariant: Invariant,
    /// Its value.
    pub(crate) value: f64,
    /// Standard error of the value.
    pub(crate) std_error: f64,
}

/// The direction of the unknowns in which χ² changes least.
#[derive(Clone, Debug, PartialEq)]
pub struct Combination {
    /// How far each unknown goes for one standard error along it; in a direction that is not determined
    /// 1 for the one that goes farthest.
    pub terms: Vec<(Id, f64)>,
    /// Roots of the eigenvalues of the normal matrix scaled to a diagonal of 1, the largest first.
    pub singular_values: Vec<f64>,
    /// Whether it is weakly determined.
    pub(crate) is_weak: bool,
    /// Whether χ² does not change along it at all.
    pub(crate) is_undetermined: bool,
    /// The function of its unknowns that is determined.
    pub(crate) remains: Option<Remains>,
}

/// Returns the worst determined direction of the free unknowns that the data depend on and that are not
/// at bounds; `None` of fewer than two.
pub(crate) fn worst_direction(problem: &Problem, at: &Evaluation, reduced: &Reduced) -> Option<Combination> {
    let mut columns = problem.inside(&at.state);
    columns.retain(|column| reduced.informs(*column));
    let unknowns: Vec<(Id, f64)> =
        columns.iter().map(|column| (problem.unknowns[*column].id, at.state.shared.0[*column])).collect();
    combine(&unknowns, &reduced.matrix(&columns))
}

impl Solution {
    /// Returns the worst determined direction of some unknowns of the only sample with these values, the
    /// other free ones eliminated; `None` of fewer than two, or if the others are not determined.
    pub(crate) fn worst_direction(&self, unknowns: &[(Id, f64)]) -> Option<Combination> {
        let reduced = self.at.eliminate(&self.problem, 0.0)?;
        let wanted: Vec<usize> = unknowns.iter().map(|(id, _)| *id as usize).collect();
        let mut others = self.problem.inside(&self.at.state);
        others.retain(|column| !wanted.contains(column));
        let (left, _) = Estimates::of_columns(&reduced, others)?.condition(&reduced, &wanted);
        combine(unknowns, &left)
    }

    /// Returns whether the data depend on an unknown of the only sample, if that was free.
    pub(crate) fn is_informed(&self, id: Id) -> bool {
        let is_free = self.problem.unknown(id).mode == Mode::Free;
        is_free && self.at.shots.iter().flatten().any(|shot| shot.slopes_by(id as usize))
    }
}

/// Returns the worst determined direction of some unknowns with these values and this normal matrix;
/// `None` of fewer than two.
fn combine(unknowns: &[(Id, f64)], matrix: &DMatrix<f64>) -> Option<Combination> {
    let norms = matrix.diagonal().map(f64::sqrt);
    let n = unknowns.len();
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] / (norms[i] * norms[j]));
    if n < 2 || !scaled.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let eigen = scaled.symmetric_eigen();
    let (values, least) = (&eigen.eigenvalues, eigen.eigenvalues.imin());
    let is_undetermined = values[least] <= NULL;
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
    let x = |i: usize| unknowns[i].1;
    let remains = match terms[..] {
        [(i, step_i), (j, step_j)] if x(i) > 0.0 && x(j) > 0.0 => {
            let ratio = (step_i / x(i)) / (step_j / x(j));
            let of = |invariant: Invariant, value: f64, by: [f64; 2]| {
                let mut gradient = DVector::zeros(n);
                (gradient[i], gradient[j]) = (by[0], by[1]);
                Remains { invariant, value, std_error: variance(&gradient).sqrt() }
            };
            if (ratio + 1.0).abs() < INVARIANT {
                Some(of(Invariant::Product, x(i) * x(j), [x(j), x(i)]))
            } else if (ratio - 1.0).abs() < INVARIANT {
                Some(of(Invariant::Ratio, x(i) / x(j), [x(j).recip(), -x(i) / x(j).powi(2)]))
            } else {
                None
            }
        }
        _ => None,
    };
    let mut singular_values: Vec<f64> = values.iter().map(|value| value.max(0.0).sqrt()).collect();
    singular_values.sort_by(|a, b| b.total_cmp(a));
    let is_weak = is_undetermined || singular_values[0] > WEAK * singular_values[n - 1];
    Some(Combination {
        terms: terms.into_iter().map(|(i, step)| (unknowns[i].0, step)).collect(),
        singular_values,
        is_weak,
        is_undetermined,
        remains,
    })
}
