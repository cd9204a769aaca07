//! The minimum of χ²: a grid in μ, and in κ if it is free, from coarse corrections of the camera,
//! then Levenberg and Marquardt's descent within bounds.

use std::ops::Range;

use super::evaluation::Evaluation;
use super::film::filmed::FilmBlock;
use super::noise::{self, minus_two_log};
use super::policy::{COMPARED_STEPS, ROUGH, STALL};
use super::problem::{Block, Problem, State};
use super::unknowns::{Id, Mode};
use crate::numerics::bounded_step::step_within_bounds;
use crate::numerics::least_squares::{self, Descending, FIRST_DAMPING, ROUNDING, Step, SumOfSquares};

/// Values of μ that descents start from, of waxed balls to rubber: a contact that sticks does not
/// depend on μ, so that thick shots of slippery bodies have minima between small values. In films
/// of balls those near published ones (0.03 to 0.08) are enough.
pub(crate) const MUS: [f64; 11] = [0.002, 0.005, 0.01, 0.02, 0.06, 0.12, 0.25, 0.4, 0.7, 1.2, 2.0];
const OF_FILMS: Range<usize> = 3..7;

/// Values of κ that descents start from: stiff contacts to soft ones.
const KAPPAS: [f64; 5] = [0.2, 0.5, 1.25, 2.5, 5.0];

/// Logarithm of the ratio of μ or κ at two ends of descents from which on they are different
/// minima.
const APART: f64 = 0.3;

/// Rise of χ² beyond which another minimum is of no interest: five standard errors.
pub(super) const FAR: f64 = 25.0;

/// Unknowns of the first descents: places and scale before all others.
const COARSE: [Id; 7] = [Id::Mu, Id::E, Id::Scale, Id::Aspect, Id::Shear, Id::PerspectiveX, Id::PerspectiveY];

/// Steps of the first descents, of films and of tables.
const COARSE_STEPS: [usize; 2] = [10, 3];

/// Number of shots of a film, and of rows of a table, that suffice to find the minima of χ²: 174
/// films of all kinds of faults have the same grades as with all shots.
const ENOUGH_FILMED: usize = 12;
pub(super) const ENOUGH_SHOTS: usize = 250;

/// Rounds after which the states of spins stay as they are.
const MAX_STATE_ROUNDS: usize = 5;

/// Rounds of noise, spreads and spin states, typical are 3.
const MAX_ROUNDS: usize = 10;

/// Minimises over everything free: coarsely, finely, and again with the noise that the residuals
/// show. Rolling and sliding balls of unknown spin have minima of their own: from all rolling and
/// from all sliding to the likelier end. `None` if no start describes a collision.
pub(crate) fn fit(problem: &mut Problem, start: &State) -> Option<Descent> {
    let end = |problem: &mut Problem| {
        let coarse = descend_coarsely(problem, start)?;
        Some(descend_with_noise(problem, coarse))
    };
    let mut sliding = problem.clone();
    let is_open = sliding.film_mut().is_some_and(FilmBlock::slide);
    let first = end(problem);
    let Some(other) = is_open.then(|| end(&mut sliding)).flatten() else { return first };
    let likelihood = |problem: &Problem, descent: &Descent| minus_two_log(problem, &descent.end);
    let other_likelihood = likelihood(&sliding, &other);
    if first.as_ref().is_some_and(|first| likelihood(problem, first) <= other_likelihood) {
        return first;
    }
    *problem = sliding;
    Some(other)
}

/// Descends a few steps from a grid with some of the shots, of films over places, scale, μ and e
/// with a noise as large as the first guesses are wrong. Returns the end, with the first guesses of
/// shots that took no part; of the best two ends, if they are different and both likely, the one
/// from which some steps with all shots over everything free lead lower.
fn descend_coarsely(problem: &Problem, start: &State) -> Option<State> {
    let is_film = problem.film().is_some();
    let enough = if is_film { ENOUGH_FILMED } else { ENOUGH_SHOTS };
    let Thinned { problem: mut coarser, state, factor } = thin(problem, start, enough);
    for (sample, own) in coarser.samples.iter_mut().zip(&state.own) {
        if let Block::Film(film) = &mut sample.block {
            film.coarsen(own);
        }
    }
    let mut free = problem.free();
    free.retain(|column| !is_film || COARSE.contains(&problem.unknowns[*column].id));
    let mut coarse = descend_from_grid(&coarser, &state, &free, COARSE_STEPS[usize::from(!is_film)]);
    let least = coarse.first()?.cost;
    coarse.retain(|end| factor * (end.cost - least) < FAR);
    let with_all_shots = |coarse: Evaluation| {
        let own = if factor == 1.0 { coarse.state.own } else { start.own.clone() };
        State { own, shared: coarse.state.shared }
    };
    let mut starts = coarse.into_iter().take(2).map(with_all_shots);
    let (first, second) = (starts.next()?, starts.next());
    let Some(second) = second else { return Some(first) };
    let [first, second] = [first, second]
        .map(|start| descend(problem, problem.evaluate(start), &problem.free(), (COMPARED_STEPS, ROUGH)).end);
    Some(if second.cost < first.cost - STALL { second.state } else { first.state })
}

