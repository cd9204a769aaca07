//! One step: the minimum of the linear model ½‖J s + r‖² within a trust region and the bounds, in
//! the scaled step z = D s, with A = R D⁻¹ of columns of norm up to 1.
//!
//! The ball ‖z‖ ≤ Δ is tried first. If x + s lies within the bounds, it is the step. Otherwise the
//! bounds enter and the box |z_j| ≤ Δ replaces the ball: least squares within a box, by active
//! sets.
//!
//! - Stark, P. B. and Parker, R. L. (1995). Bounded-variable least squares: an algorithm and
//!   applications. Computational Statistics 10, 129–141.
use nalgebra::{DMatrix, DVector};

use super::bounds::Bounds;
use super::linear_algebra::{Reduced, ball_step, basic_solution};

/// Half width of the box of a bounded step, in units of the length of the unbounded one: the other
/// parameters may make up for one that meets its bound, but within reason.
const BOX: f64 = 4.0;

/// Slope of the cost into the box, in units of ‖q‖, below which a parameter stays at its bound: the
/// rounding of Aᵀ(A z + q) for columns of A of norm up to 1.
const SLOPE_ROUNDING: f64 = 1e-14;

/// Maximum number of changes of the active set per parameter. Each parameter is held and freed a
/// few times at most, unless rounding makes the method cycle.
const CHANGES_PER_PARAMETER: usize = 10;

/// A step from x.
#[derive(Clone, Debug)]
pub struct Step {
    /// x + s, within the bounds; exactly on those that are active.
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
    pub is_limited: bool,
}

/// Returns the step from `x`, which lies within the bounds. `scale` is the diagonal of D, all
/// positive; `radius` is Δ > 0, perhaps ∞.
pub fn step(x: &DVector<f64>, reduced: &Reduced, scale: &DVector<f64>, radius: f64, bounds: &Bounds) -> Step {
    // A parameter that is fixed, or that the residuals do not depend on here, is kept.
    let moves = |j: &usize| bounds.lower[*j] < bounds.upper[*j] && reduced.column_norms[*j] != 0.0;
    let moving: Vec<usize> = (0..x.len()).filter(moves).collect();
    let mut a = reduced.triangle.select_columns(&moving);
    for (mut column, j) in a.column_iter_mut().zip(&moving) {
        column /= scale[*j];
    }
    let q = &reduced.residual;
    let ball = ball_step(&a, q, radius);
    let mut trial = x.clone();
    for (z, &j) in ball.y.iter().zip(&moving) {
        trial[j] += z / scale[j];
    }
    if bounds.contain(&trial) {
        return describe(&a, q, &ball.y, trial, ball.is_limited);
    }

    let half = radius.min(BOX * ball.y.norm());
    let room = |bound: &DVector<f64>| {
        DVector::from_iterator(moving.len(), moving.iter().map(|&j| (bound[j] - x[j]) * scale[j]))
    };
    let (below, above) = (room(&bounds.lower), room(&bounds.upper));
    let z = box_step(&a, q, &Bounds::new(below.map(|z| z.max(-half)), above.map(|z| z.min(half))));
    let mut is_limited = false;
    for (k, &j) in moving.iter().enumerate() {
        trial[j] = match z[k] {
            z if z == below[k] => bounds.lower[j],
            z if z == above[k] => bounds.upper[j],
            z => (x[j] + z / scale[j]).clamp(bounds.lower[j], bounds.upper[j]),
        };
        is_limited |= z[k].abs() == half && z[k] != below[k] && z[k] != above[k];
    }
    describe(&a, q, &z, trial, is_limited)
}

fn describe(
    a: &DMatrix<f64>,
    q: &DVector<f64>,
    z: &DVector<f64>,
    trial: DVector<f64>,
    is_limited: bool,
) -> Step {
    let tangent = a * z;
    // ½‖q‖² − ½‖A z + q‖² = −qᵀA z − ½‖A z‖².
    let slope = q.dot(&tangent);
    let predicted = -slope - 0.5 * tangent.norm_squared();
    Step { trial, length: z.norm(), tangent: tangent.norm(), slope, predicted, is_limited }
}

/// Minimises ½‖A z + q‖² within a box around 0, exact to rounding: solves for the free parameters,
/// holds the one that first meets its bound on the way there, and frees the held one whose cost
/// decreases most into the box.
fn box_step(a: &DMatrix<f64>, q: &DVector<f64>, bounds: &Bounds) -> DVector<f64> {
    let mut z = DVector::zeros(a.ncols());
    let mut is_held = vec![false; a.ncols()];
    for _ in 0..CHANGES_PER_PARAMETER * a.ncols() {
        let target = minimise_free(a, q, &z, &is_held);
        if let Some(Crossing { parameter, bound, fraction }) = first_crossing(&z, &target, bounds) {
            z += (target - &z) * fraction;
            z[parameter] = bound;
            is_held[parameter] = true;
            continue;
        }
        z = target;
        let gradient = a.tr_mul(&(a * &z + q));
        let slope_inwards = |k: usize| if z[k] == bounds.lower[k] { gradient[k] } else { -gradient[k] };
        let steepest = (0..z.len())
            .filter(|&k| is_held[k] && slope_inwards(k) < -SLOPE_ROUNDING * q.norm())
            .min_by(|&k, &l| slope_inwards(k).total_cmp(&slope_inwards(l)));
        let Some(freed) = steepest else { break };
        is_held[freed] = false;
    }
    z
}

