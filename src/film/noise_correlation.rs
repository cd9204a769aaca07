//! Correlation of the noise between frames: trackers err similarly in neighbouring frames.
//!
//! The noise of a coordinate is modelled as autoregressive of first order, with the correlation
//! ρ^|i−j| between frames i and j. ρ is estimated from the cue balls before their impacts, whose
//! paths are cubics in time, by restricted maximum likelihood over all paths:
//!
//!   −2 ln L = Σ ((n − 4) ln rᵀR⁻¹r + ln|R| + ln|XᵀR⁻¹X|)
//!
//! R is the correlation matrix, X holds the powers of time, r the generalised least-squares
//! residuals, and n is the number of frames of a path. Unlike the correlation of residuals, this is
//! not biased by the number of unknowns. Each path has a noise of its own, so that one with wrong
//! frames counts no more than others.
//!
//! Sources: Patterson and Thompson (1971), Biometrika 58, 545; Box, Jenkins and Reinsel, Time
//! Series Analysis, § 3.2.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::meeting::arriving;
use crate::measurement::dataset::Measured;
use crate::measurement::track::{Sample, TrackShot};

/// Columns of X: 1, t, t², t³.
const POWERS: usize = 4;

/// Maximum number of shots used, spread evenly: they determine ρ to a hundredth.
const MAX_SHOTS: usize = 500;

/// Largest and smallest number of frames of a path that are used.
const MAX_FRAMES: usize = 48;
const MIN_FRAMES: usize = 10;

/// Number of correlations that are tried, from 0 on to below 1.
const TRIED: usize = 50;

/// Least decrease of −2 ln L at which the correlation is adopted.
const MIN_DECREASE: f64 = 6.0;

/// Least correlation of neighbouring frames: a smaller one changes no error by a tenth.
const MIN_RHO: f64 = 0.1;

/// Returns the correlation of the noise of neighbouring frames, from 0 to below 1, with its
/// standard error; `None` if the shots do not show it.
pub(crate) fn noise_correlation(shots: &[TrackShot]) -> Option<Measured> {
    let some = shots.par_iter().step_by(shots.len().div_ceil(MAX_SHOTS).max(1));
    let paths: Vec<DVector<f64>> = some.filter_map(paths).flatten_iter().collect();
    // a coordinate that never changes has no noise
    let minus_two_ln_l = |rho: f64| -> f64 {
        paths.iter().map(|path| unlikely(path, rho)).filter(|of_path| of_path.is_finite()).sum()
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
    let before = arriving(shot);
    let is_even = |two: &[Sample]| {
        (two[1].t - two[0].t - frame).abs() < 0.1 * frame && (two[0].x != two[1].x || two[0].y != two[1].y)
    };
    let from = before.windows(2).rposition(|two| !is_even(two)).map_or(0, |i| i + 1);
    let last = &before[from.max(before.len().saturating_sub(MAX_FRAMES))..];
    let along = |pick: fn(&Sample) -> f64| DVector::from_iterator(last.len(), last.iter().map(pick));
    (last.len() >= MIN_FRAMES).then(|| [along(|s| s.x), along(|s| s.y)])
}

/// Returns −2 ln L of a path at a correlation, up to a constant.
fn unlikely(y: &DVector<f64>, rho: f64) -> f64 {
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
    let ln_square = r[(POWERS, POWERS)].powi(2).ln();
    // |R| = (1 − ρ²)^(n−1)
    (n - POWERS) as f64 * ln_square + 2.0 * (n - 1) as f64 * rest.ln() + ln_x
}
