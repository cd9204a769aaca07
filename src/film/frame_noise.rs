//! The noise of the positions in the frames of a shot, before anything is fitted.
//!
//! A coordinate that was rounded to a grid of step h errs by h/√12 besides its noise. If noise or
//! motion carry the ball over several steps, these errors are nearly independent. Otherwise one
//! number repeats with the same error, and the repeated frames are worth one.

use statrs::function::erf::erfc;

use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::{NORMAL_MEDIAN, SIGNIFICANT, median};

/// Frames on either side of an instant from which the noise near it is estimated.
const NOISE_FRAMES: f64 = 30.0;

pub(super) const COORDINATES: [fn(&Sample) -> f64; 2] = [|s| s.x, |s| s.y];

/// Least noise assumed, m: it keeps exact synthetic tracks finite. Places nearer to each other are
/// the same.
pub(crate) const MIN_NOISE_M: f64 = 1e-8;

/// Returns the noise of a coordinate of balls, m, from the second differences of consecutive
/// frames, in which a smooth motion leaves only its acceleration: the root mean square over both
/// coordinates of median |Δ²x|/0.6745/√(6 − 8ρ + 2ρ²), with ρ the correlation of neighbouring
/// frames. It is at least the rounding error of the coordinates' grid. A ball at rest that a program
/// holds in place does not count.
pub(crate) fn noise(shot: &TrackShot) -> f64 {
    noise_of(&[&shot.cue, &shot.object], shot)
}

/// Returns what [`noise`] does from some tracks of a shot.
pub(crate) fn noise_of(tracks: &[&[Sample]], shot: &TrackShot) -> f64 {
    let all = triples(tracks, shot.fps.recip());
    let free: Vec<&[Sample]> = all.iter().copied().filter(|three| !is_held(three)).collect();
    let noise_of_free = estimate(&free, shot);
    // noise of a step or more leaves at most 0.7 % of triples equal
    let step = shot.resolution[0].max(shot.resolution[1]);
    if !shot.states_noise() && noise_of_free > step { noise_of_free } else { estimate(&all, shot) }
}

/// Returns the noise of the frames of some tracks near an instant: far from it the noise may
/// differ.
pub(crate) fn noise_of_near(tracks: &[&[Sample]], shot: &TrackShot, instant: f64) -> f64 {
    let until =
        |samples: &[Sample], frames: f64| samples.partition_point(|s| s.t < instant + frames / shot.fps);
    let near = |samples: &&'_ [Sample]| until(samples, -NOISE_FRAMES)..until(samples, NOISE_FRAMES);
    let near: Vec<&[Sample]> = tracks.iter().map(|samples| &samples[near(samples)]).collect();
    estimate(&triples(&near, shot.fps.recip()), shot)
}

/// Returns the noise estimated from triples of positions.
fn estimate(triples: &[&[Sample]], shot: &TrackShot) -> f64 {
    let [finer, coarser] = [f64::min, f64::max].map(|of| of(shot.resolution[0], shot.resolution[1]));
    let least = MIN_NOISE_M.max(rounding(finer));
    let constant = constant_axis_of(triples);
    let rho = shot.correlation;
    let differs = (6.0 - 8.0 * rho + 2.0 * rho * rho).sqrt();
    let variance = |axis: usize| {
        let mut differences: Vec<f64> = triples.iter().map(|three| bend(three, COORDINATES[axis])).collect();
        differences.sort_by(f64::total_cmp);
        (median_of_multiples(&differences, coarser) / NORMAL_MEDIAN / differs).powi(2)
    };
    let variances: Vec<f64> = (0..2).filter(|axis| constant != Some(*axis)).map(variance).collect();
    (variances.iter().sum::<f64>() / variances.len() as f64).sqrt().max(least)
}

/// Returns whether positions are exactly the same.
fn is_held(samples: &[Sample]) -> bool {
    samples.iter().all(|sample| sample.x == samples[0].x && sample.y == samples[0].y)
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
    (x != y).then_some(usize::from(y))
}

/// Returns the triples of successive samples that are as close in time as the median: consecutive
/// frames, unless the tracks have only some (every second, two of three).
fn triples<'a>(tracks: &[&'a [Sample]], frame: f64) -> Vec<&'a [Sample]> {
    let mut all: Vec<&[Sample]> = tracks.iter().flat_map(|samples| samples.windows(3)).collect();
    let span = |three: &[Sample]| three[2].t - three[0].t;
    let typical = median(all.iter().map(|three| span(three)).collect());
    all.retain(|three| span(three) < typical + 0.1 * frame);
    all
}

/// Returns the second difference a − 2b + c of three positions, scaled to the standard deviation of
/// even spacing if their times are uneven.
fn bend(three: &[Sample], pick: fn(&Sample) -> f64) -> f64 {
    let [a, b, c] = [pick(&three[0]), pick(&three[1]), pick(&three[2])];
    let part = (three[1].t - three[0].t) / (three[2].t - three[0].t);
    let spread = (1.0 + part * part + (1.0 - part) * (1.0 - part)).sqrt();
    6.0_f64.sqrt() * ((1.0 - part) * a - b + part * c).abs() / spread
}

/// Returns the standard deviation of rounding to steps of this length.
pub(crate) fn rounding(step: f64) -> f64 {
    step / 12.0_f64.sqrt()
}

