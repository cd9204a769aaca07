//! The fit of films of discs from beginning to end: what was measured of each shot whatever the law of
//! friction, then the law that all shots share.

use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

use super::block::{Component, DiscBlock};
use super::first_guess::DiscFilm;
use super::impact::DiscImpact;
use super::measure::{ROUNDS, Reached, impacts, measure, settle};
use crate::measurement::dataset::Dataset;
use crate::measurement::parameter::Settings;
use crate::problem::film::film_data::FilmError;
use crate::problem::findings::Finding;
use crate::problem::policy::Policy;
use crate::problem::problem::Problem;
use crate::problem::solution::Solution;
use crate::problem::sums::OwnPrior;
use crate::problem::uncertainty::Estimates;
use crate::problem::unknowns::{Id, Mode, Shared};

/// Rise of −2 log L at the ends of an interval of 95 %.
const RISE_95: f64 = 3.84;

/// Degrees of freedom of a normal distribution.
const NORMAL: f64 = 1e6;

/// Another minimum that is nearly as likely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rival {
    /// Friction between the discs there.
    pub mu: f64,
    /// Tangential compliance there.
    pub kappa: f64,
    /// By how much −2 log L is higher.
    pub rise: f64,
}

impl Rival {
    /// Returns whether it is as likely as the values of an interval of 95 %.
    #[must_use]
    pub fn is_within_95(&self) -> bool {
        self.rise < RISE_95
    }
}

/// How much a quantity differs from shot to shot beyond the noise of the frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// The quantity.
    pub component: Component,
    /// Standard deviation.
    pub sd: f64,
}

/// The fit of films of discs.
#[derive(Clone)]
pub struct DiscFit {
    /// The minimum. Its first sample is of the shots that determine the law.
    pub solution: Solution,
    /// What was measured of each shot, whatever the law.
    pub impacts: Vec<DiscImpact>,
    /// What differs from shot to shot.
    pub scatter: Vec<Scatter>,
    /// Other minima that are nearly as likely.
    pub rivals: Vec<Rival>,
    /// Degrees of freedom of Student's t for intervals: scatter is known from these shots alone; of a
    /// single shot they are those of its frames.
    pub dof: f64,
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
        let ends = |value: f64| {
            if is_positive {
                [-1.0, 1.0].map(|side| value * (side * reach / estimate.value).exp())
            } else {
                [value - reach, value + reach]
            }
        };
        let near = self.rivals.iter().filter(|rival| rival.is_within_95());
        let others = near.filter_map(|rival| match id {
            Id::Mu => Some(rival.mu),
            Id::Kappa => Some(rival.kappa),
            _ => None,
        });
        let all = others.chain([estimate.value]).map(ends);
        let hull = all.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])?;
        let [low, high] = self.solution.problem.unknown(id).bounds;
        Some([hull[0].max(low), hull[1].min(high)])
    }
}

/// Fits the films of discs of a data set.
///
/// # Errors
/// See [`FilmError`].
pub fn fit_discs(dataset: &Dataset, policy: &Policy) -> Result<DiscFit, FilmError> {
    let film = DiscFilm::new(dataset)?;
    let measured = measure(&film, policy)?;
    let impacts = impacts(&film, &measured, policy)?;
    let fault = |impact: &DiscImpact| match impact.stuck {
        Some(_) => Some("the discs stick together".to_owned()),
        None if impact.is_no_collision() => Some("its motion fits no single collision".to_owned()),
        None => impact.find_impossible_restitution(policy).map(|doubt| doubt.to_string()),
    };
    let faults: Vec<Option<String>> = impacts.iter().map(fault).collect();
    let mut left_out = film.left_out.clone();
    let named = impacts.iter().zip(&faults);
    left_out.extend(named.filter_map(|(impact, why)| Some((impact.name.clone(), why.clone()?))));
    let is_usable: Vec<bool> = faults.iter().map(Option::is_none).collect();
    if !is_usable.contains(&true) {
        return Err(FilmError::NoImpact(left_out));
    }
    let findings = film.findings.clone();
    let mut run = Run { policy, settings: dataset.settings, free: measured, findings };
    run.keep(&is_usable);
    run.fit(&film, impacts, left_out)
}

pub(super) struct Run<'a> {
    pub policy: &'a Policy,
    pub settings: Settings,
    /// The problem without a law.
    pub free: Reached,
    pub findings: Vec<Finding>,
}

