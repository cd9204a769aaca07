//! Access to results for programs: what [`Fit`] and measured impacts of discs hold.

use super::{DiscImpact, Estimate, Fit, FoundCamera, Id, Rejected, with_impacts};
use crate::measurement::correction::Correction;
use crate::measurement::dataset::{Dataset, Measured};
use crate::measurement::parameter::Parameter;
use crate::problem::Finding;

/// Returns a data set with what its frames show independently of the law of the impact: of a film
/// of balls the impacts, of one of discs the shots that can be used. Other data are returned as
/// they are.
pub fn extract(dataset: Dataset) -> Dataset {
    with_impacts(dataset, &|| ()).0
}

impl Fit {
    /// Returns the label that was fitted by itself, if `[fit] by` asks for it.
    pub fn label(&self) -> Option<&str> {
        self.group.as_ref().map(|(_, label)| label.as_str())
    }

    /// Returns the estimates of the parameters that the fit has, in the order of
    /// [`Parameter::ALL`](crate::measurement::parameter::Parameter::ALL).
    pub fn estimates(&self) -> &[Estimate] {
        &self.estimates
    }

    /// Returns χ²: the sum of squared standardized residuals, priors included.
    pub fn chi2(&self) -> f64 {
        self.chi2
    }

    /// Returns −2 log L at the minimum up to a constant, greatest over the noises that are not
    /// stated.
    pub fn minus_two_log(&self) -> f64 {
        self.solution.minus_two_log().0
    }

    /// Returns the degrees of freedom: measured numbers less all unknowns that they determine.
    pub fn dof(&self) -> usize {
        self.dof
    }

    /// Returns whether the search stopped at a minimum.
    pub fn converged(&self) -> bool {
        self.converged
    }

    /// Returns the number of shots that were fitted.
    pub fn shots_used(&self) -> usize {
        self.shots_used
    }

    /// Returns the shots that were left out, with the reasons.
    pub fn shots_rejected(&self) -> &[Rejected] {
        &self.shots_rejected
    }

    /// Returns whether the data contradict the model: no estimate has an error then.
    pub fn is_refuted(&self) -> bool {
        self.solution.findings.iter().any(|finding| matches!(finding, Finding::Misfit { refutes: true, .. }))
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
}

impl Estimate {
    /// Returns the ends of the range in which χ², least over all other parameters, is below that of
    /// the 95 % interval.
    pub fn profile(&self) -> Option<[f64; 2]> {
        self.intervals.profile
    }
}

impl FoundCamera {
    /// Returns a correction that was free, as a correction of what the data set states, in the unit
    /// that [`Correction::words`] names.
    pub fn found(&self, which: Correction) -> Option<Measured> {
        let found = self.corrections.iter().find(|found| found.which == which)?;
        Some(Measured::new(found.value, found.std_error))
    }

    /// Returns the middle of the film, x and y in m, from which the corrections count.
    pub fn middle(&self) -> [f64; 2] {
        self.middle
    }

    /// Returns the unit of the film in m; 1 if the stated one was right to a tenth.
    pub fn unit(&self) -> f64 {
        self.unit
    }

    /// Returns whether the corrections converged.
    pub fn converged(&self) -> bool {
        self.converged
    }
}

impl DiscImpact {
    /// Returns the doubts of its numbers as clauses, also that the discs stick together.
    pub fn doubts(&self) -> Vec<String> {
        let stuck = self.stuck.iter().map(|stuck| stuck.sentence());
        stuck.chain(self.doubts.iter().map(ToString::to_string)).collect()
    }

    /// Returns the number of frames that were left out as wrong.
    pub fn outliers(&self) -> usize {
        self.outliers
    }
}
