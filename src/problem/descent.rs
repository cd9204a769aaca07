//! Descents of a problem, within the bounds of its unknowns.

use super::problem::{Evaluation, Problem, State};
use crate::numerics::bounded_step::step_within_bounds;
use crate::numerics::least_squares::{self, Descending, ROUNDING, Step, SumOfSquares};

/// Decrease of χ² below which a step is not made: 0.1 standard deviations.
pub(super) const STALL: f64 = 0.01;

/// Part by which diagonals are raised in the first step: first guesses are near.
const FIRST_DAMPING: f64 = 1e-6;

/// Evaluations of a descent at most, typical are 6.
pub(super) const MAX_STEPS: usize = 50;

/// A descent that has ended.
pub(crate) type Descent = least_squares::Descent<Evaluation>;

/// A problem with the shared unknowns that move.
struct Moving<'a> {
    problem: &'a Problem,
    free: &'a [usize],
}

impl Problem {
    /// Descends from a state over everything free until a step promises or gains less than
    /// [`STALL`].
    pub(crate) fn descend(&self, from: State) -> Descent {
        descend(self, self.evaluate(from), &self.free(), (MAX_STEPS, STALL))
    }
}

/// Descends from `at` in the unknowns `free`: some steps at most, and until one promises or gains
/// less than `stall`.
pub(crate) fn descend(
    problem: &Problem,
    at: Evaluation,
    free: &[usize],
    (steps, stall): (usize, f64),
) -> Descent {
    let how = Descending { damping: FIRST_DAMPING, steps, stall };
    least_squares::descend(&Moving { problem, free }, at, how)
}

impl SumOfSquares for Moving<'_> {
    type State = State;
    type Evaluation = Evaluation;

    fn evaluate(&self, state: State) -> Evaluation {
        self.problem.evaluate(state)
    }

    fn sum(&self, at: &Evaluation) -> f64 {
        at.cost
    }

    fn rounding(&self, at: &Evaluation) -> f64 {
        ROUNDING * at.cost
    }

    fn step(&self, at: &Evaluation, damping: f64) -> Option<Step<State>> {
        let problem = self.problem;
        let reduced = at.eliminate(problem, damping)?;
        let moving: Vec<usize> =
            self.free.iter().copied().filter(|column| reduced.informs(*column)).collect();
        let room: Vec<[f64; 2]> = moving
            .iter()
            .map(|column| problem.unknowns[*column].bounds.map(|bound| bound - at.state.shared.0[*column]))
            .collect();
        // ½ sᵀLLᵀs + gᵀs = ½ ‖Lᵀs + L⁻¹g‖² + a constant
        let factor = reduced.matrix(&moving).cholesky()?.unpack();
        let residual = factor.solve_lower_triangular(&reduced.gradient(&moving))?;
        let step = step_within_bounds(&factor.transpose(), &residual, &room)?;
        let mut end = reduced.step(problem, &at.state, &moving, &step);
        for ((column, by), room) in moving.iter().zip(step.iter()).zip(&room) {
            if let Some(side) = room.iter().position(|room| room == by) {
                // x + (b − x) is rounded
                end.shared.0[*column] = problem.unknowns[*column].bounds[side];
            }
        }
        Some(Step { end, promise: reduced.promise(&moving, &step) })
    }
}
