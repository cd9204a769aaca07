//! Whether the data refute the model, and what they then still say.
//!
//! Standard errors hold if the model does. If χ² rules the model out they are not given; what
//! needs no model of the friction, the ratio of the normal velocities, is given in their place.

use nalgebra::DVector;
use serde::{Serialize, Serializer};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::fit::{Estimate, Fit, Status};
use crate::measurement::dataset::Measured;
use crate::measurement::observable::{Axis, Observable};
use crate::measurement::parameter::Parameter;
use crate::problem::{Deviations, Policy};

/// How the data contradict the model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Refuted {
    /// χ² per degree of freedom.
    pub(crate) reduced_chi2: f64,
    /// The probability that chance alone gives a larger χ².
    pub(crate) p_value: f64,
    /// The standard errors that would hold if the model did.
    #[serde(rename = "std_errors_if_model_held", serialize_with = "by_parameter")]
    pub(crate) if_model_held: Vec<(Parameter, f64)>,
    /// The restitution measured without the model; `None` if the data do not have the velocities of
    /// both balls after the impact.
    #[serde(rename = "measured_e")]
    pub(crate) restitution: Option<MeasuredRestitution>,
}

/// The coefficient of restitution as the ratio of the normal velocities after and before the
/// impact. No law of friction goes into it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct MeasuredRestitution {
    /// The mean over the shots, each weighted by its own error and the scatter between shots.
    #[serde(rename = "estimate")]
    pub(crate) value: f64,
    pub(crate) std_error: f64,
    #[serde(rename = "scatter_between_shots")]
    /// The standard deviation between shots, beyond their own errors; 0 for a single shot.
    pub(crate) scatter: f64,
    /// How many shots it was measured in.
    pub(crate) shots: usize,
}

impl Refuted {
    /// Returns χ² per degree of freedom, and the probability that chance gives a larger χ², if both
    /// rule the model out. As many parameters as observations should leave no residual; what they
    /// leave is judged as one degree of freedom.
    pub(crate) fn judge(chi2: f64, dof: usize) -> Option<[f64; 2]> {
        let dof = dof.max(1) as f64;
        let reduced = chi2 / dof;
        let p_value = ChiSquared::new(dof).map_or(1.0, |distribution| distribution.sf(chi2));
        let policy = Policy::default();
        (p_value < policy.shot_tail && reduced > policy.refuted_rows).then_some([reduced, p_value])
    }
}

impl Fit {
    /// Returns the standard error of a parameter as if the model held.
    pub fn std_error_if_model_held(&self, parameter: Parameter) -> Option<f64> {
        let nominal = self.refuted.iter().flat_map(|refuted| &refuted.if_model_held).copied();
        let stated = self.get(parameter).and_then(|estimate| Some((parameter, estimate.std_error?)));
        stated.into_iter().chain(nominal).find(|(of, _)| *of == parameter).map(|(_, error)| error)
    }
}

/// Finds out whether χ² refutes the model; then takes the errors of the estimates away. `shots` are
/// those that were fitted.
pub(in crate::fit) fn judge(fit: &mut Fit, shots: &[Option<Deviations>]) {
    let Some(goodness) = fit.diagnostics.goodness.as_ref().filter(|goodness| goodness.noise_is_stated) else {
        return;
    };
    let Some([reduced_chi2, p_value]) = Refuted::judge(goodness.chi2, goodness.dof) else { return };
    let if_model_held = fit.estimates.iter().filter_map(|e| Some((e.parameter, e.std_error?))).collect();
    for estimate in fit.estimates.iter_mut().filter(|e| e.status != Status::Fixed) {
        *estimate = Estimate::bare(estimate.parameter, estimate.value, estimate.status);
    }
    // their regions are intervals of two parameters
    fit.diagnostics.contours.clear();
    let measured: Vec<Measured> = shots.iter().flatten().filter_map(restitution).collect();
    fit.refuted = Some(Refuted { reduced_chi2, p_value, if_model_held, restitution: mean(&measured) });
}

