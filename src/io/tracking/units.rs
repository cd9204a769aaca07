//! Units of lengths, times and angles in files of tracks.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::physics::name::worded;

worded! {
    #[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
    #[serde(rename_all = "lowercase")]
    pub(super) enum Unit {
        M = "m",
        Cm = "cm",
        Mm = "mm",
        In = "in",
        Ft = "ft",
        Px = "px",
    }
    pub(super) fn name;
}

worded! {
    #[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
    #[serde(rename_all = "lowercase")]
    pub(in crate::io) enum TimeUnit {
        Frames = "frames",
        S = "s",
        Ms = "ms",
        Us = "us",
    }
    pub(in crate::io) fn name;
}

worded! {
    #[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
    #[serde(rename_all = "lowercase")]
    pub(in crate::io) enum AngleUnit {
        Rad = "rad",
        Deg = "deg",
    }
    pub(in crate::io) fn name;
}

impl Unit {
    /// Returns the unit of this name in dataset.toml.
    pub(super) fn of(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|unit| unit.name().eq_ignore_ascii_case(word.trim()))
    }

    /// Returns metres per unit as whole factor and divisor (5.6 cm is 0.056 m); `None` for pixels.
    pub(super) fn metres(self) -> Option<(f64, f64)> {
        match self {
            Self::M => Some((1.0, 1.0)),
            Self::Cm => Some((1.0, 100.0)),
            Self::Mm => Some((1.0, 1000.0)),
            // 25.4 mm and 304.8 mm
            Self::In => Some((127.0, 5000.0)),
            Self::Ft => Some((381.0, 1250.0)),
            Self::Px => None,
        }
    }
}

impl TimeUnit {
    /// Returns seconds per unit; `None` for frames.
    pub(super) fn seconds(self) -> Option<f64> {
        match self {
            Self::Frames => None,
            Self::S => Some(1.0),
            Self::Ms => Some(1e-3),
            Self::Us => Some(1e-6),
        }
    }
}

impl AngleUnit {
    pub(super) fn radians(self) -> f64 {
        if self == Self::Rad { 1.0 } else { 1.0_f64.to_radians() }
    }
}
