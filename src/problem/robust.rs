//! Errors of estimates by robust losses, from the scatter of the shots.

use nalgebra::{DMatrix, DVector};

use super::noise::count_shared;
use super::problem::{Evaluation, Problem};
use super::sums::Part;
use super::uncertainty::Estimates;
use super::unknowns::Id;

/// Largest part of the information in a direction that one shot has, when its scatter is made
/// whole.
const MOST_OF_ITSELF: f64 = 0.99;

/// Returns the covariance H⁻¹BH⁻¹ of estimates by a robust loss for any noise, with the curvature H
/// and the scatter B of the slopes of the shots (Huber 1967); `None` if all losses are least
/// squares, or there are too few shots. A shot scatters less about a fit that it takes part in: if
/// CCᵀ = H⁻¹ and its own curvature is N = CᵀHᵢC, its slope Cᵀg has the variance N(1 − N) and
/// counts as (1 − N)^(−1/2) Cᵀg (Bell and McCaffrey 2002, Surv. Methodol. 28, 169).
pub(crate) fn robust_covariance(
    problem: &Problem,
    at: &Evaluation,
    estimates: &Estimates,
) -> Option<DMatrix<f64>> {
    let n = estimates.columns.len();
    let count = at.shots.iter().map(Vec::len).sum::<usize>() as f64;
    if !problem.is_robust() || count <= count_shared(problem, estimates) {
        return None;
    }
    let mut curvature = DMatrix::<f64>::zeros(n, n);
    let mut slopes = Vec::new();
    for (sample, shots) in problem.samples.iter().zip(&at.shots) {
        let local = |id: &Id| estimates.position(sample.columns[*id as usize]);
        let (ids, places): (Vec<Id>, Vec<usize>) =
            Id::ALL.into_iter().filter_map(|id| Some((id, local(&id)?))).unzip();
        for shot in shots {
            // of the weighted sums: g = w Jᵀr, H = w JᵀJ + (w'/s)(Jᵀr)(Jᵀr)ᵀ
            let (matrix, slope) = shot.reduced(&ids)?;
            let bend = |Part { loss, distance }: Part| {
                loss.slope(distance) / (distance * loss.weight(distance).powi(2))
            };
            let bend = shot.part.filter(|part| part.distance > 0.0).map_or(0.0, bend);
            let own = matrix + &slope * slope.transpose() * bend;
            for (i, a) in places.iter().enumerate() {
                for (j, b) in places.iter().enumerate() {
                    curvature[(*a, *b)] += own[(i, j)];
                }
            }
            slopes.push((places.clone(), own, slope));
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
