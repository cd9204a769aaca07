//! Positions that a camera saw of a shot, in metres and seconds.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::correction::Correction;
use super::observable::Measured;
use super::spin::Spin;
use crate::physics::disc::Discs;

/// One filmed shot, calibrated: m in the plane of the table (x right, y up, seen from above), s
/// from the first frame of the file.
#[derive(Clone, Debug, Default)]
pub struct TrackShot {
    /// The name of the shot.
    pub name: String,
    /// The file that it was read from; empty for one that a program made.
    pub file: PathBuf,
    /// The line of its first row in the file, from 1; 0 for one that a program made.
    pub line: usize,
    /// Columns of the shots table that have no meaning for caromfit, kept as text.
    pub labels: BTreeMap<String, String>,
    /// Frames per second at which the camera recorded.
    pub fps: f64,
    /// Positions of the cue ball's centre in the order of time, without missing frames.
    pub cue: Vec<Sample>,
    /// Positions of the object ball's centre likewise.
    pub object: Vec<Sample>,
    /// Positions of the points on the balls' surfaces that were tracked.
    pub markers: Vec<Marker>,
    /// The cue ball's spin before the impact, in the table frame if it is measured.
    pub spin: Spin,
    /// The standard deviation of a coordinate that dataset.toml states, m.
    pub position_sd: Option<f64>,
    /// The step of the grid to which the coordinates of the cue ball and of the object ball were
    /// rounded, such as a pixel, m; 0 if they were not. Rounding has the standard deviation
    /// step/√12.
    pub resolution: [f64; 2],
    /// Correlation of the noise of neighbouring frames, from 0 to below 1.
    pub correlation: f64,
}

impl TrackShot {
    /// Returns whether the noise of every position is stated.
    pub(crate) fn states_noise(&self) -> bool {
        self.position_sd.is_some() || self.cue.iter().chain(&self.object).all(|sample| sample.sd.is_some())
    }

    /// Returns a film at `fps` frames per second: the positions of the centres of cue ball and
    /// object ball in the order of time, before, through and after the hit.
    ///
    /// ```
    /// use caromfit::measurement::dataset::Dataset;
    /// use caromfit::measurement::spin::Spin;
    /// use caromfit::measurement::track::{Sample, TrackShot};
    /// use caromfit::physics::ball::Ball;
    ///
    /// // of each ball the rows (t, [x, y]) from a tracker, s and m
    /// let rows = |x: f64| (0..40).map(|i| Sample::new(f64::from(i) * 1e-3, [x, 0.0])).collect();
    /// let shot = TrackShot::new("shot 1", 1000.0, Spin::NaturalRoll, [rows(0.0), rows(0.1)]);
    /// let dataset = Dataset::filmed("film", Ball::POOL, vec![shot]);
    /// assert!(dataset.faults().is_empty());
    /// ```
    pub fn new(name: impl Into<String>, fps: f64, spin: Spin, [cue, object]: [Vec<Sample>; 2]) -> Self {
        Self { name: name.into(), fps, cue, object, spin, ..Self::default() }
    }

    /// Returns the positions of both balls, and of each marker.
    pub(crate) fn tracks_mut(&mut self) -> impl Iterator<Item = &mut Vec<Sample>> {
        let markers = self.markers.iter_mut().map(|marker| &mut marker.samples);
        [&mut self.cue, &mut self.object].into_iter().chain(markers)
    }

    /// Returns the number of frames that determine a slow motion as one with independent noise
    /// does, (1 + ρ)/(1 − ρ).
    pub(crate) fn frames_alike(&self) -> f64 {
        (1.0 + self.correlation) / (1.0 - self.correlation)
    }
}

/// A position in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time, s.
    pub t: f64,
    /// Coordinate x, m.
    pub x: f64,
    /// Coordinate y, m.
    pub y: f64,
    /// Standard deviations of x and y, m, if the data give them.
    pub sd: Option<[f64; 2]>,
}

impl Sample {
    /// The position x, y in m at the time t in s, of unknown error.
    pub fn new(t: f64, [x, y]: [f64; 2]) -> Self {
        Self { t, x, y, sd: None }
    }
}

/// A marker on a ball.
#[derive(Clone, Debug)]
pub struct Marker {
    /// The ball that carries the marker.
    pub ball: TrackedBall,
    /// The name of the marker.
    pub name: String,
    /// The marker's positions in the order of time.
    pub samples: Vec<Sample>,
}

/// One of the two balls of a shot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrackedBall {
    /// The cue ball; of discs, the first.
    Cue,
    /// The object ball; of discs, the second.
    Object,
}

/// The filmed shots of a data set.
#[derive(Clone, Debug, Default)]
pub struct Tracks {
    /// The shots whose impacts can be extracted.
    pub shots: Vec<TrackShot>,
    /// Frames per second of the first shot, also once the shots were extracted.
    pub fps: Option<f64>,
    /// Name and reason of each shot that is to be skipped, or that cannot be repaired.
    pub left_out: Vec<(String, String)>,
    /// Faults that were detected in the files and repaired, with file and line.
    pub notes: Vec<String>,
    /// The discs; `None` for balls.
    pub discs: Option<Discs>,
    /// Stated corrections for the camera, in the order of [`Correction::ALL`]; `None`: to be found.
    pub camera: [Option<Measured>; Correction::COUNT],
    /// Relative standard deviation of the frame rate, if it is stated.
    pub rate_sd: Option<f64>,
    /// Standard deviation of the slope of the table along x and y, if it is stated.
    pub tilt_sd: Option<f64>,
    /// Standard deviation of the mean topspin Rω/U of stun and natural roll, if it is stated.
    pub topspin_sd: Option<f64>,
    /// Whether lengths are in an unknown unit, so that the size of the balls sets the scale.
    pub from_balls: bool,
    /// Relative standard deviation of the scale; `None` if the size of the balls is said to set it.
    pub scale_sd: Option<f64>,
}

impl Tracks {
    /// Relative standard deviation of a scale that is stated without one: rulers on the table, and
    /// not at the height of the balls' centres, seen from 1.5 m are off by 2 %.
    pub const SCALE_SD: f64 = 0.02;

    /// Highest rate at which films are played, frames per second; slow motion is recorded at more.
    pub const MAX_PLAYBACK: f64 = 60.0;

    /// Returns shots of balls whose camera is to be found from the balls, in metres.
    pub fn new(shots: Vec<TrackShot>) -> Self {
        let fps = shots.first().map(|shot| shot.fps);
        Self { shots, fps, scale_sd: Some(Self::SCALE_SD), ..Self::default() }
    }
}
