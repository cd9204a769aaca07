//! `--fidelity auto`: what each shot of a fit is computed with.

use rayon::prelude::*;

use super::run::Settled;
use super::search::Search;
use super::{Computed, FitError};
use crate::collision::{Coefficients, Model};
use crate::residuals::Fitted;

/// Of a shot's smallest standard error, what may be left out: squared it adds a hundredth.
const PART: f64 = 0.1;

/// Of the speed, where the data state no errors.
const OTHERWISE: f64 = 1e-4;

/// Rounds of correcting and fitting: with its slope, a correction is off by the square of what the first changes.
const ROUNDS: usize = 2;

/// Each shot takes the cheapest fidelity that keeps within [`PART`] of its standard errors, first at the initial
/// values, then where a fit with these ends. One that calls for `contact` is computed as `full` with a correction,
/// which is taken anew after each fit.
///
/// What `contact` adds rests on more than is fitted: the duration of the contact, μ_k of the cloth on the cue
/// ball. Where the shots as a whole are fitted less well with it, none is corrected, and what −2 log L was higher by
/// is returned.
pub(super) fn choose(
    fitted: &mut [Fitted],
    search: &Search,
    on_cloth: bool,
) -> Result<Option<f64>, FitError> {
    let model = search.model;
    let choose = |fitted: &mut [Fitted], at: Coefficients| {
        fitted.par_iter_mut().for_each(|shot| {
            // what cannot be predicted there is told of where the fit ends
            _ = shot.plan.choose(model, &at, PART, OTHERWISE);
            // weight and contact time have no part in a shot without a speed
            if !(on_cloth && shot.plan.knows_speed()) {
                shot.plan.settle_for_closed(model);
            }
        });
    };
    choose(fitted, search.initial);
    let (_, at) = settle(fitted, search)?;
    choose(fitted, at);
    if !fitted.iter().any(|shot| shot.plan.is_corrected()) {
        return Ok(None);
    }
    let (closed, at) = settle(fitted, search)?;
    let worse = correct(fitted, search, at)? - closed;
    if worse > 0.0 {
        fitted.par_iter_mut().for_each(|shot| shot.plan.settle_for_closed(model));
    }
    Ok((worse > 0.0).then_some(worse))
}

/// All shots at the integrated fidelity of the model, as `full` with corrections.
pub(super) fn integrate(fitted: &mut [Fitted], search: &Search) -> Result<(), FitError> {
    for shot in &mut *fitted {
        shot.plan.fix(search.model);
    }
    let (_, at) = settle(fitted, search)?;
    correct(fitted, search, at)?;
    Ok(())
}

/// −2 log L and the coefficients at the minimum; with the likelihood that can be compared.
fn settle(fitted: &[Fitted], search: &Search) -> Result<(f64, Coefficients), FitError> {
    let settled = Settled::new(&Search { fitted, maximum_likelihood: true, ..search.clone() })?;
    let minus_two_log = settled.search.minus_two_log_likelihood(&settled.minimum, &settled.estimated);
    Ok((minus_two_log, settled.minimum.coefficients))
}

/// Corrects and fits in turn; −2 log L in the end.
fn correct(fitted: &mut [Fitted], search: &Search, mut at: Coefficients) -> Result<f64, FitError> {
    let mut minus_two_log = f64::NAN;
    for _ in 0..ROUNDS {
        fitted.par_iter_mut().for_each(|shot| {
            if shot.plan.correct(search.model, &at).is_err() {
                shot.plan.settle_for_closed(search.model);
            }
        });
        (minus_two_log, at) = settle(fitted, search)?;
    }
    Ok(minus_two_log)
}

/// Counts what is computed how.
pub(super) fn computed(fitted: &[Fitted], model: &Model) -> Vec<Computed> {
    let own = (model.fidelity, model.effects.and(model.fidelity.effects()));
    let mut computed: Vec<Computed> = Vec::new();
    for Fitted { plan, .. } in fitted {
        let (fidelity, effects) = plan.choice().unwrap_or(own);
        match computed.iter_mut().find(|c| (c.fidelity, c.effects) == (fidelity, effects)) {
            Some(known) => known.shots += 1,
            None => computed.push(Computed { fidelity, effects, shots: 1 }),
        }
    }
    computed
}
