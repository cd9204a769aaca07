//! The fit of films of discs: the law of friction that all shots share, rigid or compliant, from several
//! starts, after the outcome of each shot was measured without a law.

use rayon::prelude::*;

use super::block::{DiscBlock, Freedom};
use super::impact::DiscImpact;
use super::measure::{ROUNDS, STEPS, list_impacts, measure, settle, solve, with_film};
use super::motion::friction;
use super::own::{self, Component, LAW};
use crate::measurement::dataset::Dataset;
use crate::measurement::parameter::Compliance;
use crate::problem::descent::descend;
use crate::problem::film::causes::explain;
use crate::problem::film::film_data::{Film, FilmError};
use crate::problem::film::outliers::tail;
use crate::problem::findings::Finding;
use crate::problem::policy::Policy;
use crate::problem::problem::{Evaluation, Problem, State};
use crate::problem::solution::Solution;
use crate::problem::sums::OwnPrior;
use crate::problem::unknowns::{Id, Mode, Own, Shared};

/// Values of μ and κ between which descents begin. A stiffer contact is as good as rigid.
const MU_RANGE: [f64; 2] = [0.02, 2.0];
const MU_STEPS: usize = 24;
const DISC_KAPPAS: [f64; 8] = [0.15, 0.3, 0.6, 1.25, 2.0, 3.0, 4.5, 9.0];

/// Smallest κ of a compliant contact.
const LEAST_KAPPA: f64 = 0.1;

/// Descents, ln of the ratio of μ or κ between their starts, and square beyond which the residual of an
/// outlying shot counts no more.
const STARTS: usize = 4;
const APART: f64 = 0.4;
const MAX_SQUARE: f64 = 25.0;

/// Variance of J_t/J_n from shot to shot with which starts are compared.
const RATIO_VARIANCE: f64 = 4e-4;

/// χ² by which a start is less likely than the best at most.
const LESS_LIKELY: f64 = 60.0;

/// Shots that determine a compliance at least, twice its three unknowns: in 37 films each of 3, 5, 10 and
/// 17 of 20 shots of rigid pucks that scatter it was let in in 4, 2, 1 and 0.
const LEAST_SHOTS: usize = 6;

/// The fit of films of discs.
#[derive(Clone)]
pub(crate) struct DiscFit {
    /// The minimum. Its first sample is of the shots that determine the law.
    pub(crate) solution: Solution,
    /// The measurements of each shot without a law.
    pub(crate) impacts: Vec<DiscImpact>,
    /// Standard deviation from shot to shot of each [`Component`], 0 where the frames do not show it.
    pub(crate) scatter: [f64; Component::ALL.len()],
    /// Other minima that are nearly as likely, with the difference of −2 log L as that of their χ².
    pub(crate) others: Vec<Evaluation>,
    /// Degrees of freedom of Student's t for intervals, as scatter is known from these shots alone; `None`
    /// for a single shot, whose errors are those of its frames.
    pub(crate) dof: Option<f64>,
}

