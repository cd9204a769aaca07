//! Estimates of parameters with their errors and 95 % intervals: what is determined, and how.

use std::sync::Arc;

use nalgebra::DMatrix;
use statrs::distribution::{ContinuousCDF, Normal as Gauss, StudentsT};

use super::evaluation::Evaluation;
use super::minimise::descend;
use super::policy::{COMPARED_STEPS, STALL};
use super::problem::{Problem, State};
use super::profile::{DIFFERENT, EDGE};
use super::rows::table::TableNoise;
use super::solution::Solution;
use super::uncertainty::{Estimates, worst_direction};
use super::unknowns::{Id, Mode};
use crate::measurement::parameter::{Parameter, Setting, Settings};
use crate::name::{by_name, worded};
use crate::numerics::EXACT;

/// Halvings for the edge of a range of values on which χ² does not depend.
const HALVINGS: usize = 45;

/// Halvings for the least friction of a film whose contacts may all stick: to a thousandth.
const HALVINGS_OF_FILMS: usize = 10;

/// Ratio of two errors of one estimate from which on the smaller one misleads.
pub(crate) const MISLEADING: f64 = 2.0;

/// Number of shots of a table beyond which profiles are followed only if χ² is not a parabola, and
/// regions, some hundred fits, are not drawn.
pub(crate) const MANY_SHOTS: usize = 1000;

worded! {
    /// How far a fit determined a parameter.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum Status {
        /// It was fitted.
        Free = "free",
        /// It was held at a stated value.
        Fixed = "fixed",
        /// It was fitted and ended at its lower bound.
        AtLowerBound = "at-lower-bound",
        /// It was fitted and ended at its upper bound.
        AtUpperBound = "at-upper-bound",
        /// The data do not determine it. It is given at its initial value or, if they determine a
        /// combination of several parameters, at one of the values that fit equally well.
        NotIdentified = "not-identified",
    }
    /// The name in fit.json.
    pub fn name;
}

by_name!(Status, "status", ALL, name);

/// One fitted parameter.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct ParameterEstimate {
    /// The parameter.
    pub parameter: Parameter,
    /// The estimate, in the parameter's unit: if it is fixed or not identified, the value that it
    /// was held at; on a range of values between which χ² does not change, its edge.
    pub value: f64,
    /// The standard error with parameters at bounds taken for free; `None` of a
    /// parameter without one, as a fixed parameter.
    pub std_error: Option<f64>,
    /// The 95 % interval within the bounds; at an active bound it is one-sided.
    pub interval_95: Option<[f64; 2]>,
    /// Whether χ², least over all other parameters, is t² above its minimum at the ends of
    /// `interval_95`, or at those about other minima; else they are value ± t·error.
    pub is_profiled: bool,
    /// The standard error if the parameters at their bounds were known to be there, if it differs
    /// from `std_error`.
    pub(crate) std_error_at_bound: Option<f64>,
    /// Whether `interval_95` was extended to another minimum that is nearly as likely; `std_error`
    /// is the curvature at the best one.
    pub(crate) includes_other_minimum: bool,
    /// How far the fit determined the parameter.
    pub status: Status,
}

impl ParameterEstimate {
    /// Returns a value without an error.
    pub(crate) fn bare(parameter: Parameter, value: f64, status: Status) -> Self {
        Self {
            parameter,
            value,
            std_error: None,
            interval_95: None,
            is_profiled: false,
            std_error_at_bound: None,
            includes_other_minimum: false,
            status,
        }
    }

    /// Returns whether it ended at one of its bounds.
    pub(crate) fn is_at_bound(&self) -> bool {
        matches!(self.status, Status::AtLowerBound | Status::AtUpperBound)
    }

    /// Returns the estimate, without a value for a parameter that ends at a bound and may as well
    /// be anywhere: the data do not determine it.
    pub(crate) fn unless_uninformed(self, setting: &Setting) -> Self {
        let is_anywhere = |[low, high]: [f64; 2]| low <= setting.lower && high >= setting.upper;
        if self.is_at_bound() && self.interval_95.is_some_and(is_anywhere) {
            return Self::bare(self.parameter, setting.initial, Status::NotIdentified);
        }
        self
    }

