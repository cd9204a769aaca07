//! Positions as all formats are read: in the file's units, with their lines.

use std::path::PathBuf;

use super::settings::Format;
use super::units::Unit;

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
        let centres = self.tracks.iter().filter(|track| track.is_centre());
        centres.collect::<Vec<_>>().try_into().ok()
    }

    /// Returns the longer side of the box about all positions.
    pub(super) fn extent(&self) -> f64 {
        let tracks = self.tracks.iter().filter(|track| !track.is_angle);
        let places = tracks.flat_map(|track| track.seen()).map(|row| row.place);
        let sides = [0, 1].map(|axis| span(places.clone().map(|place| place[axis])));
        sides.map(|[low, high]| high - low).into_iter().fold(0.0, f64::max)
    }

    /// Returns the least distance of both centres in a frame.
    pub(super) fn closest(&self) -> Option<f64> {
        let [one, other] = self.centres()?;
        let frames = one.frames_with(other).into_iter();
        frames.map(|[i, j]| one.rows[i].distance(&other.rows[j])).min_by(f64::total_cmp)
    }

    /// Returns the time at which a track is a tenth of its way from its start, as a part of the time
    /// of all tracks; 1 if it stays there.
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

/// Returns the number at a part of a sorted list.
pub(super) fn value_at(sorted: &[f64], part: f64) -> Option<f64> {
    sorted.get((part * sorted.len() as f64) as usize).copied()
}

/// Returns the speed beyond which a step is a jump: a multiple of that which nine tenths of these
/// steps do not exceed, since others may be wrong. Infinite without motion.
pub(super) fn jump_speed(steps: impl Iterator<Item = [f64; 2]>) -> f64 {
    const MIN_JUMP: f64 = 5.0;
    let speeds = sorted(steps.map(|[length, time]| length / time).filter(|speed| speed.is_finite()));
    MIN_JUMP * value_at(&speeds, 0.9).filter(|fast| *fast > 0.0).unwrap_or(f64::INFINITY)
}

pub(super) fn span(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    numbers.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

/// Statements of a file, or of its format, about all its rows.
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
    /// Index of its body in the layout of the file: two may have the same name.
    pub(crate) body: usize,
    /// Name of a marker on the ball `name`.
    pub(crate) point: Option<String>,
    /// Whether x holds the angle of the disc `name` instead of positions, radians from the x axis
    /// to the y axis of the file.
    pub(crate) is_angle: bool,
    /// Its part in the shot, once it is assigned.
    pub(crate) role: Option<Role>,
    /// Its rows in the order of time.
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

    /// Puts the rows in the order of time.
    pub(super) fn sort(&mut self) {
        self.rows.sort_by(|a, b| a.time.total_cmp(&b.time));
    }

    /// Returns the row of a time.
    pub(super) fn at(&self, time: f64) -> Option<&Row> {
        self.rows.get(self.rows.partition_point(|row| row.time < time)).filter(|row| row.time == time)
    }

    /// Returns the places in the rows of frames in which this track and another are seen.
    pub(super) fn frames_with(&self, other: &Self) -> Vec<[usize; 2]> {
        let (mut frames, mut j) = (Vec::new(), 0);
        for (i, row) in self.rows.iter().enumerate() {
            j += other.rows[j..].iter().take_while(|other| other.time < row.time).count();
            let Some(beside) = other.rows.get(j).filter(|other| other.time == row.time) else { continue };
            if !row.is_gap() && !beside.is_gap() {
                frames.push([i, j]);
            }
            j += 1;
        }
        frames
    }

    /// Returns the rows with positions.
    pub(super) fn seen(&self) -> impl Iterator<Item = &Row> + Clone {
        self.rows.iter().filter(|row| !row.is_gap())
    }

    /// Returns the steps from one row with a position to the next one.
    pub(super) fn steps(&self) -> impl Iterator<Item = [f64; 2]> {
        self.seen().zip(self.seen().skip(1)).map(|(row, next)| row.step(next))
    }

    /// Returns the first of its lines.
    pub(super) fn line(&self) -> usize {
        self.rows.iter().map(|row| row.line).min().unwrap_or(1)
    }
}

/// A position; NaN in a gap, as are standard deviations that the file does not have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Row {
    pub(crate) time: f64,
    pub(crate) place: [f64; 2],
    pub(crate) sd: [f64; 2],
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
