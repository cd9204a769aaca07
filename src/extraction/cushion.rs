//! Cue balls that come off a cushion, or off another ball, shortly before the impact: their path has a corner, and only what follows it
//! belongs to the shot.

use super::initial_guess::{Line, surely_before};
use crate::film::frame_noise::noise;
use crate::measurement::track::TrackShot;
use crate::physics::ball::Ball;

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
pub(crate) fn leave_out_before_cushion(shot: &mut TrackShot, ball: &Ball) -> bool {
    let Some(corner) = last_corner(shot, ball) else { return false };
    shot.cue.retain(|sample| sample.t > corner);
    true
}

/// The time of the first frame after the last corner, s, in which the ball may still touch what turned it.
fn last_corner(shot: &TrackShot, ball: &Ball) -> Option<f64> {
    let impact = surely_before(shot, ball)?;
    let frame = shot.fps.recip();
    let count = shot.cue.partition_point(|sample| sample.t < impact - 0.5 * frame);
    let before = &shot.cue[..count];
    // of a least-squares slope, per frame, and of the difference of two
    let n = SIDE as f64;
    let error = ERRORS * noise(shot) * (24.0 / (n * (n * n - 1.0))).sqrt();
    let turn = |at: usize| {
        let sides = [&before[at - SIDE..at], &before[at..at + SIDE]];
        let [early, late] = sides.map(|side| Line::through(side, side[0].t));
        let off = early.largest_residual(sides[0]).max(late.largest_residual(sides[1]));
        let change = (late.velocity[0] - early.velocity[0]).hypot(late.velocity[1] - early.velocity[1]);
        let speed = early.velocity[0].hypot(early.velocity[1]);
        let is_corner = change > TURN * speed && change * frame > error && off < BENT * change * frame;
        is_corner.then_some((at, change))
    };
    let corners: Vec<(usize, f64)> = (SIDE..(count + 1).saturating_sub(SIDE)).filter_map(turn).collect();
    let (last, _) = *corners.last()?;
    // neighbouring places see the same corner, the right one the largest change
    let near = corners.iter().filter(|(at, _)| at + SIDE > last);
    let (at, _) = near.max_by(|a, b| a.1.total_cmp(&b.1))?;
    before.get(*at).map(|sample| sample.t)
}
