//! The promises of `least_squares::minimise`: exact active bounds, regions where the residuals cannot be
//! evaluated, dependent parameters, wrong use.
use argmin::core::{Error, Jacobian, Operator};
use caromfit::numerics::least_squares::{
    Activity, Bounds, OptimiseError, Options, Solution, Termination, minimise,
};

use crate::nist::{MODELS, Regression, mgh09, saturation};
use crate::prelude::*;

/// Relative. The reference values are of forty digits; conditioning leaves this much of double precision.
const EXACT: f64 = 1e-11;

/// Cosine between the residuals and a column of the Jacobian that counts as zero, beside the rounding of the
/// residuals: 1e-9 standard errors in problems of up to 250 residuals.
const ORTHOGONAL: f64 = 1e-10;

/// Rounding of a residual in units of ε |y|.
const ROUNDING: f64 = 4.0;

type Residuals = fn(&DVector<f64>) -> Result<DVector<f64>, Error>;
type Derivatives = fn(&DVector<f64>) -> DMatrix<f64>;

struct Problem {
    residuals: Residuals,
    derivatives: Derivatives,
}

impl Operator for Problem {
    type Param = DVector<f64>;
    type Output = DVector<f64>;

    fn apply(&self, x: &DVector<f64>) -> Result<DVector<f64>, Error> {
        (self.residuals)(x)
    }
}

impl Jacobian for Problem {
    type Param = DVector<f64>;
    type Jacobian = DMatrix<f64>;

    fn jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, Error> {
        Ok((self.derivatives)(x))
    }
}

fn vector(values: &[f64]) -> DVector<f64> {
    DVector::from_row_slice(values)
}

fn solve(problem: Problem, start: &[f64], bounds: &Bounds) -> Solution {
    minimise(problem, &vector(start), bounds, &Options::default()).unwrap()
}

/// Minimises a certified problem from `start`, moved into the bounds.
fn regress(problem: &Regression, start: &[f64], bounds: &Bounds) -> Solution {
    let moved = |(j, start): (usize, &f64)| start.clamp(bounds.lower[j], bounds.upper[j]);
    problem.minimise(&start.iter().enumerate().map(moved).collect::<Vec<f64>>(), bounds)
}

fn assert_close(computed: f64, expected: f64) {
    assert!((computed / expected - 1.0).abs() <= EXACT, "{computed} instead of {expected}");
}

/// r = (ln x_1, ln x_2).
fn logarithms() -> Problem {
    Problem {
        residuals: |x| Ok(x.map(f64::ln)),
        derivatives: |x| DMatrix::from_diagonal(&x.map(|x| 1.0 / x)),
    }
}

/// Minima on bounds, found with mpmath at 40 digits. On b1 = 230 the sum of squares of Misra1a is one of b2 alone: b2 =
/// 5.75225772150151590824006e-4, sum 0.247621969906334608035856, ∂sum/∂b1 = −0.0287 < 0. MGH09 on b1 = 0.18, b3 = 0.2: b2 =
/// 0.497198395389635872795173, b4 = 0.259636924077753296240109, sum 3.83394441302464446344e-4, its gradient −0.00713 in b1 and
/// +0.000294 in b3.
#[test]
fn active_bounds_are_met_exactly() {
    use Activity::{AtLower, AtUpper, Free};
    let infinity = f64::INFINITY;
    let misra = Regression::read("Misra1a", saturation);
    let starts = misra.starts.to_vec();
    let mgh = Regression::read("MGH09", mgh09);
    let of_mgh = [[0.17, 0.19, 0.3, 0.13], [0.1, 0.5, 0.5, 0.5], [0.25, 0.39, 0.415, 0.39]];
    let of_mgh: Vec<Vec<f64>> = of_mgh.iter().map(|start| start.to_vec()).collect();
    let b_misra = Bounds::new(vector(&[0.0, 0.0]), vector(&[230.0, 1.0]));
    let lower = vector(&[-infinity, -infinity, 0.2, -infinity]);
    let b_mgh = Bounds::new(lower, vector(&[0.18, infinity, infinity, infinity]));
    let [x_misra, x_mgh] = [
        vec![230.0, 5.752_257_721_501_516e-4],
        vec![0.18, 0.497_198_395_389_635_9, 0.2, 0.259_636_924_077_753_3],
    ];
    for (problem, starts, bounds, minimum, active, sum) in [
        (&misra, starts, &b_misra, x_misra, vec![AtUpper, Free], 0.247_621_969_906_334_6),
        (&mgh, of_mgh, &b_mgh, x_mgh, vec![AtUpper, Free, AtLower, Free], 3.833_944_413_024_644_5e-4),
    ] {
        for start in starts {
            let solution = regress(problem, &start, bounds);
            assert!(solution.termination.converged());
            assert_eq!(solution.active, active);
            for ((found, expected), activity) in solution.x.iter().zip(&minimum).zip(&active) {
                assert!(*activity == Free || found == expected, "{found} for {expected}");
                assert_close(*found, *expected);
            }
            assert_close(2.0 * solution.cost, sum);
        }
    }
}

