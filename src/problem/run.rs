//! The fit of a film from beginning to end.

use std::sync::Arc;

use rayon::prelude::*;

use super::effects::choose_effects;
use super::false_shots::{Squares, judge, tail};
use super::film::causes::{self, Refit};
use super::film::film_data::{FilmError, prepare_film};
use super::film::outliers::{self, leave_out_frames, squares};
use super::film::own::{SCATTERED, scattering};
use super::film::spins::{FIRST_SCATTER, SIDE_SPREAD, TOPSPIN_SPREAD};
use super::findings::{Differing, Finding, Severity};
use super::intervals::errors_as_free;
use super::loss::ShotLoss;
use super::minimise::{Descent, descend_with_noise, fit};
use super::policy::{Choices, POLICY};
use super::problem::{Prepared, Problem, State};
use super::solution::Solution;
use super::sums::{Noise, ShotSums, Spread};
use super::uncertainty::{Estimates, robust_covariance};
use super::unknowns::{Id, Mode};
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
pub(crate) fn fit_film(dataset: &Dataset, choices: &Choices) -> Result<Solution, FilmError> {
    let data = prepare_film(dataset, choices)?;
    let mut run = Run::minimise(data.clone())?.without_false_shots(data);
    run.leave_out_spoiled();
    if run.slow_variance() > POLICY.misfit {
        run.free_spins(POLICY.cause + run.price_of_spins());
    }
    let how = (choices.fidelity.is_none(), dataset.settings.compliance);
    let without_causes = run.clone();
    let mut estimates = run.name_causes(how)?;
    if run.is_scattered(&estimates) || without_causes.uneven_topspins().is_some() {
        // a cause is named only if it explains more than such scatter does
        run = without_causes;
        run.let_scatter();
        // spins that are not as stated scatter outcomes, too
        let least = run.uneven_topspins().map_or(POLICY.cause + run.price_of_spins(), |_| 0.0);
        run.free_spins(least);
        estimates = run.name_causes(how)?;
        let spreads = run.problem.film().map_or(&[][..], |film| &film.variation.spreads[FIRST_SCATTER..]);
        let differing =
            SCATTERED.into_iter().zip(spreads).filter(|(_, spread)| spread.sd > 2.0 * spread.first);
        let spreads: Vec<_> = differing.map(|(id, spread)| Differing { id, sd: spread.sd }).collect();
        run.data.record.findings.extend((!spreads.is_empty()).then_some(Finding::Dispersed { spreads }));
    } else if !run.problem.is_robust() {
        run.let_scatter();
        estimates = run.estimates()?;
    }
    let state = &run.descent.end.state;
    let film = run.problem.film();
    let lags = film.and_then(|film| outliers::lags(film, &state.own[0], &state.shared));
    run.data.record.findings.extend(lags.map(|_| Finding::Lags));
    let side = film.map(|film| film.variation.spreads[SIDE_SPREAD]);
    let is_wide = |side: &Spread| side.sd > POLICY.side_spins.max(2.0 * side.first);
    run.data.record.findings.extend(side.filter(is_wide).map(|Spread { sd, .. }| Finding::SideSpins { sd }));
    run.data.record.findings.extend(run.uneven_topspins().map(|sd| Finding::Topspins { sd }));
    let misfit = run.slow_variance();
    if misfit > POLICY.misfit {
        run.data.record.findings.push(Finding::Misfit { ratio: misfit, refutes: misfit > POLICY.refuted });
    }
    if !run.descent.converged {
        run.data.record.findings.push(Finding::NotConverged);
    }
    let mut solution = run.finish(estimates);
    let fps = dataset.tracks.as_ref().and_then(|tracks| tracks.fps);
    if let Some(fps) = fps.filter(|fps| *fps <= Tracks::MAX_PLAYBACK)
        && solution.record.findings.iter().any(|finding| finding.severity() > Severity::Note)
    {
        solution.record.findings.insert(0, Finding::Playback { fps });
    }
    Ok(solution)
}

/// Returns which shots have the outcome of the others and frames as near to their paths, by a loss
/// that gives gross errors little weight and with the noise that neighbouring frames show, and the
/// state of all; `None` if all have them, or too few.
fn judge_outcomes(data: &Prepared) -> Option<(Vec<bool>, State)> {
    let mut robust = data.problem.clone();
    let film = robust.film_mut()?;
    let numbers = Id::OFFSETS.len();
    (film.loss, film.variation.is_stated) = (Some(ShotLoss::new(Loss::Cauchy, numbers)), true);
    let end = fit(&mut robust, &data.start)?.end;
    let distance = |i: usize| end.shots[0][i].part.map_or(f64::INFINITY, |part| part.distance);
    let keep = judge_shots(&end.shots[0], distance, 1.0);
    keep.contains(&false).then_some((keep, end.state))
}

