//! Estimates with their errors and 95 % intervals: what is determined, and how.

use nalgebra::DMatrix;
use statrs::distribution::{ContinuousCDF, Normal as Gauss, StudentsT};

use super::identifiability::worst_direction;
use super::problem::{Evaluation, Problem};
use super::profile::End;
use super::solution::Solution;
use super::uncertainty::Estimates;
use super::unknowns::{Id, Mode};
use crate::physics::name::{by_name, worded};

/// Relative change of χ² within which nothing depends on an unknown, and halvings for the edge of such a
/// range.
const SAME: f64 = 1e-12;
const HALVINGS: usize = 45;

/// Difference of an end of a profile from value ± t·error, as a part of t·error, from which on the
/// profile is the interval.
const DIFFERENT: f64 = 0.1;

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
        /// The data do not determine it. It is given at its initial value or, where they determine a combination of
        /// several parameters, at one of the values that fit equally well.
        NotIdentified = "not-identified",
    }
    /// The name in fit.json.
    pub fn name;
}

by_name!(Status, "status", ALL, name);

/// The estimate of one unknown of the contact.
#[derive(Clone, Copy, Debug)]
pub struct Determined {
    /// The unknown.
    pub id: Id,
    /// Its value; at the edge of a range of values between which nothing changes.
    pub value: f64,
    /// Its standard error with unknowns at bounds taken for free; `None` at a bound, on such a range, or
    /// if the noise is not known.
    pub std_error: Option<f64>,
    /// Its standard error if unknowns at bounds are known to be there.
    pub std_error_at_bounds: Option<f64>,
    /// Value ± t·error within its bounds.
    pub of_error: Option<[f64; 2]>,
    /// Its 95 % interval: of the profile if that differs from value ± t·error by a tenth.
    pub interval: Option<[f64; 2]>,
    /// The ends of its profile.
    pub profile: Option<[End; 2]>,
    /// What is known of it.
    pub status: Status,
}

/// Quantiles of the deviations of estimates in their standard errors.
#[derive(Clone, Copy)]
pub(crate) struct Quantiles {
    /// Half width of a 95 % interval.
    two_sided: f64,
    /// Width of a 95 % interval from a bound.
    one_sided: f64,
}

impl Quantiles {
    /// Returns those of Student's t, or of the normal distribution if the noise is stated.
    pub fn new(dof: Option<f64>) -> Option<Self> {
        let of =
            |quantile: &dyn Fn(f64) -> f64| Self { two_sided: quantile(0.975), one_sided: quantile(0.95) };
        match dof {
            None => Some(of(&|p| Gauss::standard().inverse_cdf(p))),
            Some(dof) => StudentsT::new(0.0, 1.0, dof).ok().map(|t| of(&|p| t.inverse_cdf(p))),
        }
    }
}

/// What estimates follow from.
pub(crate) struct Intervals<'a> {
    pub solution: &'a Solution,
    /// Covariance with unknowns at bounds taken for free.
    pub as_free: &'a Estimates,
    /// Unknowns that the data do not determine.
    pub undetermined: Vec<Id>,
    /// `None` if the noise is not known.
    pub quantiles: Option<Quantiles>,
    /// Other minima.
    pub others: &'a [Evaluation],
    /// Whether profiles are followed.
    pub profiles: bool,
}

