//! The promises of the minimiser: bounds that are met exactly, regions without residuals, dependent unknowns.

use crate::nist::{Dense, MODELS, ROUNDING, Regression, Residuals, mgh09, saturation, unbounded};
use crate::prelude::*;

/// Relative. The reference values are of forty digits; conditioning leaves this much of double precision.
const EXACT: f64 = 1e-11;

/// Cosine between the residuals and a column of the Jacobian that counts as zero, beside the rounding of the
/// residuals: 1e-9 standard errors in problems of up to 250 residuals.
const ORTHOGONAL: f64 = 1e-10;

/// More steps than any of these problems takes.
const MANY: usize = 1000;

fn dense(residuals: Residuals, bounds: Vec<[f64; 2]>) -> Dense {
    Dense { residuals, bounds, size: 0.0 }
}

/// Minimises a certified problem from `start`, moved into the bounds.
fn regress(problem: &Regression, start: &[f64], bounds: &[[f64; 2]]) -> (bool, crate::nist::Linear) {
    let moved = start.iter().zip(bounds).map(|(start, [low, high])| start.clamp(*low, *high));
    let descent = problem.minimise(&moved.collect::<Vec<f64>>(), bounds);
    (descent.converged, descent.end)
}

fn assert_close(computed: f64, expected: f64) {
    assert!((computed / expected - 1.0).abs() <= EXACT, "{computed} instead of {expected}");
}

/// r = (ln x_1, ln x_2).
fn logarithms() -> Residuals<'static> {
    Box::new(|x| (x.map(f64::ln), DMatrix::from_diagonal(&x.map(f64::recip))))
}

/// Minima on bounds, found with mpmath at 40 digits. On b1 = 230 the sum of squares of Misra1a is one of b2 alone: b2 =
/// 5.75225772150151590824006e-4, sum 0.247621969906334608035856, ∂sum/∂b1 = −0.0287 < 0. MGH09 on b1 = 0.18, b3 = 0.2: b2 =
/// 0.497198395389635872795173, b4 = 0.259636924077753296240109, sum 3.83394441302464446344e-4, its gradient −0.00713 in b1 and
/// +0.000294 in b3.
#[test]
fn active_bounds_are_met_exactly() {
    let infinity = f64::INFINITY;
    let misra = Regression::read("Misra1a", saturation);
    let starts = misra.starts.to_vec();
    let mgh = Regression::read("MGH09", mgh09);
    let of_mgh = [[0.17, 0.19, 0.3, 0.13], [0.1, 0.5, 0.5, 0.5], [0.25, 0.39, 0.415, 0.39]];
    let of_mgh: Vec<Vec<f64>> = of_mgh.iter().map(|start| start.to_vec()).collect();
    let b_misra = vec![[0.0, 230.0], [0.0, 1.0]];
    let free = [-infinity, infinity];
    let b_mgh = vec![[-infinity, 0.18], free, [0.2, infinity], free];
    let [x_misra, x_mgh] = [
        vec![230.0, 5.752_257_721_501_516e-4],
        vec![0.18, 0.497_198_395_389_635_9, 0.2, 0.259_636_924_077_753_3],
    ];
    for (problem, starts, bounds, minimum, sum) in [
        (&misra, starts, b_misra, x_misra, 0.247_621_969_906_334_6),
        (&mgh, of_mgh, b_mgh, x_mgh, 3.833_944_413_024_644_5e-4),
    ] {
        for start in starts {
            let (converged, solution) = regress(problem, &start, &bounds);
            assert!(converged);
            for ((found, expected), bounds) in solution.at.x.iter().zip(&minimum).zip(&bounds) {
                assert!(!bounds.contains(expected) || found == expected, "{found} for {expected}");
                assert_close(*found, *expected);
            }
            assert_close(solution.sum(), sum);
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
            let mut bounds = unbounded(n);
            let away = |k: usize| AWAY * problem.standard_deviations[k];
            bounds[j][1] = optimum[j] - away(j);
            let k = (j + 1) % n;
            bounds[k][0] = optimum[k] + if j % 2 == 0 { away(k) } else { -3.0 * away(k) };
            let (converged, solution) = regress(&problem, optimum, &bounds);
            assert!(converged, "{name}, b{}", j + 1);
            let norm = solution.residuals.norm();
            let zero =
                ORTHOGONAL + ROUNDING * f64::EPSILON * DVector::from_column_slice(&problem.y).norm() / norm;
            let gradient = solution.jacobian.tr_mul(&solution.residuals);
            for (i, column) in solution.jacobian.column_iter().enumerate() {
                let cosine = gradient[i] / (column.norm() * norm);
                let (x, [low, high]) = (solution.at.x[i], bounds[i]);
                let is_optimal = if x == low {
                    cosine >= -zero
                } else if x == high {
                    cosine <= zero
                } else {
                    cosine.abs() <= zero
                };
                assert!(is_optimal, "{name}, b{} bounded: cosine {cosine} of b{}", j + 1, i + 1);
                assert!(low <= x && x <= high);
            }
        }
    }
}

