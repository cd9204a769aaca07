//! The shots of a film with their faults repaired, before anything is fitted.

use rayon::prelude::*;

use crate::extraction::{leave_out_after_cushion, leave_out_before_cushion, noise_correlation};
use crate::film::drops;
use crate::film::frame_noise::noise;
use crate::measurement::dataset::{Measured, Tracks};
use crate::measurement::track::TrackShot;
use crate::numerics::median;
use crate::problem::findings::Finding;

/// Scatter of neighbouring frames, in units of the stated noise, that does not refute it.
const AS_STATED: std::ops::Range<f64> = 0.7..1.5;

/// Returns the shots of a film with their faults repaired as far as single tracks show them, and
/// what was found. The radius of the balls is in m.
pub(super) fn cleaned(tracks: &Tracks, radius: f64) -> (Vec<TrackShot>, Vec<Finding>) {
    let mut shots = tracks.shots.clone();
    let of = shots.len();
    let mut findings: Vec<Finding> = repair_drops(&mut shots).into_iter().collect();
    let corners =
        shots.par_iter_mut().filter_map(|shot| leave_out_before_cushion(shot).then_some(())).count();
    if corners > 0 {
        findings.push(Finding::Corners { shots: corners, of });
    }
    if let Some(Measured { value: rho, sd }) = noise_correlation(&shots) {
        findings.push(Finding::NoiseLasts { rho, sd: sd.unwrap_or(f64::NAN) });
        for shot in &mut shots {
            shot.correlation = rho;
        }
    }
    let ends =
        shots.par_iter_mut().filter_map(|shot| leave_out_after_cushion(shot, radius).then_some(())).count();
    if ends > 0 {
        findings.push(Finding::Ends { shots: ends, of });
    }
    if let Some(times) = refute_noise(&shots) {
        for shot in shots.iter_mut().filter(|_| times > 1.0) {
            shot.position_sd = None;
            shot.samples_mut().for_each(|sample| sample.sd = None);
        }
        findings.push(Finding::NoiseRefuted { times });
    }
    (shots, findings)
}

/// Moves the frames after dropped ones in time; says so if there are any.
pub(in crate::problem) fn repair_drops(shots: &mut [TrackShot]) -> Option<Finding> {
    let drops: Vec<usize> = shots.par_iter_mut().map(drops::repair).filter(|count| *count > 0).collect();
    (!drops.is_empty()).then(|| Finding::Drops { shots: drops.len(), drops: drops.iter().sum() })
}

/// Returns the scatter of neighbouring frames over the stated noise, if that refutes what is
/// stated.
fn refute_noise(shots: &[TrackShot]) -> Option<f64> {
    let of_shot = |shot: &TrackShot| {
        let samples = shot.cue.iter().chain(&shot.object);
        let of_samples = || median(samples.filter_map(|sample| sample.sd).flatten().collect());
        let stated = shot.position_sd.unwrap_or_else(of_samples);
        (stated > 0.0).then(|| noise(shot) / stated)
    };
    let times: Vec<f64> = shots.par_iter().filter_map(of_shot).collect();
    (!times.is_empty()).then(|| median(times)).filter(|times| !AS_STATED.contains(times))
}
