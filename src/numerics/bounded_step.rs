//! The step to the minimum of a linear least-squares problem within bounds, by Clarabel.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus};
use nalgebra::{DMatrix, DVector};

/// One bound of one unknown.
struct Limit {
    unknown: usize,
    /// −1 for the lower bound, 1 for the upper one.
    sign: f64,
    /// The value on the bound.
    value: f64,
    /// Distance to the bound in y, 0 or more.
    size: f64,
}

/// Returns the s that minimises ‖`root` s + `residual`‖² with each s_j between its bounds in
/// `room`, which include 0 and are met exactly. `root` (m × n, m ≥ n) has full rank; else `None`.
///
/// If the free minimum lies outside, Clarabel's multipliers show which bounds are active; the other
/// unknowns are solved for once more by QR.
pub fn step_within_bounds(
    root: &DMatrix<f64>,
    residual: &DVector<f64>,
    room: &[[f64; 2]],
) -> Option<DVector<f64>> {
    let mut held: Vec<Option<f64>> = room.iter().map(|[low, high]| (low == high).then_some(*low)).collect();
    let outside =
        |step: &DVector<f64>| (0..room.len()).find(|j| step[*j] < room[*j][0] || room[*j][1] < step[*j]);
    let free = minimum(root, residual, &held)?;
    if outside(&free).is_none() {
        return Some(free);
    }
    hold_active(root, residual, room, &mut held)?;
    // each bound that rounding hid is held, too
    loop {
        let step = minimum(root, residual, &held)?;
        let Some(j) = outside(&step) else { return Some(step) };
        held[j] = Some(step[j].clamp(room[j][0], room[j][1]));
    }
}

/// Returns the minimum over the unknowns that are not held.
fn minimum(root: &DMatrix<f64>, residual: &DVector<f64>, held: &[Option<f64>]) -> Option<DVector<f64>> {
    let mut step = DVector::from_iterator(held.len(), held.iter().map(|held| held.unwrap_or(0.0)));
    let free: Vec<usize> = (0..held.len()).filter(|j| held[*j].is_none()).collect();
    if free.is_empty() {
        return Some(step);
    }
    let factor = root.select_columns(&free).qr();
    let mut against = -(residual + root * &step);
    factor.q_tr_mul(&mut against);
    let solved = factor.r().solve_upper_triangular(&against.rows(0, free.len()))?;
    for (j, by) in free.iter().zip(solved.iter()) {
        step[*j] = *by;
    }
    step.iter().all(|s| s.is_finite()).then_some(step)
}

/// Holds the unknowns at the bounds that Clarabel finds active. Its unknowns are y = D s/γ, with
/// ones on the diagonal of the quadratic form and a gradient of length 1.
fn hold_active(
    root: &DMatrix<f64>,
    residual: &DVector<f64>,
    room: &[[f64; 2]],
    held: &mut [Option<f64>],
) -> Option<()> {
    let free: Vec<usize> = (0..held.len()).filter(|j| held[*j].is_none()).collect();
    let n = free.len();
    let mut columns = root.select_columns(&free);
    let scale: Vec<f64> = columns.column_iter().map(|column| column.norm()).collect();
    for (mut column, norm) in columns.column_iter_mut().zip(&scale) {
        column /= *norm;
    }
    let quadratic = columns.tr_mul(&columns);
    let mut gradient = columns.tr_mul(residual);
    let length = gradient.normalize_mut();
    let upper: Vec<(usize, usize)> = (0..n).flat_map(|j| (0..=j).map(move |i| (i, j))).collect();
    let form = CscMatrix::new_from_triplets(
        n,
        n,
        upper.iter().map(|(i, _)| *i).collect(),
        upper.iter().map(|(_, j)| *j).collect(),
        upper.iter().map(|at| quadratic[*at]).collect(),
    );
    let limits: Vec<Limit> = (0..n)
        .flat_map(|unknown| room[free[unknown]].into_iter().zip([-1.0, 1.0]).map(move |side| (unknown, side)))
        .map(|(unknown, (value, sign))| {
            let size = sign * value * scale[unknown] / length;
            Limit { unknown, sign, value, size }
        })
        .filter(|limit| limit.size.is_finite())
        .collect();
    // rows of order 1: ± y/b ≤ 1 if b > 1
    let weight = |limit: &Limit| 1.0 / limit.size.max(1.0);
    let rows = CscMatrix::new_from_triplets(
        limits.len(),
        n,
        (0..limits.len()).collect(),
        limits.iter().map(|limit| limit.unknown).collect(),
        limits.iter().map(|limit| limit.sign * weight(limit)).collect(),
    );
    let sizes: Vec<f64> = limits.iter().map(|limit| limit.size * weight(limit)).collect();
    let settings = DefaultSettings { verbose: false, presolve_enable: false, ..DefaultSettings::default() };
    let cones = [NonnegativeConeT(limits.len())];
    let mut solver = DefaultSolver::new(&form, gradient.as_slice(), &rows, &sizes, &cones, settings).ok()?;
    solver.solve();
    let solution = &solver.solution;
    if !matches!(solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved) {
        return None;
    }
    for ((limit, multiplier), slack) in limits.iter().zip(&solution.z).zip(&solution.s) {
        if multiplier > slack {
            held[free[limit.unknown]] = Some(limit.value);
        }
    }
    Some(())
}
