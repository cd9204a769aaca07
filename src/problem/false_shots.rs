//! Shots that fit no collision that the others fit, by the tail probability of their residuals.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::policy::POLICY;
use crate::numerics::median;

/// The sum of squares of the residuals of a shot in units of their errors.
#[derive(Clone, Copy)]
pub(super) struct Squares {
    pub(super) sum: f64,
    /// Number of independent residuals.
    pub(super) count: f64,
}

/// Returns the probability that χ² of `dof` degrees of freedom exceeds `chi2`.
pub(super) fn tail(chi2: f64, dof: f64) -> f64 {
    ChiSquared::new(dof).map_or(1.0, |distribution| distribution.sf(chi2))
}

/// Returns whether each shot is farther away than chance has it at the scale of the median shot,
/// which is `least` at least.
pub(super) fn candidates(shots: &[Squares], least: f64) -> Vec<bool> {
    let half = |count: f64| ChiSquared::new(count).map_or(f64::NAN, |chi2| chi2.inverse_cdf(0.5));
    let typical = median(shots.iter().map(|shot| shot.sum / half(shot.count)).collect()).max(least);
    shots.iter().map(|shot| tail(shot.sum / typical, shot.count) < POLICY.shot_tail).collect()
}

/// Returns whether each shot is kept. A shot has the sum of squares d² of k residuals. Those that
/// are no candidates have the variance s² = Σd²/(Σk − p), `least` at least, with the number p of
/// unknowns; d²/(k s²) of a shot follows F(k, Σk − p).
pub(super) fn judge(shots: &[Squares], (unknowns, least): (f64, f64)) -> Vec<bool> {
    let candidates = candidates(shots, least);
    let others = shots.iter().zip(&candidates).filter(|(_, is_candidate)| !**is_candidate);
    let [sum, count] = others.fold([0.0; 2], |[sum, count], (shot, _)| [sum + shot.sum, count + shot.count]);
    let dof = count - unknowns;
    let variance = (sum / dof).max(least);
    let is_outlying = |shot: &Squares| {
        let ratio = shot.sum / shot.count / variance;
        // the distribution fails for larger numbers and for NaN
        let is_number = ratio < f64::MAX.sqrt();
        FisherSnedecor::new(shot.count, dof).is_ok_and(|f| !is_number || f.sf(ratio) < POLICY.shot_tail)
    };
    let keep = shots.iter().zip(candidates).map(|(shot, is_candidate)| !(is_candidate && is_outlying(shot)));
    POLICY.keep_most(keep.collect())
}

#[cfg(test)]
mod tests {
    use super::{Squares, judge};

    #[test]
    fn a_shot_at_an_infinite_distance_is_left_out() {
        let mut shots = vec![Squares { sum: 4.0, count: 4.0 }; 7];
        shots[3].sum = f64::INFINITY;
        let keep = judge(&shots, (0.0, 1.0));
        assert_eq!(keep, [true, true, true, false, true, true, true]);
    }
}
