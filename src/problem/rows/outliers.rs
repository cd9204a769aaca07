//! Shots of a table that fit no collision that the others fit, and tables that refute the model.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use crate::measurement::loss::Loss;
use crate::numerics::median;
use crate::problem::film::outliers::tail;
use crate::problem::minimise::descend_with_noise;
use crate::problem::policy::Policy;
use crate::problem::problem::{Problem, State};

/// Returns whether each shot is kept. The distance d of a shot from a robust fit, in which gross
/// errors count little, has d² of its k numbers as a sum of squares; with the mean s² = Σd²/(Σk −
/// p) of the shots that are no candidates, d²/(k s²) follows F(k, Σk − p).
pub(super) fn judge_rows(problem: &Problem, state: &State, policy: &Policy) -> Vec<bool> {
    let squares = |problem: &Problem, state: &State| -> Vec<(f64, f64)> {
        let numbers =
            problem.rows().into_iter().flat_map(|rows| rows.shots.iter()).map(|shot| shot.rows.len());
        let at = problem.evaluate(state.clone());
        let distances = at.shots[0].iter().map(|shot| shot.part.map_or(f64::INFINITY, |part| part.distance));
        distances.map(|distance| distance * distance).zip(numbers.map(|numbers| numbers as f64)).collect()
    };
    let all = vec![true; state.own[0].len()];
    let is_robust = problem.rows().is_none_or(|rows| rows.loss != Loss::Squares);
    if is_robust || !candidates(&squares(problem, state), least_scale(problem), policy).contains(&true) {
        return all;
    }
    let mut robust = problem.clone();
    if let Some(rows) = robust.rows_mut() {
        *rows = rows.clone().with_loss(Loss::Cauchy);
    }
    let descent = descend_with_noise(&mut robust, state.clone());
    let shots = squares(&robust, &descent.end.state);
    let least = least_scale(&robust);
    let candidates = candidates(&shots, least, policy);
    let others = shots.iter().zip(&candidates).filter(|(_, is_candidate)| !**is_candidate);
    let (square, count) = others.fold((0.0, 0.0), |sum, (shot, _)| (sum.0 + shot.0, sum.1 + shot.1));
    let dof = count - problem.free().len() as f64;
    let scale = (square / dof).max(least);
    let is_outlying = |(square, count): &(f64, f64)| {
        let ratio = (square / count / scale).min(f64::MAX);
        FisherSnedecor::new(*count, dof).is_ok_and(|f| f.sf(ratio) < policy.shot_tail)
    };
    let keep: Vec<bool> = shots
        .iter()
        .zip(&candidates)
        .map(|(shot, is_candidate)| !(*is_candidate && dof >= 1.0 && scale > 0.0 && is_outlying(shot)))
        .collect();
    let lost = keep.iter().filter(|keep| !**keep).count();
    if lost as f64 > (policy.max_lost * keep.len() as f64).max(1.0) { all } else { keep }
}

/// Returns whether each shot, of this sum of squares and number of numbers, is farther away than
/// chance has it at the scale of the median shot.
fn candidates(shots: &[(f64, f64)], least: f64, policy: &Policy) -> Vec<bool> {
    let chi2 = |count: f64| ChiSquared::new(count).ok();
    let scale = |(square, count): &(f64, f64)| chi2(*count).map_or(f64::NAN, |c| square / c.inverse_cdf(0.5));
    let typical = median(shots.iter().map(scale).collect()).max(least);
    let is_candidate = |(square, count): &(f64, f64)| {
        chi2(*count).is_some_and(|c| c.sf(square / typical) < policy.shot_tail)
    };
    shots.iter().map(is_candidate).collect()
}

/// Returns the least variance of the residuals in units of the noise: 1 if it is stated, what
/// rounding leaves if not.
fn least_scale(problem: &Problem) -> f64 {
    let Some(rows) = problem.rows() else { return 1.0 };
    let of_row = |row: &super::shot::Row| {
        row.noise.map_or(1.0, |noise| (rows.pools[noise].least() / rows.noises[noise].sd).powi(2))
    };
    let all: Vec<f64> = rows.shots.iter().flat_map(|shot| shot.rows.iter().map(of_row)).collect();
    all.iter().sum::<f64>() / all.len() as f64
}

/// Returns χ² per degree of freedom of numbers with stated errors if it rules the model out. As many
/// parameters as numbers should leave no residual; what they leave is judged as one degree of freedom.
pub(crate) fn refutes(chi2: f64, dof: f64, policy: &Policy) -> Option<f64> {
    let dof = dof.max(1.0);
    (tail(chi2, dof) < policy.shot_tail && chi2 > policy.refuted_rows * dof).then_some(chi2 / dof)
}

#[cfg(test)]
mod tests {
    use super::{Policy, refutes};

    #[test]
    fn both_the_probability_and_the_size_of_chi2_count() {
        let is_refuted = |chi2, dof| refutes(chi2, dof, &Policy::default()).is_some();
        assert!(is_refuted(3736.0, 1.0));
        // many shots with noise stated too small by a third
        assert!(!is_refuted(1800.0, 1000.0));
        // a single residual of 2.5 standard deviations
        assert!(!is_refuted(6.3, 1.0));
    }
}
