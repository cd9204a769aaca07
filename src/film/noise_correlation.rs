//! Correlation of the noise between frames: trackers err similarly in neighbouring frames.
//!
//! The noise of a coordinate is modelled as autoregressive of first order, with the correlation
//! ρ^|i−j| between frames i and j. ρ is estimated from the cue balls before their impacts, whose
//! paths are cubics in time, by restricted maximum likelihood over all paths:
//!
//!   −2 ln L = N ln Σ rᵀR⁻¹r + Σ (ln|R| + ln|XᵀR⁻¹X|)
//!
//! R is the correlation matrix, X holds the powers of time, r the generalised least-squares
//! residuals, and N is the number of frames less that of the columns of X. Unlike the correlation
//! of residuals, this is not biased by the number of unknowns.
//!
//! Sources: Patterson and Thompson (1971), Biometrika 58, 545; Box, Jenkins and Reinsel, Time
//! Series Analysis, § 3.2.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::initial_guess::{MAX_RESIDUAL, approach};
use crate::measurement::dataset::Measured;
use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::median;

/// Columns of X: 1, t, t², t³.
const POWERS: usize = 4;

/// Maximum number of shots used, spread evenly: they determine ρ to a hundredth.
const MAX_SHOTS: usize = 500;

/// Largest and smallest number of frames of a path that are used.
const MAX_FRAMES: usize = 48;
const MIN_FRAMES: usize = 10;

/// Least number of degrees of freedom of the paths that determines a correlation.
const MIN_FREEDOM: usize = 100;

/// Number of correlations that are tried, from 0 on to below 1.
const TRIED: usize = 50;

/// Least decrease of −2 ln L at which the correlation is adopted.
const MIN_DECREASE: f64 = 6.0;

/// Least correlation of neighbouring frames: a smaller one changes no error by a tenth.
pub(crate) const MIN_RHO: f64 = 0.1;

/// Returns the correlation of the noise of neighbouring frames, from 0 to below 1, with its
/// standard error; `None` if the shots do not show it.
pub(crate) fn noise_correlation(shots: &[TrackShot]) -> Option<Measured> {
    let some = shots.par_iter().step_by(shots.len().div_ceil(MAX_SHOTS).max(1));
    let mut paths: Vec<DVector<f64>> = some.filter_map(paths).flatten_iter().collect();
    let variance = |y: &DVector<f64>| whiten(y, 0.0)[0] / (y.len() - POWERS) as f64;
    let typical = median(paths.iter().map(variance).collect());
    // others have wrong frames
    paths.retain(|path| variance(path) < MAX_RESIDUAL * MAX_RESIDUAL * typical);
    let numbers: usize = paths.iter().map(|path| path.len() - POWERS).sum();
    if numbers < MIN_FREEDOM || !(typical > 0.0) {
        return None;
    }
    let minus_two_ln_l = |rho: f64| {
        let all = paths.iter().map(|path| whiten(path, rho));
        let [square, of_determinants] = all.fold([0.0; 2], |sum, own| [sum[0] + own[0], sum[1] + own[1]]);
        let value = numbers as f64 * square.ln() + of_determinants;
        if value.is_nan() { f64::INFINITY } else { value }
    };
    let tried = || (0..TRIED).map(|i| i as f64 / TRIED as f64);
    let values: Vec<f64> = tried().map(minus_two_ln_l).collect();
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    // mean and standard deviation by L, with a uniform prior of ρ: short paths do not separate high
    // correlations, and the likeliest may be the highest
    let moment = |power: i32| -> f64 {
        tried().zip(&values).map(|(rho, value)| (0.5 * (least - value)).exp() * rho.powi(power)).sum()
    };
    let mean = moment(1) / moment(0);
    let sd = (moment(2) / moment(0) - mean * mean).max(0.0).sqrt();
    (mean > MIN_RHO && values[0] - least > MIN_DECREASE).then(|| Measured::new(mean, sd))
}

