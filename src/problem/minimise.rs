//! The minimum of χ²: a grid in μ from coarse corrections of the camera, then Levenberg and
//! Marquardt's descent within bounds.

use super::block::Block;
use super::descent::{Descent, STALL, descend};
use super::film::block::FilmBlock;
use super::noise::{self, minus_two_log};
use super::problem::{Problem, State};
use super::rows::block::RowsBlock;
use super::unknowns::Id;

/// Values of μ that descents of films start from: published ones (0.03 to 0.08), waxed and chalked
/// balls.
const FILM_GRID: [f64; 4] = [0.02, 0.06, 0.12, 0.25];

/// Unknowns of the first descents: places and scale before all others.
const COARSE: [Id; 7] = [Id::Mu, Id::E, Id::Scale, Id::Aspect, Id::Shear, Id::PerspectiveX, Id::PerspectiveY];

/// Evaluations of a descent, typical are 6.
const MAX_STEPS: usize = 40;

/// Steps of the first descents, of films and of tables, and of the two best ones over everything
/// free.
const COARSE_STEPS: [usize; 2] = [10, 3];
const SECOND_STEPS: usize = 12;

/// Number of shots of a table that suffices to find the minima of χ².
pub(super) const ENOUGH_SHOTS: usize = 250;

/// Relative difference within which two descents end at the same μ.
pub(super) const SAME_MU: f64 = 0.3;

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
        Some(descend_with_noise(problem, coarse.end.state))
    };
    let mut sliding = problem.clone();
    let is_open = sliding.film_mut().is_some_and(FilmBlock::slide);
    let first = end(problem);
    let Some(other) = is_open.then(|| end(&mut sliding)).flatten() else { return first };
    let likelihood = |problem: &Problem, descent: &Descent| minus_two_log(problem, &descent.end);
    let of_other = likelihood(&sliding, &other);
    if first.as_ref().is_some_and(|first| likelihood(problem, first) <= of_other) {
        return first;
    }
    *problem = sliding;
    Some(other)
}

/// Descends a few steps over places, scale, μ and e from each μ of a grid, with a noise as large as
/// the first guesses are wrong, of large tables with some of the shots. From the best two, if they
/// are at different μ, goes on over everything free; returns the lower one.
fn descend_coarsely(problem: &Problem, start: &State) -> Option<Descent> {
    let Thinned { problem: mut coarser, state: coarse_start, .. } = thin(problem, start);
    for sample in &mut coarser.samples {
        if let Block::Film(film) = &mut sample.block {
            film.coarsen();
        }
    }
    let free = problem.free();
    let is_table = problem.rows().is_some();
    let is_coarse = |column: &usize| is_table || COARSE.contains(&problem.unknowns[*column].id);
    let coarse_columns: Vec<usize> = free.iter().copied().filter(is_coarse).collect();
    let of_mu: Vec<usize> =
        free.iter().copied().filter(|column| problem.unknowns[*column].id == Id::Mu).collect();
    let from = |mu: &f64| {
        let mut state = coarse_start.clone();
        for column in &of_mu {
            let [low, high] = problem.unknowns[*column].bounds;
            state.shared.0[*column] = mu.clamp(low, high);
        }
        descend(&coarser, coarser.evaluate(state), &coarse_columns, COARSE_STEPS[usize::from(is_table)])
    };
    let grid = if is_table { &RowsBlock::GRID[..] } else { &FILM_GRID };
    let mut coarse: Vec<Descent> = grid.iter().map(from).collect();
    coarse.retain(|descent| descent.end.cost.is_finite());
    let mu = |descent: &Descent, column: usize| descent.end.state.shared.0[column];
    // of values that fit equally well the smallest
    let rank = |descent: &Descent| (descent.end.cost / STALL).round();
    coarse.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
    let mut ranked = coarse.into_iter();
    let best = ranked.next()?;
    let is_other = |other: &Descent| {
        of_mu.iter().any(|column| (mu(other, *column) / mu(&best, *column) - 1.0).abs() > SAME_MU)
    };
    let second = ranked.find(is_other);
    let is_whole = coarse_start.own.iter().map(Vec::len).eq(start.own.iter().map(Vec::len));
    let go_on = |coarse: Descent| {
        let own = if is_whole { coarse.end.state.own } else { start.own.clone() };
        let state = State { own, shared: coarse.end.state.shared };
        descend(problem, problem.evaluate(state), &free, SECOND_STEPS)
    };
    let Some(second) = second else { return Some(if is_whole { best } else { go_on(best) }) };
    let [first, second] = [best, second].map(go_on);
    Some(if second.end.cost < first.end.cost - STALL { second } else { first })
}

/// A problem with some of its shots.
pub(crate) struct Thinned {
    pub(crate) problem: Problem,
    pub(crate) state: State,
    /// Number of shots over the number of shots taken.
    pub(crate) factor: f64,
}

/// Returns [`ENOUGH_SHOTS`] shots, spread evenly, of a table that has more; films as they are.
pub(crate) fn thin(problem: &Problem, state: &State) -> Thinned {
    let (mut problem, mut state) = (problem.clone(), state.clone());
    let count = state.own.first().map_or(0, Vec::len);
    if problem.rows().is_none() || problem.samples.len() > 1 || count <= ENOUGH_SHOTS {
        return Thinned { problem, state, factor: 1.0 };
    }
    let keep: Vec<bool> =
        (0..count).map(|i| (i + 1) * ENOUGH_SHOTS / count > i * ENOUGH_SHOTS / count).collect();
    problem.retain(0, &mut state, &keep);
    Thinned { problem, state, factor: count as f64 / ENOUGH_SHOTS as f64 }
}

/// Minimises with what weight and cloth do during the contact, computed at `state` and once more
/// after the fit has moved.
pub(crate) fn descend_weighed(problem: &mut Problem, state: State) -> Descent {
    problem.weigh(&state);
    let moved = descend_with_noise(problem, state).end.state;
    problem.weigh(&moved);
    descend_with_noise(problem, moved)
}

/// Minimises over everything free, and again with the noise and the spreads that the residuals show
/// and the states of unknown spins, until these stay.
pub(crate) fn descend_with_noise(problem: &mut Problem, mut state: State) -> Descent {
    let free = problem.free();
    let mut round = 0;
    loop {
        let changed = round < MAX_STATE_ROUNDS && problem.choose_states(&mut state);
        let descent = descend(problem, problem.evaluate(state), &free, MAX_STEPS);
        round += 1;
        // noise and spreads of wrong states are meaningless
        let settled = !changed && noise::update(problem, &descent.end);
        if settled || round == MAX_ROUNDS {
            // χ² with the last noise, which −2 log L takes
            return Descent { end: problem.evaluate(descent.end.state), ..descent };
        }
        state = descent.end.state;
    }
}
