//! Suspicions about a data set, without a fit. Plain errors were reported when it was loaded.

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use crate::measurement::dataset::{Before, Dataset, Measured, Shot};
use crate::measurement::number::{count_of, with_error};
use crate::measurement::observable::{Axis, Observable};
use crate::measurement::parameter::Parameter;
use crate::measurement::spin::Spin;
use crate::physics::collision::Fidelity;
use crate::problem::predict;
use crate::words::capital;

/// Number of shots below which the noise is left to luck.
pub(super) const FEW_SHOTS: usize = 5;

/// Speeds of a cue ball before the impact, m/s: below, gravity during the contact and the cloth
/// take more than the model leaves out; above, no player hits a ball (a break reaches 13).
const SPEEDS: [f64; 2] = [0.3, 14.0];

/// Radii of billiard balls, m: from miniature to Russian pyramid balls.
const RADII: [f64; 2] = [0.015, 0.037];

/// The object ball leaves along the line of centres but for the throw, which is at most 12° in any
/// table of treated balls (Alciatore 2014); more than this is another line.
const MOST_THROW_DEG: f64 = 20.0;

/// Published sliding frictions of a ball on a cloth lie between 0.15 and 0.4; these limits leave
/// room for others.
const SLIDING: [f64; 2] = [0.1, 0.5];

/// Number of standard errors beyond which a friction is outside of its limits.
const OUTSIDE_ERRORS: f64 = 3.0;

/// A rolling ball's spin can add a few per cent to the energy of motion, and to a speed.
const MOST_RATIO: f64 = 1.05;

/// Number of shots that a warning names.
const NAMED: usize = 3;

/// Kind of a finding that is good to know; all others are suspicious.
const ADVICE: &str = "advice";

/// Something suspicious, or good to know, about a shot or a data set.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Finding {
    /// Name of the shot; null: the whole data set.
    pub shot: Option<String>,
    /// Whether it is suspicious; else it is good to know.
    #[serde(rename = "suspicious", serialize_with = "suspicious_kind")]
    #[schemars(with = "bool")]
    pub(crate) kind: &'static str,
    /// The finding, as a clause without a capital letter and a full stop.
    #[serde(rename = "sentence")]
    pub text: String,
}

fn suspicious_kind<S: Serializer>(kind: &str, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bool(kind != ADVICE)
}

/// Returns everything suspicious, and notes; findings about the whole data set come first. Impacts
/// must have been extracted from tracks before.
pub fn check(dataset: &Dataset) -> Vec<Finding> {
    let shots: Vec<&Shot> = dataset.shots.iter().collect();
    let mut found = suspicious(dataset, &shots, dataset.sliding);
    let advice = advice(dataset).into_iter();
    found.extend(advice.map(|text| Finding { shot: None, kind: ADVICE, text }));
    for shot in shots.iter().filter(|shot| shot.spin == Spin::Unknown) {
        let text = "its spin is unknown: it cannot be fitted".to_owned();
        found.push(Finding { shot: Some(shot.name.clone()), kind: "unknown spin", text });
    }
    let place = |name: &String| dataset.shots.iter().position(|shot| shot.name == *name);
    found.sort_by_key(|finding| finding.shot.as_ref().map(place));
    found
}

/// Returns what lets doubt some shots of a data set, or the μ_k of the cloth that their paths show;
/// findings about the whole come first. Fits have the same among their doubts.
pub(crate) fn suspicious(dataset: &Dataset, shots: &[&Shot], sliding: Option<Measured>) -> Vec<Finding> {
    if dataset.is_of_discs() {
        return Vec::new();
    }
    let mut of_all = Vec::new();
    let (radius, [small, large]) = (dataset.ball.radius, RADII);
    if !(small..=large).contains(&radius) {
        of_all.push(("radius", format!(
            "the radius is {radius} m: billiard balls have {small} to {large} m (pool 0.028575, carom 0.03075, snooker 0.02625)"
        )));
    }
    if let Some(Measured { value, sd: Some(sd) }) = sliding
        && (value + OUTSIDE_ERRORS * sd < SLIDING[0] || value - OUTSIDE_ERRORS * sd > SLIDING[1])
    {
        of_all.push(("sliding", format!(
            "the paths after the impacts show that the cloth's sliding friction is {}, where 0.2 is typical: the spin of the cue \
             balls (cue_spin), the scale or the times may not be as stated",
            with_error(value, sd)
        )));
    }
    let of_all = of_all.into_iter().map(|(kind, text)| Finding { shot: None, kind, text });
    let of_shots = shots.iter().flat_map(|shot| {
        let found = of_shot(shot).into_iter();
        found.map(|(kind, text)| Finding { shot: Some(shot.name.clone()), kind, text })
    });
    of_all.chain(of_shots).collect()
}

/// Returns findings as warnings, each kind once: sentences.
pub(crate) fn warnings(found: &[Finding], shots: usize) -> Vec<String> {
    let mut all = Vec::new();
    for (i, Finding { kind, text, .. }) in found.iter().enumerate() {
        let is_of_kind = |finding: &&Finding| finding.kind == *kind;
        if found[..i].iter().any(|other| is_of_kind(&other)) {
            continue;
        }
        let of_kind = found.iter().filter(is_of_kind);
        let names: Vec<&str> = of_kind.filter_map(|finding| finding.shot.as_deref()).collect();
        all.push(match names[..] {
            [] => format!("{}.", capital(text)),
            [name] => format!("Shot {name}: {text}."),
            [first, ..] => {
                let others = if names.len() > NAMED { ", …" } else { "" };
                let named = names[..names.len().min(NAMED)].join(", ");
                format!("{} of {shots} shots ({named}{others}), as shot {first}: {text}.", names.len())
            }
        });
    }
    all
}

