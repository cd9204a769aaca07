//! Units of lengths, times and angles in files of tracks.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::physics::name::worded;

worded! {
    /// A unit that dataset.toml states, or a file beside the name of a column or below it.
    #[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
    #[serde(rename_all = "lowercase")]
    pub(super) enum Unit {
        M = "m" | "m metre metres meter meters",
        Cm = "cm" | "cm",
        Mm = "mm" | "mm",
        In = "in" | "in inch inches \"",
        Ft = "ft" | "ft foot feet",
        Px = "px" | "px pixel pixels",
        Frames = "frames" | "frames frame",
        S = "s" | "s sec second seconds",
        Ms = "ms" | "ms",
        Us = "us" | "us µs μs",
        Rad = "rad" | "rad radian radians",
        Deg = "deg" | "deg ° degree degrees",
    }
    pub(super) fn name;
    fn words;
}

impl Unit {
    /// Returns the unit that a word means, in letters of any case.
    pub(super) fn of(word: &str) -> Option<Self> {
        let word = word.trim().to_lowercase();
        Self::ALL.into_iter().find(|unit| unit.words().split(' ').any(|known| known == word))
    }

    /// Returns the SI unit of its quantity.
    pub(super) fn si(self) -> Self {
        match self {
            Self::Frames | Self::S | Self::Ms | Self::Us => Self::S,
            Self::Rad | Self::Deg => Self::Rad,
            _ => Self::M,
        }
    }

    /// Returns the units of the same quantity.
    pub(super) fn alike(self) -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(move |unit| unit.si() == self.si())
    }

    pub(super) fn names_alike(self) -> Vec<&'static str> {
        self.alike().map(Self::name).collect()
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
            _ => None,
        }
    }

    /// Returns seconds per unit; `None` for frames.
    pub(super) fn seconds(self) -> Option<f64> {
        match self {
            Self::S => Some(1.0),
            Self::Ms => Some(1e-3),
            Self::Us => Some(1e-6),
            _ => None,
        }
    }
}
