//! Fitted parameters for other programs: the simulator pooltool, JSON, TOML.
//!
//! pooltool's balls (`pooltool.objects.ball.params.BallParams`) have m, R (kg, m), u_b and e_b (ball–ball
//! friction and restitution), u_s, u_r, u_sp_proportionality (cloth), e_c, f_c (cushions) and g.

use serde_json::{Map, Value, json};

use crate::io::stored_fit::{StoredBall, StoredFit, StoredParameter};
use crate::measurement::number;
use crate::measurement::parameter::Parameter;

/// The program or format to export to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Keyword arguments of pooltool's `BallParams`, as a JSON object.
    Pooltool,
    /// A JSON object.
    Json,
    /// A TOML table.
    Toml,
}

impl Target {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Pooltool, Self::Json, Self::Toml];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Pooltool => "pooltool",
            Self::Json => "json",
            Self::Toml => "toml",
        }
    }
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
pub fn export(fit: &StoredFit, target: Target) -> Exported {
    let (object, mut left_behind) = match target {
        Target::Pooltool => pooltool(fit),
        Target::Json | Target::Toml => plain(fit),
    };
    if let Some(refuted) = &fit.refuted {
        left_behind.insert(0, refuted.sentence.clone());
    }
    let value = Value::Object(object);
    let text = match target {
        Target::Toml => toml::to_string(&value).unwrap_or_default(),
        Target::Pooltool | Target::Json => format!("{value:#}\n"),
    };
    Exported { text, left_behind }
}

/// A parameter that means something: fitted, or fixed by who knew it.
fn known(fit: &StoredFit, parameter: Parameter) -> Option<&StoredParameter> {
    fit.parameters.get(parameter.name()).filter(|p| p.status != "not-identified")
}

fn pooltool(fit: &StoredFit) -> (Map<String, Value>, Vec<String>) {
    let mut object = Map::new();
    let mut left = Vec::new();
    if let Some(ball) = fit.ball {
        match ball.mass_kg {
            Some(mass) => _ = object.insert("m".into(), json!(mass)),
            None => left.push("m: the data set does not state the masses; pooltool's default holds.".into()),
        }
        if let Some(second) = fit.object
            && (second.radius_m, second.mass_kg, second.inertia)
                != (ball.radius_m, ball.mass_kg, ball.inertia)
        {
            let mass =
                second.mass_kg.map_or(String::new(), |mass| format!(", {} g", number::plain(1e3 * mass, 4)));
            left.push(format!(
                "The object ball (the second disc) by itself ({} mm{mass}): these arguments are of one ball, here the cue ball (the first \
                 disc), and pooltool's friction and restitution take both balls for equal.",
                number::plain(1e3 * second.radius_m, 5)
            ));
        }
        object.insert("R".into(), json!(ball.radius_m));
        if (ball.inertia - crate::physics::ball::UNIFORM_SPHERE).abs() > 1e-9 {
            left.push(format!(
                "The moment of inertia {} MR²: pooltool takes every ball for a uniform sphere, 0.4 MR².",
                ball.inertia
            ));
        }
    } else {
        left.push(
            "Mass and radius: this fit.json does not say them; pooltool's defaults hold. Fit again.".into(),
        );
    }
    let mut not_told = |parameter: Parameter, name: &str| {
        let why = match fit.refuted {
            Some(_) => "the data refute the model that it belongs to",
            None => "the data do not determine it",
        };
        left.push(format!("{} ({name}): {why}; pooltool's default holds.", parameter.symbol()));
    };
    let measured_e = fit.refuted.as_ref().and_then(|refuted| refuted.measured_e);
    let falls = falls(fit);
    for (parameter, name) in [(Parameter::Mu, "u_b"), (Parameter::E, "e_b")] {
        if let Some(measured) = measured_e.filter(|_| parameter == Parameter::E) {
            object.insert(name.into(), json!(measured.estimate));
            continue;
        }
        match known(fit, parameter) {
            _ if falls && parameter == Parameter::Mu => {}
            Some(value) if fit.refuted.is_none() || value.status == "fixed" => {
                object.insert(name.into(), json!(value.estimate));
            }
            _ => not_told(parameter, name),
        }
    }
    if falls {
        left.push(falling_in_pooltool(fit));
    } else if object.contains_key("u_b") {
        left.push(
            "u_b is used by pooltool's AverageBallBallFriction only: its default for balls, \
             AlciatoreBallBallFriction, is a curve of its own over the slip speed and ignores u_b."
                .into(),
        );
    }
    left.extend(of_contact(fit));
    match fit.mu_k {
        Some(mu_k) => _ = object.insert("u_s".into(), json!(mu_k.estimate)),
        None => {
            left.push("u_s (cloth, sliding): only footage tells it; pooltool's default holds.".into());
        }
    }
    if let Some(mu_s) = known(fit, Parameter::MuS) {
        left.push(format!(
            "μ_s = {}: the friction of the cloth on the object ball during the impact has no counterpart in pooltool, \
             whose balls collide as if the table were not there. It is not u_s, the cloth's sliding friction \
             after the impact.",
            mu_s.estimate
        ));
    }
    left.push("Standard errors and intervals: pooltool has no place for them.".into());
    left.push(
        "u_r, u_sp_proportionality (rolling and spinning on the cloth), e_c, f_c (cushions) and g are not fitted: \
         pooltool's defaults hold."
            .into(),
    );
    (object, left)
}

