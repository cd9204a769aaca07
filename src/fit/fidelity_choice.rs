//! `--fidelity auto`: what each shot of a fit is computed with.

use rayon::prelude::*;

use super::search::Search;
use super::settled::Settled;
use super::{Computed, FitError};
use crate::likelihood::fitted::Fitted;
use crate::measurement::parameter::{Compliance, Parameter};
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

/// What the shots of a fit are computed with.
pub(super) struct Chosen {
    /// Where their search is to begin.
    pub starts: Vec<Values>,
    /// How much lower −2 log L is with a contact that gives way, where they call for it.
    pub gives_way: Option<f64>,
    /// What was left out and what came of it: sentences.
    pub notes: Vec<String>,
}

/// χ²/dof of a fit that misses its data by far.
const POOR: f64 = 1.5;

/// What is as large as a part of the shots' errors.
pub(crate) const WEIGHT: &str =
    "The balls' weight and all that the cloth does during the impact (--fidelity contact) are";
pub(super) const GIVES_WAY: &str =
    "What a contact that gives way along its surface (kappa under [fit]) changes is";

/// Why `what` was left out, with −2 log L `higher` by so much and these values `found` with it; `who` do not tell.
pub(crate) fn left_out(what: &str, higher: f64, who: &str, found: &[String]) -> String {
    let with = if what.ends_with("are") { "these" } else { "it" };
    let verdict = if higher > EVIDENCE {
        format!("with {with} the shots are fitted less well (−2 log L higher by {higher:.1})")
    } else {
        let way = if higher > 0.0 { "higher" } else { "lower" };
        let act = if with == "it" { "it acts" } else { "these act" };
        format!("{who} not tell whether {act} (−2 log L {way} by {:.1})", higher.abs())
    };
    let found = if found.is_empty() { String::new() } else { format!(". With {with} {}", found.join(", ")) };
    format!("{what} as large as a part of these shots' errors, but {verdict}: left out{found}.")
}

/// So many shots, spread evenly, tell what is to be computed how.
pub(crate) const SAMPLE: usize = 2000;

/// Each shot takes the cheapest fidelity that keeps within [`PART`] of its standard errors, first at usual
/// values, then where a fit with these ends. One that calls for more than `full` is computed as `full` with a correction,
/// which is taken anew after each fit, or where the contact gives way so much that no correction serves, integrated.
///
/// What `contact` adds rests on more than is fitted: the duration of the contact, μ_k of the cloth on the cue ball; and that a
/// contact gives way on Poisson's ratio. Unless the shots as a whole speak for it, it is left out, and what it would have given is
/// said.
pub(super) fn choose(fitted: &mut [Fitted], search: &Search, near: &[Values]) -> Result<Chosen, FitError> {
    let mut sample: Vec<Fitted> =
        fitted.iter().step_by(fitted.len().div_ceil(SAMPLE).max(1)).cloned().collect();
    let mut notes = Vec::new();
    take_cheapest(&mut sample, search.model, &search.initial, false);
    let first = settle(&sample, search, near)?;
    take_cheapest(&mut sample, search.model, &first.values, false);
    let starts = first.starts_with(&sample);
    let mut found = correct(&mut sample, search, &starts)?;
    let mut model = *search.model;
    let mut gives_way = None;
    let kappa = search.settings[Parameter::Kappa].initial;
    // noise that is estimated from what is left after as many unknowns compares nothing
    let rows = || sample.iter().flat_map(|shot| shot.plan.rows());
    let compares = rows().all(|row| row.measured.sd.is_some()) || rows().count() > found.told.len() + 1;
    if compares && search.settings.compliance == Compliance::Auto && kappa > 0.0 {
        let giving = Model { kappa, ..model };
        let search = Search { model: &giving, ..search.clone() };
        take_cheapest(&mut sample, &giving, &found.values, false);
        if sample.iter().any(|shot| shot.plan.gives_way()) {
            let with = giving_way(&mut sample, &search, &found)?;
            let higher = with.minus_two_log - found.minus_two_log;
            if higher < -EVIDENCE {
                (model, gives_way) = (giving, Some(-higher));
                found = with;
            } else {
                notes.push(left_out(GIVES_WAY, higher, "the shots do", &found.told_of(&with)));
            }
        }
    }
    let search = Search { model: &model, ..search.clone() };
    take_cheapest(&mut sample, &model, &found.values, true);
    let mut weighs = sample.iter().any(|shot| shot.plan.has_weight());
    if weighs {
        let with = correct(&mut sample, &search, &found.starts)?;
        let higher = with.minus_two_log - found.minus_two_log;
        if higher > -EVIDENCE {
            notes.push(left_out(WEIGHT, higher, "the shots do", &found.told_of(&with)));
            weighs = false;
        } else {
            found = with;
        }
    }
    take_cheapest(fitted, &model, &found.values, weighs);
    take(fitted, &model, &found.values);
    Ok(Chosen { starts: found.starts, gives_way, notes })
}

