//! The estimate of one parameter, and what χ², degrees of freedom and residuals count.

use nalgebra::DMatrix;

use super::{Fit, Noise};
use crate::measurement::observable::Observable;
use crate::measurement::parameter::{Parameter, Setting};
use crate::measurement::written::written_by_name;
use crate::physics::name::worded;
use crate::problem::{Id, Status};

impl Fit {
    /// The estimate of a parameter; `None` for one that the fit does not have, such as b where the friction is constant.
    #[must_use]
    pub fn get(&self, parameter: Parameter) -> Option<&Estimate> {
        self.estimates.iter().find(|estimate| estimate.parameter == parameter)
    }

    /// The friction between the balls μ.
    #[must_use]
    pub fn mu(&self) -> Option<&Estimate> {
        self.get(Parameter::Mu)
    }

    /// The friction of the cloth on the object ball during the impact, μ_s.
    #[must_use]
    pub fn mu_s(&self) -> Option<&Estimate> {
        self.get(Parameter::MuS)
    }

    /// The coefficient of restitution between the balls, e.
    #[must_use]
    pub fn e(&self) -> Option<&Estimate> {
        self.get(Parameter::E)
    }

    /// The estimates of what happens at the contact: all but the ratios of the balls.
    pub(super) fn of_contact(&self) -> impl Iterator<Item = &Estimate> {
        self.estimates.iter().filter(|estimate| !estimate.parameter.is_of_balls())
    }

    /// Returns the range of values of a parameter on which nothing depends, as that of μ if every shot sticks: from the
    /// estimate to a bound.
    #[must_use]
    pub fn plateau(&self, parameter: Parameter) -> Option<[f64; 2]> {
        let own = self.get(parameter)?;
        let is_known = self.refuted.is_none() && !self.noise.iter().any(Noise::is_unknown);
        let is_flat = own.status == Status::Free && own.std_error.is_none() && is_known;
        is_flat.then(|| [own.value, self.solution.bounds(Id::from(parameter))[1]])
    }

    /// The covariance of the estimates, a row and a column for each of [`Fit::estimates`]: NaN for those without a standard
    /// error.
    #[must_use]
    pub fn covariance(&self) -> DMatrix<f64> {
        let error = |i: usize| self.estimates[i].std_error.unwrap_or(f64::NAN);
        let count = self.estimates.len();
        DMatrix::from_fn(count, count, |i, j| {
            if i == j { error(i) * error(i) } else { self.correlation[(i, j)] * error(i) * error(j) }
        })
    }

    /// The kind of the numbers that `chi2` and `dof` count.
    #[must_use]
    pub fn counted(&self) -> Counted {
        let is_film = self.frames.is_some() || self.camera.is_some();
        if is_film { Counted::Coordinates } else { self.tested() }
    }

    /// The kind of the numbers that `residuals` lists and [`super::Goodness`] tests.
    #[must_use]
    pub fn tested(&self) -> Counted {
        Counted::of(self.residuals.iter().map(|residual| &residual.observable))
    }

    /// How the data were fitted, as in fit.json: all frames at once, or measured impacts and angles directly.
    #[must_use]
    pub fn method_name(&self) -> &'static str {
        if self.frames.is_some() || self.discs.is_some() { "joint" } else { "direct" }
    }
}

/// One fitted parameter.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Estimate {
    /// The parameter.
    pub parameter: Parameter,
    /// The estimate, in the parameter's unit; where it is fixed or not identified, the value that it was held at.
    pub value: f64,
    /// The standard error; `None` where there is none, as for a parameter that is fixed.
    pub std_error: Option<f64>,
    /// The 95 % interval within the bounds; at an active bound it is one-sided. It is that of the profile where the
    /// two of `intervals` differ by more than a tenth, else that of the Hessian.
    pub interval_95: Option<[f64; 2]>,
    /// Both intervals.
    pub intervals: Intervals,
    /// The standard error if the parameters at their bounds were known to be there, where it differs from
    /// `std_error`.
    pub std_error_at_bound: Option<f64>,
    /// Whether `interval_95` was extended to another minimum that is nearly as likely; `std_error` is the curvature at the best one.
    pub includes_other_minimum: bool,
    /// How far the fit determined the parameter.
    pub status: Status,
}

