//! Causes of residuals: effects that the model leaves out, and stated quantities that the frames
//! contradict. Each is a changed problem, refitted, that is adopted if χ² decreases by enough.

use std::sync::Arc;

use super::priors::{RATE_SD, of_unknown_spins};
use super::spins::ShotSpin;
use crate::problem::evaluation::Evaluation;
use crate::problem::findings::Finding;
use crate::problem::minimise::{Descent, descend_with_noise, fit};
use crate::problem::noise::unlikely;
use crate::problem::policy::POLICY;
use crate::problem::problem::{Prepared, Problem, State};
use crate::problem::uncertainty::{Estimates, Suspect};
use crate::problem::unknowns::{Id, Mode, Normal, Shared, Unknown};

/// Parts of the way to the estimate of a score at which a descent with a freed unknown starts:
/// flights between bounces give the frame rate several minima.
const PLACES: [f64; 3] = [1.0, 2.0, 3.0];

/// Part of the decrease that a score promises with which a refit is taken to have ended at the
/// estimate of the score.
const KEPT_PROMISE: f64 = 0.8;

/// Frame rates over the stated one at which descents start.
const FRAME_RATES: [f64; 5] = [0.8, 0.9, 1.0, 1.1, 1.25];

/// Suspects of one round that are refitted: the largest by their score.
const MAX_SUSPECTS: usize = 3;

/// A fit of a problem that was changed.
pub(crate) struct Refit {
    pub(crate) problem: Problem,
    pub(crate) descent: Descent,
    /// Decrease of −2 log L.
    pub(crate) fall: f64,
    pub(crate) finding: Option<Finding>,
}

impl Refit {
    /// Returns a shared unknown with its standard error.
    fn estimate(&self, id: Id) -> Option<(f64, f64)> {
        let sd = Estimates::new(&self.problem, &self.descent.end)?.sd(id as usize)?;
        Some((self.descent.end.state.shared[id], sd))
    }
}

/// Returns the refit with the suspect that lowers χ² most, if the decrease is significant.
pub(crate) fn explain(problem: &Problem, at: &Evaluation, estimates: &Estimates) -> Option<Refit> {
    let rank = |suspect: &Suspect| suspect.size.powi(2) / threshold(problem.unknown(suspect.id));
    let is_likely = |suspect: &Suspect| {
        let [low, high] = problem.unknown(suspect.id).bounds;
        (low..=high).contains(&suspect.estimate) && rank(suspect) > 0.5
    };
    let mut suspects = estimates.suspects(problem, at);
    suspects.retain(is_likely);
    suspects.sort_by(|a, b| rank(b).total_cmp(&rank(a)));
    let suspects = suspects.into_iter().take(MAX_SUSPECTS);
    let mut all: Vec<(Refit, &Unknown)> = suspects
        .filter_map(|suspect| Some((let_in(problem, at, suspect)?, problem.unknown(suspect.id))))
        .collect();
    all.sort_by(|(a, _), (b, _)| b.fall.total_cmp(&a.fall));
    all.into_iter().find_map(|(freed, before)| freed.named(before))
}

/// Returns the decrease of χ² that names an unknown.
fn threshold(unknown: &Unknown) -> f64 {
    if unknown.mode == Mode::Tested { POLICY.cause } else { POLICY.conflict.powi(2) }
}

/// Returns the refit with a suspect free and without its prior, if χ² decreases by enough.
fn let_in(problem: &Problem, at: &Evaluation, suspect: Suspect) -> Option<Refit> {
    let id = suspect.id;
    let mut wider = problem.clone();
    let unknown = wider.unknown_mut(id);
    (unknown.mode, unknown.prior) = (Mode::Free, None);
    wider.refresh_contact();
    let from = at.state.shared[id];
    let mut values = PLACES.map(|part| from + part * (suspect.estimate - from)).to_vec();
    if id == Id::Rate {
        values.extend(FRAME_RATES);
    }
    // the first start serves if χ² decreases as its score promises
    let mut descent = descend_from(&wider, &at.state, id, &values[..1])?;
    if id == Id::Rate || at.cost - descent.end.cost < KEPT_PROMISE * suspect.size.powi(2) {
        let other = descend_from(&wider, &at.state, id, &values[1..])?;
        if other.end.cost < descent.end.cost {
            descent = other;
        }
    }
    let fall = at.cost - descent.end.cost;
    let refit = Refit { problem: wider, descent, fall, finding: None };
    (fall > threshold(problem.unknown(id))).then_some(refit)
}

