//! Balls that come off a cushion, or off another ball, shortly before or after the impact: their
//! path has a corner, and only the part on the impact's side belongs to the shot.

use super::initial_guess::{Path, from_paths, time_before_impact};
use crate::film::frame_noise::noise;
use crate::measurement::track::{Sample, TrackShot};
use crate::physics::ball::Ball;

/// Frames on either side of a corner with a line each; longer lines show gentler corners.
const SIDE_FRAMES: usize = 4;
const LONG_SIDE_FRAMES: usize = 12;

/// Least change of velocity at a corner, as a part of the speed before it: the cloth changes the
/// velocity by less than 2 % in as many frames, at 100 frames per second and 1 m/s.
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

/// Steepest deceleration by a cloth, m/s²: a sliding friction of 0.4.
const MAX_DECELERATION: f64 = 4.0;

/// Residual that some of a dozen frames reach, in standard deviations of the noise.
const MAX_NOISE: f64 = 4.0;

/// Removes the cue ball's frames up to the last corner before the impact; returns whether one
/// exists.
pub(crate) fn leave_out_before_cushion(shot: &mut TrackShot, ball: &Ball) -> bool {
    let Some(corner) = last_corner(shot, ball) else { return false };
    shot.cue.retain(|sample| sample.t > corner);
    true
}

/// Removes a ball's frames from the first corner after the impact on; returns whether one exists.
pub(crate) fn leave_out_after_cushion(shot: &mut TrackShot, ball: &Ball) -> bool {
    // correlated noise bends paths more
    let noise = noise(shot) * shot.frames_alike().sqrt();
    let Ok(guess) = from_paths(shot, ball, noise) else { return false };
    let after = guess.time + LAG_FRAMES / shot.fps;
    let incoming = guess.before[0].hypot(guess.before[1]);
    let cloth = MAX_DECELERATION * guess.distance / (2.0 * ball.radius);
    let first = |samples: &[Sample]| {
        let from = samples.partition_point(|sample| sample.t < after);
        let of_side = |side: usize| {
            let least = (MIN_TURN_AFTER * incoming).max(cloth * side as f64 / shot.fps);
            let first = first_corner(&samples[from..], side, (shot.fps, noise), least)?;
            // in the frame before it the ball may touch already
            Some(samples[from + first - 1].t)
        };
        of_side(SIDE_FRAMES).or_else(|| of_side(LONG_SIDE_FRAMES))
    };
    let ends = [first(&shot.cue), first(&shot.object)];
    for (samples, end) in [&mut shot.cue, &mut shot.object].into_iter().zip(ends) {
        samples.retain(|sample| end.is_none_or(|end| sample.t < end));
    }
    ends.iter().any(Option::is_some)
}

/// Returns the index of the first frame after the first corner.
fn first_corner(samples: &[Sample], side: usize, (fps, noise): (f64, f64), least: f64) -> Option<usize> {
    let corners = corners(samples, side, (fps, noise), (|_| least, MAX_NOISE * noise));
    let (first, _) = *corners.first()?;
    largest(corners.iter().filter(|(at, _)| *at < first + side))
}

/// Returns the time of the first frame after the last corner, s, in which the ball may still touch
/// the cushion or ball that turned it.
fn last_corner(shot: &TrackShot, ball: &Ball) -> Option<f64> {
    let impact = time_before_impact(shot, ball)?;
    let count = shot.cue.partition_point(|sample| sample.t < impact - 0.5 / shot.fps);
    let before = &shot.cue[..count];
    let corners = corners(before, SIDE_FRAMES, (shot.fps, noise(shot)), (|speed| MIN_TURN * speed, 0.0));
    let (last, _) = *corners.last()?;
    let at = largest(corners.iter().filter(|(at, _)| at + SIDE_FRAMES > last))?;
    before.get(at).map(|sample| sample.t)
}

/// Returns the corners of a path: the index of the first frame after each, and the change of
/// velocity. `least` is the smallest change at a speed (m/s), `white` the largest residual (m) of
/// the lines beside the corner in excess of the part that the change explains.
fn corners(
    samples: &[Sample],
    side: usize,
    (fps, noise): (f64, f64),
    (least, white): (impl Fn(f64) -> f64, f64),
) -> Vec<(usize, f64)> {
    let frame = fps.recip();
    // of a least-squares slope, per frame, and of the difference of two
    let n = side as f64;
    let error = MIN_TURN_ERRORS * noise * (24.0 / (n * (n * n - 1.0))).sqrt();
    let turn = |at: usize| {
        let sides = [&samples[at - side..at], &samples[at..at + side]];
        let [early, late] = sides.map(|side| Path::line(side, side[0].t));
        let off = early.largest_residual(sides[0]).max(late.largest_residual(sides[1]));
        let change = (late.velocity - early.velocity).norm();
        let is_corner = change > least(early.velocity.norm())
            && change * frame > error
            && off < MAX_RESIDUAL * change * frame + white;
        is_corner.then_some((at, change))
    };
    (side..(samples.len() + 1).saturating_sub(side)).filter_map(turn).collect()
}

/// Merges neighbouring places that see the same corner: the largest change is the right one.
fn largest<'a>(near: impl Iterator<Item = &'a (usize, f64)>) -> Option<usize> {
    near.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(at, _)| *at)
}