/// What a fit knows of the contact that one number for friction and one for restitution do not hold.
fn of_contact(fit: &StoredFit) -> Vec<String> {
    let above_0 = |parameter: Parameter| Some(known(fit, parameter)?.estimate).filter(|value| *value > 0.0);
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

/// Without a mass that is not stated: TOML has no null.
fn body(body: StoredBall) -> Value {
    let mut entry = Map::from_iter([("radius_m".to_string(), json!(body.radius_m))]);
    for (key, value) in
        [("radius_m_sd", body.radius_m_sd), ("mass_kg", body.mass_kg), ("mass_kg_sd", body.mass_kg_sd)]
    {
        if let Some(value) = value {
            entry.insert(key.into(), json!(value));
        }
    }
    entry.insert("inertia".into(), json!(body.inertia));
    Value::Object(entry)
}

/// Whether the friction between the balls falls with their slip v, as μ + b·exp(−c·v).
fn falls(fit: &StoredFit) -> bool {
    [Parameter::B, Parameter::C].iter().any(|p| fit.parameters.contains_key(p.name()))
}

/// What to do about a friction that falls: a ball's `u_b` is one number and cannot hold it.
fn falling_in_pooltool(fit: &StoredFit) -> String {
    let [mu, b, c] = [Parameter::Mu, Parameter::B, Parameter::C].map(|p| known(fit, p).map(|p| p.estimate));
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
fn plain(fit: &StoredFit) -> (Map<String, Value>, Vec<String>) {
    let mut object = Map::new();
    let mut left = Vec::new();
    object.insert("dataset".into(), json!(fit.dataset));
    if let Some(group) = &fit.group {
        object.insert("group".into(), json!({"column": group.column, "label": group.label}));
    }
    object.insert("fidelity".into(), json!(fit.fidelity));
    if let Some(ball) = fit.ball {
        object.insert("ball".into(), body(ball));
    }
    if let Some(second) = fit.object {
        object.insert("object".into(), body(second));
    }
    if let Some(refuted) = &fit.refuted {
        object.insert("refuted".into(), json!(true));
        if let Some(measured) = refuted.measured_e {
            let entry = json!({"estimate": measured.estimate, "std_error": measured.std_error});
            object.insert("measured_e".into(), entry);
        }
    }
    let falls = falls(fit);
    if falls {
        // mu alone is the friction at high slip only
        object.insert("friction".into(), json!("mu + mu_b exp(-mu_c v), v: slip in m/s"));
    }
    if fit.parameters.contains_key(Parameter::ESlope.name()) {
        object.insert("restitution".into(), json!("e - e_slope v, v: closing speed in m/s"));
    }
    let stated = |p: &Parameter| Parameter::COEFFICIENTS.contains(p) || fit.parameters.contains_key(p.name());
    for parameter in Parameter::ALL.into_iter().filter(stated) {
        let Some(value) = known(fit, parameter) else {
            left.push(format!("{}: the data do not tell it.", parameter.symbol()));
            continue;
        };
        let mut entry = Map::new();
        entry.insert("estimate".into(), json!(value.estimate));
        entry.insert("status".into(), json!(value.status));
        // TOML has no null
        if let Some(error) = value.std_error {
            entry.insert("std_error".into(), json!(error));
        }
        if let Some(interval) = value.interval_95 {
            entry.insert("interval_95".into(), json!(interval));
        }
        object.insert(parameter.name().into(), Value::Object(entry));
    }
    if let Some(mu_k) = fit.mu_k {
        let mut entry = Map::from_iter([("estimate".to_string(), json!(mu_k.estimate))]);
        if let Some(error) = mu_k.std_error {
            entry.insert("std_error".into(), json!(error));
        }
        object.insert("mu_k".into(), Value::Object(entry));
    }
    (object, left)
}
