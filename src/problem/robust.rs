//! Errors of estimates by robust losses, from the scatter of the shots.

use nalgebra::{DMatrix, DVector};

use super::block::Block;
use super::film::block::FilmBlock;
use super::loss::ShotLoss;
use super::noise::count_shared;
use super::problem::{Evaluation, Problem};
use super::uncertainty::Estimates;
use super::unknowns::{Id, Own};
use crate::measurement::loss::Loss;

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
    for (number, (sample, shots)) in problem.samples.iter().zip(&at.shots).enumerate() {
        let local = |id: &Id| estimates.position(sample.columns[*id as usize]);
        let (ids, places): (Vec<Id>, Vec<usize>) =
            Id::ALL.into_iter().filter_map(|id| Some((id, local(&id)?))).unzip();
        for (shot, (loss, distance)) in shots.iter().zip(losses(problem, at, number)) {
            // of the weighted sums: g = w Jᵀr, H = w JᵀJ + (w'/s)(Jᵀr)(Jᵀr)ᵀ
            let (matrix, slope) = shot.reduced(&ids)?;
            let weight = loss.weight(distance);
            let bend = if distance > 0.0 { loss.slope(distance) / (distance * weight * weight) } else { 0.0 };
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

/// Returns the loss and the distance of each shot of a sample.
pub(super) fn losses(problem: &Problem, at: &Evaluation, number: usize) -> Vec<(ShotLoss, f64)> {
    let (sample, shots) = (&problem.samples[number], &at.shots[number]);
    match &sample.block {
        Block::Film(film @ FilmBlock { loss: Some(loss), .. }) => {
            film.distances(shots).into_iter().map(|distance| (*loss, distance)).collect()
        }
        Block::Rows(rows) => {
            let shared = sample.gather(&at.state.shared);
            let of_shot = |(i, own): (usize, &Own)| {
                let (distance, loss) = rows.distance(i, own, &shared);
                (loss, distance)
            };
            at.state.own[number].iter().enumerate().map(of_shot).collect()
        }
        _ => vec![(ShotLoss::new(Loss::Squares, 1), 0.0); shots.len()],
    }
}
