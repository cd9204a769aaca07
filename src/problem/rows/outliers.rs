//! Shots of a table that fit no collision that the others fit, and tables that refute the model.

use super::shot::Row;
use crate::measurement::loss::Loss;
use crate::problem::false_shots::{Squares, candidates, judge, tail};
use crate::problem::minimise::descend_with_noise;
use crate::problem::policy::Policy;
use crate::problem::problem::{Problem, State};

/// Returns whether each shot is kept, by its distance from a robust fit, in which gross errors
/// count little.
pub(super) fn judge_rows(problem: &Problem, state: &State, policy: &Policy) -> Vec<bool> {
    let squares = |problem: &Problem, state: &State| -> Vec<Squares> {
        let rows = problem.rows().into_iter().flat_map(|rows| rows.shots.iter());
        let at = problem.evaluate(state.clone());
        let distances = at.shots[0].iter().map(|shot| shot.part.map_or(f64::INFINITY, |part| part.distance));
        let of_shot =
            |(distance, count): (f64, usize)| Squares { sum: distance * distance, count: count as f64 };
        distances.zip(rows.map(|shot| shot.rows.len())).map(of_shot).collect()
    };
    let stays = vec![true; state.own[0].len()];
    if problem.is_robust()
        || !candidates(&squares(problem, state), least_scale(problem), policy).contains(&true)
    {
        return stays;
    }
    let mut robust = problem.clone();
    if let Some(rows) = robust.rows_mut() {
        *rows = rows.clone().with_loss(Loss::Cauchy);
    }
    let descent = descend_with_noise(&mut robust, state.clone());
    let unknowns = problem.free().len() as f64;
    judge(&squares(&robust, &descent.end.state), (unknowns, least_scale(&robust)), policy)
}

/// Returns the least variance of the residuals in units of the noise: 1 if it is stated, what
/// rounding leaves if not.
fn least_scale(problem: &Problem) -> f64 {
    let Some(rows) = problem.rows() else { return 1.0 };
    let of_row = |row: &Row| {
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