/// Fits the films of discs of a data set.
///
/// # Errors
/// See [`FilmError`].
pub(crate) fn fit_discs(dataset: &Dataset, policy: &Policy) -> Result<DiscFit, FilmError> {
    let mut film = Film::of_discs(dataset)?;
    let free = measure(&film, policy)?;
    let impacts = list_impacts(&free, &film, policy)?;
    let fault = |impact: &DiscImpact| match impact.stuck {
        Some(_) => Some("the discs stick together".to_owned()),
        None => impact
            .find_misfit()
            .map(|misfit| misfit.to_string())
            .or_else(|| impact.find_impossible_restitution(policy).map(|doubt| doubt.to_string())),
    };
    let faults: Vec<Option<String>> = impacts.iter().map(fault).collect();
    let named = impacts.iter().zip(&faults);
    film.left_out.extend(named.filter_map(|(impact, why)| Some((impact.name.clone(), why.clone()?))));
    if faults.iter().all(Option::is_some) {
        return Err(FilmError::NoImpact(film.left_out));
    }
    let mut shots = Shots { policy, film: &film, compliance: dataset.settings.compliance, free };
    shots.keep(&faults.iter().map(Option::is_none).collect::<Vec<_>>());
    let mut findings = film.findings.clone();
    let mut fits = shots.choose_law(&mut findings)?;
    for _ in 0..ROUNDS {
        let keep = judge_shots(&fits[0], policy)?;
        if keep.iter().all(|keep| *keep) {
            break;
        }
        let names = shots.free.names[0].iter().cloned().zip(&keep);
        let names = names.filter(|(_, keep)| !**keep).map(|(name, _)| name).collect();
        findings.push(Finding::LostShots { names });
        shots.keep(&keep);
        fits = shots.choose_law(&mut findings)?;
    }
    let mut best = fits.remove(0);
    let rises: Vec<f64> = fits.iter().map(|other| unlikely(other) - unlikely(&best)).collect();
    let rivals = fits.into_iter().zip(rises).filter(|(_, rise)| *rise < policy.cause);
    let mut others: Vec<(Evaluation, f64)> = rivals.map(|(other, rise)| (other.at, rise)).collect();
    for _ in 0..ROUNDS {
        let refit = explain(&best.problem, &best.at, &best.covariance, policy);
        let Some(refit) = refit else { break };
        findings.extend(refit.finding);
        best = solve(refit.problem, refit.descent)?;
    }
    for id in [Id::Mu, Id::E, Id::Kappa] {
        let (unknown, bound) = (best.problem.unknown(id), best.value(id));
        let is_free = film.unknowns[id as usize].mode == Mode::Free || unknown.mode == Mode::Free;
        if is_free && best.covariance.sd(id as usize).is_none() {
            let is_at_bound = unknown.mode == Mode::Free && unknown.bounds.contains(&bound);
            let undetermined = Finding::Undetermined { id, sd: f64::INFINITY };
            findings.push(if is_at_bound { Finding::AtBound { id, bound } } else { undetermined });
        }
    }
    if !best.converged {
        findings.push(Finding::NotConverged);
    }
    let block = best.problem.discs().ok_or(FilmError::NoFilm)?;
    let count = block.shots.len();
    let priors: Vec<_> = (0..count).flat_map(|i| block.own_priors(i)).map(|(_, prior)| prior).collect();
    let scatter = std::array::from_fn(|which| {
        if priors.contains(&OwnPrior::Spread(which)) { block.spreads[which].sd } else { 0.0 }
    });
    for (other, rise) in &mut others {
        other.cost = best.at.cost + *rise;
    }
    let others = others.into_iter().map(|(other, _)| other).collect();
    let solution = with_film(best, Film { findings, ..film });
    let dof = (count > 1).then_some(count as f64 - 1.0);
    Ok(DiscFit { solution, impacts, scatter, others, dof })
}

/// The shots that the law is fitted to.
struct Shots<'a> {
    policy: &'a Policy,
    film: &'a Film<DiscBlock>,
    compliance: Compliance,
    /// The problem without a law.
    free: Solution,
}

