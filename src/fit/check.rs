//! What is suspicious about a data set, without fitting it. Plain errors were reported when it was loaded.

use crate::measurement::dataset::{Before, Dataset, Measured, Shot, Tracks};
use crate::measurement::number::{count_of, plain, with_error};
use crate::measurement::observable::{Axis, Observable};
use crate::measurement::parameter::Parameter;
use crate::measurement::spin::Spin;
use crate::physics::collision::{Coefficients, Fidelity};
use crate::problem::predict;

/// Fewer shots than this leave the noise to luck.
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

/// What is usual.
const USUAL_SLIDING: f64 = 0.2;

/// No cloth that is published of has a higher rolling resistance, four standard deviations from the mean.
const MOST_ROLLING: f64 = 0.03;

/// So many standard errors are no chance.
const SURELY: f64 = 3.0;

/// A rolling ball's spin can add a few per cent to the energy of motion, and to a speed.
const MOST_RATIO: f64 = 1.05;

/// So many shots are named in a warning.
const NAMED: usize = 3;

/// Something suspicious, or good to know, about a shot or a data set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// The name of the shot; `None` where it concerns the whole data set.
    pub shot: Option<String>,
    /// What was found, as a clause without a capital letter and a full stop.
    pub text: String,
    /// The kind of the finding.
    pub kind: Kind,
}

/// The kind of a finding: what it is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// Nothing need be wrong, but it is good to know.
    Advice,
    /// The radius is not that of billiard balls.
    Radius,
    /// The sliding friction of the cloth that the paths show is unusual.
    Sliding,
    /// The rolling resistance of the cloth that the paths show is unusual.
    Rolling,
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
    fn whole(kind: Kind, text: String) -> Self {
        Self { shot: None, text, kind }
    }

    /// Whether something may be wrong with the data.
    #[must_use]
    pub fn is_suspicious(&self) -> bool {
        self.kind != Kind::Advice
    }
}

/// Looks for everything suspicious and whatever else is good to know; findings about the whole data set come first. Impacts must have
/// been extracted from tracks before.
#[must_use]
pub fn check(dataset: &Dataset) -> Vec<Finding> {
    let shots: Vec<&Shot> = dataset.shots.iter().collect();
    let (whole, mut of_shots): (Vec<_>, Vec<_>) =
        suspicious(dataset, &shots, [dataset.sliding, dataset.rolling])
            .into_iter()
            .partition(|finding| finding.shot.is_none());
    for shot in shots.iter().filter(|shot| shot.spin == Spin::Unknown) {
        let text = "its spin is unknown: it cannot be fitted".to_string();
        of_shots.push(Finding { shot: Some(shot.name.clone()), text, kind: Kind::UnknownSpin });
    }
    let order =
        |finding: &Finding| dataset.shots.iter().position(|shot| Some(&shot.name) == finding.shot.as_ref());
    of_shots.sort_by_key(order);
    whole.into_iter().chain(advice(dataset)).chain(of_shots).collect()
}

/// What lets doubt some shots of a data set, or the μ_k and μ_r of the cloth that their paths show; findings about the whole come
/// first. Fits have the same among their warnings.
pub(crate) fn suspicious(
    dataset: &Dataset,
    shots: &[&Shot],
    [sliding, rolling]: [Option<Measured>; 2],
) -> Vec<Finding> {
    if dataset.tracks.as_ref().is_some_and(|tracks| tracks.discs.is_some()) {
        return Vec::new();
    }
    let mut found = Vec::new();
    let radius = dataset.ball.radius;
    if !(RADII[0]..=RADII[1]).contains(&radius) {
        found.push(Finding::whole(
            Kind::Radius,
            format!(
                "the radius is {radius} m: billiard balls have {} to {} m (pool 0.028575, carom 0.03075, snooker 0.02625)",
                RADII[0], RADII[1]
            ),
        ));
    }
    if let Some(Measured { value, sd }) = rolling
        && value > MOST_ROLLING
    {
        // none where the model is refuted
        let known = sd.filter(|sd| sd.is_finite());
        let resistance = known.map_or_else(|| plain(value, 2), |sd| with_error(value, sd));
        found.push(Finding::whole(
            Kind::Rolling,
            format!(
                "the balls slow down before the impacts as if the cloth's rolling resistance were {resistance}, where 0.01 is \
                 usual: cue balls that are said to roll may slide (cue_spin), or the times or the scale of the footage are wrong"
            ),
        ));
    }
    if let Some(Measured { value, sd: Some(sd) }) = sliding
        && (value + SURELY * sd < SLIDING[0] || value - SURELY * sd > SLIDING[1])
    {
        found.push(Finding::whole(
            Kind::Sliding,
            format!(
                "the paths after the impacts show that the cloth's sliding friction is {}, where {USUAL_SLIDING} is \
                 usual: the spin of the cue balls (cue_spin), the scale or the times may not be as stated",
                with_error(value, sd)
            ),
        ));
    }
    let fps = dataset.tracks.as_ref().and_then(|tracks| tracks.fps);
    for shot in shots {
        let of_shot = of_shot(shot, fps).into_iter();
        found.extend(of_shot.map(|(kind, text)| Finding { shot: Some(shot.name.clone()), text, kind }));
    }
    found
}