    /// Returns the 95 % interval of the profile if a standard error would mislead: if it is less
    /// than half, or more than twice, as wide as ± two standard errors, or extends to another
    /// minimum.
    pub fn lopsided(&self) -> Option<[f64; 2]> {
        let [low, high] = self.interval_95.filter(|_| self.is_profiled)?;
        let wide = (high - low) / (4.0 * self.std_error?);
        let differs = self.includes_other_minimum || !(1.0 / MISLEADING..=MISLEADING).contains(&wide);
        (wide.is_finite() && differs).then_some([low, high])
    }

    /// Returns whether the value is in the middle of its interval, as that of a parabola is.
    pub(crate) fn is_in_the_middle(&self) -> bool {
        self.interval_95.is_some_and(|[low, high]| {
            (low + high - 2.0 * self.value).abs() <= 0.5 * DIFFERENT * (high - low)
        })
    }
}

/// The end of a fit of data of any kind, with all that estimates follow from.
pub(crate) struct FitEnd {
    pub(crate) solution: Arc<Solution>,
    /// Covariance with unknowns at bounds taken for free.
    pub(crate) as_free: Estimates,
    /// Unknowns that the data do not determine.
    pub(crate) undetermined: Vec<Id>,
    /// Noises of tables that were estimated.
    pub(crate) noises: Vec<TableNoise>,
    /// Degrees of freedom of Student's t; `None` if all errors are stated.
    pub(crate) dof: Option<f64>,
    /// Other minima.
    pub(crate) others: Vec<Evaluation>,
    /// Whether intervals of profiles are wanted.
    pub(crate) profiles: bool,
}

impl FitEnd {
    /// Returns the end of a fit of frames, with intervals for a scatter of these degrees of freedom
    /// that extend to other minima.
    pub(crate) fn of_frames(
        solution: impl Into<Arc<Solution>>,
        settings: &Settings,
        (dof, others): (Option<f64>, Vec<Evaluation>),
        profiles: bool,
    ) -> Self {
        let solution = solution.into();
        let undetermined = Parameter::ALL.into_iter().filter(|p| solution.is_undetermined(settings, *p));
        Self {
            as_free: solution.covariance.clone(),
            undetermined: undetermined.map(Id::from).collect(),
            noises: Vec::new(),
            dof,
            others,
            profiles: profiles && solution.weights().is_empty(),
            solution,
        }
    }

    /// Returns whether the noise is stated or could be estimated.
    pub(crate) fn knows_noise(&self) -> bool {
        self.noises.iter().all(|noise| noise.is_known)
    }

    /// Returns a quantile of the deviations of estimates in their standard errors: of Student's t, or
    /// of the normal distribution if the noise is stated; `None` if it is not known.
    fn quantile(&self, probability: f64) -> Option<f64> {
        match self.dof {
            _ if !self.knows_noise() => None,
            None => Some(Gauss::standard().inverse_cdf(probability)),
            Some(dof) => Some(StudentsT::new(0.0, 1.0, dof).ok()?.inverse_cdf(probability)),
        }
    }

    /// Returns the estimates of some parameters; one at a bound that may as well be anywhere is not
    /// identified, unless others depend on it.
    pub(crate) fn estimates(&self, parameters: &[Parameter], settings: &Settings) -> Vec<ParameterEstimate> {
        let estimate = |parameter: &Parameter| self.estimate(*parameter, &settings[*parameter]);
        let all: Vec<ParameterEstimate> = parameters.iter().map(estimate).collect();
        let hangs = |estimate: &ParameterEstimate| {
            let errors = estimate.std_error.zip(estimate.std_error_at_bound);
            errors.is_some_and(|(free, held)| (free - held).abs() > DIFFERENT * held)
        };
        if all.iter().any(hangs) {
            return all;
        }
        all.into_iter().map(|estimate| estimate.unless_uninformed(&settings[estimate.parameter])).collect()
    }

