//! Units of lengths, times and angles in files of tracks.

use std::mem::discriminant;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::physics::name::worded;

worded! {
    #[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
    #[serde(rename_all = "lowercase")]
    pub(super) enum Unit {
        M = "m" | "m metre metres meter meters",
        Cm = "cm" | "cm",
        Mm = "mm" | "mm",
        In = "in" | "in inch inches \"",
        Ft = "ft" | "ft foot feet",
        Px = "px" | "px pixel pixels",
    }
    pub(super) fn name;
    fn words;
}

worded! {
    #[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
    #[serde(rename_all = "lowercase")]
    pub(super) enum TimeUnit {
        Frames = "frames" | "frames frame",
        S = "s" | "s sec second seconds",
        Ms = "ms" | "ms",
        Us = "us" | "us µs μs",
    }
    pub(super) fn name;
    fn words;
}

worded! {
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(super) enum AngleUnit {
        Radians = "rad" | "rad radian radians",
        Degrees = "deg" | "deg ° degree degrees",
    }
    pub(super) fn name;
    fn words;
}

/// A unit that a file states beside the name of a column or below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Measure {
    Length(Unit),
    Time(TimeUnit),
    Angle(AngleUnit),
}

impl Measure {
    /// Returns the unit that a word means, in letters of any case.
    pub(super) fn of(word: &str) -> Option<Self> {
        let word = word.trim().to_lowercase();
        let fits = |words: &str| words.split(' ').any(|known| known == word);
        let length = || Unit::ALL.into_iter().find(|unit| fits(unit.words())).map(Self::Length);
        let time = || TimeUnit::ALL.into_iter().find(|unit| fits(unit.words())).map(Self::Time);
        let angle = || AngleUnit::ALL.into_iter().find(|unit| fits(unit.words())).map(Self::Angle);
        length().or_else(time).or_else(angle)
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Length(unit) => unit.name(),
            Self::Time(unit) => unit.name(),
            Self::Angle(unit) => unit.name(),
        }
    }

    pub(super) fn is_like(self, other: Self) -> bool {
        discriminant(&self) == discriminant(&other)
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
