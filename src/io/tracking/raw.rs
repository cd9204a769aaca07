//! Positions as all formats are read: in the file's units, with their lines.

use std::path::PathBuf;
use std::sync::Arc;

use super::units::{TimeUnit, Unit};

#[derive(Clone, Debug, PartialEq)]
pub(super) struct RawShot {
    pub(crate) name: String,
    pub(crate) file: Arc<PathBuf>,
    pub(crate) line: usize,
    pub(crate) clock: Clock,
    /// The unit of lengths that the file states.
    pub(crate) unit: Option<Unit>,
    pub(crate) tracks: Vec<RawTrack>,
}

impl RawShot {
    pub(super) fn rows(&self) -> impl Iterator<Item = &Row> {
        self.tracks.iter().flat_map(|track| &track.rows)
    }

    pub(super) fn rows_mut(&mut self) -> impl Iterator<Item = &mut Row> {
        self.tracks.iter_mut().flat_map(|track| &mut track.rows)
    }

    /// Returns the different times of all tracks, ascending.
    pub(super) fn times(&self) -> Vec<f64> {
        let mut times = sorted(self.rows().map(|row| row.time));
        times.dedup();
        times
    }

    pub(super) fn centres(&self) -> Option<[&RawTrack; 2]> {
        let centres = self.tracks.iter().filter(|track| track.is_centre());
        centres.collect::<Vec<_>>().try_into().ok()
    }
}

pub(super) fn sorted(numbers: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = numbers.collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}

/// Returns the median, the larger of both middle numbers.
pub(super) fn middle(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let sorted = sorted(numbers);
    sorted.get(sorted.len() / 2).copied()
}

pub(super) fn span(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    numbers.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

/// Meaning of the times of a shot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Clock {
    /// The unit; `None` if the file does not state it (Kinovea).
    pub(crate) unit: Option<TimeUnit>,
    /// Rounding of times that are written as a clock shows them, s.
    pub(crate) rounding: Option<f64>,
    /// Frame rate of the camera that the file states.
    pub(crate) fps: Option<f64>,
}

impl Clock {
    pub(super) fn of(unit: TimeUnit) -> Self {
        Self { unit: Some(unit), ..Self::default() }
    }
}

/// A tracked ball, or a point on it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct RawTrack {
    pub(crate) name: String,
    /// Index of its body in the layout of the file: two may have the same name.
    pub(crate) body: usize,
    /// Name of a marker on the ball `name`.
    pub(crate) point: Option<String>,
    /// Whether x holds the angle of the disc `name` instead of positions, radians from the x axis
    /// to the y axis of the file.
    pub(crate) is_angle: bool,
    /// Its part in the shot, once it is assigned.
    pub(crate) role: Option<Role>,
    /// The rows in the order of the file.
    pub(crate) rows: Vec<Row>,
}

/// The part of a track in its shot, in the order of the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Role {
    /// 0 for the cue ball, 1 for the object ball.
    pub(crate) ball: usize,
    /// Whether it is a further point on the ball, and not the centre or one of the points whose
    /// mean is the centre.
    pub(crate) is_marker: bool,
    pub(crate) order: usize,
}

impl RawTrack {
    pub(super) fn is_centre(&self) -> bool {
        self.point.is_none()
    }

    pub(super) fn seen(&self) -> impl Iterator<Item = &Row> + Clone {
        self.rows.iter().filter(|row| !row.is_gap())
    }

    pub(super) fn line(&self) -> usize {
        self.rows.first().map_or(1, |row| row.line)
    }
}

/// A row; x and y are NaN in a gap, as are standard deviations that the file does not have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Row {
    pub(crate) time: f64,
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) sd: [f64; 2],
    pub(crate) line: usize,
}

impl Row {
    pub(super) fn new(time: f64, [x, y]: [f64; 2], line: usize) -> Self {
        Self { time, x, y, sd: [f64::NAN; 2], line }
    }

    pub(super) fn place(&self) -> [f64; 2] {
        [self.x, self.y]
    }

    pub(super) fn distance(&self, other: Self) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }

    pub(super) fn lose(&mut self) {
        (self.x, self.y) = (f64::NAN, f64::NAN);
    }

    pub(super) fn is_gap(&self) -> bool {
        self.x.is_nan() || self.y.is_nan()
    }
}
