//! Whether the data refute the model, and what they then still say.
//!
//! Standard errors hold if the model does. Where χ² rules the model out they are not given; what needs no model of the
//! friction, the ratio of the normal velocities, is given in their place.

use serde::{Serialize, Serializer};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::fit::{Estimate, Fit, Status};
use crate::measurement::dataset::{Before, Measured, Shot};
use crate::measurement::observable::{Axis, Observable};
use crate::measurement::parameter::Parameter;
use crate::problem::Policy;

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
    /// The restitution measured without the model; `None` if the data do not have the velocities of both balls
    /// after the impact.
    #[serde(rename = "measured_e")]
    pub(crate) restitution: Option<MeasuredRestitution>,
}

/// The coefficient of restitution as the ratio of the normal velocities after and before the impact. No law of friction
/// goes into it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct MeasuredRestitution {
    /// The mean over the shots, each weighted by its own error and the scatter between shots.
    #[serde(rename = "estimate")]
    pub(crate) value: f64,
    /// The standard error of the mean.
    pub(crate) std_error: f64,
    #[serde(rename = "scatter_between_shots")]
    /// The standard deviation between shots, beyond their own errors; 0 for a single shot.
    pub(crate) scatter: f64,
    /// How many shots it was measured in.
    pub(crate) shots: usize,
}

impl Refuted {
    /// Returns χ² per degree of freedom, and the probability that chance gives a larger χ², if both rule the model out. As
    /// many parameters as observations should leave no residual; what they leave is judged as one degree of freedom.
    pub(crate) fn judge(chi2: f64, dof: usize) -> Option<[f64; 2]> {
        let dof = dof.max(1) as f64;
        let reduced = chi2 / dof;
        let p_value = ChiSquared::new(dof).map_or(1.0, |distribution| distribution.sf(chi2));
        let policy = Policy::default();
        (p_value < policy.shot_tail && reduced > policy.refuted_rows).then_some([reduced, p_value])
    }
}

impl Fit {
    /// The standard error of a parameter as if the model held: what is stated, or if the data refute the model what would
    /// have been.
    pub fn std_error_if_model_held(&self, parameter: Parameter) -> Option<f64> {
        let stated = self.estimates.iter().find(|e| e.parameter == parameter).and_then(|e| e.std_error);
        stated.or_else(|| {
            let nominal = &self.refuted.as_ref()?.if_model_held;
            nominal.iter().find(|(known, _)| *known == parameter).map(|(_, error)| *error)
        })
    }
}

/// Finds out whether χ² refutes the model; then takes the errors of the estimates away. `shots` are those that were fitted.
pub(in crate::fit) fn judge(fit: &mut Fit, shots: &[&Shot]) {
    let Some(goodness) = fit.diagnostics.goodness.as_ref().filter(|goodness| goodness.noise_is_stated) else {
        return;
    };
    let Some([reduced_chi2, p_value]) = Refuted::judge(goodness.chi2, goodness.dof) else { return };
    let if_model_held =
        fit.estimates.iter().filter_map(|e| Some((e.parameter, e.std_error?))).collect::<Vec<_>>();
    for estimate in fit.estimates.iter_mut().filter(|e| e.status != Status::Fixed) {
        *estimate = Estimate::bare(estimate.parameter, estimate.value, estimate.status);
    }
    // their regions are intervals of two parameters
    fit.diagnostics.contours.clear();
    let measured: Vec<Measured> = shots.iter().filter_map(|shot| restitution(shot)).collect();
    fit.refuted = Some(Refuted { reduced_chi2, p_value, if_model_held, restitution: mean(&measured) });
}

/// Returns e = −(V' − U')·n / (V − U)·n of one shot, with its standard error.
fn restitution(shot: &Shot) -> Option<Measured> {
    let Before::Impact { normal, velocity } = shot.before else { return None };
    let after =
        |observable| shot.after.iter().find(|row| row.observable == observable).map(|row| row.measured);
    let both = |of: fn(Axis) -> Observable| Some([after(of(Axis::X))?, after(of(Axis::Y))?]);
    let length = normal[0].value.hypot(normal[1].value);
    let n = normal.map(|m| m.value / length);
    let along = |v: [Measured; 2]| v[0].value * n[0] + v[1].value * n[1];
    let across = |v: [Measured; 2]| v[1].value * n[0] - v[0].value * n[1];
    let (u, v, w) = (velocity, both(Observable::ObjectVelocity)?, both(Observable::CueVelocity)?);
    let closing = along(u);
    let e = (along(v) - along(w)) / closing;
    let sd = |measured: &Measured| measured.sd.unwrap_or(0.0);
    let of_direction = (n[1] * sd(&normal[0])).hypot(n[0] * sd(&normal[1]));
    // (∂e/∂α σ_α)² + Σ (∂e/∂v σ_v)², with the direction α of n and the velocities along it
    let by_direction = across(v) - across(w) - e * across(u);
    let mut variance = (by_direction * of_direction).powi(2);
    for k in 0..2 {
        variance += (n[k] * n[k]) * ((e * sd(&u[k])).powi(2) + sd(&v[k]).powi(2) + sd(&w[k]).powi(2));
    }
    let sd = variance.sqrt() / closing.abs();
    (e.is_finite() && sd.is_finite() && sd > 0.0).then_some(Measured { value: e, sd: Some(sd) })
}

/// The mean of values that scatter by more than their own errors: weights 1/(s² + τ²), with τ² from Cochran's Q
/// (DerSimonian and Laird 1986, Controlled Clinical Trials 7, 177, Eq. 8).
pub fn mean(values: &[Measured]) -> Option<MeasuredRestitution> {
    let weighted = |between: f64| {
        let (mut sum, mut weights, mut squares) = (0.0, 0.0, 0.0);
        for Measured { value, sd } in values {
            let weight = 1.0 / (sd.unwrap_or(f64::INFINITY).powi(2) + between);
            (sum, weights, squares) = (sum + weight * value, weights + weight, squares + weight * weight);
        }
        (sum / weights, weights, squares)
    };
    if values.is_empty() {
        return None;
    }
    let (first, weights, squares) = weighted(0.0);
    let q: f64 = values.iter().map(|m| ((m.value - first) / m.sd.unwrap_or(f64::INFINITY)).powi(2)).sum();
    let room = weights - squares / weights;
    let excess = q - (values.len() - 1) as f64;
    let between = if values.len() > 1 && room > 0.0 { (excess / room).max(0.0) } else { 0.0 };
    let (value, weights, _) = weighted(between);
    Some(MeasuredRestitution {
        value,
        std_error: weights.sqrt().recip(),
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
