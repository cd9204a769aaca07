//! Frames that a camera dropped and that neither numbers nor times show: from there on everything happens one frame too early.
//!
//! A ball that moves evenly then goes two or more steps at once, and so does the other ball if it moves. A frame that stands twice, after
//! which the ball catches up, is none; nor is a step at the impact, where nothing says how far a ball should go.

use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::median;

/// Steps on either side that say how far a ball goes in a frame.
const SIDE: usize = 6;
/// Fewer of them, where the impact is among the others.
const NEAR_SIDE: usize = 4;
/// Of them, so many at least.
const LEAST: usize = 3;

/// A step of this many times the usual one, more or less, is one of so many frames.
const OFF: f64 = 0.35;

/// Steps are told apart that are so many times as long as the root mean square by which noise makes them uneven.
const NOISES: f64 = 4.0;

/// A frame is lost between steps that are so many times as long: half a step more is 3.5 standard deviations of one axis.
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
    lengths: Vec<Option<[f64; 2]>>,
}

impl<'a> Steps<'a> {
    fn new(samples: &'a [Sample], frame: f64) -> Self {
        let step = |two: &[Sample]| {
            let follows = (two[1].t - two[0].t - frame).abs() < 0.1 * frame;
            follows.then(|| [two[1].x - two[0].x, two[1].y - two[0].y])
        };
        Self { samples, lengths: samples.windows(2).map(step).collect() }
    }

    /// A step, if it is longer than most on either side: others have lost nothing.
    fn long(&self, i: usize) -> Step {
        /// A step of two frames is half as long again as the usual one at least, and most steps are within a fifth of that.
        const LONGER: f64 = 1.2;
        let square = |v: [f64; 2]| v[0] * v[0] + v[1] * v[1];
        let Some(own) = self.lengths[i] else { return Step::default() };
        let around = i.saturating_sub(SIDE)..self.lengths.len().min(i + 1 + SIDE);
        let (mut shorter, mut all) = (0, 0);
        for other in self.lengths[around].iter().flatten() {
            shorter += usize::from(LONGER * LONGER * square(*other) < square(own));
            all += 1;
        }
        if 2 * shorter < all { Step::default() } else { self.at(i) }
    }

    fn at(&self, i: usize) -> Step {
        let steps = [SIDE, NEAR_SIDE].map(|side| self.among(i, side));
        steps.into_iter().find(|step| step.is_even).unwrap_or_default()
    }

    /// The step against so many on either side.
    fn among(&self, i: usize, side: usize) -> Step {
        let lengths = &self.lengths;
        let Some(own) = lengths[i] else { return Step::default() };
        let before: Vec<[f64; 2]> = lengths[i.saturating_sub(side)..i].iter().copied().flatten().collect();
        let after: Vec<[f64; 2]> =
            lengths[i + 1..lengths.len().min(i + 1 + side)].iter().copied().flatten().collect();
        if before.len() < LEAST || after.len() < LEAST {
            return Step::default();
        }
        let (usual_before, usual_after) = (middle(&before), middle(&after));
        let length = |v: [f64; 2]| v[0].hypot(v[1]);
        let squares = |all: &[[f64; 2]], usual: [f64; 2]| -> f64 {
            all.iter().map(|v| length([v[0] - usual[0], v[1] - usual[1]]).powi(2)).sum()
        };
        let usual = [0, 1].map(|k| 0.5 * (usual_before[k] + usual_after[k]));
        let all = squares(&before, usual_before) + squares(&after, usual_after);
        let noise = (all / (before.len() + after.len()) as f64).sqrt();
        let turns = length([usual_before[0] - usual_after[0], usual_before[1] - usual_after[1]]);
        // the same on both sides, and neighbours that are no catching up
        let is_even = length(usual) > NOISES * noise && turns < OFF * length(usual);
        // how often the usual step goes into this one, and what is left across it
        let square = usual[0] * usual[0] + usual[1] * usual[1];
        let times = (own[0] * usual[0] + own[1] * usual[1]) / square;
        let whole = times.round();
        let left = length([own[0] - whole * usual[0], own[1] - whole * usual[1]]);
        // of steps of four noises one in a thousand looks like two
        let is_clear = length(usual) > CLEAR_NOISES * noise;
        let lost = is_even && is_clear && (2.0..=MOST).contains(&whole) && left < OFF * length(usual);
        Step { is_even, lost: lost.then_some(whole - 1.0) }
    }
}

/// The medians of x and of y.
fn middle(steps: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|axis| median(steps.iter().map(|step| step[axis]).collect()))
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::measurement::spin::Spin;

    const FPS: f64 = 500.0;

    /// Two balls that move evenly; the cue ball's frame is shown at the instants that `shows` gives, the numbers count on.
    fn shot(shows: impl Fn(usize) -> f64) -> TrackShot {
        let samples = |speed: f64| {
            let sample = |i: usize| {
                let noise = 1e-5 * (1.7 * i as f64).sin();
                Sample { t: i as f64 / FPS, x: speed * shows(i) / FPS + noise, y: 0.1 - noise, sd: None }
            };
            (0..40).map(sample).collect()
        };
        TrackShot::new("", FPS, Spin::Stun, [samples(1.0), samples(0.7)])
    }

    #[test]
    fn what_is_lost_is_made_up_for() {
        let mut dropped =
            shot(|i| i as f64 + if i > 20 { 1.0 } else { 0.0 } + if i > 30 { 2.0 } else { 0.0 });
        assert_eq!(repair(&mut dropped), 2);
        assert!((dropped.cue[20].t - 20.0 / FPS).abs() < 1e-12);
        assert!((dropped.object[21].t - 22.0 / FPS).abs() < 1e-12);
        assert!((dropped.cue[39].t - 42.0 / FPS).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_drop_stays() {
        let mut even = shot(|i| i as f64);
        assert_eq!(repair(&mut even), 0);
        // a frame that stands twice, and the next that catches up
        let mut twice = shot(|i| if i == 20 { 19.0 } else { i as f64 });
        assert_eq!(repair(&mut twice), 0);
        // a wrong frame of one ball
        let mut wrong = shot(|i| i as f64);
        wrong.cue[20].x += 2e-3;
        assert_eq!(repair(&mut wrong), 0);
    }
}
