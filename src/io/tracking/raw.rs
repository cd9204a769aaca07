//! Positions as all formats are read: in the file's units, on one grid of frames, with their lines.

use std::path::PathBuf;
use std::sync::Arc;

use super::units::{TimeUnit, Unit};
use crate::numerics::median;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct RawShot {
    pub(crate) name: String,
    pub(crate) file: Arc<PathBuf>,
    pub(crate) line: usize,
    pub(crate) clock: Clock,
    /// The unit of lengths that the file states.
    pub(crate) unit: Option<Unit>,
    /// The times of the frames, ascending. Two frames have one time if a track has it in two rows.
    pub(crate) times: Vec<f64>,
    pub(crate) tracks: Vec<RawTrack>,
}

impl RawShot {
    /// Returns the shot with each track's rows, written with their times, in frames: the second row
    /// of a track at one time is in a frame of its own.
    pub(super) fn on_grid(mut self, written: Vec<Vec<(f64, Row)>>) -> Self {
        let mut tracks: Vec<Vec<((f64, usize), Row)>> = written.into_iter().map(numbered).collect();
        let order = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        let mut frames: Vec<(f64, usize)> = tracks.iter().flatten().map(|(frame, _)| *frame).collect();
        frames.sort_unstable_by(order);
        frames.dedup();
        for (track, rows) in self.tracks.iter_mut().zip(&mut tracks) {
            let mut rows = std::mem::take(rows).into_iter().peekable();
            let mut of = |frame: &(f64, usize)| rows.next_if(|(own, _)| own == frame);
            track.rows = frames.iter().map(|frame| of(frame).map_or(Row::NONE, |(_, row)| row)).collect();
        }
        self.times = frames.into_iter().map(|(time, _)| time).collect();
        self
    }

    /// Returns the rows that the file has of each track, with their times.
    pub(super) fn written(&self) -> Vec<Vec<(f64, Row)>> {
        let rows = |track: &RawTrack| track.written().map(|(i, row)| (self.times[i], *row)).collect();
        self.tracks.iter().map(rows).collect()
    }

    /// Returns the different times, ascending.
    pub(super) fn instants(&self) -> Vec<f64> {
        let mut times = self.times.clone();
        times.dedup();
        times
    }

    /// Returns the median step of time; NaN with fewer than two times.
    pub(super) fn step(&self) -> f64 {
        median(self.instants().windows(2).map(|two| two[1] - two[0]).collect())
    }

    pub(super) fn centres(&self) -> Option<[&RawTrack; 2]> {
        let centres = self.tracks.iter().filter(|track| track.is_centre());
        centres.collect::<Vec<_>>().try_into().ok()
    }

    /// Returns the lengths and durations of a track's steps from one position that is seen to the
    /// next one.
    pub(super) fn steps(&self, track: &RawTrack) -> Vec<[f64; 2]> {
        let seen: Vec<(usize, &Row)> = track.seen().collect();
        let step = |two: &[(usize, &Row)]| {
            [two[0].1.distance(two[1].1), self.times[two[1].0] - self.times[two[0].0]]
        };
        seen.windows(2).map(step).collect()
    }

    /// Returns the time at which a track is a tenth of its way from its start, as a part of the time
    /// of all tracks; 1 if it stays there.
    pub(super) fn beginning(&self, track: &RawTrack) -> Option<f64> {
        const MOVED: f64 = 0.1;
        let (first, last) = (self.times.first()?, self.times.last()?);
        let (_, origin) = track.seen().next()?;
        let most = track.seen().map(|(_, row)| origin.distance(row)).fold(0.0, f64::max);
        let moving = track.seen().find(|(_, row)| origin.distance(row) > MOVED * most);
        let part = |frame: usize| (self.times[frame] - first) / (last - first).max(f64::MIN_POSITIVE);
        Some(moving.map_or(1.0, |(frame, _)| part(frame)))
    }
}

/// Returns rows in the order of time, with the number of rows above of the same time.
fn numbered(mut rows: Vec<(f64, Row)>) -> Vec<((f64, usize), Row)> {
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut last = (f64::NAN, 0);
    let number = |(time, row): (f64, Row)| {
        last = (time, if time == last.0 { last.1 + 1 } else { 0 });
        (last, row)
    };
    rows.into_iter().map(number).collect()
}

pub(super) fn sorted(numbers: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = numbers.collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
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

    /// Returns the rows that the file has, with their frames.
    pub(super) fn written(&self) -> impl Iterator<Item = (usize, &Row)> + Clone {
        self.rows.iter().enumerate().filter(|(_, row)| row.line > 0)
    }

    /// Returns the rows with positions, with their frames.
    pub(super) fn seen(&self) -> impl Iterator<Item = (usize, &Row)> + Clone {
        self.rows.iter().enumerate().filter(|(_, row)| !row.is_gap())
    }

    /// Returns the first of its lines.
    pub(super) fn line(&self) -> usize {
        self.written().map(|(_, row)| row.line).min().unwrap_or(1)
    }
}

/// A position; NaN in a gap, as are standard deviations that the file does not have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Row {
    pub(crate) place: [f64; 2],
    pub(crate) sd: [f64; 2],
    /// 0 if the file has no row of the track in this frame.
    pub(crate) line: usize,
}

impl Row {
    pub(super) const NONE: Self = Self { place: [f64::NAN; 2], sd: [f64::NAN; 2], line: 0 };

    pub(super) fn distance(&self, other: &Self) -> f64 {
        (self.place[0] - other.place[0]).hypot(self.place[1] - other.place[1])
    }

    pub(super) fn lose(&mut self) {
        self.place = [f64::NAN; 2];
    }

    pub(super) fn is_gap(&self) -> bool {
        self.place.iter().any(|x| x.is_nan())
    }
}
