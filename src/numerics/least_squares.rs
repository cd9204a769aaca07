//! Least squares by Levenberg and Marquardt's descent, as a solver of argmin's.
//!
//! - Moré, J. J. (1978). The Levenberg–Marquardt algorithm: implementation and theory. Lecture
//!   Notes in Mathematics 630, 105–116.
//! - Nielsen, H. B. (1999). Damping parameter in Marquardt's method. Technical University of
//!   Denmark, report IMM-REP-1999-05.

use argmin::core::{
    Error, Executor, IterState, KV, Problem, Solver, State, TerminationReason, TerminationStatus,
};

/// Share of a sum that is rounding. A descent gives up when the undamped part of a diagonal is,
/// too.
pub(crate) const ROUNDING: f64 = 1e-14;

/// Part by which diagonals are raised in the first step: first guesses are near.
pub(crate) const FIRST_DAMPING: f64 = 1e-6;

/// Least factor of the damping after a step that was made, and the factor after one that was not,
/// which doubles each time: with these all certified problems of NIST are solved, and films take
/// the fewest steps.
const AFTER_GAIN: f64 = 0.03;
const AFTER_LOSS: f64 = 10.0;

/// Number of steps in a row that gain almost no part of their promise, after which a
/// descent ends.
const MAX_STALLS: usize = 2;

/// Largest promise of a step as a part of that before, if this was not made or refined a minimum: a
/// step that promises as much is the same step, and at the minimum promises are rounding.
const CONTRACTION: f64 = 0.5;

/// A sum of squares, and damped steps towards its minimum.
pub trait SumOfSquares {
    /// Values of all unknowns.
    type State;
    /// The sum at a state, with what a step from there needs.
    type Evaluation;

    /// Evaluates the sum and its derivatives at a state.
    fn evaluate(&self, state: Self::State) -> Self::Evaluation;

    /// Returns the sum; infinite at a state without one.
    fn sum(&self, at: &Self::Evaluation) -> f64;

    /// Returns how much of the sum is rounding.
    fn rounding(&self, at: &Self::Evaluation) -> f64;

    /// Returns the step to the least value of the quadratic approximation within the bounds,
    /// shortened by `damping`: added to the diagonal of the normal equations as a part of it, or as
    /// a factor 1/(1 + damping). `None` if they cannot be solved.
    fn step(&self, at: &Self::Evaluation, damping: f64) -> Option<Step<Self::State>>;
}

/// A step.
pub struct Step<S> {
    /// The state at its end.
    pub end: S,
    /// The decrease of the sum if it is quadratic.
    pub promise: f64,
}

/// A descent that has ended.
#[derive(Clone)]
pub struct Descent<E> {
    /// The lowest point met.
    pub end: E,
    /// Whether it ended because a step promised or gained too little.
    pub converged: bool,
    /// The decrease of the sum that the step promises which was too little to be tried; 0 if it ended
    /// otherwise.
    pub promise: f64,
    /// Number of steps tried.
    pub steps: u64,
}

/// When a descent begins and ends.
#[derive(Clone, Copy)]
pub struct Descending {
    /// The damping of the first step.
    pub damping: f64,
    /// Maximum number of steps tried.
    pub steps: usize,
    /// A step that promises, or several steps in a row that gain, less than this are the end. With
    /// 0, the minimum is refined until steps no longer become shorter.
    pub stall: f64,
}

/// Descends from `at` to a minimum.
pub fn descend<S: SumOfSquares>(squares: &S, at: S::Evaluation, how: Descending) -> Descent<S::Evaluation> {
    let Descending { damping, steps, stall } = how;
    let state = Iterate::new().cost(squares.sum(&at)).max_iters(steps as u64);
    let mut solver = Marquardt {
        at,
        damping,
        growth: AFTER_LOSS,
        stall,
        failed: f64::INFINITY,
        may_relax: true,
        stalls: 0,
        last_refinement: f64::INFINITY,
        is_blocked: false,
        promise: 0.0,
        converged: None,
    };
    let run = Executor::new(squares, &mut solver).configure(|_| state).timer(false).run();
    let steps = run.map_or(0, |run| run.state.iter);
    let Marquardt { at: end, promise, converged, .. } = solver;
    Descent { end, converged: converged == Some(true), promise, steps }
}

