//! The minimum of χ²: a grid in μ from coarse corrections of the camera, then Levenberg and
//! Marquardt's descent within bounds.

use super::descent::{Descent, descend};
use super::noise;
use super::problem::{Problem, State};
use super::spins::ShotSpin;
use super::states::choose_states;
use super::unknowns::Id;

/// Values of μ that descents start from: published ones (0.03 to 0.08), waxed and chalked balls.
const GRID: [f64; 4] = [0.02, 0.06, 0.12, 0.25];

/// Unknowns of the first descents: places and scale before all others.
const COARSE: [Id; 7] = [Id::Mu, Id::E, Id::Scale, Id::Aspect, Id::Shear, Id::PerspectiveX, Id::PerspectiveY];

/// Noise of the first descents, m: lines through the frames next to an impact miss the balls by as
/// much.
const COARSE_SD: f64 = 1e-3;

/// Evaluations of a descent, typical are 6.
const MAX_STEPS: usize = 40;

/// Steps of the first descents, and of the two best ones over everything free.
const COARSE_STEPS: usize = 3;
const SECOND_STEPS: usize = 12;

/// Relative difference within which two descents end at the same μ.
const SAME_MU: f64 = 0.3;

/// Rounds after which the states of spins stay as they are.
const MAX_STATE_ROUNDS: usize = 5;

/// Rounds of noise, spreads and spin states, typical are 3.
const MAX_ROUNDS: usize = 10;

/// Minimises over everything free: coarsely, finely, and again with the noise that the residuals
/// show. `None` if no start describes a collision.
pub(crate) fn fit(problem: &mut Problem, start: &State) -> Option<Descent> {
    let coarse = descend_with_spins(problem, start)?;
    let end = descend_with_noise(problem, coarse.end.state);
    Some(Descent { evaluations: coarse.evaluations + end.evaluations, ..end })
}

/// Descends coarsely; shots of unknown spin all roll, or all slide, whichever leads lower: their
/// states are judged one by one from shared unknowns that suit most of them.
pub(crate) fn descend_with_spins(problem: &mut Problem, start: &State) -> Option<Descent> {
    let rolling = descend_coarsely(problem, start);
    if !problem.spins.iter().any(ShotSpin::is_unknown) {
        return rolling;
    }
    let mut sliding = problem.clone();
    sliding
        .spins
        .iter_mut()
        .filter(|spin| spin.is_unknown())
        .for_each(|spin| *spin = ShotSpin::unknown_sliding());
    let other = descend_coarsely(&mut sliding, start);
    let is_lower = |other: &Descent| rolling.as_ref().is_none_or(|rolling| other.end.cost < rolling.end.cost);
    if other.as_ref().is_some_and(is_lower) {
        *problem = sliding;
        return other;
    }
    rolling
}

/// Descends a few steps over places, scale, μ and e from each μ of a grid, with a noise as large as
/// the first guesses are wrong. Where the best two end at different μ, both go on over everything
/// free; returns the lower one.
fn descend_coarsely(problem: &mut Problem, start: &State) -> Option<Descent> {
    let fine = problem.world.noise;
    problem.world.noise = fine.map(|noise| noise::Noise { sd: noise.sd.max(COARSE_SD), ..noise });
    let free = problem.free();
    let coarse_ids: Vec<Id> = free.iter().copied().filter(|id| COARSE.contains(id)).collect();
    let from = |mu: f64| {
        let mut state = start.clone();
        if free.contains(&Id::Mu) {
            let [low, high] = problem.unknown(Id::Mu).bounds;
            state.shared[Id::Mu] = mu.clamp(low, high);
        }
        descend(problem, problem.evaluate(state), &coarse_ids, COARSE_STEPS)
    };
    let mut coarse: Vec<Descent> = GRID.into_iter().map(from).collect();
    let mut evaluations: usize = coarse.iter().map(|descent| 1 + descent.evaluations).sum();
    coarse.retain(|descent| descent.end.cost.is_finite());
    coarse.sort_by(|a, b| a.end.cost.total_cmp(&b.end.cost));
    problem.world.noise = fine;
    let mut ranked = coarse.into_iter();
    let best = ranked.next()?;
    let mu = best.end.state.shared[Id::Mu];
    let is_other = |other: &Descent| (other.end.state.shared[Id::Mu] / mu - 1.0).abs() > SAME_MU;
    let Some(second) = ranked.find(is_other) else { return Some(Descent { evaluations, ..best }) };
    let [first, second] = [best, second].map(|coarse| {
        let descent = descend(problem, problem.evaluate(coarse.end.state), &free, SECOND_STEPS);
        evaluations += 1 + descent.evaluations;
        descent
    });
    let lower = if second.end.cost < first.end.cost { second } else { first };
    Some(Descent { evaluations, ..lower })
}

/// Minimises over everything free, and again with the noise and the spreads that the residuals show
/// and the states of unknown spins, until these stay.
pub(crate) fn descend_with_noise(problem: &mut Problem, mut state: State) -> Descent {
    let free = problem.free();
    let mut evaluations = 0;
    let mut round = 0;
    loop {
        let changed = round < MAX_STATE_ROUNDS && choose_states(problem, &mut state);
        let descent = descend(problem, problem.evaluate(state), &free, MAX_STEPS);
        evaluations += 1 + descent.evaluations;
        round += 1;
        // noise and spreads of wrong states mean nothing
        let settled = !changed && noise::update(problem, &descent.end);
        if settled || round == MAX_ROUNDS {
            return Descent { evaluations, ..descent };
        }
        state = descent.end.state;
    }
}
