//! The fit of a film from beginning to end.

use super::block::Block;
use super::descent::Descent;
use super::film::causes;
use super::film::film_data::{Film, FilmError, Modelling};
use super::film::next_to_impact;
use super::film::outliers::{judge_shots, leave_out_frames, tail};
use super::findings::{Finding, Severity};
use super::loss::ShotLoss;
use super::minimise::{descend_with_noise, fit};
use super::policy::Policy;
use super::problem::{Problem, State};
use super::robust::robust_covariance;
use super::solution::Solution;
use super::sums::Noise;
use super::uncertainty::Estimates;
use super::unknowns::{Id, Mode, Shared};
use crate::measurement::dataset::{Dataset, Tracks};
use crate::measurement::loss::Loss;
use crate::measurement::parameter::Compliance;

/// Rounds of leaving out frames and shots.
const ROUNDS: usize = 3;

/// Causes that are let in one after the other.
const MAX_CAUSES: usize = 3;

/// Fits the film of a data set.
///
/// # Errors
/// See [`FilmError`].
pub fn fit_film(dataset: &Dataset, modelling: &Modelling, policy: &Policy) -> Result<Solution, FilmError> {
    let Film { block, unknowns, own, names, left_out, findings, unit, middle } =
        Film::new(dataset, modelling)?;
    let first_noise = block.world.noise;
    let start = State { own: vec![own], shared: Shared::starts(&unknowns) };
    let problem = Problem::of_one(Block::Film(block), unknowns);
    let mut run = Run { policy, problem, names, findings, left_out };
    let all = (run.problem.clone(), run.names.clone());
    let mut descent = run.minimise(&start)?;
    run.leave_out_false_shots(all, &start, &mut descent);
    run.leave_out_spoiled(&mut descent);
    // shots that were left out have no first guess any more
    let start = if start.own[0].len() == run.names.len() { start } else { descent.end.state.clone() };
    if slow_variance(&run.noise(), &first_noise) > policy.misfit
        && let Some(explained) =
            causes::spin_freely(&run.problem, &descent.end, (&start, first_noise), policy)
    {
        run.findings.push(explained.finding);
        run.adopt(explained.problem, explained.descent, &mut descent);
    }
    // a rigid contact that is fitted to a compliant one may leave μ undetermined
    if modelling.is_auto
        && let Some((problem, refit, fall)) = causes::comply(&run.problem, &descent.end, policy)
    {
        let (kappa, shots) = (refit.end.state.shared[Id::Kappa], descent.end.count_sticking());
        run.findings.push(Finding::Compliance { kappa, shots, fall, adopted: true });
        run.adopt(problem, refit, &mut descent);
    }
    let corrected = match modelling.settings.compliance {
        _ if !modelling.is_auto => causes::correct(&run.problem, &descent.end),
        // the integrated contact is none that is stated to be rigid
        Compliance::Rigid => None,
        _ => causes::weigh(&run.problem, &descent.end, policy),
    };
    if let Some((problem, refit, fall)) = corrected {
        let shots = problem.samples[0].block.count_corrected();
        run.findings.extend(modelling.is_auto.then_some(Finding::Weight { shots, fall, adopted: true }));
        run.adopt(problem, refit, &mut descent);
    }
    let mut estimates = run.estimates(&descent)?;
    for _ in 0..MAX_CAUSES {
        let Some(explained) = causes::explain(&run.problem, &descent.end, &estimates, policy) else { break };
        run.findings.push(explained.finding);
        run.adopt(explained.problem, explained.descent, &mut descent);
        estimates = run.estimates(&descent)?;
    }
    if let Some((problem, refit)) = causes::widen_rate(&run.problem, &descent.end, &estimates, policy) {
        run.adopt(problem, refit, &mut descent);
        estimates = run.estimates(&descent)?;
        run.findings.extend(causes::contradicted_rate(&run.problem, &descent.end, &estimates, policy));
    }
    let state = &descent.end.state;
    let lags =
        run.problem.film().is_some_and(|film| next_to_impact::lags(film, &state.own[0], &state.shared));
    if lags && !run.findings.contains(&Finding::Lags) {
        run.findings.push(Finding::Lags);
    }
    let misfit = slow_variance(&run.noise(), &first_noise);
    if misfit > policy.misfit {
        run.findings.push(Finding::Misfit { ratio: misfit, refutes: misfit > policy.refuted });
    }
    if !descent.converged {
        run.findings.push(Finding::NotConverged);
    }
    let mut solution = Solution { unit, middle: middle.into(), ..run.finish(descent, estimates, misfit) };
    let fps = dataset.tracks.as_ref().and_then(|tracks| tracks.fps);
    if let Some(fps) = fps.filter(|fps| *fps <= Tracks::MAX_PLAYBACK)
        && solution.severity() > Severity::Note
    {
        solution.findings.insert(0, Finding::Playback { fps });
    }
    Ok(solution)
}

