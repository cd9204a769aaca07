//! The shots of a film with their faults repaired, before anything is fitted.

use rayon::prelude::*;

use crate::extraction::{leave_out_after_cushion, leave_out_before_cushion, noise_correlation, object_speed};
use crate::film::drops;
use crate::film::frame_noise::noise;
use crate::measurement::dataset::Tracks;
use crate::measurement::track::TrackShot;
use crate::numerics::median;
use crate::physics::ball::Ball;
use crate::problem::findings::Finding;

/// Number of shots below which each is judged alone, and part of the shots from which on moving object
/// balls are not an accident of one.
const MIN_SHOTS: usize = 6;
const MANY: f64 = 0.5;

/// Parts of the cue ball's speed: less hardly matters, and a ball that is faster is the cue ball.
const MIN_SPEED_PART: f64 = 0.003;
const MAX_SPEED_PART: f64 = 0.2;

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
        let mut left_out = tracks.left_out.clone();
        leave_out_moving(&mut shots, tracks.from_balls, &mut left_out);
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

/// Leaves out all shots if the object balls of most move significantly before the impact, as those of the
/// others then do, too; adds their names and reasons to `left_out`.
fn leave_out_moving(shots: &mut Vec<TrackShot>, from_balls: bool, left_out: &mut Vec<(String, String)>) {
    let count = shots.len();
    let speeds: Vec<Option<(f64, f64)>> =
        shots.par_iter().map(|shot| object_speed(shot, MAX_SPEED_PART)).collect();
    let matter = speeds.iter().flatten().filter(|(_, part)| *part > MIN_SPEED_PART).count();
    if count < MIN_SHOTS || matter as f64 <= MANY * count as f64 {
        return;
    }
    let moving = speeds.iter().flatten().count();
    for (shot, speed) in shots.drain(..).zip(speeds) {
        let was = match speed {
            Some((speed, _)) if !from_balls => format!("was moving before the impact, with {speed:.3} m/s"),
            Some(_) => "was moving before the impact".to_owned(),
            None => "may have been moving before the impact".to_owned(),
        };
        let reason = format!(
            "the object ball {was}, as in {moving} of {count} shots: let it come to rest first, on a table \
             that is level"
        );
        left_out.push((shot.name, reason));
    }
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
