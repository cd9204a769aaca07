//! Frames next to the impacts that are off in all shots: balls that touch hide each other, or seem one
//! to a tracker; an exposure that lasts over the impact shows a ball on neither of its paths; and a
//! tracker that predicts each position from those before, or averages over them, takes some frames to
//! notice an impact.

use std::sync::Arc;

use super::block::FilmBlock;
use super::own;
use super::shots::FittedFrame;
use crate::measurement::track::TrackedBall;
use crate::problem::unknowns::{Own, Shared};

/// Frames on either side of the impact that may be off; if all of them are, it is something else.
const MOST: usize = 16;

/// Residuals next to the impacts are so many standard deviations of their mean square larger than is
/// usual, and by this part: no chance.
const SURELY: f64 = 5.0;
const LARGER: f64 = 0.5;

/// Of frames further away, while those nearer are off.
const STILL: f64 = 2.5;

/// Number of shots below which nothing is told.
const LEAST_SHOTS: usize = 8;

/// Shots that are looked at.
const MOST_SHOTS: usize = 200;

/// Frames after the impact that may show a lag, and how many tell the velocity on each side.
const AFTER: usize = 3;
const NEXT: usize = 4;

/// Standard errors of a lag that are no chance, if both balls show them.
const LAGS: f64 = 4.0;

/// Part of a lag by which a ball is off before the impact at most: an exposure that lasts blurs both
/// sides alike, and a wrong model shows on both.
const BEFORE: f64 = 0.4;

/// Returns how many frames before and after the impacts are off, the first of which is less than half
/// a frame away; `None` if none is.
pub(crate) fn spoiled(film: &FilmBlock, own: &[Own], shared: &Shared) -> Option<[usize; 2]> {
    if film.shots.len() < LEAST_SHOTS {
        return None;
    }
    // sums of squares and counts: before and after the impact, by distance in frames; and of all
    let mut near = [[(0.0, 0.0); MOST]; 2];
    let mut all = (0.0, 0.0);
    for (i, own) in own.iter().enumerate().take(MOST_SHOTS) {
        for frame in film.fitted_frames(i, own, shared).iter().filter(|frame| frame.used) {
            let away = (frame.time - own[own::TIME]) * film.shots[i].fps;
            let [x, y] = frame.standardized();
            let square = x * x + y * y;
            let of_place = near[usize::from(away > 0.0)].get_mut(away.abs().round() as usize);
            for at in of_place.into_iter().chain([&mut all]) {
                at.0 += square;
                at.1 += 2.0;
            }
        }
    }
    let usual = all.0 / all.1;
    if !(usual > 0.0) {
        return None;
    }
    let excess = |(square, count): (f64, f64)| {
        let larger = square / count / usual - 1.0;
        (larger, larger / (2.0 / count).sqrt())
    };
    let is_off = |at: (f64, f64)| {
        let (larger, surely) = excess(at);
        larger > LARGER && surely > SURELY
    };
    let still = |at: &&(f64, f64)| excess(**at).1 > STILL;
    let reach = near.each_ref().map(|side| side.iter().take_while(still).count());
    let surely = |i: usize| near[i].iter().take(reach[i]).copied().any(is_off);
    ((surely(0) || surely(1)) && reach.into_iter().all(|frames| frames < MOST)).then_some(reach)
}

/// Leaves out the frames of all shots that are so near to their impacts.
pub(crate) fn leave_out(film: &mut FilmBlock, own: &[Own], reach: [usize; 2]) {
    for (shot, own) in Arc::make_mut(&mut film.shots).iter_mut().zip(own) {
        let [before, after] = reach.map(|frames| (frames as f64 - 0.5).max(0.0) / shot.fps);
        let instant = own[own::TIME];
        for frame in shot.tracks.iter_mut().flatten() {
            frame.used &= frame.time < instant - before || frame.time > instant + after;
        }
    }
}

/// Returns whether the tracker lags: with u the direction in which the impact changes a ball's
/// velocity, and r the standardized residuals of a frame, u·r is averaged over the shots for the last
/// frame before the impact and the first ones after it.
pub(crate) fn lags(film: &FilmBlock, own: &[Own], shared: &Shared) -> bool {
    let shots: Vec<Vec<FittedFrame>> =
        own.iter().enumerate().take(MOST_SHOTS).map(|(i, own)| film.fitted_frames(i, own, shared)).collect();
    let [cue, object] = [TrackedBall::Cue, TrackedBall::Object].map(|ball| {
        let shots = shots.iter().zip(own);
        let all: Vec<_> = shots.filter_map(|(frames, own)| along(frames, own[own::TIME], ball)).collect();
        let count = all.len() as f64;
        std::array::from_fn::<_, { AFTER + 1 }, _>(|frame| {
            let mean = all.iter().map(|shot| shot[frame]).sum::<f64>() / count;
            let variance = all.iter().map(|shot| (shot[frame] - mean).powi(2)).sum::<f64>() / (count - 1.0);
            (mean, mean / (variance / count).sqrt())
        })
    });
    let late = |ball: &[(f64, f64)], frame: usize| {
        ball[frame].1.abs() > LAGS && ball[0].0.abs() < BEFORE * ball[frame].0.abs()
    };
    (1..=AFTER).any(|frame| late(&cue, frame) && late(&object, frame) && cue[frame].0 * object[frame].0 > 0.0)
}

/// Returns u·r in the last frame before the impact and the first ones after it; `None` for too few
/// frames.
fn along(frames: &[FittedFrame], instant: f64, ball: TrackedBall) -> Option<[f64; AFTER + 1]> {
    // also those that were left out as wrong
    let own: Vec<&FittedFrame> = frames.iter().filter(|frame| frame.ball == ball).collect();
    let first = own.iter().position(|frame| frame.time >= instant)?;
    if first < NEXT || own.len() < first + NEXT {
        return None;
    }
    let velocity = |i: usize, j: usize| {
        let seconds = own[j].time - own[i].time;
        [0, 1].map(|axis| (own[j].predicted[axis] - own[i].predicted[axis]) / seconds)
    };
    let (before, after) = (velocity(first - NEXT, first - 1), velocity(first, first + NEXT - 1));
    let change = [after[0] - before[0], after[1] - before[1]];
    let size = change[0].hypot(change[1]);
    let along = |i: usize| {
        let [x, y] = own[first - 1 + i].standardized();
        (change[0] * x + change[1] * y) / size
    };
    let found = std::array::from_fn(along);
    found.iter().all(|r| r.is_finite()).then_some(found)
}