/// Returns the variance of slow motions, σ²(1 + ρ)/(1 − ρ), over that of another noise.
fn slow_variance(noise: &[Noise; 2], first: &[Noise; 2]) -> f64 {
    let variance = |noise: &Noise| noise.sd * noise.sd * (1.0 + noise.rho) / (1.0 - noise.rho);
    let ratios = noise.iter().zip(first).map(|(noise, first)| variance(noise) / variance(first));
    ratios.fold(0.0, f64::max)
}

/// Returns which shots have the outcome of the others, by a loss that lets gross errors hardly count and with
/// the noise that neighbouring frames show, and the state of all; `None` if all have it, or too few.
fn judge_outcomes(problem: &Problem, start: &State, policy: &Policy) -> Option<(Vec<bool>, State)> {
    let mut robust = problem.clone();
    let film = robust.film_mut()?;
    let numbers = Id::OFFSETS.len();
    (film.loss, film.states_noise) = (Some(ShotLoss::new(Loss::Cauchy, numbers)), true);
    let end = fit(&mut robust, start)?.end;
    let distances = robust.film()?.distances(&end.shots[0]);
    let is_alike = |distance: &f64| tail(distance * distance, numbers as f64) > policy.shot_tail;
    let keep: Vec<bool> = distances.iter().map(is_alike).collect();
    let lost = keep.iter().filter(|keep| !**keep).count();
    let is_few = lost > 0 && lost as f64 <= policy.max_lost * keep.len() as f64;
    is_few.then_some((keep, end.state))
}

struct Run<'a> {
    policy: &'a Policy,
    problem: Problem,
    names: Vec<String>,
    findings: Vec<Finding>,
    left_out: Vec<(String, String)>,
}

