//! Fitted parameters for other programs: the simulator pooltool, JSON, TOML.
//!
//! pooltool's balls (`pooltool.objects.ball.params.BallParams`) have m, R (kg, m), u_b and e_b (ball–ball friction and restitution), u_s,
//! u_r, u_sp_proportionality (cloth), e_c, f_c (cushions) and g.

use serde_json::{Value, json};

use super::document::{Body, FitDocument, FittedParameter};
use super::size;
use crate::measurement::number::plain;
use crate::measurement::parameter::Parameter;
use crate::physics::ball::UNIFORM_SPHERE;
use crate::physics::name::worded;

worded! {
    /// The program or format to export to.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(crate) enum Target {
        /// Keyword arguments of pooltool's `BallParams`, as a JSON object.
        Pooltool = "pooltool",
        /// A JSON object.
        Json = "json",
        /// A TOML table.
        Toml = "toml",
    }
    /// The name on the command line.
    pub(crate) fn name;
}

/// A fit for another program.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Exported {
    /// The text, with a newline at its end.
    pub(crate) text: String,
    /// The values that could not be carried over, and why, in sentences.
    pub(crate) left_behind: Vec<String>,
}

/// Renders a fit for another program. A parameter that the data do not determine is left out.
pub(crate) fn export(fit: &FitDocument, target: Target) -> Exported {
    let (object, left) = if target == Target::Pooltool { pooltool(fit) } else { all(fit) };
    let text = match target {
        Target::Toml => toml::to_string(&object).unwrap_or_default(),
        Target::Pooltool | Target::Json => format!("{object:#}\n"),
    };
    let refuted = fit.refuted().into_iter().map(|found| found.sentence.clone());
    Exported { text, left_behind: refuted.chain(left).collect() }
}

/// A parameter as far as it is determined.
struct Known<'a> {
    found: &'a FittedParameter,
    /// If it has a bound instead of an estimate: the key in JSON, the bound, and why.
    bound: Option<(&'static str, f64, String)>,
}

/// Returns what is known of a parameter: it was fitted, or fixed by who knew it; `None` if the data do not determine it.
fn known(fit: &FitDocument, parameter: Parameter) -> Option<Known<'_>> {
    let found = fit.parameters.get(parameter.name()).filter(|found| found.status != "not-identified")?;
    let bound = match (found.status.as_str(), found.plateau) {
        ("free", Some([edge, end])) if end >= edge => {
            Some(("at_least", "≥ ", edge, "every larger value fits equally"))
        }
        ("free", Some([edge, _])) => Some(("at_most", "≤ ", edge, "every smaller value fits equally")),
        ("at-lower-bound" | "at-upper-bound", _) => {
            Some(("bound", "", found.estimate, "the fit ended at an end of its range"))
        }
        _ => None,
    };
    let bound = bound.map(|(key, sign, bound, why)| {
        let (symbol, number) = (parameter.symbol(), plain(bound, 3));
        (key, bound, format!("{symbol} {sign}{number}: {why}, which is a bound and not a value"))
    });
    Some(Known { found, bound })
}

/// Returns the estimate of a parameter that is known and not only by a bound.
fn value(fit: &FitDocument, parameter: Parameter) -> Option<f64> {
    known(fit, parameter).filter(|known| known.bound.is_none()).map(|known| known.found.estimate)
}

fn falls(fit: &FitDocument) -> bool {
    [Parameter::B, Parameter::C].iter().any(|p| fit.parameters.contains_key(p.name()))
}

