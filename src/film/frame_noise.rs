//! The noise of the positions in the frames of a shot, before anything is fitted.
//!
//! A coordinate that was rounded to a grid of step h errs by h/√12 besides its noise. If noise or
//! motion carry the ball over several steps, these errors are nearly independent. Otherwise one
//! number repeats with the same error, and the repeated frames are worth one.

use statrs::function::erf::erfc;

use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::{SIGNIFICANT, median};

/// Frames on either side of an instant from which the noise near it is estimated.
const NOISE_FRAMES: f64 = 30.0;

pub(super) const COORDINATES: [fn(&Sample) -> f64; 2] = [|s| s.x, |s| s.y];

/// Mean of the smaller half of the absolute values of a normal distribution, in units of its
/// standard deviation: 4(φ(0) − φ(0.6745)).
const SMALLER_HALF: f64 = 0.3247;

/// Least noise assumed, m: it keeps exact synthetic tracks finite. Places nearer to each other are
/// the same.
pub(crate) const MIN_NOISE_M: f64 = 1e-8;

/// Returns the noise of a coordinate of balls, m, from the second differences of consecutive
/// frames, in which a smooth motion leaves only its acceleration: the mean of the smaller half of
/// |Δ²x|, over 0.3247 √(6 − 8ρ + 2ρ²) with ρ the correlation of neighbouring frames. Half of the
/// frames may be wrong, and multiples of a grid are averaged. The noise is at least the rounding
/// error of the grid. A ball at rest that a program holds in place does not count.
pub(crate) fn noise(shot: &TrackShot) -> f64 {
    let all = triples(&[&shot.cue, &shot.object], shot.fps.recip());
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
    let least = MIN_NOISE_M.max(rounding(shot.resolution[0].min(shot.resolution[1])));
    let constant = constant_axis_of(triples);
    let moving = (0..2).filter(|axis| constant != Some(*axis));
    let mut differences: Vec<f64> =
        moving.flat_map(|axis| triples.iter().map(move |three| bend(three, COORDINATES[axis]))).collect();
    differences.sort_by(f64::total_cmp);
    let smaller = &differences[..differences.len().div_ceil(2)];
    let mean = smaller.iter().sum::<f64>() / smaller.len() as f64;
    let rho = shot.correlation;
    let differs = (6.0 - 8.0 * rho + 2.0 * rho * rho).sqrt();
    // without any the mean is NaN
    (mean / SMALLER_HALF / differs).max(least)
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
