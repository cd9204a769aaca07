//! The estimate of one parameter, and what χ², degrees of freedom and residuals count.

use nalgebra::DMatrix;

use super::{Estimate, Fit, Noise};
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;
use crate::measurement::written::written_by_name;
use crate::physics::name::worded;
use crate::problem::{Id, Status};

impl Fit {
    /// The estimate of a parameter; `None` for one that the fit does not have, such as b if the
    /// friction is constant.
    pub fn get(&self, parameter: Parameter) -> Option<&Estimate> {
        self.estimates.iter().find(|estimate| estimate.parameter == parameter)
    }

    /// The friction between the balls μ.
    pub fn mu(&self) -> Option<&Estimate> {
        self.get(Parameter::Mu)
    }

    /// The friction of the cloth on the object ball during the impact, μ_s.
    pub fn mu_s(&self) -> Option<&Estimate> {
        self.get(Parameter::MuS)
    }

    /// The coefficient of restitution between the balls, e.
    pub fn e(&self) -> Option<&Estimate> {
        self.get(Parameter::E)
    }

    /// The estimates of what happens at the contact: all but the ratios of the balls.
    pub(super) fn of_contact(&self) -> impl Iterator<Item = &Estimate> {
        self.estimates.iter().filter(|estimate| !estimate.parameter.is_of_balls())
    }

    /// Returns the range of values of a parameter on which χ² does not depend, as that of μ if
    /// every shot sticks: from the estimate to a bound.
    pub(crate) fn plateau(&self, parameter: Parameter) -> Option<[f64; 2]> {
        let own = self.get(parameter)?;
        let is_known = !self.is_refuted() && !self.noise.iter().any(Noise::is_unknown);
        let is_flat = own.status == Status::Free && own.std_error.is_none() && is_known;
        is_flat.then(|| [own.value, self.solution.bounds(Id::from(parameter))[1]])
    }

    /// The covariance of the estimates, a row and a column for each of [`Fit::estimates`]: NaN for
    /// those without a standard error.
    pub fn covariance(&self) -> DMatrix<f64> {
        let error = |i: usize| self.estimates[i].std_error.unwrap_or(f64::NAN);
        let count = self.estimates.len();
        DMatrix::from_fn(count, count, |i, j| {
            if i == j { error(i) * error(i) } else { self.correlation[(i, j)] * error(i) * error(j) }
        })
    }

    /// The kind of the numbers that `chi2`, `dof` and [`super::Goodness`] count.
    pub(crate) fn counted(&self) -> Counted {
        let observables = self.residuals.iter().map(|residual| &residual.observable);
        if self.frames.is_some() { Counted::Coordinates } else { Counted::of(observables) }
    }

    /// How the data were fitted, as in fit.json: all frames at once, or measured impacts and angles
    /// directly.
    pub fn method_name(&self) -> &'static str {
        if self.frames.is_some() || self.discs.is_some() { "joint" } else { "direct" }
    }
}

worded! {
    /// The kind of the measured numbers whose squared residuals are summed.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    #[non_exhaustive]
    pub(crate) enum Counted {
        /// Coordinates of the balls in the frames, and components of spins that markers show.
        Coordinates = "coordinates" | "the frames' coordinates",
        /// Components of velocities, and of spins, after the impact.
        Velocities = "velocities" | "the velocities",
        /// Angles, speeds and their ratios.
        Angles = "angles" | "the angles and speeds",
        /// The restitution and the ratio of the impulses of each shot of discs.
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