#[test]
fn a_start_at_a_bound_leaves_it_or_stays() {
    // Both start at a bound; the minimum (1, 1) is inside the one and beyond the other.
    for first in [0.5, 3.0] {
        let descent = dense(logarithms(), vec![[0.5, 3.0], [2.0, 3.0]]).minimise(&[first, 2.0], MANY);
        assert!(descent.converged);
        assert!((descent.end.at.x[0] - 1.0).abs() <= EXACT);
        assert_eq!(descent.end.at.x[1], 2.0);
    }
}

/// Bounds of widths from 1e-6 to 1e12 beside each other.
#[test]
fn widths_of_very_different_size() {
    let residuals: Residuals = Box::new(|x| {
        let residuals = [1e-9 * x[0] + x[1] - 6.0, x[1] - 1.0, 1e-9 * x[0] - 1.0];
        let jacobian = DMatrix::from_row_slice(3, 2, &[1e-9, 1.0, 0.0, 1.0, 1e-9, 0.0]);
        (DVector::from_column_slice(&residuals), jacobian)
    });
    let problem = dense(residuals, vec![[-1e12, 1e12], [2.0, 2.000_001]]);
    let descent = problem.minimise(&[0.0, 2.000_000_5], MANY);
    assert!(descent.converged);
    // The free minimum is at x_2 = 7/3; on x_2 = 2.000001: 1e-9 x_1 = (1 + 6 − 2.000001)/2.
    assert_eq!(descent.end.at.x[1], 2.000_001);
    assert_close(descent.end.at.x[0], 2.499_999_5e9);
}

#[test]
fn steps_into_a_region_without_residuals_are_shortened() {
    // From 10 the full step ends at 10 − 10 ln 10 < 0, where ln gives NaN.
    let descent = dense(logarithms(), unbounded(2)).minimise(&[10.0, 10.0], MANY);
    assert!(descent.converged);
    assert!(descent.end.at.x.iter().all(|x| (x - 1.0).abs() <= EXACT));
}

#[test]
fn a_minimum_beyond_the_residuals_is_not_called_one() {
    let edge: Residuals =
        Box::new(|x| (x.map(|x| if x >= 1.0 { x } else { f64::NAN }), DMatrix::identity(1, 1)));
    let descent = dense(edge, unbounded(1)).minimise(&[2.0], MANY);
    assert!(!descent.converged);
    let x = descent.end.at.x[0];
    assert!(x >= 1.0 && x - 1.0 < EXACT);
}

#[test]
fn dependent_unknowns_share_one_minimum() {
    // exp(x_1 + x_2) = 3 t for t = 1, 2 in the least-squares sense.
    let residuals = || -> Residuals {
        Box::new(|x| {
            let e = (x[0] + x[1]).exp();
            let jacobian = DMatrix::from_element(2, 2, e);
            (DVector::from_column_slice(&[e - 3.0, e - 6.0]), jacobian)
        })
    };
    for bounds in [unbounded(2), vec![[0.0, 0.7], [-1.0, 5.0]]] {
        let descent = dense(residuals(), bounds).minimise(&[0.0, 0.2], MANY);
        assert!(descent.converged);
        assert!((descent.end.at.x.sum() - 4.5f64.ln()).abs() <= EXACT);
    }
}

#[test]
fn a_wrong_jacobian_is_not_called_converged() {
    let wrong: Residuals = Box::new(|x| (x.clone(), -DMatrix::identity(1, 1)));
    let descent = dense(wrong, unbounded(1)).minimise(&[2.0], MANY);
    assert!(!descent.converged);
    assert_eq!(descent.end.at.x[0], 2.0);
}

#[test]
fn the_limit_of_steps_returns_the_best_point() {
    let descent = dense(logarithms(), unbounded(2)).minimise(&[10.0, 10.0], 2);
    assert!(!descent.converged && descent.steps == 2);
    assert!(descent.end.sum() <= 2.0 * 10f64.ln().powi(2));
}
