//! Cue balls that come off a cushion, or off another ball, shortly before the impact: their path has a corner, and only what follows it
//! belongs to the shot.

use super::initial_guess;
use crate::film::frame_noise::noise;
use crate::measurement::track::{Sample, TrackShot};
use crate::trajectory::scene::Scene;

/// Frames on either side of a corner through which straight lines are laid.
const SIDE: usize = 4;

/// Least change of velocity at a corner, as a part of the speed before it: the cloth changes the velocity by less than 2 % in as many
/// frames, at 100 frames per second and 1 m/s.
const TURN: f64 = 0.2;

/// Least change of velocity at a corner, in standard errors of the difference of two slopes.
const ERRORS: f64 = 8.0;

/// Largest distance from the lines, as a part of the change of velocity times a frame: a frame that was dropped within a side leaves 0.75
/// or more.
const BENT: f64 = 0.5;

/// Leaves out the frames of the cue ball up to the last corner of its path before the impact; returns whether there is one.
pub(crate) fn leave_out_before_cushion(shot: &mut TrackShot, scene: &Scene) -> bool {
    let Some(corner) = last_corner(shot, scene) else { return false };
    shot.cue.retain(|sample| sample.t > corner);
    true
}

/// The time of the first frame after the last corner, s, in which the ball may still touch what turned it.
fn last_corner(shot: &TrackShot, scene: &Scene) -> Option<f64> {
    let impact = initial_guess::surely_before(shot, scene)?;
    let frame = shot.fps.recip();
    let count = shot.cue.partition_point(|sample| sample.t < impact - 0.5 * frame);
    let before = &shot.cue[..count];
    // of a least-squares slope, per frame, and of the difference of two
    let n = SIDE as f64;
    let error = ERRORS * noise(shot) * (24.0 / (n * (n * n - 1.0))).sqrt();
    let turn = |at: usize| {
        let (early, late) = (Line::through(&before[at - SIDE..at])?, Line::through(&before[at..at + SIDE])?);
        let change = (late.velocity[0] - early.velocity[0]).hypot(late.velocity[1] - early.velocity[1]);
        let speed = early.velocity[0].hypot(early.velocity[1]);
        let is_corner = change > TURN * speed
            && change * frame > error
            && early.off.max(late.off) < BENT * change * frame;
        is_corner.then_some((at, change))
    };
    let corners: Vec<(usize, f64)> = (SIDE..(count + 1).saturating_sub(SIDE)).filter_map(turn).collect();
    let (last, _) = *corners.last()?;
    // neighbouring places see the same corner, the right one the largest change
    let near = corners.iter().filter(|(at, _)| at + SIDE > last);
    let (at, _) = near.max_by(|a, b| a.1.total_cmp(&b.1))?;
    before.get(*at).map(|sample| sample.t)
}

/// A straight path at a constant speed.
struct Line {
    velocity: [f64; 2],
    /// Largest distance of a frame from it, m.
    off: f64,
}

impl Line {
    fn through(samples: &[Sample]) -> Option<Self> {
        let n = samples.len() as f64;
        let mean = |pick: fn(&Sample) -> f64| samples.iter().map(pick).sum::<f64>() / n;
        let (t, x, y) = (mean(|s| s.t), mean(|s| s.x), mean(|s| s.y));
        let square: f64 = samples.iter().map(|s| (s.t - t).powi(2)).sum();
        let slope =
            |of: &dyn Fn(&Sample) -> f64| samples.iter().map(|s| (s.t - t) * of(s)).sum::<f64>() / square;
        let velocity = [slope(&|s| s.x - x), slope(&|s| s.y - y)];
        let distance = |s: &Sample| {
            let late = s.t - t;
            (s.x - x - velocity[0] * late).hypot(s.y - y - velocity[1] * late)
        };
        let off = samples.iter().map(distance).fold(0.0, f64::max);
        (square > 0.0 && off.is_finite()).then_some(Self { velocity, off })
    }
}
