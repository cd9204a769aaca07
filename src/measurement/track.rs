//! What a camera saw of a shot, in metres and seconds: loaded by `dataset`, read by `impact`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::spin::Spin;

/// One filmed shot, calibrated: metres in the plane of the table (x right, y up, seen from above),
/// seconds from the first frame of the file.
#[derive(Clone, Debug)]
pub struct TrackShot {
    pub name: String,
    pub file: PathBuf,
    /// Line of its first row in the file.
    pub line: usize,
    /// Columns of the shots table that mean nothing to caromfit.
    pub labels: BTreeMap<String, String>,
    /// Frames per second at which the camera recorded.
    pub fps: f64,
    /// Positions of the cue ball's centre, in the order of time, without gaps' empty rows.
    pub cue: Vec<Sample>,
    /// And of the object ball's.
    pub object: Vec<Sample>,
    /// Tracked points on the balls' surfaces.
    pub markers: Vec<Marker>,
    /// The cue ball's spin before the impact; in the table frame where it is measured.
    pub spin: Spin,
    /// Standard deviation of a coordinate that dataset.toml states, metres.
    pub position_sd: Option<f64>,
    /// Step of the grid that the coordinates of the cue ball and of the object ball were rounded to, metres, such as a pixel; 0
    /// where there is none. Rounding errs by step/√12, as a uniform distribution of this width.
    pub resolution: [f64; 2],
    /// Correlation of the noise of neighbouring frames, from 0 to below 1; it falls by this factor from frame to frame.
    pub correlation: f64,
}

impl TrackShot {
    /// All positions: of both balls and of the markers.
    pub fn samples_mut(&mut self) -> impl Iterator<Item = &mut Sample> {
        let markers = self.markers.iter_mut().map(|marker| &mut marker.samples);
        [&mut self.cue, &mut self.object].into_iter().chain(markers).flatten()
    }

    /// How many frames together tell as much of a slow motion as one with independent noise: (1 + ρ)/(1 − ρ), where the correlation of
    /// the noise falls by ρ from frame to frame.
    #[must_use]
    pub fn frames_alike(&self) -> f64 {
        (1.0 + self.correlation) / (1.0 - self.correlation)
    }
}

/// A position in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Seconds.
    pub t: f64,
    /// Metres.
    pub x: f64,
    pub y: f64,
    /// Standard deviations of x and y, where the data give them.
    pub sd: Option<[f64; 2]>,
}

/// A marker on a ball.
#[derive(Clone, Debug)]
pub struct Marker {
    pub ball: TrackedBall,
    pub name: String,
    pub samples: Vec<Sample>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrackedBall {
    Cue,
    Object,
}
