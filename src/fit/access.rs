//! Access to results for programs, and what χ², degrees of freedom and residuals count.

use nalgebra::DMatrix;

use super::{DiscImpact, Estimate, Explanation, Fit, FoundCamera, Noise, Rejected, film_words};
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;
use crate::measurement::written::written_by_name;
use crate::name::worded;
use crate::problem::{Id, Status};

impl Fit {
    /// Returns the label that was fitted by itself, if `[fit] by` asks for it.
    pub fn label(&self) -> Option<&str> {
        self.group.as_ref().map(|(_, label)| label.as_str())
    }

    /// Returns the estimates, in the order of [`Parameter::ALL`].
    pub fn estimates(&self) -> &[Estimate] {
        &self.estimates
    }

    /// Returns χ²: the sum of squared standardized residuals, priors included.
    pub fn chi2(&self) -> f64 {
        self.chi2
    }

    /// Returns −2 log L at the minimum up to a constant, greatest over noises that are not stated.
    pub fn minus_two_log(&self) -> f64 {
        self.solution.minus_two_log()
    }

    /// Returns the degrees of freedom: measured numbers less all unknowns that they determine.
    pub fn dof(&self) -> usize {
        self.dof
    }

    /// Returns whether the search stopped at a minimum.
    pub fn converged(&self) -> bool {
        self.solution.converged
    }

    /// Returns why the search stopped.
    pub(crate) fn termination(&self) -> &'static str {
        if self.converged() { "χ² has settled" } else { "too many steps" }
    }

    /// Returns causes of residuals that the estimates include, the best first.
    pub(crate) fn explanations(&self) -> Vec<Explanation> {
        film_words::explanations(&self.solution, self.frames.as_ref())
    }

    /// Returns the number of shots that were fitted.
    pub fn shots_used(&self) -> usize {
        self.solution.names().len()
    }

    /// Returns the shots that were left out, with the reasons.
    pub fn shots_rejected(&self) -> &[Rejected] {
        &self.shots_rejected
    }

    /// Returns whether the data contradict the model: no estimate has an error then.
    pub fn is_refuted(&self) -> bool {
        self.solution.is_refuted()
    }

    /// Returns the standard error of a parameter as if the model held.
    pub fn std_error_if_model_held(&self, parameter: Parameter) -> Option<f64> {
        let stated = self.get(parameter).and_then(|estimate| estimate.std_error);
        stated.or_else(|| self.solution.get(Id::from(parameter))?.std_error)
    }

    /// Returns the camera of footage as it was fitted.
    pub fn camera(&self) -> Option<&FoundCamera> {
        self.camera.as_ref()
    }

    /// Returns the estimate of a parameter, if the fit has it.
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

    /// Returns the range, from the estimate to a bound, of values on which χ² does not depend.
    pub(crate) fn plateau(&self, parameter: Parameter) -> Option<[f64; 2]> {
        let estimate = self.get(parameter)?;
        let is_known = !self.is_refuted() && !self.noise.iter().any(Noise::is_unknown);
        let is_flat = estimate.status == Status::Free && estimate.std_error.is_none() && is_known;
        is_flat.then(|| [estimate.value, self.solution.problem.unknown(Id::from(parameter)).bounds[1]])
    }

    /// Returns the covariance of [`Fit::estimates`], NaN for those without a standard error.
    pub fn covariance(&self) -> DMatrix<f64> {
        let error = |i: usize| self.estimates[i].std_error.unwrap_or(f64::NAN);
        let count = self.estimates.len();
        DMatrix::from_fn(count, count, |i, j| {
            if i == j { error(i) * error(i) } else { self.correlation[(i, j)] * error(i) * error(j) }
        })
    }

    /// The kind of the numbers that `chi2`, `dof` and [`super::Goodness`] count.
    pub(crate) fn counted(&self) -> Counted {
        self.diagnostics.goodness.as_ref().map_or(Counted::Angles, |goodness| goodness.counted)
    }

    /// Returns how the data were fitted: all frames at once, or measured impacts and angles
    /// directly.
    pub fn method_name(&self) -> &'static str {
        if self.frames.is_some() || self.discs.is_some() { "joint" } else { "direct" }
    }
}

impl DiscImpact {
    /// Returns the doubts of its numbers as clauses, also that the discs stick together.
    pub fn doubts(&self) -> Vec<String> {
        let stuck = self.stuck.iter().map(|stuck| stuck.sentence());
        stuck.chain(self.doubts.iter().cloned()).collect()
    }

    /// Returns the number of frames that were left out as wrong.
    pub fn outliers(&self) -> usize {
        self.outliers
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
    /// Returns the kind of some observables.
    pub(crate) fn of<'a>(observables: impl Iterator<Item = &'a Observable> + Clone) -> Self {
        let has = |kind: &[Observable]| observables.clone().any(|observable| kind.contains(observable));
        if has(&Observable::IMPACTS) {
            Self::Velocities
        } else if has(&Observable::DISCS) {
            Self::Impulses
        } else {
            Self::Angles
        }
    }
}
