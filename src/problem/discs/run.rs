//! The fit of films of discs from beginning to end: what was measured of each shot whatever the law of
//! friction, then the law that all shots share.

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::impact::DiscImpact;
use super::law::{Rival, Shots};
use super::measure::{ROUNDS, Reached, measure};
use super::own::Component;
use crate::measurement::dataset::Dataset;
use crate::problem::film::film_data::{Film, FilmError};
use crate::problem::film::outliers::tail;
use crate::problem::findings::Finding;
use crate::problem::policy::Policy;
use crate::problem::solution::Solution;
use crate::problem::sums::OwnPrior;
use crate::problem::unknowns::{Id, Mode};

/// Degrees of freedom of a normal distribution.
const NORMAL: f64 = 1e6;

/// The fit of films of discs.
#[derive(Clone)]
pub(crate) struct DiscFit {
    /// The minimum. Its first sample is of the shots that determine the law.
    pub(crate) solution: Solution,
    /// The measurements of each shot without a law.
    pub(crate) impacts: Vec<DiscImpact>,
    /// Standard deviation from shot to shot of each [`Component`], 0 where the frames do not show it.
    pub(crate) scatter: [f64; Component::ALL.len()],
    /// Other minima that are nearly as likely.
    pub(crate) rivals: Vec<Rival>,
    /// Degrees of freedom of Student's t for intervals: scatter is known from these shots alone; of a
    /// single shot they are those of its frames.
    pub(crate) dof: f64,
}

impl DiscFit {
    /// Returns the interval of 95 % of an unknown, which holds that of each other minimum that is nearly
    /// as likely; `None` if it has no standard error.
    #[must_use]
    pub fn interval_95(&self, id: Id) -> Option<[f64; 2]> {
        let estimate = self.solution.get(id)?;
        let reach = StudentsT::new(0.0, 1.0, self.dof).ok()?.inverse_cdf(0.975) * estimate.std_error?;
        // what is positive is known to a factor
        let is_positive = matches!(id, Id::Mu | Id::Kappa);
        let end = |value: f64, side: f64| {
            if is_positive { value * (side * reach / estimate.value).exp() } else { value + side * reach }
        };
        let near = self.rivals.iter().filter(|rival| is_positive && rival.is_within_95());
        let others = near.map(|rival| if id == Id::Mu { rival.mu } else { rival.kappa });
        let [mut low, mut high] = [-1.0, 1.0].map(|side| end(estimate.value, side));
        for value in others {
            (low, high) = (low.min(end(value, -1.0)), high.max(end(value, 1.0)));
        }
        let [least, most] = self.solution.problem.unknown(id).bounds;
        Some([low.max(least), high.min(most)])
    }
}

/// Fits the films of discs of a data set.
///
/// # Errors
/// See [`FilmError`].
pub(crate) fn fit_discs(dataset: &Dataset, policy: &Policy) -> Result<DiscFit, FilmError> {
    let mut film = Film::of_discs(dataset)?;
    let free = measure(&film, policy)?;
    let impacts = free.impacts(&film, policy)?;
    let fault = |impact: &DiscImpact| match impact.stuck {
        Some(_) => Some("the discs stick together".to_owned()),
        None if impact.is_no_collision() => Some("its motion fits no single collision".to_owned()),
        None => impact.find_impossible_restitution(policy).map(|doubt| doubt.to_string()),
    };
    let faults: Vec<Option<String>> = impacts.iter().map(fault).collect();
    let named = impacts.iter().zip(&faults);
    film.left_out.extend(named.filter_map(|(impact, why)| Some((impact.name.clone(), why.clone()?))));
    if faults.iter().all(Option::is_some) {
        return Err(FilmError::NoImpact(film.left_out));
    }
    let mut shots = Shots { policy, settings: dataset.settings, free, impacts: &impacts };
    shots.free.keep(&faults.iter().map(Option::is_none).collect::<Vec<_>>());
    let mut chosen = shots.choose_law()?;
    for _ in 0..ROUNDS {
        let keep = chosen.best.judge_shots(policy)?;
        if keep.iter().all(|keep| *keep) {
            break;
        }
        let names = shots.free.names().into_iter().zip(&keep);
        let names = names.filter(|(_, keep)| !**keep).map(|(name, _)| name).collect();
        film.findings.extend(chosen.finding);
        film.findings.push(Finding::LostShots { names });
        shots.free.keep(&keep);
        chosen = shots.choose_law()?;
    }
    film.findings.extend(chosen.finding);
    let mut best = chosen.best;
    best.resolve_conflicts(policy, &mut film.findings)?;
    let block = best.block()?;
    // a single shot shows no law, nor do shots whose slip is free
    let shows_law = block.shots.iter().filter(|shot| shot.knows_slip).count() > 1;
    best.find_undetermined(shows_law, &mut film.findings)?;
    if !best.descent.converged {
        film.findings.push(Finding::NotConverged);
    }
    let count = block.shots.len();
    let priors: Vec<_> = (0..count).flat_map(|i| block.own_priors(i)).map(|(_, prior)| prior).collect();
    let scatter = std::array::from_fn(|which| {
        if priors.contains(&OwnPrior::Spread(which)) { block.spreads[which].sd } else { 0.0 }
    });
    let mut solution = best.solution(&film)?;
    solution.misfit = impacts.iter().map(|impact| impact.misfit).fold(0.0, f64::max);
    // if the shots determine no friction, any other is as likely
    let is_shown = shows_law && solution.covariance.sd(Id::Mu as usize).is_some();
    let rivals = if is_shown { chosen.rivals } else { Vec::new() };
    let dof = if count > 1 { count as f64 - 1.0 } else { NORMAL };
    Ok(DiscFit { solution, impacts, scatter, rivals, dof })
}

