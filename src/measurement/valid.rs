//! Rules for every data set that is fitted or compared. Reading a file applies the same rules, and
//! states line and column of each fault.

use std::collections::BTreeMap;
use std::path::Path;

use super::dataset::{Before, Dataset, Measured, ObjectBall, Shot};
use super::fault::FINITE;
pub use super::fault::{Condition, FRACTION, Fault, Faults, INERTIA, NOT_NEGATIVE, POSITIVE};
use super::parameter::Parameter;
use super::spin::Spin;
use super::track::{Sample, TrackShot};
use crate::physics::ball::Ball;

/// A line of centres is taken for a unit vector, and made one, if its length is within this of 1.
const UNIT: f64 = 1e-3;

/// Returns whether a vector is meant to have the length 1.
pub(crate) fn is_unit(x: f64, y: f64) -> bool {
    (x.hypot(y) - 1.0).abs() <= UNIT
}

impl Dataset {
    /// Returns what keeps it from being fitted, each with the parameter or the shot, the value and
    /// what was expected. Empty for every data set that was read from files.
    #[must_use]
    pub fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        let mut check = |key: &str, value: f64, condition: Condition| {
            faults.extend(Fault::of_number(key, value, condition).map(|fault| fault.to_string()));
        };
        let object = self.object.map(|object| ("object", object.ball));
        for (which, Ball { radius, mass, inertia }) in [("ball", self.ball)].into_iter().chain(object) {
            for (name, value) in [("radius", radius), ("mass", mass), ("inertia", inertia)] {
                check(&format!("{which}.{name}"), value, POSITIVE);
            }
        }
        if let Some(ObjectBall { mass_sd, radius_sd, .. }) = self.object {
            for i in 0..2 {
                check("mass_sd", mass_sd.unwrap_or_default()[i], NOT_NEGATIVE);
                check("radius_sd", radius_sd[i], NOT_NEGATIVE);
            }
        }
        for parameter in Parameter::ALL {
            faults.extend(self.settings[parameter].faults(parameter).iter().map(Fault::to_string));
        }
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
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        for name in names.iter().rev().take(once) {
            *counts.entry(name).or_default() += 1;
        }
        for (name, count) in counts.into_iter().filter(|(_, count)| *count > 1) {
            faults.push(format!("{count} shots are named \"{name}\"; expected names that differ"));
        }
        faults
    }
}

/// Returns what is wrong with a measured value and its standard deviation.
fn faults_of(name: &str, measured: &Measured) -> Vec<String> {
    let value = Fault::of_number(name, measured.value, FINITE);
    let sd = measured.sd.and_then(|sd| Fault::of_number(&format!("{name}_sd"), sd, POSITIVE));
    value.into_iter().chain(sd).map(|fault| fault.to_string()).collect()
}

/// Returns what is wrong with a filmed shot: numbers that are not finite or out of range, and times
/// that do not rise.
fn faults_of_film(shot: &TrackShot) -> Vec<String> {
    const CORRELATION: Condition = (|x| (0.0..1.0).contains(&x), "0 to below 1");
    let numbers = [
        ("fps", shot.fps, POSITIVE),
        ("correlation", shot.correlation, CORRELATION),
        ("resolution of cue", shot.resolution[0], NOT_NEGATIVE),
        ("resolution of object", shot.resolution[1], NOT_NEGATIVE),
        ("position_sd", shot.position_sd.unwrap_or(1.0), POSITIVE),
    ];
    let numbers =
        numbers.into_iter().filter_map(|(key, value, condition)| Fault::of_number(key, value, condition));
    let mut faults: Vec<String> = numbers.map(|fault| fault.to_string()).collect();
    let markers = shot.markers.iter().map(|marker| (marker.name.as_str(), &marker.samples));
    for (name, samples) in [("cue", &shot.cue), ("object", &shot.object)].into_iter().chain(markers) {
        let is_wrong = |sample: &&Sample| {
            let sds = sample.sd.iter().flatten().all(|sd| *sd > 0.0 && sd.is_finite());
            !(sds && [sample.t, sample.x, sample.y].iter().all(|value| value.is_finite()))
        };
        if let Some(Sample { t, x, y, sd }) = samples.iter().find(is_wrong) {
            faults.push(format!(
                "{name} has the position t = {t:?}, x = {x:?}, y = {y:?} with the standard deviations {sd:?}; expected finite \
                 numbers, and standard deviations above 0"
            ));
        } else if let Some(pair) = samples.windows(2).find(|pair| pair[1].t <= pair[0].t) {
            faults.push(format!(
                "{name} is at t = {:?} after t = {:?}; expected times that rise",
                pair[1].t, pair[0].t
            ));
        }
    }
    named(&shot.name, (&shot.file, shot.line), faults)
}

/// Returns faults behind the name of their shot, and the place where it was read.
fn named(shot: &str, (file, line): (&Path, usize), faults: Vec<String>) -> Vec<String> {
    let place = if line > 0 { format!(" ({}:{line})", file.display()) } else { String::new() };
    faults.into_iter().map(|fault| format!("shot {shot}{place}: {fault}")).collect()
}

/// Returns what is wrong with a measured shot.
fn faults_of_shot(shot: &Shot) -> Vec<String> {
    let mut values: Vec<(&str, Measured)> = Vec::new();
    let mut faults = Vec::new();
    match shot.before {
        Before::Impact { normal: [x, y], velocity: [vx, vy] } => {
            values.extend([("nx", x), ("ny", y), ("cue_vx", vx), ("cue_vy", vy)]);
            let length = x.value.hypot(y.value);
            if length.is_finite() && !is_unit(x.value, y.value) {
                let value = format!("({}, {}), of length {length:?}", x.value, y.value);
                let line = "the line of centres (nx, ny)";
                faults.push(Fault::new(line, value, "a unit vector").to_string());
            }
        }
        Before::Angle { cut, speed } => {
            values.push(("cut_deg", cut));
            values.extend(speed.map(|speed| ("speed_m_s", speed)));
        }
    }
    if let Spin::Measured { spin, sd } = shot.spin {
        let components = ["spin x", "spin y", "spin z"].into_iter().zip(spin.iter().zip(sd));
        values.extend(components.map(|(name, (value, sd))| (name, Measured { value: *value, sd })));
    }
    values.extend(shot.after.iter().map(|row| (row.observable.column(), row.measured)));
    faults.extend(values.iter().flat_map(|(name, measured)| faults_of(name, measured)));
    if shot.after.is_empty() {
        faults.push("nothing is observed; expected at least one observation".to_owned());
    }
    named(&shot.name, (&shot.file, shot.line), faults)
}