/// Returns which shots have an outcome as near to the law as the others, at this distance from it
/// in standard deviations, and frames as near to their paths; `least` is the least variance of the
/// frames in units of their noise.
fn judge_shots(shots: &[ShotSums], distance: impl Fn(usize) -> f64, least: f64) -> Vec<bool> {
    let outcome = |i| Squares { sum: distance(i).powi(2), count: Id::OFFSETS.len() as f64 };
    let by_outcome = judge(&(0..shots.len()).map(outcome).collect::<Vec<_>>(), (0.0, 1.0));
    let by_frames = judge(&squares(shots), (0.0, least));
    let keep = by_outcome.into_iter().zip(by_frames).map(|(outcome, frames)| outcome && frames);
    POLICY.keep_most(keep.collect())
}

/// A fit on its way: the problem and the end of its last descent.
#[derive(Clone)]
struct Run {
    problem: Problem,
    descent: Descent,
    /// The problem before its search, with all that was found.
    data: Prepared,
}

impl Run {
    /// Minimises, leaving out frames and shots that fit no collision.
    fn minimise(data: Prepared) -> Result<Self, FilmError> {
        let mut problem = data.problem.clone();
        let descent = fit(&mut problem, &data.start).ok_or(FilmError::NoStart)?;
        let mut run = Self { problem, descent, data };
        for round in 0..ROUNDS {
            let mut state = run.descent.end.state.clone();
            // wrong frames are left out before shots are judged; by a robust loss wrong shots count
            // less
            let mut keep = Vec::new();
            if round > 0 && !run.problem.is_robust() {
                let distances = run.distances();
                let distance = |i: usize| distances[i].unwrap_or(0.0);
                keep = judge_shots(&run.descent.end.shots[0], distance, f64::MIN_POSITIVE);
            }
            let frames = run.leave_out_frames(&state);
            if keep.contains(&false) {
                run.problem.retain(&mut state, &keep);
                run.data.leave_out(&keep);
                // what was fitted to wrong shots may be another minimum
                let mut anew = run.data.problem.clone();
                if let Some(descent) = fit(&mut anew, &run.data.start) {
                    (run.problem, run.descent) = (anew, descent);
                    continue;
                }
            } else if frames == 0 {
                if round > 0 {
                    break;
                }
                continue;
            }
            run.descent = descend_with_noise(&mut run.problem, state);
        }
        Ok(run)
    }

    /// Returns the fit without shots that are not as the others, as a fit of all shots with a
    /// robust loss shows them, if the frames of the others then scatter as their noise.
    fn without_false_shots(self, all: Prepared) -> Self {
        let is_good = |run: &Self| run.slow_variance() <= POLICY.misfit;
        if self.problem.is_robust() || is_good(&self) {
            return self;
        }
        let Some((keep, start)) = judge_outcomes(&all) else { return self };
        let mut others = Prepared { start, ..all };
        others.leave_out(&keep);
        Self::minimise(others).ok().filter(is_good).unwrap_or(self)
    }

    /// Returns the standard deviation of topspins about the stated ones, if it is more than is usual.
    fn uneven_topspins(&self) -> Option<f64> {
        let film = self.problem.film().filter(|film| film.loss.is_none())?;
        let are_stated = film.shots.iter().any(|shot| !shot.spin.rolls && !shot.spin.is_unknown());
        let sd = film.variation.spreads[TOPSPIN_SPREAD].sd;
        (are_stated && sd > POLICY.topspins).then_some(sd)
    }

    /// Goes on with unknown spins if −2 log L decreases by more than `least`; returns whether it does.
    fn free_spins(&mut self, least: f64) -> bool {
        let freed = causes::spin_freely(&self.problem, &self.descent.end, &self.data);
        self.adopt(freed.filter(|freed| freed.fall > least))
    }

    /// Returns the decrease of −2 log L that a topspin of its own for each shot must make: 2 for
    /// each unknown (Akaike 1974).
    fn price_of_spins(&self) -> f64 {
        2.0 * self.count_shots() as f64
    }

    fn count_shots(&self) -> usize {
        self.problem.samples[0].names.len()
    }

    /// Leaves out frames that fit no collision, also of the search from the beginning; returns their
    /// number.
    fn leave_out_frames(&mut self, state: &State) -> usize {
        let Some((film, first)) = self.problem.film_mut().zip(self.data.problem.film_mut()) else { return 0 };
        let frames = leave_out_frames(film, &state.own[0], &state.shared);
        for (first, shot) in Arc::make_mut(&mut first.shots).iter_mut().zip(film.shots.iter()) {
            first.tracks = Arc::clone(&shot.tracks);
        }
        frames
    }

    /// Leaves out the frames next to the impacts if they are off in all shots, and says so.
    fn leave_out_spoiled(&mut self) {
        let state = self.descent.end.state.clone();
        let Some(film) = self.problem.film_mut() else { return };
        let spoiled = outliers::spoiled(film, &state.own[0], &state.shared);
        let lags = outliers::lags(film, &state.own[0], &state.shared);
        if spoiled.is_none() && lags.is_none() {
            return;
        }
        let [before, after] = spoiled.unwrap_or_default();
        // the first frame after an impact may be less than half a frame away
        let after = after.max(lags.map_or(0, |frames| frames + 1));
        self.data.record.findings.push(Finding::Spoiled { before, after });
        outliers::leave_out_spoiled(film, &state.own[0], [before, after]);
        self.descent = descend_with_noise(&mut self.problem, state);
    }