impl Run<'_> {
    /// Minimises, leaving out frames and shots that fit no collision.
    fn minimise(&mut self, start: &State) -> Result<Descent, FilmError> {
        let mut descent = fit(&mut self.problem, start).ok_or(FilmError::NoStart)?;
        for round in 0..ROUNDS {
            let mut state = descent.end.state.clone();
            // wrong frames are left out before shots are judged; by a robust loss wrong shots count less
            let is_robust = self.problem.film().is_some_and(|film| film.loss.is_some());
            let keep = if round == 0 || is_robust {
                vec![true; self.names.len()]
            } else {
                judge_shots(&descent.end.shots[0], self.policy)
            };
            let loses = keep.contains(&false);
            let frames = match self.problem.film_mut() {
                Some(film) => leave_out_frames(film, &state.own[0], &state.shared, self.policy),
                None => 0,
            };
            if !loses && frames == 0 && round > 0 {
                break;
            }
            if !loses && frames == 0 {
                continue;
            }
            if loses {
                self.leave_out(&keep, &mut state);
            }
            descent = descend_with_noise(&mut self.problem, state);
        }
        Ok(descent)
    }

    /// Leaves out shots whose outcome is not that of the others, as a fit with a robust loss of all shots
    /// shows it, if the frames of the others then scatter as their noise.
    fn leave_out_false_shots(
        &mut self,
        (problem, names): (Problem, Vec<String>),
        start: &State,
        descent: &mut Descent,
    ) {
        let Some(first) = problem.film().filter(|film| film.loss.is_none()).map(|film| film.world.noise)
        else {
            return;
        };
        if slow_variance(&self.noise(), &first) <= self.policy.misfit {
            return;
        }
        let Some((keep, mut state)) = judge_outcomes(&problem, start, self.policy) else { return };
        let mut others = Run { problem, names, findings: Vec::new(), left_out: Vec::new(), ..*self };
        others.leave_out(&keep, &mut state);
        let Ok(found) = others.minimise(&state) else { return };
        if slow_variance(&others.noise(), &first) > self.policy.misfit {
            return;
        }
        self.findings.retain(|finding| !matches!(finding, Finding::LostShots { .. }));
        self.findings.append(&mut others.findings);
        (self.problem, self.names, *descent) = (others.problem, others.names, found);
    }

    /// Leaves out the shots that are not kept, and says so.
    fn leave_out(&mut self, keep: &[bool], state: &mut State) {
        let is_lost = |(name, keep): (&String, &bool)| (!*keep).then(|| name.clone());
        let lost = self.names.iter().zip(keep).filter_map(is_lost).collect();
        self.problem.retain(0, state, keep);
        let mut keep = keep.iter();
        self.names.retain(|_| keep.next().copied().unwrap_or(true));
        self.findings.push(Finding::LostShots { names: lost });
    }

    /// Leaves out the frames next to the impacts if they are off in all shots, and says so.
    fn leave_out_spoiled(&mut self, descent: &mut Descent) {
        let state = descent.end.state.clone();
        let Some(film) = self.problem.film_mut() else { return };
        let Some(reach) = next_to_impact::spoiled(film, &state.own[0], &state.shared) else { return };
        let lags = next_to_impact::lags(film, &state.own[0], &state.shared);
        let [before, after] = reach;
        self.findings.push(if lags { Finding::Lags } else { Finding::Spoiled { before, after } });
        next_to_impact::leave_out(film, &state.own[0], reach);
        *descent = descend_with_noise(&mut self.problem, state);
    }

    /// Returns the noise of the frames of each ball.
    fn noise(&self) -> [Noise; 2] {
        self.problem.film().map_or([Noise { sd: f64::NAN, rho: 0.0 }; 2], |film| film.world.noise)
    }

    fn adopt(&mut self, problem: Problem, refit: Descent, descent: &mut Descent) {
        self.problem = problem;
        *descent = refit;
    }

    fn estimates(&self, descent: &Descent) -> Result<Estimates, FilmError> {
        Estimates::new(&self.problem, &descent.end).ok_or(FilmError::Undetermined)
    }

    fn finish(mut self, descent: Descent, estimates: Estimates, misfit: f64) -> Solution {
        let state = &descent.end.state;
        for id in Id::WANTED {
            let (unknown, value) = (self.problem.unknown(id), state.shared[id]);
            if unknown.mode != Mode::Free {
                continue;
            }
            match estimates.sd(id as usize) {
                None if !unknown.bounds.contains(&value) => {
                    self.findings.push(Finding::Undetermined { id, sd: f64::INFINITY });
                }
                None => self.findings.push(Finding::AtBound { id, bound: value }),
                Some(sd) if id == Id::MuS && sd > self.policy.undetermined_mu_s => {
                    self.findings.push(Finding::Undetermined { id, sd });
                }
                Some(_) => {}
            }
        }
        let mut estimates = estimates;
        if let Some(covariance) = robust_covariance(&self.problem, &descent.end, &estimates) {
            estimates.covariance = covariance;
        }
        Solution {
            evaluations: self.problem.count_evaluations(),
            problem: self.problem,
            converged: descent.converged,
            at: descent.end,
            covariance: estimates,
            findings: self.findings,
            names: vec![self.names],
            left_out: self.left_out,
            misfit,
            unit: 1.0,
            middle: [0.0; 2],
        }
    }
}
