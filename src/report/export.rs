//! Fitted parameters for other programs: the simulator pooltool, JSON, TOML.
//!
//! pooltool's balls (`pooltool.objects.ball.params.BallParams`) have m, R (kg, m), u_b and e_b (ball–ball
//! friction and restitution), u_s, u_r, u_sp_proportionality (cloth), e_c, f_c (cushions) and g.

use serde_json::{Value, json};

use super::document::{Body, FitDocument, FittedParameter};
use crate::measurement::number;
use crate::measurement::parameter::Parameter;
use crate::physics::ball::UNIFORM_SPHERE;
use crate::physics::name::worded;

worded! {
    /// The program or format to export to.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Target {
        /// Keyword arguments of pooltool's `BallParams`, as a JSON object.
        Pooltool = "pooltool",
        /// A JSON object.
        Json = "json",
        /// A TOML table.
        Toml = "toml",
    }
    /// The name on the command line.
    pub fn name;
}

/// A fit for another program.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// The text, with a newline at its end.
    pub text: String,
    /// What could not be carried over, and why, in sentences.
    pub left_behind: Vec<String>,
}

/// Renders a fit for another program. A parameter that the data do not determine is left out.
#[must_use]
pub fn export(fit: &FitDocument, target: Target) -> Exported {
    let (object, mut left_behind) = match target {
        Target::Pooltool => pooltool(fit),
        Target::Json | Target::Toml => plain(fit),
    };
    if let Some(refuted) = &fit.refuted {
        left_behind.insert(0, refuted.sentence.clone());
    }
    let text = match target {
        Target::Toml => toml::to_string(&object).unwrap_or_default(),
        Target::Pooltool | Target::Json => format!("{object:#}\n"),
    };
    Exported { text, left_behind }
}

/// A parameter that means something: fitted, or fixed by who knew it.
fn known(fit: &FitDocument, parameter: Parameter) -> Option<&FittedParameter> {
    fit.parameters.get(parameter.name()).filter(|p| p.status != "not-identified")
}

/// A bound that stands instead of an estimate.
struct OnlyBound {
    /// Its key in JSON, and its sign before the value.
    key: &'static str,
    sign: &'static str,
    value: f64,
    why: &'static str,
}

/// The bound of a parameter that has no estimate: it is on a plateau of χ², or ended at the end of its range.
fn only_bound(found: &FittedParameter) -> Option<OnlyBound> {
    let bound = |key, sign, value, why| Some(OnlyBound { key, sign, value, why });
    match (found.status.as_str(), found.plateau) {
        ("free", Some([edge, end])) if end >= edge => {
            bound("at_least", "≥ ", edge, "every larger value fits equally")
        }
        ("free", Some([edge, _])) => bound("at_most", "≤ ", edge, "every smaller value fits equally"),
        ("at-lower-bound", _) => {
            bound("bound", "", found.estimate, "the fit ended at the lower end of its range")
        }
        ("at-upper-bound", _) => {
            bound("bound", "", found.estimate, "the fit ended at the upper end of its range")
        }
        _ => None,
    }
}

/// Says what is known of a parameter of which only a bound is.
fn of_bound(parameter: Parameter, OnlyBound { sign, value, why, .. }: &OnlyBound) -> String {
    let (symbol, value) = (parameter.symbol(), number::plain(*value, 3));
    format!("{symbol} {sign}{value}: {why}, which is a bound and not a value")
}

/// The estimate of a parameter that means something and is not only a bound.
fn value(fit: &FitDocument, parameter: Parameter) -> Option<f64> {
    known(fit, parameter).filter(|found| only_bound(found).is_none()).map(|found| found.estimate)
}

