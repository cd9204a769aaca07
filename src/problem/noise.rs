//! The noise of the frames and the spreads from shot to shot, by restricted maximum likelihood:
//! each estimate counts the unknowns that it was estimated beside (Patterson and Thompson 1971,
//! Biometrika 58, 545).

pub use super::frames::Noise;
use super::priors::FIRST_SPREADS;
use super::problem::{Evaluation, Problem, Reduced};
use super::spins::{OwnPrior, Spread};
use super::uncertainty::Estimates;
use super::unknowns::{Normal, OWN, own};

/// Largest correlation of neighbouring frames that is estimated.
const MAX_RHO: f64 = 0.98;

/// Correlation below which that of the residuals serves: it changes no error by a tenth.
const LEAST_RHO: f64 = 0.1;

/// Step of the correlation between values whose likelihoods are compared.
const RHO_STEP: f64 = 0.04;

/// The noise has settled if its variance changes by less than this part and ρ by less than this.
const SETTLED: f64 = 0.01;

/// Power of a step of expectation and maximisation; up to 2 it still converges.
const PROLONGED: f64 = 1.7;

/// The spread of topspin, in parts of natural roll, is at least this: no frames determine a smaller
/// one.
const LEAST_SPREAD: f64 = 0.004;

/// Sets noise and spreads to what the residuals at `at` show; returns whether they have settled.
pub(super) fn update(problem: &mut Problem, at: &Evaluation) -> bool {
    let Some(reduced) = at.eliminate(0.0) else { return true };
    let Some(estimates) = Estimates::of_reduced(problem, &at.state, &reduced) else { return true };
    let parameters = count_unknowns(problem, &estimates, &reduced);
    let total: f64 = at.bodies.iter().map(|body| body.count).sum();
    // residuals are less correlated than the errors, as each shot's unknowns follow slow errors
    let likeliest = likeliest_correlation(problem, at, total - parameters);
    let mut settled = true;
    for (noise, body) in problem.world.noise.iter_mut().zip(&at.bodies) {
        let dof = body.count * (1.0 - parameters / total);
        if !(dof > 0.0 && body.square > 0.0) {
            continue;
        }
        let growth = body.weighted / dof;
        let rho = likeliest.unwrap_or(body.lagged / body.square).clamp(0.0, MAX_RHO);
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

/// Returns the correlation of neighbouring frames that restricted likelihood prefers near the
/// present one; `None` if the residuals of neighbouring frames are hardly correlated.
fn likeliest_correlation(problem: &Problem, at: &Evaluation, dof: f64) -> Option<f64> {
    let lagged = at.bodies.iter().map(|body| body.lagged).sum::<f64>();
    let square = at.bodies.iter().map(|body| body.square).sum::<f64>();
    let of_residuals = lagged / square;
    let present = problem.world.noise.iter().map(|noise| noise.rho).fold(of_residuals, f64::max);
    if !(present > LEAST_RHO && dof > 0.0) {
        return None;
    }
    let middle = present.clamp(RHO_STEP, MAX_RHO - RHO_STEP);
    let [low, here, high] = [-RHO_STEP, 0.0, RHO_STEP].map(|by| restricted(problem, at, middle + by, dof));
    let (low, here, high) = (low?, here?, high?);
    // the vertex of the parabola through three points, at most two steps away
    let (slope, bend) = (0.5 * (high - low), high - 2.0 * here + low);
    let steps = if bend > 0.0 { (-slope / bend).clamp(-2.0, 2.0) } else { -2.0 * slope.signum() };
    Some(middle + steps * RHO_STEP)
}

/// Returns −2 ln of the restricted likelihood with a correlation, up to a constant, least over all
/// unknowns and the size of the noise: (N − p) ln χ² + ln|R| + ln|XᵀR⁻¹X|.
fn restricted(problem: &Problem, at: &Evaluation, rho: f64, dof: f64) -> Option<f64> {
    let mut other = problem.clone();
    for noise in &mut other.world.noise {
        noise.rho = rho;
    }
    let there = other.evaluate(at.state.clone());
    let (least, of_unknowns) = there.eliminate(0.0)?.least(&other.free())?;
    let of_frames: f64 = there.bodies.iter().map(|body| body.ln_determinant).sum();
    Some(dof * least.ln() + of_frames + of_unknowns)
}

/// Returns the number of unknowns that the frames determine: each counts by the part of its
/// information that is not its prior's.
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

/// Returns the spread of a spin from shot to shot: s² = [Σ(ŝ² + v) + s₀²]/(n + 1), one step of
/// expectation and maximisation.
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
    let first = FIRST_SPREADS[which as usize];
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
    // expectation and maximisation converges slowly: the step is prolonged
    let sd = old.sd * ((squares / count).sqrt() / old.sd).powf(PROLONGED);
    Normal { mean: old.mean, sd: if sd.is_finite() { sd.max(LEAST_SPREAD) } else { first.sd } }
}