impl Run<'_> {
    /// Keeps the shots for which `keep` is true.
    fn keep(&mut self, keep: &[bool]) {
        let mut state = self.free.descent.end.state.clone();
        self.free.problem.retain(0, &mut state, keep);
        self.free.descent.end = self.free.problem.evaluate(state);
    }

    /// Fits the law that all shots share, leaving out shots that do not follow it.
    fn fit(
        mut self,
        film: &DiscFilm,
        impacts: Vec<DiscImpact>,
        left_out: Vec<(String, String)>,
    ) -> Result<DiscFit, FilmError> {
        let (mut best, mut rivals) = self.choose_law(&impacts)?;
        for _ in 0..ROUNDS {
            let keep = self.judge_shots(&best)?;
            if keep.iter().all(|keep| *keep) {
                break;
            }
            let names = self.free.names().into_iter().zip(&keep);
            let names = names.filter(|(_, keep)| !**keep).map(|(name, _)| name).collect();
            self.findings.push(Finding::LostShots { names });
            self.keep(&keep);
            (best, rivals) = self.choose_law(&impacts)?;
        }
        self.resolve_conflicts(&mut best)?;
        let best = best.solution(film)?;
        let Solution { problem, at, covariance, converged, .. } = &best;
        let block = problem.discs().ok_or(FilmError::NoFilm)?;
        // a single shot shows no law, nor do shots whose slip is free
        let shows_law = block.shots.iter().filter(|shot| shot.knows_slip).count() > 1;
        self.find_undetermined(problem, &at.state.shared, covariance, shows_law);
        let scatter = list_scatter(block);
        let dof = if block.shots.len() > 1 { block.shots.len() as f64 - 1.0 } else { NORMAL };
        // if the shots determine no friction, any other is as likely
        rivals.retain(|_| shows_law && covariance.sd(Id::Mu as usize).is_some());
        if !converged {
            self.findings.push(Finding::NotConverged);
        }
        let misfit = impacts.iter().map(|impact| impact.misfit).fold(0.0, f64::max);
        let solution = Solution { findings: self.findings, left_out, misfit, ..best };
        Ok(DiscFit { solution, impacts, scatter, rivals, dof })
    }

    /// Returns whether each shot is kept: its e and J_t/J_n, momentum, spins and distance differ from
    /// those of the others by no more than chance makes them.
    fn judge_shots(&self, fit: &Reached) -> Result<Vec<bool>, FilmError> {
        let block = fit.block()?;
        let at = &fit.descent.end;
        let reduced = at.eliminate(&fit.problem, 0.0).ok_or(FilmError::Undetermined)?;
        let probability = |i: usize| {
            let own = &reduced.own[0][i].covariance;
            let squares = block.own_priors(i).into_iter().filter_map(|(place, prior)| {
                let OwnPrior::Spread(which) = prior else { return None };
                let sd = block.spreads[which].sd;
                let expected = sd * sd - own[(place, place)];
                // what the frames do not show says nothing
                (expected > 1e-3 * sd * sd).then(|| fit.own()[i][place].powi(2) / expected)
            });
            let squares: Vec<f64> = squares.collect();
            let largest = squares.iter().copied().fold(0.0, f64::max);
            squares.len() as f64 * ChiSquared::new(1.0).map_or(1.0, |chi2| chi2.sf(largest))
        };
        let keep: Vec<bool> =
            (0..block.shots.len()).map(|i| probability(i) > self.policy.shot_tail).collect();
        let lost = keep.iter().filter(|keep| !**keep).count();
        let too_many = lost as f64 > self.policy.max_lost * keep.len() as f64;
        Ok(if too_many { vec![true; keep.len()] } else { keep })
    }

    /// Leaves out priors that the frames contradict, the worst first.
    fn resolve_conflicts(&mut self, fit: &mut Reached) -> Result<(), FilmError> {
        for _ in 0..ROUNDS {
            let estimates = Estimates::new(&fit.problem, &fit.descent.end).ok_or(FilmError::Undetermined)?;
            let conflicts = estimates.conflicts(&fit.problem, &fit.descent.end);
            let worst = conflicts.into_iter().max_by(|a, b| a.size.abs().total_cmp(&b.size.abs()));
            let Some(worst) = worst.filter(|worst| worst.size.abs() > self.policy.conflict) else { break };
            let Some(prior) = fit.problem.unknown_mut(worst.id).prior.take() else { break };
            // with the prior, what it contradicts counts as scatter of the shots
            let mut scattering = fit.problem.clone();
            for spread in &mut scattering.discs_mut().ok_or(FilmError::NoFilm)?.spreads {
                spread.sd = spread.first;
            }
            let state = fit.descent.end.state.clone();
            let mut there = state.clone();
            let [low, high] = fit.problem.unknown(worst.id).bounds;
            there.shared[worst.id] = worst.estimate.clamp(low, high);
            let mut best: Option<Reached> = None;
            for (mut problem, start) in [(fit.problem.clone(), state), (scattering, there)] {
                let descent = settle(&mut problem, start);
                let reached = Reached::new(problem, descent)?;
                if best.as_ref().is_none_or(|best| reached.unlikely < best.unlikely) {
                    best = Some(reached);
                }
            }
            *fit = best.ok_or(FilmError::NoStart)?;
            let estimates = Estimates::new(&fit.problem, &fit.descent.end).ok_or(FilmError::Undetermined)?;
            let estimate = fit.shared()[worst.id];
            let sd = estimates.sd(worst.id as usize).unwrap_or(worst.sd);
            let size = (estimate - prior.mean) / sd.hypot(prior.sd);
            self.findings.push(Finding::Conflict { id: worst.id, stated: prior.mean, estimate, sd, size });
        }
        Ok(())
    }

    /// Finds which unknowns of the law the shots do not determine.
    fn find_undetermined(
        &mut self,
        problem: &Problem,
        shared: &Shared,
        estimates: &Estimates,
        shows_law: bool,
    ) {
        for id in [Id::Mu, Id::E, Id::Kappa] {
            let (unknown, value) = (problem.unknown(id), shared[id]);
            let sd = estimates.sd(id as usize);
            let is_shown = sd.is_some() && (id == Id::E || shows_law);
            if unknown.mode != Mode::Free || is_shown {
                continue;
            }
            self.findings.push(if unknown.bounds.contains(&value) {
                Finding::AtBound { id, bound: value }
            } else {
                Finding::Undetermined { id, sd: sd.unwrap_or(f64::INFINITY) }
            });
        }
    }
}

/// Returns how much shots differ, by nothing where the frames do not show it.
fn list_scatter(block: &DiscBlock) -> Vec<Scatter> {
    let priors: Vec<OwnPrior> =
        (0..block.shots.len()).flat_map(|i| block.own_priors(i)).map(|(_, prior)| prior).collect();
    let of_component = |(which, component): (usize, Component)| {
        let is_shown = priors.contains(&OwnPrior::Spread(which));
        Scatter { component, sd: if is_shown { block.spreads[which].sd } else { 0.0 } }
    };
    Component::ALL.into_iter().enumerate().map(of_component).collect()
}