/// Descends some steps over the unknowns `free` from a grid in μ and κ; returns the different
/// minima, the lowest first, and of those that fit equally well that of the smallest μ.
pub(super) fn descend_from_grid(
    problem: &Problem,
    start: &State,
    free: &[usize],
    steps: usize,
) -> Vec<Evaluation> {
    let descend_from = |state: State| descend(problem, problem.evaluate(state), free, (steps, STALL)).end;
    let mut ends: Vec<Evaluation> = grid(problem, start).into_iter().flatten().map(descend_from).collect();
    ends.retain(|end| end.cost.is_finite());
    let rank = |end: &Evaluation| (end.cost / STALL).round();
    ends.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
    different(problem, ends, |end| &end.state)
}

/// Returns the states that descents start from: a list for each κ, with a state for each μ; of μ or
/// κ that is not free the present value.
pub(super) fn grid(problem: &Problem, start: &State) -> Vec<Vec<State>> {
    let mus = if problem.film().is_some() { &MUS[OF_FILMS] } else { &MUS };
    let with = |state: &State, id: Id, values: &[f64]| -> Vec<State> {
        let columns = free_columns(problem, id);
        let Some(first) = columns.first() else { return vec![state.clone()] };
        let [low, high] = problem.unknowns[*first].bounds;
        let mut within: Vec<f64> = values.iter().map(|value| value.clamp(low, high)).collect();
        within.dedup();
        let at = |value: f64| state.clone().with(columns.iter().map(|column| (*column, value)));
        within.into_iter().map(at).collect()
    };
    with(start, Id::Kappa, &KAPPAS).iter().map(|state| with(state, Id::Mu, mus)).collect()
}

fn free_columns(problem: &Problem, id: Id) -> Vec<usize> {
    let is_free = |column: &usize| problem.unknowns[*column].mode == Mode::Free;
    problem.columns_of(id).into_iter().filter(is_free).collect()
}

/// Returns one end of descents for each minimum, the first; minima differ in μ or κ.
pub(super) fn different<T>(problem: &Problem, ends: Vec<T>, state: impl Fn(&T) -> &State) -> Vec<T> {
    let columns = [Id::Mu, Id::Kappa].map(|id| free_columns(problem, id)).concat();
    let are_apart = |a: &State, b: &State| {
        columns.iter().any(|column| (a.shared.0[*column] / b.shared.0[*column]).ln().abs() > APART)
    };
    let mut all: Vec<T> = Vec::new();
    for end in ends {
        if all.iter().all(|other| are_apart(state(&end), state(other))) {
            all.push(end);
        }
    }
    all
}

/// A problem with some of its shots.
pub(crate) struct Thinned {
    pub(crate) problem: Problem,
    pub(crate) state: State,
    /// Number of shots over the number of shots taken.
    pub(crate) factor: f64,
}

/// Returns `enough` shots, spread evenly, of a single sample that has more.
pub(crate) fn thin(problem: &Problem, state: &State, enough: usize) -> Thinned {
    let (mut problem, mut state) = (problem.clone(), state.clone());
    let count = state.own.first().map_or(0, Vec::len);
    if problem.samples.len() > 1 || count <= enough {
        return Thinned { problem, state, factor: 1.0 };
    }
    let keep: Vec<bool> = (0..count).map(|i| (i + 1) * enough / count > i * enough / count).collect();
    problem.retain(&mut state, &keep);
    Thinned { problem, state, factor: count as f64 / enough as f64 }
}

/// Minimises over everything free, and again with the noise and the spreads that the residuals show
/// and the states of unknown spins, until these stay.
pub(crate) fn descend_with_noise(problem: &mut Problem, mut state: State) -> Descent {
    let mut round = 0;
    loop {
        let changed = round < MAX_STATE_ROUNDS && problem.choose_states(&mut state);
        let end = descend(problem, problem.evaluate(state), &problem.free(), (MAX_STEPS, ROUGH)).end;
        round += 1;
        // noise and spreads of wrong states are meaningless
        let mut next = problem.clone();
        let settled = !changed && noise::update(&mut next, &end);
        if settled || round == MAX_ROUNDS {
            return descend(problem, end, &problem.free(), (MAX_STEPS, STALL));
        }
        *problem = next;
        state = end.state;
    }
}

/// Evaluations of a descent at most, typical are 6.
pub(super) const MAX_STEPS: usize = 40;

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
        let reduced = at.reduced()?;
        let moving: Vec<usize> =
            self.free.iter().copied().filter(|column| reduced.informs(*column)).collect();
        let room: Vec<[f64; 2]> = moving
            .iter()
            .map(|column| problem.unknowns[*column].bounds.map(|bound| bound - at.state.shared.0[*column]))
            .collect();
        // ½ sᵀLLᵀs + gᵀs = ½ ‖Lᵀs + L⁻¹g‖² + a constant
        let mut matrix = reduced.matrix(&moving);
        matrix.set_diagonal(&(matrix.diagonal() * (1.0 + damping)));
        let factor = matrix.cholesky()?.unpack();
        let residual = factor.solve_lower_triangular(&reduced.gradient(&moving))?;
        let step = step_within_bounds(&factor.transpose(), &residual, &room)?;
        let follow = (1.0 + damping).recip();
        let mut end = reduced.step(problem, &at.state, (&moving, &step), follow);
        for ((column, by), room) in moving.iter().zip(step.iter()).zip(&room) {
            if let Some(side) = room.iter().position(|room| room == by) {
                // x + (b − x) is rounded
                end.shared.0[*column] = problem.unknowns[*column].bounds[side];
            }
        }
        Some(Step { end, promise: reduced.promise(&moving, &step, follow) })
    }
}
