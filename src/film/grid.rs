//! What rounding to a grid does to the errors of positions.
//!
//! A coordinate that was rounded to a grid of step h errs by h/√12 besides its noise. Where noise or motion carry the ball over
//! several steps, these errors are as good as independent. Where they do not, the same number comes again and again, with the same
//! error: so many frames tell as much as one.

use crate::measurement::track::Sample;

/// Noise above this part of the step, its rounding included, makes rounding errors independent: with noise σ the mean of many
/// rounded numbers is off by at most h/π exp(−2π²σ²/h²), which is 0.002 h at σ = h/2, where σ and h/√12 together are 0.58 h.
const DITHERED: f64 = 0.58;

/// Numbers that repeat so often by chance less often than this do not repeat by chance.
const CHANCE: f64 = 1e-6;

/// The error of rounding to steps of this length.
pub(crate) fn rounding(step: f64) -> f64 {
    step / 12.0_f64.sqrt()
}

/// For x and y of each sample, in how many samples that follow each other the same number stands with the same error; 1 where
/// errors are independent. `noise` is the standard deviation of a coordinate, rounding included. A ball at rest of which both coordinates
/// repeat, though the noise is larger than the step, is held in its place by a program: whether that was found from one of the frames or
/// from all of them is not known, and the frames count as many as the square root of their number, the geometric mean of both. Discs
/// (`are_balls` false) count once.
pub(crate) fn repeats(samples: &[Sample], noise: f64, step: f64, are_balls: bool) -> Vec<[f64; 2]> {
    let mut repeats = vec![[1.0; 2]; samples.len()];
    // that noise of density 1/(2√π σ) for no difference leads to the same number
    let same = (step / (2.0 * std::f64::consts::PI.sqrt() * noise)).min(1.0);
    for (axis, pick) in [|s: &Sample| s.x, |s: &Sample| s.y].into_iter().enumerate() {
        let mut first = 0;
        for run in samples.chunk_by(|a, b| pick(a) == pick(b)) {
            let length = run.len();
            let by_chance = same.powi(length.min(1000) as i32 - 1);
            let rests = are_balls && run.iter().all(|sample| sample.x == run[0].x && sample.y == run[0].y);
            if length > 1 && (noise < DITHERED * step || by_chance < CHANCE) {
                let is_held = rests && noise >= DITHERED * step;
                let alike = if is_held { (length as f64).sqrt() } else { length as f64 };
                repeats[first..first + length].iter_mut().for_each(|repeat| repeat[axis] = alike);
            }
            first += length;
        }
    }
    repeats
}

/// The median of absolute values that are multiples of `step`, as it was before they were rounded: within its class it is where
/// the counts say. A step of 0 leaves the plain median.
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
        // noise of a whole step: three alike are chance
        let thrice = samples(|i| (i / 3 % 2) as f64);
        assert_eq!(repeats(&thrice, 1.0, 1.0, true)[3], [1.0, 1.0]);
    }

    #[test]
    fn the_median_of_rounded_numbers_is_that_of_the_numbers() {
        /// Of 1000 numbers.
        const NEAR: f64 = 0.03;
        let exact: Vec<f64> = (0..1000).map(|i| f64::from(i) * 2.6e-3).collect();
        let rounded: Vec<f64> = exact.iter().map(|x| x.round()).collect();
        assert!((median_of_multiples(&rounded, 1.0) - 1.3).abs() < NEAR);
        assert_eq!(median_of_multiples(&exact, 0.0), exact[500]);
        assert!(median_of_multiples(&[], 1.0).is_nan());
        assert!(median_of_multiples(&[0.0; 9], 1.0) <= 0.5);
    }
}
