//! Fitted parameters as keyword arguments of the simulator pooltool.
//!
//! pooltool's balls (`pooltool.objects.ball.params.BallParams`) have m, R (kg, m), u_b and e_b
//! (ball–ball friction and restitution), u_s, u_r, u_sp_proportionality (cloth), e_c, f_c
//! (cushions) and g.

use super::document::{Body, FitDocument};
use super::size;
use crate::measurement::number::plain;
use crate::measurement::parameter::Parameter;
use crate::physics::ball::UNIFORM_SPHERE;

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
    let found = fit.parameters.get(parameter.name()).filter(|found| found.status != "not-identified");
    let found = found.ok_or("the data do not determine it")?;
    let (sign, bound, why) = match (found.status.as_str(), found.plateau) {
        ("fixed", _) => return Ok(found.estimate),
        _ if fit.refuted().is_some() => {
            return Err("the data refute the model that it belongs to".to_owned());
        }
        ("free", None) => return Ok(found.estimate),
        ("free", Some([edge, end])) if end >= edge => ("≥ ", edge, "every larger value fits equally"),
        ("free", Some([edge, _])) => ("≤ ", edge, "every smaller value fits equally"),
        _ => ("", found.estimate, "the fit ended at an end of its range"),
    };
    let (symbol, number) = (parameter.symbol(), plain(bound, 3));
    Err(format!("{symbol} {sign}{number}: {why}, which is a bound and not a value"))
}

/// Returns pooltool's arguments. A parameter that the data do not determine is left out.
pub(crate) fn export(fit: &FitDocument) -> Exported {
    let mut left: Vec<String> = fit.refuted().map(|found| found.sentence.clone()).into_iter().collect();
    left.extend(of_balls(fit));
    let mut arguments = serde_json::Map::new();
    let mut add =
        |name: &str, value: Option<f64>| value.map(|value| arguments.insert(name.to_owned(), value.into()));
    add("m", fit.ball.and_then(|ball| ball.mass_kg));
    add("R", fit.ball.map(|ball| ball.radius_m));
    let mut unknown = |parameter: Parameter, name: &str, why: String| {
        left.push(format!("{} ({name}): {why}; pooltool's default holds.", parameter.symbol()));
    };
    let falls = [Parameter::B, Parameter::C].iter().any(|own| fit.parameters.contains_key(own.name()));
    if !falls {
        let u_b = value(fit, Parameter::Mu).map_err(|why| unknown(Parameter::Mu, "u_b", why)).ok();
        add("u_b", u_b);
    }
    let e = fit.measured_e().map_or_else(|| value(fit, Parameter::E), |[estimate, _]| Ok(estimate));
    add("e_b", e.map_err(|why| unknown(Parameter::E, "e_b", why)).ok());
    add("u_s", fit.mu_k.map(|mu_k| mu_k.value));
    match [Parameter::Mu, Parameter::B, Parameter::C].map(|parameter| value(fit, parameter)) {
        [Ok(mu), Ok(b), Ok(c)] if falls => left.push(format!(
            "u_b: the friction of this fit decreases with the slip v as {mu} + {b}·exp(−{c}·v), v in m/s, and u_b is one number. \
             pooltool's model AlciatoreBallBallFriction(a={mu}, b={b}, c={c}) is this friction."
        )),
        _ if falls => left.push("u_b: the friction of this fit decreases with the slip, and is not known.".to_owned()),
        [Ok(_), ..] => left.push(
            "u_b is used by pooltool's AverageBallBallFriction only: its default for balls, AlciatoreBallBallFriction, is a curve \
             of its own over the slip speed and ignores u_b."
                .to_owned(),
        ),
        _ => {}
    }
    if fit.mu_k.is_none() {
        left.push("u_s (cloth, sliding): only footage determines it.".to_owned());
    }
    for parameter in [Parameter::MuS, Parameter::Kappa, Parameter::ESlope] {
        if let Some(value) = value(fit, parameter).ok().filter(|value| *value > 0.0) {
            let (symbol, meaning) = (parameter.symbol(), parameter.meaning());
            left.push(format!("{symbol} = {value}, {meaning}, has no counterpart in pooltool."));
        }
    }
    left.push("Standard errors and intervals: pooltool has no place for them.".to_owned());
    left.push(
        "u_r, u_sp_proportionality, e_c, f_c and g are not fitted: pooltool's defaults hold.".to_owned(),
    );
    Exported { text: format!("{:#}\n", serde_json::Value::Object(arguments)), left_behind: left }
}

/// Returns what of the balls pooltool's arguments, which are of one uniform ball, do not hold.
fn of_balls(fit: &FitDocument) -> Vec<String> {
    let Some(ball) = fit.ball else {
        return vec!["Mass and radius: this fit.json does not state them.".to_owned()];
    };
    let mut left = Vec::new();
    if ball.mass_kg.is_none() {
        left.push("m: the data set does not state the masses.".to_owned());
    }
    let numbers = |body: Body| (body.radius_m, body.mass_kg, body.inertia);
    left.extend(fit.object.filter(|second| numbers(*second) != numbers(ball)).map(|second| {
        let size = size(&second);
        format!("The object ball (the second disc) by itself, {size}: these arguments are of the first.")
    }));
    if (ball.inertia - UNIFORM_SPHERE).abs() > 1e-9 {
        let inertia = ball.inertia;
        left.push(format!(
            "The moment of inertia {inertia} MR²: pooltool takes every ball as a uniform sphere."
        ));
    }
    left
}
