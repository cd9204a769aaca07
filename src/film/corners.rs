//! The part of each path that belongs to a shot: balls that come off a cushion, or off another
//! ball, shortly before or after the impact have a corner in their path.

use super::frame_noise::noise;
use super::meeting::{Meeting, arriving, line, residuals};
use super::unusable::Bodies;
use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::SIGNIFICANT;

/// Frames on either side of a corner with a line each; longer lines show gentler corners.
const SIDE_FRAMES: usize = 4;
const LONG_SIDE_FRAMES: usize = 12;

/// Least change of velocity at a corner before the impact, as a part of the speed after it. At 100
/// frames per second and 1 m/s the cloth changes the velocity by less than 2 % in as many frames.
const MIN_TURN: f64 = 0.2;

/// Least change of velocity at a corner, in standard errors of the difference of two slopes.
const MIN_TURN_ERRORS: f64 = 8.0;

/// Largest distance from the lines, as a part of the change of velocity times a frame: a frame that
/// was dropped within a side leaves 0.75 or more.
const MAX_CORNER_RESIDUAL: f64 = 0.5;

/// Frames next to the impact that are not searched for a corner: a tracker may lag as long.
const LAG_FRAMES: f64 = 8.0;

/// Least change of velocity at a corner after the impact, as a part of the incoming speed: a ball
/// that lands loses less than 0.015.
const MIN_TURN_AFTER: f64 = 0.03;

/// Steepest deceleration by a cloth, m/s²: a sliding friction of 0.4.
const MAX_DECELERATION: f64 = 4.0;

/// Removes the cue ball's frames up to the last corner before the impact, in the last of which it
/// may still touch the cushion or ball that turned it; returns whether a corner exists.
pub(crate) fn leave_out_before_cushion(shot: &mut TrackShot) -> bool {
    let before = arriving(shot);
    let least = |speed: f64| MIN_TURN * speed;
    let corner = corner(before, SIDE_FRAMES, (shot.fps, noise(shot)), (least, 0.0), <[Corner]>::last);
    let Some(until) = corner.map(|corner| before[corner].t) else { return false };
    shot.cue.retain(|sample| sample.t > until);
    true
}

/// Removes a ball's frames from the first corner after the impact on; returns whether one exists.
/// The radius of the balls is in m.
pub(crate) fn leave_out_after_cushion(shot: &mut TrackShot, radius: f64) -> bool {
    let Ok(meeting) = Meeting::find(shot, Bodies::Balls) else { return false };
    // correlated noise bends paths more
    let noise = noise(shot) * shot.frames_alike().sqrt();
    let fps = shot.fps;
    let incoming = meeting.before(0)[1].norm();
    let cloth = MAX_DECELERATION * meeting.relative(0)[0].norm() / (2.0 * radius);
    let first = |samples: &[Sample], side: usize| {
        let after = &samples[samples.partition_point(|sample| sample.t < meeting.time + LAG_FRAMES / fps)..];
        let least = |_| (MIN_TURN_AFTER * incoming).max(cloth * side as f64 / fps);
        let limits = (least, SIGNIFICANT * noise);
        // in the frame before it the ball may touch already
        Some(after[corner(after, side, (fps, noise), limits, <[Corner]>::first)? - 1].t)
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

/// Returns the index of the first frame after the corner of a path that is picked among all,
/// between lines through `side` frames on either side, with a change of velocity (m/s) of at least
/// `least` of the speed afterwards; `white` is the largest residual (m) of the lines in excess of
/// the part that the change explains.
fn corner(
    samples: &[Sample],
    side: usize,
    (fps, noise): (f64, f64),
    (least, white): (impl Fn(f64) -> f64, f64),
    pick: fn(&[Corner]) -> Option<&Corner>,
) -> Option<usize> {
    // of a least-squares slope, per frame, and of the difference of two
    let n = side as f64;
    let error = MIN_TURN_ERRORS * noise * (24.0 / (n * (n * n - 1.0))).sqrt();
    let turn = |at: usize| {
        let sides = [&samples[at - side..at], &samples[at..at + side]];
        let lines = sides.map(|side| line(side, side[0].t));
        let change = (lines[1][1] - lines[0][1]).norm();
        if !(change > least(lines[1][1].norm()) && change / fps > error) {
            return None;
        }
        let off = sides.into_iter().zip(lines).flat_map(|(side, line)| residuals(line, side[0].t, side));
        let is_corner = off.fold(0.0, f64::max) < MAX_CORNER_RESIDUAL * change / fps + white;
        is_corner.then_some(Corner { at, change })
    };
    let corners: Vec<Corner> = (side..(samples.len() + 1).saturating_sub(side)).filter_map(turn).collect();
    // it is seen at neighbouring places, too: the largest change is the right one
    let place = pick(&corners)?.at;
    let near = corners.iter().filter(|corner| corner.at.abs_diff(place) < side);
    near.max_by(|a, b| a.change.total_cmp(&b.change)).map(|corner| corner.at)
}
