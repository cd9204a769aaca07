//! Causes of residuals: effects that the model leaves out, and stated quantities that the frames
//! contradict. Each is a changed problem, refitted, that is adopted if χ² decreases by enough.

use super::priors::{RATE_SD, of_unknown_spins};
use super::spins::ShotSpin;
use crate::problem::descent::{Descent, descend};
use crate::problem::findings::Finding;
use crate::problem::minimise::{descend_with_noise, descend_with_states};
use crate::problem::policy::Policy;
use crate::problem::problem::{Evaluation, Problem, State};
use crate::problem::sums::Noise;
use crate::problem::uncertainty::Estimates;
use crate::problem::unknowns::{Id, Mode, Normal, Shared};

/// Parts of the way to the estimate of a score at which a descent with a freed unknown starts:
/// flights between bounces give the frame rate several minima.
const PLACES: [f64; 3] = [1.0, 2.0, 3.0];

/// Part of the decrease that a score promises with which a refit is taken to have ended where it
/// pointed.
const PROMISED: f64 = 0.8;

/// Frame rates over the stated one at which descents start.
const FRAME_RATES: [f64; 5] = [0.8, 0.9, 1.0, 1.1, 1.25];

/// Part of the decrease of another suspect with which balls that slide are the likelier explanation: it
/// contradicts no prior of the cloth.
const SLIDES_RATHER: f64 = 0.9;

/// Topspin over natural roll at which descents start whose balls slide: on either side of rolling,
/// where the friction of the cloth turns, and almost without it.
const SLIDES: [f64; 4] = [0.1, 0.8, 0.95, 1.05];

/// Steps of a refit with a freed unknown.
const FREED_STEPS: usize = 40;

/// Suspects of one round that are refitted: the largest by their score.
const MAX_SUSPECTS: usize = 3;

/// A fit of a problem that was changed.
pub(crate) struct Refit {
    pub(crate) problem: Problem,
    pub(crate) descent: Descent,
    /// Decrease of −2 log L at the noise before.
    pub(crate) fall: f64,
    /// The finding about it.
    pub(crate) finding: Option<Finding>,
}

impl Refit {
    /// Returns the fit of a changed problem from a state near its end, the noise estimated again; `fall` is
    /// the decrease at the noise before.
    fn from(mut problem: Problem, state: State, fall: f64) -> Self {
        let descent = descend_with_noise(&mut problem, state);
        Self { problem, descent, fall, finding: None }
    }

    fn saying(self, finding: Finding) -> Self {
        Self { finding: Some(finding), ..self }
    }

    fn shared(&self, id: Id) -> f64 {
        self.descent.end.state.shared[id]
    }

    /// Returns the standard error of a shared unknown.
    fn sd(&self, id: Id) -> Option<f64> {
        Estimates::new(&self.problem, &self.descent.end)?.sd(id as usize)
    }
}

/// Something that may be other than assumed.
#[derive(Clone, Copy, Debug)]
struct Suspect {
    id: Id,
    /// Decrease of χ² to first order.
    fall: f64,
    estimate: f64,
    /// Decrease that names it.
    threshold: f64,
}

/// Returns the refit with the suspect that lowers χ² most, if the decrease is significant.
pub(crate) fn explain(
    problem: &Problem,
    at: &Evaluation,
    estimates: &Estimates,
    policy: &Policy,
) -> Option<Refit> {
    let suspect = |id, fall, estimate, threshold| Suspect { id, fall, estimate, threshold };
    let scores = estimates.score_tested(problem, at).into_iter();
    let scores = scores.map(|score| suspect(score.id, score.fall, score.estimate, policy.cause));
    let conflicts = estimates.conflicts(problem, at).into_iter();
    let conflicts = conflicts.map(|c| suspect(c.id, c.size.powi(2), c.estimate, policy.conflict.powi(2)));
    let is_likely = |suspect: &Suspect| {
        let [low, high] = problem.unknown(suspect.id).bounds;
        suspect.fall > 0.5 * suspect.threshold && (low..=high).contains(&suspect.estimate)
    };
    let mut suspects: Vec<Suspect> = scores.chain(conflicts).filter(is_likely).collect();
    suspects.sort_by(|a, b| (b.fall / b.threshold).total_cmp(&(a.fall / a.threshold)));
    let suspects = suspects.into_iter().take(MAX_SUSPECTS);
    let refits = suspects.filter_map(|suspect| let_in(problem, at, suspect, policy));
    let best = refits.max_by(|a, b| a.fall.total_cmp(&b.fall))?;
    // sliding explains a deceleration that no cloth has
    let sliding = slide(problem, at, policy).filter(|sliding| sliding.fall > SLIDES_RATHER * best.fall);
    Some(sliding.unwrap_or(best))
}