/// A parameter's 95 % interval, found in two ways.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Intervals {
    /// From the curvature of χ² at its minimum: value ± t·error, as far as the bounds allow.
    pub hessian: Option<[f64; 2]>,
    /// Where χ², least over all other parameters, is t² above its minimum: from the lowest such value to the highest, other minima included.
    pub profile: Option<[f64; 2]>,
}

impl Estimate {
    /// A value without an error.
    pub(super) fn bare(parameter: Parameter, value: f64, status: Status) -> Self {
        let intervals = Intervals::default();
        Self {
            parameter,
            value,
            std_error: None,
            interval_95: None,
            intervals,
            std_error_at_bound: None,
            includes_other_minimum: false,
            status,
        }
    }

    /// Returns whether it ended at one of its bounds.
    pub(super) fn is_at_bound(&self) -> bool {
        matches!(self.status, Status::AtLowerBound | Status::AtUpperBound)
    }

    /// The estimate, or none of a parameter that ends at a bound and may as well be anywhere: the data say nothing about it.
    pub(super) fn unless_uninformed(self, setting: &Setting) -> Self {
        let all = |[low, high]: [f64; 2]| low <= setting.lower && high >= setting.upper;
        if !(self.is_at_bound() && self.interval_95.is_some_and(all)) {
            return self;
        }
        Self::bare(self.parameter, setting.initial, Status::NotIdentified)
    }

    /// The 95 % interval of the profile where a standard error would mislead: where it is less than half, or more than twice, as wide as
    /// ± two standard errors, or extends to another minimum.
    #[must_use]
    pub fn lopsided(&self) -> Option<[f64; 2]> {
        const DIFFERENT: f64 = 2.0;
        let [low, high] = self.interval_95.filter(|_| self.is_profiled())?;
        let wide = (high - low) / (4.0 * self.std_error?);
        let differs = self.includes_other_minimum || !(1.0 / DIFFERENT..=DIFFERENT).contains(&wide);
        (wide.is_finite() && differs).then_some([low, high])
    }

    /// Whether `interval_95` is the one of the profile.
    #[must_use]
    pub fn is_profiled(&self) -> bool {
        self.interval_95.is_some() && self.interval_95 == self.intervals.profile
    }
}

worded! {
    /// The kind of the measured numbers whose squared residuals are summed.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum Counted {
        /// Coordinates of the balls in the frames, and components of spins that markers show.
        Coordinates = "coordinates" | "the frames' coordinates",
        /// Components of velocities, and of spins, after the impact.
        Velocities = "velocities" | "the velocities",
        /// Angles, speeds and their ratios.
        Angles = "angles" | "the angles and speeds",
        /// Of discs: the restitution and the ratio of the impulses of each shot.
        Impulses = "impulses" | "e and J_t/J_n of the shots",
    }
    /// The name in fit.json.
    pub fn name;
    /// The name in a sentence.
    pub fn words;
}

written_by_name!(Counted);

impl Counted {
    /// The kind of some observables.
    pub(crate) fn of<'a>(observables: impl Iterator<Item = &'a Observable>) -> Self {
        let mut kind = Self::Angles;
        for observable in observables {
            if Observable::IMPACTS.contains(observable) {
                return Self::Velocities;
            }
            if Observable::DISCS.contains(observable) {
                kind = Self::Impulses;
            }
        }
        kind
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_ends_at_a_bound_and_may_be_anywhere_is_not_identified() {
        let setting = Parameter::MuS.default_setting();
        let at_bound = |interval| Estimate {
            interval_95: Some(interval),
            ..Estimate::bare(Parameter::MuS, 0.0, Status::AtLowerBound)
        };
        let anywhere = at_bound([0.0, 1.0]).unless_uninformed(&setting);
        assert_eq!((anywhere.status, anywhere.value), (Status::NotIdentified, setting.initial));
        assert_eq!(anywhere.interval_95, None);
        assert_eq!(at_bound([0.0, 0.7]).unless_uninformed(&setting).status, Status::AtLowerBound);
    }
}
