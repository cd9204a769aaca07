//! The fit of films of discs: the law of friction that all shots share, rigid or compliant, from
//! several starts, after the outcome of each shot was measured without a law.

use super::impact::DiscImpact;
use super::measure::{ROUNDS, measure_discs, settle, solve};
use super::motion;
use super::own::{self, Component, LAW};
use crate::measurement::dataset::Dataset;
use crate::measurement::parameter::{Compliance, Settings};
use crate::problem::evaluation::Evaluation;
use crate::problem::false_shots::{Squares, judge};
use crate::problem::film::causes::explain;
use crate::problem::film::dual::{constant, gradient};
use crate::problem::film::film_data::FilmError;
use crate::problem::film::priors::list_contact;
use crate::problem::findings::Finding;
use crate::problem::minimise::{different, grid};
use crate::problem::policy::POLICY;
use crate::problem::problem::{Prepared, State};
use crate::problem::solution::Solution;
use crate::problem::sums::Scattered;
use crate::problem::unknowns::{Id, Mode, Unknown};

/// Smallest κ of a compliant contact: (2 − ν)/(2 (1 − ν)) of elastic bodies is 1 at ν = 0 and more
/// else (Mindlin 1949, J. Appl. Mech. 16, 259); soft rims give way along the surface still more.
const LEAST_KAPPA: f64 = 1.0;

/// Values of κ from which descents begin: the likeliest ones.
const STARTS: usize = 4;

/// Shots that determine a compliance at least, twice its three unknowns: in 37 films each of 3, 5,
/// 10 and 17 of 20 shots of rigid pucks that scatter it was let in in 4, 2, 1 and 0.
const LEAST_SHOTS: usize = 6;

/// The fit of films of discs.
pub(crate) struct DiscFit {
    /// The minimum. Its first sample is of the shots that determine the law.
    pub(crate) solution: Solution,
    /// The measurements of each shot without a law.
    pub(crate) impacts: Vec<DiscImpact>,
    /// Other minima that are nearly as likely, with the difference of −2 log L as that of their χ².
    pub(crate) others: Vec<Evaluation>,
}

/// Fits the films of discs of a data set: the contact as stated, or else a rigid one, or a
/// compliant one if that is open and the shots show it.
///
/// # Errors
/// See [`FilmError`].
pub(crate) fn fit_discs(dataset: &Dataset) -> Result<DiscFit, FilmError> {
    let (solution, impacts) = measure_discs(dataset)?;
    let mut free = solution.again();
    let fault = |impact: &DiscImpact| Some((impact.name.clone(), impact.find_fault()?));
    free.record.left_out.extend(impacts.iter().filter_map(fault));
    let is_usable = |name: &String| free.record.left_out.iter().all(|(other, _)| other != name);
    let usable: Vec<bool> = free.problem.samples[0].names.iter().map(is_usable).collect();
    if !usable.contains(&true) {
        return Err(FilmError::NoImpact(free.record.left_out));
    }
    free.problem.retain(&mut free.start, &usable);
    let (mut fits, mut compliance) = choose_law(&free, &dataset.settings)?;
    for _ in 0..ROUNDS {
        let keep = judge_shots(&fits[0])?;
        if !keep.contains(&false) {
            break;
        }
        free.leave_out(&keep);
        (fits, compliance) = choose_law(&free, &dataset.settings)?;
    }
    free.record.findings.extend(compliance);
    let mut best = fits.remove(0);
    let rivals = fits.into_iter().map(|other| (other.unlikely() - best.unlikely(), other.at));
    let rivals: Vec<(f64, Evaluation)> = rivals.filter(|(rise, _)| *rise < POLICY.cause).collect();
    for _ in 0..ROUNDS {
        let Some(refit) = explain(&best.problem, &best.at, &best.covariance) else { break };
        free.record.findings.extend(refit.finding);
        best = solve(refit.problem, refit.descent, best.record)?;
    }
    let others =
        rivals.into_iter().map(|(rise, at)| Evaluation { cost: best.at.cost + rise, ..at }).collect();
    let solution = Solution { record: free.record, ..best };
    Ok(DiscFit { solution, impacts, others })
}

/// Returns the minima with the likelier law, the likeliest first, and the finding that its contact
/// is compliant though that is not stated.
fn choose_law(free: &Prepared, settings: &Settings) -> Result<(Vec<Solution>, Option<Finding>), FilmError> {
    let block = free.problem.discs().ok_or(FilmError::NoFilm)?;
    let shots = block.shots.len();
    let shows_friction = block.knows_slips();
    let mut law = Unknown::list();
    list_contact(&mut law, settings);
    // discs do not press on a cloth
    law[Id::MuS as usize].mode = Mode::Fixed;
    let bounds = &mut law[Id::Kappa as usize].bounds;
    bounds[0] = bounds[0].max(LEAST_KAPPA);
    if !shows_friction {
        law[Id::Kappa as usize].start = 0.0;
        for id in [Id::Mu, Id::Kappa] {
            law[id as usize].mode = Mode::Fixed;
        }
    }
    let stated = fit_law(free, &law)?;
    if settings.compliance != Compliance::Auto || shots < LEAST_SHOTS || !shows_friction {
        return Ok((stated, None));
    }
    law[Id::Kappa as usize].mode = Mode::Free;
    let compliant = fit_law(free, &law)?;
    // beyond the equations that define the parameters only if the shots show it
    let fall = stated[0].unlikely() - compliant[0].unlikely();
    if fall <= POLICY.cause {
        return Ok((stated, None));
    }
    let kappa = compliant[0].value(Id::Kappa);
    Ok((compliant, Some(Finding::Compliance { kappa, shots, fall, adopted: true })))
}

