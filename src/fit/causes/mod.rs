//! What explains residuals that the model leaves: each assumption of a fit that may not hold is given up in turn, and the one
//! without which −2 log L falls furthest is named first, with the value that it would have.
//!
//! Along each assumption −2 log L is that of a whole fit (a profile), so that what parameters, camera and the shots' own unknowns
//! can take up is not blamed on it. Where one assumption is not enough, the best is given up and the others are tried again.

mod cause;
mod conflict;
mod hypothesis;
mod profile;
mod score;

pub use cause::{Cause, Explanation};
use hypothesis::{Departures, Trial, Tried};
use profile::Profile;
use score::Score;

use super::Fit;
use super::camera::CONFLICT;
use super::diagnostics::goodness::IMPROBABLE;
use super::samples::Search;
use super::settled::Settled;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::frames::shared_unknowns::SharedUnknown;
use crate::likelihood::sample::Sample;
use crate::measurement::correction::Correction;
use crate::measurement::number::plain;
use crate::measurement::parameter::Parameter;

/// A cause is named if −2 log L falls by so much where it is let in: chance does that once in 10⁵ fits.
const NAMED: f64 = 20.0;

/// Causes are looked for where a score test, which follows −2 log L as a parabola, has it fall by this.
const SUSPECTED: f64 = 10.0;

/// And by this part of what the residuals are beyond the noise: a cause that leaves nearly all of a misfit is none.
const WORTH_NAMING: f64 = 0.1;

/// Another cause that takes this part of the fall explains alike.
const ALIKE: f64 = 0.95;

/// So many causes together are looked for.
const TOGETHER: usize = 3;

/// So many shots, spread evenly, tell a cause.
const SHOTS: usize = 60;

/// Whether something is left to explain: residuals that the stated noise makes improbable.
pub(super) fn is_called_for(fit: &Fit) -> bool {
    let improbable = |p: f64| p < IMPROBABLE;
    let goodness = fit.diagnostics.goodness.as_ref();
    goodness.is_some_and(|goodness| {
        goodness.p_value.is_some_and(improbable) && goodness.chi2 > goodness.dof as f64
    })
}

/// The assumptions without which, by a score test, −2 log L may be lower by what names a cause, though the noise explains the residuals:
/// noise that each shot tells by itself hides much.
pub(super) fn suspects(settled: &Settled, discs: bool) -> Vec<Cause> {
    let sample = settled.search.first();
    if !sample.is_filmed() || discs || settled.search.is_robust() {
        return Vec::new();
    }
    let some = thinned(sample);
    let sample = Sample { fitted: &some, ..sample.clone() };
    let trial = Trial { sample: &sample, start: *settled.minimum.first(), discs };
    Score::of(&trial, settled).map_or_else(Vec::new, |score| score.suspects(SUSPECTED))
}

/// Whether −2 log L is lower by a large part of what the noise does not explain if cue balls that are said to be stun roll, or the other
/// way round.
pub(super) fn are_spins_suspect(settled: &Settled, discs: bool) -> bool {
    /// Of what the noise does not explain.
    const LARGE: f64 = 0.2;
    let sample = settled.search.first();
    if !sample.is_filmed() || discs {
        return false;
    }
    let some = thinned(sample);
    let sample = Sample { fitted: &some, unknowns: found_unknowns(sample, settled), ..sample.clone() };
    let trial = Trial { sample: &sample, start: *settled.minimum.first(), discs };
    let held = Departures::default();
    if !trial.knows(Cause::CueSpin) {
        return false;
    }
    let Some(before) = trial.fit(&held) else { return false };
    [1.0, -1.0].into_iter().any(|other| {
        let there = trial.fit(&held.with(Cause::CueSpin, other));
        there.is_some_and(|there| before.minus_two_log - there.minus_two_log > LARGE * before.excess())
    })
}

/// Compares the frame rate that is stated with the one that the frames prefer, and notes how well they determine it.
pub(super) fn compare_rate(fit: &mut Fit, settled: &Settled, discs: bool) {
    let sample = settled.search.first();
    if !sample.is_filmed() || discs || settled.search.is_robust() || fit.refuted.is_some() {
        return;
    }
    let some = thinned(sample);
    let sample = Sample { fitted: &some, unknowns: found_unknowns(sample, settled), ..sample.clone() };
    let trial = Trial { sample: &sample, start: *settled.minimum.first(), discs };
    let held = Departures::default();
    let Some(before) = trial.fit(&held) else { return };
    let Some(profile) = trial.along(Cause::FrameRate, &held) else { return };
    let Some(there) = trial.fit_with_errors(&held, (Cause::FrameRate, &profile)) else { return };
    let rate = Rate::of(&before, &profile, &there);
    if rate.is_in_conflict() {
        let reduced = before.reduced();
        fit.explanations.push(trial.explanation(Cause::FrameRate, &profile, (&before, reduced), &there));
    } else {
        fit.notes.push(rate.sentence());
    }
}