    /// Adopts effects beyond the model and causes of residuals that the frames show; returns the
    /// estimates.
    fn name_causes(&mut self, how: (bool, Compliance)) -> Result<Estimates, FilmError> {
        let effects = choose_effects(&mut self.problem, &mut self.descent, how);
        self.data.record.findings.extend(effects);
        let mut estimates = self.estimates()?;
        for _ in 0..MAX_CAUSES {
            let cause = causes::explain(&self.problem, &self.descent.end, &estimates);
            // other spins explain decelerations that no cloth has
            let least = cause.as_ref().map(|cause| cause.fall + self.price_of_spins());
            if !least.is_some_and(|least| self.free_spins(least)) && !self.adopt(cause) {
                break;
            }
            estimates = self.estimates()?;
        }
        if self.adopt(causes::widen_rate(&self.problem, &self.descent.end)) {
            estimates = self.estimates()?;
        }
        Ok(estimates)
    }

    /// Returns whether outcomes scatter about what the shots have in common by more than the noise
    /// makes them.
    fn is_scattered(&self, estimates: &Estimates) -> bool {
        let distances: Vec<f64> = self.distances().into_iter().flatten().collect();
        let square = distances.iter().map(|distance| distance * distance).sum::<f64>();
        let numbers = (Id::OFFSETS.len() * distances.len()) as f64;
        let dof = numbers - estimates.count_data(&self.problem);
        dof >= 1.0 && tail(square, dof) < POLICY.improbable && !self.problem.is_robust()
    }

    /// Returns how far the outcome of each shot is from the law, in standard deviations; `None` if
    /// its frames do not determine it.
    fn distances(&self) -> Vec<Option<f64>> {
        let state = &self.descent.end.state;
        let distance = |i: usize| Some(self.problem.contribute(state, (0, i)).offsets()?.distance);
        (0..self.count_shots()).into_par_iter().map(distance).collect()
    }

    /// Goes on with impacts that differ from shot to shot.
    fn let_scatter(&mut self) {
        let scatters = scattering(&self.problem.unknowns);
        let Some(film) = self.problem.film_mut() else { return };
        film.scatters = scatters;
        let state = self.descent.end.state.clone();
        self.descent = descend_with_noise(&mut self.problem, state);
    }

    /// Returns the variance of slow motions, σ²(1 + ρ)/(1 − ρ), over that before the search, of the
    /// ball for which that is larger.
    fn slow_variance(&self) -> f64 {
        let variance = |noise: &Noise| noise.sd * noise.sd * (1.0 + noise.rho) / (1.0 - noise.rho);
        let [now, first] =
            [&self.problem, &self.data.problem].map(|of| &of.samples[0].block.variation().noises);
        let ratios = now.iter().zip(first).map(|(now, first)| variance(now) / variance(first));
        ratios.fold(0.0, f64::max)
    }

    /// Goes on from a refit, if there is one; returns whether there is.
    fn adopt(&mut self, refit: Option<Refit>) -> bool {
        let Some(Refit { problem, descent, finding, .. }) = refit else { return false };
        (self.problem, self.descent) = (problem, descent);
        self.data.record.findings.extend(finding);
        true
    }

    fn estimates(&self) -> Result<Estimates, FilmError> {
        Estimates::new(&self.problem, &self.descent.end).ok_or(FilmError::Undetermined)
    }

    fn finish(mut self, mut estimates: Estimates) -> Solution {
        let as_free = errors_as_free(&self.problem, &self.descent.end, &[]);
        for id in Id::WANTED {
            let (unknown, value) = (self.problem.unknown(id), self.descent.end.state.shared[id]);
            let sd = estimates.sd(id as usize);
            // at a bound the error that it would have without one
            let as_free = as_free.as_ref().and_then(|all| all.sd(id as usize)).or(sd);
            let is_vague = id == Id::MuS && as_free.is_some_and(|sd| sd > POLICY.undetermined_mu_s);
            if unknown.mode == Mode::Free && (sd.is_none() || is_vague) {
                let is_at_bound = !is_vague && unknown.bounds.contains(&value);
                self.data.record.findings.push(if is_at_bound {
                    Finding::AtBound { id, bound: value }
                } else {
                    Finding::Undetermined { id, sd: as_free.unwrap_or(f64::INFINITY) }
                });
            }
        }
        if let Some(covariance) = robust_covariance(&self.problem, &self.descent.end, &estimates) {
            estimates.covariance = covariance;
        }
        Solution::new(self.problem, self.descent, estimates, self.data.record)
    }
}