/// Descends with these unknowns of the law from the likeliest μ of the likeliest values of κ;
/// returns the minima, the likeliest first.
fn fit_law(free: &Prepared, law: &[Unknown]) -> Result<Vec<Solution>, FilmError> {
    let (mut problem, mut first) = (free.problem.clone(), free.start.clone());
    let block = problem.discs_mut().ok_or(FilmError::NoFilm)?;
    // what the law leaves is scatter of the shots
    (block.has_law, block.variation.is_stated) = (true, true);
    for unknown in &law[..LAW] {
        *problem.unknown_mut(unknown.id) = *unknown;
        first.shared[unknown.id] = unknown.start;
    }
    let likeliest = |of_kappa: Vec<State>| {
        let all = of_kappa.into_iter().map(|state| problem.evaluate(state));
        all.min_by(|a, b| a.cost.total_cmp(&b.cost))
    };
    let mut starts: Vec<Evaluation> = grid(&problem, &first).into_iter().filter_map(likeliest).collect();
    starts.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let starts = starts.into_iter().take(STARTS);
    let fits = starts.filter_map(|start| {
        let (problem, record) = (problem.clone(), free.record.clone());
        settle(Prepared { problem, start: start.state, record }).ok()
    });
    let mut fits: Vec<Solution> = fits.filter(|fit| fit.at.cost.is_finite()).collect();
    fits.sort_by(|a, b| a.unlikely().total_cmp(&b.unlikely()));
    let fits = different(&problem, fits, Solution::state);
    if fits.is_empty() { Err(FilmError::Undetermined) } else { Ok(fits) }
}

/// Returns whether each shot is kept: its e and J_t/J_n, momentum, spins and distance differ from
/// those of the others by no more than chance makes them.
fn judge_shots(fit: &Solution) -> Result<Vec<bool>, FilmError> {
    let spreads = &fit.problem.samples[0].block.variation().spreads;
    let reduced = fit.at.reduced().ok_or(FilmError::Undetermined)?;
    let squares = |(i, scattered): (usize, &Vec<Scattered>)| {
        let squares: Vec<f64> = scattered
            .iter()
            .filter_map(|number| {
                let variance = spreads[number.spread].sd.powi(2);
                let expected = variance - reduced.own[0][i].variance(&number.by);
                // quantities that the frames do not show do not count
                (expected > 1e-3 * variance).then(|| number.value.powi(2) / expected)
            })
            .collect();
        Squares { sum: squares.iter().sum(), count: squares.len() as f64 }
    };
    let scattered = fit.at.shots[0].iter().map(|shot| &shot.scattered).enumerate();
    Ok(judge(&scattered.map(squares).collect::<Vec<_>>(), (0.0, 1.0)))
}

impl DiscFit {
    /// Returns the standard deviation from shot to shot of each [`Component`], 0 if the frames do
    /// not show it.
    pub(crate) fn scatter(&self) -> [f64; Component::ALL.len()] {
        let mut scatter = [0.0; Component::ALL.len()];
        let spreads = &self.solution.problem.samples[0].block.variation().spreads;
        for number in self.solution.at.shots[0].iter().flat_map(|shot| &shot.scattered) {
            scatter[number.spread] = spreads[number.spread].sd;
        }
        scatter
    }

    /// Returns the root mean square over the shots of what J_t/J_n scatters by, also as μ does.
    pub(crate) fn scatter_of_ratio(&self) -> f64 {
        let [_, ratio, .., mu] = self.scatter();
        let numbers = self.solution.at.shots[0].iter().flat_map(|shot| &shot.scattered);
        let ratios = numbers.filter(|number| number.place == own::RATIO);
        let squares = ratios.map(|number| ratio.hypot(mu * number.by[own::FRICTION]).powi(2));
        let squares: Vec<f64> = squares.collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    }
}

impl Solution {
    /// Returns J_t/J_n on the second of two discs of a fit of discs that close and slip with these
    /// velocities, m/s, and its derivative by μ.
    pub(crate) fn impulse_ratio(&self, [closing, slip]: [f64; 2]) -> Option<[f64; 2]> {
        let inertia = self.problem.discs()?.discs.inertia;
        let shared = &self.state().shared;
        let (closing, off) = (constant(closing), constant(0.0).derivative(own::FRICTION));
        let e = motion::restitution(&closing, shared);
        let ratio = motion::impulse_ratio([closing, constant(slip), e, off], shared, inertia)?;
        Some([ratio.re, gradient(&ratio)[own::FRICTION]])
    }
}
