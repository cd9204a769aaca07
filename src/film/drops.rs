//! Dropped frames that frame numbers and times do not show: all later frames are then one early; and
//! frames that were put in, after which all are one late.
//!
//! A ball that moves evenly goes two or more steps at once where a frame was dropped, as does the
//! other ball if it moves. Where one was put in, which is a gap, it goes one step in two frames. A
//! repeated frame, after which the ball catches up, is neither; nor is a long step at the impact,
//! whose length cannot be predicted.

use super::meeting::{line, residuals};
use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::SIGNIFICANT;

/// Numbers of frames on either side that predict a step, the second if the first spans the impact,
/// and the least number.
const SIDES: [usize; 2] = [7, 5];
const MIN_SIDE: usize = 4;

/// A step that is longer or shorter than at the speed before it by this part of a frame's may be of
/// another number of frames.
const MIN_JUMP: f64 = 0.5;

/// Largest difference between a step and a multiple of the typical step, in typical steps.
const MAX_STEP_DEVIATION: f64 = 0.35;

/// Numbers of frames that were dropped at a place, or put in (below 0): longer drops show in the
/// numbers.
const LOST: std::ops::RangeInclusive<f64> = -2.0..=7.0;

/// Corrects the times of the frames after dropped ones, and after those that were put in, which are
/// left out; returns the number of such places.
pub(crate) fn repair(shot: &mut TrackShot) -> usize {
    let frame = shot.fps.recip();
    // instant of the frame before such a place, s, and number of frames
    let mut drops: Vec<(f64, f64)> = Vec::new();
    for (own, other) in [(&shot.cue, &shot.object), (&shot.object, &shot.cue)] {
        let step = |i: usize| (own[i + 1].x - own[i].x).hypot(own[i + 1].y - own[i].y);
        let frames = |i: usize| ((own[i + 1].t - own[i].t) / frame).round();
        let jumps = |i: &usize| (step(*i) * frames(i - 1) / step(i - 1) - frames(*i)).abs() > MIN_JUMP;
        for i in (1..own.len().saturating_sub(1)).filter(jumps) {
            let is_then = |t: f64| (t - own[i].t).abs() < 0.5 * frame;
            // the other ball moves on evenly
            let contradicts = |j: usize| is_then(other[j].t) && count_lost(other, j, frame) == Some(0.0);
            let is_known = drops.iter().any(|(at, _)| is_then(*at));
            if let Some(lost) = count_lost(own, i, frame).filter(|lost| *lost != 0.0)
                && !is_known
                && !(0..other.len()).any(contradicts)
            {
                drops.push((own[i].t, lost));
            }
        }
    }
    for samples in shot.tracks_mut() {
        let is_put_in =
            |t: f64| drops.iter().any(|(from, lost)| (0.5..0.5 - lost).contains(&((t - from) / frame)));
        samples.retain(|sample| !is_put_in(sample.t));
        for sample in samples {
            let earlier = drops.iter().filter(|(from, _)| sample.t > from + 0.5 * frame);
            sample.t += frame * earlier.map(|(_, lost)| lost).sum::<f64>();
        }
    }
    drops.len()
}

/// Returns the number of frames that were dropped after frame `i` of a ball that moves evenly, well
/// above the noise, on both sides, less those that were put in; `None` of others, or in a longer gap.
fn count_lost(samples: &[Sample], i: usize, frame: f64) -> Option<f64> {
    let (early, late) = samples.split_at(i + 1);
    let times = [early.last()?.t, late.first()?.t];
    let elapsed = ((times[1] - times[0]) / frame).round();
    let is_near =
        elapsed <= 1.0 - LOST.start() && (times[1] - times[0] - elapsed * frame).abs() < 0.1 * frame;
    SIDES.into_iter().filter(|_| is_near).find_map(|side| {
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
        let (lost, rest) = (whole - elapsed, (step - typical * whole).norm());
        let is_clear = whole > 0.0 && LOST.contains(&lost) && rest < MAX_STEP_DEVIATION * length;
        Some(if is_clear { lost } else { 0.0 })
    })
}
