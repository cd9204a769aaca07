//! The shots of a film with their faults repaired, before anything is fitted.

use rayon::prelude::*;

use crate::extraction::{leave_out_after_cushion, leave_out_before_cushion, noise_correlation};
use crate::film::drops;
use crate::film::frame_noise::noise;
use crate::measurement::dataset::Tracks;
use crate::measurement::track::TrackShot;
use crate::numerics::median;
use crate::physics::ball::Ball;
use crate::problem::findings::Finding;

/// Scatter of neighbouring frames, in units of the stated noise, that does not refute it.
const AS_STATED: std::ops::Range<f64> = 0.7..1.5;

/// The shots of a film with their faults repaired as far as single tracks show them.
pub(super) struct Cleaned {
    pub(crate) shots: Vec<TrackShot>,
    /// Correlation of the noise of neighbouring frames.
    pub(crate) rho: f64,
    pub(crate) findings: Vec<Finding>,
    pub(crate) left_out: Vec<(String, String)>,
}

impl Cleaned {
    pub fn new(tracks: &Tracks, ball: &Ball) -> Self {
        let mut shots = tracks.shots.clone();
        let of = shots.len();
        let mut findings: Vec<Finding> = repair_drops(&mut shots).into_iter().collect();
        let count = |shots: &mut [TrackShot], repair: fn(&mut TrackShot, &Ball) -> bool| {
            shots.par_iter_mut().map(|shot| usize::from(repair(shot, ball))).sum::<usize>()
        };
        let corners = count(&mut shots, leave_out_before_cushion);
        if corners > 0 {
            findings.push(Finding::Corners { shots: corners, of });
        }
        let lasting = noise_correlation(&shots, ball).filter(|found| found.adopted);
        findings.extend(lasting.map(|found| Finding::NoiseLasts { rho: found.value, sd: found.std_error }));
        let rho = lasting.map_or(0.0, |found| found.value);
        for shot in &mut shots {
            shot.correlation = rho;
        }
        let ends = count(&mut shots, leave_out_after_cushion);
        if ends > 0 {
            findings.push(Finding::Ends { shots: ends, of });
        }
        let left_out = tracks.left_out.clone();
        if let Some(times) = refute_noise(&shots) {
            if times > 1.0 {
                for shot in &mut shots {
                    shot.position_sd = None;
                    shot.samples_mut().for_each(|sample| sample.sd = None);
                }
            }
            findings.push(Finding::NoiseRefuted { times });
        }
        Self { shots, rho, findings, left_out }
    }
}

/// Moves the frames after dropped ones in time; says so if there are any.
pub(in crate::problem) fn repair_drops(shots: &mut [TrackShot]) -> Option<Finding> {
    let drops: Vec<usize> = shots.par_iter_mut().map(drops::repair).filter(|count| *count > 0).collect();
    (!drops.is_empty()).then(|| Finding::Drops { shots: drops.len(), drops: drops.iter().sum() })
}

/// Returns the scatter of neighbouring frames over the stated noise, if that refutes what is stated.
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
