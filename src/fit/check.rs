//! Suspicions about a data set, without a fit. Plain errors were reported when it was loaded.

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use crate::measurement::dataset::{Before, Dataset, Measured, Shot, Tracks};
use crate::measurement::number::{count_of, with_error};
use crate::measurement::observable::{Axis, Observable};
use crate::measurement::parameter::Parameter;
use crate::measurement::spin::Spin;
use crate::physics::collision::Fidelity;
use crate::problem::predict;

/// Number of shots below which the noise is left to luck.
pub(super) const FEW_SHOTS: usize = 5;

/// Speeds of a cue ball before the impact, m/s: below, gravity during the contact and the cloth take more than
/// the model leaves out; above, no player hits a ball (a break reaches 13).
const SPEEDS: [f64; 2] = [0.3, 14.0];

/// Radii of billiard balls, m: from miniature to Russian pyramid balls.
const RADII: [f64; 2] = [0.015, 0.037];

/// The object ball leaves along the line of centres but for the throw, which is at most 12° in any table of
/// treated balls (Alciatore 2014); more than this is another line.
const MOST_THROW_DEG: f64 = 20.0;

/// Published sliding frictions of a ball on a cloth lie between 0.15 and 0.4; these limits leave room for others.
const SLIDING: [f64; 2] = [0.1, 0.5];

/// Number of standard errors beyond which a friction is outside of its limits.
const OUTSIDE_ERRORS: f64 = 3.0;

/// A rolling ball's spin can add a few per cent to the energy of motion, and to a speed.
const MOST_RATIO: f64 = 1.05;

/// Number of shots that a warning names.
const NAMED: usize = 3;

/// Something suspicious, or good to know, about a shot or a data set.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Finding {
    /// Name of the shot; null: the whole data set.
    pub shot: Option<String>,
    /// Whether it is suspicious; else it is good to know.
    #[serde(rename = "suspicious", serialize_with = "suspicious_kind")]
    #[schemars(with = "bool")]
    pub(crate) kind: Kind,
    /// The finding, as a clause without a capital letter and a full stop.
    #[serde(rename = "sentence")]
    pub text: String,
}

fn suspicious_kind<S: Serializer>(kind: &Kind, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bool(*kind != Kind::Advice)
}

/// The kind of a finding: what it is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub(crate) enum Kind {
    /// Nothing need be wrong, but it is good to know.
    Advice,
    /// The radius is not that of billiard balls.
    Radius,
    /// The sliding friction of the cloth that the paths show is unusual.
    Sliding,
    /// The cue ball is slower than the model is made for.
    Slow,
    /// The cue ball is faster than a player can hit it.
    Fast,
    /// The cue ball's spin is unknown.
    UnknownSpin,
    /// The object ball leaves in a direction far from the line of centres.
    Direction,
    /// The balls have more energy after the impact than before.
    Energy,
    /// The object ball leaves faster than a collision allows.
    SpeedRatio,
    /// The throw is larger than friction gives.
    Throw,
}

impl Finding {
    /// Returns whether something may be wrong with the data.
    pub(crate) fn is_suspicious(&self) -> bool {
        self.kind != Kind::Advice
    }
}

/// Returns everything suspicious, and notes; findings about the whole data set come first. Impacts must have
/// been extracted from tracks before.
pub fn check(dataset: &Dataset) -> Vec<Finding> {
    let shots: Vec<&Shot> = dataset.shots.iter().collect();
    let mut found = suspicious(dataset, &shots, dataset.sliding);
    let advice = advice(dataset).into_iter();
    found.extend(advice.map(|text| Finding { shot: None, kind: Kind::Advice, text }));
    for shot in shots.iter().filter(|shot| shot.spin == Spin::Unknown) {
        let text = "its spin is unknown: it cannot be fitted".to_owned();
        found.push(Finding { shot: Some(shot.name.clone()), kind: Kind::UnknownSpin, text });
    }
    let place = |name: &String| dataset.shots.iter().position(|shot| shot.name == *name);
    found.sort_by_key(|finding| finding.shot.as_ref().map(place));
    found
}

/// Returns what lets doubt some shots of a data set, or the μ_k of the cloth that their paths show; findings about the whole
/// come first. Fits have the same among their doubts.
pub(crate) fn suspicious(dataset: &Dataset, shots: &[&Shot], sliding: Option<Measured>) -> Vec<Finding> {
    if dataset.is_of_discs() {
        return Vec::new();
    }
    let mut all = Vec::new();
    let mut add = |shot: Option<&String>, kind, text| all.push(Finding { shot: shot.cloned(), kind, text });
    let (radius, [small, large]) = (dataset.ball.radius, RADII);
    if !(small..=large).contains(&radius) {
        let usual = format!(
            "the radius is {radius} m: billiard balls have {small} to {large} m (pool 0.028575, carom 0.03075, snooker 0.02625)"
        );
        add(None, Kind::Radius, usual);
    }
    if let Some(Measured { value, sd: Some(sd) }) = sliding
        && (value + OUTSIDE_ERRORS * sd < SLIDING[0] || value - OUTSIDE_ERRORS * sd > SLIDING[1])
    {
        let text = format!(
            "the paths after the impacts show that the cloth's sliding friction is {}, where 0.2 is usual: the spin of the cue \
             balls (cue_spin), the scale or the times may not be as stated",
            with_error(value, sd)
        );
        add(None, Kind::Sliding, text);
    }
    let fps = dataset.tracks.as_ref().and_then(|tracks| tracks.fps);
    for shot in shots {
        for (kind, text) in of_shot(shot, fps) {
            add(Some(&shot.name), kind, text);
        }
    }
    all
}

