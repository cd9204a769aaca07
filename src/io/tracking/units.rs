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

/// Notation of a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Style {
    /// h:mm:ss.fff, with the number of digits after the mark.
    Fraction(usize),
    /// h:mm:ss:cs, with the number of digits after the last colon.
    Colon(usize),
}

impl Style {
    pub(super) fn resolution(self) -> f64 {
        let (Self::Fraction(digits) | Self::Colon(digits)) = self;
        1.0 / 10.0_f64.powi(digits as i32)
    }
}

pub(super) fn is_clock(cell: &str) -> bool {
    cell.contains(':')
}

/// Returns the seconds since midnight (or since the clock began), and their notation.
pub(super) fn seconds(cell: &str) -> Option<(f64, Style)> {
    let (time, is_dated) = without_date(cell.trim());
    let has_colon = !is_dated && !time.contains(['.', ',']);
    let (clock, part) = if has_colon {
        time.rsplit_once(':').filter(|(_, part)| (2..=3).contains(&part.len()))?
    } else {
        time.rsplit_once(['.', ',']).unwrap_or((time, ""))
    };
    let number = |text: &str| text.parse::<u32>().ok().filter(|_| !text.starts_with('+')).map(f64::from);
    let parts: Vec<f64> = clock.split(':').map(number).collect::<Option<_>>()?;
    if !(2..=3).contains(&parts.len()) || parts[1..].iter().any(|part| *part >= 60.0) {
        return None;
    }
    let style = if has_colon { Style::Colon(part.len()) } else { Style::Fraction(part.len()) };
    let whole = parts.iter().fold(0.0, |sum, part| 60.0 * sum + part);
    let fraction = if part.is_empty() { 0.0 } else { number(part)? };
    Some((whole + fraction / 10.0_f64.powi(part.len() as i32), style))
}

/// Returns `2024-05-01T12:00:00Z` without the date and the zone, and whether there was a date.
fn without_date(cell: &str) -> (&str, bool) {
    let is_date = |date: &str| date.len() == 10 && date.bytes().filter(u8::is_ascii_digit).count() == 8;
    match cell.split_once(['T', ' ']) {
        Some((date, time)) if is_date(date) => {
            (time.split(['Z', '+', '-']).next().unwrap_or(time).trim(), true)
        }
        _ => (cell, false),
    }
}