/// Returns x and y of the cue ball in the last even frames before the impact.
fn paths(shot: &TrackShot) -> Option<[DVector<f64>; 2]> {
    let frame = shot.fps.recip();
    let until = approach(shot)?[0] - 0.5 * frame;
    let before = &shot.cue[..shot.cue.partition_point(|s| s.t < until)];
    let is_even = |two: &[Sample]| {
        (two[1].t - two[0].t - frame).abs() < 0.1 * frame && (two[0].x != two[1].x || two[0].y != two[1].y)
    };
    let from = before.windows(2).rposition(|two| !is_even(two)).map_or(0, |i| i + 1);
    let last = &before[from.max(before.len().saturating_sub(MAX_FRAMES))..];
    let along = |pick: fn(&Sample) -> f64| DVector::from_iterator(last.len(), last.iter().map(pick));
    (last.len() >= MIN_FRAMES).then(|| [along(|s| s.x), along(|s| s.y)])
}

/// Returns rᵀR⁻¹r of a path at a correlation, and ln|R| + ln|XᵀR⁻¹X|.
fn whiten(y: &DVector<f64>, rho: f64) -> [f64; 2] {
    let n = y.len();
    let rest = (1.0 - rho * rho).sqrt();
    // (1, t, t², t³, y), and its product with L⁻¹, LLᵀ = R: the first row as it is, then
    // (r_i − ρ r_(i−1))/√(1 − ρ²)
    let time = |i: usize| 2.0 * i as f64 / (n - 1) as f64 - 1.0;
    let raw = |i: usize, k: usize| if k < POWERS { time(i).powi(k as i32) } else { y[i] - y[0] };
    let white = |i: usize, k: usize| {
        if i == 0 { raw(0, k) } else { (raw(i, k) - rho * raw(i - 1, k)) / rest }
    };
    let r = DMatrix::from_fn(n, POWERS + 1, white).qr().r();
    let ln_x: f64 = (0..POWERS).map(|k| 2.0 * r[(k, k)].abs().ln()).sum();
    // |R| = (1 − ρ²)^(n−1)
    [r[(POWERS, POWERS)].powi(2), 2.0 * (n - 1) as f64 * rest.ln() + ln_x]
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::simulate;

    /// The correlation of noise that is added to footage of 40 shots is found if it is not 0, and
    /// within three standard errors, which seldom fails in four trials.
    #[test]
    fn a_correlation_is_found_as_surely_as_is_said() {
        const SPEC: &str = r#"
            name = "a"
            kind = "tracks"
            seed = 1
            truth = { mu = 0.05, mu_s = 0.25, e = 0.94 }
            shots = { count = 40, speed_m_s = [1, 3], cut_deg = [-50, 50], cue_spin = ["natural-roll"] }
            camera = { position_sd_m = 1e-7 }
            "#;
        let filmed = simulate::filmed(&SPEC.parse().unwrap()).unwrap();
        for (rho, seed) in [(0.0_f64, 1), (0.3, 2), (0.6, 3), (0.8, 4), (0.9, 5)] {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            // a sum of twelve uniform numbers is as good as normal
            let mut normal = || (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>();
            let mut shots: Vec<TrackShot> = filmed.iter().map(|(shot, _)| shot.clone()).collect();
            for shot in &mut shots {
                let mut last = [normal(), normal()];
                for sample in &mut shot.cue {
                    last = last.map(|z| rho * z + (1.0 - rho * rho).sqrt() * normal());
                    (sample.x, sample.y) = (sample.x + 2e-4 * last[0], sample.y + 2e-4 * last[1]);
                }
            }
            let correlation = noise_correlation(&shots);
            assert_eq!(correlation.is_some(), rho > 0.0, "{rho}: {correlation:?}");
            let Some(Measured { value, sd: Some(sd) }) = correlation else { continue };
            assert!(
                sd < 0.06 && (value - rho).abs() < 3.0 * sd.max((TRIED as f64).recip()),
                "{rho}: {value} ± {sd}"
            );
        }
    }
}
