//! One step: the minimum of the linear model ½‖J s + r‖² within a trust region and the constraints, in
//! the scaled step z = D s, with A = R D⁻¹ of columns of norm up to 1.
//!
//! First the ball ‖z‖ ≤ Δ without the inequalities. If x + s then satisfies them it is the step.
//! Otherwise the inequalities come in and the box |z_j| ≤ Δ in the place of the ball: Clarabel suggests
//! which of them are active, the active set solves for the rest by QR.
use nalgebra::{DMatrix, DVector};

use super::active_set;
use super::active_set::{Face, Row};
use super::constraints::{Constraints, Linear};
use super::linear_algebra::{Reduced, ball_step};
use super::qp;
use super::working_set::WorkingSet;

/// The box of a constrained step reaches this many times as far as the unconstrained step: what one
/// parameter is not allowed to do the others may have to make up for, but not by much more than it
/// would have done; and it keeps the numbers handed to Clarabel of order 1.
const BOX: f64 = 4.0;

/// A step from x.
#[derive(Clone, Debug)]
pub struct Step {
    /// x + s, within the constraints; exactly on the bounds that are active.
    pub trial: DVector<f64>,
    /// ‖D s‖.
    pub length: f64,
    /// ‖J s‖.
    pub tangent: f64,
    /// ∇(½‖r‖²)ᵀ s.
    pub slope: f64,
    /// ½‖r‖² − ½‖J s + r‖².
    pub predicted: f64,
    /// Whether the trust region kept the step from the minimum of the model.
    pub limited: bool,
}

/// The step from `x`, which satisfies the constraints. `scale` is the diagonal of D, all positive;
/// `radius` Δ > 0, perhaps ∞.
pub fn step(
    x: &DVector<f64>,
    reduced: &Reduced,
    scale: &DVector<f64>,
    radius: f64,
    constraints: &Constraints,
) -> Step {
    let mut a = reduced.triangle.clone();
    for (mut column, d) in a.column_iter_mut().zip(scale.iter()) {
        column /= *d;
    }
    let q = &reduced.residual;
    let mut rows = equalities(x, reduced, scale, constraints);
    let count = rows.len();
    let mut set = WorkingSet::new(x.len());
    for (i, row) in rows.iter().enumerate() {
        set.push(i, &row.normal);
    }
    let limits: Vec<f64> = set.members().iter().map(|&i| rows[i].limit).collect();
    // z = p + N y on the equalities.
    let particular = set.particular(&limits);
    let basis = set.null_basis();
    let ball = ball_step(&(&a * &basis), &(q + &a * &particular), radius);
    let z = particular + basis * ball.y;
    let trial = x + z.component_div(scale);
    if constraints.allow(&trial) {
        return describe(&a, q, &z, trial, ball.limited);
    }

    let half = radius.min(BOX * z.norm());
    inequalities(&mut rows, x, scale, half, constraints);
    let guess = qp::solve(&a, q, &rows, count, half)
        .unwrap_or_else(|| qp::Guess { z: DVector::zeros(x.len()), active: Vec::new() });
    let solution = active_set::minimise(&a, q, &rows, count, guess.z, &guess.active, half);
    let mut trial = x + solution.z.component_div(scale);
    for (j, value) in trial.iter_mut().enumerate() {
        *value = value.clamp(constraints.lower[j], constraints.upper[j]);
    }
    let mut limited = false;
    for &member in &solution.members {
        match rows[member].face {
            Face::Lower(j) => trial[j] = constraints.lower[j],
            Face::Upper(j) => trial[j] = constraints.upper[j],
            Face::Radius => limited = true,
            Face::Equality | Face::Inequality => {}
        }
    }
    describe(&a, q, &solution.z, trial, limited)
}

