//! A minimum, and what is known there: estimates, error budget, influence of shots.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use nalgebra::DVector;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use statrs::distribution::ContinuousCDF;

use super::evaluation::Evaluation;
use super::findings::Finding;
use super::minimise::Descent;
use super::noise::{minus_two_log, unlikely};
use super::problem::{Block, Prepared, Problem, Record, Sample, State};
use super::sums::ShotSums;
use super::uncertainty::Estimates;
use super::unknowns::{Id, Mode, Normal};
use crate::measurement::dataset::Measured;
use crate::measurement::parameter::{Parameter, Settings};

/// The estimate of a shared unknown.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimate {
    pub(crate) id: Id,
    pub(crate) value: f64,
    /// Its standard error; `None` at a bound.
    pub(crate) std_error: Option<f64>,
    /// Prior, if it has one.
    pub(crate) prior: Option<Normal>,
}

/// The error budget of an estimate.
#[derive(Clone, Debug)]
pub(crate) struct Budget {
    /// The estimate's unknown.
    pub(crate) id: Id,
    /// Parts of its standard error, the largest first: name of a nuisance parameter, and what it
    /// would take away to know that exactly; noise of the data, what is left then. Their squares add
    /// up.
    pub(crate) parts: Vec<(&'static str, f64)>,
}

impl Budget {
    /// Returns the standard error.
    pub(crate) fn std_error(&self) -> f64 {
        self.parts.iter().map(|(_, part)| part.powi(2)).sum::<f64>().sqrt()
    }
}

/// How much a fit depends on one shot.
#[derive(Clone, Debug)]
pub(crate) struct ShotInfluence {
    /// Part that the shot has in the fit; over all shots they add up to the number of shared
    /// unknowns that the data determine.
    pub(crate) leverage: f64,
    /// Change of each estimate if the shot were left out, to first order.
    pub(crate) changes: Vec<(Id, f64)>,
}

impl ShotInfluence {
    /// Returns the change of an estimate if the shot were left out.
    pub(crate) fn change(&self, id: Id) -> f64 {
        self.changes.iter().find(|(of, _)| *of == id).map_or(0.0, |(_, by)| *by)
    }
}

/// A minimum of a problem, and what is known there.
#[derive(Clone)]
pub(crate) struct Solution {
    pub(crate) problem: Problem,
    pub(crate) at: Evaluation,
    pub(crate) covariance: Estimates,
    pub(crate) record: Record,
    pub(crate) evaluations: usize,
    /// Whether the descent ended at a minimum.
    pub(crate) converged: bool,
}

impl std::fmt::Debug for Solution {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("Solution").field("estimates", &self.estimates()).finish_non_exhaustive()
    }
}

impl Solution {
    /// Returns the end of a descent as a solution, with the covariance there.
    pub(crate) fn new(problem: Problem, descent: Descent, covariance: Estimates, record: Record) -> Self {
        Self {
            evaluations: problem.evaluations.load(Ordering::Relaxed),
            problem,
            at: descent.end,
            covariance,
            record,
            converged: descent.converged,
        }
    }

    /// Returns the data with a search that begins at the solution.
    pub(crate) fn again(self) -> Prepared {
        Prepared { problem: self.problem, start: self.at.state, record: self.record }
    }

    /// Returns the names of the shots of the first sample.
    pub(crate) fn names(&self) -> &[String] {
        &self.problem.samples[0].names
    }

    /// Returns the values of all unknowns.
    pub(crate) fn state(&self) -> &State {
        &self.at.state
    }

