//! Conversion of tracked positions to frames in metres from the middle of the film.

use super::camera::Point;
use crate::film::{frame_noise, grid};
use crate::measurement::track::{Sample, TrackShot};
use crate::problem::frames::Frame;

/// How the positions of a shot are read.
pub(crate) struct Reading {
    /// Middle of the film, in its unit.
    pub(crate) middle: Point,
    /// Metres in a unit of length of the film.
    pub(crate) unit: f64,
    /// Whether the noise of every frame is stated, so that it counts in metres.
    pub(crate) states_noise: bool,
    /// Whether a ball that repeats its place may be held there by a program.
    pub(crate) may_be_held: bool,
}

impl Reading {
    /// Returns the frames of a ball, or of a point on a disc; coordinates lie on a grid of this
    /// step.
    pub fn frames(&self, shot: &TrackShot, samples: &[Sample], step: f64) -> Vec<Frame> {
        let noise = frame_noise::noise(shot);
        let repeats = grid::repeats(samples, noise.max(grid::rounding(step)), step, self.may_be_held);
        let frame = |(sample, repeats): (&Sample, [f64; 2])| {
            let seen = (Point::new(sample.x, sample.y) - self.middle) * self.unit;
            let weight = |axis: usize| {
                let stated = sample.sd.map(|sd| sd[axis]).or(shot.position_sd);
                // over the noise of the film, which is 1 m if all noise is stated
                let of_noise = |sd: f64| if self.states_noise { sd * self.unit } else { sd / noise };
                let sd = stated.map_or(1.0, of_noise);
                (repeats[axis].sqrt() * if sd > 0.0 { sd } else { 1.0 }).recip()
            };
            Frame {
                time: sample.t,
                seen,
                weight: Point::new(weight(0), weight(1)),
                used: seen.x.is_finite() && seen.y.is_finite(),
            }
        };
        samples.iter().zip(repeats).map(frame).collect()
    }
}
