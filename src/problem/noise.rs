//! The noise of the frames and the spreads from shot to shot, by restricted maximum likelihood: each estimate counts the unknowns that it
//! was estimated beside (Patterson and Thompson 1971, Biometrika 58, 545).

pub use super::frames::Noise;
use super::problem::{Evaluation, Problem, Reduced};
use super::spins::{OwnPrior, Spread};
use super::uncertainty::Estimates;
use super::unknowns::{Normal, OWN, own};

/// Largest correlation of neighbouring frames that is estimated.
const MAX_RHO: f64 = 0.98;

/// The noise has settled if its variance changes by less than this part and ρ by less than this.
const SETTLED: f64 = 0.01;

/// The spread of topspin, in parts of natural roll, is at least this: no frames determine a smaller one.
const LEAST_SPREAD: f64 = 0.004;

/// Sets noise and spreads to what the residuals at `at` show; returns whether they have settled.
pub(super) fn update(problem: &mut Problem, at: &Evaluation) -> bool {
    let Some(reduced) = at.eliminate(0.0) else { return true };
    let Some(estimates) = Estimates::of_reduced(problem, &at.state, &reduced) else { return true };
    let parameters = count_unknowns(problem, &estimates, &reduced);
    let total: f64 = at.bodies.iter().map(|body| body.count).sum();
    let mut settled = true;
    for (noise, body) in problem.world.noise.iter_mut().zip(&at.bodies) {
        let dof = body.count * (1.0 - parameters / total);
        if !(dof > 0.0 && body.square > 0.0) {
            continue;
        }
        let growth = body.weighted / dof;
        let rho = (body.lagged / body.square).clamp(0.0, MAX_RHO);
        settled &= (growth - 1.0).abs() < SETTLED && (rho - noise.rho).abs() < SETTLED;
        if growth > 0.0 && growth.is_finite() {
            *noise = Noise { sd: noise.sd * growth.sqrt(), rho };
        }
    }
    for which in [Spread::Topspin, Spread::Side] {
        let old = problem.spreads[which as usize];
        let new = estimate_spread(problem, at, &reduced, &estimates, which);
        settled &= (new.sd / old.sd - 1.0).abs() < 0.05;
        problem.spreads[which as usize] = new;
    }
    settled
}

/// Returns the number of unknowns that the frames determine: each counts by the part of its information that is not its prior's.
fn count_unknowns(problem: &Problem, estimates: &Estimates, reduced: &Reduced) -> f64 {
    let shared = estimates.ids.iter().enumerate().map(|(i, id)| {
        let prior = problem.unknown(*id).active_prior();
        prior.map_or(1.0, |prior| 1.0 - estimates.covariance[(i, i)] / (prior.sd * prior.sd))
    });
    let own = problem.spins.iter().enumerate().map(|(i, spin)| {
        let priors = spin.priors(&problem.spreads);
        let without_prior = (OWN - priors.len()) as f64;
        let with_prior = priors.iter().filter_map(|(place, prior)| {
            let variance = reduced.own_covariance[i][(*place, *place)];
            prior.map(|prior| (1.0 - variance / (prior.sd * prior.sd)).clamp(0.0, 1.0))
        });
        without_prior + with_prior.sum::<f64>()
    });
    shared.sum::<f64>() + own.sum::<f64>()
}

/// Returns the spread of a spin from shot to shot: s² = [Σ(ŝ² + v) + s₀²]/(n + 1), one step of expectation and maximisation.
fn estimate_spread(
    problem: &Problem,
    at: &Evaluation,
    reduced: &Reduced,
    estimates: &Estimates,
    which: Spread,
) -> Normal {
    let place = match which {
        Spread::Topspin => own::TOPSPIN,
        Spread::Side => own::SIDE,
    };
    let old = problem.spreads[which as usize];
    let first = super::film::FIRST_SPREADS[which as usize];
    let mut squares = first.sd * first.sd;
    let mut count = 1.0;
    for (i, spin) in problem.spins.iter().enumerate() {
        let prior = if which == Spread::Topspin { spin.topspin } else { spin.side };
        if prior != OwnPrior::Spread(which) || at.shots[i].held[place] {
            continue;
        }
        let by_shared = reduced.response(i, place, &estimates.ids);
        let variance =
            reduced.own_covariance[i][(place, place)] + by_shared.dot(&(&estimates.covariance * &by_shared));
        squares += (at.state.own[i][place] - old.mean).powi(2) + variance;
        count += 1.0;
    }
    let sd = (squares / count).sqrt();
    Normal { mean: old.mean, sd: if sd.is_finite() { sd.max(LEAST_SPREAD) } else { first.sd } }
}
