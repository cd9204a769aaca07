//! Levenberg and Marquardt's descent within bounds (Moré 1978).

use nalgebra::DVector;

use super::problem::{Evaluation, Problem, Reduced, State};

/// Fall of χ² below which a step is not made: 0.1 standard deviations.
const STALL: f64 = 0.01;

/// Number of steps that gain nothing, though they were promised to, after which a descent ends.
const MAX_STALLS: usize = 2;

/// Parts by which diagonals are raised at the beginning, and at which a descent gives up.
const LEAST_DAMPING: f64 = 1e-6;
const MAX_DAMPING: f64 = 1e6;

/// The end of a descent.
pub(crate) struct Descent {
    pub end: Evaluation,
    /// Evaluations of the whole problem.
    pub evaluations: usize,
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
    let mut evaluations = 0;
    let mut stalls = 0;
    while evaluations < steps && damping < MAX_DAMPING && at.cost.is_finite() {
        let step = at.eliminate(problem, damping).and_then(|reduced| {
            let moving: Vec<usize> = free.iter().copied().filter(|column| reduced.informs(*column)).collect();
            let step = step_within_bounds(problem, &reduced, &at.state, &moving)?;
            let state = reduced.step(problem, &at.state, &moving, &step);
            Some((reduced.promise(&moving, &step), state))
        });
        let trial = match step {
            Some((promise, _)) if promise < stall => {
                return Descent { end: at, evaluations, converged: true };
            }
            Some((_, state)) => problem.evaluate(state),
            None => {
                damping *= 10.0;
                continue;
            }
        };
        evaluations += 1;
        if trial.cost < at.cost {
            at = trial;
            damping = (damping * 0.01).max(LEAST_DAMPING);
        } else {
            // a step that gains nothing may have crossed a kink: shorter ones may gain
            stalls += usize::from(trial.cost - at.cost < stall);
            if stalls > MAX_STALLS {
                return Descent { end: at, evaluations, converged: true };
            }
            damping *= 100.0;
        }
    }
    Descent { end: at, evaluations, converged: false }
}

/// Returns the damped step. Unknowns that would leave their bounds go to them, and the others
/// follow.
fn step_within_bounds(
    problem: &Problem,
    reduced: &Reduced,
    state: &State,
    free: &[usize],
) -> Option<DVector<f64>> {
    let mut held: Vec<Option<f64>> = vec![None; problem.unknowns.len()];
    loop {
        let (stopped, moving): (Vec<usize>, Vec<usize>) =
            free.iter().partition(|column| held[**column].is_some());
        let all: Vec<usize> = moving.iter().chain(&stopped).copied().collect();
        let matrix = reduced.matrix(&all);
        let n = moving.len();
        let known = DVector::from_fn(stopped.len(), |i, _| held[stopped[i]].unwrap_or(0.0));
        let against = reduced.gradient(&moving) + matrix.view((0, n), (n, stopped.len())) * &known;
        let step = -matrix.view((0, 0), (n, n)).into_owned().cholesky()?.solve(&against);
        if !step.iter().all(|s| s.is_finite()) {
            return None;
        }
        let mut inside = true;
        for (column, by) in moving.iter().zip(step.iter()) {
            let ([low, high], x) = (problem.unknowns[*column].bounds, state.shared.0[*column]);
            if x + by < low || x + by > high {
                held[*column] = Some((x + by).clamp(low, high) - x);
                inside = false;
            }
        }
        if inside {
            let step_of = |column: &usize| {
                held[*column].or_else(|| Some(step[moving.iter().position(|m| m == column)?]))
            };
            return free.iter().map(step_of).collect::<Option<Vec<f64>>>().map(DVector::from_vec);
        }
    }
}