/// Every certified problem, each parameter in turn kept from its optimum, and each pair of neighbours: the
/// bounds are exact and the conditions of Karush, Kuhn and Tucker hold.
#[test]
fn the_optimality_conditions_hold_whatever_the_bounds() {
    /// How far from its optimum a parameter is kept, in standard deviations.
    const AWAY: f64 = 0.5;
    for (name, model) in MODELS {
        let problem = Regression::read(name, model);
        let (n, optimum) = (problem.parameters.len(), &problem.parameters);
        for j in 0..n {
            let mut bounds = Bounds::none(n);
            let away = |k: usize| AWAY * problem.standard_deviations[k];
            bounds.upper[j] = optimum[j] - away(j);
            let k = (j + 1) % n;
            bounds.lower[k] = optimum[k] + if j % 2 == 0 { away(k) } else { -3.0 * away(k) };
            let solution = regress(&problem, optimum, &bounds);
            assert!(solution.termination.converged(), "{name}, b{}: {}", j + 1, solution.termination);
            let noise = ROUNDING * f64::EPSILON * vector(&problem.y).norm() / solution.residuals.norm();
            let zero = ORTHOGONAL + noise;
            let gradient = solution.jacobian.tr_mul(&solution.residuals);
            for (i, column) in solution.jacobian.column_iter().enumerate() {
                let cosine = gradient[i] / (column.norm() * solution.residuals.norm());
                let optimal = match solution.active[i] {
                    Activity::Free => cosine.abs() <= zero,
                    Activity::AtLower => cosine >= -zero,
                    Activity::AtUpper => cosine <= zero,
                };
                assert!(optimal, "{name}, b{} bounded: cosine {cosine} of b{}", j + 1, i + 1);
                assert!(bounds.lower[i] <= solution.x[i] && solution.x[i] <= bounds.upper[i]);
            }
        }
    }
}

#[test]
fn a_start_at_a_bound_leaves_it_or_stays() {
    let bounds = Bounds::new(vector(&[0.5, 2.0]), vector(&[3.0, 3.0]));
    // Both start at a bound; the minimum (1, 1) is inside the one and beyond the other.
    for first in [0.5, 3.0] {
        let solution = solve(logarithms(), &[first, 2.0], &bounds);
        assert!(solution.termination.converged());
        assert_close(solution.x[0], 1.0);
        assert_eq!(solution.x[1], 2.0);
        assert_eq!(solution.active, [Activity::Free, Activity::AtLower]);
    }
}

/// Bounds of widths from 1e-6 to 1e12 beside each other.
#[test]
fn widths_of_very_different_size() {
    let bounds = Bounds::new(vector(&[-1e12, 2.0]), vector(&[1e12, 2.000_001]));
    let residuals: Residuals = |x| Ok(vector(&[1e-9 * x[0] + x[1] - 6.0, x[1] - 1.0, 1e-9 * x[0] - 1.0]));
    let derivatives: Derivatives = |_| DMatrix::from_row_slice(3, 2, &[1e-9, 1.0, 0.0, 1.0, 1e-9, 0.0]);
    let solution = solve(Problem { residuals, derivatives }, &[0.0, 2.000_000_5], &bounds);
    assert!(solution.termination.converged());
    // The free minimum is at x_2 = 7/3; on x_2 = 2.000001: 1e-9 x_1 = (1 + 6 − 2.000001)/2.
    assert_eq!(solution.x[1], 2.000_001);
    assert_close(solution.x[0], 2.499_999_5e9);
}

#[test]
fn steps_into_a_region_without_residuals_are_shortened() {
    // From 10 the full step ends at 10 − 10 ln 10 < 0: ln gives NaN, or the problem an error.
    let solution = solve(logarithms(), &[10.0, 10.0], &Bounds::none(2));
    assert!(solution.termination.converged());
    assert!(solution.x.iter().all(|x| (x - 1.0).abs() <= EXACT));
    let refusing = Problem {
        residuals: |x| if x.min() > 0.0 { Ok(x.map(f64::ln)) } else { Err(Error::msg("negative")) },
        derivatives: logarithms().derivatives,
    };
    assert_eq!(solve(refusing, &[10.0, 10.0], &Bounds::none(2)).x, solution.x);
}

#[test]
fn a_minimum_beyond_the_residuals_is_not_called_one() {
    let edge = Problem {
        residuals: |x| Ok(x.map(|x| if x >= 1.0 { x } else { f64::NAN })),
        derivatives: |_| DMatrix::identity(1, 1),
    };
    let solution = solve(edge, &[2.0], &Bounds::none(1));
    assert_eq!(solution.termination, Termination::NotFinite);
    assert!(!solution.termination.converged());
    assert!(solution.x[0] >= 1.0 && solution.x[0] - 1.0 < EXACT);
}

