//! The fit of a table from beginning to end.

use std::sync::Arc;

use nalgebra::DVector;

use super::shot::{Row, RowsError};
use super::table::{list_noises, prepare_table, split_noise};
use crate::measurement::dataset::Dataset;
use crate::measurement::loss::Loss;
use crate::measurement::parameter::Compliance;
use crate::numerics::EXACT;
use crate::problem::effects::choose_effects;
use crate::problem::evaluation::Evaluation;
use crate::problem::false_shots::{Squares, candidates, judge, tail};
use crate::problem::film::causes::{self, Refit};
use crate::problem::findings::Finding;
use crate::problem::intervals::{FitEnd, determine, errors_as_free};
use crate::problem::minimise::{
    Descent, ENOUGH_SHOTS, MAX_STEPS, descend, descend_from_grid, descend_with_noise, fit,
};
use crate::problem::policy::{Choices, POLICY, STALL};
use crate::problem::problem::{Prepared, Problem, State};
use crate::problem::solution::Solution;
use crate::problem::uncertainty::{Estimates, robust_covariance};
use crate::problem::unknowns::{Id, Mode};

/// Distance from a bound within which a search ends at it but for rounding.
const BESIDE: f64 = 1e-9;

/// Fits the shots of a table.
///
/// # Errors
/// See [`RowsError`].
pub(crate) fn fit_rows(dataset: &Dataset, choices: &Choices) -> Result<FitEnd, RowsError> {
    let mut table = prepare_table(dataset, choices)?;
    let mut descent = fit(&mut table.problem, &table.start).ok_or(RowsError::NoStart)?;
    let how = (choices.fidelity.is_none(), dataset.settings.compliance);
    let keep = judge_rows(&table.problem, &descent.end.state, how);
    if keep.contains(&false) {
        table.leave_out(&keep);
        descent = fit(&mut table.problem, &table.start).ok_or(RowsError::NoStart)?;
    }
    if split_noise(&mut table.problem, &descent.end) {
        descent = descend_with_noise(&mut table.problem, descent.end.state);
    }
    let effects = choose_effects(&mut table.problem, &mut descent, how);
    table.record.findings.extend(effects);
    if let Some(explained) = explain(&table.problem, &descent.end, how) {
        table.record.findings.extend(explained.finding);
        (table.problem, descent) = (explained.problem, explained.descent);
    }
    let mut others = Vec::new();
    // many shots show one minimum, which the first search has found
    let are_few = table.start.own[0].len() <= ENOUGH_SHOTS;
    if are_few && !(choices.without_profiles && descent.converged) {
        others = descend_from_grid(&table.problem, &descent.end.state, &table.problem.free(), MAX_STEPS);
        if let Some(lower) = others.first().filter(|least| least.cost < descent.end.cost - STALL) {
            descent = descend_with_noise(&mut table.problem, lower.state.clone());
        }
    }
    let free = table.problem.free();
    let converged = descent.converged;
    table.problem.weigh_again(&mut descent.end);
    // to rounding, so that bounds are met
    descent = descend(&table.problem, descent.end, &free, (MAX_STEPS, EXACT));
    let mut state = descent.end.state.clone();
    for column in free {
        let x = &mut state.shared.0[column];
        let mut bounds = table.problem.unknowns[column].bounds.into_iter();
        *x = bounds.find(|bound| (*x - bound).abs() < BESIDE).unwrap_or(*x);
    }
    descent = Descent { end: table.problem.evaluate(state), converged, ..descent };
    if dataset.side_sd > 0.0
        && let Some(end) = integrate_spins(&table.problem, &descent.end)
    {
        descent = Descent { end, ..descent };
    }
    Ok(finish(table, (descent, others), choices))
}

/// Returns the minimum of χ² + V, V = Σ ln det of the own unknowns' normal matrices: unmeasured
/// spins are integrated over and not only minimised over (Tierney and Kadane 1986, J. Am. Stat.
/// Assoc. 81, 82). To first order it is −½ C ∂V/∂x away from that of χ², with the covariance C.
fn integrate_spins(problem: &Problem, at: &Evaluation) -> Option<Evaluation> {
    /// Part of a standard error over which V changes evenly.
    const VOLUME_STEP: f64 = 0.1;
    let estimates = Estimates::new(problem, at)?;
    let volume = |column: usize, by: f64| {
        let mut state = at.state.clone();
        state.shared.0[column] += by;
        let there = descend(problem, problem.evaluate(state), &[], (MAX_STEPS, STALL)).end;
        Some(there.reduced()?.own_ln_determinant)
    };
    let slope = |column: &usize| {
        let step = VOLUME_STEP * estimates.sd(*column)?;
        Some((volume(*column, step)? - volume(*column, -step)?) / (2.0 * step))
    };
    let slopes: Vec<f64> = estimates.columns.iter().map(slope).collect::<Option<_>>()?;
    let shift = &estimates.covariance * DVector::from_vec(slopes) * -0.5;
    let mut state = at.state.clone();
    for (column, by) in estimates.columns.iter().zip(shift.iter()) {
        let [low, high] = problem.unknowns[*column].bounds;
        let x = &mut state.shared.0[*column];
        *x = (*x + by).clamp(low, high);
    }
    let end = descend(problem, problem.evaluate(state), &[], (MAX_STEPS, STALL)).end;
    end.cost.is_finite().then_some(end)
}

