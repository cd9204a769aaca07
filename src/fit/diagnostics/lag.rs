//! Trackers that lag. One that predicts each position from those before, or averages over them, takes some frames to notice an impact:
//! in the first frames after it both balls are off their paths, which just before they are not.
//!
//! With u the direction in which the impact changes a ball's velocity, and r the standardized residuals of a frame, u·r is averaged over
//! the shots for the last frame before the impact and the first ones after it.

use crate::fit::FittedFrames;
use crate::fit::frames::OfShot;
use crate::likelihood::frames::rows::Row;
use crate::measurement::observable::Axis;
use crate::measurement::track::TrackedBall;

/// Frames after the impact that are looked at, and how many tell the velocity on each side.
const AFTER: usize = 3;
const NEXT: usize = 4;

/// So many shots tell it.
const MOST_SHOTS: usize = 200;

/// So many standard errors are no chance, where both balls show them.
const SURELY: f64 = 4.0;

/// Before the impact a ball is off by less than this part of it: an exposure that lasts blurs both sides alike, and a wrong
/// model shows on both.
const BEFORE: f64 = 0.4;

/// Whether the frames of a joint fit show that the tracker lags.
pub(crate) fn lags(frames: &FittedFrames) -> bool {
    let shots: Vec<OfShot> = frames.shots().take(MOST_SHOTS).collect();
    let [cue, object] = [TrackedBall::Cue, TrackedBall::Object].map(|ball| {
        let all: Vec<_> = shots.iter().filter_map(|shot| next_to_impact(shot, ball)).collect();
        let count = all.len() as f64;
        std::array::from_fn::<_, { AFTER + 1 }, _>(|frame| {
            let mean = all.iter().map(|shot| shot[frame]).sum::<f64>() / count;
            let variance = all.iter().map(|shot| (shot[frame] - mean).powi(2)).sum::<f64>() / (count - 1.0);
            (mean, mean / (variance / count).sqrt())
        })
    });
    let late = |ball: &[(f64, f64)], frame: usize| {
        ball[frame].1.abs() > SURELY && ball[0].0.abs() < BEFORE * ball[frame].0.abs()
    };
    (1..=AFTER).any(|frame| late(&cue, frame) && late(&object, frame) && cue[frame].0 * object[frame].0 > 0.0)
}

/// u·r in the last frame before the impact and the first ones after it; `None` where there are too few frames.
fn next_to_impact(shot: &OfShot, ball: TrackedBall) -> Option<[f64; AFTER + 1]> {
    let of_axis = |axis: Axis| {
        let rows = shot.rows.iter().filter(move |row| row.ball == ball && row.axis == axis);
        rows.filter(|row| row.time.is_some()).collect::<Vec<&Row>>()
    };
    let (x, y) = (of_axis(Axis::X), of_axis(Axis::Y));
    let time = |i: usize| x[i].time.unwrap_or_default();
    let first = x.iter().position(|row| row.time.is_some_and(|t| t >= shot.instant))?;
    if first < NEXT || x.len() < first + NEXT || y.len() != x.len() {
        return None;
    }
    let velocity = |i: usize, j: usize| {
        let of = |rows: &[&Row]| (rows[j].predicted - rows[i].predicted) / (time(j) - time(i));
        [of(&x), of(&y)]
    };
    let (before, after) = (velocity(first - NEXT, first - 1), velocity(first, first + NEXT - 1));
    let change = [after[0] - before[0], after[1] - before[1]];
    let size = change[0].hypot(change[1]);
    let along = |i: usize| (change[0] * x[i].standardized() + change[1] * y[i].standardized()) / size;
    let frames = std::array::from_fn(|i| along(first - 1 + i));
    frames.iter().all(|r| r.is_finite()).then_some(frames)
}
