//! Spins just before and after the impact from the markers on the balls.

use super::marker_rotation::{self, Rotation, Spot};
use crate::measurement::track::{Marker, Sample, TrackShot, TrackedBall};

/// Part of a frame that is left out on both sides: frames across the impact show neither spin.
const CLEAR_FRAMES: f64 = 0.01;

/// Frames on either side of the impact that are used: over these the cloth changes a spin evenly.
const NEAR_FRAMES: f64 = 60.0;

/// Angular velocities just before and after the impact, of balls with markers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rotations {
    /// The cue ball's angular velocity just before the impact.
    pub cue_before: Option<Rotation>,
    /// The cue ball's angular velocity just after the impact.
    pub cue_after: Option<Rotation>,
    /// The object ball's angular velocity just after the impact.
    pub object_after: Option<Rotation>,
}

impl Rotations {
    /// Measures the rotations of balls of this radius (m) in the unit of the film, from positions
    /// with this noise unless another is stated.
    #[must_use]
    pub fn of(shot: &TrackShot, impact: f64, radius: f64, noise: f64) -> Self {
        let clear = CLEAR_FRAMES / shot.fps;
        let near = NEAR_FRAMES / shot.fps;
        let of = |ball: TrackedBall, window: [f64; 2]| {
            let centres = if ball == TrackedBall::Cue { &shot.cue } else { &shot.object };
            let own = || shot.markers.iter().filter(|marker| marker.ball == ball);
            let spot = |marker: &Marker| spot(&marker.samples, centres, (window, impact), (radius, noise));
            let spots: Vec<Spot> = own().map(spot).collect();
            let is_known = |marker: &Marker| marker.samples.iter().all(|sample| sample.sd.is_some());
            let stated = shot.position_sd.is_some() || own().all(is_known);
            marker_rotation::measure(&spots, stated)
        };
        let before = [impact - near, impact - clear];
        let after = [impact + clear, impact + near];
        Self {
            cue_before: of(TrackedBall::Cue, before),
            cue_after: of(TrackedBall::Cue, after),
            object_after: of(TrackedBall::Object, after),
        }
    }
}

/// Returns a marker's places from the centre of its ball in the frames of a window that show both.
fn spot(
    samples: &[Sample],
    centres: &[Sample],
    ([from, to], impact): ([f64; 2], f64),
    (radius, noise): (f64, f64),
) -> Spot {
    let sd_of = |sample: &Sample| sample.sd.map_or(noise, |[x, y]| 0.5 * (x + y));
    let inside = samples.iter().filter(|sample| (from..=to).contains(&sample.t));
    let seen = inside.filter_map(|sample| {
        let at = centres.partition_point(|centre| centre.t < sample.t - 1e-9);
        let centre = centres.get(at).filter(|centre| (centre.t - sample.t).abs() < 1e-9)?;
        let sd = sd_of(sample).hypot(sd_of(centre)) / radius;
        Some((sample.t - impact, [(sample.x - centre.x) / radius, (sample.y - centre.y) / radius], sd))
    });
    Spot { seen: seen.collect() }
}