/// Returns the minimum of ½‖A z + q‖² over the parameters that are not held.
fn minimise_free(a: &DMatrix<f64>, q: &DVector<f64>, z: &DVector<f64>, is_held: &[bool]) -> DVector<f64> {
    let free: Vec<usize> = (0..z.len()).filter(|&k| !is_held[k]).collect();
    let mut target = z.clone();
    for &k in &free {
        target[k] = 0.0;
    }
    let (solution, _) = basic_solution(&a.select_columns(&free), &(q + a * &target));
    for (&k, value) in free.iter().zip(solution.iter()) {
        target[k] = *value;
    }
    target
}

/// The bound that a parameter meets, and the fraction of the way at which it does.
struct Crossing {
    parameter: usize,
    bound: f64,
    fraction: f64,
}

/// Returns the first bound crossed between `z`, which lies within the bounds, and `target`.
fn first_crossing(z: &DVector<f64>, target: &DVector<f64>, bounds: &Bounds) -> Option<Crossing> {
    let crossings = (0..z.len()).filter_map(|parameter| {
        let bound = target[parameter].clamp(bounds.lower[parameter], bounds.upper[parameter]);
        let fraction = (bound - z[parameter]) / (target[parameter] - z[parameter]);
        (bound != target[parameter]).then_some(Crossing { parameter, bound, fraction })
    });
    crossings.min_by(|a, b| a.fraction.total_cmp(&b.fraction))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::least_squares::linear_algebra::reduce;

    fn vector(values: &[f64]) -> DVector<f64> {
        DVector::from_row_slice(values)
    }

    /// r = M x − y, linear with correlated columns, at x = 0.
    fn step_from_zero(radius: f64, lower: &[f64], upper: &[f64]) -> Step {
        let jacobian = DMatrix::from_row_slice(3, 2, &[1.0, 0.9, 0.0, 1.0, 1.0, 0.0]);
        let reduced = reduce(&jacobian, &vector(&[-3.0, -2.0, -1.5])).unwrap();
        let scale = reduced.column_norms.clone();
        step(&DVector::zeros(2), &reduced, &scale, radius, &Bounds::new(vector(lower), vector(upper)))
    }

    #[test]
    fn a_bound_is_met_exactly_and_the_other_parameter_makes_up_for_it() {
        for upper in [0.3, 1e-3, 0.0] {
            let step = step_from_zero(1e3, &[-1.0, -1e8], &[upper, 1e8]);
            assert_eq!(step.trial[0], upper);
            // On x_1 = upper: x_2 = Σ M_2 (y − M_1 upper) / Σ M_2².
            let second = (0.9 * (3.0 - upper) + 2.0) / 1.81;
            assert!((step.trial[1] - second).abs() < SLOPE_ROUNDING);
            assert!(!step.is_limited);
        }
    }

    #[test]
    fn a_small_radius_limits_a_bounded_step() {
        let step = step_from_zero(0.1, &[-1.0, -1.0], &[1e-3, 1.0]);
        assert_eq!(step.trial[0], 1e-3);
        assert!(step.is_limited && step.length <= 0.1 * 2f64.sqrt() && step.predicted > 0.0);
    }

    #[test]
    fn the_minimum_within_a_box_satisfies_the_conditions_of_optimality() {
        let a = DMatrix::from_fn(4, 4, |i, j| ((i * 5 + j * 3) as f64).sin() + f64::from(u8::from(i == j)));
        for case in 0..200 {
            let wave = |k: usize, rate: f64| (k as f64 + rate * f64::from(case)).sin();
            let q = DVector::from_fn(4, |k, _| 2.0 * wave(k, 1.7));
            let lower = DVector::from_fn(4, |k, _| (wave(k, 2.3) - 0.5).min(0.0));
            let upper = DVector::from_fn(4, |k, _| (wave(k, 0.9) + 0.5).max(0.1));
            let z = box_step(&a, &q, &Bounds::new(lower.clone(), upper.clone()));
            let gradient = a.tr_mul(&(&a * &z + &q));
            for k in 0..4 {
                assert!(lower[k] <= z[k] && z[k] <= upper[k]);
                assert!(gradient[k] < 10.0 * SLOPE_ROUNDING || z[k] == lower[k], "case {case}: {gradient}");
                assert!(gradient[k] > -10.0 * SLOPE_ROUNDING || z[k] == upper[k], "case {case}: {gradient}");
            }
        }
    }
}
