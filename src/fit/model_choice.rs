//! With what the shots of a fit are computed: the model as it is stated, or as the shots call for it, and where their search begins.

use super::fidelity_choice::{self, Chosen};
use super::samples::Search;
use super::scatter::Scatter;
use super::{FitError, Options, Rejected};
use crate::likelihood::fitted::Fitted;
use crate::likelihood::prediction::Plan;
use crate::likelihood::sample::Sample;
use crate::measurement::dataset::{Dataset, Shot};
use crate::measurement::parameter::{Compliance, Parameter, Settings};
use crate::measurement::values::Values;
use crate::physics::collision::{FidelityChoice, Model};
use crate::physics::friction_law::Law;

/// What the shots of a data set are fitted with: model, settings, and where a search begins.
///
/// # Errors
/// A contact that is stated to give way, at a fidelity that takes it as rigid.
pub(crate) fn fitted_with(
    dataset: &Dataset,
    options: &Options,
) -> Result<(Model, Settings, Values), FitError> {
    let mut model = dataset.model(options.fidelity.first());
    model.tolerance = options.tolerance;
    model.effects = options.effects.unwrap_or(model.effects);
    let settings = options.falling.applied(dataset.settings_of_balls());
    let initial = Values::usual(&settings);
    if settings.falls {
        model.law = Law::Exponential { b: initial[Parameter::B], c: initial[Parameter::C] };
    }
    if settings.compliance == Compliance::Stated {
        if let FidelityChoice::Of(fidelity) = options.fidelity
            && !fidelity.effects().compliance
        {
            return Err(FitError::Rigid { dataset: dataset.name.clone(), fidelity: fidelity.name() });
        }
        model.kappa = initial[Parameter::Kappa];
    }
    Ok((model, settings, initial))
}

/// The shots that can be predicted at usual values of the parameters, and the others with the reason.
pub(crate) fn plan(shots: &[&Shot], model: &Model, usual: &Values) -> (Vec<Fitted>, Vec<Rejected>) {
    let (mut fitted, mut rejected) = (Vec::new(), Vec::new());
    for (index, shot) in shots.iter().enumerate() {
        let planned = Plan::new(shot).and_then(|plan| {
            plan.predict(model, &usual.coefficients()).map(|_| Fitted { index, plan, film: None })
        });
        match planned {
            Ok(shot) => fitted.push(shot),
            Err(error) => {
                rejected.push(Rejected { shot: shot.name.clone(), reason: error.to_string() });
            }
        }
    }
    (fitted, rejected)
}

/// What the shots are fitted with, once it is chosen.
pub(crate) struct ModelChoice {
    /// The shots as they are computed; of discs with their scatter in their errors.
    pub fitted: Vec<Fitted>,
    pub model: Model,
    pub settings: Settings,
    /// Where the search begins; none: where a scan of the friction says.
    pub starts: Vec<Vec<Values>>,
    /// Of discs.
    pub scatter: Option<Scatter>,
    /// Of discs: other minima with their own scatter, and how much higher −2 log L is there.
    pub rivals: Option<Vec<(Values, f64)>>,
    /// How much lower −2 log L is with a contact that gives way, where the shots call for it.
    pub gives_way: Option<f64>,
    /// What was left out and what came of it: sentences.
    pub notes: Vec<String>,
}

impl ModelChoice {
    /// For shots of balls that are planned with the model of a search of one sample, which has none yet.
    pub(super) fn of(mut fitted: Vec<Fitted>, search: &Search, options: &Options) -> Result<Self, FitError> {
        let sample = search.first();
        let (mut model, mut settings) = (*sample.model, *sample.settings);
        let near = options.near.map(|near| vec![with_what_is_fixed(sample, near)]);
        let shots = std::slice::from_mut(&mut fitted);
        let Chosen { starts, gives_way, notes } =
            fidelity_choice::choose(options.fidelity, shots, search, near.as_slice())?;
        if gives_way.is_some() {
            settings.compliance = Compliance::Stated;
            model.kappa = sample.initial[Parameter::Kappa];
        }
        Ok(Self { fitted, model, settings, starts, scatter: None, rivals: None, gives_way, notes })
    }
}

/// Values near which a search begins, with what is fixed where it is stated.
fn with_what_is_fixed(sample: &Sample, near: Values) -> Values {
    let has = sample.settings.parameters();
    let fixed = |p: &Parameter| sample.settings[*p].fixed || !has.contains(p);
    Parameter::ALL.into_iter().filter(fixed).fold(near, |near, p| near.with(p, sample.initial[p]))
}