/// Returns e = (V' − U')·n / U·n of one shot with velocities V' of the object ball and U' of the
/// cue ball after the impact, with its standard error.
fn restitution(shot: &Deviations) -> Option<Measured> {
    let along = |of: fn(Axis) -> Observable, sign: f64| {
        [Axis::X, Axis::Y].into_iter().zip(shot.normal).map(move |(axis, n)| (of(axis), sign * n))
    };
    let mut direction = DVector::zeros(shot.observables.len());
    for (observable, n) in along(Observable::ObjectVelocity, 1.0).chain(along(Observable::CueVelocity, -1.0))
    {
        direction[shot.observables.iter().position(|other| *other == observable)?] = n;
    }
    let closing = shot.speed? * shot.cut.cos();
    let value = direction.dot(&DVector::from_column_slice(&shot.measured)) / closing;
    let sd = direction.dot(&(&shot.covariance * &direction)).sqrt() / closing;
    (value.is_finite() && sd.is_finite() && sd > 0.0).then(|| Measured::new(value, sd))
}

/// The mean of values that scatter by more than their own errors: weights 1/(s² + τ²), with τ² from
/// Cochran's Q (DerSimonian and Laird 1986, Controlled Clinical Trials 7, 177, Eq. 8).
fn mean(values: &[Measured]) -> Option<MeasuredRestitution> {
    let variance = |measured: &Measured| measured.sd.unwrap_or(f64::INFINITY).powi(2);
    // Σ w xᵏ with weights w = 1/(s² + τ²)ⁿ
    let sum = |between: f64, n: i32, k: i32| -> f64 {
        values.iter().map(|x| (variance(x) + between).powi(-n) * x.value.powi(k)).sum()
    };
    let weights = sum(0.0, 1, 0);
    let first = sum(0.0, 1, 1) / weights;
    let q: f64 = values.iter().map(|x| (x.value - first).powi(2) / variance(x)).sum();
    let excess = (q - (values.len() as f64 - 1.0)) / (weights - sum(0.0, 2, 0) / weights);
    let between = if values.len() > 1 { excess.max(0.0) } else { 0.0 };
    (!values.is_empty()).then(|| MeasuredRestitution {
        value: sum(between, 1, 1) / sum(between, 1, 0),
        std_error: sum(between, 1, 0).sqrt().recip(),
        scatter: between.sqrt(),
        shots: values.len(),
    })
}

/// Writes values by the names of their parameters.
pub(super) fn by_parameter<T: Serialize, S: Serializer>(
    values: &[(Parameter, T)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(values.iter().map(|(parameter, value)| (parameter.name(), value)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(value: f64, sd: f64) -> Measured {
        Measured { value, sd: Some(sd) }
    }

    #[test]
    fn one_value_is_its_own_mean_and_scatter_widens_the_error() {
        let one = mean(&[measured(0.8, 0.01)]).unwrap();
        assert_eq!((one.value, one.scatter, one.shots), (0.8, 0.0, 1));
        assert!((one.std_error - 0.01).abs() < 1e-12);
        // equal errors: τ² + s² is the sample variance, the error that of the plain mean
        let values = [0.70, 0.75, 0.80, 0.85].map(|e| measured(e, 0.01));
        let four = mean(&values).unwrap();
        let variance: f64 = [0.075, 0.025, 0.025, 0.075].iter().map(|d: &f64| d * d).sum::<f64>() / 3.0;
        assert!(
            (four.value - 0.775).abs() < 1e-12 && (four.std_error - (variance / 4.0).sqrt()).abs() < 1e-12
        );
        assert!((four.scatter - (variance - 1e-4).sqrt()).abs() < 1e-12);
        assert!(mean(&[]).is_none());
    }

    #[test]
    fn both_the_probability_and_the_size_of_chi2_count() {
        assert!(Refuted::judge(3736.0, 1).is_some());
        // many shots with noise stated too small by a third
        assert!(Refuted::judge(1800.0, 1000).is_none());
        // a single residual of 2.5 standard deviations
        assert!(Refuted::judge(6.3, 1).is_none());
    }
}
