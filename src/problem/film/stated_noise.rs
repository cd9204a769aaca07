//! Noise that is stated, against what neighbouring frames scatter by.

use rayon::prelude::*;

use crate::film::frame_noise::noise;
use crate::measurement::track::TrackShot;
use crate::numerics::median;

/// Scatter of neighbouring frames, in units of the stated noise, that does not refute it.
const AS_STATED: std::ops::Range<f64> = 0.7..1.5;

/// Returns the scatter of neighbouring frames over the stated noise, if that refutes what is stated.
pub(super) fn refuted(shots: &[TrackShot]) -> Option<f64> {
    let of_shot = |shot: &TrackShot| {
        let samples = shot.cue.iter().chain(&shot.object);
        let of_samples = || median(samples.filter_map(|sample| sample.sd).flatten().collect());
        let stated = shot.position_sd.unwrap_or_else(of_samples);
        (stated > 0.0).then(|| noise(shot) / stated)
    };
    let found: Vec<f64> = shots.par_iter().filter_map(of_shot).collect();
    (!found.is_empty()).then(|| median(found)).filter(|times| !AS_STATED.contains(times))
}

/// Forgets the noise that is stated.
pub(super) fn forget(shots: &mut [TrackShot]) {
    for shot in shots {
        shot.position_sd = None;
        shot.samples_mut().for_each(|sample| sample.sd = None);
    }
}