fn pooltool(fit: &FitDocument) -> (Value, Vec<String>) {
    let mut left = Vec::new();
    match fit.ball {
        Some(ball) => left.extend(of_balls(fit, ball)),
        None => left.push(
            "Mass and radius: this fit.json does not say them; pooltool's defaults hold. Fit again.".into(),
        ),
    }
    let why = match fit.refuted {
        Some(_) => "the data refute the model that it belongs to",
        None => "the data do not determine it",
    };
    let means_something = |value: &&FittedParameter| fit.refuted.is_none() || value.status == "fixed";
    let fitted = |p: Parameter| known(fit, p).filter(means_something).and_then(|_| value(fit, p));
    let measured_e = fit.refuted.as_ref().and_then(|refuted| refuted.measured_e);
    let falls = falls(fit);
    let u_b = fitted(Parameter::Mu).filter(|_| !falls);
    let e_b = measured_e.map(|measured| measured.estimate).or_else(|| fitted(Parameter::E));
    for (parameter, name, is_told) in
        [(Parameter::Mu, "u_b", u_b.is_some() || falls), (Parameter::E, "e_b", e_b.is_some())]
    {
        if !is_told {
            let bound = known(fit, parameter).and_then(only_bound).filter(|_| fit.refuted.is_none());
            let why = bound.map_or(why.to_owned(), |bound| of_bound(parameter, &bound));
            left.push(format!("{} ({name}): {why}; pooltool's default holds.", parameter.symbol()));
        }
    }
    if falls {
        left.push(falling_in_pooltool(fit));
    } else if u_b.is_some() {
        left.push(
            "u_b is used by pooltool's AverageBallBallFriction only: its default for balls, \
             AlciatoreBallBallFriction, is a curve of its own over the slip speed and ignores u_b."
                .into(),
        );
    }
    left.extend(of_contact(fit));
    if fit.mu_k.is_none() {
        left.push("u_s (cloth, sliding): only footage tells it; pooltool's default holds.".into());
    }
    if let Some(mu_s) = value(fit, Parameter::MuS) {
        left.push(format!(
            "μ_s = {mu_s}: the friction of the cloth on the object ball during the impact has no counterpart in pooltool, \
             whose balls collide as if the table were not there. It is not u_s, the cloth's sliding friction \
             after the impact."
        ));
    }
    left.push("Standard errors and intervals: pooltool has no place for them.".into());
    left.push(
        "u_r, u_sp_proportionality (rolling and spinning on the cloth), e_c, f_c (cushions) and g are not fitted: \
         pooltool's defaults hold."
            .into(),
    );
    let arguments = json!({
        "m": fit.ball.and_then(|ball| ball.mass_kg), "R": fit.ball.map(|ball| ball.radius_m),
        "u_b": u_b, "e_b": e_b, "u_s": fit.mu_k.map(|mu_k| mu_k.value),
    });
    (stated(arguments), left)
}

/// What of the balls pooltool's arguments, which are of one ball, do not hold.
fn of_balls(fit: &FitDocument, ball: Body) -> Vec<String> {
    let mut left = Vec::new();
    if ball.mass_kg.is_none() {
        left.push("m: the data set does not state the masses; pooltool's default holds.".into());
    }
    let same = |other: &Body| {
        (other.radius_m, other.mass_kg, other.inertia) == (ball.radius_m, ball.mass_kg, ball.inertia)
    };
    if let Some(second) = fit.object.filter(|second| !same(second)) {
        let mass =
            second.mass_kg.map_or(String::new(), |mass| format!(", {} g", number::plain(1e3 * mass, 4)));
        left.push(format!(
            "The object ball (the second disc) by itself ({} mm{mass}): these arguments are of one ball, here the cue ball (the first \
             disc), and pooltool's friction and restitution take both balls for equal.",
            number::plain(1e3 * second.radius_m, 5)
        ));
    }
    if (ball.inertia - UNIFORM_SPHERE).abs() > 1e-9 {
        left.push(format!(
            "The moment of inertia {} MR²: pooltool takes every ball for a uniform sphere, 0.4 MR².",
            ball.inertia
        ));
    }
    left
}

/// What a fit knows of the contact that one number for friction and one for restitution do not hold.
fn of_contact(fit: &FitDocument) -> Vec<String> {
    let above_0 = |parameter: Parameter| value(fit, parameter).filter(|value| *value > 0.0);
    let kappa = above_0(Parameter::Kappa).map(|kappa| {
        format!(
            "κ = {kappa}: the contact of this fit gives way along its surface and springs back; pooltool's is rigid there, and throws \
             stun shots less with the same friction."
        )
    });
    let slope = above_0(Parameter::ESlope).map(|slope| {
        format!("e₁ = {slope} s/m: e falls with the closing speed v as e − e₁·v; e_b is one number, its value at v = 0.")
    });
    kappa.into_iter().chain(slope).collect()
}

