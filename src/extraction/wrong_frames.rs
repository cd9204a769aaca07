//! Which frames of a body are wrong: those that stand out alone, before anything is fitted and from a fit.

use crate::measurement::track::Sample;
use crate::numerics::median;
use crate::trajectory::frames::{Frame, Frames};

/// A frame stands alone that is off by more than this many standard deviations…
const ALONE: f64 = 10.0;
/// …and by what its body may accelerate: a ball on a cloth by so much, m/s².
pub(crate) const ACCELERATION: f64 = 5.0;

/// A frame is wrong when a coordinate is this many standard deviations off the fit…
const OUTLIER: f64 = 5.0;
/// …and fewer than this many in a row are: more is a motion that the model does not know.
const RUN: usize = 3;

/// The median of the larger of two absolute normal deviates.
const MEDIAN_OF_LARGER: f64 = 1.05;

/// The samples without those that stand alone.
pub(crate) fn steady(samples: &[Sample], noise: f64, acceleration: f64) -> Vec<Sample> {
    let steady = (0..samples.len()).filter(|i| is_steady(samples, *i, noise, acceleration));
    steady.map(|i| samples[i]).collect()
}

/// The instants of the others.
pub(crate) fn alone(samples: &[Sample], noise: f64, acceleration: f64) -> Vec<f64> {
    let alone = (0..samples.len()).filter(|i| !is_steady(samples, *i, noise, acceleration));
    alone.map(|i| samples[i].t).collect()
}

/// Whether a sample fits the two before it or the two behind: at the impact itself a good one fits one side.
fn is_steady(samples: &[Sample], i: usize, noise: f64, acceleration: f64) -> bool {
    let fits = |s: &Sample, near: &Sample, far: &Sample| {
        let part = (s.t - near.t) / (near.t - far.t);
        let off = |s: f64, near: f64, far: f64| (s - near - (near - far) * part).abs();
        let most = ALONE * noise * (1.0 + part.abs()) + acceleration * (s.t - far.t).powi(2);
        off(s.x, near.x, far.x) <= most && off(s.y, near.y, far.y) <= most
    };
    let before = i >= 2 && fits(&samples[i], &samples[i - 1], &samples[i - 2]);
    before || i + 2 < samples.len() && fits(&samples[i], &samples[i + 1], &samples[i + 2])
}

/// Instants of the frames of either body that a fit shows to be wrong, from its residuals. These and `noise`, that of a
/// coordinate, are in standard deviations of the frames.
pub(crate) fn off_the_fit(frames: &Frames, residuals: &[f64], noise: f64) -> [Vec<f64>; 2] {
    let off: Vec<f64> = residuals.chunks(2).map(|xy| xy[0].abs().max(xy[1].abs())).collect();
    // the scatter by medians: wrong frames are not to hide each other
    let scatter = median(off.clone()) / MEDIAN_OF_LARGER;
    let far = OUTLIER * noise.max(scatter).max(1.0);
    let (first, second) = off.split_at(frames.of[0].len());
    [few_in_a_row(&frames.of[0], first, far), few_in_a_row(&frames.of[1], second, far)]
}

fn few_in_a_row(frames: &[Frame], off: &[f64], far: f64) -> Vec<f64> {
    let mut found = Vec::new();
    let mut i = 0;
    while i < off.len() {
        let run = off[i..].iter().take_while(|off| **off > far).count();
        if (1..RUN).contains(&run) {
            found.extend(frames[i..i + run].iter().map(|frame| frame.sample.t));
        }
        i += run.max(1);
    }
    found
}
