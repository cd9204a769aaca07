//! Dropped frames that frame numbers and times do not show: all later frames are then one early.
//!
//! A ball that moves evenly goes two or more steps at once there, as does the other ball if it
//! moves. A repeated frame, after which the ball catches up, is not a drop; nor is a long step at
//! the impact, whose length cannot be predicted.

use super::meeting::{line, residuals};
use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::SIGNIFICANT;

/// Numbers of frames on either side that predict a step, the second if the first spans the impact,
/// and the least number.
const SIDES: [usize; 2] = [7, 5];
const MIN_SIDE: usize = 4;

/// Ratio of a step to the one before it from which on it may be several.
const MIN_JUMP: f64 = 1.5;

/// Largest difference between a step and a multiple of the typical step, in typical steps.
const MAX_STEP_DEVIATION: f64 = 0.35;

/// Ratios of a step to the typical step at a drop: longer drops show in the numbers.
const RATIOS: std::ops::RangeInclusive<f64> = 2.0..=8.0;

/// Corrects the times of the frames after each drop; returns the number of drops.
pub(crate) fn repair(shot: &mut TrackShot) -> usize {
    let frame = shot.fps.recip();
    // instant of the frame before a drop, s, and number of frames
    let mut drops: Vec<(f64, f64)> = Vec::new();
    for (own, other) in [(&shot.cue, &shot.object), (&shot.object, &shot.cue)] {
        let step = |i: usize| (own[i + 1].x - own[i].x).hypot(own[i + 1].y - own[i].y);
        for i in (1..own.len().saturating_sub(1)).filter(|i| step(*i) > MIN_JUMP * step(i - 1)) {
            let is_then = |t: f64| (t - own[i].t).abs() < 0.5 * frame;
            // the other ball moves on evenly
            let contradicts = |j: usize| is_then(other[j].t) && count_lost(other, j, frame) == Some(0.0);
            let is_known = drops.iter().any(|(at, _)| is_then(*at));
            if let Some(lost) = count_lost(own, i, frame).filter(|lost| *lost > 0.0)
                && !is_known
                && !(0..other.len()).any(contradicts)
            {
                drops.push((own[i].t, lost));
            }
        }
    }
    for sample in shot.samples_mut() {
        let earlier = drops.iter().filter(|(from, _)| sample.t > from + 0.5 * frame);
        sample.t += frame * earlier.map(|(_, lost)| lost).sum::<f64>();
    }
    drops.len()
}

/// Returns the number of frames that are missing after frame `i` of a ball that moves evenly, well
/// above the noise, on both sides; `None` of others, or if the next frame is missing.
fn count_lost(samples: &[Sample], i: usize, frame: f64) -> Option<f64> {
    let (early, late) = samples.split_at(i + 1);
    let times = [early.last()?.t, late.first()?.t];
    let is_next = (times[1] - times[0] - frame).abs() < 0.1 * frame;
    SIDES.into_iter().filter(|_| is_next).find_map(|side| {
        let sides = [&early[early.len().saturating_sub(side)..], &late[..late.len().min(side)]];
        if sides.iter().any(|side| side.len() < MIN_SIDE) {
            return None;
        }
        // both lines at the frames between which a frame may be missing
        let lines = [0, 1].map(|i| line(sides[i], times[i]));
        let squares = (0..2).flat_map(|i| residuals(lines[i], times[i], sides[i])).map(|off| off * off);
        // two numbers determine each line
        let freedom = (sides[0].len() + sides[1].len() - 4) as f64;
        // of a step, the difference of two places
        let noise = (2.0 * squares.sum::<f64>() / freedom).sqrt();
        let [before, after] = lines.map(|[_, velocity]| velocity * frame);
        let typical = (before + after) * 0.5;
        let length = typical.norm();
        // even steps on both sides, so that neighbours do not catch up; at four standard deviations
        // one step in a thousand looks like two
        if !(length > SIGNIFICANT * noise && (before - after).norm() < MAX_STEP_DEVIATION * length) {
            return None;
        }
        // the number of typical steps in this one, and the remainder
        let step = lines[1][0] - lines[0][0];
        let whole = (step.dot(&typical) / (length * length)).round();
        let is_drop =
            RATIOS.contains(&whole) && (step - typical * whole).norm() < MAX_STEP_DEVIATION * length;
        Some(if is_drop { whole - 1.0 } else { 0.0 })
    })
}