fn pooltool(fit: &FitDocument) -> (Value, Vec<String>) {
    let mut left = of_balls(fit);
    // an estimate of a model that the data refute is none, but for what was held
    let fitted = |parameter: Parameter| {
        let is_fixed = known(fit, parameter).is_some_and(|known| known.found.status == "fixed");
        value(fit, parameter).filter(|_| fit.refuted().is_none() || is_fixed)
    };
    let falls = falls(fit);
    let u_b = fitted(Parameter::Mu).filter(|_| !falls);
    let e_b = fit.measured_e().map(|[estimate, _]| estimate).or_else(|| fitted(Parameter::E));
    let missing = [(Parameter::Mu, "u_b", u_b.is_none() && !falls), (Parameter::E, "e_b", e_b.is_none())];
    for (parameter, name, _) in missing.into_iter().filter(|(.., is_missing)| *is_missing) {
        let bound = known(fit, parameter).and_then(|known| known.bound);
        let why = match (fit.refuted(), bound) {
            (Some(_), _) => "the data refute the model that it belongs to".to_owned(),
            (None, Some((.., sentence))) => sentence,
            (None, None) => "the data do not determine it".to_owned(),
        };
        left.push(format!("{} ({name}): {why}; pooltool's default holds.", parameter.symbol()));
    }
    match [Parameter::Mu, Parameter::B, Parameter::C].map(fitted) {
        [Some(mu), Some(b), Some(c)] if falls => left.push(format!(
            "u_b: the friction of this fit falls with the slip v as {mu} + {b}·exp(−{c}·v), v in m/s, and u_b is one number. \
             pooltool's model AlciatoreBallBallFriction(a={mu}, b={b}, c={c}) is this friction."
        )),
        _ if falls => left.push("u_b: the friction of this fit falls with the slip, and is not known.".to_owned()),
        _ if u_b.is_some() => left.push(
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
        let value = value(fit, parameter).filter(|value| *value > 0.0);
        left.extend(value.map(|value| {
            let (symbol, meaning) = (parameter.symbol(), parameter.meaning());
            format!("{symbol} = {value}, {meaning}, has no counterpart in pooltool.")
        }));
    }
    left.push("Standard errors and intervals: pooltool has no place for them.".to_owned());
    left.push(
        "u_r, u_sp_proportionality, e_c, f_c and g are not fitted: pooltool's defaults hold.".to_owned(),
    );
    let arguments = json!({
        "m": fit.ball.and_then(|ball| ball.mass_kg), "R": fit.ball.map(|ball| ball.radius_m),
        "u_b": u_b, "e_b": e_b, "u_s": fit.mu_k.map(|mu_k| mu_k.value),
    });
    (stated(arguments), left)
}

/// Returns what of the balls pooltool's arguments, which are of one uniform ball, do not hold.
fn of_balls(fit: &FitDocument) -> Vec<String> {
    let Some(ball) = fit.ball else {
        return vec!["Mass and radius: this fit.json does not state them.".to_owned()];
    };
    let numbers = |body: Body| (body.radius_m, body.mass_kg, body.inertia);
    let no_mass = ball.mass_kg.is_none().then(|| "m: the data set does not state the masses.".to_owned());
    let second = fit.object.filter(|second| numbers(*second) != numbers(ball)).map(|second| {
        format!(
            "The object ball (the second disc) by itself, {}: these arguments are of the first.",
            size(&second)
        )
    });
    let inertia = (ball.inertia - UNIFORM_SPHERE).abs() > 1e-9;
    let inertia = inertia.then(|| {
        format!("The moment of inertia {} MR²: pooltool takes every ball as a uniform sphere.", ball.inertia)
    });
    [no_mass, second, inertia].into_iter().flatten().collect()
}

/// Returns an object without what is not stated: TOML has no null.
fn stated(mut document: Value) -> Value {
    if let Some(entries) = document.as_object_mut() {
        entries.retain(|_, value| !value.is_null());
        entries.values_mut().for_each(|value| *value = stated(value.take()));
    }
    document
}

fn all(fit: &FitDocument) -> (Value, Vec<String>) {
    let measured_e = fit.measured_e();
    let e_falls = fit.parameters.contains_key(Parameter::ESlope.name());
    let mut document = json!({
        "dataset": fit.dataset,
        "group": fit.group,
        "fidelity": fit.fidelity,
        "ball": fit.ball,
        "object": fit.object,
        "refuted": fit.refuted().map(|_| true),
        "measured_e": measured_e.map(|[estimate, std_error]| json!({"estimate": estimate, "std_error": std_error})),
        // mu alone is the friction at high slip only
        "friction": falls(fit).then_some("mu + mu_b exp(-mu_c v), v: slip in m/s"),
        "restitution": e_falls.then_some("e - e_slope v, v: closing speed in m/s"),
        "mu_k": fit.mu_k,
    });
    let mut left = Vec::new();
    for parameter in Parameter::ALL {
        let Some(Known { found, bound }) = known(fit, parameter) else {
            let is_fitted = fit.parameters.contains_key(parameter.name());
            if is_fitted || Parameter::COEFFICIENTS.contains(&parameter) {
                left.push(format!("{}: the data do not tell it.", parameter.symbol()));
            }
            continue;
        };
        let mut entry = json!({"status": found.status, "interval_95": found.interval_95});
        if let Some((key, value, sentence)) = bound {
            entry[key] = value.into();
            left.push(format!("{sentence}: it has no estimate."));
        } else {
            (entry["estimate"], entry["std_error"]) = (found.estimate.into(), found.std_error.into());
        }
        document[parameter.name()] = entry;
    }
    (stated(document), left)
}
