//! Frames next to the impacts whose positions are off in all shots: balls that touch hide each other, or seem one to a tracker, and an
//! exposure that lasts over the impact shows a ball on neither of its paths.

use crate::extraction::instant;
use crate::fit::FittedFrames;
use crate::measurement::track::TrackShot;
use crate::numerics::median;
use crate::trajectory::scene::Scene;

/// Frames on either side of the impact that may be off; if all of them are, it is something else.
const MOST: usize = 16;

/// Residuals next to the impacts are so many standard deviations of their mean square larger than is usual, and by this part: no chance.
const SURELY: f64 = 5.0;
const LARGER: f64 = 0.5;

/// Of frames further away, while those nearer are off.
const STILL: f64 = 2.5;

/// Few shots tell nothing.
const LEAST_SHOTS: usize = 8;

/// How many frames before and after the impacts are off, the first of which is less than half a frame away.
pub(super) fn spoiled(frames: &FittedFrames) -> Option<[usize; 2]> {
    // sums of squares and counts: before and after the impact, by distance in frames; and of all
    let mut near = [[(0.0, 0.0); MOST]; 2];
    let mut all = (0.0, 0.0);
    let mut count = 0;
    for shot in frames.shots() {
        let times: Vec<f64> = shot.rows.iter().filter_map(|row| row.time).collect();
        let steps = times.windows(2).map(|two| two[1] - two[0]).filter(|step| *step > 0.0);
        let frame = median(steps.collect());
        for row in &shot.rows {
            let Some(time) = row.time else { continue };
            let away = (time - shot.instant) / frame;
            let place = away.abs().round() as usize;
            let of_place = near[usize::from(away > 0.0)].get_mut(place);
            for at in of_place.into_iter().chain([&mut all]) {
                at.0 += row.standardized().powi(2);
                at.1 += 1.0;
            }
        }
        count += 1;
    }
    let usual = all.0 / all.1;
    if count < LEAST_SHOTS || !(usual > 0.0) {
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

/// Leaves out of a shot the frames that are so near to its impact.
pub(super) fn leave_out(shot: &mut TrackShot, reach: [usize; 2], scene: &Scene) {
    let Some(instant) = instant(shot, scene) else { return };
    let [before, after] = reach.map(|frames| (frames as f64 - 0.5).max(0.0) / shot.fps);
    let is_kept = |t: f64| t < instant - before || t > instant + after;
    shot.cue.retain(|sample| is_kept(sample.t));
    shot.object.retain(|sample| is_kept(sample.t));
}