/// Returns the least χ² with a suspect free and without its prior, if χ² decreases by enough.
fn let_in(problem: &Problem, at: &Evaluation, suspect: Suspect, policy: &Policy) -> Option<Refit> {
    let id = suspect.id;
    let mut wider = problem.clone();
    let before = *wider.unknown(id);
    let unknown = wider.unknown_mut(id);
    (unknown.mode, unknown.prior) = (Mode::Free, None);
    wider.refresh_contact();
    let from = at.state.shared[id];
    let mut values = PLACES.map(|part| from + part * (suspect.estimate - from)).to_vec();
    if id == Id::Rate {
        values.extend(FRAME_RATES);
    }
    // the first start serves if χ² decreases as its score promises
    let mut best = descend_from(&wider, &at.state, id, &values[..1])?;
    if id == Id::Rate || at.cost - best.end.cost < PROMISED * suspect.fall {
        let other = descend_from(&wider, &at.state, id, &values[1..])?;
        best = if other.end.cost < best.end.cost { other } else { best };
    }
    let fall = at.cost - best.end.cost;
    if !(fall > suspect.threshold) {
        return None;
    }
    let refit = Refit::from(wider, best.end.state, fall);
    let (estimate, sd) = (refit.shared(id), refit.sd(id)?);
    let (stated, size) = match before.prior {
        Some(Normal { mean, sd: of_prior }) => (mean, (estimate - mean) / sd.hypot(of_prior)),
        // masses that are stated as exact
        None if id == Id::MassRatio => (before.start, fall.sqrt().copysign(estimate - before.start)),
        None => return Some(refit.saying(Finding::Cause { id, estimate, sd, fall })),
    };
    let conflict = Finding::Conflict { id, stated, estimate, sd, size };
    (before.prior.is_none() || size.abs() >= policy.conflict).then(|| refit.saying(conflict))
}

/// Returns the best of the descents that start with unknown `id` at each of some values.
fn descend_from(problem: &Problem, state: &State, id: Id, values: &[f64]) -> Option<Descent> {
    let free = problem.free();
    let [low, high] = problem.unknown(id).bounds;
    let descend_at = |value: &f64| {
        let mut start = state.clone();
        let value = value.clamp(low, high);
        if id == Id::Rate {
            // what decelerates balls is seen in the film's seconds
            let [least, most] = problem.unknown(Id::MuK).bounds;
            let sliding = start.shared[Id::MuK] * (value / start.shared[Id::Rate]).powi(2);
            start.shared[Id::MuK] = sliding.clamp(least, most);
        }
        start.shared[id] = value;
        descend(problem, problem.evaluate(start), &free, FREED_STEPS)
    };
    let all = values.iter().map(descend_at).filter(|descent| descent.end.cost.is_finite());
    all.min_by(|a, b| a.end.cost.total_cmp(&b.end.cost))
}