/// Returns findings as warnings, each kind once: sentences.
pub(crate) fn warnings(found: &[Finding], shots: usize) -> Vec<String> {
    let mut kinds: Vec<Kind> = Vec::new();
    let mut all = Vec::new();
    for Finding { kind, text, .. } in found {
        if kinds.contains(kind) {
            continue;
        }
        kinds.push(*kind);
        let of_kind = found.iter().filter(|finding| finding.kind == *kind);
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

/// Returns words with a capital letter. A symbol (e, μ, μ_s) stays as it is: of words, only `a` has one letter.
pub(crate) fn capital(words: &str) -> String {
    let first = words.split([' ', '_']).next().unwrap_or_default();
    if first != "a" && first.chars().count() == 1 {
        return words.to_string();
    }
    let mut letters = words.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// Returns what is good to know before a fit.
fn advice(dataset: &Dataset) -> Vec<String> {
    let mut all = Vec::new();
    let usable = dataset.count_usable();
    if (1..FEW_SHOTS).contains(&usable) {
        all.push(format!("{} can be used: too few to tell how noisy they are", count_of(usable, "shot")));
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
    Some(format!("nothing here tells {symbol}: {why}; it will be left at {}", setting.initial))
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
            "no standard deviations for {}: they will be estimated from the residuals, and nothing can test the fit",
            names.join(", ")
        )
    })
}

/// Returns what is suspicious about a shot, of a film with `fps` frames per second.
fn of_shot(shot: &Shot, fps: Option<f64>) -> Vec<(Kind, String)> {
    let value = |observable| shot.after.iter().find(|m| m.observable == observable).map(|m| m.measured.value);
    let velocity = |ball: fn(Axis) -> Observable| Some([value(ball(Axis::X))?, value(ball(Axis::Y))?]);
    let size = |[x, y]: [f64; 2]| x.hypot(y);
    let mut found = Vec::new();
    match shot.before {
        Before::Impact { normal, velocity: before, .. } => {
            let speed = size(before.map(|v| v.value));
            found.extend(of_speed(speed, fps));
            let object = velocity(Observable::ObjectVelocity);
            if let Some([x, y]) = object.filter(|object| size(*object) > 0.0) {
                let [nx, ny] = normal.map(|n| n.value);
                let off = (nx * y - ny * x).atan2(nx * x + ny * y).to_degrees();
                let text = format!(
                    "the object ball leaves {off:.0}° off the line of centres: the balls or the axes may be mixed up"
                );
                found.extend((off.abs() > MOST_THROW_DEG).then_some((Kind::Direction, text)));
            }
            if let Some((object, cue)) = object.zip(velocity(Observable::CueVelocity)) {
                let ratio = (size(object).powi(2) + size(cue).powi(2)) / (speed * speed);
                let text = format!(
                    "the balls have {ratio:.2} times the cue ball's energy of motion after the impact"
                );
                found.extend((ratio > MOST_RATIO).then_some((Kind::Energy, text)));
            }
        }
        Before::Angle { speed, .. } => {
            found.extend(speed.and_then(|speed| of_speed(speed.value, fps)));
            if let Some(ratio) = value(Observable::ObjectSpeedRatio).filter(|ratio| *ratio > MOST_RATIO) {
                let text = format!("the object ball leaves {ratio:.2} times as fast as the cue ball came");
                found.push((Kind::SpeedRatio, text));
            }
            let throw = value(Observable::Throw).map(f64::to_degrees);
            if let Some(throw) = throw.filter(|throw| throw.abs() > MOST_THROW_DEG) {
                found.push((Kind::Throw, format!("a throw of {throw:.1}° is more than friction gives")));
            }
        }
    }
    found
}

/// Returns what is suspicious about the speed of a cue ball before the impact, m/s.
fn of_speed(speed: f64, fps: Option<f64>) -> Option<(Kind, String)> {
    let [slow, fast] = SPEEDS;
    if speed > fast {
        let text = format!(
            "the cue ball comes at {speed:.1} m/s, faster than any break: the frame rate or the scale may be wrong"
        );
        return Some((Kind::Fast, text));
    }
    let rate = fps.filter(|fps| *fps <= Tracks::MAX_PLAYBACK).map_or(String::new(), |fps| {
        format!(
            ". {fps} frames/s is a rate at which films are played: [video] capture_fps is to be what the camera recorded at, \
             in slow motion 120, 240 or more"
        )
    });
    let text =
        format!("the cue ball comes at {speed:.2} m/s: below {slow} m/s the model leaves too much out{rate}");
    (speed < slow).then_some((Kind::Slow, text))
}