/// The fit with a contact that gives way, after `rigid`, which is one without. Where that describes the shots, corrections of it show
/// whether this describes them better, and only then are they integrated.
fn giving_way(sample: &mut [Fitted], search: &Search, rigid: &Found) -> Result<Found, FitError> {
    let starts = rigid.starts_with(sample);
    if !starts.is_empty() && sample.iter().any(|shot| shot.plan.is_direct()) {
        let mut corrected = sample.to_vec();
        for shot in &mut corrected {
            shot.plan.correct_rigid();
        }
        let with = correct(&mut corrected, search, &starts)?;
        if with.minus_two_log > rigid.minus_two_log {
            return Ok(with);
        }
    }
    correct(sample, search, &starts)
}

/// Each shot takes the cheapest fidelity; without weight none takes more than the contact between the balls calls for.
fn take_cheapest(fitted: &mut [Fitted], model: &Model, at: &Values, weight: bool) {
    fitted.par_iter_mut().for_each(|shot| {
        // what cannot be predicted there is told of where the fit ends
        _ = shot.plan.choose(&at.model(model), &at.coefficients, PART, OTHERWISE);
        // weight and contact time have no part in a shot without a speed
        if !(weight && shot.plan.knows_speed()) {
            shot.plan.leave_out_weight(model);
        }
    });
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
    /// Whether it is on a plateau, or misses the data by far.
    is_poor: bool,
    values: Values,
    /// What is free and told.
    told: Vec<(Parameter, f64)>,
    /// Where a search of shots that are computed a little differently is to begin: here first.
    starts: Vec<Values>,
}

impl Found {
    /// Where a search begins once these shots are computed as they now are. Where they stuck, did not fit, or their noise is not
    /// stated and took up what did not fit, and are integrated now, any friction may fit: anywhere.
    fn starts_with(&self, sample: &[Fitted]) -> Vec<Values> {
        let is_direct = sample.iter().any(|shot| shot.plan.is_direct());
        let states_noise =
            sample.iter().flat_map(|shot| shot.plan.rows()).all(|row| row.measured.sd.is_some());
        if is_direct && (self.is_poor || !states_noise) { Vec::new() } else { self.starts.clone() }
    }

    /// What another fit makes of the parameters that are told here: what is not told without an effect is hardly told with it.
    fn told_of(&self, other: &Self) -> Vec<String> {
        let is_told = |parameter: &Parameter| self.told.iter().any(|(known, _)| known == parameter);
        let with = other.told.iter().filter(|(parameter, _)| is_told(parameter));
        with.map(|(parameter, value)| format!("{} = {value:.4}", parameter.symbol())).collect()
    }
}

/// With the likelihood that can be compared, from some starts; without any wherever the least minimum may be.
fn settle(fitted: &[Fitted], search: &Search, starts: &[Values]) -> Result<Found, FitError> {
    let search = Search { fitted, maximum_likelihood: true, ..search.clone() };
    let settled =
        if starts.is_empty() { Settled::new(&search) } else { Settled::from_starts(&search, starts) };
    let settled = settled?;
    let starts = settled.starts_nearby();
    let is_poor = !settled.plateaus.is_empty() || settled.scale() > POOR;
    let Settled { search, free, minimum, estimated, .. } = settled;
    Ok(Found {
        is_poor,
        minus_two_log: search.minus_two_log_likelihood(&minimum, &estimated),
        values: minimum.values,
        told: free.iter().copied().zip(minimum.x.iter().copied()).collect(),
        starts,
    })
}

/// Corrects and fits in turn; without starts the first fit is one without corrections, from anywhere.
fn correct(fitted: &mut [Fitted], search: &Search, starts: &[Values]) -> Result<Found, FitError> {
    let mut starts = starts.to_vec();
    if starts.is_empty() || !fitted.iter().any(|shot| shot.plan.is_corrected()) {
        let found = settle(fitted, search, &starts)?;
        if !fitted.iter().any(|shot| shot.plan.is_corrected()) {
            return Ok(found);
        }
        starts = found.starts;
    }
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
            if shot.plan.is_direct() {
                shot.plan.leave_out_weight(model);
            } else {
                shot.plan.settle_for_closed(model);
            }
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
