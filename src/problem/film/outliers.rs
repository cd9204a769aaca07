//! Frames that fit no collision, by the tail probability of their whitened residuals, and
//! frames next to the impacts that are off in all shots: balls that touch hide each other, or seem
//! one to a tracker; an exposure that lasts over the impact shows a ball between its paths; and a
//! tracker that predicts each position from those before, or averages over them, takes some frames
//! to notice an impact.

use std::f64::consts::LN_2;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::camera::Point;
use super::filmed::{FilmBlock, FilmedShot, ShotAt};
use super::own;
use crate::measurement::track::TrackedBall;
use crate::numerics::{SIGNIFICANT, median};
use crate::problem::false_shots::{Squares, tail};
use crate::problem::frames::Sight;
use crate::problem::policy::POLICY;
use crate::problem::sums::{NoiseSums, ShotSums};
use crate::problem::unknowns::{Own, Shared};

/// Frames of a block at the end of a track that is judged as a whole: a collision at the end is
/// lost in a single frame.
const BLOCK: usize = 6;

/// Frames of a ball on one side of the impact that are always kept.
const LEAST_FRAMES: usize = 4;

/// Largest number of frames on either side of the impact that may be off in all shots; if all are
/// off, the cause is another one.
const MOST_NEAR: usize = 16;

/// Residuals next to the impacts exceed the mean square by this part, if they are off, and
/// significantly; half as significantly, if those nearer to the impact are off.
const MIN_SQUARE_EXCESS: f64 = 0.5;

/// Numbers of shots that determine what is off next to all impacts: at least, and that are looked
/// at.
const MIN_SHOTS: usize = 8;
const MAX_SHOTS: usize = 200;

/// Frames after the impact that may show a lag.
const AFTER: usize = 4;

/// Parts of a lag by which balls are off before the impact, in the same direction if positive: an
/// exposure that lasts blurs both sides similarly, and a fit shares a lag out among both.
const BEFORE: Range<f64> = -1.0..0.4;

/// Leaves out frames that stand out alone, and the ends of tracks at which the ball has left its
/// path; returns the number of frames left out.
pub(crate) fn leave_out_frames(film: &mut FilmBlock, own: &[Own], shared: &Shared) -> usize {
    let judge = |(shot, own): (&FilmedShot, &Own)| {
        let sights = ShotAt { film, shot, own, shared }.sights().unwrap_or_default();
        sights.map(|sights| outlying(&sights, own[own::TIME]))
    };
    let all: Vec<[Vec<usize>; 2]> = film.shots.par_iter().zip(own).map(judge).collect();
    let has_any = |(_, of_shot): &(&mut FilmedShot, &[Vec<usize>; 2])| !of_shot.concat().is_empty();
    for (shot, of_shot) in Arc::make_mut(&mut film.shots).iter_mut().zip(&all).filter(has_any) {
        for (track, left_out) in Arc::make_mut(&mut shot.tracks).iter_mut().zip(of_shot) {
            for index in left_out {
                track[*index].used = false;
            }
        }
    }
    all.iter().flatten().map(Vec::len).sum()
}

/// Returns the indices of the frames of one ball that are left out.
pub(crate) fn outlying<const R: usize>(frames: &[Sight<R>], instant: f64) -> Vec<usize> {
    // by the median, 2 ln 2 of two normal coordinates, so that wrong frames do not hide each other
    let scale = (median(frames.iter().map(Sight::square).collect()) / (2.0 * LN_2)).max(1.0);
    let first_after = frames.partition_point(|frame| frame.time < instant);
    let sum = |frames: &[Sight<R>]| frames.iter().map(|frame| frame.square().min(1e6)).sum::<f64>() / scale;
    let is_off = |frames: &[Sight<R>]| tail(sum(frames), 2.0 * frames.len() as f64) < POLICY.frame_tail;
    let (mut from, mut to) = (0, frames.len());
    while to > first_after + LEAST_FRAMES + BLOCK && is_off(&frames[to - BLOCK..to]) {
        to -= BLOCK;
    }
    while from + LEAST_FRAMES + BLOCK < first_after && is_off(&frames[from..from + BLOCK]) {
        from += BLOCK;
    }
    let is_left_out = |i: &usize| !(from..to).contains(i) || is_off(&frames[*i..=*i]);
    (0..frames.len()).filter(is_left_out).map(|i| frames[i].index).collect()
}

/// Returns the squares of the residuals of the frames of each shot: of n numbers at most n/(1 − ρ),
/// with the correlation ρ of neighbours. That is what a shot has that is on its paths and only
/// scatters more than the others.
pub(crate) fn squares(shots: &[ShotSums]) -> Vec<Squares> {
    let add_up = |shot: &ShotSums| {
        let mut all = NoiseSums::default();
        for noise in &shot.noises {
            all.add(noise);
        }
        let count = (all.count - shot.count_free() as f64).max(1.0);
        let rho = if all.square > 0.0 { (all.lagged / all.square).clamp(0.0, 1.0) } else { 1.0 };
        Squares { sum: all.weighted.min(count / (1.0 - rho)), count }
    };
    shots.iter().map(add_up).collect()
}

