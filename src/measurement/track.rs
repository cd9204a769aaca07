//! What a camera saw of a shot, in metres and seconds.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::spin::Spin;

/// One filmed shot, calibrated: metres in the plane of the table (x right, y up, seen from above),
/// seconds from the first frame of the file.
#[derive(Clone, Debug)]
pub struct TrackShot {
    /// The name of the shot.
    pub name: String,
    /// The file that it was read from.
    pub file: PathBuf,
    /// The line of its first row in the file, from 1.
    pub line: usize,
    /// Columns of the shots table that have no meaning for caromfit, kept as text.
    pub labels: BTreeMap<String, String>,
    /// Frames per second at which the camera recorded.
    pub fps: f64,
    /// Positions of the cue ball's centre in the order of time; frames without a position are left out.
    pub cue: Vec<Sample>,
    /// Positions of the object ball's centre likewise.
    pub object: Vec<Sample>,
    /// Positions of the points on the balls' surfaces that were tracked.
    pub markers: Vec<Marker>,
    /// The cue ball's spin before the impact, in the table frame where it is measured.
    pub spin: Spin,
    /// The standard deviation of a coordinate that dataset.toml states, m.
    pub position_sd: Option<f64>,
    /// The step of the grid to which the coordinates of the cue ball and of the object ball were rounded, such as a
    /// pixel, m; 0 where they were not. The rounding error has the standard deviation step/√12 of a uniform
    /// distribution of this width.
    pub resolution: [f64; 2],
    /// Correlation of the noise of neighbouring frames, from 0 to below 1; it falls by this factor from frame to frame.
    pub correlation: f64,
}

impl TrackShot {
    /// All positions: of both balls and of the markers.
    pub(crate) fn samples_mut(&mut self) -> impl Iterator<Item = &mut Sample> {
        let markers = self.markers.iter_mut().map(|marker| &mut marker.samples);
        [&mut self.cue, &mut self.object].into_iter().chain(markers).flatten()
    }

    /// How many frames together tell as much of a slow motion as one with independent noise: (1 + ρ)/(1 − ρ), where the correlation of
    /// the noise falls by ρ from frame to frame.
    #[must_use]
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
    /// Standard deviations of x and y, m, where the data give them.
    pub sd: Option<[f64; 2]>,
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
