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
use crate::measurement::number::plain;
use crate::measurement::parameter::Parameter;

/// A fit for pooltool.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Exported {
    /// A JSON object, with a newline at its end.
    pub(crate) text: String,
    /// The values that could not be carried over, and why, in sentences.
    pub(crate) left_behind: Vec<String>,
}

/// Returns the value of a parameter that was fitted, or fixed by who knew it.
///
/// # Errors
/// Why it is not known: the data refute the model, do not determine it, or give a bound only.
fn value(fit: &FitDocument, parameter: Parameter) -> Result<f64, String> {
    let stored = fit.parameters.get(parameter.name()).filter(|stored| stored.status != "not-identified");
    let stored = stored.ok_or("the data do not determine it")?;
    let (sign, bound, why) = match (stored.status.as_str(), stored.plateau) {
        ("fixed", _) => return Ok(stored.estimate),
        _ if fit.refuted().is_some() => {
            return Err("the data refute the model that it belongs to".to_owned());
        }
        ("free", None) => return Ok(stored.estimate),
        ("free", Some([edge, end])) if end >= edge => ("≥ ", edge, "every larger value fits equally"),
        ("free", Some([edge, _])) => ("≤ ", edge, "every smaller value fits equally"),
        _ => ("", stored.estimate, "the fit ended at an end of its range"),
    };
    let (symbol, number) = (parameter.symbol(), plain(bound, 3));
    Err(format!("{symbol} {sign}{number}: {why}, which is a bound and not a value"))
}

/// Returns pooltool's arguments. A parameter that the data do not determine is left out.
pub(crate) fn export(fit: &FitDocument) -> Exported {
    let falls = [Parameter::B, Parameter::C].iter().any(|own| fit.parameters.contains_key(own.name()));
    let arguments = [
        ("m", fit.ball.and_then(|ball| ball.mass_kg)),
        ("R", fit.ball.map(|ball| ball.radius_m)),
        ("u_b", value(fit, Parameter::Mu).ok().filter(|_| !falls)),
        ("e_b", value(fit, Parameter::E).ok()),
        ("u_s", fit.mu_k.map(|mu_k| mu_k.value)),
    ];
    let arguments = arguments.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?.into())));
    let known = |parameter: Parameter| {
        let known = match value(fit, parameter) {
            Ok(value) => context! { value },
            Err(why) => context! { why },
        };
        (parameter.name(), known)
    };
    let left_behind = templates::text(
        include_str!("templates/export.jinja"),
        context! {
            falls,
            refuted => fit.refuted().map(|found| found.sentence.clone()),
            values => Serde(BTreeMap::from(Parameter::ALL.map(known))),
            fit => Serde(fit),
        },
    );
    let text = format!("{:#}\n", Value::Object(arguments.collect()));
    Exported { text, left_behind: left_behind.lines().map(str::to_owned).collect() }
}
