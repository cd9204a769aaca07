//! `--fidelity auto`: what each shot of a fit is computed with.

use rayon::prelude::*;

use super::samples::Search;
use super::settled::Settled;
use super::{Computed, FitError};
use crate::likelihood::fitted::Fitted;
use crate::likelihood::sample::{Sample, Unknown};
use crate::measurement::parameter::{Compliance, Parameter};
use crate::measurement::values::Values;
use crate::physics::collision::{FidelityChoice, Model};

/// Rounds of correcting and fitting: with its slope, a correction is off by the square of what the first changes.
const ROUNDS: usize = 2;

/// −2 log L must be lower by this, odds of 20 to 1, to go beyond the equations that the parameters are defined by.
pub(super) const EVIDENCE: f64 = 6.0;

/// What came of a choice of what shots are computed with.
#[derive(Default)]
pub(crate) struct Chosen {
    /// Where their search is to begin; none: where a scan of the friction says.
    pub starts: Vec<Vec<Values>>,
    /// How much lower −2 log L is with a contact that gives way, where they call for it.
    pub gives_way: Option<f64>,
    /// What was left out and what came of it: sentences.
    pub notes: Vec<String>,
}

/// χ²/dof of a fit that misses its data by far.
const POOR: f64 = 1.5;

/// What is as large as a part of the shots' errors.
const WEIGHT: &str =
    "The balls' weight and all that the cloth does during the impact (--fidelity contact) are";
pub(super) const GIVES_WAY: &str =
    "What a contact that gives way along its surface (kappa under [fit]) changes is";

/// Why `what` was left out, with −2 log L `higher` by so much and these values `found` with it; `who` do not tell.
pub(super) fn left_out(what: &str, higher: f64, who: &str, found: &[String]) -> String {
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
const SAMPLE: usize = 2000;

/// What each shot is computed with: a fidelity that is stated, or as the shots call for it. `near`: where a search may begin.
pub(crate) fn choose(
    fidelity: FidelityChoice,
    shots: &mut [Vec<Fitted>],
    search: &Search,
    near: &[Vec<Values>],
) -> Result<Chosen, FitError> {
    match fidelity {
        FidelityChoice::Auto => as_called_for(shots, search, near),
        FidelityChoice::Of(fidelity) if fidelity.is_integrated() => {
            Ok(Chosen { starts: integrate(shots, search)?, ..Chosen::default() })
        }
        FidelityChoice::Of(_) => Ok(Chosen { starts: near.to_vec(), ..Chosen::default() }),
    }
}

/// Each shot takes the cheapest fidelity that keeps within a part of its standard errors, first at usual
/// values, then where a fit with these ends. One that calls for more than `full` is computed as `full` with a correction,
/// which is taken anew after each fit, or where the contact gives way so much that no correction serves, integrated.
///
/// What `contact` adds rests on more than is fitted: the duration of the contact, μ_k of the cloth on the cue ball; and that a
/// contact gives way on Poisson's ratio. Unless the shots as a whole speak for it, it is left out, and what it would have given is
/// said.
fn as_called_for(
    shots: &mut [Vec<Fitted>],
    search: &Search,
    near: &[Vec<Values>],
) -> Result<Chosen, FitError> {
    let mut some = thinned(shots);
    let mut notes = Vec::new();
    take_cheapest(&mut some, search, &search.initial(), false);
    let first = settle(&some, search, near)?;
    take_cheapest(&mut some, search, &first.values, false);
    let starts = first.starts_with(&some);
    let mut found = correct(&mut some, search, &starts)?;
    let mut gives_way = None;
    let giving: Vec<Model> = search.samples.iter().zip(&*shots).map(giving).collect();
    let rigid = search;
    let search = &rigid.with(|i, sample| sample.model = &giving[i]);
    let is_asked = giving.iter().zip(&rigid.samples).any(|(giving, sample)| giving != sample.model);
    // noise that is estimated from what is left after as many unknowns compares nothing
    let rows = || some.iter().flatten().flat_map(|shot| shot.plan.rows());
    let compares = rows().all(|row| row.measured.sd.is_some()) || rows().count() > found.told.len() + 1;
    let mut taken = rigid;
    if compares && is_asked {
        take_cheapest(&mut some, search, &found.values, false);
        if some.iter().flatten().any(|shot| shot.plan.gives_way()) {
            let with = giving_way(&mut some, search, &found)?;
            let higher = with.minus_two_log - found.minus_two_log;
            if higher < -EVIDENCE {
                (taken, gives_way) = (search, Some(-higher));
                found = with;
            } else {
                notes.push(left_out(GIVES_WAY, higher, who(search), &found.told_of(&with, search)));
            }
        }
    }
    let search = taken;
    take_cheapest(&mut some, search, &found.values, true);
    let mut weighs = some.iter().flatten().any(|shot| shot.plan.has_weight());
    if weighs {
        let with = correct(&mut some, search, &found.starts)?;
        let higher = with.minus_two_log - found.minus_two_log;
        if higher > -EVIDENCE {
            notes.push(left_out(WEIGHT, higher, who(search), &found.told_of(&with, search)));
            weighs = false;
        } else {
            found = with;
        }
    }
    take_cheapest(shots, search, &found.values, weighs);
    take(shots, search, &found.values);
    Ok(Chosen { starts: found.starts, gives_way, notes })
}

/// The model with a contact that gives way, where the data are to tell whether it does.
fn giving((sample, shots): (&Sample, &Vec<Fitted>)) -> Model {
    let kappa = sample.settings[Parameter::Kappa].initial;
    let is_asked = sample.settings.compliance == Compliance::Auto
        && kappa > 0.0
        && shots.iter().all(|shot| !shot.plan.is_of_discs());
    if is_asked { Model { kappa, ..*sample.model } } else { *sample.model }
}

/// Whose shots do not tell something.
fn who(search: &Search) -> &'static str {
    if search.samples.len() > 1 { "all data sets together do" } else { "the shots do" }
}