/// Returns the refit with a wider prior of the frame rate if the frames disagree with the stated
/// one moderately: they seldom determine the rate, and a wrong one biases e by more than its error.
pub(crate) fn widen_rate(
    problem: &Problem,
    at: &Evaluation,
    estimates: &Estimates,
    policy: &Policy,
) -> Option<Refit> {
    let id = Id::Rate;
    let stated = problem.unknown(id).active_prior().filter(|prior| prior.sd == RATE_SD)?.mean;
    let conflict = estimates.conflicts(problem, at).into_iter().find(|conflict| conflict.id == id)?;
    if conflict.size.abs() < policy.rate_conflict {
        return None;
    }
    let mut wider = problem.clone();
    wider.unknown_mut(id).prior = Some(Normal { mean: stated, sd: policy.doubted_rate_sd });
    let mut refit = Refit::from(wider, at.state.clone(), 0.0);
    if let Some(sd) = refit.sd(id) {
        let (estimate, size) = (refit.shared(id), (refit.shared(id) - stated) / sd);
        let conflict = Finding::Conflict { id, stated, estimate, sd, size };
        refit.finding = (size.abs() > policy.conflict).then_some(conflict);
    }
    Some(refit)
}

/// Returns the refit with balls that slide before the impact though natural roll is stated, with a
/// topspin that the shots share.
fn slide(problem: &Problem, at: &Evaluation, policy: &Policy) -> Option<Refit> {
    let has_rolls = problem.film()?.shots.iter().any(|shot| shot.spin.is_said_to_roll());
    if problem.is_robust() || !has_rolls || problem.unknown(Id::Slide).mode == Mode::Free {
        return None;
    }
    let mut wider = problem.clone();
    let shots = &mut wider.film_mut()?.shots;
    let sliding = shots.len();
    for shot in shots.iter_mut().filter(|shot| shot.spin.is_said_to_roll()) {
        shot.spin = ShotSpin::SLIDES;
    }
    wider.unknown_mut(Id::Roll).mode = Mode::Fixed;
    wider.unknown_mut(Id::Slide).mode = Mode::Free;
    let mut start = at.state.clone();
    for id in [Id::Roll, Id::MuK, Id::MuR] {
        start.shared[id] = wider.unknown(id).start;
    }
    let best = descend_from(&wider, &start, Id::Slide, &SLIDES)?;
    let fall = at.cost - best.end.cost;
    if !(fall > policy.cause) {
        return None;
    }
    let refit = Refit::from(wider, best.end.state, fall);
    let topspin = refit.shared(Id::Slide);
    Some(refit.saying(Finding::Spins { fall, topspin, sliding }))
}

/// Returns the refit with the spins of all shots unknown, from the first guesses, if χ² decreases by
/// enough for one more unknown per shot.
pub(crate) fn spin_freely(
    problem: &Problem,
    at: &Evaluation,
    (first, noise): (&State, [Noise; 2]),
    policy: &Policy,
) -> Option<Refit> {
    // a spin of its own for each shot would explain wrong shots that count less
    if problem.is_robust() {
        return None;
    }
    let mut free = Problem { unknowns: of_unknown_spins(&problem.unknowns), ..problem.clone() };
    let start = State { shared: Shared::starts(&free.unknowns), ..first.clone() };
    let film = free.film_mut()?;
    film.noise = noise;
    film.shots.iter_mut().for_each(|shot| shot.spin = ShotSpin::UNKNOWN);
    let coarse = descend_with_states(&mut free, &start)?;
    let mut refit = Refit::from(free, coarse.end.state, 0.0);
    let state = &refit.descent.end.state;
    // at the noise of the first fit
    let mut same = refit.problem.clone();
    same.film_mut()?.noise = problem.film()?.noise;
    let fall = at.cost - same.evaluate(state.clone()).cost;
    let shots = &refit.problem.film()?.shots;
    if !(fall > policy.cause + 2.0 * shots.len() as f64) {
        return None;
    }
    let sliding = shots.iter().zip(&state.own[0]).filter(|(shot, _)| !shot.spin.rolls);
    let topspins: Vec<f64> = sliding.map(|(shot, own)| shot.spin.topspin_of(own, &state.shared)).collect();
    let sliding = topspins.len();
    let topspin = if sliding == 0 { 1.0 } else { topspins.iter().sum::<f64>() / sliding as f64 };
    refit.fall = fall;
    Some(refit.saying(Finding::Spins { fall, topspin, sliding }))
}
