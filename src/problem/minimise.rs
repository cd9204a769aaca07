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

/// Rounds of noise, spreads and spin states, typical are 3.
const MAX_ROUNDS: usize = 12;

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
/// the first guesses are wrong; returns the best.
fn descend_coarsely(problem: &mut Problem, start: &State) -> Option<Descent> {
    let fine = problem.world.noise;
    problem.world.noise = fine.map(|noise| noise::Noise { sd: noise.sd.max(COARSE_SD), ..noise });
    let free = problem.free();
    let coarse_ids: Vec<Id> = free.iter().copied().filter(|id| COARSE.contains(id)).collect();
    let mut evaluations = 0;
    let mut best: Option<Descent> = None;
    for mu in GRID {
        let mut state = start.clone();
        if free.contains(&Id::Mu) {
            let [low, high] = problem.unknown(Id::Mu).bounds;
            state.shared[Id::Mu] = mu.clamp(low, high);
        }
        let coarse = descend(problem, problem.evaluate(state), &coarse_ids, 3);
        evaluations += 1 + coarse.evaluations;
        if coarse.end.cost.is_finite() && best.as_ref().is_none_or(|best| coarse.end.cost < best.end.cost) {
            best = Some(coarse);
        }
    }
    problem.world.noise = fine;
    best.map(|best| Descent { evaluations, ..best })
}

/// Minimises over everything free, and again with the noise and the spreads that the residuals show
/// and the states of unknown spins, until these stay.
pub(crate) fn descend_with_noise(problem: &mut Problem, mut state: State) -> Descent {
    let free = problem.free();
    let mut evaluations = 0;
    let mut round = 0;
    loop {
        let changed = choose_states(problem, &mut state);
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