/// Computes what is known at a minimum, besides the ends of descents from elsewhere.
fn finish(table: Prepared, (descent, others): (Descent, Vec<Evaluation>), choices: &Choices) -> FitEnd {
    let Prepared { problem, start, record } = table;
    let (mut covariance, undetermined) = determine(&problem, &descent.end);
    let noises = list_noises(&problem, &descent.end, &covariance);
    let is_robust = problem.is_robust();
    let mut dof = (!noises.is_empty()).then(|| noises.iter().map(|noise| noise.dof).sum::<f64>());
    if let Some(scattered) = robust_covariance(&problem, &descent.end, &covariance) {
        covariance.covariance = scattered;
        dof = Some((start.own[0].len() as f64 - covariance.columns.len() as f64).max(1.0));
    }
    let mut solution = Solution::new(problem, descent, covariance, record);
    let refuted = refutes(solution.at.cost, solution.dof() as f64);
    let refuted = refuted.filter(|_| noises.is_empty() && !is_robust);
    if let Some(ratio) = refuted {
        solution.record.findings.push(Finding::Misfit { ratio, refutes: true });
    }
    let as_free = errors_as_free(&solution.problem, &solution.at, &undetermined).filter(|_| !is_robust);
    let as_free = as_free.unwrap_or_else(|| solution.covariance.clone());
    FitEnd {
        as_free,
        solution: Arc::new(solution),
        undetermined,
        noises,
        dof,
        others,
        profiles: !(choices.without_profiles || is_robust || refuted.is_some()),
    }
}

/// Returns the refit with what explains residuals that the errors do not, unless a fidelity is
/// stated: another ratio of the masses, or a friction or restitution that decreases with speed.
fn explain(problem: &Problem, at: &Evaluation, (is_auto, _): (bool, Compliance)) -> Option<Refit> {
    if !is_auto {
        return None;
    }
    let mut wider = problem.clone();
    let knows_speed = wider.rows()?.shots.iter().all(|shot| shot.knows_speed);
    for (id, is_told) in [(Id::MassRatio, true), (Id::FallB, knows_speed), (Id::ESlope, knows_speed)] {
        let unknown = wider.unknown_mut(id);
        if unknown.mode == Mode::Fixed && is_told {
            unknown.mode = Mode::Tested;
        }
    }
    wider.refresh_contact();
    let at = wider.evaluate(at.state.clone());
    causes::explain(&wider, &at, &Estimates::new(&wider, &at)?)
}

/// Returns whether each shot is kept, by its distance from a robust fit, in which gross errors
/// count little, with what explains its residuals.
fn judge_rows(problem: &Problem, state: &State, how: (bool, Compliance)) -> Vec<bool> {
    let squares = |problem: &Problem, state: &State| -> Vec<Squares> {
        let rows = problem.rows().into_iter().flat_map(|rows| rows.shots.iter());
        let at = problem.evaluate(state.clone());
        let distances = at.shots[0].iter().map(|shot| shot.part.map_or(f64::INFINITY, |part| part.distance));
        let squares_of =
            |(distance, count): (f64, usize)| Squares { sum: distance * distance, count: count as f64 };
        distances.zip(rows.map(|shot| shot.rows.len())).map(squares_of).collect()
    };
    let stays = vec![true; state.own[0].len()];
    if problem.is_robust() || !candidates(&squares(problem, state), least_scale(problem)).contains(&true) {
        return stays;
    }
    let mut robust = problem.clone();
    if let Some(rows) = robust.rows_mut() {
        *rows = rows.clone().with_loss(Loss::Cauchy);
    }
    let mut descent = descend_with_noise(&mut robust, state.clone());
    choose_effects(&mut robust, &mut descent, how);
    if let Some(explained) = explain(&robust, &descent.end, how) {
        (robust, descent) = (explained.problem, explained.descent);
    }
    let unknowns = problem.free().len() as f64;
    judge(&squares(&robust, &descent.end.state), (unknowns, least_scale(&robust)))
}

/// Returns the least variance of the residuals in units of the noise: 1 if it is stated, what
/// rounding leaves if not.
fn least_scale(problem: &Problem) -> f64 {
    let Some(rows) = problem.rows() else { return 1.0 };
    let scale = |row: &Row| {
        row.noise.map_or(1.0, |noise| (rows.pools[noise].least() / rows.variation.noises[noise].sd).powi(2))
    };
    let all: Vec<f64> = rows.shots.iter().flat_map(|shot| shot.rows.iter().map(scale)).collect();
    all.iter().sum::<f64>() / all.len() as f64
}

/// Returns χ² per degree of freedom of numbers with stated errors if it rules the model out. As
/// many parameters as numbers should leave no residual; what they leave is judged as one degree of
/// freedom.
pub(crate) fn refutes(chi2: f64, dof: f64) -> Option<f64> {
    let dof = dof.max(1.0);
    (tail(chi2, dof) < POLICY.shot_tail && chi2 > POLICY.refuted_rows * dof).then_some(chi2 / dof)
}

#[cfg(test)]
mod tests {
    use super::refutes;

    #[test]
    fn both_the_probability_and_the_size_of_chi2_count() {
        let is_refuted = |chi2, dof| refutes(chi2, dof).is_some();
        assert!(is_refuted(3736.0, 1.0));
        // many shots with noise stated too small by a third
        assert!(!is_refuted(1800.0, 1000.0));
        // a single residual of 2.5 standard deviations
        assert!(!is_refuted(6.3, 1.0));
    }
}