impl Intervals<'_> {
    /// Returns the estimate of an unknown with its intervals.
    pub fn estimate(&self, id: Id) -> Determined {
        let solution = self.solution;
        let (column, unknown) = (id as usize, solution.problem.unknown(id));
        let mut found = Determined {
            id,
            value: solution.value(id),
            std_error: None,
            std_error_at_bounds: None,
            of_error: None,
            interval: None,
            profile: None,
            status: Status::Fixed,
        };
        if self.undetermined.contains(&id) {
            return Determined { status: Status::NotIdentified, ..found };
        }
        if unknown.mode != Mode::Free {
            return found;
        }
        if let Some(edge) = edge_of_saturation(&solution.problem, &solution.at, column) {
            found.value = edge;
        }
        let [low, high] = unknown.bounds;
        found.status = match found.value {
            value if value == low => Status::AtLowerBound,
            value if value == high => Status::AtUpperBound,
            _ => Status::Free,
        };
        let Some(Quantiles { two_sided, one_sided }) = self.quantiles else { return found };
        found.std_error_at_bounds = solution.covariance.sd(column);
        found.std_error = found.std_error_at_bounds.and(self.as_free.sd(column));
        let t = if found.std_error.is_some() { two_sided } else { one_sided };
        let ends = |sd: f64| [found.value - t * sd, found.value + t * sd].map(|end| end.clamp(low, high));
        found.of_error = found.std_error.map(ends);
        // along a ratio of the balls χ² is a parabola
        let is_profiled = self.profiles && !matches!(id, Id::MassRatio | Id::RadiusRatio);
        found.profile = if is_profiled { solution.profile(column, t) } else { None };
        let of_profile = found.profile.map(|ends| ends.map(|end| end.value));
        found.interval = match (found.of_error, of_profile) {
            (Some(of_error), Some(of_profile)) => {
                let half = 0.5 * (of_error[1] - of_error[0]);
                let differs = (0..2).any(|side| (of_error[side] - of_profile[side]).abs() > DIFFERENT * half);
                Some(if differs { of_profile } else { of_error })
            }
            (of_error, of_profile) => of_profile.or(of_error),
        };
        for other in self.others {
            found.interval = found.interval.map(|ends| self.extend(ends, other, column, t));
        }
        found
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

    /// Makes unknowns at bounds that may as well be anywhere not identified, unless others depend on
    /// them.
    pub fn judge_uninformed(&self, estimates: &mut [Determined]) {
        let hangs = |estimate: &Determined| {
            let errors = estimate.std_error.zip(estimate.std_error_at_bounds);
            errors.is_some_and(|(free, held)| (free - held).abs() > DIFFERENT * held)
        };
        if estimates.iter().any(hangs) {
            return;
        }
        for estimate in estimates {
            let [low, high] = self.solution.problem.unknown(estimate.id).bounds;
            let is_anywhere = estimate.interval.is_some_and(|ends| ends[0] <= low && ends[1] >= high);
            if is_anywhere && matches!(estimate.status, Status::AtLowerBound | Status::AtUpperBound) {
                estimate.value = self.solution.problem.unknown(estimate.id).start;
                (estimate.status, estimate.interval, estimate.profile) = (Status::NotIdentified, None, None);
                estimate.of_error = None;
            }
        }
    }
}

/// Returns the covariance with unknowns at bounds taken for free, those that are not determined held.
pub(crate) fn errors_as_free(problem: &Problem, at: &Evaluation, undetermined: &[Id]) -> Option<Estimates> {
    let is_determined = |column: &usize| !undetermined.contains(&problem.unknowns[*column].id);
    let columns = problem.free().into_iter().filter(is_determined).collect();
    Estimates::of_columns(&at.eliminate(problem, 0.0)?, columns)
}

/// Returns the edge of the range of values of an unknown on which χ² does not depend, next to the
/// values on which it does; `None` if χ² depends on the unknown at the minimum.
fn edge_of_saturation(problem: &Problem, at: &Evaluation, column: usize) -> Option<f64> {
    if at.shots.iter().flatten().any(|shot| shot.slopes_by(column)) {
        return None;
    }
    let is_flat = |value: f64| {
        let mut state = at.state.clone();
        state.shared.0[column] = value;
        (problem.evaluate(state).cost - at.cost).abs() <= SAME * (1.0 + at.cost)
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

/// Returns what the data determine, and the unknowns of which they determine only combinations; one of
/// these is then held.
pub(crate) fn determine(problem: &Problem, at: &Evaluation) -> (Estimates, Vec<Id>) {
    let mut held = problem.clone();
    let mut undetermined: Vec<Id> = Vec::new();
    while let Some(worst) = at.eliminate(&held, 0.0).and_then(|reduced| worst_direction(&held, at, &reduced))
        && let Some(largest) = worst.terms.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
        && worst.is_undetermined
    {
        undetermined.extend(worst.terms.iter().map(|(id, _)| *id));
        held.unknown_mut(largest.0).mode = Mode::Fixed;
    }
    let none = Estimates { columns: Vec::new(), covariance: DMatrix::zeros(0, 0) };
    (Estimates::new(&held, at).unwrap_or(none), undetermined)
}
