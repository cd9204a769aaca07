//! Balls that come off a cushion, or off another ball, shortly before or after the impact: their
//! path has a corner, and only the part on the impact's side belongs to the shot.

use super::initial_guess::{Approach, MAX_DECELERATION, Path, approach, from_paths};
use crate::film::frame_noise::noise;
use crate::measurement::track::{Sample, TrackShot};

/// Frames on either side of a corner with a line each; longer lines show gentler corners.
const SIDE_FRAMES: usize = 4;
const LONG_SIDE_FRAMES: usize = 12;

/// Least change of velocity at a corner before the impact, as a part of the speed at the impact:
/// the cloth changes the velocity by less than 2 % in as many frames, at 100 frames per second and
/// 1 m/s.
const MIN_TURN: f64 = 0.2;

/// Least change of velocity at a corner, in standard errors of the difference of two slopes.
const MIN_TURN_ERRORS: f64 = 8.0;

/// Largest distance from the lines, as a part of the change of velocity times a frame: a frame that
/// was dropped within a side leaves 0.75 or more.
const MAX_RESIDUAL: f64 = 0.5;

/// Frames after the impact that are not searched for a corner: a tracker may lag as long.
const LAG_FRAMES: f64 = 8.0;

/// Least change of velocity at a corner after the impact, as a part of the incoming speed: a ball
/// that lands loses less than 0.015.
const MIN_TURN_AFTER: f64 = 0.03;

/// Residual that some of a dozen frames reach, in standard deviations of the noise.
const MAX_NOISE: f64 = 4.0;

/// Removes the cue ball's frames up to the last corner before the impact, in the last of which it
/// may still touch the cushion or ball that turned it; returns whether a corner exists.
pub(crate) fn leave_out_before_cushion(shot: &mut TrackShot) -> bool {
    let Some(Approach { until, speed }) = approach(shot) else { return false };
    let before = &shot.cue[..shot.cue.partition_point(|sample| sample.t < until - 0.5 / shot.fps)];
    let corners = corners(before, SIDE_FRAMES, (shot.fps, noise(shot)), (MIN_TURN * speed, 0.0));
    let Some(corner) = corners.last().map(|last| before[sharpest(&corners, last.at, SIDE_FRAMES)].t) else {
        return false;
    };
    shot.cue.retain(|sample| sample.t > corner);
    true
}

/// Removes a ball's frames from the first corner after the impact on; returns whether one exists.
/// The radius of the balls is in m.
pub(crate) fn leave_out_after_cushion(shot: &mut TrackShot, radius: f64) -> bool {
    // correlated noise bends paths more
    let noise = noise(shot) * shot.frames_alike().sqrt();
    let Ok(guess) = from_paths(shot, noise) else { return false };
    let fps = shot.fps;
    let incoming = guess.before[0].hypot(guess.before[1]);
    let cloth = MAX_DECELERATION * guess.distance / (2.0 * radius);
    let first = |samples: &[Sample], side: usize| {
        let after = &samples[samples.partition_point(|sample| sample.t < guess.time + LAG_FRAMES / fps)..];
        let least = (MIN_TURN_AFTER * incoming).max(cloth * side as f64 / fps);
        let corners = corners(after, side, (fps, noise), (least, MAX_NOISE * noise));
        // in the frame before it the ball may touch already
        Some(after[sharpest(&corners, corners.first()?.at, side) - 1].t)
    };
    let mut ends = 0;
    for samples in [&mut shot.cue, &mut shot.object] {
        if let Some(end) = first(samples, SIDE_FRAMES).or_else(|| first(samples, LONG_SIDE_FRAMES)) {
            samples.retain(|sample| sample.t < end);
            ends += 1;
        }
    }
    ends > 0
}

/// A corner of a path: the index of the first frame after it, and the change of velocity, m/s.
struct Corner {
    at: usize,
    change: f64,
}

/// Returns the corners of a path between lines through `side` frames on either side, with a change
/// of velocity (m/s) of at least `least`; `white` is the largest residual (m) of the lines in
/// excess of the part that the change explains.
fn corners(
    samples: &[Sample],
    side: usize,
    (fps, noise): (f64, f64),
    (least, white): (f64, f64),
) -> Vec<Corner> {
    // of a least-squares slope, per frame, and of the difference of two
    let n = side as f64;
    let error = MIN_TURN_ERRORS * noise * (24.0 / (n * (n * n - 1.0))).sqrt();
    let turn = |at: usize| {
        let sides = [&samples[at - side..at], &samples[at..at + side]];
        let [early, late] = sides.map(|side| Path::line(side, side[0].t));
        let off = early.largest_residual(sides[0]).max(late.largest_residual(sides[1]));
        let change = (late.velocity - early.velocity).norm();
        let is_corner = change > least && change / fps > error && off < MAX_RESIDUAL * change / fps + white;
        is_corner.then_some(Corner { at, change })
    };
    (side..(samples.len() + 1).saturating_sub(side)).filter_map(turn).collect()
}

/// Returns the index of the first frame after the corner that is seen at a place and at
/// neighbouring ones: the largest change is the right one.
fn sharpest(corners: &[Corner], place: usize, side: usize) -> usize {
    let near = corners.iter().filter(|corner| corner.at.abs_diff(place) < side);
    near.max_by(|a, b| a.change.total_cmp(&b.change)).map_or(place, |corner| corner.at)
}
