//! The fit of a film from beginning to end.

use super::block::Block;
use super::descent::Descent;
use super::film::causes;
use super::film::first_guess::{Film, FilmError};
use super::film::motion::Approach;
use super::film::outliers::{judge_shots, leave_out_frames};
use super::film::own;
use super::film::spins::ShotSpin;
use super::findings::{Finding, Severity, worst};
use super::minimise::{descend_with_noise, fit};
use super::policy::Policy;
use super::problem::{Problem, State};
use super::sums::Noise;
use super::uncertainty::{Estimates, Share};
use super::unknowns::{Id, Mode, Normal, Own, Shared};
use crate::measurement::dataset::Dataset;

/// Rounds of leaving out frames and shots.
const ROUNDS: usize = 3;

/// Causes that are let in one after the other.
const MAX_CAUSES: usize = 3;

/// The estimate of a shared unknown.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// The unknown.
    pub id: Id,
    /// Its estimate.
    pub value: f64,
    /// Its standard error; `None` at a bound.
    pub std_error: Option<f64>,
    /// What was known of it before the frames were seen.
    pub prior: Option<Normal>,
}

/// The error budget of an estimate: the parts of its variance, the largest first, and the noise of
/// the frames.
#[derive(Clone, Debug)]
pub struct Budget {
    /// The estimate's unknown.
    pub id: Id,
    /// Parts of nuisance parameters.
    pub shares: Vec<Share>,
    /// Variance that is left if all nuisance parameters are known.
    pub frames: f64,
}

/// The fit of a film.
pub struct FilmFit {
    /// Estimates of all shared unknowns that were free.
    pub estimates: Vec<Estimate>,
    /// Error budgets of the wanted unknowns.
    pub budgets: Vec<Budget>,
    /// What is wrong or worth saying.
    pub findings: Vec<Finding>,
    /// Noise of the frames of the cue balls and of the object balls.
    pub noise: [Noise; 2],
    /// Variance of slow motions over that of the noise before the impacts.
    pub misfit: f64,
    /// Number of shots that were fitted.
    pub shots: usize,
    /// Names and reasons of the shots that show no impact.
    pub left_out: Vec<(String, String)>,
    /// Evaluations of all frames.
    pub evaluations: usize,
    /// Tangential compliance of the contact; 0 if it is rigid.
    pub kappa: f64,
    /// Names of the shots that were fitted.
    pub names: Vec<String>,
    pub(crate) problem: Problem,
    pub(crate) state: State,
}

impl FilmFit {
    /// Returns the estimate of an unknown that was free.
    #[must_use]
    pub fn get(&self, id: Id) -> Option<&Estimate> {
        self.estimates.iter().find(|estimate| estimate.id == id)
    }

    /// Returns the change of each wanted estimate if each shot were left out, in the order of the
    /// shots.
    #[must_use]
    pub fn influence(&self) -> Vec<(String, Vec<(Id, f64)>)> {
        let at = self.problem.evaluate(self.state.clone());
        let Some(estimates) = Estimates::new(&self.problem, &at) else { return Vec::new() };
        let of_shot = |(i, name): (usize, &String)| {
            let change = estimates.influence(&self.problem, &at, i)?;
            let of = |id: Id| Some((id, change[estimates.position(id as usize)?]));
            let wanted = Id::WANTED.into_iter().filter_map(of);
            Some((name.clone(), wanted.collect()))
        };
        self.names.iter().enumerate().filter_map(of_shot).collect()
    }

    /// Returns the topspin of each shot over natural roll, with its name; 1 for a ball that rolls.
    #[must_use]
    pub fn topspins(&self) -> Vec<(String, f64)> {
        let Some(film) = self.problem.film() else { return Vec::new() };
        let shots = film.spins.iter().zip(&self.state.own[0]).zip(&self.names);
        let of_shot = |((spin, own), name): ((&ShotSpin, &Own), &String)| {
            let rolls = spin.stated.approach == Approach::Rolls;
            let topspin = if rolls { 1.0 } else { spin.mean(&self.state.shared) + own[own::TOPSPIN] };
            (name.clone(), topspin)
        };
        shots.map(of_shot).collect()
    }

    /// Returns the fall of −2 log L if spins that differ from those stated explain the frames and
    /// nothing else is wrong with them.
    #[must_use]
    pub fn explained_by_spins(&self) -> Option<f64> {
        let mut fall = None;
        for finding in &self.findings {
            match finding {
                Finding::Spins { fall: by, .. } => fall = Some(*by),
                Finding::Undetermined { .. } | Finding::AtBound { .. } | Finding::LostShots { .. } => {}
                _ => return None,
            }
        }
        fall
    }

    /// Returns whether the frames hardly determine a wanted unknown: its error is more than half of
    /// what it is known to without them, or a finding says so.
    #[must_use]
    pub fn is_undetermined(&self, id: Id) -> bool {
        let is_of = |finding: &Finding| matches!(finding, Finding::Undetermined { id: of, .. } if *of == id);
        let is_prior = |estimate: &Estimate| {
            estimate.prior.zip(estimate.std_error).is_some_and(|(prior, sd)| sd > 0.5 * prior.sd)
        };
        self.findings.iter().any(is_of) || self.get(id).is_some_and(is_prior)
    }

    /// Returns the worst severity of the findings.
    #[must_use]
    pub fn severity(&self) -> Severity {
        worst(&self.findings)
    }
}

