//! Shots that fit no collision that the others fit, by the tail probability of their residuals, and
//! clips that are there twice.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::policy::POLICY;
use crate::measurement::dataset::Measured;
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

/// Returns each shot whose impact is that of another within the errors, as no two shots of a player
/// are, with the other: copies of a clip, whatever their first frame, origin and rounding. Of each
/// shot the same quantities are given, of which those without errors do not count.
pub(crate) fn find_copies(shots: &[Vec<Measured>]) -> Vec<[usize; 2]> {
    let square = |(a, b): (&Measured, &Measured)| {
        let variance = a.sd?.powi(2) + b.sd?.powi(2);
        (variance > 0.0).then(|| (a.value - b.value).powi(2) / variance)
    };
    let first = |i: usize| shots[i].first();
    let mut order: Vec<usize> = (0..shots.len()).filter(|i| first(*i).is_some()).collect();
    let key = |i: usize| first(i).map_or(f64::NAN, |number| number.value);
    order.sort_by(|i, j| key(*i).total_cmp(&key(*j)));
    let mut pairs = Vec::new();
    for (place, i) in order.iter().enumerate() {
        for j in &order[place + 1..] {
            let squares: Vec<f64> = shots[*i].iter().zip(&shots[*j]).filter_map(square).collect();
            // the mean of χ²
            let typical = squares.len() as f64;
            if squares.first().is_none_or(|first| *first >= typical) {
                break;
            }
            if squares.iter().sum::<f64>() < typical {
                pairs.extend([[*i, *j], [*j, *i]]);
            }
        }
    }
    pairs
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