/// Returns for x and y of each sample the number of consecutive samples that repeat one number with
/// its error; 1 if errors are independent. `noise` is the standard deviation of a coordinate,
/// rounding included. If both coordinates of a ball at rest repeat though the noise exceeds the
/// step, a program holds the ball in place, found from one frame or from all: the n frames count as
/// √n, the geometric mean of both cases. Discs (`are_balls` false) count once.
pub(crate) fn repeats(samples: &[Sample], noise: f64, step: f64, are_balls: bool) -> Vec<[f64; 2]> {
    let mut repeats = vec![[1.0; 2]; samples.len()];
    // probability of equal numbers: density 1/(2√π σ) of the difference at 0, times the step
    let same = (step / (2.0 * std::f64::consts::PI.sqrt() * noise)).min(1.0);
    let improbable = erfc(SIGNIFICANT * std::f64::consts::FRAC_1_SQRT_2);
    // noise of half a step makes rounding errors independent: the mean of many rounded numbers with
    // noise σ is off by at most h/π exp(−2π²σ²/h²), 0.002 h at σ = h/2
    let is_coarse = noise < (0.5 * step).hypot(rounding(step));
    for (axis, pick) in COORDINATES.into_iter().enumerate() {
        let mut first = 0;
        for run in samples.chunk_by(|a, b| pick(a) == pick(b)) {
            let length = run.len();
            let by_chance = same.powi(length.min(1000) as i32 - 1);
            let rests = are_balls && is_held(run);
            if length > 1 && (is_coarse || by_chance < improbable) {
                let alike = if rests && !is_coarse { (length as f64).sqrt() } else { length as f64 };
                repeats[first..first + length].iter_mut().for_each(|repeat| repeat[axis] = alike);
            }
            first += length;
        }
    }
    repeats
}

/// Returns the median before rounding of absolute values that are multiples of `step`, interpolated
/// by counts within its class. A step of 0 gives the plain median.
pub(crate) fn median_of_multiples(sorted: &[f64], step: f64) -> f64 {
    let half = 0.5 * sorted.len() as f64;
    let Some(median) = sorted.get(sorted.len() / 2).copied() else { return f64::NAN };
    let below = sorted.partition_point(|x| *x < median - 0.5 * step);
    let within = sorted.partition_point(|x| *x < median + 0.5 * step) - below;
    if !(step > 0.0) || within == 0 {
        return median;
    }
    let low = (median - 0.5 * step).max(0.0);
    low + (median + 0.5 * step - low) * (half - below as f64) / within as f64
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::measurement::spin::Spin;

    #[test]
    fn the_noise_of_tracks_that_have_only_some_frames() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        // the sum of twelve uniform numbers has the variance 1
        let mut normal = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let mut place = |t: f64| [1300.0 + 5000.0 * t + normal(), 700.0 + normal()];
        let all: Vec<Sample> =
            (0..4000).map(|n| f64::from(n) / 500.0).map(|t| Sample::new(t, place(t))).collect();
        for (what, every, kept) in
            [("all", 1, 1), ("half", 2, 1), ("two of three", 3, 2), ("two of four", 4, 2)]
        {
            let some: Vec<Sample> = (0..all.len()).filter(|n| n % every < kept).map(|n| all[n]).collect();
            let noise = noise(&TrackShot::new("", 500.0, Spin::Stun, [some.clone(), some]));
            assert!((noise - 1.0).abs() < 0.05, "{what}: {noise}");
        }
    }

    fn samples(x: impl Fn(usize) -> f64) -> Vec<Sample> {
        (0..20).map(|i| Sample { t: i as f64, x: x(i), y: i as f64, sd: None }).collect()
    }

    #[test]
    fn what_repeats_with_the_same_error_counts_once() {
        let lies = samples(|_| 0.3);
        assert!(repeats(&lies, 2e-4, 5e-4, true).iter().all(|repeat| *repeat == [20.0, 1.0]));
        // one coordinate held by the tracker
        assert!(repeats(&lies, 1e-4, 0.0, true).iter().all(|repeat| *repeat == [20.0, 1.0]));
        // a ball at rest whose place never changes, and a disc
        let rests = [Sample { t: 0.0, x: 0.0, y: 0.0, sd: None }; 25];
        assert!(repeats(&rests, 1e-4, 0.0, true).iter().all(|repeat| *repeat == [5.0, 5.0]));
        assert!(repeats(&rests, 1e-4, 0.0, false).iter().all(|repeat| *repeat == [25.0, 25.0]));
        assert!(repeats(&rests, 1e-4, 5e-4, true).iter().all(|repeat| *repeat == [25.0, 25.0]));
        let flips = samples(|i| if i % 10 == 9 { 1.0 } else { 0.0 });
        assert_eq!(repeats(&flips, 0.3, 1.0, true)[0], [9.0, 1.0]);
        assert_eq!(repeats(&flips, 0.3, 1.0, true)[9], [1.0, 1.0]);
        // noise of a whole step: three equal numbers are chance
        let thrice = samples(|i| (i / 3 % 2) as f64);
        assert_eq!(repeats(&thrice, 1.0, 1.0, true)[3], [1.0, 1.0]);
    }

    #[test]
    fn the_median_of_rounded_numbers_is_that_of_the_numbers() {
        let exact: Vec<f64> = (0..1000).map(|i| f64::from(i) * 2.6e-3).collect();
        let rounded: Vec<f64> = exact.iter().map(|x| x.round()).collect();
        let tolerance = (rounded.len() as f64).sqrt().recip();
        assert!((median_of_multiples(&rounded, 1.0) - 1.3).abs() < tolerance);
        assert_eq!(median_of_multiples(&exact, 0.0), exact[500]);
        assert!(median_of_multiples(&[], 1.0).is_nan());
        assert!(median_of_multiples(&[0.0; 9], 1.0) <= 0.5);
    }
}
