//! Dropped frames that frame numbers and times do not show: all later frames are then one early.
//!
//! A ball that moves evenly goes two or more steps at once there, as does the other ball if it
//! moves. A repeated frame, after which the ball catches up, is not a drop; nor is a long step at
//! the impact, whose length cannot be predicted.

use nalgebra::Vector2;

use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::{SIGNIFICANT, median};

type Point = Vector2<f64>;

/// Numbers of steps on either side that predict a step, the second if the first spans the impact.
const NEIGHBOURS: [usize; 2] = [6, 4];
/// Smallest number of known steps on either side.
const MIN_NEIGHBOURS: usize = 3;

/// Largest difference between a step and a multiple of the median step, in median steps.
const MAX_STEP_DEVIATION: f64 = 0.35;

/// Least median step for which steps can be compared, in units of their root mean square deviation.
const MIN_EVEN_NOISES: f64 = 4.0;

/// Ratios of a step to the median step at a drop: longer drops show in the numbers.
const RATIOS: std::ops::RangeInclusive<f64> = 2.0..=8.0;

/// Corrects the times of the frames after each drop; returns the number of drops.
pub(crate) fn repair(shot: &mut TrackShot) -> usize {
    let frame = shot.fps.recip();
    // instant of the frame before a drop, s, and number of frames
    let mut drops: Vec<(f64, f64)> = Vec::new();
    let balls = [&shot.cue, &shot.object].map(|samples| Steps::new(samples, frame));
    for (own, other) in [(&balls[0], &balls[1]), (&balls[1], &balls[0])] {
        for i in 0..own.lengths.len() {
            let (Some(lost), from) = (own.lost(i), own.samples[i].t) else { continue };
            let is_then = |t: f64| (t - from).abs() < 0.5 * frame;
            // the other ball moves on evenly
            let contradicts = |j: usize| is_then(other.samples[j].t) && other.lost(j) == Some(0.0);
            let is_known = drops.iter().any(|(at, _)| is_then(*at));
            if lost > 0.0 && !is_known && !(0..other.lengths.len()).any(contradicts) {
                drops.push((from, lost));
            }
        }
    }
    for sample in shot.samples_mut() {
        let earlier = drops.iter().filter(|(from, _)| sample.t > from + 0.5 * frame);
        sample.t += frame * earlier.map(|(_, lost)| lost).sum::<f64>();
    }
    drops.len()
}

/// The steps of a ball; `None` if the next frame is missing.
struct Steps<'a> {
    samples: &'a [Sample],
    lengths: Vec<Option<Point>>,
}

impl<'a> Steps<'a> {
    fn new(samples: &'a [Sample], frame: f64) -> Self {
        let step = |two: &[Sample]| {
            let follows = (two[1].t - two[0].t - frame).abs() < 0.1 * frame;
            follows.then(|| Point::new(two[1].x - two[0].x, two[1].y - two[0].y))
        };
        Self { samples, lengths: samples.windows(2).map(step).collect() }
    }

    /// Returns the number of frames that are missing in a step of a ball that moves evenly, well
    /// above the noise, on both sides; `None` of others.
    fn lost(&self, i: usize) -> Option<f64> {
        NEIGHBOURS.into_iter().find_map(|side| self.lost_among(i, side))
    }

    /// Returns the same by `side` steps on either side.
    fn lost_among(&self, i: usize, side: usize) -> Option<f64> {
        let (before, after) = (&self.lengths[..i], &self.lengths[i + 1..]);
        let sides = [&before[i.saturating_sub(side)..], &after[..after.len().min(side)]];
        let sides = sides.map(|side| side.iter().copied().flatten().collect::<Vec<Point>>());
        if sides.iter().any(|side| side.len() < MIN_NEIGHBOURS) {
            return None;
        }
        let middles = sides.each_ref().map(|side| middle(side));
        let typical = (middles[0] + middles[1]) * 0.5;
        let length = typical.norm();
        let off = sides.iter().zip(middles).flat_map(|(side, middle)| side.iter().map(move |v| v - middle));
        let squares: Vec<f64> = off.map(|off| off.norm_squared()).collect();
        let noise = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        // equal medians on both sides, so that neighbours do not catch up
        let turns = (middles[0] - middles[1]).norm();
        if !(length > MIN_EVEN_NOISES * noise && turns < MAX_STEP_DEVIATION * length) {
            return None;
        }
        // the number of median steps in this one, and the remainder
        let step = self.lengths[i]?;
        let whole = (step.dot(&typical) / (length * length)).round();
        let is_drop = RATIOS.contains(&whole)
            && (step - typical * whole).norm() < MAX_STEP_DEVIATION * length
            // at four standard deviations one step in a thousand looks like two
            && length > SIGNIFICANT * noise;
        Some(if is_drop { whole - 1.0 } else { 0.0 })
    }
}

/// Returns the medians of x and of y.
fn middle(steps: &[Point]) -> Point {
    let median_along = |axis: usize| median(steps.iter().map(|step| step[axis]).collect());
    Point::new(median_along(0), median_along(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurement::spin::Spin;
    use crate::numerics::EXACT;

    /// Two balls that move evenly, with a frame a second; `shows` gives the instant that each
    /// shows.
    fn shot(shows: impl Fn(usize) -> f64) -> TrackShot {
        let sample = |speed: f64, i: usize| {
            let noise = 1e-5 * (1.7 * i as f64).sin();
            Sample::new(i as f64, [speed * shows(i) + noise, 0.1 - noise])
        };
        let samples = |speed: f64| (0..40).map(|i| sample(speed, i)).collect();
        TrackShot::new("", 1.0, Spin::Stun, [samples(2e-3), samples(1.4e-3)])
    }

    #[test]
    fn what_is_lost_is_made_up_for() {
        let lost = |i: usize| f64::from(u8::from(i > 20)) + 2.0 * f64::from(u8::from(i > 30));
        let mut dropped = shot(|i| i as f64 + lost(i));
        assert_eq!(repair(&mut dropped), 2);
        for (sample, frame) in [(dropped.cue[20], 20.0), (dropped.object[21], 22.0), (dropped.cue[39], 42.0)]
        {
            assert!((sample.t - frame).abs() < EXACT);
        }
    }

    #[test]
    fn what_is_no_drop_stays() {
        assert_eq!(repair(&mut shot(|i| i as f64)), 0);
        // a repeated frame, after which the ball catches up
        assert_eq!(repair(&mut shot(|i| if i == 20 { 19.0 } else { i as f64 })), 0);
        // a wrong frame of one ball
        let mut wrong = shot(|i| i as f64);
        wrong.cue[20].x += 2e-3;
        assert_eq!(repair(&mut wrong), 0);
    }
}