    /// Returns one sample as a solution of its own, with the values and errors that all samples
    /// determine.
    pub(crate) fn of_sample(&self, number: usize) -> Self {
        let sample = &self.problem.samples[number];
        let unknowns = sample.columns.iter().map(|column| self.problem.unknowns[*column]).collect();
        let problem = Problem::of_one(sample.block.clone(), Arc::clone(&sample.names), unknowns);
        let shared = sample.gather(&self.at.state.shared);
        let at = problem.evaluate(State { own: vec![self.at.state.own[number].clone()], shared });
        let known = (0..sample.columns.len()).filter_map(|local| {
            let place = self.covariance.position(sample.columns[local])?;
            Some((local, place))
        });
        let (columns, places): (Vec<usize>, Vec<usize>) = known.unzip();
        let covariance = self.covariance.covariance.select_rows(&places).select_columns(&places);
        Self { problem, at, covariance: Estimates { columns, covariance }, ..self.clone() }
    }

    /// Returns the estimates of all shared unknowns that were free, in the order of the columns.
    pub fn estimates(&self) -> Vec<Estimate> {
        self.problem.free().into_iter().map(|column| self.estimate(column)).collect()
    }

    fn estimate(&self, column: usize) -> Estimate {
        let unknown = &self.problem.unknowns[column];
        Estimate {
            id: unknown.id,
            value: self.at.state.shared.0[column],
            std_error: self.covariance.sd(column),
            prior: unknown.prior,
        }
    }

    /// Returns the estimate of an unknown of the first sample if it was free.
    pub fn get(&self, id: Id) -> Option<Estimate> {
        (self.problem.unknown(id).mode == Mode::Free).then(|| self.estimate(id as usize))
    }

    /// Returns an unknown of the first sample with its standard error, if it was free and has one.
    pub(crate) fn measured(&self, id: Id) -> Option<Measured> {
        let estimate = self.get(id)?;
        Some(Measured::new(estimate.value, estimate.std_error?))
    }

    /// Returns the middle of the impacts in the film at its stated scale, m.
    pub(crate) fn origin(&self) -> [f64; 2] {
        self.record.middle.map(|x| x * self.record.unit)
    }

    /// Returns whether the data depend on an unknown of the only sample, if that was free.
    pub(crate) fn is_informed(&self, id: Id) -> bool {
        let is_free = self.problem.unknown(id).mode == Mode::Free;
        is_free && self.at.slopes_by(id as usize)
    }

    /// Returns the value of an unknown of the first sample, free or held.
    pub fn value(&self, id: Id) -> f64 {
        self.at.state.shared[id]
    }

    /// Returns the index of an unknown of a sample among the unknowns of the problem.
    pub(crate) fn column(&self, sample: usize, id: Id) -> usize {
        self.problem.samples[sample].columns[id as usize]
    }

    /// Returns the unknowns of the only sample that have a standard error, in the order of the
    /// covariance.
    pub(crate) fn determined(&self) -> Vec<Id> {
        self.covariance.columns.iter().map(|column| self.problem.unknowns[*column].id).collect()
    }

    /// Returns the error budget of an unknown of the only sample: its variance nuisance by nuisance,
    /// and the rest, which is the noise of the data; `None` if it has no standard error.
    pub fn budget(&self, id: Id) -> Option<Budget> {
        let ids = self.determined();
        let i = ids.iter().position(|other| *other == id)?;
        let mut left = self.covariance.covariance.clone();
        let mut nuisances: Vec<usize> = (0..ids.len()).filter(|n| !Id::WANTED.contains(&ids[*n])).collect();
        let mut variances = Vec::new();
        while let Some(place) = (0..nuisances.len()).max_by(|a, b| {
            let gain = |n: usize| left[(i, nuisances[n])].powi(2) / left[(nuisances[n], nuisances[n])];
            gain(*a).total_cmp(&gain(*b))
        }) {
            let n = nuisances.swap_remove(place);
            let column: DVector<f64> = left.column(n).into_owned();
            variances.push((ids[n].name(), column[i] * column[i] / column[n]));
            left -= &column * column.transpose() / column[n];
        }
        variances.push(("noise", left[(i, i)]));
        variances.sort_by(|a, b| b.1.total_cmp(&a.1));
        let parts = variances.into_iter().map(|(name, variance)| (name, variance.max(0.0).sqrt()));
        Some(Budget { id, parts: parts.collect() })
    }

