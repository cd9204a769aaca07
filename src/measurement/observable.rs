//! The observables of a collision: one list for every kind of data set.

use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::name::{UnknownName, named};

/// A value with its standard deviation, if any; as JSON an estimate with its standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Measured {
    /// The value, in the unit of the quantity.
    #[serde(rename = "estimate")]
    pub value: f64,
    /// Its standard deviation in the same unit; null if it is unknown.
    #[serde(rename = "std_error")]
    pub sd: Option<f64>,
}

impl Measured {
    /// Returns a value with its standard deviation.
    pub fn new(value: f64, sd: f64) -> Self {
        Self { value, sd: Some(sd) }
    }
}

/// An observable's measured value, in SI units and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// The observable.
    pub observable: Observable,
    /// Its value and standard deviation.
    pub measured: Measured,
}

/// A measured quantity after the impact. Inside, angles are radians, speeds m/s, spins rad/s.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Observable {
    /// Object ball's direction against the line of centres, positive the way a stun shot throws.
    Throw,
    /// Cue ball's outgoing against incoming direction, positive for the typical turn of a cut shot.
    CueTurn,
    /// Angle between the two balls' outgoing directions, 0 to π.
    Separation,
    /// Horizontal speed of the object ball.
    ObjectSpeed,
    /// Horizontal speed of the cue ball.
    CueSpeed,
    /// Object ball's horizontal speed over the cue ball's before the impact.
    ObjectSpeedRatio,
    /// Object ball's speed once it rolls on the cloth.
    ObjectSpeedRolling,
    /// Cue ball's speed once it rolls on the cloth.
    CueSpeedRolling,
    /// Cue ball's direction against its incoming one, as `CueTurn`, once it rolls on the cloth.
    CueTurnRolling,
    /// Object ball's rolling direction against the cue ball's incoming one.
    ObjectAngleRolling,
    /// e of discs, the ratio of the normal velocities after and before the impact.
    Restitution,
    /// J_t/J_n of discs on the second, t 90° counter-clockwise from the line of centres.
    ImpulseRatio,
    /// Component of the cue ball's velocity, table frame.
    CueVelocity(Axis),
    /// Component of the object ball's velocity, table frame.
    ObjectVelocity(Axis),
    /// Component of the cue ball's spin, table frame.
    CueSpin(Axis),
    /// Component of the object ball's spin, table frame.
    ObjectSpin(Axis),
}

/// A coordinate axis of the table frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Axis {
    /// The horizontal axis x.
    X,
    /// The horizontal axis y, 90° counter-clockwise from x as seen from above.
    Y,
    /// The vertical axis, upwards.
    Z,
}

impl Axis {
    /// The three axes in this order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];
}

/// Each observable with its column, label and unit: those of angles, of discs and of impacts.
const TEXTS: [(Observable, [&str; 3]); 24] = [
    (Observable::Throw, ["throw_deg", "throw", "°"]),
    (Observable::CueTurn, ["cue_turn_deg", "cue-ball turn", "°"]),
    (Observable::Separation, ["separation_deg", "separation angle", "°"]),
    (Observable::ObjectSpeed, ["object_speed_m_s", "object-ball speed", "m/s"]),
    (Observable::CueSpeed, ["cue_speed_m_s", "cue-ball speed", "m/s"]),
    (Observable::ObjectSpeedRatio, ["object_speed_ratio", "object-ball speed ratio", ""]),
    (Observable::ObjectSpeedRolling, ["object_speed_rolling_m_s", "object-ball speed, rolling", "m/s"]),
    (Observable::CueSpeedRolling, ["cue_speed_rolling_m_s", "cue-ball speed, rolling", "m/s"]),
    (Observable::CueTurnRolling, ["cue_turn_rolling_deg", "cue-ball turn, rolling", "°"]),
    (Observable::ObjectAngleRolling, ["object_angle_rolling_deg", "object-ball angle, rolling", "°"]),
    (Observable::Restitution, ["e", "e", ""]),
    (Observable::ImpulseRatio, ["impulse_ratio", "J_t/J_n", ""]),
    (Observable::CueVelocity(Axis::X), ["cue_vx_after", "cue-ball vx", "m/s"]),
    (Observable::CueVelocity(Axis::Y), ["cue_vy_after", "cue-ball vy", "m/s"]),
    (Observable::CueVelocity(Axis::Z), ["cue_vz_after", "cue-ball vz", "m/s"]),
    (Observable::ObjectVelocity(Axis::X), ["obj_vx_after", "object-ball vx", "m/s"]),
    (Observable::ObjectVelocity(Axis::Y), ["obj_vy_after", "object-ball vy", "m/s"]),
    (Observable::ObjectVelocity(Axis::Z), ["obj_vz_after", "object-ball vz", "m/s"]),
    (Observable::CueSpin(Axis::X), ["cue_wx_after", "cue-ball ωx", "rad/s"]),
    (Observable::CueSpin(Axis::Y), ["cue_wy_after", "cue-ball ωy", "rad/s"]),
    (Observable::CueSpin(Axis::Z), ["cue_wz_after", "cue-ball ωz", "rad/s"]),
    (Observable::ObjectSpin(Axis::X), ["obj_wx_after", "object-ball ωx", "rad/s"]),
    (Observable::ObjectSpin(Axis::Y), ["obj_wy_after", "object-ball ωy", "rad/s"]),
    (Observable::ObjectSpin(Axis::Z), ["obj_wz_after", "object-ball ωz", "rad/s"]),
];

/// Returns N observables of the table, from the one at `first`.
const fn listed<const N: usize>(first: usize) -> [Observable; N] {
    let mut all = [Observable::Throw; N];
    let mut i = 0;
    while i < N {
        all[i] = TEXTS[first + i].0;
        i += 1;
    }
    all
}

impl Observable {
    /// The observables of a data set of kind `angles`.
    pub const ANGLES: [Self; 10] = listed(0);

    /// The observables of discs.
    pub const DISCS: [Self; 2] = listed(10);

    /// The observables of a data set of kind `impacts`.
    pub const IMPACTS: [Self; 12] = listed(12);

    /// Returns its column, label and unit.
    fn texts(self) -> [&'static str; 3] {
        TEXTS.iter().find(|(one, _)| *one == self).map_or([""; 3], |(_, texts)| *texts)
    }

    /// Returns the column that holds it in a data file, which ends in the unit if that is not SI.
    pub fn column(self) -> &'static str {
        self.texts()[0]
    }

    /// Returns the name in plots and tables.
    pub fn label(self) -> &'static str {
        self.texts()[1]
    }

    /// Returns the unit of its column: `°`, `m/s`, `rad/s`, or empty for a ratio.
    pub fn unit(self) -> &'static str {
        self.texts()[2]
    }

    /// Returns whether it is an angle: radians inside, degrees in files, tables and plots.
    pub(crate) fn is_angle(self) -> bool {
        self.unit() == "°"
    }

    /// Returns one unit of the column in SI: π/180 for angles, else 1.
    pub(crate) fn unit_si(self) -> f64 {
        if self.is_angle() { 1.0_f64.to_radians() } else { 1.0 }
    }
}

/// Finds an observable by its column.
impl FromStr for Observable {
    type Err = UnknownName;

    fn from_str(column: &str) -> Result<Self, UnknownName> {
        let all: [Self; TEXTS.len()] = listed(0);
        named("observable", &all, |observable| [observable.column()], column)
    }
}
