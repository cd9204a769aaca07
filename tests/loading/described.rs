//! A data set as JSON, and what of it is not as expected.

use caromfit::measurement::track::Marker;
use serde_json::Map;

use crate::prelude::*;

fn measured(measured: &Measured) -> Value {
    json!([measured.value, measured.sd])
}

/// Time, x, y, and the standard deviations of both where they are stated.
fn sample(sample: &Sample) -> Value {
    let numbers = [sample.t, sample.x, sample.y].into_iter().chain(sample.sd.into_iter().flatten());
    numbers.collect()
}

fn spin(spin: Spin) -> Value {
    match spin {
        Spin::Measured { spin, sd } => json!({ "is": [spin.x, spin.y, spin.z], "sd": sd }),
        other => json!(other.name()),
    }
}

fn row(shot: &Shot) -> Value {
    let before = match &shot.before {
        Before::Impact { normal, velocity } => json!({
            "normal": [measured(&normal[0]), measured(&normal[1])],
            "velocity": [measured(&velocity[0]), measured(&velocity[1])],
        }),
        Before::Angle { cut, speed } => {
            json!({ "cut": measured(cut), "speed": speed.as_ref().map(measured) })
        }
    };
    let after =
        shot.after.iter().map(|after| (after.observable.column().to_owned(), measured(&after.measured)));
    json!({
        "name": shot.name,
        "line": shot.line,
        "file": shot.file.file_name().map(|name| name.to_string_lossy()),
        "labels": shot.labels,
        "spin": spin(shot.spin),
        "before": before,
        "after": after.collect::<Map<_, _>>(),
    })
}

/// A marker, with the angle of each of its samples about the centre of its disc in the same frame.
fn marker(shot: &TrackShot, marker: &Marker) -> Value {
    let ball = format!("{:?}", marker.ball).to_lowercase();
    let centres = if ball == "cue" { &shot.cue } else { &shot.object };
    let angle = |sample: &Sample| {
        let centre = centres.iter().find(|centre| centre.t == sample.t)?;
        Some([sample.t, (sample.y - centre.y).atan2(sample.x - centre.x)])
    };
    json!({
        "ball": ball,
        "name": marker.name,
        "samples": marker.samples.iter().map(sample).collect::<Vec<_>>(),
        "angles": marker.samples.iter().map(angle).collect::<Vec<_>>(),
    })
}

fn film(shot: &TrackShot) -> Value {
    json!({
        "name": shot.name,
        "line": shot.line,
        "labels": shot.labels,
        "fps": shot.fps,
        "spin": spin(shot.spin),
        "position_sd": shot.position_sd,
        "cue": shot.cue.iter().map(sample).collect::<Vec<_>>(),
        "object": shot.object.iter().map(sample).collect::<Vec<_>>(),
        "markers": shot.markers.iter().map(|one| marker(shot, one)).collect::<Vec<_>>(),
    })
}

fn tracks(tracks: &Tracks, folder: &str) -> Value {
    let camera = Correction::ALL.iter().map(|which| {
        let stated = tracks.camera[*which as usize].as_ref().map_or(Value::Null, measured);
        (format!("{which:?}"), stated)
    });
    let left_out = tracks.left_out.iter().map(|(shot, reason)| json!([shot, reason.replace(folder, "")]));
    json!({
        "shots": tracks.shots.iter().map(film).collect::<Vec<_>>(),
        "left_out": left_out.collect::<Vec<_>>(),
        "camera": camera.collect::<Map<_, _>>(),
        "rate_sd": tracks.rate_sd,
        "tilt_sd": tracks.tilt_sd,
        "topspin_sd": tracks.topspin_sd,
        "from_balls": tracks.from_balls,
        "discs": tracks.discs.is_some(),
    })
}

/// A data set as JSON: its tracks, or else its rows.
pub fn described(dataset: &Dataset, folder: &str) -> Value {
    if let Some(filmed) = &dataset.tracks {
        return tracks(filmed, folder);
    }
    let setting = |parameter: &Parameter| {
        let setting = &dataset.settings[*parameter];
        let prior = setting.prior.map(|prior| [prior.mean, prior.sd]);
        let bounds = [setting.lower, setting.upper];
        let value =
            json!({ "initial": setting.initial, "bounds": bounds, "fixed": setting.fixed, "prior": prior });
        (parameter.name().to_owned(), value)
    };
    json!({
        "name": dataset.name,
        "cloth": dataset.cloth,
        "source": dataset.source,
        "by": dataset.by,
        "ball": [dataset.ball.radius, dataset.ball.mass, dataset.ball.inertia],
        "settings": Parameter::COEFFICIENTS.iter().map(setting).collect::<Map<_, _>>(),
        "shots": dataset.shots.iter().map(row).collect::<Vec<_>>(),
    })
}

/// Differences of a value from what is expected of it: of an object the keys that are named, where a number is a place in a list and
/// `count` its length; of a list all of it; "null" for null.
pub fn differences(expected: &Value, value: &Value, tolerance: f64) -> Vec<String> {
    let mut faults = Vec::new();
    compare(expected, value, tolerance, "", &mut faults);
    faults
}

fn compare(expected: &Value, value: &Value, tolerance: f64, at: &str, faults: &mut Vec<String>) {
    match (expected, value) {
        (Value::Object(keys), _) => {
            for (key, expected) in keys {
                let at = format!("{at}.{key}");
                let length = value.as_array().filter(|_| key == "count").map(|list| json!(list.len()));
                let inner = key.parse().ok().and_then(|place: usize| value.get(place)).or(value.get(key));
                match length.as_ref().or(inner) {
                    Some(inner) => compare(expected, inner, tolerance, &at, faults),
                    None => faults.push(format!("{at} is missing")),
                }
            }
        }
        (Value::Array(all), Value::Array(list)) if all.len() == list.len() => {
            for (i, (expected, value)) in all.iter().zip(list).enumerate() {
                compare(expected, value, tolerance, &format!("{at}.{i}"), faults);
            }
        }
        (Value::Number(expected), Value::Number(value)) => {
            let [expected, value] = [expected, value].map(|number| number.as_f64().unwrap());
            if !((expected - value).abs() <= tolerance * value.abs().max(1.0)) {
                faults.push(format!("{at} is {value}; expected {expected}"));
            }
        }
        (Value::String(word), Value::Null) if word == "null" => (),
        (Value::String(part), Value::String(text)) if part.starts_with('…') => {
            if !text.contains(part.trim_start_matches('…')) {
                faults.push(format!("{at} is {text:?}; expected {part:?} in it"));
            }
        }
        _ if expected == value => (),
        _ => faults.push(format!("{at} is {value}; expected {expected}")),
    }
}
