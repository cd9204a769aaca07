//! Frames that a camera dropped and that neither numbers nor times show: from there on everything happens one
//! frame too early.
//!
//! A ball that moves evenly then goes two or more steps at once, and so does the other ball if it moves. A
//! frame that stands twice, after which the ball catches up, is none; nor is a step at the impact, where
//! nothing says how far a ball should go.

use nalgebra::Vector2;

use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::median;

type Point = Vector2<f64>;

/// Steps on either side that say how far a ball goes in a frame.
const SIDE: usize = 6;
/// Fewer of them, where the impact is among the others.
const NEAR_SIDE: usize = 4;
/// Of them, so many at least.
const LEAST: usize = 3;

/// A step of this many times the usual one, more or less, is one of so many frames.
const OFF: f64 = 0.35;

/// Steps are told apart that are so many times as long as the root mean square by which noise makes them
/// uneven.
const NOISES: f64 = 4.0;

/// A frame is lost between steps that are so many times as long: half a step more is 3.5 standard deviations
/// of one axis.
const CLEAR_NOISES: f64 = 5.0;

/// No more frames are lost at once without a sign in the numbers.
const MOST: f64 = 8.0;

/// Puts the frames after each drop where they belong in time; how many drops there were.
pub fn repair(shot: &mut TrackShot) -> usize {
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

/// From a sample to the next.
#[derive(Default)]
struct Step {
    /// The ball moves by steps that are well above the noise on both sides.
    is_even: bool,
    /// How many frames are missing in it.
    lost: Option<f64>,
}

/// The steps of a ball; `None` where the next frame is missing.
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

    /// Returns a step, if it is longer than most on either side: others have lost nothing.
    fn long(&self, i: usize) -> Step {
        /// A step of two frames is half as long again as the usual one at least, and most steps are within a
        /// fifth of that.
        const LONGER: f64 = 1.2;
        let Some(own) = self.lengths[i] else { return Step::default() };
        let around = i.saturating_sub(SIDE)..self.lengths.len().min(i + 1 + SIDE);
        let around: Vec<&Point> = self.lengths[around].iter().flatten().collect();
        let shorter = around.iter().filter(|other| LONGER * other.norm() < own.norm()).count();
        if 2 * shorter < around.len() { Step::default() } else { self.at(i) }
    }

    fn at(&self, i: usize) -> Step {
        let steps = [SIDE, NEAR_SIDE].map(|side| self.among(i, side));
        steps.into_iter().find(|step| step.is_even).unwrap_or_default()
    }

    /// Returns the step against so many on either side.
    fn among(&self, i: usize, side: usize) -> Step {
        let lengths = &self.lengths;
        let Some(own) = lengths[i] else { return Step::default() };
        let sides = [&lengths[i.saturating_sub(side)..i], &lengths[i + 1..lengths.len().min(i + 1 + side)]];
        let sides = sides.map(|side| side.iter().copied().flatten().collect::<Vec<Point>>());
        if sides.iter().any(|side| side.len() < LEAST) {
            return Step::default();
        }
        let of_side = sides.each_ref().map(|side| middle(side));
        let usual = (of_side[0] + of_side[1]) * 0.5;
        let off = sides.iter().zip(of_side).flat_map(|(side, usual)| side.iter().map(move |v| v - usual));
        let squares: Vec<f64> = off.map(|off| off.norm_squared()).collect();
        let noise = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        // the same on both sides, and neighbours that are no catching up
        let turns = (of_side[0] - of_side[1]).norm();
        let is_even = usual.norm() > NOISES * noise && turns < OFF * usual.norm();
        // how often the usual step goes into this one, and what is left across it
        let whole = (own.dot(&usual) / usual.norm_squared()).round();
        let left = (own - usual * whole).norm();
        // of steps of four noises one in a thousand looks like two
        let is_clear = usual.norm() > CLEAR_NOISES * noise;
        let lost = is_even && is_clear && (2.0..=MOST).contains(&whole) && left < OFF * usual.norm();
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

    /// Two balls that move evenly; each frame shows them where they are at the instant that `shows` gives.
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
        // a frame that stands twice, and the next that catches up
        assert_eq!(repair(&mut shot(|i| if i == 20 { 19.0 } else { i as f64 })), 0);
        // a wrong frame of one ball
        let mut wrong = shot(|i| i as f64);
        wrong.cue[20].x += 2e-3;
        assert_eq!(repair(&mut wrong), 0);
    }
}
