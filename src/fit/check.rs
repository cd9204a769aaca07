//! Suspicions about a data set, without a fit. Plain errors were reported when it was loaded.

use std::f64::consts::FRAC_PI_2;

use indexmap::{IndexMap, IndexSet};
use minijinja::value::Serde;
use minijinja::{Value as Values, context};
use schemars::JsonSchema;
use serde::Serialize;

use super::film_words::words_of;
use crate::measurement::dataset::{Before, Dataset, Measured, Shot};
use crate::measurement::observable::{Axis, Observable};
use crate::measurement::parameter::Parameter;
use crate::measurement::spin::Spin;
use crate::physics::collision::Fidelity;
use crate::problem::{POLICY, find_copies, predict};

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

/// Limits of the sliding friction of a cloth; published values lie between 0.15 and 0.4.
const SLIDING: [f64; 2] = [0.1, 0.5];

/// A rolling ball's spin can add a few per cent to the energy of motion, and to a speed.
const MOST_RATIO: f64 = 1.05;

/// Kind of a finding that is good to know; all others are suspicious.
const ADVICE: &str = "advice";

/// Something suspicious, or good to know, about a shot or a data set.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Finding {
    /// Name of the shot; null: the whole data set.
    pub shot: Option<String>,
    #[serde(skip)]
    pub(crate) kind: &'static str,
    /// Whether it is suspicious; else it is good to know.
    pub(crate) suspicious: bool,
    /// The finding, as a clause without a capital letter and a full stop.
    #[serde(rename = "sentence")]
    pub text: String,
}

impl Finding {
    fn new(shot: Option<&Shot>, kind: &'static str, values: Values) -> Self {
        let (shot, text) = (shot.map(|shot| shot.name.clone()), words_of(kind, values));
        Self { shot, kind, suspicious: kind != ADVICE, text }
    }
}

/// Returns everything suspicious, and notes; findings about the whole data set come first. Impacts
/// must have been extracted from tracks before.
pub fn check(dataset: &Dataset) -> Vec<Finding> {
    let shots: Vec<&Shot> = dataset.shots.iter().collect();
    let mut findings = suspicious(dataset, &shots, dataset.sliding);
    findings.extend(advice(dataset));
    for shot in shots.iter().filter(|shot| shot.spin == Spin::Unknown) {
        findings.push(Finding::new(Some(shot), "unknown spin", context! {}));
    }
    let place = |name: &String| dataset.shots.iter().position(|shot| shot.name == *name);
    findings.sort_by_key(|finding| finding.shot.as_ref().map(place));
    findings
}

/// Returns what lets doubt some shots of a data set, or the μ_k of the cloth that their paths show;
/// findings about the whole come first. Fits have the same among their doubts.
pub(crate) fn suspicious(dataset: &Dataset, shots: &[&Shot], sliding: Option<Measured>) -> Vec<Finding> {
    let mut findings = if dataset.tracks.is_some() { copies(shots) } else { Vec::new() };
    if dataset.is_of_discs() {
        return findings;
    }
    let (radius, limits) = (dataset.ball.radius, RADII);
    if !(limits[0]..=limits[1]).contains(&radius) {
        let radius = radius.to_string();
        findings.push(Finding::new(None, "radius", context! { radius, limits }));
    }
    if let Some(Measured { value, sd: Some(sd) }) = sliding
        && let outside = (SLIDING[0] - value).max(value - SLIDING[1])
        && outside > POLICY.conflict * sd
    {
        findings.push(Finding::new(None, "sliding", context! { value, sd }));
    }
    let is_thick = |shot: &&Shot| match shot.before {
        Before::Angle { cut, .. } => cut.value.abs() < FRAC_PI_2.to_radians(),
        Before::Impact { .. } => false,
    };
    if shots.len() > 1 && shots.iter().all(is_thick) {
        findings.push(Finding::new(None, "radians", context! {}));
    }
    findings.extend(shots.iter().flat_map(|shot| of_shot(shot)));
    findings
}

/// Returns the shots of films of balls that are there twice, each clip and its copies.
fn copies(shots: &[&Shot]) -> Vec<Finding> {
    let numbers = |shot: &&Shot| {
        let before = match shot.before {
            Before::Impact { normal, velocity, .. } => [normal, velocity].concat(),
            Before::Angle { .. } => Vec::new(),
        };
        // the outcome first, whose errors are the smallest
        shot.after.iter().map(|row| row.measured).chain(before).collect()
    };
    let pairs = find_copies(&shots.iter().map(numbers).collect::<Vec<_>>());
    let find =
        |[i, j]: [usize; 2]| Finding::new(Some(shots[i]), "copy", context! { other => &shots[j].name });
    pairs.into_iter().map(find).collect()
}