    /// Returns how much the fit depends on each shot of the only sample, in the order of the shots;
    /// `None` for a shot without which an unknown is not determined.
    pub fn influence(&self) -> Vec<Option<ShotInfluence>> {
        let (ids, covariance) = (self.determined(), &self.covariance.covariance);
        let information = covariance.clone().cholesky().map(|factor| factor.inverse());
        let influence_of = |i: usize| {
            let (matrix, gradient) = self.problem.contribute(self.state(), (0, i)).reduced(&ids)?;
            let change = (information.as_ref()? - &matrix).cholesky()?.solve(&gradient);
            let changes = ids.iter().copied().zip(change.iter().copied()).collect();
            Some(ShotInfluence { leverage: (covariance * matrix).trace(), changes })
        };
        let shots = self.at.shots.first().map_or(0, Vec::len);
        (0..shots).into_par_iter().map(influence_of).collect()
    }

    /// Returns the interval of an unknown from the bound that it is at, beyond which lie 5 % of its
    /// likelihood, to second order a normal distribution cut off at the bound. (A rise of χ² by
    /// 1.645² from the bound leaves 24 % in films whose χ² decreases beyond it.) `None` for one
    /// that is not at a bound.
    pub(crate) fn limit_at_bound(&self, column: usize) -> Option<[f64; 2]> {
        let (unknown, x) = (&self.problem.unknowns[column], self.at.state.shared.0[column]);
        let inward = if x == unknown.bounds[0] { 1.0 } else { -1.0 };
        if unknown.mode != Mode::Free || !unknown.bounds.contains(&x) {
            return None;
        }
        let reduced = self.at.reduced()?;
        let (bend, _) = self.covariance.condition(reduced, &[column]);
        let (bend, slope) = (bend[0], (inward * reduced.gradient(&[column])[0]).max(0.0));
        // the minimum of χ² lies s/√b standard errors beyond the bound
        let sd = bend.sqrt().recip();
        let beyond = slope * sd;
        if !(sd + beyond).is_finite() {
            return None;
        }
        let normal = statrs::distribution::Normal::standard();
        let distance = -sd * (normal.inverse_cdf(0.05 * normal.sf(beyond)) + beyond);
        let [low, high] = unknown.bounds;
        let limit = (x + inward * distance).clamp(low, high);
        Some([x.min(limit), x.max(limit)])
    }

    /// Returns −2 log L up to a constant, greatest over the noises that are not stated.
    pub fn minus_two_log(&self) -> f64 {
        minus_two_log(&self.problem, &self.at)
    }

    /// Returns −2 log L with the own unknowns integrated over, up to a constant.
    pub(super) fn unlikely(&self) -> f64 {
        unlikely(&self.problem, &self.at)
    }

    /// Returns χ² of the data alone, and the number of measured numbers in it.
    pub(crate) fn chi2_of_data(&self) -> (f64, f64) {
        let count_data = |(number, sample): (usize, &Sample)| match &sample.block {
            Block::Rows(rows) => {
                let chi2 = self.at.shots[number].iter().map(|shot| shot.cost).sum::<f64>();
                (chi2, rows.count_numbers() as f64)
            }
            _ => {
                let sums = self.at.noises(number);
                (sums.iter().map(|sum| sum.weighted).sum(), sums.iter().map(|sum| sum.count).sum())
            }
        };
        let all = self.problem.samples.iter().enumerate().map(count_data);
        all.fold((0.0, 0.0), |sum, own| (sum.0 + own.0, sum.1 + own.1))
    }

    /// Returns what the priors of shared unknowns add to χ².
    pub(crate) fn prior_chi2(&self) -> f64 {
        let pulls = self.problem.unknowns.iter().zip(&self.at.state.shared.0);
        pulls.filter_map(|(unknown, x)| Some(unknown.active_prior()?.pull(*x).powi(2))).sum()
    }