impl Shots<'_> {
    /// Keeps the shots for which `keep` is true.
    fn keep(&mut self, keep: &[bool]) {
        let Solution { problem, at, names, .. } = &mut self.free;
        let mut state = at.state.clone();
        problem.retain(0, &mut state, keep);
        *at = problem.evaluate(state);
        let mut keep = keep.iter();
        names[0].retain(|_| keep.next() == Some(&true));
    }

    /// Returns whether the shots show a law: a single one does not, nor do shots whose slip is free.
    fn show_law(&self) -> bool {
        let block = self.free.problem.discs();
        block.is_some_and(|block| block.shots.iter().filter(|shot| shot.knows_slip).count() > 1)
    }

    /// Fits a rigid contact and a compliant one, as far as they are possible; returns the minima of the
    /// likelier one, the likeliest first.
    fn choose_law(&self, findings: &mut Vec<Finding>) -> Result<Vec<Solution>, FilmError> {
        let (shots, shows_law) = (self.free.names[0].len(), self.show_law());
        let is_stated = self.compliance == Compliance::Stated && shows_law;
        let mut fits = if is_stated { Vec::new() } else { self.fit_law(false, None)? };
        let is_auto = self.compliance == Compliance::Auto && shots >= LEAST_SHOTS && shows_law;
        if is_stated || is_auto {
            let compliant = self.fit_law(true, fits.first())?;
            let of_rigid = fits.first().map_or(f64::INFINITY, unlikely);
            let best = compliant.first().map(|best| (best.value(Id::Kappa), of_rigid - unlikely(best)));
            // beyond the equations that define the parameters only if the shots show it
            if let Some((kappa, fall)) = best.filter(|(_, fall)| *fall > self.policy.cause) {
                findings.extend(is_auto.then_some(Finding::Compliance { kappa, shots, fall, adopted: true }));
                fits = compliant;
            }
        }
        if fits.is_empty() { Err(FilmError::NoStart) } else { Ok(fits) }
    }

    /// Descends from the most promising values of μ and κ, first with the spreads before the frames are seen
    /// or those of a rival, then with spreads of their own; returns each minimum once, the likeliest first.
    /// Returns an empty list if with the spreads of the rival χ² is not low enough to be likelier: if it is
    /// lower by Δ for n numbers, −2 log L with their own spread is lower by −n ln(1 − Δ/n).
    fn fit_law(&self, is_compliant: bool, rival: Option<&Solution>) -> Result<Vec<Solution>, FilmError> {
        let mut problem = self.with_law(is_compliant)?;
        if let Some(rival) = rival {
            problem.samples[0].block.spreads_mut().copy_from_slice(rival.problem.samples[0].block.spreads());
        }
        let free = problem.free();
        let descend_from = |state| descend(&problem, problem.evaluate(state), &free, STEPS).end;
        let starts: Vec<Evaluation> = self.starts(&problem)?.into_iter().map(descend_from).collect();
        let least = starts.iter().map(|start| start.cost).fold(f64::INFINITY, f64::min);
        let shots = self.free.names[0].len() as f64;
        let needed = -shots * f64::exp_m1(-self.policy.cause / shots);
        if rival.is_some_and(|rival| least > rival.at.cost - needed) {
            return Ok(Vec::new());
        }
        let mut fits: Vec<Solution> = Vec::new();
        let is_new = |there: &Evaluation, fits: &[Solution]| {
            fits.iter().all(|fit| are_apart(&there.state.shared, &fit.at.state.shared, 0.5 * APART))
        };
        for start in starts.into_iter().filter(|start| start.cost <= least + LESS_LIKELY) {
            let end = descend(&problem, start, &free, ROUNDS * STEPS).end;
            if end.cost.is_finite() && is_new(&end, &fits) {
                let fit = settle(problem.clone(), end.state)?;
                if is_new(&fit.at, &fits) {
                    fits.push(fit);
                }
            }
        }
        fits.sort_by(|a, b| unlikely(a).total_cmp(&unlikely(b)));
        Ok(fits)
    }

    /// Returns the problem of all shots with a law in common.
    fn with_law(&self, is_compliant: bool) -> Result<Problem, FilmError> {
        let mut problem = self.free.problem.clone();
        problem.discs_mut().ok_or(FilmError::NoFilm)?.freedom = Freedom::Law;
        for id in LAW {
            *problem.unknown_mut(id) = self.film.unknowns[id as usize];
        }
        let kappa = problem.unknown_mut(Id::Kappa);
        kappa.bounds[0] = kappa.bounds[0].max(LEAST_KAPPA);
        if is_compliant && self.compliance == Compliance::Auto {
            kappa.mode = Mode::Free;
        }
        if !self.show_law() {
            problem.unknown_mut(Id::Mu).mode = Mode::Fixed;
            (problem.unknown_mut(Id::Kappa).mode, problem.unknown_mut(Id::Kappa).start) = (Mode::Fixed, 0.0);
        }
        Ok(problem)
    }

    /// Returns states in which each shot has the outcome that was measured, at values of μ and κ by which these
    /// are likely, the likeliest first.
    fn starts(&self, problem: &Problem) -> Result<Vec<State>, FilmError> {
        let block = problem.discs().ok_or(FilmError::NoFilm)?;
        let mut first = self.free.at.state.clone();
        let outcome = |(i, own): (usize, &Own)| block.outcome(i, own, &first.shared);
        let outcomes = first.own[0].iter().enumerate().map(outcome);
        let outcomes: Vec<Option<[f64; 2]>> = outcomes.map(|all| Some(all?.map(|value| value.re))).collect();
        for id in LAW {
            first.shared[id] = problem.unknown(id).start;
        }
        let e = problem.unknown(Id::E);
        if e.mode == Mode::Free {
            let all: Vec<f64> = outcomes.iter().flatten().map(|[e, _]| *e).collect();
            let mean = all.iter().sum::<f64>() / all.len() as f64;
            first.shared[Id::E] = mean.clamp(e.bounds[0] + 1e-3, e.bounds[1] - 1e-3);
        }
        let grid = |id: Id, values: &[f64]| -> Vec<f64> {
            let unknown = problem.unknown(id);
            let [low, high] = unknown.bounds;
            let within = values.iter().map(|value| value.clamp(low, high));
            if unknown.mode == Mode::Free { within.collect() } else { vec![unknown.start] }
        };
        let step = (MU_RANGE[1] / MU_RANGE[0]).powf(1.0 / (MU_STEPS - 1) as f64);
        let frictions: Vec<f64> = (0..MU_STEPS).map(|i| MU_RANGE[0] * step.powi(i as i32)).collect();
        let (frictions, kappas) = (grid(Id::Mu, &frictions), grid(Id::Kappa, &DISC_KAPPAS));
        let pairs: Vec<[f64; 2]> =
            kappas.iter().flat_map(|kappa| frictions.iter().map(|mu| [*mu, *kappa])).collect();
        let start = |[mu, kappa]: &[f64; 2]| {
            let mut state = first.clone();
            (state.shared[Id::Mu], state.shared[Id::Kappa]) = (*mu, *kappa);
            let mut square = 0.0;
            for (i, (own, outcome)) in state.own[0].iter_mut().zip(&outcomes).enumerate() {
                let Some(outcome) = outcome else { continue };
                block.set_outcome(i, own, &state.shared, *outcome);
                if block.shots[i].knows_slip {
                    square += (own[own::RATIO].powi(2) / RATIO_VARIANCE).min(MAX_SQUARE);
                }
            }
            (square, state)
        };
        let mut ranked: Vec<(f64, State)> = pairs.par_iter().map(start).collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let most = ranked.first().map_or(0.0, |best| best.0 + LESS_LIKELY);
        let mut starts: Vec<State> = Vec::new();
        for (_, state) in ranked.into_iter().filter(|(square, _)| *square <= most) {
            let is_apart = |start: &State| are_apart(&start.shared, &state.shared, APART);
            if starts.len() < STARTS && starts.iter().all(is_apart) {
                starts.push(state);
            }
        }
        Ok(starts)
    }
}