/// Some of the shots of every sample, spread evenly.
fn thinned(shots: &[Vec<Fitted>]) -> Vec<Vec<Fitted>> {
    let step = shots.iter().map(Vec::len).sum::<usize>().div_ceil(SAMPLE).max(1);
    shots.iter().map(|own| own.iter().step_by(step).cloned().collect()).collect()
}

/// The fit with a contact that gives way, after `rigid`, which is one without. Where that describes the shots, corrections of it show
/// whether this describes them better, and only then are they integrated.
fn giving_way(some: &mut [Vec<Fitted>], search: &Search, rigid: &Found) -> Result<Found, FitError> {
    let starts = rigid.starts_with(some);
    if !starts.is_empty() && some.iter().flatten().any(|shot| shot.plan.is_direct()) {
        let mut corrected = some.to_vec();
        for shot in corrected.iter_mut().flatten() {
            shot.plan.correct_rigid();
        }
        let with = correct(&mut corrected, search, &starts)?;
        if with.minus_two_log > rigid.minus_two_log {
            return Ok(with);
        }
    }
    correct(some, search, &starts)
}

/// Each shot takes the cheapest fidelity; without weight none takes more than the contact between the balls calls for.
fn take_cheapest(shots: &mut [Vec<Fitted>], search: &Search, at: &[Values], weight: bool) {
    for ((shots, sample), at) in shots.iter_mut().zip(&search.samples).zip(at) {
        let model = sample.model;
        shots.par_iter_mut().for_each(|shot| {
            // what cannot be predicted there is told of where the fit ends
            _ = shot.plan.choose(&at.model(model), &at.coefficients());
            // weight and contact time have no part in a shot without a speed, or in one of discs
            if !(weight && shot.plan.knows_speed() && !shot.plan.is_of_discs()) {
                shot.plan.leave_out_weight(model);
            }
        });
    }
}

/// All shots at the integrated fidelity of the model, as `full` with corrections; and where their search is to begin.
fn integrate(shots: &mut [Vec<Fitted>], search: &Search) -> Result<Vec<Vec<Values>>, FitError> {
    for (shots, sample) in shots.iter_mut().zip(&search.samples) {
        for shot in shots {
            shot.plan.fix(sample.model);
        }
    }
    let mut some = thinned(shots);
    // a compliant contact takes long where a search from everywhere begins
    let mut rigid = some.clone();
    rigid.iter_mut().flatten().for_each(|shot| shot.plan.correct_rigid());
    let starts = settle(&rigid, search, &[])?.starts_with(&some);
    let corrected = correct(&mut some, search, &starts)?;
    take(shots, search, &corrected.values);
    Ok(corrected.starts)
}

/// A minimum.
struct Found {
    minus_two_log: f64,
    /// Whether it is on a plateau, or misses the data by far.
    is_poor: bool,
    values: Vec<Values>,
    /// What is free and told.
    told: Vec<(Unknown, f64)>,
    /// Where a search of shots that are computed a little differently is to begin: here first.
    starts: Vec<Vec<Values>>,
}