    /// Returns the estimate of a parameter with its intervals.
    fn estimate(&self, parameter: Parameter, setting: &Setting) -> ParameterEstimate {
        let (solution, id) = (&self.solution, Id::from(parameter));
        let (column, unknown) = (id as usize, solution.problem.unknown(id));
        let bare = |value: f64, status: Status| ParameterEstimate::bare(parameter, value, status);
        if self.undetermined.contains(&id) {
            return bare(solution.value(id), Status::NotIdentified);
        }
        if unknown.mode != Mode::Free {
            return bare(solution.value(id), Status::Fixed);
        }
        let [low, high] = unknown.bounds;
        if let Some(value) = self.least_if_all_may_stick(column) {
            let interval_95 = Some([value, high]);
            return ParameterEstimate { interval_95, is_profiled: true, ..bare(value, Status::Free) };
        }
        let edge = if solution.is_informed(id) {
            Some(solution.value(id))
        } else {
            edge_of_saturation(&solution.problem, &solution.at, column)
        };
        let Some(value) = edge else { return bare(setting.initial, Status::NotIdentified) };
        let status = match value {
            value if value == low => Status::AtLowerBound,
            value if value == high => Status::AtUpperBound,
            _ => Status::Free,
        };
        let without_error = bare(value, status);
        let at_bounds = solution.covariance.sd(column);
        let std_error = at_bounds.and(self.as_free.sd(column));
        let quantile = self.quantile(if std_error.is_some() { 0.975 } else { 0.95 });
        let Some(t) = quantile else { return without_error };
        let ends = |sd: f64| [value - t * sd, value + t * sd].map(|end| end.clamp(low, high));
        let is_film = solution.problem.film().is_some();
        let curvature =
            std_error.map(ends).or_else(|| is_film.then(|| solution.limit_at_bound(column)).flatten());
        let profile = match std_error {
            // along a ratio of the balls χ² is a parabola
            _ if !self.profiles || parameter.is_of_balls() => None,
            Some(_) if is_film || solution.names().len() > MANY_SHOTS => {
                solution.lopsided_interval(column, t)
            }
            _ if is_film => None,
            _ => solution.profile(column, (t, [EDGE; 2])),
        };
        let alone = profile.or(curvature);
        let interval_95 = alone
            .map(|alone| self.others.iter().fold(alone, |ends, other| self.extend(ends, other, column, t)));
        let includes_other_minimum = interval_95 != alone;
        ParameterEstimate {
            std_error,
            interval_95,
            is_profiled: profile.is_some() || includes_other_minimum,
            std_error_at_bound: at_bounds
                .filter(|of_bounds| std_error.is_some_and(|error| error != *of_bounds)),
            includes_other_minimum,
            ..without_error
        }
    }

    /// Returns the least value of the friction between balls that the frames of a film allow, if
    /// most contacts stick and all may: χ² is less than t² above its minimum at the greatest value.
    fn least_if_all_may_stick(&self, column: usize) -> Option<f64> {
        let (problem, at) = (&self.solution.problem, &self.solution.at);
        let shots = at.shots.iter().map(Vec::len).sum::<usize>();
        if column != Id::Mu as usize || problem.film().is_none() || 2 * at.count_sticking() < shots {
            return None;
        }
        let t = self.quantile(0.975)?;
        let others: Vec<usize> = problem.free().into_iter().filter(|other| *other != column).collect();
        let likely_at = |from: &State, value: f64| {
            let start = problem.evaluate(from.clone().with([(column, value)]));
            let there = descend(problem, start, &others, (COMPARED_STEPS, STALL)).end;
            (there.cost - at.cost < t * t).then_some(there)
        };
        let [mut off, high] = problem.unknowns[column].bounds;
        likely_at(&at.state, high).filter(|there| there.count_sticking() == shots)?;
        let mut on = at.state.clone();
        for _ in 0..HALVINGS_OF_FILMS {
            let middle = 0.5 * (on.shared.0[column] + off);
            match likely_at(&on, middle) {
                Some(there) => on = there.state,
                None => off = middle,
            }
        }
        Some(on.shared.0[column])
    }

