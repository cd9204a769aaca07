//! Frames and shots that fit no collision, by the tail probability of their whitened residuals.

use std::sync::Arc;

use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::block::FilmBlock;
use super::own::{self, OWN};
use crate::numerics::median;
use crate::problem::frames::Sight;
use crate::problem::policy::Policy;
use crate::problem::sums::Contribution;
use crate::problem::unknowns::{Own, Shared};

/// Frames of a block at the end of a track that is judged as a whole: a collision at the end is
/// lost in a single frame.
const BLOCK: usize = 6;

/// Frames of a ball on one side of the impact that are always kept.
const LEAST_FRAMES: usize = 4;

/// Median of χ² with 2 degrees of freedom.
const MEDIAN_OF_TWO: f64 = 1.386;

/// Returns the probability that χ² of `dof` degrees of freedom exceeds `chi2`.
pub(crate) fn tail(chi2: f64, dof: f64) -> f64 {
    ChiSquared::new(dof).map_or(1.0, |distribution| distribution.sf(chi2))
}

/// Leaves out frames that stand out alone, and those at the ends of tracks from where on the ball
/// is not on its path any more; returns how many.
pub(crate) fn leave_out_frames(film: &mut FilmBlock, own: &[Own], shared: &Shared, policy: &Policy) -> usize {
    let judge = |i: usize| {
        let (shot, spin) = (&film.shots[i], &film.spins[i]);
        let bodies = shot.sights(&own[i], shared, &spin.stated, film.world(i));
        bodies.map(|frames| outlying(&frames, own[i][own::TIME], policy))
    };
    let found: Vec<[Vec<usize>; 2]> = (0..film.shots.len()).into_par_iter().map(judge).collect();
    let count = found.iter().flatten().map(Vec::len).sum();
    if count > 0 {
        let shots = Arc::make_mut(&mut film.shots);
        for (shot, found) in shots.iter_mut().zip(found) {
            for (track, indices) in shot.tracks.iter_mut().zip(found) {
                for index in indices {
                    track[index].used = false;
                }
            }
        }
    }
    count
}

/// Returns the indices of the frames of one ball that are left out.
pub(crate) fn outlying<const R: usize>(frames: &[Sight<R>], instant: f64, policy: &Policy) -> Vec<usize> {
    // by the median, so that wrong frames do not hide each other
    let scale = (median(frames.iter().map(Sight::square).collect()) / MEDIAN_OF_TWO).max(1.0);
    let first_after = frames.partition_point(|frame| frame.time < instant);
    let sum = |frames: &[Sight<R>]| frames.iter().map(|frame| frame.square().min(1e6)).sum::<f64>() / scale;
    let is_off = |frames: &[Sight<R>]| tail(sum(frames), 2.0 * frames.len() as f64) < policy.frame_tail;
    let (mut from, mut to) = (0, frames.len());
    while to > first_after + LEAST_FRAMES + BLOCK && is_off(&frames[to - BLOCK..to]) {
        to -= BLOCK;
    }
    while from + LEAST_FRAMES + BLOCK < first_after && is_off(&frames[from..from + BLOCK]) {
        from += BLOCK;
    }
    let ends = frames[..from].iter().chain(&frames[to..]);
    let alone = frames[from..to].iter().filter(|frame| is_off(std::slice::from_ref(frame)));
    ends.chain(alone).map(|frame| frame.index).collect()
}

/// Returns whether each shot is kept: its residuals are not larger than chance makes them in units
/// of what is typical of the shots.
pub(crate) fn judge_shots(shots: &[Contribution], policy: &Policy) -> Vec<bool> {
    let reduced = |shot: &Contribution| {
        let count: f64 = shot.noises.iter().map(|noise| noise.count).sum();
        let dof = (count - OWN as f64).max(1.0);
        let square: f64 = shot.noises.iter().map(|noise| noise.weighted).sum();
        (square, dof)
    };
    let all: Vec<(f64, f64)> = shots.iter().map(reduced).collect();
    let typical = median(all.iter().map(|(square, dof)| square / dof).collect());
    let keep: Vec<bool> = all
        .iter()
        .map(|(square, dof)| tail(square / typical.max(f64::MIN_POSITIVE), *dof) > policy.shot_tail)
        .collect();
    let lost = keep.iter().filter(|keep| !**keep).count();
    if lost as f64 > policy.max_lost * keep.len() as f64 { vec![true; keep.len()] } else { keep }
}
