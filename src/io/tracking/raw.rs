//! Positions as all formats are read: in the file's units, with their lines.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use super::settings::{Format, TrackSettings};
use super::words::Unit;
use crate::io::error::{Log, Subject};

#[derive(Clone, Debug, PartialEq)]
pub(super) struct RawShot {
    pub(crate) name: String,
    pub(crate) file: PathBuf,
    pub(crate) line: usize,
    pub(crate) stated: Stated,
    pub(crate) tracks: Vec<RawTrack>,
}

impl RawShot {
    /// Returns the different times of all rows, ascending.
    pub(super) fn times(&self) -> Vec<f64> {
        let mut times = sorted(self.tracks.iter().flat_map(|track| &track.rows).map(|row| row.time));
        times.dedup();
        times
    }

    /// Gives the rows other times, in the same order.
    pub(super) fn map_times(&mut self, new: impl Fn(f64) -> f64) {
        let rows = self.tracks.iter_mut().flat_map(|track| &mut track.rows);
        rows.for_each(|row| row.time = new(row.time));
    }

    pub(super) fn centres(&self) -> Option<[&RawTrack; 2]> {
        let centres = self.tracks.iter().filter(|track| track.point.is_none());
        centres.collect::<Vec<_>>().try_into().ok()
    }

    /// Returns at which part of all tracks' time one is a tenth of its way from its start; 1: never.
    pub(super) fn beginning(&self, track: &RawTrack) -> Option<f64> {
        const MOVED: f64 = 0.1;
        let [first, last] = span(self.tracks.iter().flat_map(|track| &track.rows).map(|row| row.time));
        let origin = track.seen().next()?;
        let most = track.seen().map(|row| origin.distance(row)).fold(0.0, f64::max);
        let moving = track.seen().find(|row| origin.distance(row) > MOVED * most);
        Some(moving.map_or(1.0, |row| (row.time - first) / (last - first).max(f64::MIN_POSITIVE)))
    }
}

pub(super) fn sorted(numbers: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = numbers.collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}

/// Returns the number below which this part of some numbers is.
pub(super) fn value_at(numbers: &mut [f64], part: f64) -> Option<f64> {
    let place = (part * numbers.len() as f64) as usize;
    (place < numbers.len()).then(|| *numbers.select_nth_unstable_by(place, f64::total_cmp).1)
}

/// Multiple of the range, or limit, of most of some numbers beyond which others are faults.
pub(super) const UNLIKE: f64 = 5.0;

/// Returns the speed beyond which a step is a jump: a multiple of that which a part of these steps do
/// not exceed, since others may be wrong. Infinite without motion.
pub(super) fn jump_speed(steps: impl Iterator<Item = [f64; 2]>, part: f64) -> f64 {
    let mut speeds: Vec<f64> = steps.map(|[length, time]| length / time).collect();
    speeds.retain(|speed| speed.is_finite() && *speed > 0.0);
    UNLIKE * value_at(&mut speeds, part).unwrap_or(f64::INFINITY)
}

pub(super) fn span(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    numbers.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

/// Statements of a file or its format about all rows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Stated {
    pub(crate) format: Format,
    /// The unit of lengths.
    pub(crate) unit: Option<Unit>,
    /// The unit of times, unless these are written h:mm:ss; `None` if it is not stated (Kinovea).
    pub(crate) time: Option<Unit>,
    /// Rounding of times that are written as a clock shows them, s.
    pub(crate) rounding: Option<f64>,
    /// Frame rate of the camera.
    pub(crate) fps: Option<f64>,
}

/// A tracked ball, or a point on it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct RawTrack {
    pub(crate) name: String,
    /// Name of a marker on the ball `name`; `None` for its centre.
    pub(crate) point: Option<String>,
    /// Whether x holds the angle of the disc `name`, radians from the file's x axis to its y axis.
    pub(crate) is_angle: bool,
    /// The key of [`NAMED`] that names it, and its place there; of other points on a named ball the
    /// key of its markers.
    pub(crate) role: Option<[usize; 2]>,
    /// In the order of time.
    pub(crate) rows: Vec<Row>,
}

impl RawTrack {
    /// Returns the rows in the order of the file.
    pub(super) fn written(&self) -> Vec<Row> {
        let mut written = self.rows.clone();
        written.sort_by_key(|row| row.line);
        written
    }

