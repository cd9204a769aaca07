//! Frames that were dropped next to an impact. No ball moves evenly there, so that only the collision tells: with the drop made up for, one
//! motion fits the frames on both sides, and without it none does.

use rayon::prelude::*;

use super::{Impact, Unusable, extract, initial_guess};
use crate::measurement::track::{TrackShot, isolated};
use crate::trajectory::scene::Scene;

/// So many frames on either side of the impact have no even neighbours on both sides.
const NEAR: f64 = 8.0;

/// A motion fits within this χ²/dof, beside the noise that second differences show…
const FITS: f64 = 2.0;
/// …and a drop is made up for where so many times as many frames then fit.
const MORE: f64 = 1.3;

/// Makes up for a frame that was dropped next to the impact, in shots that no motion fits well; how many there are.
pub fn repair_drops_at_impacts(shots: &mut [TrackShot], scene: &Scene) -> usize {
    let repaired = shots.par_iter_mut().map(|shot| {
        let found = isolated(|| repaired(shot, scene)).ok().flatten();
        found.map(|better| *shot = better).is_some()
    });
    repaired.filter(|repaired| *repaired).count()
}

/// How many frames a motion fits.
fn fitting(impact: &Result<Impact, Unusable>) -> f64 {
    match impact {
        Ok(impact) if impact.reduced_chi2 < FITS => impact.frames.iter().sum::<usize>() as f64,
        _ => 0.0,
    }
}

fn repaired(shot: &TrackShot, scene: &Scene) -> Option<TrackShot> {
    let as_it_is = fitting(&extract(shot, scene));
    let frames = shot.cue.len() as f64;
    // where most frames fit nothing is amiss
    if as_it_is > frames {
        return None;
    }
    let instant = initial_guess::instant(shot, scene)?;
    let frame = shot.fps.recip();
    let near = shot.cue.iter().map(|sample| sample.t).filter(|t| (t - instant).abs() < NEAR * frame);
    let candidates = near.map(|from| later(shot, from + 0.5 * frame));
    let scored = candidates.map(|candidate| (fitting(&extract(&candidate, scene)), candidate));
    let (score, best) = scored.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (score > MORE * as_it_is.max(1.0)).then_some(best)
}

/// With everything after an instant one frame later.
fn later(shot: &TrackShot, from: f64) -> TrackShot {
    let mut shot = shot.clone();
    let frame = shot.fps.recip();
    for sample in shot.samples_mut().filter(|sample| sample.t > from) {
        sample.t += frame;
    }
    shot
}