/// The frame rate that the frames prefer, over the stated one.
struct Rate {
    value: f64,
    std_error: f64,
    /// Standard errors by which it differs from the stated one: the root of the fall of χ² where it is free.
    errors: f64,
    /// The parameter that it moves most, and by how many of its standard errors.
    moved: Option<(Parameter, f64)>,
}

impl Rate {
    /// Relative standard deviation of the frame rate of a camera.
    const SD: f64 = 0.005;

    fn of(before: &Tried, profile: &Profile, there: &Tried) -> Self {
        let off = (profile.at - 1.0).abs();
        let fall = (before.minus_two_log - profile.lowest).max(0.0);
        let errors = off / (off / fall.sqrt().max(f64::MIN_POSITIVE)).hypot(Self::SD);
        let moved = before
            .parameters
            .iter()
            .zip(&there.parameters)
            .map(|((parameter, from, error), (_, to, _))| (*parameter, (to - from) / error));
        let moved = moved.filter(|(_, by)| by.is_finite()).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        Self { value: profile.at, std_error: profile.error, errors, moved }
    }

    /// Beyond three standard errors; of 15 shots that tell the rate to 3 %, one that is wrong by 10 % is not beyond, and moves estimates by
    /// as many of theirs: then beyond two.
    fn is_in_conflict(&self) -> bool {
        const UNLIKELY: f64 = 2.0;
        let moves = self.moved.is_some_and(|(_, by)| by.abs() > CONFLICT);
        self.errors > if moves { UNLIKELY } else { CONFLICT }
    }

    fn sentence(&self) -> String {
        /// Relative standard error beyond which the frames do not show a frame rate that is wrong by 10 % at five standard errors.
        const WELL: f64 = 0.02;
        let stated = format!("The frame rate is taken as stated (± {} %)", 100.0 * Self::SD);
        let error = plain(100.0 * self.std_error, 2);
        if self.std_error < WELL {
            return format!("{stated}. The frames agree with it: they determine it to {error} %.");
        }
        let moved = self.moved.map_or(String::new(), |(parameter, by)| {
            let of_tenth = (by * 0.1 / (self.value - 1.0)).abs();
            format!(
                ", and one that is wrong by 10 % would move {} by {} of its standard errors",
                parameter.symbol(),
                plain(of_tenth, 2)
            )
        });
        format!("{stated}. The frames agree with it, but determine it only to {error} %{moved}.")
    }
}

/// Some of the shots, spread evenly.
fn thinned(sample: &Sample) -> Vec<Fitted> {
    let step = sample.fitted.len().div_ceil(SHOTS).max(1);
    sample.fitted.iter().step_by(step).cloned().collect()
}

/// What all shots share besides the parameters, where a fit found it.
fn found_unknowns(sample: &Sample, settled: &Settled) -> Vec<SharedUnknown> {
    let mut unknowns = sample.unknowns.clone();
    let first = settled.minimum.x.len() - settled.minimum.shared;
    if sample.is_filmed() {
        for (unknown, value) in unknowns.iter_mut().zip(settled.minimum.x.iter().skip(first)) {
            unknown.start = *value;
        }
    }
    unknowns
}

