//! Rules for every data set that is fitted or compared; readers of files state line and column too.

use std::path::Path;

use super::dataset::{Before, Dataset, Measured, ObjectBall, Shot};
use super::fault::{Condition, FINITE, Fault, NOT_NEGATIVE, POSITIVE};
use super::parameter::Parameter;
use super::spin::Spin;
use super::track::{Sample, TrackShot};
use crate::physics::ball::Ball;

/// Returns whether a vector is meant to have the length 1, and is made one: within 0.1 %.
pub(crate) fn is_unit(x: f64, y: f64) -> bool {
    (x.hypot(y) - 1.0).abs() <= 1e-3
}

impl Dataset {
    /// Returns what keeps it from being fitted, each with the parameter or the shot, the value and
    /// what was expected.
    pub fn faults(&self) -> Vec<String> {
        let mut numbers = Vec::new();
        let object = self.object.map(|object| ("object", object.ball));
        for (which, Ball { radius, mass, inertia }) in [("ball", self.ball)].into_iter().chain(object) {
            for (name, value) in [("radius", radius), ("mass", mass), ("inertia", inertia)] {
                numbers.extend(Fault::of_number(&format!("{which}.{name}"), value, POSITIVE));
            }
        }
        if let Some(ObjectBall { mass_sd, radius_sd, .. }) = self.object {
            let masses = mass_sd.unwrap_or_default().map(|sd| ("mass_sd", sd));
            for (name, sd) in masses.into_iter().chain(radius_sd.map(|sd| ("radius_sd", sd))) {
                numbers.extend(Fault::of_number(name, sd, NOT_NEGATIVE));
            }
        }
        numbers.extend(Parameter::ALL.iter().flat_map(|own| self.settings[*own].faults(*own)));
        let mut faults: Vec<String> = numbers.iter().map(Fault::to_string).collect();
        if let Some(by) = &self.by
            && !self.shots.is_empty()
            && self.shots.iter().all(|shot| !shot.labels.contains_key(by))
        {
            faults.push(format!(
                "by is \"{by}\", but no shot has such a label; expected the name of a label column"
            ));
        }
        faults.extend(self.shots.iter().flat_map(faults_of_shot));
        faults.extend(self.tracks.iter().flat_map(|tracks| &tracks.shots).flat_map(faults_of_film));
        // footage has its names twice once its impacts have been extracted
        let names = self.names();
        let once = if self.shots.is_empty() { names.len() } else { self.shots.len() };
        let mut names = names[names.len() - once..].to_vec();
        names.sort_unstable();
        for same in names.chunk_by(|a, b| a == b).filter(|same| same.len() > 1) {
            let (count, name) = (same.len(), same[0]);
            faults.push(format!("{count} shots are named \"{name}\"; expected names that differ"));
        }
        faults
    }
}

/// Returns what is wrong with a filmed shot.
fn faults_of_film(shot: &TrackShot) -> Vec<String> {
    const CORRELATION: Condition = (|x| (0.0..1.0).contains(&x), "0 to below 1");
    let numbers = [
        Fault::of_number("fps", shot.fps, POSITIVE),
        Fault::of_number("correlation", shot.correlation, CORRELATION),
        Fault::of_number("resolution of cue", shot.resolution[0], NOT_NEGATIVE),
        Fault::of_number("resolution of object", shot.resolution[1], NOT_NEGATIVE),
        Fault::of_number("position_sd", shot.position_sd.unwrap_or(1.0), POSITIVE),
    ];
    let mut faults: Vec<String> = numbers.iter().flatten().map(Fault::to_string).collect();
    let markers = shot.markers.iter().map(|marker| (marker.name.as_str(), &marker.samples));
    for (name, samples) in [("cue", &shot.cue), ("object", &shot.object)].into_iter().chain(markers) {
        let is_wrong = |sample: &&Sample| {
            let is_sd = |sd: &f64| *sd > 0.0 && sd.is_finite();
            let is_finite = [sample.t, sample.x, sample.y].iter().all(|value| value.is_finite());
            !(is_finite && sample.sd.iter().flatten().all(is_sd))
        };
        if let Some(Sample { t, x, y, sd }) = samples.iter().find(is_wrong) {
            faults.push(format!(
                "{name} has the position t = {t:?}, x = {x:?}, y = {y:?} with the standard deviations {sd:?}; expected finite \
                 numbers, and standard deviations above 0"
            ));
        } else if let Some([first, second]) = samples.array_windows().find(|[a, b]| b.t <= a.t) {
            let (first, second) = (first.t, second.t);
            faults.push(format!("{name} is at t = {second:?} after t = {first:?}; expected times that rise"));
        }
    }
    with_place(&shot.name, &shot.file, shot.line, faults)
}

/// Returns faults behind the name of their shot, and the file and line that it was read from.
fn with_place(shot: &str, file: &Path, line: usize, faults: Vec<String>) -> Vec<String> {
    let place = if line > 0 { format!(" ({}:{line})", file.display()) } else { String::new() };
    faults.into_iter().map(|fault| format!("shot {shot}{place}: {fault}")).collect()
}

/// Returns what is wrong with a measured shot.
fn faults_of_shot(shot: &Shot) -> Vec<String> {
    let mut faults = Vec::new();
    let mut check = |name: &str, measured: Measured| {
        faults.extend(Fault::of_number(name, measured.value, FINITE));
        faults.extend(measured.sd.and_then(|sd| Fault::of_number(&format!("{name}_sd"), sd, POSITIVE)));
    };
    match shot.before {
        Before::Impact { normal: [x, y], velocity: [vx, vy] } => {
            for (name, measured) in [("nx", x), ("ny", y), ("cue_vx", vx), ("cue_vy", vy)] {
                check(name, measured);
            }
        }
        Before::Angle { cut, speed } => {
            check("cut_deg", cut);
            if let Some(speed) = speed {
                check("speed_m_s", speed);
            }
        }
    }
    if let Spin::Measured { spin, sd } = shot.spin {
        for (i, name) in ["spin x", "spin y", "spin z"].into_iter().enumerate() {
            check(name, Measured { value: spin[i], sd: sd[i] });
        }
    }
    shot.after.iter().for_each(|row| check(row.observable.column(), row.measured));
    if let Before::Impact { normal, .. } = shot.before {
        let [x, y] = normal.map(|component| component.value);
        let length = x.hypot(y);
        if length.is_finite() && !is_unit(x, y) {
            let value = format!("({x}, {y}), of length {length:?}");
            faults.push(Fault::new("the line of centres (nx, ny)", value, "a unit vector"));
        }
    }
    let mut faults: Vec<String> = faults.iter().map(Fault::to_string).collect();
    if shot.after.is_empty() {
        faults.push("no observation; expected at least one observation".to_owned());
    }
    with_place(&shot.name, &shot.file, shot.line, faults)
}