/// Returns what is good to know before a fit.
fn advice(dataset: &Dataset) -> Vec<String> {
    let mut all = Vec::new();
    let usable = dataset.count_usable();
    if (1..FEW_SHOTS).contains(&usable) {
        all.push(format!("{} can be used: too few to show how noisy they are", count_of(usable, "shot")));
    }
    if !dataset.is_of_discs() {
        all.extend(Parameter::COEFFICIENTS.into_iter().filter_map(|own| undetermined(dataset, own)));
    }
    all.extend(noise(dataset));
    all
}

/// Returns that no observation depends on a parameter.
fn undetermined(dataset: &Dataset, parameter: Parameter) -> Option<String> {
    /// Part of the initial value at which something else is predicted if it depends on it.
    const OTHER: f64 = 0.9;
    let setting = &dataset.settings[parameter];
    let model = dataset.model(Fidelity::Full);
    let mut other = dataset.settings;
    other[parameter].initial *= OTHER;
    let depends = |shot: &Shot| {
        let [here, there] =
            [&dataset.settings, &other].map(|settings| predict(shot, &model, &settings.coefficients()));
        here.is_ok_and(|here| there.is_ok_and(|there| there.values != here.values))
    };
    if setting.fixed || dataset.shots.is_empty() || dataset.shots.iter().any(depends) {
        return None;
    }
    let why = match parameter {
        Parameter::Mu => {
            "every shot is without slip between the balls, or only what does not depend on it is measured"
        }
        Parameter::MuS => "no shot has topspin, so the cloth never carries the object ball",
        _ => "no speed after the impact is measured",
    };
    let symbol = parameter.symbol();
    Some(format!("these shots do not determine {symbol}: {why}; it will be left at {}", setting.initial))
}

/// Returns the observables whose noise is not stated.
fn noise(dataset: &Dataset) -> Option<String> {
    let mut names: Vec<&str> = Vec::new();
    for row in dataset.shots.iter().flat_map(|shot| &shot.after) {
        let name = row.observable.column();
        if row.measured.sd.is_none() && !names.contains(&name) {
            names.push(name);
        }
    }
    (!names.is_empty()).then(|| {
        format!(
            "no standard deviations for {}: they will be estimated from the residuals, and the fit cannot be tested",
            names.join(", ")
        )
    })
}

/// Returns what is suspicious about a shot: kinds and clauses.
fn of_shot(shot: &Shot) -> Vec<(&'static str, String)> {
    let value = |observable| shot.after.iter().find(|m| m.observable == observable).map(|m| m.measured.value);
    let velocity = |ball: fn(Axis) -> Observable| Some([value(ball(Axis::X))?, value(ball(Axis::Y))?]);
    let size = |[x, y]: [f64; 2]| x.hypot(y);
    let mut found = Vec::new();
    let mut add = |is_wrong: bool, kind, text: String| found.extend(is_wrong.then_some((kind, text)));
    let speed = match shot.before {
        Before::Impact { velocity, .. } => Some(size(velocity.map(|v| v.value))),
        Before::Angle { speed, .. } => speed.map(|speed| speed.value),
    };
    if let Some(speed) = speed {
        let [slow, fast] = SPEEDS;
        add(
            speed > fast,
            "fast",
            format!(
                "the cue ball comes at {speed:.1} m/s, faster than any break: the frame rate or the scale may be wrong"
            ),
        );
        add(
            speed < slow,
            "slow",
            format!("the cue ball comes at {speed:.2} m/s: below {slow} m/s the model leaves too much out"),
        );
    }
    let Before::Impact { normal, .. } = shot.before else {
        let ratio = value(Observable::ObjectSpeedRatio).unwrap_or(0.0);
        let text = format!("the object ball leaves {ratio:.2} times as fast as the cue ball came");
        add(ratio > MOST_RATIO, "speed ratio", text);
        let throw = value(Observable::Throw).unwrap_or(0.0).to_degrees();
        let text = format!("a throw of {throw:.1}° is more than friction gives");
        add(throw.abs() > MOST_THROW_DEG, "throw", text);
        return found;
    };
    let Some([x, y]) = velocity(Observable::ObjectVelocity) else { return found };
    let [nx, ny] = normal.map(|n| n.value);
    let off = (nx * y - ny * x).atan2(nx * x + ny * y).to_degrees();
    add(
        off.abs() > MOST_THROW_DEG,
        "direction",
        format!(
            "the object ball leaves {off:.0}° off the line of centres: the balls or the axes may be mixed up"
        ),
    );
    if let Some((cue, before)) = velocity(Observable::CueVelocity).zip(speed) {
        let ratio = (size([x, y]).powi(2) + size(cue).powi(2)) / (before * before);
        let text =
            format!("the balls have {ratio:.2} times the cue ball's energy of motion after the impact");
        add(ratio > MOST_RATIO, "energy", text);
    }
    found
}
