//! The convex quadratic program of a step that meets a constraint, solved by Clarabel:
//!
//!   min ½‖A z + q‖² + ½λ‖z‖²  subject to  a_iᵀ z = d_i (equalities),  a_iᵀ z ≤ d_i (the others).
//!
//! An interior-point solution is never exactly on a constraint. What is wanted of it is which
//! constraints hold with equality; [`super::active_set`] makes it exact.
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, ZeroConeT};
use nalgebra::{DMatrix, DVector};

use super::active_set::Row;

/// λ, beside columns of A of norm up to 1: makes the program strictly convex where the Jacobian is
/// rank-deficient, too small to move an active set.
const REGULARISATION: f64 = 1e-10;

/// What Clarabel suggests of the solution: a point, and the inequalities that hold there, the surest
/// first.
#[derive(Clone, Debug)]
pub struct Guess {
    pub z: DVector<f64>,
    pub active: Vec<usize>,
}

/// Solves the program over z of size up to `unit`: with w = z / `unit` and the objective divided by its
/// steepest slope every number handed to Clarabel is of order 1. The first `equalities` of `rows` are
/// equalities. `None` when Clarabel ends without a solution.
pub fn solve(
    a: &DMatrix<f64>,
    q: &DVector<f64>,
    rows: &[Row],
    equalities: usize,
    unit: f64,
) -> Option<Guess> {
    let n = a.ncols();
    // ½‖A z + q‖² = unit² (½ wᵀAᵀA w + wᵀAᵀq / unit) + a constant.
    let slope = a.tr_mul(q) / unit;
    let steepest = slope.amax();
    if !steepest.is_normal() {
        return None;
    }
    let gram = (a.tr_mul(a) + DMatrix::identity(n, n) * REGULARISATION) / steepest;
    let p = csc(n, n, |i, j| if i <= j { gram[(i, j)] } else { 0.0 });
    let c: Vec<f64> = slope.iter().map(|value| value / steepest).collect();
    let matrix = csc(rows.len(), n, |i, j| rows[i].normal[j]);
    let limits: Vec<f64> = rows.iter().map(|row| row.limit / unit).collect();
    let cones = [ZeroConeT(equalities), NonnegativeConeT(rows.len() - equalities)];
    let settings = DefaultSettings { verbose: false, presolve_enable: false, ..DefaultSettings::default() };

    let mut solver = DefaultSolver::new(&p, &c, &matrix, &limits, &cones, settings).ok()?;
    solver.solve();
    let solution = &solver.solution;
    match solution.status {
        SolverStatus::Solved | SolverStatus::AlmostSolved => {}
        // z = 0 is feasible and the objective bounded below, so that an infeasibility is a failure like
        // the others.
        SolverStatus::PrimalInfeasible
        | SolverStatus::DualInfeasible
        | SolverStatus::AlmostPrimalInfeasible
        | SolverStatus::AlmostDualInfeasible
        | SolverStatus::Unsolved
        | SolverStatus::MaxIterations
        | SolverStatus::MaxTime
        | SolverStatus::NumericalError
        | SolverStatus::InsufficientProgress
        | SolverStatus::CallbackTerminated => return None,
    }
    // Strict complementarity: dual above slack. The dual is in units of the steepest slope.
    let mut active: Vec<usize> =
        (equalities..rows.len()).filter(|&i| solution.z[i] > solution.s[i]).collect();
    active.sort_by(|&i, &j| solution.z[j].total_cmp(&solution.z[i]));
    Some(Guess { z: DVector::from_column_slice(&solution.x) * unit, active })
}

/// The matrix of the entries that are not zero, by columns.
fn csc(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> f64) -> CscMatrix<f64> {
    let (mut starts, mut indices, mut values) = (vec![0], Vec::new(), Vec::new());
    for j in 0..columns {
        for i in 0..rows {
            let value = entry(i, j);
            if value != 0.0 {
                indices.push(i);
                values.push(value);
            }
        }
        starts.push(values.len());
    }
    CscMatrix::new(rows, columns, starts, indices, values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::least_squares::active_set::Face;

    fn row(normal: &[f64], limit: f64) -> Row {
        Row { normal: DVector::from_row_slice(normal), limit, face: Face::Radius }
    }

    fn square(half: f64) -> Vec<Row> {
        vec![row(&[1.0, 0.0], half), row(&[-1.0, 0.0], half), row(&[0.0, 1.0], half), row(&[0.0, -1.0], half)]
    }

    #[test]
    fn the_active_constraint_is_found_at_any_size() {
        // The nearest point of a square to (3, 0.2), in units of half its side, is (1, 0.2).
        for unit in [1e-12, 1.0, 1e12] {
            let q = DVector::from_row_slice(&[-3.0, -0.2]) * unit;
            let guess = solve(&DMatrix::identity(2, 2), &q, &square(unit), 0, unit).unwrap();
            assert_eq!(guess.active, [0]);
            assert!((guess.z / unit - DVector::from_row_slice(&[1.0, 0.2])).norm() < 1e-6);
        }
    }

    #[test]
    fn equalities_hold_and_a_flat_objective_needs_no_solution() {
        let mut rows = square(1.0);
        rows.insert(0, row(&[1.0, 1.0], 0.0));
        let q = DVector::from_row_slice(&[-3.0, 0.0]);
        let guess = solve(&DMatrix::identity(2, 2), &q, &rows, 1, 1.0).unwrap();
        assert!((guess.z[0] + guess.z[1]).abs() < 1e-6);
        assert!(solve(&DMatrix::identity(2, 2), &DVector::zeros(2), &rows, 1, 1.0).is_none());
    }
}