/// What explains the residuals of a fit, the best first; empty where nothing does. `reduced`: its χ²/dof, where it has one. With
/// `suspects`, all is looked for only where one of these is named.
pub(super) fn explain(
    settled: &Settled,
    search: &Search,
    (discs, reduced): (bool, Option<f64>),
    suspects: Option<&[Cause]>,
) -> Vec<Explanation> {
    let sample = search.first();
    let some = thinned(sample);
    let sample = Sample { fitted: &some, unknowns: found_unknowns(sample, settled), ..sample.clone() };
    let trial = Trial { sample: &sample, start: *settled.minimum.first(), discs };
    let mut held = Departures::default();
    let Some(mut before) = trial.fit(&held) else { return Vec::new() };
    let mut explanations = Vec::new();
    for round in 0..TOGETHER {
        let along = |causes: &[Cause]| -> Vec<(Cause, Profile)> {
            causes
                .iter()
                .copied()
                .filter(|cause| !held.contains(*cause) && trial.knows(*cause))
                .filter(|cause| trial.is_worth_it(*cause, &held, &before))
                .filter_map(|cause| Some((cause, trial.along(cause, &held)?)))
                .filter(|(cause, profile)| trial.is_believable(*cause, profile, &held))
                .collect()
        };
        let fall = |profile: &Profile| before.minus_two_log - profile.lowest;
        let is_named = |profile: &Profile| fall(profile) > NAMED.max(WORTH_NAMING * before.excess());
        if let Some(suspects) = suspects.filter(|_| round == 0)
            && !along(suspects).iter().any(|(_, profile)| is_named(profile))
        {
            break;
        }
        let mut found = along(&Cause::OF_ALL_SHOTS);
        found.sort_by(|a, b| a.1.lowest.total_cmp(&b.1.lowest));
        // shots that go their own ways take up part of whatever is wrong, and are the slowest to look along
        let explains_all = |(cause, profile): &(Cause, Profile)| {
            is_named(profile)
                && trial.fit(&held.with(*cause, profile.at)).is_some_and(|with_it| !with_it.is_unexplained())
        };
        if !found.first().is_some_and(explains_all) {
            found.extend(along(&[Cause::SideSpin]));
            found.sort_by(|a, b| a.1.lowest.total_cmp(&b.1.lowest));
        }
        let Some((best, profile)) = found.first().copied() else { break };
        if !is_named(&profile) {
            break;
        }
        let alike = |other: &Profile| round == 0 && fall(other) > ALIKE * fall(&profile);
        for (cause, profile) in found.iter().filter(|(cause, other)| *cause == best || alike(other)) {
            let Some(after) = trial.fit_with_errors(&held, (*cause, profile)) else { continue };
            let reduced = reduced.filter(|_| round == 0).unwrap_or_else(|| before.reduced());
            explanations.push(trial.explanation(*cause, profile, (&before, reduced), &after));
        }
        held = held.with(best, profile.at);
        let Some(after) = trial.fit(&held) else { break };
        before = after;
        if !before.is_unexplained() {
            break;
        }
    }
    // what came first may only have stood in for what came later
    explanations.sort_by(|a: &Explanation, b| a.delta_2logl.total_cmp(&b.delta_2logl));
    let needless = |cause: Cause| {
        held.contains(cause)
            && trial
                .fit(&held.without(cause))
                .is_some_and(|fit| fit.minus_two_log < before.minus_two_log + NAMED)
    };
    explanations
        .retain(|explanation| explanation.is_sure(trial.assumed(explanation.cause)) && explanation.is_some());
    let best = explanations.first().map(|best| best.cause);
    explanations.retain(|explanation| Some(explanation.cause) == best || !needless(explanation.cause));
    explanations
}

/// That [`explain`] found nothing, and what it looked for.
pub(super) fn none_found(settled: &Settled, search: &Search, discs: bool) -> String {
    let trial = Trial { sample: search.first(), start: *settled.minimum.first(), discs };
    let mut tried: Vec<&str> = Cause::OF_ALL_SHOTS
        .into_iter()
        .chain([Cause::SideSpin])
        .filter(|cause| trial.knows(*cause))
        .map(Cause::name)
        .collect();
    tried.dedup();
    if tried.is_empty() {
        return "Causes of the residuals were looked for on request, but these data can tell none."
            .to_owned();
    }
    format!(
        "Looked for on request, and not found: {}. Each would be named if it lowered −2 log L by more than {NAMED}.",
        tried.join(", ")
    )
}

/// What was adopted of the film, as explanations of what would be left without it, and what explains it as well.
pub(super) fn of_film(fit: &mut Fit) {
    let Some(found) = &fit.camera else { return };
    let adopted = found.corrections.iter().filter(|correction| correction.adopted);
    let mut known: Vec<Explanation> = adopted.map(Explanation::of_correction).collect();
    let scale = found.corrections.iter().find(|c| c.adopted && c.which == Correction::Scale);
    if let Some(scale) = scale.filter(|_| found.unit == 1.0) {
        known.push(Explanation::of_radius(scale));
    }
    fit.explanations.append(&mut known);
}

impl Fit {
    /// Says that the contact gives way, as the data call for it: −2 log L is `lower` by so much than with a rigid contact.
    pub(super) fn adopt_compliance(&mut self, lower: f64) {
        self.explanations.push(Explanation::of_compliance(
            self.get(Parameter::Kappa),
            self.discs.is_some(),
            lower,
        ));
        self.notes.extend(self.explanations.last().map(|explanation| explanation.sentence.clone()));
    }

    /// By how much a contact that gives way lowers −2 log L, where the data call for it.
    pub(super) fn compliance_lowers(&self) -> Option<f64> {
        let mut adopted = self.explanations.iter().filter(|known| known.adopted);
        adopted.find(|known| known.cause == Cause::Compliance).map(|known| -known.delta_2logl)
    }
}