/// Returns findings as warnings, each kind once: sentences.
pub(crate) fn warnings(found: &[Finding], shots: usize) -> Vec<String> {
    let mut kinds: IndexMap<&str, (&str, Vec<&str>)> = IndexMap::new();
    for Finding { shot, kind, text, .. } in found {
        kinds.entry(kind).or_insert((text, Vec::new())).1.extend(shot.as_deref());
    }
    let sentence = |(text, names)| words_of("of-kind", context! { text, names => Serde(names), shots });
    kinds.into_values().map(sentence).collect()
}

/// Returns what is good to know before a fit.
fn advice(dataset: &Dataset) -> Vec<Finding> {
    let mut all = Vec::new();
    let few = dataset.count_usable();
    if (1..FEW_SHOTS).contains(&few) {
        all.push(context! { few });
    }
    if !dataset.is_of_discs() {
        let open = Parameter::COEFFICIENTS.into_iter().filter(|own| is_undetermined(dataset, *own));
        all.extend(open.map(|own| {
            let (parameter, initial) = (own.name(), dataset.settings[own].initial.to_string());
            context! { parameter, initial }
        }));
    }
    let rows = dataset.shots.iter().flat_map(|shot| &shot.after).filter(|row| row.measured.sd.is_none());
    let unstated: IndexSet<&str> = rows.map(|row| row.observable.column()).collect();
    if !unstated.is_empty() {
        all.push(context! { unstated => Serde(unstated) });
    }
    all.into_iter().map(|values| Finding::new(None, ADVICE, values)).collect()
}

/// Returns whether no observation depends on a parameter.
fn is_undetermined(dataset: &Dataset, parameter: Parameter) -> bool {
    let model = dataset.model(Fidelity::Full);
    let mut other = dataset.settings;
    other[parameter].initial *= 0.5;
    let depends = |shot: &Shot| {
        let [here, there] =
            [&dataset.settings, &other].map(|settings| predict(shot, &model, &settings.coefficients()));
        here.is_ok_and(|here| there.is_ok_and(|there| there.values != here.values))
    };
    let is_fixed = dataset.settings[parameter].fixed;
    !is_fixed && !dataset.shots.is_empty() && !dataset.shots.iter().any(depends)
}

/// Returns what is suspicious about a shot.
fn of_shot(shot: &Shot) -> Vec<Finding> {
    let value = |observable| shot.after.iter().find(|m| m.observable == observable).map(|m| m.measured.value);
    let velocity = |ball: fn(Axis) -> Observable| Some([value(ball(Axis::X))?, value(ball(Axis::Y))?]);
    let size = |[x, y]: [f64; 2]| x.hypot(y);
    let mut findings = Vec::new();
    let mut add = |is_wrong: bool, kind, values: Values| {
        findings.extend(is_wrong.then(|| Finding::new(Some(shot), kind, values)));
    };
    let speed = match shot.before {
        Before::Impact { velocity, .. } => Some(size(velocity.map(|v| v.value))),
        Before::Angle { speed, .. } => speed.map(|speed| speed.value),
    };
    if let Some(speed) = speed {
        let [slow, fast] = SPEEDS;
        add(speed > fast, "fast", context! { speed });
        add(speed < slow, "slow", context! { speed, slow });
    }
    let Before::Impact { normal, .. } = shot.before else {
        let ratio = value(Observable::ObjectSpeedRatio).unwrap_or(0.0);
        add(ratio > MOST_RATIO, "speed ratio", context! { ratio });
        let throw = value(Observable::Throw).unwrap_or(0.0).to_degrees();
        add(throw.abs() > MOST_THROW_DEG, "throw", context! { throw });
        return findings;
    };
    let Some([x, y]) = velocity(Observable::ObjectVelocity) else { return findings };
    let [nx, ny] = normal.map(|n| n.value);
    let off = (nx * y - ny * x).atan2(nx * x + ny * y).to_degrees();
    add(off.abs() > MOST_THROW_DEG, "direction", context! { off });
    if let Some((cue, before)) = velocity(Observable::CueVelocity).zip(speed) {
        let ratio = (size([x, y]).powi(2) + size(cue).powi(2)) / (before * before);
        add(ratio > MOST_RATIO, "energy", context! { ratio });
    }
    findings
}
