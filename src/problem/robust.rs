//! Errors of estimates by robust losses, from the scatter of the shots.

use nalgebra::DMatrix;

use super::block::Block;
use super::film::block::FilmBlock;
use super::loss::ShotLoss;
use super::problem::{Evaluation, Problem};
use super::uncertainty::Estimates;
use super::unknowns::{Id, Own};
use crate::measurement::loss::Loss;

/// Returns the covariance of estimates by the losses of the films; `None` if all are least squares, or
/// there are too few shots.
pub(crate) fn robust_covariance(
    problem: &Problem,
    at: &Evaluation,
    estimates: &Estimates,
) -> Option<DMatrix<f64>> {
    if !problem.is_robust() {
        return None;
    }
    let losses: Vec<_> = (0..problem.samples.len()).map(|sample| losses(problem, at, sample)).collect();
    sandwich(problem, at, estimates, &losses)
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
                let distance = rows.predict(i, own, &shared).map(|found| rows.distance(i, own, &found));
                (rows.losses[rows.shots[i].rows.len()], distance.unwrap_or(f64::INFINITY))
            };
            at.state.own[number].iter().enumerate().map(of_shot).collect()
        }
        _ => vec![(ShotLoss::new(Loss::Squares, 1), 0.0); shots.len()],
    }
}

/// Returns the covariance H⁻¹BH⁻¹ of estimates by a robust loss, whatever the noise is, with the
/// curvature H and the scatter B of the slopes of the shots (Huber 1967); `losses` has the loss and the
/// distance of each shot of each sample.
pub(crate) fn sandwich(
    problem: &Problem,
    at: &Evaluation,
    estimates: &Estimates,
    losses: &[Vec<(ShotLoss, f64)>],
) -> Option<DMatrix<f64>> {
    let n = estimates.columns.len();
    let count = losses.iter().map(Vec::len).sum::<usize>() as f64;
    // of unknowns with priors the shots tell a part
    let prior = |column: &usize| problem.unknowns[*column].active_prior();
    let told = estimates.columns.iter().zip(0..).map(|(column, i)| match prior(column) {
        Some(prior) => 1.0 - estimates.covariance[(i, i)] / (prior.sd * prior.sd),
        None => 1.0,
    });
    let told: f64 = told.sum();
    if count <= told {
        return None;
    }
    let (mut curvature, mut scatter) = (DMatrix::<f64>::zeros(n, n), DMatrix::<f64>::zeros(n, n));
    for ((sample, shots), losses) in problem.samples.iter().zip(&at.shots).zip(losses) {
        let local = |id: &Id| estimates.position(sample.columns[*id as usize]);
        let (ids, places): (Vec<Id>, Vec<usize>) =
            Id::ALL.into_iter().filter_map(|id| Some((id, local(&id)?))).unzip();
        for (shot, (loss, distance)) in shots.iter().zip(losses) {
            // of the weighted sums: g = w Jᵀr, H = w JᵀJ + (w'/s)(Jᵀr)(Jᵀr)ᵀ
            let (matrix, slope) = shot.reduced(&ids)?;
            let weight = loss.weight(*distance);
            let outer = &slope * slope.transpose();
            let bend =
                if *distance > 0.0 { loss.slope(*distance) / (distance * weight * weight) } else { 0.0 };
            for (i, a) in places.iter().enumerate() {
                for (j, b) in places.iter().enumerate() {
                    curvature[(*a, *b)] += matrix[(i, j)] + outer[(i, j)] * bend;
                    // few shots scatter less about their own fit
                    scatter[(*a, *b)] += outer[(i, j)] * (count / (count - told));
                }
            }
        }
    }
    for (i, column) in estimates.columns.iter().enumerate() {
        if let Some(prior) = prior(column) {
            curvature[(i, i)] += prior.sd.powi(-2);
            scatter[(i, i)] += prior.sd.powi(-2);
        }
    }
    let inverse = curvature.cholesky()?.inverse();
    Some(&inverse * scatter * &inverse)
}