/// Whether most shots show that balls or axes are mixed up, which no cause explains.
pub(super) fn are_mixed_up(shots: &[&Shot]) -> bool {
    let is_mixed_up = |shot: &&&Shot| {
        let mut kinds = of_shot(shot, None).into_iter().map(|(kind, _)| kind);
        kinds.any(|kind| matches!(kind, Kind::Direction | Kind::Energy | Kind::SpeedRatio | Kind::Throw))
    };
    2 * shots.iter().filter(is_mixed_up).count() > shots.len()
}

/// Findings as warnings, each kind once: sentences.
#[must_use]
pub fn warnings(found: &[Finding], shots: usize) -> Vec<String> {
    let mut kinds: Vec<Kind> = Vec::new();
    for finding in found {
        if !kinds.contains(&finding.kind) {
            kinds.push(finding.kind);
        }
    }
    let of_kind = |kind: Kind| {
        let alike: Vec<&Finding> = found.iter().filter(|finding| finding.kind == kind).collect();
        let names: Vec<&str> = alike.iter().filter_map(|finding| finding.shot.as_deref()).collect();
        let text = &alike.first()?.text;
        Some(match names[..] {
            [] => format!("{}.", capital(text)),
            [name] => format!("Shot {name}: {text}."),
            [first, ..] => {
                let others = if names.len() > NAMED { ", …" } else { "" };
                let named = names[..names.len().min(NAMED)].join(", ");
                format!("{} of {shots} shots ({named}{others}), as shot {first}: {text}.", names.len())
            }
        })
    };
    kinds.into_iter().filter_map(of_kind).collect()
}

