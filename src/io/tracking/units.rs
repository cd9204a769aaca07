//! Units of lengths and times in files of tracks.

use serde::Deserialize;

/// What positions are in.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(super) enum Unit {
    M,
    Cm,
    Mm,
    In,
    Ft,
    Px,
}

impl Unit {
    const ALL: [Self; 6] = [Self::M, Self::Cm, Self::Mm, Self::In, Self::Ft, Self::Px];

    /// The one that dataset.toml names so.
    pub(super) fn of(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|unit| unit.name().eq_ignore_ascii_case(word.trim()))
    }

    /// As dataset.toml names it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::M => "m",
            Self::Cm => "cm",
            Self::Mm => "mm",
            Self::In => "in",
            Self::Ft => "ft",
            Self::Px => "px",
        }
    }

    /// Metres in one of it, as two whole numbers to multiply with and divide by, so that 5.6 cm is 0.056 m; `None` for pixels.
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

/// What the time column of a file is in.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(super) enum TimeUnit {
    Frames,
    S,
    Ms,
    Us,
}

impl TimeUnit {
    /// As dataset.toml names it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Frames => "frames",
            Self::S => "s",
            Self::Ms => "ms",
            Self::Us => "us",
        }
    }

    /// Seconds in one of it; `None` for frames.
    pub(super) fn seconds(self) -> Option<f64> {
        match self {
            Self::Frames => None,
            Self::S => Some(1.0),
            Self::Ms => Some(1e-3),
            Self::Us => Some(1e-6),
        }
    }
}