impl Reached {
    /// Keeps the shots for which `keep` is true.
    fn keep(&mut self, keep: &[bool]) {
        let mut state = self.descent.end.state.clone();
        self.problem.retain(0, &mut state, keep);
        self.descent.end = self.problem.evaluate(state);
    }

    /// Returns whether each shot is kept: its e and J_t/J_n, momentum, spins and distance differ from
    /// those of the others by no more than chance makes them.
    fn judge_shots(&self, policy: &Policy) -> Result<Vec<bool>, FilmError> {
        let block = self.block()?;
        let reduced = self.descent.end.eliminate(&self.problem, 0.0).ok_or(FilmError::Undetermined)?;
        let is_likely = |i: usize| {
            let own = &reduced.own[0][i].covariance;
            let squares = block.own_priors(i).into_iter().filter_map(|(place, prior)| {
                let OwnPrior::Spread(which) = prior else { return None };
                let variance = block.spreads[which].sd.powi(2);
                let expected = variance - own[(place, place)];
                // what the frames do not show says nothing
                (expected > 1e-3 * variance).then(|| self.own()[i][place].powi(2) / expected)
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

    /// Leaves out priors that the frames contradict, the worst first.
    fn resolve_conflicts(&mut self, policy: &Policy, findings: &mut Vec<Finding>) -> Result<(), FilmError> {
        for _ in 0..ROUNDS {
            let conflicts = self.estimates()?.conflicts(&self.problem, &self.descent.end);
            let worst = conflicts.into_iter().max_by(|a, b| a.size.abs().total_cmp(&b.size.abs()));
            let Some(worst) = worst.filter(|worst| worst.size.abs() > policy.conflict) else { break };
            let Some(prior) = self.problem.unknown_mut(worst.id).prior.take() else { break };
            // with the prior, what it contradicts counts as scatter of the shots
            let mut problem = self.problem.clone();
            for spread in &mut problem.discs_mut().ok_or(FilmError::NoFilm)?.spreads {
                spread.sd = spread.first;
            }
            let mut state = self.descent.end.state.clone();
            let [low, high] = problem.unknown(worst.id).bounds;
            state.shared[worst.id] = worst.estimate.clamp(low, high);
            *self = Self::settle(problem, state)?;
            let estimate = self.shared()[worst.id];
            let sd = self.estimates()?.sd(worst.id as usize).unwrap_or(worst.sd);
            let size = (estimate - prior.mean) / sd.hypot(prior.sd);
            findings.push(Finding::Conflict { id: worst.id, stated: prior.mean, estimate, sd, size });
        }
        Ok(())
    }

    /// Finds which unknowns of the law the shots do not determine.
    fn find_undetermined(&self, shows_law: bool, findings: &mut Vec<Finding>) -> Result<(), FilmError> {
        let estimates = self.estimates()?;
        for id in [Id::Mu, Id::E, Id::Kappa] {
            let (unknown, value) = (self.problem.unknown(id), self.shared()[id]);
            let sd = estimates.sd(id as usize);
            let is_shown = sd.is_some() && (id == Id::E || shows_law);
            if unknown.mode != Mode::Free || is_shown {
                continue;
            }
            findings.push(if unknown.bounds.contains(&value) {
                Finding::AtBound { id, bound: value }
            } else {
                Finding::Undetermined { id, sd: sd.unwrap_or(f64::INFINITY) }
            });
        }
        Ok(())
    }
}
