//! What every data set must fulfil that is fitted or compared, whoever made it. Reading a file applies the same rules, and
//! says where in the file they are broken.

use super::dataset::{Before, Dataset, Measured, Shot};
use super::parameter::Parameter;
use super::spin::Spin;

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
        let ratios = self.object.map(|object| [object.mass_ratio_sd, object.radius_ratio_sd]);
        for sd in ratios.into_iter().flatten().flatten().filter(|sd| !is_standard_deviation(*sd)) {
            faults.push(format!(
                "a ratio of the balls has the standard deviation {sd:?}; expected more than 0"
            ));
        }
        for parameter in Parameter::ALL {
            let of_setting = self.settings[parameter].faults(parameter).into_iter();
            faults.extend(
                of_setting.map(|f| format!("{}.{} is {:?}{}", parameter.name(), f.key, f.value, f.rest)),
            );
        }
        for relation in &self.relations {
            let finite = relation.coefficients.iter().chain([&relation.limit]).all(|c| c.is_finite());
            if !finite || relation.coefficients.iter().all(|c| *c == 0.0) {
                let text = &relation.text;
                faults.push(format!(
                    "the constraint \"{text}\" has no finite coefficient; expected some other than 0"
                ));
            }
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

fn faults_of(shot: &Shot) -> Vec<String> {
    let mut named: Vec<(&str, Measured)> = Vec::new();
    let mut faults = Vec::new();
    match shot.before {
        Before::Impact { normal: [x, y], velocity: [vx, vy] } => {
            named.extend([("nx", x), ("ny", y), ("cue_vx", vx), ("cue_vy", vy)]);
            if !is_unit(x.value, y.value) && x.value.is_finite() && y.value.is_finite() {
                let length = x.value.hypot(y.value);
                faults.push(format!(
                    "the line of centres (nx, ny) = ({}, {}) has the length {length:?}; expected a unit vector",
                    x.value, y.value
                ));
            }
        }
        Before::Angle { cut, speed } => {
            named.push(("cut_deg", cut));
            named.extend(speed.map(|speed| ("speed_m_s", speed)));
        }
    }
    if let Spin::Measured { spin, sd } = shot.spin {
        let components = ["spin x", "spin y", "spin z"].into_iter().zip(spin.iter().zip(sd));
        // an extraction knows that a ball struck without side has none: exactly
        let known = |sd: Option<f64>| sd.filter(|sd| shot.joint.is_none() || *sd != 0.0);
        named.extend(components.map(|(name, (value, sd))| (name, Measured { value: *value, sd: known(sd) })));
    }
    named.extend(shot.after.iter().map(|row| (row.observable.column(), row.measured)));
    faults
        .extend(named.into_iter().filter_map(|(name, measured)| Some(format!("{name}{}", fault(measured)?))));
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
    let place =
        if shot.line > 0 { format!(" ({}:{})", shot.file.display(), shot.line) } else { String::new() };
    faults.into_iter().map(|fault| format!("shot {}{place}: {fault}", shot.name)).collect()
}
