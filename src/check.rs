//! What is suspicious about a data set, without fitting it. What is wrong was said when it was loaded.

use crate::collision::{Coefficients, Fidelity, Model};
use crate::dataset::{Before, Dataset, Shot, Spin};
use crate::observable::{Axis, Observable};
use crate::parameters::Parameter;
use crate::predict::Plan;

/// Fewer shots than this leave the noise to luck.
const FEW_SHOTS: usize = 5;

/// Speeds of a cue ball before the impact, m/s: below, gravity during the contact and the cloth take more than
/// the model leaves out; above, no player hits a ball (a break reaches 13).
const SPEEDS: [f64; 2] = [0.3, 14.0];

/// Radii of billiard balls, m: from miniature to Russian pyramid balls.
const RADII: [f64; 2] = [0.015, 0.037];

/// The object ball leaves along the line of centres but for the throw, which is at most 12° in any table of
/// treated balls (Alciatore 2014); more than this is another line.
const MOST_THROW_DEG: f64 = 20.0;

/// A finding: of what, and a sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    pub shot: Option<String>,
    pub text: String,
}

/// Everything suspicious, that of the whole first. Tracks must have been made into impacts before.
#[must_use]
pub fn check(dataset: &Dataset) -> Vec<Finding> {
    let mut found = Vec::new();
    let mut whole = |text: String| found.push(Finding { shot: None, text });
    let radius = dataset.ball.radius;
    let balls = dataset.tracks.as_ref().is_none_or(|tracks| tracks.discs.is_none());
    if balls && !(RADII[0]..=RADII[1]).contains(&radius) {
        whole(format!(
            "the radius is {radius} m: billiard balls have {} to {} m (pool 0.028575, carom 0.03075, snooker 0.02625)",
            RADII[0], RADII[1]
        ));
    }
    let usable = dataset.shots.len();
    if usable < FEW_SHOTS {
        whole(format!("{usable} shot(s) can be used: too few to tell how noisy they are"));
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
    for shot in &dataset.shots {
        for text in of_shot(shot) {
            found.push(Finding { shot: Some(shot.name.clone()), text });
        }
    }
    found
}

/// Parameters that no observation depends on.
fn told(dataset: &Dataset, say: &mut impl FnMut(String)) {
    let initial = Parameter::COEFFICIENTS.map(|p| dataset.settings[p].initial);
    let coefficients = Coefficients { mu: initial[0], mu_s: initial[1], e: initial[2] };
    let model = Model::new(Fidelity::Full, dataset.ball);
    let mut depends = [false; 3];
    for shot in &dataset.shots {
        let Ok(plan) = Plan::new(shot) else { continue };
        let Ok(prediction) = plan.predict(&model, &coefficients) else { continue };
        let by = prediction.by_parameters.rows(0, plan.rows().len());
        for (i, depends) in depends.iter_mut().enumerate() {
            *depends |= by.column(i).iter().any(|d| *d != 0.0);
        }
    }
    for parameter in Parameter::COEFFICIENTS {
        if depends[parameter as usize] || dataset.settings[parameter].fixed || dataset.shots.is_empty() {
            continue;
        }
        let why = match parameter {
            Parameter::Mu => {
                "every shot is without slip between the balls, or only what does not depend on it is measured"
            }
            Parameter::MuS => "no shot has topspin, so the cloth never carries the object ball",
            Parameter::E | Parameter::B | Parameter::C => "no speed after the impact is measured",
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

fn of_shot(shot: &Shot) -> Vec<String> {
    let mut found = Vec::new();
    let value = |observable| shot.after.iter().find(|m| m.observable == observable).map(|m| m.measured.value);
    let speed = match shot.before {
        Before::Impact { velocity, .. } => Some(velocity[0].value.hypot(velocity[1].value)),
        Before::Angle { speed, .. } => speed.map(|speed| speed.value),
    };
    if let Some(speed) = speed {
        if speed < SPEEDS[0] {
            found.push(format!(
                "the cue ball comes at {speed:.2} m/s: below {} m/s the model leaves too much out",
                SPEEDS[0]
            ));
        } else if speed > SPEEDS[1] {
            found.push(format!(
                "the cue ball comes at {speed:.1} m/s, faster than any break: is the frame rate or the scale wrong?"
            ));
        }
    }
    if shot.spin == Spin::Unknown {
        found.push("its spin is unknown: it cannot be fitted".into());
    }
    match shot.before {
        Before::Impact { normal, .. } => {
            let after = |ball: fn(Axis) -> Observable| Some([value(ball(Axis::X))?, value(ball(Axis::Y))?]);
            let object = after(Observable::ObjectVelocity);
            if let Some([x, y]) = object.filter(|v| v[0].hypot(v[1]) > 0.0) {
                let [nx, ny] = normal.map(|n| n.value);
                let off = (nx * y - ny * x).atan2(nx * x + ny * y).to_degrees();
                if off.abs() > MOST_THROW_DEG {
                    found.push(format!(
                        "the object ball leaves {off:.0}° off the line of centres: are the balls or the axes mixed up?"
                    ));
                }
            }
            if let (Some(object), Some(cue), Some(speed)) = (object, after(Observable::CueVelocity), speed) {
                // 2/3 of nothing: a rolling ball's spin can add at most a few per cent of its energy
                let ratio =
                    (object[0].hypot(object[1]).powi(2) + cue[0].hypot(cue[1]).powi(2)) / (speed * speed);
                if ratio > 1.05 {
                    found.push(format!(
                        "the balls have {ratio:.2} times the cue ball's energy of motion after the impact"
                    ));
                }
            }
        }
        Before::Angle { .. } => {
            if let Some(ratio) = value(Observable::ObjectSpeedRatio).filter(|ratio| *ratio > 1.05) {
                found.push(format!("the object ball leaves {ratio:.2} times as fast as the cue ball came"));
            }
            if let Some(throw) = value(Observable::Throw).map(f64::to_degrees)
                && throw.abs() > MOST_THROW_DEG
            {
                found.push(format!("a throw of {throw:.1}° is more than friction gives"));
            }
        }
    }
    found
}
