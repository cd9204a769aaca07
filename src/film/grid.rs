//! The effect of rounding to a grid on the errors of positions.
//!
//! A coordinate that was rounded to a grid of step h errs by h/√12 besides its noise. If noise or
//! motion carry the ball over several steps, these errors are nearly independent. Otherwise one
//! number repeats with the same error, and the repeated frames are worth one.

use crate::measurement::track::Sample;

/// Noise above this part of the step, its rounding included, makes rounding errors independent: the
/// mean of many rounded numbers with noise σ is off by at most h/π exp(−2π²σ²/h²), which is 0.002 h
/// at σ = h/2; σ and h/√12 together are then 0.58 h.
const MIN_DITHER: f64 = 0.58;

/// Probability of a run of equal numbers by chance below which the run is not chance.
const MAX_CHANCE: f64 = 1e-6;

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
    for (axis, pick) in [|s: &Sample| s.x, |s: &Sample| s.y].into_iter().enumerate() {
        let mut first = 0;
        for run in samples.chunk_by(|a, b| pick(a) == pick(b)) {
            let length = run.len();
            let by_chance = same.powi(length.min(1000) as i32 - 1);
            let rests = are_balls && run.iter().all(|sample| sample.x == run[0].x && sample.y == run[0].y);
            if length > 1 && (noise < MIN_DITHER * step || by_chance < MAX_CHANCE) {
                let is_held = rests && noise >= MIN_DITHER * step;
                let alike = if is_held { (length as f64).sqrt() } else { length as f64 };
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
    use super::*;

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
        /// Tolerance for 1000 numbers.
        const WHOLE_TOLERANCE: f64 = 0.03;
        let exact: Vec<f64> = (0..1000).map(|i| f64::from(i) * 2.6e-3).collect();
        let rounded: Vec<f64> = exact.iter().map(|x| x.round()).collect();
        assert!((median_of_multiples(&rounded, 1.0) - 1.3).abs() < WHOLE_TOLERANCE);
        assert_eq!(median_of_multiples(&exact, 0.0), exact[500]);
        assert!(median_of_multiples(&[], 1.0).is_nan());
        assert!(median_of_multiples(&[0.0; 9], 1.0) <= 0.5);
    }
}