/// Returns how many frames before and after the impacts are off, the first of which is less than
/// half a frame away; `None` if all are on their paths.
pub(crate) fn spoiled(film: &FilmBlock, own: &[Own], shared: &Shared) -> Option<[usize; 2]> {
    if film.shots.len() < MIN_SHOTS {
        return None;
    }
    // sums of squared residuals and their numbers before and after the impact, by distance in
    // frames; and of all
    let mut near = [[[0.0; 2]; MOST_NEAR]; 2];
    let mut all = [0.0; 2];
    for (shot, own) in film.shots.iter().zip(own).take(MAX_SHOTS) {
        let frames = ShotAt { film, shot, own, shared }.fitted_frames();
        for frame in frames.iter().filter(|frame| frame.used) {
            let away = (frame.time - own[own::TIME]) * shot.fps;
            let square = Point::from(frame.standardized()).norm_squared();
            let near = near[usize::from(away > 0.0)].get_mut(away.abs().round() as usize);
            for [sum, count] in near.into_iter().chain([&mut all]) {
                *sum += square;
                *count += 2.0;
            }
        }
    }
    let typical = all[0] / all[1];
    if !(typical > 0.0) {
        return None;
    }
    // by which part their mean exceeds the typical one, and by how many standard deviations
    let excess = |[sum, count]: &[f64; 2]| {
        let part = sum / count / typical - 1.0;
        [part, part / (2.0 / count).sqrt()]
    };
    let reach = near
        .each_ref()
        .map(|side| side.iter().take_while(|near| excess(near)[1] > 0.5 * SIGNIFICANT).count());
    let is_off = |near: &[f64; 2]| {
        let [part, errors] = excess(near);
        part > MIN_SQUARE_EXCESS && errors > SIGNIFICANT
    };
    let is_spoiled = near.iter().zip(reach).any(|(side, reach)| side[..reach].iter().any(is_off));
    (is_spoiled && reach.into_iter().all(|frames| frames < MOST_NEAR)).then_some(reach)
}

/// Leaves out the frames of all shots that are so near to their impacts.
pub(crate) fn leave_out_spoiled(film: &mut FilmBlock, own: &[Own], reach: [usize; 2]) {
    let [before, after] = reach.map(|frames| (frames as f64 - 0.5).max(0.0));
    film.keep_frames(own, |away, fps| away < -before / fps || away > after / fps);
}

/// Returns the number of frames after the impacts by which the tracker lags, if it does.
pub(crate) fn lags(film: &FilmBlock, own: &[Own], shared: &Shared) -> Option<usize> {
    let shots = film.shots.iter().zip(own).take(MAX_SHOTS);
    let near = shots.filter_map(|(shot, own)| near_impact(&ShotAt { film, shot, own, shared }));
    find_lag(&near.collect::<Vec<_>>())
}

/// The bodies of a shot next to an impact that changes their velocities by d.
#[derive(Clone, Copy, Default)]
pub(crate) struct Near {
    /// Σd·r over the bodies, r the standardized residuals of a frame: of the last frame before the
    /// impact, and of the first ones after it.
    along: [f64; AFTER + 1],
    /// Σd²
    square: f64,
}

/// Returns the number of frames after the impacts by which a tracker lags, if it does: residuals are
/// in proportion to the change of velocity, r = l d with l = Σd·r/Σd² over shots and bodies, and l
/// differs from 0 (Student's t), and by more than in the last frame before the impacts.
pub(crate) fn find_lag(all: &[Near]) -> Option<usize> {
    let count = all.len() as f64;
    let student = StudentsT::new(0.0, 1.0, count - 1.0).ok()?;
    let square: f64 = all.iter().map(|shot| shot.square).sum();
    let lag = |frame: usize| all.iter().map(|shot| shot.along[frame]).sum::<f64>() / square;
    let chance = |frame: usize| {
        let off = |shot: &Near| (shot.along[frame] - lag(frame) * shot.square).powi(2);
        let scatter = all.iter().map(off).sum::<f64>() * count / (count - 1.0);
        2.0 * student.sf(lag(frame).abs() * square / scatter.sqrt())
    };
    let is_late = |frame: usize| {
        chance(frame) < POLICY.improbable / AFTER as f64 && BEFORE.contains(&(lag(0) / lag(frame)))
    };
    let is_off = |frame: &usize| chance(*frame) < POLICY.level;
    (1..=AFTER).any(is_late).then(|| (1..=AFTER).rev().find(is_off))?
}

impl Near {
    /// Adds a body with its frames, each with its instant, s; `None` for too few.
    pub(crate) fn add(&mut self, frames: &[(f64, Point)], change: Point, instant: f64) -> Option<()> {
        let last = frames.partition_point(|(time, _)| *time < instant).checked_sub(1)?;
        for (sum, (_, residual)) in self.along.iter_mut().zip(frames.get(last..=last + AFTER)?) {
            *sum += change.dot(residual);
        }
        self.square += change.norm_squared();
        self.along.iter().all(|sum| sum.is_finite()).then_some(())
    }
}

/// Returns both balls of a shot next to its impact, also in frames that were left out; `None` for too
/// few.
fn near_impact(at: &ShotAt) -> Option<Near> {
    let (struck, frames) = (at.struck().ok()?, at.fitted_frames());
    let [cue, object] = struck.after.each_ref().map(|ball| ball.velocity);
    let mut near = Near::default();
    for (ball, change) in [(TrackedBall::Cue, cue - struck.before.velocity), (TrackedBall::Object, object)] {
        let of_ball = frames.iter().filter(|frame| frame.ball == ball);
        let of_ball: Vec<_> = of_ball.map(|frame| (frame.time, frame.standardized().into())).collect();
        near.add(&of_ball, struck.turn(&change).map(|v| v.re), at.own[own::TIME])?;
    }
    Some(near)
}
