//! Fits of shots of discs: in a contact that gives way as they call for it, with what they scatter by. Fits and covariances are taken in
//! turn until both rest.

use super::effort::Effort;
use super::fidelity_choice::{EVIDENCE, GIVES_WAY, left_out};
use super::model_choice::ModelChoice;
use super::samples::Search;
use super::scatter::{Scatter, estimate, spread, with_errors};
use super::settled::{differs, told};
use super::{FitError, scatter_starts};
use crate::likelihood::fitted::Fitted;
use crate::likelihood::sample::{Sample, Unknown};
use crate::measurement::parameter::{Compliance, Parameter, Setting};
use crate::measurement::values::Values;
use crate::physics::collision::{Effects, Fidelity, FidelityChoice, Model};

/// Less than this gives way by less than is seen; (2 − σ)/2(1 − σ) with Poisson's ratio σ is 1 or more.
const LEAST_KAPPA: f64 = 0.1;

/// Rounds of fitting and weighting end where no standard deviation changes by more than this part, a small one of its error, or after
/// so many.
const AT_REST: f64 = 1e-4;
const MOST_ROUNDS: usize = 60;

/// A rigid contact, or with `auto`, where nothing is stated of it, one that gives way as the shots call for it. What is around discs
/// may be any material, so that its κ is fitted.
pub(crate) fn choose(
    raw: &[Fitted],
    search: &Search,
    fidelity: FidelityChoice,
) -> Result<ModelChoice, FitError> {
    let is_auto = fidelity == FidelityChoice::Auto;
    let mut notes = Vec::new();
    let (mut gives_way, mut starts) = (None, Vec::new());
    let sample = search.first();
    let (mut model, mut settings) = (*sample.model, *sample.settings);
    if is_auto && (settings.compliance == Compliance::Stated || settings.falls) {
        model = integrated(sample.model, settings.compliance == Compliance::Stated);
    }
    settings[Parameter::Kappa] = above_rigid(settings[Parameter::Kappa]);
    let rows = raw.iter().map(|shot| shot.plan.rows().len()).sum::<usize>();
    if is_auto && settings.compliance == Compliance::Auto && rows > settings.parameters().len() + 1 {
        let mut with = settings;
        with.compliance = Compliance::Stated;
        with[Parameter::Kappa] = above_rigid(Setting { fixed: false, ..with[Parameter::Kappa] });
        let giving = integrated(sample.model, true);
        let rigid = weigh(raw, &search.likeliest().with(|_, sample| sample.model = &model), &[])?;
        let gave = Sample { model: &giving, settings: &with, ..sample.clone() };
        let gave = weigh(raw, &Search::of(gave).likeliest(), &[])?;
        let higher = gave.minus_two_log - rigid.minus_two_log;
        if higher < -EVIDENCE {
            (model, settings, gives_way) = (giving, with, Some(-higher));
            starts = gave.starts;
        } else if higher < 0.0 {
            notes.push(left_out(GIVES_WAY, higher, "the shots do", &[]));
        }
    }
    let with = Sample { model: &model, settings: &settings, ..sample.clone() };
    let weighed = weigh(raw, &Search { samples: vec![with], ..search.clone() }, &starts)?;
    let Weighed { mut fitted, scatter, starts, rivals, .. } = weighed;
    if scatter.is_none() && model.kappa == 0.0 {
        // what the errors of the state before the impact do at a kink is then seen, too
        fitted = raw.to_vec();
    }
    let starts = starts.into_iter().map(|start| vec![start]).collect();
    let (scatter, rivals) = (Some(scatter), Some(rivals));
    Ok(ModelChoice { fitted, model, settings, starts, scatter, rivals, gives_way, notes })
}

/// κ that is fitted, without values that are as good as a rigid contact, which is another model and is computed much faster.
fn above_rigid(kappa: Setting) -> Setting {
    if kappa.fixed || kappa.upper < LEAST_KAPPA {
        return kappa;
    }
    let lower = kappa.lower.max(LEAST_KAPPA);
    Setting { lower, initial: kappa.initial.max(lower), ..kappa }
}