    /// Returns the rows at which the time begins again, before all since it last began, and goes on:
    /// at another place than at that time before, or to end before it first began.
    pub(super) fn restarts(&self) -> Vec<Row> {
        let written = self.written();
        let [Some(mut first), Some(last)] = [written.first(), written.last()] else { return Vec::new() };
        let ends_before = last.time < first.time;
        let mut restarts = Vec::new();
        for (i, two) in written.windows(2).enumerate().skip(1) {
            let ([row, next], before) = ([&two[0], &two[1]], &written[..i]);
            let is_elsewhere = |other: &Row| other.time == row.time && other.distance(row) > 0.0;
            let begins = row.time < before[i - 1].time && row.time <= first.time && next.time > row.time;
            if begins && (ends_before || before.iter().any(is_elsewhere)) {
                first = row;
                restarts.push(*row);
            }
        }
        restarts
    }

    pub(super) fn at(&self, time: f64) -> Option<&Row> {
        self.rows.get(self.rows.partition_point(|row| row.time < time)).filter(|row| row.time == time)
    }

    /// Returns the rows of both in each frame in which this track and another are seen.
    pub(super) fn frames_with(&self, other: &Self) -> Vec<[Row; 2]> {
        let frames = self.seen().filter_map(|row| Some([*row, *other.at(row.time)?]));
        frames.filter(|[_, beside]| !beside.is_gap()).collect()
    }

    pub(super) fn distances(&self, other: &Self) -> Vec<f64> {
        self.frames_with(other).iter().map(|[row, beside]| row.distance(beside)).collect()
    }

    pub(super) fn seen(&self) -> impl Iterator<Item = &Row> + Clone {
        self.rows.iter().filter(|row| !row.is_gap())
    }

    /// Returns the steps between rows with positions.
    pub(super) fn steps(&self) -> impl Iterator<Item = [f64; 2]> {
        self.seen().zip(self.seen().skip(1)).map(|(row, next)| row.step(next))
    }

    pub(super) fn line(&self) -> usize {
        self.rows.iter().map(|row| row.line).min().unwrap_or(1)
    }
}

/// A position, NaN in a gap, with its standard deviations if the file has them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Row {
    pub(crate) time: f64,
    pub(crate) place: [f64; 2],
    pub(crate) sd: Option<[f64; 2]>,
    pub(crate) line: usize,
}

impl Row {
    pub(super) fn distance(&self, other: &Self) -> f64 {
        (self.place[0] - other.place[0]).hypot(self.place[1] - other.place[1])
    }

    /// Returns the length and the duration of the step to another row.
    pub(super) fn step(&self, other: &Self) -> [f64; 2] {
        [self.distance(other), other.time - self.time]
    }

    pub(super) fn lose(&mut self) {
        self.place = [f64::NAN; 2];
    }

    pub(super) fn is_gap(&self) -> bool {
        self.place.iter().any(|x| x.is_nan())
    }
}

/// A file that is read, or a shot of it, with the settings and the list of notes and problems.
#[derive(Clone, Copy)]
pub(super) struct Job<'a> {
    pub(crate) file: &'a Path,
    /// The file's text, for its reader.
    pub(crate) text: &'a str,
    pub(crate) settings: &'a TrackSettings,
    pub(crate) log: &'a Log,
}

impl Job<'_> {
    pub(super) fn note(self, subject: Subject, line: impl Into<Option<usize>>, message: impl Into<String>) {
        self.log.note(subject, self.file, line, message);
    }

    pub(super) fn wrong<'c>(
        self,
        line: impl Into<Option<usize>>,
        column: impl Into<Option<&'c str>>,
        message: impl Into<String>,
    ) {
        self.log.add(self.file, line, column, message);
    }

    /// Returns `None`, with a problem.
    pub(super) fn refuse<T>(self, line: impl Into<Option<usize>>, message: impl Into<String>) -> Option<T> {
        self.wrong(line, None, message);
        None
    }

    /// Returns the column to be read, and whether it holds numbers of frames: these are preferred
    /// if the frame rate is stated, since they cannot follow a wrong one.
    pub(super) fn frame_or_time<T>(self, frame: Option<T>, time: Option<T>) -> Option<(T, bool)> {
        let frame = frame.filter(|_| time.is_none() || self.settings.fps().is_some());
        frame.map(|frame| (frame, true)).or(time.map(|time| (time, false)))
    }
}

/// Returns the name of a file without its ending: the default name of its shot.
pub(super) fn stem(file: &Path) -> Cow<'_, str> {
    file.file_stem().unwrap_or_default().to_string_lossy()
}