impl Found {
    /// Where a search begins once these shots are computed as they now are. Where they stuck, did not fit, or their noise is not
    /// stated and took up what did not fit, and are integrated now, any friction may fit: anywhere.
    fn starts_with(&self, some: &[Vec<Fitted>]) -> Vec<Vec<Values>> {
        let shots = || some.iter().flatten();
        let is_direct = shots().any(|shot| shot.plan.is_direct());
        let states_noise = shots().flat_map(|shot| shot.plan.rows()).all(|row| row.measured.sd.is_some());
        if is_direct && (self.is_poor || !states_noise) { Vec::new() } else { self.starts.clone() }
    }

    /// What another fit makes of the parameters that are told here: what is not told without an effect is hardly told with it.
    fn told_of(&self, other: &Self, search: &Search) -> Vec<String> {
        let with =
            other.told.iter().filter(|(unknown, _)| self.told.iter().any(|(known, _)| known == unknown));
        let name = |(unknown, value): &(Unknown, f64)| {
            let of_all = search
                .samples
                .iter()
                .all(|sample| sample.numbers[unknown.parameter as usize] == unknown.number);
            let whose = search.members(*unknown).next().filter(|_| !of_all);
            let whose = whose.map_or(String::new(), |i| format!(" ({})", search.samples[i].title));
            format!("{} = {value:.4}{whose}", unknown.parameter.symbol())
        };
        with.filter(|(unknown, _)| !unknown.parameter.is_of_balls()).map(name).collect()
    }
}

/// With the likelihood that can be compared, from some starts; without any wherever the least minimum may be.
fn settle(shots: &[Vec<Fitted>], search: &Search, starts: &[Vec<Values>]) -> Result<Found, FitError> {
    let search = search.likeliest().with_shots(shots);
    let settled =
        if starts.is_empty() { Settled::new(&search) } else { Settled::from_starts(&search, starts) };
    let settled = settled?;
    let starts = settled.starts_nearby();
    let is_poor = !settled.plateaus.is_empty() || settled.scale() > POOR;
    let Settled { search, free, minimum, estimated, .. } = settled;
    Ok(Found {
        is_poor,
        minus_two_log: search.minus_two_log_likelihood(&minimum, &estimated),
        told: free.iter().copied().zip(minimum.x.iter().copied()).collect(),
        values: minimum.values,
        starts,
    })
}

/// Corrects and fits in turn; without starts the first fit is one without corrections, from anywhere.
fn correct(shots: &mut [Vec<Fitted>], search: &Search, starts: &[Vec<Values>]) -> Result<Found, FitError> {
    let is_corrected = |shots: &[Vec<Fitted>]| shots.iter().flatten().any(|shot| shot.plan.is_corrected());
    let mut starts = starts.to_vec();
    if starts.is_empty() || !is_corrected(shots) {
        let found = settle(shots, search, &starts)?;
        if !is_corrected(shots) {
            return Ok(found);
        }
        starts = found.starts;
    }
    take(shots, search, &starts[0]);
    let mut found = settle(shots, search, &starts)?;
    for _ in 1..ROUNDS {
        if serve(shots, search, &found.values) {
            break;
        }
        take(shots, search, &found.starts[0]);
        found = settle(shots, search, &found.starts)?;
    }
    Ok(found)
}

/// Whether the corrections of all shots serve there as well.
fn serve(shots: &[Vec<Fitted>], search: &Search, at: &[Values]) -> bool {
    shots.iter().zip(&search.samples).zip(at).all(|((shots, sample), at)| {
        let model = at.model(sample.model);
        shots.iter().all(|shot| shot.plan.serves(&model, &at.coefficients()))
    })
}

/// Takes every shot's correction.
fn take(shots: &mut [Vec<Fitted>], search: &Search, at: &[Values]) {
    for ((shots, sample), at) in shots.iter_mut().zip(&search.samples).zip(at) {
        let model = sample.model;
        shots.par_iter_mut().for_each(|shot| {
            if shot.plan.correct(&at.model(model), &at.coefficients()).is_err() {
                if shot.plan.is_direct() {
                    shot.plan.leave_out_weight(model);
                } else {
                    shot.plan.settle_for_closed(model);
                }
            }
        });
    }
}

/// Counts what is computed how.
pub(crate) fn computed(search: &Search) -> Vec<Computed> {
    let mut computed: Vec<Computed> = Vec::new();
    for sample in &search.samples {
        let Model { fidelity, effects, .. } = *sample.model;
        let own = (fidelity, effects.and(fidelity.effects()));
        for Fitted { plan, .. } in sample.fitted {
            let (fidelity, effects) = plan.choice().unwrap_or(own);
            match computed.iter_mut().find(|c| (c.fidelity, c.effects) == (fidelity, effects)) {
                Some(known) => known.shots += 1,
                None => computed.push(Computed { fidelity, effects, shots: 1 }),
            }
        }
    }
    computed
}