/// The model that is integrated, without what a cloth or the weight adds.
fn integrated(model: &Model, compliance: bool) -> Model {
    let effects = Effects { compliance, falling_friction: true, ..Fidelity::Full.effects() };
    Model {
        fidelity: Fidelity::Ode,
        effects: model.effects.and(effects),
        kappa: if compliance { model.kappa.max(Model::KAPPA) } else { 0.0 },
        tolerance: model.tolerance.max(Model::TOLERANCE_OF_FITS),
        ..*model
    }
}

/// A minimum with the scatter that it leaves.
struct Weighed {
    fitted: Vec<Fitted>,
    scatter: Scatter,
    minus_two_log: f64,
    /// Of the parameters there, and at other minima that are nearly as likely.
    starts: Vec<Values>,
    /// The latter, with how much higher −2 log L is.
    rivals: Vec<(Values, f64)>,
}

/// From these values, or without any from wherever the least minimum may be, each with its own scatter: the most likely.
fn weigh(raw: &[Fitted], search: &Search, starts: &[Values]) -> Result<Weighed, FitError> {
    let spread = spread(raw);
    let sample = search.first();
    let fitted = with_errors(raw, sample.model, &sample.initial, &spread);
    let (search, free) = told(&search.with(|_, sample| sample.fitted = &fitted))?;
    let mut starts = starts.to_vec();
    if starts.is_empty() {
        starts = scatter_starts::promising(raw, &search, &free);
    }
    if starts.is_empty() {
        starts = search.promising_starts(&free).into_iter().map(|(start, _)| start[0]).collect();
    }
    let from = |start: &Values| {
        let scatter = scatter_starts::scatter_at(raw, search.first().model, start, spread);
        settle(raw, &search, &free, *start, scatter)
    };
    let mut found = starts.iter().map(from).collect::<Result<Vec<Weighed>, FitError>>()?;
    found.sort_by(|a, b| a.minus_two_log.total_cmp(&b.minus_two_log));
    let least = found.first().map_or(f64::NAN, |best| best.minus_two_log);
    let near = found.iter().filter(|other| other.minus_two_log <= least + EVIDENCE);
    let mut minima: Vec<(Values, f64)> = Vec::new();
    for other in near {
        let is_new = |at: &&Values| minima.iter().all(|(known, _)| differs(&[**at], &[*known]));
        let new: Vec<Values> = other.starts.iter().filter(is_new).copied().collect();
        minima.extend(new.into_iter().map(|at| (at, other.minus_two_log - least)));
    }
    let starts: Vec<Values> = minima.iter().map(|(at, _)| *at).collect();
    let best = found.into_iter().next().ok_or(FitError::NoWeights)?;
    let rivals = minima.into_iter().skip(1).collect();
    Ok(Weighed { starts, rivals, ..best })
}

/// Fits and weighs in turn.
fn settle(
    raw: &[Fitted],
    search: &Search,
    free: &[Unknown],
    start: Values,
    first: Scatter,
) -> Result<Weighed, FitError> {
    let (mut values, mut scatter) = (start, first);
    for round in 0.. {
        let fitted = with_errors(raw, search.first().model, &values, &scatter);
        let at = search.from(&[values]).with(|_, sample| sample.fitted = &fitted);
        let (minimum, groups) = at.converge_with(free, Effort::SCREEN)?;
        values = *minimum.first();
        let next = estimate(raw, &at, free, &values, &scatter);
        if next.change_from(&scatter) < AT_REST || round >= MOST_ROUNDS {
            let minus_two_log = at.minus_two_log_likelihood(&minimum, &groups);
            let (starts, rivals) = (vec![values], Vec::new());
            return Ok(Weighed { fitted, scatter, minus_two_log, starts, rivals });
        }
        scatter = next;
    }
    Err(FitError::NoWeights)
}