fn describe(
    a: &DMatrix<f64>,
    q: &DVector<f64>,
    z: &DVector<f64>,
    trial: DVector<f64>,
    limited: bool,
) -> Step {
    let tangent = a * z;
    // ½‖q‖² − ½‖A z + q‖² = −qᵀA z − ½‖A z‖².
    let slope = q.dot(&tangent);
    let predicted = -slope - 0.5 * tangent.norm_squared();
    Step { trial, length: z.norm(), tangent: tangent.norm(), slope, predicted, limited }
}

/// The rows that hold at every step: parameters with equal bounds, parameters that the residuals do not
/// depend on here and no linear constraint ties to others (they stay where they are), and the
/// equalities between parameters.
fn equalities(
    x: &DVector<f64>,
    reduced: &Reduced,
    scale: &DVector<f64>,
    constraints: &Constraints,
) -> Vec<Row> {
    let n = x.len();
    let tied = |linear: &Linear, j: usize| linear.matrix.column(j).iter().any(|value| *value != 0.0);
    let mut rows = Vec::new();
    for j in 0..n {
        let fixed = constraints.lower[j] == constraints.upper[j];
        let idle = reduced.column_norms[j] == 0.0
            && !tied(&constraints.inequalities, j)
            && !tied(&constraints.equalities, j);
        if fixed || idle {
            rows.push(Row { normal: unit(n, j, 1.0), limit: 0.0, face: Face::Equality });
        }
    }
    let linear = &constraints.equalities;
    rows.extend((0..linear.len()).map(|i| linear_row(linear, i, linear.slack(i, x), scale, Face::Equality)));
    rows
}

/// Appends the inequalities that a step within the box |z_j| ≤ `half` can reach, and the box.
fn inequalities(
    rows: &mut Vec<Row>,
    x: &DVector<f64>,
    scale: &DVector<f64>,
    half: f64,
    constraints: &Constraints,
) {
    let n = x.len();
    let held: Vec<bool> = (0..n).map(|j| rows.iter().any(|row| row.normal == unit(n, j, 1.0))).collect();
    for j in (0..n).filter(|&j| !held[j]) {
        let room = (constraints.upper[j] - x[j]) * scale[j];
        let face = if room <= half { Face::Upper(j) } else { Face::Radius };
        rows.push(Row { normal: unit(n, j, 1.0), limit: room.min(half), face });
        let room = (x[j] - constraints.lower[j]) * scale[j];
        let face = if room <= half { Face::Lower(j) } else { Face::Radius };
        rows.push(Row { normal: unit(n, j, -1.0), limit: room.min(half), face });
    }
    let linear = &constraints.inequalities;
    for i in 0..linear.len() {
        let row = linear_row(linear, i, linear.slack(i, x).max(0.0), scale, Face::Inequality);
        // The largest aᵀ z in the box is half ‖a‖₁.
        if row.limit <= half * row.normal.lp_norm(1) {
            rows.push(row);
        }
    }
}

/// a s ≤ slack as a row of norm 1 in z = D s.
fn linear_row(linear: &Linear, i: usize, slack: f64, scale: &DVector<f64>, face: Face) -> Row {
    let normal = linear.matrix.row(i).transpose().component_div(scale);
    let norm = normal.norm();
    Row { normal: normal / norm, limit: slack / norm, face }
}

