//! Fitted parameters as keyword arguments of the simulator pooltool.
//!
//! pooltool's balls (`pooltool.objects.ball.params.BallParams`) have m, R (kg, m), u_b and e_b
//! (ball–ball friction and restitution), u_s, u_r, u_sp_proportionality (cloth), e_c, f_c
//! (cushions) and g.

use std::collections::BTreeMap;

use minijinja::context;
use minijinja::value::Serde;
use serde_json::Value;

use super::document::FitDocument;
use super::templates;
use crate::measurement::parameter::Parameter;

/// A fit for pooltool.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Exported {
    /// A JSON object, with a newline at its end.
    pub(crate) text: String,
    /// The values that could not be carried over, and why, in sentences.
    pub(crate) left_behind: Vec<String>,
}

/// Returns the value of a parameter that was fitted, or fixed by who knew it; `None` if the data
/// refute the model, do not determine it, or give a bound only.
fn value(fit: &FitDocument, parameter: Parameter) -> Option<f64> {
    let stored = fit.parameters.get(parameter.name())?;
    let is_fitted = stored.status == "free" && stored.plateau.is_none() && fit.refuted().is_none();
    (is_fitted || stored.status == "fixed").then_some(stored.estimate)
}

/// Returns pooltool's arguments. A parameter that the data do not determine is left out.
pub(crate) fn export(fit: &FitDocument) -> Exported {
    let falls = [Parameter::B, Parameter::C].iter().any(|own| fit.parameters.contains_key(own.name()));
    let arguments = [
        ("m", fit.ball.and_then(|ball| ball.mass_kg)),
        ("R", fit.ball.map(|ball| ball.radius_m)),
        ("u_b", value(fit, Parameter::Mu).filter(|_| !falls)),
        ("e_b", value(fit, Parameter::E)),
        ("u_s", fit.mu_k.map(|mu_k| mu_k.value)),
    ];
    let arguments = arguments.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?.into())));
    let left_behind = templates::text(
        include_str!("templates/export.jinja"),
        context! {
            falls,
            refuted => fit.refuted().map(|found| found.sentence.clone()),
            values => BTreeMap::from(Parameter::ALL.map(|parameter| (parameter.name(), value(fit, parameter)))),
            fit => Serde(fit),
        },
    );
    let text = format!("{:#}\n", Value::Object(arguments.collect()));
    Exported { text, left_behind: left_behind.lines().map(str::to_owned).collect() }
}
