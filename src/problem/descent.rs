//! Levenberg and Marquardt's descent within bounds (Moré 1978).

use nalgebra::DVector;

use super::problem::{Evaluation, Problem, Reduced, State};

/// Fall of χ² below which a step is not made: 0.1 standard deviations.
pub(super) const STALL: f64 = 0.01;

/// Number of steps in a row that gain next to nothing, though they were promised to, after which a descent
/// ends.
const MAX_STALLS: usize = 2;

/// Parts by which diagonals are raised at the beginning, and at which a descent gives up.
const LEAST_DAMPING: f64 = 1e-6;
const MAX_DAMPING: f64 = 1e6;

/// The end of a descent.
#[derive(Clone)]
pub(crate) struct Descent {
    pub end: Evaluation,
    /// Whether it ended because a step promised or gained nothing.
    pub converged: bool,
}

/// Descends from `at` in the unknowns `free` until a step promises or gains less than [`STALL`].
pub(crate) fn descend(problem: &Problem, at: Evaluation, free: &[usize], steps: usize) -> Descent {
    descend_until(problem, at, free, steps, STALL)
}

/// Descends from `at` in the unknowns `free` until a step promises or gains less than `stall`.
pub(crate) fn descend_until(
    problem: &Problem,
    mut at: Evaluation,
    free: &[usize],
    steps: usize,
    stall: f64,
) -> Descent {
    let mut damping = LEAST_DAMPING;
    let mut count = 0;
    let mut stalls = 0;
    while count < steps && damping < MAX_DAMPING && at.cost.is_finite() {
        let step = at.eliminate(problem, damping).and_then(|reduced| {
            let moving: Vec<usize> = free.iter().copied().filter(|column| reduced.informs(*column)).collect();
            let step = step_within_bounds(problem, &reduced, &at.state, &moving)?;
            let state = reduced.step(problem, &at.state, &moving, &step);
            Some((reduced.promise(&moving, &step), state))
        });
        let trial = match step {
            Some((promise, _)) if promise < stall => {
                return Descent { end: at, converged: true };
            }
            Some((_, state)) => problem.evaluate(state),
            None => {
                damping *= 10.0;
                continue;
            }
        };
        count += 1;
        let rise = trial.cost - at.cost;
        // a step that gains nothing may have crossed a kink: shorter ones may gain
        stalls = if rise < -stall { 0 } else { stalls + usize::from(rise < stall) };
        if rise < 0.0 {
            at = trial;
            damping = (damping * 0.01).max(LEAST_DAMPING);
        } else {
            damping *= 100.0;
        }
        if stalls > MAX_STALLS {
            return Descent { end: at, converged: true };
        }
    }
    Descent { end: at, converged: false }
}

/// Returns the damped step that is best within the bounds: the first unknown that would leave its
/// bounds goes to its bound and the others follow; one whose slope leads away from its bound is
/// released.
fn step_within_bounds(
    problem: &Problem,
    reduced: &Reduced,
    state: &State,
    free: &[usize],
) -> Option<DVector<f64>> {
    let n = free.len();
    let (matrix, gradient) = (reduced.matrix(free), reduced.gradient(free));
    let room: Vec<[f64; 2]> = free
        .iter()
        .map(|column| problem.unknowns[*column].bounds.map(|bound| bound - state.shared.0[*column]))
        .collect();
    let mut held = vec![false; n];
    let mut step = DVector::zeros(n);
    // holds and releases alternate for ever only by rounding
    for _ in 0..=4 * n {
        let moving: Vec<usize> = (0..n).filter(|i| !held[*i]).collect();
        let mut against = DVector::from_fn(moving.len(), |i, _| gradient[moving[i]]);
        for (i, place) in moving.iter().enumerate() {
            for stopped in (0..n).filter(|stopped| held[*stopped]) {
                against[i] += matrix[(*place, stopped)] * step[stopped];
            }
        }
        let inner = matrix.select_rows(&moving).select_columns(&moving);
        let solved = -inner.cholesky()?.solve(&against);
        if !solved.iter().all(|s| s.is_finite()) {
            return None;
        }
        let outside = moving.iter().zip(solved.iter()).filter_map(|(place, by)| {
            let bound = by.clamp(room[*place][0], room[*place][1]);
            (bound != *by).then(|| (*place, bound, (bound / by).abs()))
        });
        if let Some((place, bound, _)) = outside.min_by(|a, b| a.2.total_cmp(&b.2)) {
            (held[place], step[place]) = (true, bound);
            continue;
        }
        for (place, by) in moving.iter().zip(solved.iter()) {
            step[*place] = *by;
        }
        let slopes = &gradient + &matrix * &step;
        let leaves = |place: &usize| {
            let is_low = step[*place] == room[*place][0];
            held[*place] && room[*place][0] < room[*place][1] && (slopes[*place] < 0.0) == is_low
        };
        match (0..n).find(|place| leaves(place) && slopes[*place] != 0.0) {
            Some(place) => held[place] = false,
            None => return Some(step),
        }
    }
    Some(step)
}