    /// Returns the number of unknowns that the shots have of their own, without those that are
    /// held.
    pub(crate) fn own_count(&self) -> usize {
        let count_unknowns = |(number, sample): (usize, &Sample)| match &sample.block {
            // what is known of an input is a number, too
            Block::Rows(_) => 0,
            _ => self.at.shots[number].iter().map(ShotSums::count_free).sum(),
        };
        self.problem.samples.iter().enumerate().map(count_unknowns).sum()
    }

    /// Returns the degrees of freedom of χ² of everything: numbers less unknowns. The prior of an
    /// unknown counts as a number, too.
    pub fn dof(&self) -> usize {
        let numbers = self.chi2_of_data().1.round() as usize;
        numbers.saturating_sub(self.own_count() + self.covariance.count_without_prior(&self.problem))
    }

    /// Returns whether the noise of all data is stated.
    pub fn states_noise(&self) -> bool {
        self.problem.samples.iter().all(|sample| !sample.block.variation().is_estimated())
    }

    /// Returns the weight of each shot of the first sample by a robust loss; an empty list by least
    /// squares.
    pub fn weights(&self) -> Vec<f64> {
        if !self.problem.is_robust() {
            return Vec::new();
        }
        self.at.shots[0].iter().map(ShotSums::weight).collect()
    }

    /// Returns whether the data are a film of balls or of discs.
    pub fn is_film(&self) -> bool {
        self.problem.rows().is_none()
    }

    /// Returns the topspin of each shot of a film over natural roll; 1 for a ball that rolls.
    pub(crate) fn topspins(&self) -> Vec<f64> {
        let shots = self.problem.film().into_iter().flat_map(|film| film.shots.iter());
        shots.zip(&self.state().own[0]).map(|(shot, own)| shot.spin.topspin_of(own)).collect()
    }

    /// Returns whether the frames of a film do not determine a parameter: a finding says so, or the
    /// error of μ_s is more than half of what it is known to without them.
    pub(crate) fn is_undetermined(&self, settings: &Settings, parameter: Parameter) -> bool {
        let id = Id::from(parameter);
        let Some(estimate) = self.get(id) else {
            return settings.has(parameter) && !settings[parameter].fixed;
        };
        let is_of = |finding: &Finding| matches!(finding, Finding::Undetermined { id: of, .. } if *of == id);
        let is_prior = estimate.prior.zip(estimate.std_error).is_some_and(|(prior, sd)| sd > 0.5 * prior.sd);
        self.record.findings.iter().any(is_of) || id == Id::MuS && is_prior
    }

    /// Returns whether the data contradict the model.
    pub(crate) fn is_refuted(&self) -> bool {
        self.record.findings.iter().any(|finding| matches!(finding, Finding::Misfit { refutes: true, .. }))
    }

    /// Returns the values of the unknowns `ids` in a fit of shots of the only sample that are drawn
    /// again with replacement (Efron 1987), at the same noise; `number` is the stream of the random
    /// numbers. `None` if the fit does not end at a minimum that determines all `ids`.
    pub(crate) fn resampled(&self, ids: &[Id], (seed, number): (u64, u64)) -> Option<Vec<f64>> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(number);
        let own = self.state().own.first()?;
        let drawn: Vec<usize> = (0..own.len()).map(|_| random.random_range(0..own.len())).collect();
        let mut problem: Problem = self.problem.clone();
        problem.samples[0].take(&drawn);
        let own = vec![drawn.iter().map(|i| own[*i].clone()).collect()];
        let state = State { own, shared: self.state().shared.clone() };
        let descent = problem.descend(state);
        let estimates = Estimates::new(&problem, &descent.end)?;
        let determined = ids.iter().all(|id| estimates.position(*id as usize).is_some());
        let values = ids.iter().map(|id| descent.end.state.shared[*id]).collect();
        (descent.converged && determined).then_some(values)
    }
}
