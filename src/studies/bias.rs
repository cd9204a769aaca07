//! The bias of fits with each fidelity, of data without noise that [`Fidelity::Contact`]
//! computes with all effects: the deviation of the estimates from the truth, in standard errors.

use std::time::Instant;

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::Serialize;

use crate::fit;
use crate::fit::{Depth, FitError, Options};
use crate::measurement::dataset::{Dataset, Measurement, ObjectBall};
use crate::measurement::loss::Loss;
use crate::measurement::observable::Observable;
use crate::measurement::parameter::{Compliance, Parameter, Setting, Settings};
use crate::physics::collision::{Effects, Fidelity, Model};
use crate::problem::predict;

/// A parameter of such a fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
struct Found {
    /// Unit of the numbers: 1 for a ratio.
    unit: &'static str,
    /// The value that the data were made with.
    truth: f64,
    /// The estimate; null if it is not determined.
    estimate: Option<f64>,
    /// Estimate less truth.
    bias: Option<f64>,
    /// Standard error of the fit for the noise that is stated.
    std_error: Option<f64>,
}

/// The model with which shots are fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Way {
    /// The name in reports.
    pub(crate) name: &'static str,
    /// The fidelity; `None`: that of `fit --fidelity auto`.
    fidelity: Option<Fidelity>,
    /// How compliant the contact is taken to be, that of the data if stated.
    compliance: Compliance,
}

/// A fit to shots without noise.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Row {
    /// The fidelity that was fitted, or auto.
    fidelity: &'static str,
    /// Tangential compliance κ of the contact that computed the shots.
    #[schemars(with = "Option<f64>")]
    pub(crate) kappa: f64,
    /// The values by parameter.
    parameters: IndexMap<&'static str, Found>,
    /// χ² of data without noise over their number: what the noise would have to hide.
    #[schemars(with = "Option<f64>")]
    chi2_per_observation: f64,
    /// Duration of the fit, s.
    seconds: f64,
}

/// The models that have parameters, in the order in which they are fitted.
pub(crate) const FITTED: [Way; 7] = {
    use Compliance::{Auto, Rigid, Stated};
    use Fidelity::{Contact, Full, Inelastic, Linear, Ode};
    [
        Way { name: "inelastic", fidelity: Some(Inelastic), compliance: Rigid },
        Way { name: "linear", fidelity: Some(Linear), compliance: Rigid },
        Way { name: "full", fidelity: Some(Full), compliance: Rigid },
        Way { name: "ode", fidelity: Some(Ode), compliance: Rigid },
        Way { name: "ode compliant", fidelity: Some(Ode), compliance: Stated },
        Way { name: "contact", fidelity: Some(Contact), compliance: Stated },
        Way { name: "auto", fidelity: None, compliance: Auto },
    ]
};

/// Returns up to 200 shots of a data set, spread evenly, as `contact` with all effects, `kappa` and
/// the initial values of the parameters predicts them, without priors and labels. Standard
/// deviations that are not stated are those of good footage.
pub(crate) fn noise_free(dataset: &Dataset, kappa: f64) -> Dataset {
    let coefficients = dataset.settings.coefficients();
    let reference = Model { effects: Effects::ALL, kappa, ..dataset.model(Fidelity::Contact) };
    // m/s, rad/s, rad
    let typical = |observable: Observable| match observable {
        Observable::CueSpin(_) | Observable::ObjectSpin(_) => 1.0,
        _ if observable.is_angle() => 0.3_f64.to_radians(),
        _ => 0.005,
    };
    let every = dataset.shots.len().div_ceil(200).max(1);
    let mut shots = Vec::new();
    for shot in dataset.shots.iter().step_by(every) {
        let Ok(prediction) = predict(shot, &reference, &coefficients) else { continue };
        let mut shot = shot.clone();
        for Measurement { observable, measured } in &mut shot.after {
            // one that is not predicted determines the speed before the impact
            if let Some(row) = prediction.observables.iter().position(|own| own == observable) {
                measured.value = prediction.values[row];
            }
            measured.sd.get_or_insert(typical(*observable));
        }
        shots.push(shot);
    }
    let each = dataset.settings.each.map(|setting| Setting { prior: None, ..setting });
    let mut settings = Settings { each, ..Settings::default() };
    settings[Parameter::Kappa] = Setting::held(kappa);
    // an error of the masses would hide what a fidelity leaves out
    let object = ObjectBall::exact(dataset.object.map_or(dataset.ball, |object| object.ball));
    Dataset { shots, settings, object: Some(object), by: None, loss: Loss::default(), ..dataset.clone() }
}

/// Fits data of [`noise_free`] with one of [`FITTED`].
///
/// # Errors
/// The fit fails.
pub(crate) fn bias(dataset: &Dataset, way: Way) -> Result<Row, FitError> {
    let begun = Instant::now();
    let is_contact = way.fidelity == Some(Fidelity::Contact);
    let options = Options {
        fidelity: way.fidelity,
        tolerance: if is_contact { Model::TOLERANCE } else { Model::TOLERANCE_OF_FITS },
        depth: Depth::Estimates,
        ..Options::default()
    };
    let mut dataset = dataset.clone();
    dataset.settings.compliance = way.compliance;
    let fitted = fit::fit(&dataset, &options)?.remove(0);
    let parameters = Parameter::COEFFICIENTS.map(|parameter| {
        let truth = dataset.settings[parameter].initial;
        // a fidelity that leaves much out is refuted, as the bias shows
        let std_error = fitted.std_error_if_model_held(parameter);
        let estimate = std_error.and_then(|_| Some(fitted.get(parameter)?.value));
        let bias = estimate.map(|estimate| estimate - truth);
        (parameter.name(), Found { unit: "1", truth, estimate, bias, std_error })
    });
    let observations = dataset.shots.iter().map(|shot| shot.after.len()).sum::<usize>();
    Ok(Row {
        fidelity: way.name,
        kappa: dataset.settings[Parameter::Kappa].initial,
        parameters: parameters.into(),
        chi2_per_observation: fitted.chi2() / observations as f64,
        seconds: begun.elapsed().as_secs_f64(),
    })
}
