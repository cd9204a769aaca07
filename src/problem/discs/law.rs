//! The fit of films of discs: the law of friction that all shots share, rigid or compliant, from
//! several starts, after the outcome of each shot was measured without a law.

use super::impact::DiscImpact;
use super::measure::{MeasuredDiscs, ROUNDS, measure, settle, solve};
use super::motion::Friction;
use super::own::{Component, LAW};
use crate::measurement::dataset::Dataset;
use crate::measurement::parameter::{Compliance, Settings};
use crate::numerics::SIGNIFICANT;
use crate::problem::false_shots::tail;
use crate::problem::film::causes::explain;
use crate::problem::film::film_data::FilmError;
use crate::problem::film::priors::list_contact;
use crate::problem::findings::Finding;
use crate::problem::minimise::{different, grid};
use crate::problem::policy::Policy;
use crate::problem::problem::{Evaluation, Problem, State, split_names};
use crate::problem::solution::Solution;
use crate::problem::unknowns::{Id, Mode, Own, Unknown};

/// Smallest κ of a compliant contact.
const LEAST_KAPPA: f64 = 0.1;

/// Values of μ and κ from which descents begin: the likeliest ones.
const STARTS: usize = 4;

/// Shots that determine a compliance at least, twice its three unknowns: in 37 films each of 3, 5,
/// 10 and 17 of 20 shots of rigid pucks that scatter it was let in in 4, 2, 1 and 0.
const LEAST_SHOTS: usize = 6;

/// The fit of films of discs.
#[derive(Clone)]
pub(crate) struct DiscFit {
    /// The minimum. Its first sample is of the shots that determine the law.
    pub(crate) solution: Solution,
    /// The measurements of each shot without a law.
    pub(crate) impacts: Vec<DiscImpact>,
    /// Other minima that are nearly as likely, with the difference of −2 log L as that of their χ².
    pub(crate) others: Vec<Evaluation>,
    /// Unknowns that were held since the shots do not determine them.
    pub(crate) undetermined: Vec<Id>,
}

/// Fits the films of discs of a data set.
///
/// # Errors
/// See [`FilmError`].
pub(crate) fn fit_discs(dataset: &Dataset, policy: &Policy) -> Result<DiscFit, FilmError> {
    let MeasuredDiscs { solution: mut free, impacts } = measure(dataset, policy)?;
    let mut keep = Vec::new();
    for impact in &impacts {
        let fault = impact.find_fault(policy);
        keep.push(fault.is_none());
        free.left_out.extend(fault.map(|why| (impact.name.clone(), why)));
    }
    if !keep.contains(&true) {
        return Err(FilmError::NoImpact(free.left_out));
    }
    let mut shots = Shots { policy, settings: &dataset.settings, free };
    let mut fits = Vec::new();
    for round in 0..=ROUNDS {
        let names = shots.keep(&keep);
        shots.free.findings.extend((round > 0).then_some(Finding::LostShots { names }));
        fits = shots.choose_law()?;
        keep = judge_shots(&fits[0], policy)?;
        if !keep.contains(&false) {
            break;
        }
    }
    let mut best = fits.remove(0);
    let rivals = fits.into_iter().map(|other| (unlikely(&other) - unlikely(&best), other.at));
    let rivals: Vec<(f64, Evaluation)> = rivals.filter(|(rise, _)| *rise < policy.cause).collect();
    for _ in 0..ROUNDS {
        let Some(refit) = explain(&best.problem, &best.at, &best.covariance, policy) else { break };
        shots.free.findings.extend(refit.finding);
        best = solve(refit.problem, refit.descent)?;
    }
    let mut undetermined = Vec::new();
    for id in [Id::Mu, Id::E, Id::Kappa] {
        let (unknown, bound) = (best.problem.unknown(id), best.value(id));
        let is_free = unknown.mode == Mode::Free;
        if best.covariance.sd(id as usize).is_none() && (is_free || shots.law(id).mode == Mode::Free) {
            let is_at_bound = is_free && unknown.bounds.contains(&bound);
            shots.free.findings.push(if is_at_bound {
                Finding::AtBound { id, bound }
            } else {
                Finding::Undetermined { id, sd: f64::INFINITY }
            });
            // others that χ² does not depend on have a bound
            undetermined.extend((!is_free).then_some(id));
        }
    }
    if !best.converged {
        shots.free.findings.push(Finding::NotConverged);
    }
    let others = rivals.into_iter().map(|(rise, at)| at.costing(best.at.cost + rise)).collect();
    let Solution { findings, left_out, unit, middle, .. } = shots.free;
    let solution = Solution { findings, left_out, unit, middle, ..best };
    Ok(DiscFit { solution, impacts, others, undetermined })
}

