//! Units of lengths, times and angles in files of tracks.

use std::mem::discriminant;

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
    pub(super) enum TimeUnit {
        Frames = "frames",
        S = "s",
        Ms = "ms",
        Us = "us",
    }
    pub(super) fn name;
}

/// A unit that a file states beside the name of a column or below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Measure {
    Length(Unit),
    Time(TimeUnit),
    Radians,
    Degrees,
}

/// Words for units, in small letters.
const WORDS: [(&str, Measure); 12] = [
    ("m metre metres meter meters", Measure::Length(Unit::M)),
    ("cm", Measure::Length(Unit::Cm)),
    ("mm", Measure::Length(Unit::Mm)),
    ("in inch inches \"", Measure::Length(Unit::In)),
    ("ft foot feet", Measure::Length(Unit::Ft)),
    ("px pixel pixels", Measure::Length(Unit::Px)),
    ("s sec second seconds", Measure::Time(TimeUnit::S)),
    ("ms", Measure::Time(TimeUnit::Ms)),
    ("us µs μs", Measure::Time(TimeUnit::Us)),
    ("frames frame", Measure::Time(TimeUnit::Frames)),
    ("rad radian radians", Measure::Radians),
    ("deg ° degree degrees", Measure::Degrees),
];

impl Measure {
    pub(super) fn of(word: &str) -> Option<Self> {
        let word = word.trim().to_lowercase();
        let is_known = |words: &str| words.split(' ').any(|known| known == word);
        WORDS.iter().find(|(words, _)| is_known(words)).map(|(_, unit)| *unit)
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Length(unit) => unit.name(),
            Self::Time(unit) => unit.name(),
            Self::Radians => "rad",
            Self::Degrees => "deg",
        }
    }

    pub(super) fn is_angle(self) -> bool {
        matches!(self, Self::Radians | Self::Degrees)
    }

    pub(super) fn is_like(self, other: Self) -> bool {
        discriminant(&self) == discriminant(&other) || self.is_angle() && other.is_angle()
    }
}

impl Unit {
    pub(super) fn of(word: &str) -> Option<Self> {
        if let Measure::Length(unit) = Measure::of(word)? { Some(unit) } else { None }
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
    pub(super) fn seconds(self) -> Option<f64> {
        match self {
            Self::Frames => None,
            Self::S => Some(1.0),
            Self::Ms => Some(1e-3),
            Self::Us => Some(1e-6),
        }
    }
}