/// Without what is not stated: TOML has no null.
fn stated(mut document: Value) -> Value {
    if let Some(entries) = document.as_object_mut() {
        entries.retain(|_, value| !value.is_null());
    }
    document
}

fn body(Body { radius_m, radius_m_sd, mass_kg, mass_kg_sd, inertia }: Body) -> Value {
    stated(json!({
        "radius_m": radius_m, "radius_m_sd": radius_m_sd, "mass_kg": mass_kg, "mass_kg_sd": mass_kg_sd,
        "inertia": inertia,
    }))
}

/// Whether the friction between the balls falls with their slip v, as μ + b·exp(−c·v).
fn falls(fit: &FitDocument) -> bool {
    [Parameter::B, Parameter::C].iter().any(|p| fit.parameters.contains_key(p.name()))
}

/// What to do about a friction that falls: a ball's `u_b` is one number and cannot hold it.
fn falling_in_pooltool(fit: &FitDocument) -> String {
    let [mu, b, c] = [Parameter::Mu, Parameter::B, Parameter::C].map(|p| value(fit, p));
    match (mu, b, c) {
        (Some(mu), Some(b), Some(c)) if fit.refuted.is_none() => format!(
            "u_b: the friction of this fit falls with the slip v as {mu} + {b}·exp(−{c}·v), v in m/s, and u_b is one number: \
             pooltool's default holds. Its model AlciatoreBallBallFriction(a={mu}, b={b}, c={c}) is this friction."
        ),
        _ => "u_b: the friction of this fit falls with the slip, but the data do not determine μ, b and c, or refute the \
              model: pooltool's default holds."
            .to_string(),
    }
}

/// Everything that the fit knows of its parameters.
fn plain(fit: &FitDocument) -> (Value, Vec<String>) {
    let group = fit.group.as_ref().map(|group| json!({"column": group.column, "label": group.label}));
    let measured_e = fit.refuted.as_ref().and_then(|refuted| refuted.measured_e);
    let measured_e = measured_e.map(|e| json!({"estimate": e.estimate, "std_error": e.std_error}));
    let e_falls = fit.parameters.contains_key(Parameter::ESlope.name());
    let mut document = stated(json!({
        "dataset": fit.dataset,
        "group": group,
        "fidelity": fit.fidelity,
        "ball": fit.ball.map(body),
        "object": fit.object.map(body),
        "refuted": fit.refuted.as_ref().map(|_| true),
        "measured_e": measured_e,
        // mu alone is the friction at high slip only
        "friction": falls(fit).then_some("mu + mu_b exp(-mu_c v), v: slip in m/s"),
        "restitution": e_falls.then_some("e - e_slope v, v: closing speed in m/s"),
        "mu_k": fit.mu_k.map(|mu_k| stated(json!(mu_k))),
    }));
    let mut left = Vec::new();
    let is_told =
        |p: &Parameter| Parameter::COEFFICIENTS.contains(p) || fit.parameters.contains_key(p.name());
    for parameter in Parameter::ALL.into_iter().filter(is_told) {
        if let Some((found, bound)) =
            known(fit, parameter).and_then(|found| Some((found, only_bound(found)?)))
        {
            document[parameter.name()] = stated(
                json!({"status": found.status, bound.key: bound.value, "interval_95": found.interval_95}),
            );
            left.push(format!("{}: it has no estimate.", of_bound(parameter, &bound)));
            continue;
        }
        match known(fit, parameter) {
            Some(FittedParameter { estimate, status, std_error, interval_95, .. }) => {
                document[parameter.name()] = stated(json!({
                    "estimate": estimate, "status": status, "std_error": std_error, "interval_95": interval_95,
                }));
            }
            None => left.push(format!("{}: the data do not tell it.", parameter.symbol())),
        }
    }
    (document, left)
}