fn unit(n: usize, j: usize, sign: f64) -> DVector<f64> {
    let mut vector = DVector::zeros(n);
    vector[j] = sign;
    vector
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::least_squares::linear_algebra::reduce;
    use crate::numerics::least_squares::testing::{ROUNDING, vector};

    /// r = M x − y, linear with correlated columns, at x = 0.
    fn model() -> (DMatrix<f64>, DVector<f64>) {
        (DMatrix::from_row_slice(3, 2, &[1.0, 0.9, 0.0, 1.0, 1.0, 0.0]), vector(&[-3.0, -2.0, -1.5]))
    }

    fn step_from_zero(radius: f64, constraints: &Constraints) -> Step {
        let (jacobian, residuals) = model();
        let reduced = reduce(&jacobian, &residuals).unwrap();
        let scale = reduced.column_norms.clone();
        step(&DVector::zeros(2), &reduced, &scale, radius, constraints)
    }

    #[test]
    fn a_full_step_solves_the_linear_problem() {
        let step = step_from_zero(f64::INFINITY, &Constraints::none(2));
        let (jacobian, residuals) = model();
        let rest = &jacobian * &step.trial + &residuals;
        assert!(jacobian.tr_mul(&rest).norm() < 10.0 * ROUNDING);
        let reduction = 0.5 * (residuals.norm_squared() - rest.norm_squared());
        assert!((step.predicted - reduction).abs() < 10.0 * ROUNDING);
        assert!(!step.limited);
    }

    #[test]
    fn a_bound_is_met_exactly_and_the_other_parameter_makes_up_for_it() {
        for upper in [0.3, 1e-3, 0.0] {
            let constraints = Constraints::bounds(vector(&[-1.0, -1e8]), vector(&[upper, 1e8]));
            let step = step_from_zero(1e3, &constraints);
            assert_eq!(step.trial[0], upper);
            // On x_1 = upper: x_2 = Σ M_2 (y − M_1 upper) / Σ M_2².
            let second = (0.9 * (3.0 - upper) + 2.0) / 1.81;
            assert!((step.trial[1] - second).abs() < ROUNDING);
            assert!(!step.limited);
        }
    }

    #[test]
    fn a_small_radius_holds_a_constrained_step_back() {
        let constraints = Constraints::bounds(vector(&[-1.0, -1.0]), vector(&[1e-3, 1.0]));
        let step = step_from_zero(0.1, &constraints);
        assert_eq!(step.trial[0], 1e-3);
        assert!(step.limited && step.length <= 0.1 * 2f64.sqrt());
        assert!(step.predicted > 0.0);
    }

    #[test]
    fn equal_bounds_and_idle_parameters_stay() {
        let constraints = Constraints::bounds(vector(&[0.0, -1.0]), vector(&[0.0, 10.0]));
        let fixed = step_from_zero(1e3, &constraints);
        assert_eq!(fixed.trial[0], 0.0);
        assert!((fixed.trial[1] - 4.7 / 1.81).abs() < ROUNDING);

        let jacobian = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 1.0, 0.0]);
        let reduced = reduce(&jacobian, &vector(&[-1.0, -2.0])).unwrap();
        let constraints = Constraints::bounds(vector(&[-1.0, 0.5]), vector(&[1.0, 2.0]));
        let idle = step(&vector(&[0.0, 0.5]), &reduced, &vector(&[2f64.sqrt(), 1.0]), 1e3, &constraints);
        assert_eq!(idle.trial, vector(&[1.0, 0.5]));
    }

    #[test]
    fn linear_constraints_between_parameters() {
        let row = |limit: f64| Linear {
            matrix: DMatrix::from_row_slice(1, 2, &[1.0, -2.0]),
            limit: vector(&[limit]),
        };
        let (jacobian, residuals) = model();
        // On x_1 = 2 x_2: the one column M (2, 1)ᵀ.
        let column = &jacobian * vector(&[2.0, 1.0]);
        let along = -column.dot(&residuals) / column.norm_squared();
        let mut equal = Constraints::none(2);
        equal.equalities = row(0.0);
        let mut below = Constraints::none(2);
        below.inequalities = Linear { matrix: -row(0.0).matrix, limit: vector(&[0.0]) };
        for constraints in [equal, below] {
            let step = step_from_zero(1e3, &constraints);
            assert!((&step.trial - vector(&[2.0, 1.0]) * along).norm() < 10.0 * ROUNDING);
            assert!(!step.limited);
        }
        // One that cannot be reached changes nothing.
        let mut far = Constraints::none(2);
        far.inequalities = row(1e6);
        assert_eq!(step_from_zero(1e3, &far).trial, step_from_zero(1e3, &Constraints::none(2)).trial);
    }
}