impl Refit {
    /// Returns the refit with the noise that residuals show, and with what it finds of an unknown
    /// that was as `before`; `None` if that is not far from what is known.
    fn named(mut self, before: &Unknown) -> Option<Self> {
        let (id, fall) = (before.id, self.fall);
        self.descent = descend_with_noise(&mut self.problem, self.descent.end.state);
        let (estimate, sd) = self.estimate(id)?;
        let (stated, size) = match before.prior {
            Some(Normal { mean, sd: of_prior }) => (mean, (estimate - mean) / sd.hypot(of_prior)),
            // masses that are stated as exact
            None => (before.start, fall.sqrt().copysign(estimate - before.start)),
        };
        let finding = if before.prior.is_none() && id != Id::MassRatio {
            Finding::Cause { id, estimate, sd, fall }
        } else {
            Finding::Conflict { id, stated, estimate, sd, size }
        };
        let is_named = before.prior.is_none() || size.abs() >= POLICY.conflict;
        is_named.then_some(Self { finding: Some(finding), ..self })
    }
}

/// Returns the lowest of the descents that start with unknown `id` at each of some values.
fn descend_from(problem: &Problem, state: &State, id: Id, values: &[f64]) -> Option<Descent> {
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
        problem.descend(start)
    };
    let all = values.iter().map(descend_at).filter(|descent| descent.end.cost.is_finite());
    all.min_by(|a, b| a.end.cost.total_cmp(&b.end.cost))
}

/// Returns the refit with a wider prior of a frame rate that is stated without an error: frames
/// seldom determine the rate, and a wrong one biases e by more than its error. While causes are
/// looked for, a wider one would let false ones in.
pub(crate) fn widen_rate(problem: &Problem, at: &Evaluation) -> Option<Refit> {
    let id = Id::Rate;
    let stated = problem.unknown(id).active_prior().filter(|prior| prior.sd == RATE_SD)?.mean;
    let mut wider = problem.clone();
    wider.unknown_mut(id).prior = Some(Normal { mean: stated, sd: POLICY.rate_sd });
    let descent = wider.descend(at.state.clone());
    let mut refit = Refit { problem: wider, descent, fall: 0.0, finding: None };
    if let Some((estimate, sd)) = refit.estimate(id) {
        let size = (estimate - stated) / sd;
        let conflict = Finding::Conflict { id, stated, estimate, sd, size };
        refit.finding = (size.abs() > POLICY.conflict).then_some(conflict);
    }
    Some(refit)
}

/// Returns the refit with the spins of all shots unknown, from the `first` guesses, if some are
/// stated. Its decrease of −2 log L is that with the own unknowns integrated over.
pub(crate) fn spin_freely(problem: &Problem, at: &Evaluation, first: &Prepared) -> Option<Refit> {
    // a spin of its own for each shot would explain wrong shots that count less
    if problem.is_robust() || problem.film()?.shots.iter().all(|shot| shot.spin.is_unknown()) {
        return None;
    }
    let mut free = Problem { unknowns: of_unknown_spins(&problem.unknowns), ..problem.clone() };
    let start = State { shared: Shared::starts(&free.unknowns), ..first.start.clone() };
    let film = free.film_mut()?;
    let before = first.problem.film()?;
    film.variation = before.variation.clone();
    for shot in Arc::make_mut(&mut film.shots) {
        shot.spin = ShotSpin::UNKNOWN;
    }
    let descent = fit(&mut free, &start)?;
    let fall = unlikely(problem, at) - unlikely(&free, &descent.end);
    // few shots may not determine all of these unknowns
    Estimates::new(&free, &descent.end)?;
    Some(Refit { problem: free, descent, fall, finding: Some(Finding::Spins { fall }) })
}