    /// Returns an interval extended to that about another minimum which is nearly as likely.
    fn extend(&self, [from, to]: [f64; 2], other: &Evaluation, column: usize, t: f64) -> [f64; 2] {
        let problem = &self.solution.problem;
        let left = t * t - (other.cost - self.solution.at.cost);
        let value = other.state.shared.0[column];
        if !(left > 0.0) || (from..=to).contains(&value) {
            return [from, to];
        }
        let sd = Estimates::new(problem, other).and_then(|estimates| estimates.sd(column)).unwrap_or(0.0);
        let [low, high] = problem.unknowns[column].bounds;
        let reach = left.sqrt() * sd;
        [from.min((value - reach).max(low)), to.max((value + reach).min(high))]
    }
}

/// Returns the covariance with unknowns at bounds taken for free, those that are not determined
/// held.
pub(super) fn errors_as_free(problem: &Problem, at: &Evaluation, undetermined: &[Id]) -> Option<Estimates> {
    let is_determined = |column: &usize| !undetermined.contains(&problem.unknowns[*column].id);
    let columns = problem.free().into_iter().filter(is_determined).collect();
    Estimates::of_columns(at.reduced()?, columns)
}

/// Returns the edge of the range of values of an unknown on which χ² does not depend, next to the
/// values on which it does; `None` if it does on none.
fn edge_of_saturation(problem: &Problem, at: &Evaluation, column: usize) -> Option<f64> {
    let is_flat = |value: f64| {
        let there = problem.evaluate(at.state.clone().with([(column, value)]));
        (there.cost - at.cost).abs() <= EXACT * (1.0 + at.cost)
    };
    let edge = |mut off: f64| {
        let mut on = at.state.shared.0[column];
        if is_flat(off) {
            return None;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (on + off);
            if is_flat(middle) { on = middle } else { off = middle }
        }
        Some(on)
    };
    let [low, high] = problem.unknowns[column].bounds;
    edge(low).or_else(|| edge(high))
}

/// Returns what the data determine, and the unknowns of which they determine only combinations; one
/// unknown of each combination is then held.
pub(crate) fn determine(problem: &Problem, at: &Evaluation) -> (Estimates, Vec<Id>) {
    let none = Estimates { columns: Vec::new(), covariance: DMatrix::zeros(0, 0) };
    let (Some(reduced), mut undetermined) = (at.reduced(), Vec::new()) else { return (none, Vec::new()) };
    let mut columns = problem.inside(&at.state);
    columns.retain(|column| reduced.informs(*column));
    let mut ids: Vec<Id> = columns.into_iter().map(|column| problem.unknowns[column].id).collect();
    while let Some(worst) = worst_direction(at, &ids, Vec::new())
        && let Some(largest) = worst.terms.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
        && worst.undetermined
    {
        undetermined.extend(worst.terms.iter().map(|(id, _)| *id));
        ids.retain(|id| *id != largest.0);
    }
    let columns = ids.into_iter().map(|id| id as usize).collect();
    (Estimates::of_columns(reduced, columns).unwrap_or(none), undetermined)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_ends_at_a_bound_and_may_be_anywhere_is_not_identified() {
        let setting = Parameter::MuS.default_setting();
        let at_bound = |interval| ParameterEstimate {
            interval_95: Some(interval),
            ..ParameterEstimate::bare(Parameter::MuS, 0.0, Status::AtLowerBound)
        };
        let anywhere = at_bound([0.0, 1.0]).unless_uninformed(&setting);
        assert_eq!((anywhere.status, anywhere.value), (Status::NotIdentified, setting.initial));
        assert_eq!(anywhere.interval_95, None);
        assert_eq!(at_bound([0.0, 0.7]).unless_uninformed(&setting).status, Status::AtLowerBound);
    }
}
