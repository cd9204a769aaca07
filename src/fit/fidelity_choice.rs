//! `--fidelity auto`: what each shot of a fit is computed with.

use rayon::prelude::*;

use super::search::Search;
use super::settled::Settled;
use super::{Computed, FitError};
use crate::likelihood::fitted::Fitted;
use crate::measurement::parameter::Parameter;
use crate::measurement::values::Values;
use crate::physics::collision::Model;

/// Of a shot's smallest standard error, what may be left out: squared it adds a hundredth.
pub(crate) const PART: f64 = 0.1;

/// Of the speed, where the data state no errors.
pub(crate) const OTHERWISE: f64 = 1e-4;

/// Rounds of correcting and fitting: with its slope, a correction is off by the square of what the first changes.
pub(crate) const ROUNDS: usize = 2;

/// −2 log L must be lower by this, odds of 20 to 1, to go beyond the equations that the parameters are defined by.
pub(crate) const EVIDENCE: f64 = 6.0;

/// What `contact` would have given.
pub(super) struct Refused {
    /// −2 log L above that without it.
    higher: f64,
    /// The parameters that the shots tell.
    with: Vec<(Parameter, f64)>,
}

impl Refused {
    pub(super) fn note(&self) -> String {
        let found: Vec<String> = self
            .with
            .iter()
            .map(|(parameter, value)| format!("{} = {value:.4}", parameter.symbol()))
            .collect();
        left_out(self.higher, "the shots do", &found)
    }
}

/// Why `contact` was left out, with −2 log L `higher` by so much and these values `found` with it; `who` do not tell.
pub(crate) fn left_out(higher: f64, who: &str, found: &[String]) -> String {
    let verdict = if higher > EVIDENCE {
        format!("with these the shots are fitted less well (−2 log L higher by {higher:.1})")
    } else {
        let way = if higher > 0.0 { "higher" } else { "lower" };
        format!("{who} not tell whether these act (−2 log L {way} by {:.1})", higher.abs())
    };
    let found = if found.is_empty() { String::new() } else { format!(". With these {}", found.join(", ")) };
    format!(
        "The balls' weight and all that the cloth does during the impact (--fidelity contact) are as large as a part of \
         these shots' errors, but {verdict}: left out{found}."
    )
}

/// So many shots, spread evenly, tell what is to be computed how.
pub(crate) const SAMPLE: usize = 2000;

/// Each shot takes the cheapest fidelity that keeps within [`PART`] of its standard errors, first at usual
/// values, then where a fit with these ends. One that calls for `contact` is computed as `full` with a correction,
/// which is taken anew after each fit.
///
/// What `contact` adds rests on more than is fitted: the duration of the contact, μ_k of the cloth on the cue
/// ball. Unless the shots as a whole speak for it, none is corrected, and what it would have given is returned.
///
/// Also where the search of all shots is then to begin.
pub(super) fn choose(
    fitted: &mut [Fitted],
    search: &Search,
    on_cloth: bool,
    near: &[Values],
) -> Result<(Option<Refused>, Vec<Values>), FitError> {
    let model = search.model;
    let choose = |fitted: &mut [Fitted], at: Values| {
        fitted.par_iter_mut().for_each(|shot| {
            // what cannot be predicted there is told of where the fit ends
            _ = shot.plan.choose(&at.model(model), &at.coefficients, PART, OTHERWISE);
            // weight and contact time have no part in a shot without a speed
            if !(on_cloth && shot.plan.knows_speed()) {
                shot.plan.settle_for_closed(model);
            }
        });
    };
    let mut sample: Vec<Fitted> =
        fitted.iter().step_by(fitted.len().div_ceil(SAMPLE).max(1)).cloned().collect();
    choose(&mut sample, search.initial);
    let first = settle(&sample, search, near)?;
    choose(&mut sample, first.values);
    let Found { minus_two_log: closed, values: mut at, told, mut starts } =
        settle(&sample, search, &first.starts)?;
    let mut refused = None;
    if sample.iter().any(|shot| shot.plan.is_corrected()) {
        let corrected = correct(&mut sample, search, &starts)?;
        let higher = corrected.minus_two_log - closed;
        if higher > -EVIDENCE {
            // what is not identified without it is hardly identified with it
            let is_told =
                |(parameter, _): &(Parameter, f64)| told.iter().any(|(known, _)| known == parameter);
            let with = corrected.told.into_iter().filter(is_told).collect();
            refused = Some(Refused { higher, with });
        } else {
            (at, starts) = (corrected.values, corrected.starts);
        }
    }
    choose(fitted, at);
    if refused.is_some() {
        fitted.par_iter_mut().for_each(|shot| shot.plan.settle_for_closed(model));
    } else {
        take(fitted, model, &at);
    }
    Ok((refused, starts))
}

/// All shots at the integrated fidelity of the model, as `full` with corrections; and where their search is to begin.
pub(super) fn integrate(fitted: &mut [Fitted], search: &Search) -> Result<Vec<Values>, FitError> {
    for shot in &mut *fitted {
        shot.plan.fix(search.model);
    }
    let mut sample: Vec<Fitted> =
        fitted.iter().step_by(fitted.len().div_ceil(SAMPLE).max(1)).cloned().collect();
    let starts = settle(&sample, search, &[])?.starts;
    let corrected = correct(&mut sample, search, &starts)?;
    take(fitted, search.model, &corrected.values);
    Ok(corrected.starts)
}

/// A minimum.
struct Found {
    minus_two_log: f64,
    values: Values,
    /// What is free and told.
    told: Vec<(Parameter, f64)>,
    /// Where a search of shots that are computed a little differently is to begin: here first.
    starts: Vec<Values>,
}

/// With the likelihood that can be compared, from some starts; without any wherever the least minimum may be.
fn settle(fitted: &[Fitted], search: &Search, starts: &[Values]) -> Result<Found, FitError> {
    let search = Search { fitted, maximum_likelihood: true, ..search.clone() };
    let settled =
        if starts.is_empty() { Settled::new(&search) } else { Settled::from_starts(&search, starts) };
    let settled = settled?;
    let starts = settled.starts_nearby();
    let Settled { search, free, minimum, estimated, .. } = settled;
    Ok(Found {
        minus_two_log: search.minus_two_log_likelihood(&minimum, &estimated),
        values: minimum.values,
        told: free.iter().copied().zip(minimum.x.iter().copied()).collect(),
        starts,
    })
}

/// Corrects and fits in turn.
fn correct(fitted: &mut [Fitted], search: &Search, starts: &[Values]) -> Result<Found, FitError> {
    let mut starts = starts.to_vec();
    for _ in 1..ROUNDS {
        take(fitted, search.model, &starts[0]);
        starts = settle(fitted, search, &starts)?.starts;
    }
    take(fitted, search.model, &starts[0]);
    settle(fitted, search, &starts)
}

/// Takes every shot's correction.
fn take(fitted: &mut [Fitted], model: &Model, at: &Values) {
    fitted.par_iter_mut().for_each(|shot| {
        if shot.plan.correct(&at.model(model), &at.coefficients).is_err() {
            shot.plan.settle_for_closed(model);
        }
    });
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