/// Returns whether the logarithms of μ or κ differ by more than `by`.
fn are_apart(a: &Shared, b: &Shared, by: f64) -> bool {
    [Id::Mu, Id::Kappa].iter().any(|id| (a[*id] / b[*id]).ln().abs() > by)
}

/// Returns −2 log L up to a constant, with the own unknowns integrated.
fn unlikely(fit: &Solution) -> f64 {
    let reduced = fit.at.eliminate(&fit.problem, 0.0);
    fit.minus_two_log().0 + reduced.map_or(f64::INFINITY, |reduced| reduced.own_ln_determinant)
}

/// Returns whether each shot is kept: its e and J_t/J_n, momentum, spins and distance differ from those of
/// the others by no more than chance makes them.
fn judge_shots(fit: &Solution, policy: &Policy) -> Result<Vec<bool>, FilmError> {
    let block = fit.problem.discs().ok_or(FilmError::NoFilm)?;
    let reduced = fit.at.eliminate(&fit.problem, 0.0).ok_or(FilmError::Undetermined)?;
    let is_likely = |i: usize| {
        let squares = block.own_priors(i).into_iter().filter_map(|(place, prior)| {
            let OwnPrior::Spread(which) = prior else { return None };
            let variance = block.spreads[which].sd.powi(2);
            let expected = variance - reduced.own[0][i].covariance[(place, place)];
            // quantities that the frames do not show do not count
            (expected > 1e-3 * variance).then(|| fit.at.state.own[0][i][place].powi(2) / expected)
        });
        let squares: Vec<f64> = squares.collect();
        let largest = squares.iter().copied().fold(0.0, f64::max);
        squares.len() as f64 * tail(largest, 1.0) > policy.shot_tail
    };
    let keep: Vec<bool> = (0..block.shots.len()).map(is_likely).collect();
    let lost = keep.iter().filter(|keep| !**keep).count();
    let too_many = lost as f64 > policy.max_lost * keep.len() as f64;
    Ok(if too_many { vec![true; keep.len()] } else { keep })
}

impl Solution {
    /// Returns J_t/J_n on the second of two discs of a fit of discs that close and slip with these
    /// velocities, m/s.
    pub(crate) fn impulse_ratio(&self, [closing, slip]: [f64; 2]) -> Option<f64> {
        let inertia = self.problem.discs()?.discs.inertia;
        let e = self.value(Id::E) - self.value(Id::ESlope) * closing;
        let of_law = [Id::Mu, Id::FallB, Id::FallC, Id::Kappa].map(|id| self.value(id));
        friction([closing, slip, e], of_law, inertia).map(|(ratio, _)| ratio)
    }
}