/// The shots that the law is fitted to.
struct Shots<'a> {
    policy: &'a Policy,
    settings: &'a Settings,
    /// The problem without a law.
    free: Solution,
}

impl Shots<'_> {
    /// Keeps the shots for which `keep` is true; returns the names of the others.
    fn keep(&mut self, keep: &[bool]) -> Vec<String> {
        let Solution { problem, at, names, .. } = &mut self.free;
        let mut state = at.state.clone();
        problem.retain(0, &mut state, keep);
        *at = problem.evaluate(state);
        split_names(&mut names[0], keep)
    }

    /// Returns an unknown of the law as the data set states it.
    fn law(&self, id: Id) -> Unknown {
        let mut all = Unknown::list();
        list_contact(&mut all, self.settings);
        all[id as usize]
    }

    /// Returns whether the shots show a law: a single one does not, nor do shots whose slip is
    /// free.
    fn show_law(&self) -> bool {
        let block = self.free.problem.discs();
        block.is_some_and(|block| block.shots.iter().filter(|shot| shot.knows_slip).count() > 1)
    }

    /// Fits the contact as stated, or else a rigid one, and a compliant one if that is open; returns
    /// the minima of the likelier one, the likeliest first.
    fn choose_law(&mut self) -> Result<Vec<Solution>, FilmError> {
        let shots = self.free.names[0].len();
        let rigid = self.fit_law(false)?;
        let is_open = self.settings.compliance == Compliance::Auto;
        if !is_open || shots < LEAST_SHOTS || !self.show_law() {
            return Ok(rigid);
        }
        let compliant = self.fit_law(true)?;
        // beyond the equations that define the parameters only if the shots show it
        let fall = unlikely(&rigid[0]) - unlikely(&compliant[0]);
        if fall <= self.policy.cause {
            return Ok(rigid);
        }
        let kappa = compliant[0].value(Id::Kappa);
        self.free.findings.push(Finding::Compliance { kappa, shots, fall, adopted: true });
        Ok(compliant)
    }

    /// Descends from the most promising values of μ and κ, first with the spreads before the frames
    /// are seen, then with spreads of their own; returns the minima, the likeliest first.
    fn fit_law(&self, is_compliant: bool) -> Result<Vec<Solution>, FilmError> {
        let problem = self.with_law(is_compliant)?;
        let ends = self.starts(&problem).into_iter().map(|start| problem.descend(start).end);
        let mut ends: Vec<Evaluation> = ends.filter(|end| end.cost.is_finite()).collect();
        ends.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let ends = different(&problem, ends, |end| &end.state).into_iter();
        let mut fits: Vec<Solution> =
            ends.map(|end| settle(problem.clone(), end.state)).collect::<Result<_, _>>()?;
        fits.sort_by(|a, b| unlikely(a).total_cmp(&unlikely(b)));
        let fits = different(&problem, fits, Solution::state);
        if fits.is_empty() { Err(FilmError::NoStart) } else { Ok(fits) }
    }

    /// Returns the states of a grid by which the measured J_t/J_n are likely, of each κ the likeliest
    /// one.
    fn starts(&self, problem: &Problem) -> Vec<State> {
        let mut first = self.free.at.state.clone();
        for id in LAW {
            first.shared[id] = problem.unknown(id).start;
        }
        let with_misfit = |state: State| (misfit(problem, &state), state);
        let best =
            |of_kappa: Vec<State>| of_kappa.into_iter().map(with_misfit).min_by(|a, b| a.0.total_cmp(&b.0));
        let mut starts: Vec<(f64, State)> = grid(problem, &first).into_iter().filter_map(best).collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        starts.into_iter().take(STARTS).map(|(_, state)| state).collect()
    }

    /// Returns the problem of all shots with a law in common.
    fn with_law(&self, is_compliant: bool) -> Result<Problem, FilmError> {
        let mut problem = self.free.problem.clone();
        problem.discs_mut().ok_or(FilmError::NoFilm)?.has_law = true;
        for id in LAW {
            *problem.unknown_mut(id) = self.law(id);
        }
        let kappa = problem.unknown_mut(Id::Kappa);
        kappa.bounds[0] = kappa.bounds[0].max(LEAST_KAPPA);
        if is_compliant {
            kappa.mode = Mode::Free;
        }
        if !self.show_law() {
            (kappa.mode, kappa.start) = (Mode::Fixed, 0.0);
            problem.unknown_mut(Id::Mu).mode = Mode::Fixed;
        }
        Ok(problem)
    }
}

