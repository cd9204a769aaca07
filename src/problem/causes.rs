//! Causes of residuals: effects that the model leaves out, and stated quantities that the frames contradict.

use super::findings::Finding;
use super::impact::Contact;
use super::minimise::{Descent, descend, descend_with_noise};
use super::policy::Policy;
use super::problem::{Evaluation, Problem, State};
use super::spins::ShotSpin;
use super::uncertainty::Estimates;
use super::unknowns::{Id, Mode, Normal};
use crate::physics::collision::Model;

/// Parts of the way to the estimate of a score at which a descent with a freed unknown starts: flights between bounces give the frame
/// rate several minima.
const PLACES: [f64; 3] = [1.0, 2.0, 3.0];

/// Frame rates over the stated one at which descents start.
const RATES: [f64; 5] = [0.8, 0.9, 1.0, 1.1, 1.25];

/// Suspects of one round that are refitted: the largest by their score.
const MAX_SUSPECTS: usize = 3;

/// A refit with a suspect let in.
pub(super) struct Explained {
    pub problem: Problem,
    pub descent: Descent,
    pub finding: Finding,
    pub fall: f64,
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
pub(super) fn explain(problem: &Problem, at: &Evaluation, estimates: &Estimates, policy: &Policy) -> Option<Explained> {
    let scores = estimates.score_tested(problem, at).into_iter().map(|score| Suspect {
        id: score.id,
        fall: score.fall,
        estimate: score.estimate,
        threshold: policy.cause,
    });
    let conflicts = estimates.conflicts(problem, at).into_iter().map(|conflict| Suspect {
        id: conflict.id,
        fall: conflict.size * conflict.size,
        estimate: conflict.estimate,
        threshold: policy.conflict * policy.conflict,
    });
    let mut suspects: Vec<Suspect> = scores.chain(conflicts).collect();
    suspects.retain(|suspect| suspect.fall > 0.5 * suspect.threshold);
    suspects.sort_by(|a, b| (b.fall / b.threshold).total_cmp(&(a.fall / a.threshold)));
    let refits = suspects.into_iter().take(MAX_SUSPECTS).filter_map(|suspect| let_in(problem, at, suspect));
    refits.max_by(|a, b| a.fall.total_cmp(&b.fall))
}

/// Returns the least χ² with a suspect free and without its prior, if χ² falls by enough.
fn let_in(problem: &Problem, at: &Evaluation, suspect: Suspect) -> Option<Explained> {
    let id = suspect.id;
    let mut wider = problem.clone();
    let before = *wider.unknown(id);
    let unknown = wider.unknown_mut(id);
    (unknown.mode, unknown.prior) = (Mode::Free, None);
    wider.world.contact = Contact::new(wider.world.contact.object(), &wider.unknowns);
    let from = at.state.shared[id];
    let places = PLACES.map(|part| from + part * (suspect.estimate - from));
    let mut values: Vec<f64> = places.to_vec();
    if id == Id::Rate {
        values.extend(RATES);
    }
    let best = descend_from(&wider, &at.state, id, &values)?;
    let fall = at.cost - best.end.cost;
    if !(fall > suspect.threshold) {
        return None;
    }
    let descent = descend_with_noise(&mut wider, best.end.state);
    let estimates = Estimates::new(&wider, &descent.end)?;
    let (estimate, sd) = (descent.end.state.shared[id], estimates.sd(id)?);
    let finding = match before.prior {
        Some(Normal { mean, sd: prior_sd }) => {
            let size = (estimate - mean) / sd.hypot(prior_sd);
            Finding::Conflict { id, stated: mean, estimate, sd, size }
        }
        None => Finding::Cause { id, estimate, sd, fall },
    };
    Some(Explained { problem: wider, descent, finding, fall })
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

/// Returns the refit without the prior of the frame rate if the frames disagree with it moderately.
pub(super) fn free_rate(problem: &Problem, at: &Evaluation, estimates: &Estimates, policy: &Policy) -> Option<(Problem, Descent)> {
    let conflict = estimates.conflicts(problem, at).into_iter().find(|conflict| conflict.id == Id::Rate)?;
    if conflict.size.abs() < policy.rate_conflict {
        return None;
    }
    let mut wider = problem.clone();
    wider.unknown_mut(Id::Rate).prior = None;
    let values = [conflict.estimate, 0.9, 1.0, 1.1];
    let best = descend_from(&wider, &at.state, Id::Rate, &values)?;
    let descent = descend_with_noise(&mut wider, best.end.state);
    Some((wider, descent))
}

/// Returns the refit with a contact that is compliant along its surface, with the κ of phenolic resin, if χ² falls by enough.
pub(super) fn comply(problem: &Problem, at: &Evaluation, policy: &Policy) -> Option<(Problem, Descent, f64)> {
    let kappa = problem.unknown(Id::Kappa);
    let sticks = at.shots.iter().filter(|shot| shot.sticks).count();
    if kappa.mode != Mode::Fixed || kappa.start != 0.0 || sticks == 0 {
        return None;
    }
    let mut compliant = problem.clone();
    compliant.unknown_mut(Id::Kappa).start = Model::KAPPA;
    compliant.world.contact = Contact::new(compliant.world.contact.object(), &compliant.unknowns);
    let mut start = at.state.clone();
    start.shared[Id::Kappa] = Model::KAPPA;
    let descent = descend(&compliant, compliant.evaluate(start), &compliant.free(), 20);
    let fall = at.cost - descent.end.cost;
    if !(fall > policy.cause) {
        return None;
    }
    let descent = descend_with_noise(&mut compliant, descent.end.state);
    Some((compliant, descent, fall))
}

/// Returns the refit with the spins of all shots unknown, if χ² falls by enough for one more unknown per shot.
pub(super) fn spin_freely(problem: &Problem, at: &Evaluation, policy: &Policy) -> Option<(Problem, Descent, Finding)> {
    let mut free = problem.clone();
    free.spins.iter_mut().for_each(|spin| *spin = ShotSpin::unknown());
    let slide = free.unknown_mut(Id::Slide);
    (slide.mode, slide.prior) = (Mode::Free, Some(Normal { mean: 0.0, sd: 1.0 }));
    let roll = free.unknown_mut(Id::Roll);
    (roll.mode, roll.start) = (Mode::Fixed, 1.0);
    let mu_s = free.unknown_mut(Id::MuS);
    if mu_s.prior.is_none() {
        (mu_s.mode, mu_s.prior) = (Mode::Free, Some(Normal { mean: 0.3, sd: 0.1 }));
    }
    let mut start = at.state.clone();
    start.shared[Id::Roll] = 1.0;
    start.shared[Id::MuS] = 0.3;
    let noise = free.world.noise;
    let descent = descend_with_noise(&mut free, start);
    // at the noise of the first fit
    let mut same = free.clone();
    same.world.noise = noise;
    let fall = at.cost - same.evaluate(descent.end.state.clone()).cost;
    if !(fall > policy.cause + 2.0 * free.spins.len() as f64) {
        return None;
    }
    let sliding: Vec<usize> = (0..free.spins.len()).filter(|i| free.spins[*i].stated.mean == Some(Id::Slide)).collect();
    let mean = descent.end.state.shared[Id::Slide];
    let own = sliding.iter().map(|i| descent.end.state.own[*i][super::unknowns::own::TOPSPIN]).sum::<f64>();
    let topspin = if sliding.is_empty() { 1.0 } else { mean + own / sliding.len() as f64 };
    let finding = Finding::Spins { fall, topspin, sliding: sliding.len() };
    Some((free, descent, finding))
}