/// The state that argmin passes between iterations, without a place: it would keep four of them.
type Iterate = IterState<(), (), (), (), (), f64>;

/// The solver and its memory.
struct Marquardt<E> {
    /// The lowest point met.
    at: E,
    damping: f64,
    /// Factor of the damping after the next step that is not made.
    growth: f64,
    stall: f64,
    /// The promise of the last step if it was not made, else infinite.
    failed: f64,
    /// Whether the damping has not been relaxed since a step was made.
    may_relax: bool,
    /// Number of steps in a row that gained too little.
    stalls: usize,
    /// The promise of the last step whose gain was lost in rounding.
    last_refinement: f64,
    /// Whether the last longer step ended at an infinite sum.
    is_blocked: bool,
    /// The promise of a step that is not tried since it is too small.
    promise: f64,
    /// Whether it has converged, once it has ended.
    converged: Option<bool>,
}

impl<E> Marquardt<E> {
    /// Returns the next step; `None` with `converged` if no step is left. If the
    /// gain of a step would be lost in rounding, one with less damping takes its place.
    fn propose<S: SumOfSquares<Evaluation = E>>(&mut self, squares: &S) -> Option<Step<S::State>> {
        let (sum, rounding) = (squares.sum(&self.at), squares.rounding(&self.at));
        while self.damping < ROUNDING.recip() && sum.is_finite() {
            let Some(step) = squares.step(&self.at, self.damping) else {
                self.damping *= AFTER_LOSS;
                continue;
            };
            if step.promise <= rounding && self.may_relax {
                self.may_relax = false;
                self.damping = (FIRST_DAMPING * self.damping).max(f64::MIN_POSITIVE);
                continue;
            }
            if step.promise > rounding && step.promise > CONTRACTION * self.failed {
                self.damping *= AFTER_LOSS;
                continue;
            }
            let is_over = step.promise <= rounding && step.promise >= CONTRACTION * self.last_refinement;
            if step.promise > 0.0 && step.promise >= self.stall && !is_over {
                return Some(step);
            }
            self.promise = step.promise;
            self.converged = Some(!self.is_blocked);
            return None;
        }
        self.converged = Some(false);
        None
    }

    /// Changes the damping by the share of its promise that a step gained (Nielsen 1999); returns
    /// whether the step is made.
    fn judge(&mut self, share: f64) -> bool {
        let is_made = share > 0.0;
        if is_made {
            let factor = (1.0 - (2.0 * share - 1.0).powi(3)).max(AFTER_GAIN);
            self.damping = (factor * self.damping).max(f64::MIN_POSITIVE);
            self.growth = AFTER_LOSS;
        } else {
            self.damping *= self.growth;
            self.growth *= 2.0;
        }
        is_made
    }
}

impl<S: SumOfSquares> Solver<&S, Iterate> for &mut Marquardt<S::Evaluation> {
    fn name(&self) -> &'static str {
        "Levenberg–Marquardt"
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<&S>,
        state: Iterate,
    ) -> Result<(Iterate, Option<KV>), Error> {
        let Some(squares) = problem.problem else { return Ok((state, None)) };
        let Some(step) = self.propose(squares) else { return Ok((state, None)) };
        let trial = squares.evaluate(step.end);
        let sum = squares.sum(&trial);
        let gain = state.cost - sum;
        let rounding = squares.rounding(&self.at);
        let is_made = if step.promise <= rounding {
            self.last_refinement = step.promise;
            self.converged = (gain < -rounding).then_some(sum.is_finite());
            self.converged.is_none()
        } else {
            self.is_blocked = !sum.is_finite();
            // a step without a gain may have crossed a corner: shorter ones may gain
            self.stalls = if gain > self.stall { 0 } else { self.stalls + usize::from(gain > -self.stall) };
            self.converged = (self.stalls > MAX_STALLS).then_some(true);
            let is_made = self.judge(gain / step.promise);
            self.failed = if is_made { f64::INFINITY } else { step.promise };
            is_made
        };
        self.may_relax |= is_made;
        if !is_made {
            return Ok((state, None));
        }
        self.at = trial;
        Ok((state.cost(sum), None))
    }

    fn terminate(&mut self, _: &Iterate) -> TerminationStatus {
        match self.converged {
            None => TerminationStatus::NotTerminated,
            Some(_) => TerminationStatus::Terminated(TerminationReason::SolverConverged),
        }
    }
}