/// Fits the film of a data set.
///
/// # Errors
/// See [`FilmError`].
pub fn fit_film(dataset: &Dataset, policy: &Policy) -> Result<FilmFit, FilmError> {
    let Film { block, unknowns, own, names, left_out, findings } = Film::new(dataset)?;
    let first_noise = block.world.noise;
    let start =
        State { own: vec![own], shared: Shared(unknowns.iter().map(|unknown| unknown.start).collect()) };
    let problem = Problem::of_one(Block::Film(block), unknowns);
    let left_out = left_out.into_iter().map(|(name, why)| (name, why.to_string())).collect();
    let mut run = Run { policy, problem, names, findings, left_out, evaluations: 0 };
    let mut descent = run.minimise(&start)?;
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
    if let Some((problem, refit, _)) = causes::comply(&run.problem, &descent.end, policy) {
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
    }
    let misfit = slow_variance(&run.noise(), &first_noise);
    if misfit > policy.misfit {
        run.findings.push(Finding::Misfit { ratio: misfit });
    }
    if !descent.converged {
        run.findings.push(Finding::NotConverged);
    }
    Ok(run.finish(&descent, &estimates, misfit))
}

/// Returns the variance of slow motions, σ²(1 + ρ)/(1 − ρ), over that of another noise.
fn slow_variance(noise: &[Noise; 2], first: &[Noise; 2]) -> f64 {
    let variance = |noise: &Noise| noise.sd * noise.sd * (1.0 + noise.rho) / (1.0 - noise.rho);
    let ratios = noise.iter().zip(first).map(|(noise, first)| variance(noise) / variance(first));
    ratios.fold(0.0, f64::max)
}

struct Run<'a> {
    policy: &'a Policy,
    problem: Problem,
    names: Vec<String>,
    findings: Vec<Finding>,
    left_out: Vec<(String, String)>,
    evaluations: usize,
}

impl Run<'_> {
    /// Minimises, leaving out frames and shots that fit no collision.
    fn minimise(&mut self, start: &State) -> Result<Descent, FilmError> {
        let mut descent = fit(&mut self.problem, start).ok_or(FilmError::NoStart)?;
        self.evaluations += descent.evaluations;
        for round in 0..ROUNDS {
            let mut state = descent.end.state.clone();
            // wrong frames are left out before shots are judged
            let keep = if round == 0 {
                vec![true; self.names.len()]
            } else {
                judge_shots(&descent.end.shots[0], self.policy)
            };
            let lost: Vec<String> = self
                .names
                .iter()
                .zip(&keep)
                .filter(|(_, keep)| !**keep)
                .map(|(name, _)| name.clone())
                .collect();
            let frames = match self.problem.film_mut() {
                Some(film) => leave_out_frames(film, &state.own[0], &state.shared, self.policy),
                None => 0,
            };
            if lost.is_empty() && frames == 0 && round > 0 {
                break;
            }
            if lost.is_empty() && frames == 0 {
                continue;
            }
            if !lost.is_empty() {
                self.problem.retain(0, &mut state, &keep);
                let mut keep = keep.iter();
                self.names.retain(|_| keep.next().copied().unwrap_or(true));
                self.findings.push(Finding::LostShots { names: lost });
            }
            descent = descend_with_noise(&mut self.problem, state);
            self.evaluations += descent.evaluations;
        }
        Ok(descent)
    }

    /// Returns the noise of the frames of each ball.
    fn noise(&self) -> [Noise; 2] {
        self.problem.film().map_or([Noise { sd: f64::NAN, rho: 0.0 }; 2], |film| film.world.noise)
    }

    fn adopt(&mut self, problem: Problem, refit: Descent, descent: &mut Descent) {
        self.evaluations += refit.evaluations;
        self.problem = problem;
        *descent = refit;
    }

    fn estimates(&self, descent: &Descent) -> Result<Estimates, FilmError> {
        Estimates::new(&self.problem, &descent.end).ok_or(FilmError::Undetermined)
    }

    fn finish(mut self, descent: &Descent, estimates: &Estimates, misfit: f64) -> FilmFit {
        let state = descent.end.state.clone();
        let free = self.problem.unknowns.iter().filter(|unknown| unknown.mode == Mode::Free);
        let all: Vec<Estimate> = free
            .map(|unknown| Estimate {
                id: unknown.id,
                value: state.shared[unknown.id],
                std_error: estimates.sd(unknown.id as usize),
                prior: unknown.prior,
            })
            .collect();
        for id in Id::WANTED {
            let bounds = self.problem.unknown(id).bounds;
            let Some(estimate) = all.iter().find(|estimate| estimate.id == id) else { continue };
            match estimate.std_error {
                None if !bounds.contains(&estimate.value) => {
                    self.findings.push(Finding::Undetermined { id, sd: f64::INFINITY });
                }
                None => self.findings.push(Finding::AtBound {
                    id,
                    bound: if estimate.value == bounds[0] { bounds[0] } else { bounds[1] },
                }),
                Some(sd) if id == Id::MuS && sd > self.policy.undetermined_mu_s => {
                    self.findings.push(Finding::Undetermined { id, sd });
                }
                Some(_) => {}
            }
        }
        let budgets = Id::WANTED.into_iter().filter_map(|id| {
            let (shares, frames) = estimates.budget(&self.problem, id as usize, &Id::WANTED)?;
            Some(Budget { id, shares, frames })
        });
        let noise = self.noise();
        FilmFit {
            estimates: all,
            budgets: budgets.collect(),
            findings: self.findings,
            noise,
            misfit,
            shots: self.names.len(),
            left_out: self.left_out,
            evaluations: self.evaluations,
            kappa: state.shared[Id::Kappa],
            names: self.names,
            problem: self.problem,
            state,
        }
    }
}
