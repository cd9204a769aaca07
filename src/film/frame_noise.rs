//! The noise of the positions in the frames of a shot, before anything is fitted.

use super::grid;
use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::{NORMAL_MEDIAN, median};

/// Frames on either side of an instant from which the noise near it is estimated.
const NOISE_FRAMES: f64 = 30.0;

const COORDINATES: [fn(&Sample) -> f64; 2] = [|s| s.x, |s| s.y];

/// Least noise assumed, m: it keeps exact synthetic tracks finite.
const MIN_NOISE_M: f64 = 1e-8;

/// Returns the noise of a coordinate of balls, m, from the second differences of consecutive
/// frames, in which a smooth motion leaves only its acceleration:
/// median |Δ²x|/0.6745/√(6 − 8ρ + 2ρ²), with ρ the correlation of neighbouring frames. The noise is
/// at least the rounding error of the coordinates' grid. A ball at rest that a program holds in
/// place does not count.
pub(crate) fn noise(shot: &TrackShot) -> f64 {
    let all = triples(&[&shot.cue, &shot.object], shot.fps.recip());
    let free: Vec<&[Sample]> = all.iter().copied().filter(|three| !is_held(three)).collect();
    let is_often_held = (all.len() - free.len()) as f64 > MAX_EQUAL * all.len() as f64;
    let of_free = estimate(&free, shot);
    let step = shot.resolution[0].max(shot.resolution[1]);
    if !shot.states_noise() && is_often_held && of_free > step { of_free } else { estimate(&all, shot) }
}

/// Returns the noise of the frames of some tracks near an instant: far from it the noise may
/// differ.
pub(crate) fn noise_of_near(tracks: &[&[Sample]], shot: &TrackShot, instant: f64) -> f64 {
    let until =
        |samples: &[Sample], frames: f64| samples.partition_point(|s| s.t < instant + frames / shot.fps);
    let near = |samples: &&'_ [Sample]| until(samples, -NOISE_FRAMES)..until(samples, NOISE_FRAMES);
    let near: Vec<&[Sample]> = tracks.iter().map(|samples| &samples[near(samples)]).collect();
    noise_of(&near, shot)
}

/// Returns the noise of parts of tracks of a shot.
pub(crate) fn noise_of(tracks: &[&[Sample]], shot: &TrackShot) -> f64 {
    estimate(&triples(tracks, shot.fps.recip()), shot)
}

/// Returns the noise estimated from triples of positions.
fn estimate(triples: &[&[Sample]], shot: &TrackShot) -> f64 {
    let [finer, coarser] = [f64::min, f64::max].map(|of| of(shot.resolution[0], shot.resolution[1]));
    let least = MIN_NOISE_M.max(grid::rounding(finer));
    let constant = constant_axis_of(triples);
    let moving = (0..2).filter(|axis| constant != Some(*axis));
    let mut differences: Vec<f64> =
        moving.flat_map(|axis| triples.iter().map(move |three| bend(three, COORDINATES[axis]))).collect();
    if differences.is_empty() {
        return least;
    }
    differences.sort_by(f64::total_cmp);
    let rho = shot.correlation;
    let differs = (6.0 - 8.0 * rho + 2.0 * rho * rho).sqrt();
    (grid::median_of_multiples(&differences, coarser) / NORMAL_MEDIAN / differs).max(least)
}

/// Largest fraction of triples of equal positions that noise explains: 0.7 % if the noise is one
/// step of the coordinates, less if it is more. Others are of balls at rest that a program holds in
/// place, which show no noise.
const MAX_EQUAL: f64 = 0.05;

/// Returns whether three positions are exactly the same.
fn is_held(three: &[Sample]) -> bool {
    three.iter().all(|sample| sample.x == three[0].x && sample.y == three[0].y)
}

/// Returns the coordinate (0: x, 1: y) that is the same in all frames of both bodies, as in a film
/// of one dimension: it has no noise.
pub(crate) fn constant_axis(shot: &TrackShot) -> Option<usize> {
    constant_axis_of(&[&shot.cue, &shot.object])
}

fn constant_axis_of(pieces: &[&[Sample]]) -> Option<usize> {
    let samples = || pieces.iter().copied().flatten();
    let first = samples().next()?;
    let is_constant = |pick: &fn(&Sample) -> f64| samples().all(|sample| pick(sample) == pick(first));
    let [x, y] = COORDINATES.each_ref().map(is_constant);
    match [x, y] {
        [true, false] => Some(0),
        [false, true] => Some(1),
        _ => None,
    }
}

/// Returns all triples of consecutive frames or, of tracks with only some frames (every second, two
/// of three), those that are as close in time as the median.
fn triples<'a>(tracks: &[&'a [Sample]], frame: f64) -> Vec<&'a [Sample]> {
    /// Least fraction of triples of consecutive frames at which the others are left out.
    const MIN_CONSECUTIVE: f64 = 0.25;
    let all: Vec<&[Sample]> = tracks.iter().flat_map(|samples| samples.windows(3)).collect();
    let follows = |a: &Sample, b: &Sample| (b.t - a.t - frame).abs() < 0.1 * frame;
    let consecutive =
        all.iter().copied().filter(|three| follows(&three[0], &three[1]) && follows(&three[1], &three[2]));
    let consecutive: Vec<&[Sample]> = consecutive.collect();
    if consecutive.len() as f64 > MIN_CONSECUTIVE * all.len() as f64 {
        return consecutive;
    }
    let span = |three: &[Sample]| three[2].t - three[0].t;
    let usual = median(all.iter().map(|three| span(three)).collect());
    all.into_iter().filter(|three| span(three) < usual + 0.1 * frame).collect()
}

/// Returns the second difference a − 2b + c of three positions, scaled to the standard deviation of
/// even spacing if their times are uneven.
fn bend(three: &[Sample], pick: fn(&Sample) -> f64) -> f64 {
    /// Largest deviation from the middle in time that jitter of a clock explains.
    const MAX_JITTER: f64 = 0.06;
    let [a, b, c] = [pick(&three[0]), pick(&three[1]), pick(&three[2])];
    let part = (three[1].t - three[0].t) / (three[2].t - three[0].t);
    if (part - 0.5).abs() < MAX_JITTER {
        return (a - 2.0 * b + c).abs();
    }
    let spread = (1.0 + part * part + (1.0 - part) * (1.0 - part)).sqrt();
    6.0_f64.sqrt() * ((1.0 - part) * a - b + part * c).abs() / spread
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::measurement::spin::Spin;

    #[test]
    fn the_noise_of_tracks_that_have_only_some_frames() {
        const TEST_NOISE: f64 = 3e-4;
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        // the sum of twelve uniform numbers has the variance 1
        let mut normal = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let mut place = |t: f64| [0.4 + 1.5 * t + TEST_NOISE * normal(), 0.2 + TEST_NOISE * normal()];
        let all: Vec<Sample> =
            (0..4000).map(|n| f64::from(n) / 500.0).map(|t| Sample::new(t, place(t))).collect();
        for (what, every, kept) in
            [("all", 1, 1), ("half", 2, 1), ("two of three", 3, 2), ("two of four", 4, 2)]
        {
            let some: Vec<Sample> = (0..all.len()).filter(|n| n % every < kept).map(|n| all[n]).collect();
            let noise = noise_of(&[&some, &some], &TrackShot::new("", 500.0, Spin::Stun, [vec![], vec![]]));
            assert!((noise / TEST_NOISE - 1.0).abs() < 0.05, "{what}: {noise}");
        }
    }
}
