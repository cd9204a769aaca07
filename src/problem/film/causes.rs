//! Causes of residuals: effects that the model leaves out, and stated quantities that the frames
//! contradict.

use super::own;
use super::priors::RATE_SD;
use super::spins::ShotSpin;
use crate::physics::collision::Model;
use crate::problem::descent::{Descent, descend};
use crate::problem::findings::Finding;
use crate::problem::minimise::{descend_with_noise, descend_with_states};
use crate::problem::policy::Policy;
use crate::problem::problem::{Evaluation, Problem, State};
use crate::problem::sums::Noise;
use crate::problem::uncertainty::{Conflict, Estimates, Score};
use crate::problem::unknowns::{Id, Mode, Normal, Shared};

/// Parts of the way to the estimate of a score at which a descent with a freed unknown starts:
/// flights between bounces give the frame rate several minima.
const PLACES: [f64; 3] = [1.0, 2.0, 3.0];

/// Part of the fall that a score promises with which a refit is taken to have ended where it
/// pointed.
const PROMISED: f64 = 0.8;

/// Frame rates over the stated one at which descents start.
const RATES: [f64; 5] = [0.8, 0.9, 1.0, 1.1, 1.25];

/// Part of the fall of another suspect with which balls that slide are the likelier explanation: it
/// contradicts no prior of the cloth.
const SLIDES_RATHER: f64 = 0.9;

/// Topspin over natural roll at which descents start whose balls slide: on either side of rolling,
/// where the friction of the cloth turns, and next to none.
const SLIDES: [f64; 4] = [0.1, 0.8, 0.95, 1.05];

/// Rounds of computing what a finer model adds, and refitting.
const ROUNDS: usize = 2;

/// Suspects of one round that are refitted: the largest by their score.
const MAX_SUSPECTS: usize = 3;

/// A fit of a problem that was changed.
pub(crate) struct Refit {
    pub problem: Problem,
    pub descent: Descent,
    /// Fall of −2 log L at the noise before.
    pub fall: f64,
    /// What is to be said of it.
    pub finding: Option<Finding>,
}

/// Something that may be other than assumed.
#[derive(Clone, Copy, Debug)]
struct Suspect {
    id: Id,
    /// Fall of χ² to first order.
    fall: f64,
    estimate: f64,
    /// Fall that names it.
    threshold: f64,
}

/// Returns the refit with the suspect that lowers χ² most, if the fall is significant.
pub(crate) fn explain(
    problem: &Problem,
    at: &Evaluation,
    estimates: &Estimates,
    policy: &Policy,
) -> Option<Refit> {
    let scores = estimates.score_tested(problem, at).into_iter();
    let scores = scores.map(|Score { id, fall, estimate, .. }| (id, fall, estimate, policy.cause));
    let conflicts = estimates.conflicts(problem, at).into_iter();
    let conflicts = conflicts
        .map(|Conflict { id, size, estimate, .. }| (id, size.powi(2), estimate, policy.conflict.powi(2)));
    let all = scores.chain(conflicts);
    let all = all.map(|(id, fall, estimate, threshold)| Suspect { id, fall, estimate, threshold });
    let is_likely = |suspect: &Suspect| {
        let [low, high] = problem.unknown(suspect.id).bounds;
        suspect.fall > 0.5 * suspect.threshold && (low..=high).contains(&suspect.estimate)
    };
    let mut suspects: Vec<Suspect> = all.filter(is_likely).collect();
    suspects.sort_by(|a, b| (b.fall / b.threshold).total_cmp(&(a.fall / a.threshold)));
    let refits =
        suspects.into_iter().take(MAX_SUSPECTS).filter_map(|suspect| let_in(problem, at, suspect, policy));
    let best = refits.max_by(|a, b| a.fall.total_cmp(&b.fall))?;
    // sliding explains a deceleration that no cloth has
    let sliding = slide(problem, at, policy).filter(|sliding| sliding.fall > SLIDES_RATHER * best.fall);
    Some(sliding.unwrap_or(best))
}