/// Returns how far J_t/J_n of the shots are off the law, in squares of their scatter; outlying shots
/// count no more than significant ones.
fn misfit(problem: &Problem, state: &State) -> f64 {
    let Some(block) = problem.discs() else { return f64::NAN };
    let of_shot = |(i, own): (usize, &Own)| block.deviations(i, own, &state.shared);
    let all = state.own[0].iter().enumerate().flat_map(of_shot).filter(|number| number.spread == 1);
    all.map(|number| (number.value / block.spreads[1].sd).powi(2).min(SIGNIFICANT * SIGNIFICANT)).sum()
}

/// Returns −2 log L up to a constant, with the own unknowns integrated.
fn unlikely(fit: &Solution) -> f64 {
    let reduced = fit.at.eliminate(&fit.problem, 0.0);
    fit.minus_two_log().0 + reduced.map_or(f64::INFINITY, |reduced| reduced.own_ln_determinant)
}

/// Returns whether each shot is kept: its e and J_t/J_n, momentum, spins and distance differ from
/// those of the others by no more than chance makes them.
fn judge_shots(fit: &Solution, policy: &Policy) -> Result<Vec<bool>, FilmError> {
    let block = fit.problem.discs().ok_or(FilmError::NoFilm)?;
    let reduced = fit.at.eliminate(&fit.problem, 0.0).ok_or(FilmError::Undetermined)?;
    let is_likely = |i: usize| {
        let squares = fit.at.shots[0][i].scattered.iter().filter_map(|number| {
            let variance = block.spreads[number.spread].sd.powi(2);
            let expected = variance - reduced.own[0][i].variance(&number.by);
            // quantities that the frames do not show do not count
            (expected > 1e-3 * variance).then(|| number.value.powi(2) / expected)
        });
        let squares: Vec<f64> = squares.collect();
        let largest = squares.iter().copied().fold(0.0, f64::max);
        squares.len() as f64 * tail(largest, 1.0) > policy.shot_tail
    };
    Ok(policy.keep_most((0..block.shots.len()).map(is_likely).collect()))
}

impl DiscFit {
    /// Returns the standard deviation from shot to shot of each [`Component`], 0 if the frames do not
    /// show it.
    pub(crate) fn scatter(&self) -> [f64; Component::ALL.len()] {
        let mut scatter = [0.0; Component::ALL.len()];
        let spreads = self.solution.problem.samples[0].block.spreads();
        for number in self.solution.at.shots[0].iter().flat_map(|shot| &shot.scattered) {
            scatter[number.spread] = spreads[number.spread].sd;
        }
        scatter
    }
}

impl Solution {
    /// Returns J_t/J_n on the second of two discs of a fit of discs that close and slip with these
    /// velocities, m/s.
    pub(crate) fn impulse_ratio(&self, [closing, slip]: [f64; 2]) -> Option<f64> {
        let inertia = self.problem.discs()?.discs.inertia;
        let shared = &self.state().shared;
        let e = shared[Id::E] - shared[Id::ESlope] * closing;
        Some(Friction::new([closing, slip, e], shared, inertia)?.ratio)
    }
}
