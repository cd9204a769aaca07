//! Dropped frames that frame numbers and times do not show: all later frames are then one early.
//!
//! A ball that moves evenly goes two or more steps at once there, as does the other ball if it
//! moves. A repeated frame, after which the ball catches up, is not a drop; nor is a long step at
//! the impact, whose length cannot be predicted.

use nalgebra::Vector2;

use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::median;

type Point = Vector2<f64>;

/// Number of steps on either side from which the length of a step is predicted.
const NEIGHBOURS: usize = 6;
/// The same number if the impact is among the others.
const NEIGHBOURS_AT_IMPACT: usize = 4;
/// Minimum number of known steps on either side.
const MIN_NEIGHBOURS: usize = 3;

/// Largest difference between a step and a multiple of the median step, in median steps.
const MAX_STEP_DEVIATION: f64 = 0.35;

/// Least median step for which steps can be compared, in units of their root mean square deviation.
const MIN_EVEN_NOISES: f64 = 4.0;

/// The same for a dropped frame: half a step more is then 3.5 standard deviations of one axis.
const MIN_DROP_NOISES: f64 = 5.0;

/// Maximum ratio of a step to the median step: longer drops show in the numbers.
const MAX_RATIO: f64 = 8.0;

/// Corrects the times of the frames after each drop; returns the number of drops.
pub(crate) fn repair(shot: &mut TrackShot) -> usize {
    let frame = shot.fps.recip();
    let mut found: Vec<(f64, f64)> = Vec::new();
    let steps = [&shot.cue, &shot.object].map(|samples| Steps::new(samples, frame));
    for (own, other) in [(0, 1), (1, 0)] {
        for i in 0..steps[own].lengths.len() {
            let Some(lost) = steps[own].long(i).lost else { continue };
            let from = steps[own].samples[i].t;
            let contradicts = |j: usize| {
                let other = &steps[other];
                let is_then = (other.samples[j].t - from).abs() < 0.5 * frame;
                is_then && matches!(other.at(j), Step { is_even: true, lost: None })
            };
            let known = found.iter().any(|(at, _)| (at - from).abs() < 0.5 * frame);
            if !known && !(0..steps[other].lengths.len()).any(contradicts) {
                found.push((from, lost));
            }
        }
    }
    let shift = |t: f64| -> f64 {
        let later = found.iter().filter(|(from, _)| t > from + 0.5 * frame);
        t + frame * later.map(|(_, lost)| lost).sum::<f64>()
    };
    for sample in shot.samples_mut() {
        sample.t = shift(sample.t);
    }
    found.len()
}

/// The step from a sample to the next.
#[derive(Default)]
struct Step {
    /// Whether the ball moves evenly, well above the noise, on both sides.
    is_even: bool,
    /// Number of frames that are missing in the step.
    lost: Option<f64>,
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

    /// Returns a step if it is longer than most on either side; others have lost no frame.
    fn long(&self, i: usize) -> Step {
        /// A step of two frames is at least 1.5 typical ones, and most steps lie within a fifth.
        const MIN_STEP_RATIO: f64 = 1.2;
        let Some(own) = self.lengths[i] else { return Step::default() };
        let around = i.saturating_sub(NEIGHBOURS)..self.lengths.len().min(i + 1 + NEIGHBOURS);
        let around: Vec<&Point> = self.lengths[around].iter().flatten().collect();
        let shorter = around.iter().filter(|other| MIN_STEP_RATIO * other.norm() < own.norm()).count();
        if 2 * shorter < around.len() { Step::default() } else { self.at(i) }
    }

    fn at(&self, i: usize) -> Step {
        let steps = [NEIGHBOURS, NEIGHBOURS_AT_IMPACT].map(|side| self.among(i, side));
        steps.into_iter().find(|step| step.is_even).unwrap_or_default()
    }

    /// Returns the step compared with `side` steps on either side.
    fn among(&self, i: usize, side: usize) -> Step {
        let lengths = &self.lengths;
        let Some(own) = lengths[i] else { return Step::default() };
        let sides = [&lengths[i.saturating_sub(side)..i], &lengths[i + 1..lengths.len().min(i + 1 + side)]];
        let sides = sides.map(|side| side.iter().copied().flatten().collect::<Vec<Point>>());
        if sides.iter().any(|side| side.len() < MIN_NEIGHBOURS) {
            return Step::default();
        }
        let of_side = sides.each_ref().map(|side| middle(side));
        let usual = (of_side[0] + of_side[1]) * 0.5;
        let off = sides.iter().zip(of_side).flat_map(|(side, usual)| side.iter().map(move |v| v - usual));
        let squares: Vec<f64> = off.map(|off| off.norm_squared()).collect();
        let noise = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        // even: equal medians on both sides, so that neighbours do not catch up
        let turns = (of_side[0] - of_side[1]).norm();
        let is_even = usual.norm() > MIN_EVEN_NOISES * noise && turns < MAX_STEP_DEVIATION * usual.norm();
        // the number of median steps in this one, and the remainder
        let whole = (own.dot(&usual) / usual.norm_squared()).round();
        let left = (own - usual * whole).norm();
        // at four standard deviations one step in a thousand looks like two
        let is_clear = usual.norm() > MIN_DROP_NOISES * noise;
        let lost = is_even
            && is_clear
            && (2.0..=MAX_RATIO).contains(&whole)
            && left < MAX_STEP_DEVIATION * usual.norm();
        Step { is_even, lost: lost.then_some(whole - 1.0) }
    }
}

/// Returns the medians of x and of y.
fn middle(steps: &[Point]) -> Point {
    let of_axis = |axis: usize| median(steps.iter().map(|step| step[axis]).collect());
    Point::new(of_axis(0), of_axis(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurement::spin::Spin;

    const FPS: f64 = 500.0;

    /// Two balls that move evenly; `shows` gives the instant, in frames, that each frame shows.
    fn shot(shows: impl Fn(usize) -> f64) -> TrackShot {
        let sample = |speed: f64, i: usize| {
            let noise = 1e-5 * (1.7 * i as f64).sin();
            Sample::new(i as f64 / FPS, [speed * shows(i) / FPS + noise, 0.1 - noise])
        };
        let samples = |speed: f64| (0..40).map(|i| sample(speed, i)).collect();
        TrackShot::new("", FPS, Spin::Stun, [samples(1.0), samples(0.7)])
    }

    #[test]
    fn what_is_lost_is_made_up_for() {
        let lost = |i: usize| f64::from(u8::from(i > 20)) + 2.0 * f64::from(u8::from(i > 30));
        let mut dropped = shot(|i| i as f64 + lost(i));
        assert_eq!(repair(&mut dropped), 2);
        for (sample, frame) in [(dropped.cue[20], 20.0), (dropped.object[21], 22.0), (dropped.cue[39], 42.0)]
        {
            assert!((sample.t - frame / FPS).abs() < 1e-12);
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