/// Returns the least χ² with a suspect free and without its prior, if χ² falls by enough.
fn let_in(problem: &Problem, at: &Evaluation, suspect: Suspect, policy: &Policy) -> Option<Refit> {
    let id = suspect.id;
    let mut wider = problem.clone();
    let before = *wider.unknown(id);
    let unknown = wider.unknown_mut(id);
    (unknown.mode, unknown.prior) = (Mode::Free, None);
    wider.refresh_contact();
    let from = at.state.shared[id];
    let mut values: Vec<f64> = PLACES.iter().map(|part| from + part * (suspect.estimate - from)).collect();
    if id == Id::Rate {
        values.extend(RATES);
    }
    // the first start serves if χ² falls as its score promises
    let mut best = descend_from(&wider, &at.state, id, &values[..1])?;
    if id == Id::Rate || at.cost - best.end.cost < PROMISED * suspect.fall {
        let other = descend_from(&wider, &at.state, id, &values[1..])?;
        best = if other.end.cost < best.end.cost { other } else { best };
    }
    let fall = at.cost - best.end.cost;
    if !(fall > suspect.threshold) {
        return None;
    }
    let descent = descend_with_noise(&mut wider, best.end.state);
    let estimates = Estimates::new(&wider, &descent.end)?;
    let (estimate, sd) = (descent.end.state.shared[id], estimates.sd(id as usize)?);
    let finding = match before.prior {
        Some(Normal { mean, sd: prior_sd }) => {
            let size = (estimate - mean) / sd.hypot(prior_sd);
            if size.abs() < policy.conflict {
                return None;
            }
            Finding::Conflict { id, stated: mean, estimate, sd, size }
        }
        // masses that are stated as exact
        None if id == Id::MassRatio => {
            let (stated, size) = (before.start, fall.sqrt().copysign(estimate - before.start));
            Finding::Conflict { id, stated, estimate, sd, size }
        }
        None => Finding::Cause { id, estimate, sd, fall },
    };
    Some(Refit { problem: wider, descent, finding: Some(finding), fall })
}

/// Returns the best of the descents that start with unknown `id` at each of some values.
fn descend_from(problem: &Problem, state: &State, id: Id, values: &[f64]) -> Option<Descent> {
    let free = problem.free();
    let [low, high] = problem.unknown(id).bounds;
    let mut best: Option<Descent> = None;
    for value in values {
        let mut start = state.clone();
        let value = value.clamp(low, high);
        if id == Id::Rate {
            // what decelerates balls is seen in the film's seconds
            let [least, most] = problem.unknown(Id::MuK).bounds;
            let sliding = start.shared[Id::MuK] * (value / start.shared[Id::Rate]).powi(2);
            start.shared[Id::MuK] = sliding.clamp(least, most);
        }
        start.shared[id] = value;
        let descent = descend(problem, problem.evaluate(start), &free, 40);
        if descent.end.cost.is_finite() && best.as_ref().is_none_or(|best| descent.end.cost < best.end.cost) {
            best = Some(descent);
        }
    }
    best
}

/// Returns the refit with a wider prior of the frame rate if the frames disagree with the stated
/// one moderately: they seldom determine the rate, and a wrong one biases e by more than its error.
pub(crate) fn widen_rate(
    problem: &Problem,
    at: &Evaluation,
    estimates: &Estimates,
    policy: &Policy,
) -> Option<Refit> {
    let prior = problem.unknown(Id::Rate).active_prior().filter(|prior| prior.sd == RATE_SD)?;
    let conflict = estimates.conflicts(problem, at).into_iter().find(|conflict| conflict.id == Id::Rate)?;
    if conflict.size.abs() < policy.rate_conflict {
        return None;
    }
    let mut wider = problem.clone();
    wider.unknown_mut(Id::Rate).prior = Some(Normal { mean: prior.mean, sd: policy.doubted_rate_sd });
    let descent = descend_with_noise(&mut wider, at.state.clone());
    Some(Refit { fall: at.cost - descent.end.cost, problem: wider, descent, finding: None })
}

/// Returns that the frames contradict the stated frame rate, if the estimate with a wider prior does.
pub(crate) fn contradicted_rate(
    problem: &Problem,
    at: &Evaluation,
    estimates: &Estimates,
    policy: &Policy,
) -> Option<Finding> {
    let stated = problem.unknown(Id::Rate).active_prior()?.mean;
    let (estimate, sd) = (at.state.shared[Id::Rate], estimates.sd(Id::Rate as usize)?);
    let size = (estimate - stated) / sd;
    let is_contradicted = size.abs() > policy.conflict;
    is_contradicted.then_some(Finding::Conflict { id: Id::Rate, stated, estimate, sd, size })
}

/// Returns the refit with a contact that is compliant along its surface, with the κ of phenolic
/// resin, if χ² falls by enough.
pub(crate) fn comply(problem: &Problem, at: &Evaluation, policy: &Policy) -> Option<Refit> {
    let kappa = problem.unknown(Id::Kappa);
    if kappa.mode != Mode::Fixed || kappa.start != 0.0 || at.count_sticking() == 0 {
        return None;
    }
    let mut compliant = problem.clone();
    let mut start = at.state.clone();
    for column in problem.columns_of(Id::Kappa) {
        let kappa = &mut compliant.unknowns[column];
        if kappa.mode == Mode::Fixed && kappa.start == 0.0 {
            kappa.start = Model::KAPPA;
            start.shared.0[column] = Model::KAPPA;
        }
    }
    compliant.refresh_contact();
    let descent = descend(&compliant, compliant.evaluate(start), &compliant.free(), 20);
    let fall = at.cost - descent.end.cost;
    if !(fall > policy.cause) {
        return None;
    }
    let descent = descend_with_noise(&mut compliant, descent.end.state);
    let (kappa, shots) = (descent.end.state.shared[Id::Kappa], at.count_sticking());
    let finding = Some(Finding::Compliance { kappa, shots, fall, adopted: true });
    Some(Refit { problem: compliant, descent, fall, finding })
}

