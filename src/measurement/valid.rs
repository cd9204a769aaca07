//! What every data set must fulfil that is fitted or compared, whoever made it. Reading a file applies the same rules, and
//! says where in the file they are broken.

use std::collections::BTreeMap;
use std::path::Path;

use super::dataset::{Before, Dataset, Measured, Shot};
use super::parameter::Parameter;
use super::spin::Spin;
use super::track::{Sample, TrackShot};

/// A line of centres is taken for a unit vector, and made one, if its length is within this of 1.
const UNIT: f64 = 1e-3;

/// Whether a number can be a standard deviation.
pub(crate) fn is_standard_deviation(sd: f64) -> bool {
    sd > 0.0 && sd.is_finite()
}

/// Whether a vector is meant to have the length 1.
pub(crate) fn is_unit(x: f64, y: f64) -> bool {
    (x.hypot(y) - 1.0).abs() <= UNIT
}

impl Dataset {
    /// What keeps it from being fitted, each with the parameter or the shot, the value and what was expected. Empty for
    /// every data set that was read from files.
    #[must_use]
    pub fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        let balls = [("ball", Some(self.ball)), ("object ball", self.object.map(|object| object.ball))];
        for (which, ball) in balls.into_iter().filter_map(|(which, ball)| Some((which, ball?))) {
            for (name, value) in [("radius", ball.radius), ("mass", ball.mass), ("inertia", ball.inertia)] {
                if !is_standard_deviation(value) {
                    faults.push(format!(
                        "the {name} of the {which} is {value:?}; expected a finite number above 0"
                    ));
                }
            }
        }
        let errors = self
            .object
            .map(|object| [("mass", object.mass_sd.unwrap_or_default()), ("radius", object.radius_sd)]);
        for (what, sd) in errors.into_iter().flatten().flat_map(|(what, both)| both.map(|sd| (what, sd))) {
            if sd != 0.0 && !is_standard_deviation(sd) {
                faults.push(format!(
                    "the {what} of a ball has the standard deviation {sd:?}; expected 0 (exact) or more"
                ));
            }
        }
        for parameter in Parameter::ALL {
            let of_setting = self.settings[parameter].faults(parameter).into_iter();
            faults.extend(
                of_setting.map(|f| format!("{}.{} is {:?}{}", parameter.name(), f.key, f.value, f.rest)),
            );
        }
        if let Some(by) = &self.by
            && !self.shots.is_empty()
            && self.shots.iter().all(|shot| !shot.labels.contains_key(by))
        {
            faults.push(format!(
                "by is \"{by}\", but no shot has such a label; expected the name of a label column"
            ));
        }
        let shared = [("sliding friction μ_k", self.sliding), ("rolling resistance μ_r", self.rolling)];
        for (name, measured) in shared.into_iter().filter_map(|(name, measured)| Some((name, measured?))) {
            faults.extend(fault(measured).map(|wrong| format!("the cloth's {name}{wrong}")));
        }
        faults.extend(self.shots.iter().flat_map(faults_of));
        faults.extend(self.tracks.iter().flat_map(|tracks| &tracks.shots).flat_map(faults_of_film));
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        // footage has its names twice once its impacts have been extracted
        let filmed = self.tracks.iter().flat_map(|tracks| &tracks.shots).map(|shot| &shot.name);
        let measured = self.shots.iter().map(|shot| &shot.name);
        for name in filmed.filter(|_| self.shots.is_empty()).chain(measured) {
            *counts.entry(name).or_default() += 1;
        }
        let twice = counts.into_iter().filter(|(_, count)| *count > 1);
        faults.extend(
            twice.map(|(name, count)| {
                format!("{count} shots are named \"{name}\"; expected names that differ")
            }),
        );
        faults
    }
}

/// What is wrong with a measured value, to be put behind its name.
fn fault(Measured { value, sd }: Measured) -> Option<String> {
    if !value.is_finite() {
        return Some(format!(" is {value}; expected a finite number"));
    }
    let sd = sd.filter(|sd| !is_standard_deviation(*sd))?;
    Some(format!(" has the standard deviation {sd:?}; expected more than 0"))
}