/// With a capital letter. A symbol (e, μ, μ_s) stays as it is: of words, only `a` has one letter.
pub(crate) fn capital(words: &str) -> String {
    let first = words.split([' ', '_']).next().unwrap_or_default();
    if first != "a" && first.chars().count() == 1 {
        return words.to_string();
    }
    let mut letters = words.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// What is good to know before a fit.
fn advice(dataset: &Dataset) -> Vec<Finding> {
    let mut found = Vec::new();
    let mut whole = |text: String| found.push(Finding::whole(Kind::Advice, text));
    let balls = dataset.tracks.as_ref().is_none_or(|tracks| tracks.discs.is_none());
    let usable = dataset.shots.len();
    if (1..FEW_SHOTS).contains(&usable) {
        whole(format!("{} can be used: too few to tell how noisy they are", count_of(usable, "shot")));
    }
    if dataset.tracks.as_ref().is_some_and(|tracks| tracks.shots.is_empty())
        && dataset.sliding.is_none()
        && balls
    {
        whole(
            "the paths after the impacts do not tell the cloth's friction μ_k: a published value is used"
                .into(),
        );
    }
    if dataset.source.is_none() {
        whole("there is no source: say who measured it, how and when".into());
    }
    told(dataset, &mut whole);
    noise(dataset, &mut whole);
    found
}

/// Parameters that no observation depends on.
fn told(dataset: &Dataset, say: &mut impl FnMut(String)) {
    /// Part of a usual value at which something else is predicted if it depends on it.
    const OTHER: f64 = 0.9;
    let initial = Parameter::COEFFICIENTS.map(|p| dataset.settings[p].initial);
    let coefficients = Coefficients { mu: initial[0], mu_s: initial[1], e: initial[2] };
    let model = dataset.model(Fidelity::Full);
    let discs = dataset.tracks.as_ref().is_some_and(|tracks| tracks.discs.is_some());
    let mut depends = [false; 3];
    // what sticks with a usual friction still bounds it from below
    let mut bounds_mu = false;
    for shot in &dataset.shots {
        bounds_mu |= shot.after.iter().any(|after| after.observable == Observable::ImpulseRatio);
        let Ok(usual) = predict(shot, &model, &coefficients) else { continue };
        let Coefficients { mu, mu_s, e } = coefficients;
        let others = [
            Coefficients { mu: OTHER * mu, ..coefficients },
            Coefficients { mu_s: OTHER * mu_s, ..coefficients },
            Coefficients { e: OTHER * e, ..coefficients },
        ];
        for (depends, other) in depends.iter_mut().zip(others) {
            *depends |= predict(shot, &model, &other).is_ok_and(|there| there.values != usual.values);
        }
    }
    for parameter in Parameter::COEFFICIENTS {
        if depends[parameter as usize] || dataset.settings[parameter].fixed || dataset.shots.is_empty() {
            continue;
        }
        let why = match parameter {
            // no cloth carries discs
            Parameter::MuS if discs => continue,
            Parameter::Mu if bounds_mu => {
                say(
                    "the discs stick together where they touch, so that these shots tell how large μ is at least, not how large it is: \
                     thinner hits determine it"
                        .to_owned(),
                );
                continue;
            }
            Parameter::Mu => {
                "every shot is without slip between the balls, or only what does not depend on it is measured"
            }
            Parameter::MuS => "no shot has topspin, so the cloth never carries the object ball",
            _ => "no speed after the impact is measured",
        };
        say(format!(
            "nothing here tells {}: {why}; it will be left at {}",
            parameter.symbol(),
            dataset.settings[parameter].initial
        ));
    }
}

fn noise(dataset: &Dataset, say: &mut impl FnMut(String)) {
    let mut without: Vec<Observable> = Vec::new();
    for row in dataset.shots.iter().filter(|shot| shot.joint.is_none()).flat_map(|shot| &shot.after) {
        if row.measured.sd.is_none() && !without.contains(&row.observable) {
            without.push(row.observable);
        }
    }
    if !without.is_empty() {
        let names: Vec<_> = without.iter().map(|observable| observable.column()).collect();
        say(format!(
            "no standard deviations for {}: they will be estimated from the residuals, and nothing can test the fit",
            names.join(", ")
        ));
    }
}

/// What is suspicious about a shot, of a film with so many frames per second.
fn of_shot(shot: &Shot, fps: Option<f64>) -> Vec<(Kind, String)> {
    let mut found = Vec::new();
    let value = |observable| shot.after.iter().find(|m| m.observable == observable).map(|m| m.measured.value);
    let speed = match shot.before {
        Before::Impact { velocity, .. } => Some(velocity[0].value.hypot(velocity[1].value)),
        Before::Angle { speed, .. } => speed.map(|speed| speed.value),
    };
    if let Some(speed) = speed {
        if speed < SPEEDS[0] {
            let rate = fps.filter(|fps| *fps <= Tracks::MAX_PLAYBACK).map_or(String::new(), |fps| {
                format!(
                    ". {fps} frames/s is a rate at which films are played: [video] capture_fps is to be what the camera recorded at, \
                     in slow motion 120, 240 or more"
                )
            });
            let text = format!(
                "the cue ball comes at {speed:.2} m/s: below {} m/s the model leaves too much out{rate}",
                SPEEDS[0]
            );
            found.push((Kind::Slow, text));
        } else if speed > SPEEDS[1] {
            let text = format!(
                "the cue ball comes at {speed:.1} m/s, faster than any break: the frame rate or the scale may be wrong"
            );
            found.push((Kind::Fast, text));
        }
    }
    match shot.before {
        Before::Impact { normal, .. } => {
            let after = |ball: fn(Axis) -> Observable| Some([value(ball(Axis::X))?, value(ball(Axis::Y))?]);
            let object = after(Observable::ObjectVelocity);
            if let Some([x, y]) = object.filter(|v| v[0].hypot(v[1]) > 0.0) {
                let [nx, ny] = normal.map(|n| n.value);
                let off = (nx * y - ny * x).atan2(nx * x + ny * y).to_degrees();
                if off.abs() > MOST_THROW_DEG {
                    let text = format!(
                        "the object ball leaves {off:.0}° off the line of centres: the balls or the axes may be mixed up"
                    );
                    found.push((Kind::Direction, text));
                }
            }
            if let (Some(object), Some(cue), Some(speed)) = (object, after(Observable::CueVelocity), speed) {
                let ratio =
                    (object[0].hypot(object[1]).powi(2) + cue[0].hypot(cue[1]).powi(2)) / (speed * speed);
                if ratio > MOST_RATIO {
                    let text = format!(
                        "the balls have {ratio:.2} times the cue ball's energy of motion after the impact"
                    );
                    found.push((Kind::Energy, text));
                }
            }
        }
        Before::Angle { .. } => {
            if let Some(ratio) = value(Observable::ObjectSpeedRatio).filter(|ratio| *ratio > MOST_RATIO) {
                let text = format!("the object ball leaves {ratio:.2} times as fast as the cue ball came");
                found.push((Kind::SpeedRatio, text));
            }
            if let Some(throw) = value(Observable::Throw).map(f64::to_degrees)
                && throw.abs() > MOST_THROW_DEG
            {
                found.push((Kind::Throw, format!("a throw of {throw:.1}° is more than friction gives")));
            }
        }
    }
    found
}