/// Returns the refit with what weight and cloth do during the contact, if χ² falls by enough.
pub(crate) fn weigh(problem: &Problem, at: &Evaluation, policy: &Policy) -> Option<Refit> {
    let mut heavy = problem.clone();
    let film = heavy.film_mut()?;
    film.world.contact = film.world.contact.with_weight();
    let refit = correct(&heavy, at).filter(|refit| refit.fall > policy.adopt)?;
    let shots = refit.problem.samples[0].block.count_corrected();
    Some(Refit { finding: Some(Finding::Weight { shots, fall: refit.fall, adopted: true }), ..refit })
}

/// Returns the refit with what the finer model of the contact adds to each shot, computed where the
/// fit is, and once more after it has moved; `None` without a finer model.
pub(crate) fn correct(problem: &Problem, at: &Evaluation) -> Option<Refit> {
    if !problem.film()?.world.contact.is_corrected() {
        return None;
    }
    let mut corrected = problem.clone();
    let mut state = at.state.clone();
    for _ in 0..ROUNDS {
        corrected.film_mut()?.correct(&state.own[0], &state.shared);
        state = descend(&corrected, corrected.evaluate(state), &corrected.free(), 20).end.state;
    }
    let fall = at.cost - corrected.evaluate(state.clone()).cost;
    let descent = descend_with_noise(&mut corrected, state);
    Some(Refit { problem: corrected, descent, fall, finding: None })
}

/// Returns whether a robust loss lets wrong shots count less: a spin of its own for each shot would
/// explain them.
fn is_robust(problem: &Problem) -> bool {
    problem.film().is_some_and(|film| film.loss.is_some())
}

/// Returns the refit with balls that slide before the impact though natural roll is stated, with a
/// topspin that the shots share.
fn slide(problem: &Problem, at: &Evaluation, policy: &Policy) -> Option<Refit> {
    if is_robust(problem) {
        return None;
    }
    let rolls = |spin: &ShotSpin| spin.stated.mean == Some(Id::Roll) && !spin.is_unknown();
    if !problem.film()?.spins.iter().any(rolls) || problem.unknown(Id::Slide).mode == Mode::Free {
        return None;
    }
    let mut sliding = problem.clone();
    let spins = &mut sliding.film_mut()?.spins;
    let count = spins.len();
    spins.iter_mut().filter(|spin| rolls(spin)).for_each(|spin| *spin = ShotSpin::slides());
    sliding.unknown_mut(Id::Roll).mode = Mode::Fixed;
    sliding.unknown_mut(Id::Slide).mode = Mode::Free;
    let mut start = at.state.clone();
    for id in [Id::Roll, Id::MuK, Id::MuR] {
        start.shared[id] = sliding.unknown(id).start;
    }
    let best = descend_from(&sliding, &start, Id::Slide, &SLIDES)?;
    let fall = at.cost - best.end.cost;
    if !(fall > policy.cause) {
        return None;
    }
    let descent = descend_with_noise(&mut sliding, best.end.state);
    let finding = Finding::Spins { fall, topspin: descent.end.state.shared[Id::Slide], sliding: count };
    Some(Refit { problem: sliding, descent, finding: Some(finding), fall })
}

/// Returns the refit with the spins of all shots unknown, from the first guesses, if χ² falls by
/// enough for one more unknown per shot.
pub(crate) fn spin_freely(
    problem: &Problem,
    at: &Evaluation,
    first: (&State, [Noise; 2]),
    policy: &Policy,
) -> Option<Refit> {
    if is_robust(problem) {
        return None;
    }
    let mut free =
        Problem { unknowns: super::priors::of_unknown_spins(&problem.unknowns), ..problem.clone() };
    let shared = Shared::starts(&free.unknowns);
    let start = State { shared, ..first.0.clone() };
    let film = free.film_mut()?;
    film.world.noise = first.1;
    film.spins.iter_mut().for_each(|spin| *spin = ShotSpin::unknown());
    let coarse = descend_with_states(&mut free, &start)?;
    let descent = descend_with_noise(&mut free, coarse.end.state);
    // at the noise of the first fit
    let mut same = free.clone();
    same.film_mut()?.world.noise = problem.film()?.world.noise;
    let fall = at.cost - same.evaluate(descent.end.state.clone()).cost;
    let spins = &free.film()?.spins;
    if !(fall > policy.cause + 2.0 * spins.len() as f64) {
        return None;
    }
    let state = &descent.end.state;
    let sliding: Vec<usize> = (0..spins.len()).filter(|i| spins[*i].stated.mean == Some(Id::Slide)).collect();
    let sum = sliding.iter().map(|i| state.own[0][*i][own::TOPSPIN]).sum::<f64>();
    let topspin = if sliding.is_empty() { 1.0 } else { state.shared[Id::Slide] + sum / sliding.len() as f64 };
    let finding = Finding::Spins { fall, topspin, sliding: sliding.len() };
    Some(Refit { problem: free, descent, finding: Some(finding), fall })
}
