//! Noise that was stated, against what neighbouring frames scatter by.

use rayon::prelude::*;

use crate::film::frame_noise::noise;
use crate::measurement::track::TrackShot;
use crate::numerics::median;

/// Frames that scatter by so many times the stated noise refute it.
const TOO_SMALL: f64 = 1.5;

/// The noise of neighbouring frames over what is stated of it; `None` where nothing is stated.
pub(super) fn over_stated(shots: &[TrackShot]) -> Option<f64> {
    let of_shot = |shot: &TrackShot| {
        let of_samples =
            || shot.cue.iter().chain(&shot.object).filter_map(|sample| sample.sd).flatten().collect();
        let stated = shot.position_sd.unwrap_or_else(|| median(of_samples()));
        (stated > 0.0).then(|| noise(shot) / stated)
    };
    let found: Vec<f64> = shots.par_iter().filter_map(of_shot).collect();
    (!found.is_empty()).then(|| median(found))
}

/// Lets the frames tell their noise where they refute what is stated.
pub(super) fn replace(shots: &mut [TrackShot], over_stated: f64) {
    if over_stated < TOO_SMALL {
        return;
    }
    for shot in shots {
        shot.position_sd = None;
        shot.samples_mut().for_each(|sample| sample.sd = None);
    }
}

/// What was done, and why.
pub(super) fn sentence(over_stated: f64) -> Option<String> {
    (over_stated > TOO_SMALL).then(|| {
        format!(
            "Neighbouring frames scatter by {over_stated:.1} times the stated noise (position_sd_m, or the columns of standard deviations): what \
             they scatter by was taken in its place."
        )
    })
}
