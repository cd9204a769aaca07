//! Frames of a ball that stand out alone, before anything is fitted.

use crate::measurement::track::Sample;

/// Residual of a wrong frame, in standard deviations, in excess of the largest acceleration.
const ALONE: f64 = 10.0;

/// Largest acceleration of a ball on a cloth, m/s².
const ACCELERATION: f64 = 5.0;

/// Returns the samples without those that stand alone.
pub(super) fn steady(samples: &[Sample], noise: f64) -> Vec<Sample> {
    (0..samples.len()).filter(|i| is_steady(samples, *i, noise)).map(|i| samples[i]).collect()
}

/// Returns whether a sample fits the two before or after it, as a good one at the impact does.
fn is_steady(samples: &[Sample], i: usize, noise: f64) -> bool {
    let fits = |s: &Sample, near: &Sample, far: &Sample| {
        let part = (s.t - near.t) / (near.t - far.t);
        let off = |s: f64, near: f64, far: f64| (s - near - (near - far) * part).abs();
        let most = ALONE * noise * (1.0 + part.abs()) + ACCELERATION * (s.t - far.t).powi(2);
        off(s.x, near.x, far.x) <= most && off(s.y, near.y, far.y) <= most
    };
    let before = i >= 2 && fits(&samples[i], &samples[i - 1], &samples[i - 2]);
    before || i + 2 < samples.len() && fits(&samples[i], &samples[i + 1], &samples[i + 2])
}