/// Of a shot that was filmed: its numbers are finite and in range, and its times rise.
fn faults_of_film(shot: &TrackShot) -> Vec<String> {
    let mut faults = Vec::new();
    if !is_standard_deviation(shot.fps) {
        faults.push(format!("fps is {:?}; expected a finite number above 0", shot.fps));
    }
    if !(0.0..1.0).contains(&shot.correlation) {
        faults.push(format!("correlation is {:?}; expected 0 to below 1", shot.correlation));
    }
    for (name, value) in ["cue", "object"].into_iter().zip(shot.resolution) {
        if !(value >= 0.0 && value.is_finite()) {
            faults.push(format!("resolution of {name} is {value:?}; expected 0 or more"));
        }
    }
    if let Some(sd) = shot.position_sd.filter(|sd| !is_standard_deviation(*sd)) {
        faults.push(format!("position_sd is {sd:?}; expected more than 0"));
    }
    let markers = shot.markers.iter().map(|marker| (marker.name.as_str(), &marker.samples));
    for (name, samples) in [("cue", &shot.cue), ("object", &shot.object)].into_iter().chain(markers) {
        let wrong = |sample: &&Sample| {
            let sds = sample.sd.iter().flatten().all(|sd| is_standard_deviation(*sd));
            !(sds && [sample.t, sample.x, sample.y].iter().all(|value| value.is_finite()))
        };
        if let Some(Sample { t, x, y, sd }) = samples.iter().find(wrong) {
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

/// Faults behind the name of their shot, and the place where it was read.
fn named(shot: &str, (file, line): (&Path, usize), faults: Vec<String>) -> Vec<String> {
    let place = if line > 0 { format!(" ({}:{line})", file.display()) } else { String::new() };
    faults.into_iter().map(|fault| format!("shot {shot}{place}: {fault}")).collect()
}

fn faults_of(shot: &Shot) -> Vec<String> {
    let mut values: Vec<(&str, Measured)> = Vec::new();
    let mut faults = Vec::new();
    match shot.before {
        Before::Impact { normal: [x, y], velocity: [vx, vy] } => {
            values.extend([("nx", x), ("ny", y), ("cue_vx", vx), ("cue_vy", vy)]);
            if !is_unit(x.value, y.value) && x.value.is_finite() && y.value.is_finite() {
                let length = x.value.hypot(y.value);
                faults.push(format!(
                    "the line of centres (nx, ny) = ({}, {}) has the length {length:?}; expected a unit vector",
                    x.value, y.value
                ));
            }
        }
        Before::Angle { cut, speed } => {
            values.push(("cut_deg", cut));
            values.extend(speed.map(|speed| ("speed_m_s", speed)));
        }
    }
    if let Spin::Measured { spin, sd } = shot.spin {
        let components = ["spin x", "spin y", "spin z"].into_iter().zip(spin.iter().zip(sd));
        // an extraction knows that a ball struck without side has none: exactly
        let known = |sd: Option<f64>| sd.filter(|sd| shot.joint.is_none() || *sd != 0.0);
        values
            .extend(components.map(|(name, (value, sd))| (name, Measured { value: *value, sd: known(sd) })));
    }
    values.extend(shot.after.iter().map(|row| (row.observable.column(), row.measured)));
    faults.extend(
        values.into_iter().filter_map(|(name, measured)| Some(format!("{name}{}", fault(measured)?))),
    );
    if shot.after.is_empty() {
        faults.push("nothing is observed; expected at least one observation".to_owned());
    }
    if let Some(joint) = &shot.joint {
        let size = super::dataset::Joint::BEFORE + shot.after.len();
        if joint.covariance.shape() != (size, size) || joint.by_shared.iter().any(|by| by.len() != size) {
            faults
                .push(format!("its joint errors do not have {size} rows and columns, one for each quantity"));
        } else if !joint.covariance.iter().all(|c| c.is_finite()) {
            faults.push("its joint errors are not finite".to_owned());
        }
    }
    named(&shot.name, (&shot.file, shot.line), faults)
}