#[test]
fn dependent_parameters_share_one_minimum() {
    // exp(x_1 + x_2) = 3 t for t = 1, 2 in the least-squares sense, x_3 without effect.
    let problem = Problem {
        residuals: |x| Ok(vector(&[(x[0] + x[1]).exp() - 3.0, (x[0] + x[1]).exp() - 6.0])),
        derivatives: |x| {
            let e = (x[0] + x[1]).exp();
            DMatrix::from_row_slice(2, 3, &[e, e, 0.0, e, e, 0.0])
        },
    };
    let bounds = Bounds::new(vector(&[0.0, -1.0, 0.0]), vector(&[0.7, 5.0, 1.0]));
    for bounds in [Bounds::none(3), bounds] {
        let solution = solve(Problem { ..problem }, &[0.0, 0.2, 0.25], &bounds);
        assert!(solution.termination.converged());
        assert_close(solution.x[0] + solution.x[1], 4.5f64.ln());
        assert_eq!(solution.x[2], 0.25);
    }
}

#[test]
fn zero_residuals_and_a_start_at_the_minimum() {
    let solution = solve(logarithms(), &[1.0, 1.0], &Bounds::none(2));
    assert_eq!((solution.termination, solution.iterations), (Termination::ZeroResidual, 0));
    let solution = solve(logarithms(), &[2.0, 0.3], &Bounds::none(2));
    assert!(solution.termination.converged());
    assert!(solution.iterations < 20);
}

#[test]
fn a_wrong_jacobian_is_not_called_converged() {
    let wrong = Problem { residuals: |x| Ok(x.clone()), derivatives: |_| -DMatrix::identity(1, 1) };
    let solution = solve(wrong, &[2.0], &Bounds::none(1));
    assert_eq!(solution.termination, Termination::Stalled);
    assert_eq!(solution.x[0], 2.0);
}

#[test]
fn the_iteration_limit_returns_the_best_point() {
    let options = Options { max_iterations: 2, ..Options::default() };
    let solution = minimise(logarithms(), &vector(&[10.0, 10.0]), &Bounds::none(2), &options).unwrap();
    assert_eq!((solution.termination, solution.iterations), (Termination::MaxIterations, 2));
    assert!(solution.cost <= 10f64.ln().powi(2));
    assert!((solution.residuals.norm_squared() / 2.0 - solution.cost).abs() <= EXACT);
}

#[test]
fn wrong_use_is_an_error() {
    let run = |problem: Problem, start: &[f64], bounds: &Bounds| {
        minimise(problem, &vector(start), bounds, &Options::default()).unwrap_err()
    };
    let none = Bounds::none(2);
    assert!(matches!(run(logarithms(), &[], &none), OptimiseError::NoParameters));
    assert!(matches!(run(logarithms(), &[1.0], &none), OptimiseError::Length { expected: 1, found: 2, .. }));
    assert!(matches!(run(logarithms(), &[-1.0, 1.0], &none), OptimiseError::NotFinite));
    assert!(matches!(run(logarithms(), &[1.0, f64::NAN], &none), OptimiseError::Start { index: 1, .. }));
    let infinity = f64::INFINITY;
    for (lower, upper) in [(2.0, 1.0), (f64::NAN, 1.0), (infinity, infinity), (-infinity, -infinity)] {
        let bounds = Bounds::new(vector(&[0.0, lower]), vector(&[3.0, upper]));
        assert!(matches!(run(logarithms(), &[1.0, 1.0], &bounds), OptimiseError::Start { index: 1, .. }));
    }
    let above = Bounds::new(vector(&[2.0, 0.0]), vector(&[3.0, 3.0]));
    assert!(matches!(run(logarithms(), &[1.0, 1.0], &above), OptimiseError::Start { index: 0, .. }));

    let derivatives = logarithms().derivatives;
    let failing = Problem { residuals: |_| Err(Error::msg("no table")), derivatives };
    let error = run(failing, &[1.0, 1.0], &none);
    assert!(std::error::Error::source(&error).unwrap().to_string().contains("no table"));
    let empty = Problem { residuals: |_| Ok(DVector::zeros(0)), derivatives };
    assert!(matches!(run(empty, &[1.0, 1.0], &none), OptimiseError::NoResiduals));
    let infinite = Problem {
        residuals: logarithms().residuals,
        derivatives: |_| DMatrix::from_element(2, 2, f64::INFINITY),
    };
    assert!(matches!(run(infinite, &[2.0, 1.0], &none), OptimiseError::NotFinite));
    let short = Problem { residuals: logarithms().residuals, derivatives: |_| DMatrix::zeros(1, 2) };
    assert!(matches!(run(short, &[2.0, 1.0], &none), OptimiseError::Length { expected: 2, found: 1, .. }));
    // A number of residuals that depends on the parameters.
    let changing = Problem {
        residuals: |x| Ok(DVector::repeat(if x[0] == 2.0 { 2 } else { 3 }, x[0])),
        derivatives: |_| DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 1.0, 0.0]),
    };
    assert!(matches!(run(changing, &[2.0, 1.0], &none), OptimiseError::Length { expected: 2, found: 3, .. }));
    let options = Options { orthogonality: f64::NAN, ..Options::default() };
    assert!(matches!(
        minimise(logarithms(), &vector(&[1.0, 1.0]), &none, &options),
        Err(OptimiseError::Orthogonality(_))
    ));
}
