//! The minimum of χ²: a grid in μ from coarse corrections of the camera, then Levenberg and Marquardt's descent within bounds.

use nalgebra::DVector;

use super::noise;
use super::problem::{Evaluation, Problem, Reduced, State};
use super::spins::{ShotSpin, choose_states};
use super::unknowns::{Id, SHARED};

/// Values of μ that descents start from: published ones (0.03 to 0.08), waxed and chalked balls.
const GRID: [f64; 4] = [0.02, 0.06, 0.12, 0.25];

/// Unknowns of the first descents: places and scale before all others.
const COARSE: [Id; 7] =
    [Id::Mu, Id::E, Id::Scale, Id::Aspect, Id::Shear, Id::PerspectiveX, Id::PerspectiveY];

/// Noise of the first descents, m: lines through the frames next to an impact miss the balls by as much.
const COARSE_SD: f64 = 1e-3;

/// Fall of χ² below which a step is not made: 0.1 standard deviations.
const STALL: f64 = 0.01;

/// Parts by which diagonals are raised at the beginning, and at which a descent gives up.
const LEAST_DAMPING: f64 = 1e-6;
const MAX_DAMPING: f64 = 1e6;

/// Evaluations of a descent, typical are 6.
const MAX_STEPS: usize = 40;

/// Rounds of noise, spreads and spin states, typical are 3.
const MAX_ROUNDS: usize = 12;

/// The end of a descent.
pub(crate) struct Descent {
    pub end: Evaluation,
    /// Evaluations of the whole problem.
    pub evaluations: usize,
    /// Whether it ended because a step promised or gained nothing.
    pub converged: bool,
}

/// Minimises over everything free: coarsely, finely, and again with the noise that the residuals show. `None` if no start describes a
/// collision.
pub(crate) fn fit(problem: &mut Problem, start: &State) -> Option<Descent> {
    let coarse = descend_with_spins(problem, start)?;
    let end = descend_with_noise(problem, coarse.end.state);
    Some(Descent { evaluations: coarse.evaluations + end.evaluations, ..end })
}

/// Descends coarsely; shots of unknown spin all roll, or all slide, whichever leads lower: their states are judged one by one from shared
/// unknowns that suit most of them.
pub(crate) fn descend_with_spins(problem: &mut Problem, start: &State) -> Option<Descent> {
    let rolling = descend_coarsely(problem, start);
    if !problem.spins.iter().any(ShotSpin::is_unknown) {
        return rolling;
    }
    let mut sliding = problem.clone();
    sliding.spins.iter_mut().filter(|spin| spin.is_unknown()).for_each(|spin| *spin = ShotSpin::unknown_sliding());
    let other = descend_coarsely(&mut sliding, start);
    let is_lower = |other: &Descent| rolling.as_ref().is_none_or(|rolling| other.end.cost < rolling.end.cost);
    if other.as_ref().is_some_and(is_lower) {
        *problem = sliding;
        return other;
    }
    rolling
}

/// Descends a few steps over places, scale, μ and e from each μ of a grid, with a noise as large as the first guesses are wrong; returns the
/// best.
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

/// Minimises over everything free, and again with the noise and the spreads that the residuals show and the states of unknown spins, until
/// these stay.
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

/// Descends from `at` in the unknowns `free` until a step promises or gains less than [`STALL`].
pub(crate) fn descend(problem: &Problem, mut at: Evaluation, free: &[Id], steps: usize) -> Descent {
    let mut damping = LEAST_DAMPING;
    let mut evaluations = 0;
    while evaluations < steps && damping < MAX_DAMPING && at.cost.is_finite() {
        let step = at.eliminate(damping).and_then(|reduced| {
            let step = step_within_bounds(problem, &reduced, &at.state, free)?;
            let state = reduced.step(problem, &at.state, free, &step, true);
            Some((reduced.promise(free, &step), state))
        });
        let trial = match step {
            Some((promise, _)) if promise < STALL => return Descent { end: at, evaluations, converged: true },
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
        } else if trial.cost - at.cost < STALL {
            return Descent { end: at, evaluations, converged: true };
        } else {
            damping *= 100.0;
        }
    }
    Descent { end: at, evaluations, converged: false }
}

/// Returns the damped step. Unknowns that would leave their bounds go to them, and the others follow.
fn step_within_bounds(problem: &Problem, reduced: &Reduced, state: &State, free: &[Id]) -> Option<DVector<f64>> {
    let mut held: [Option<f64>; SHARED] = [None; SHARED];
    loop {
        let (stopped, moving): (Vec<Id>, Vec<Id>) = free.iter().partition(|id| held[**id as usize].is_some());
        let all: Vec<Id> = moving.iter().chain(&stopped).copied().collect();
        let matrix = reduced.matrix(&all);
        let n = moving.len();
        let known = DVector::from_fn(stopped.len(), |i, _| held[stopped[i] as usize].unwrap_or(0.0));
        let against = reduced.gradient(&moving) + matrix.view((0, n), (n, stopped.len())) * &known;
        let step = -matrix.view((0, 0), (n, n)).into_owned().cholesky()?.solve(&against);
        if !step.iter().all(|s| s.is_finite()) {
            return None;
        }
        let mut inside = true;
        for (id, by) in moving.iter().zip(step.iter()) {
            let ([low, high], x) = (problem.unknown(*id).bounds, state.shared[*id]);
            if x + by < low || x + by > high {
                held[*id as usize] = Some((x + by).clamp(low, high) - x);
                inside = false;
            }
        }
        if inside {
            let step_of = |id: &Id| held[*id as usize].or_else(|| Some(step[moving.iter().position(|m| m == id)?]));
            return free.iter().map(step_of).collect::<Option<Vec<f64>>>().map(DVector::from_vec);
        }
    }
}
