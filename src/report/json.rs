//! fit.json: the whole fit but its residuals, for programs. SI and radians, except where a unit
//! stands beside the number. Numbers have the digits that mean something, see `digits`.

// types of `entry` have parameters that are named after its keys
#![allow(non_camel_case_types)]

use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use super::content::Verdict;
use super::digits::{self, FEW, MANY, decimal, probability, relative, significant, to_error};
use super::{FORMAT_VERSION, ReportError, diagnostics, pretty, reduced_chi2, unit_name, unit_of};
use crate::fit::causes::Explanation;
use crate::fit::{Estimate, Fit, FoundCamera, FoundCorrection, Noise, Plateau, Refuted, Rejected};
use crate::measurement::dataset::ObjectBall;

/// fit.json as text, with a newline at its end. What is not finite becomes `null`.
pub fn render(fit: &Fit) -> Result<String, ReportError> {
    pretty(fit, &fit.dataset)
}

/// Several fits as a JSON array, with a newline at its end.
pub fn render_all(fits: &[Fit]) -> Result<String, ReportError> {
    pretty(fits, "all fits")
}

/// Whether two texts of fit.json hold the same result, whatever it took to find it.
#[must_use]
pub fn same_result(one: &str, other: &str) -> bool {
    let result = |line: &&str| !EFFORT.iter().any(|key| line.starts_with(key));
    one.lines().filter(result).eq(other.lines().filter(result))
}

/// How the lines of fit.json begin that tell what it took: the time, and steps, of which one more or less is a matter of roundings.
const EFFORT: [&str; 2] = ["  \"seconds\":", "  \"iterations\":"];

/// A value of its own that is serialized with these keys, in this order. A key that may be missing is an [`Option`] of such a value,
/// flattened.
macro_rules! entry {
    ($($(#[$attribute:meta])* $key:ident: $value:expr),* $(,)?) => {{
        #[derive(Serialize)]
        struct Entry<$($key),*> {
            $($(#[$attribute])* $key: $key),*
        }
        Entry { $($key: $value),* }
    }};
}

/// As in fit.json.
impl Serialize for Fit {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        document(self).serialize(serializer)
    }
}

/// The content of fit.json.
fn document(fit: &Fit) -> impl Serialize + '_ {
    // of discs the second one; of balls the object ball, where it is stated to differ from the cue ball
    let has_object = fit.discs.is_some() || fit.object.is_some();
    // of discs: standard deviations between shots, beyond the errors of their frames
    let scatter = fit.scatter.filter(|scatter| scatter.is_estimated).map(|scatter| {
        let (e, impulse_ratio) = (scatter.restitution, scatter.impulse_ratio);
        entry! { scatter: entry! { e: significant(e, FEW), impulse_ratio: significant(impulse_ratio, FEW) } }
    });
    entry! {
        dataset: &fit.dataset,
        group: fit.group.as_ref().map(|(column, label)| entry! { column: column, label: label }),
        verdict: Verdict::from(fit.verdict()),
        cloth: &fit.cloth,
        source: &fit.source,
        ball: body(fit, 0),
        #[serde(flatten)] object: has_object.then(|| entry! { object: body(fit, 1) }),
        mu_k: fit.sliding.map(|friction| estimated(friction.value, friction.sd)),
        mu_r: fit.rolling.map(|friction| estimated(friction.value, friction.sd)),
        version: env!("CARGO_PKG_VERSION"),
        format_version: FORMAT_VERSION,
        fidelity: fit.fidelity,
        method: fit.method_name(),
        effects: Ordered(fit.effects.clone()),
        warnings: &fit.warnings,
        notes: &fit.notes,
        parameters: Ordered(fit.estimates.iter().map(|estimate| parameter(estimate, plateau(fit, estimate))).collect()),
        correlation: entry! {
            order: fit.estimates.iter().map(|e| e.parameter.name()).collect::<Vec<_>>(),
            matrix: correlation(fit),
        },
        // what chi2, dof, observations and residuals.csv count
        counted: fit.counted().name(),
        chi2: significant(fit.chi2, MANY),
        // the part of chi2 that is no residual's
        chi2_of_priors: significant(fit.prior_chi2, FEW),
        dof: fit.dof,
        reduced_chi2: reduced_chi2(fit).map(|value| significant(value, MANY)),
        // `null` where the data do not refute the model
        refuted: fit.refuted.as_ref().map(refuted),
        film: fit.camera.as_ref().map(film),
        // every unknown that the shots share, and what adds to the errors
        unknowns: diagnostics::unknowns(&fit.unknowns),
        budget: diagnostics::budget(&fit.budget),
        // the best first; empty where nothing is amiss
        explanations: fit.explanations.iter().map(explanation).collect::<Vec<_>>(),
        observations: fit.diagnostics.joint.as_ref().map_or(fit.residuals.len(), |joint| joint.observations),
        noise: fit.noise.iter().map(noise).collect::<Vec<_>>(),
        #[serde(flatten)] diagnostics: diagnostics::entries(fit),
        shots_used: fit.shots_used,
        shots_rejected: with_reasons(&fit.shots_rejected),
        shots_doubtful: with_reasons(&fit.shots_doubtful),
        #[serde(flatten)] scatter: scatter,
        converged: fit.converged,
        termination: &fit.termination,
        iterations: fit.iterations,
        seconds: relative(fit.seconds, FEW),
    }
}

/// An object whose keys keep their order.
#[derive(Debug)]
struct Ordered<T>(Vec<(&'static str, T)>);

impl<T: Serialize> Serialize for Ordered<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(key, value)| (key, value)))
    }
}

/// An estimate of one thing.
fn estimated(value: f64, error: Option<f64>) -> impl Serialize {
    entry! { estimate: to_error(value, error), std_error: error.map(|error| relative(error, FEW)) }
}

/// A cause of residuals.
fn explanation(found: &Explanation) -> impl Serialize + '_ {
    entry! {
        cause: found.cause.name(),
        estimate: to_error(found.estimate, Some(found.std_error)),
        std_error: significant(found.std_error, FEW),
        delta_2logl: decimal(found.delta_2logl),
        adopted: found.adopted,
        sentence: &found.sentence,
    }
}

/// The cue ball or the object ball, or one of two discs (0 or 1); of discs the mass only where it is stated, of balls the standard
/// deviations of what is stated, where they count.
fn body(fit: &Fit, which: usize) -> impl Serialize + use<> {
    let radii = fit.discs.and_then(|discs| discs.radii);
    let ball = fit.object.filter(|_| which == 1).map_or(fit.ball, |object| object.ball);
    let mass_kg = match fit.discs {
        Some(discs) => discs.masses.map(|masses| masses[which]),
        None => Some(ball.mass),
    };
    let sd = |of: fn(ObjectBall) -> [f64; 2]| {
        let sd = fit.object.map(|object| of(object)[which]).filter(|sd| *sd > 0.0);
        sd.map(|sd| significant(sd, MANY))
    };
    let radius_sd = sd(|object| object.radius_sd).map(|sd| entry! { radius_m_sd: sd });
    let mass_sd = sd(|object| object.mass_sd.unwrap_or_default()).map(|sd| entry! { mass_kg_sd: sd });
    entry! {
        radius_m: significant(radii.map_or(ball.radius, |radii| radii[which]), MANY),
        mass_kg: mass_kg.map(|mass| significant(mass, MANY)),
        inertia: significant(ball.inertia, MANY),
        #[serde(flatten)] radius_sd: radius_sd,
        #[serde(flatten)] mass_sd: mass_sd,
    }
}

/// The camera as it was fitted, and what else was found of a film.
fn film(found: &FoundCamera) -> Value {
    let entry = |value: f64, std_error: f64, adopted: bool| {
        let (estimate, std_error) = (to_error(value, Some(std_error)), relative(std_error, FEW));
        json!({"estimate": estimate, "std_error": std_error, "adopted": adopted})
    };
    let [shots, drops] = found.drops;
    let mut film = json!({
        "resolution_m": {"estimate": significant(found.resolution, FEW)},
        "dropped_frames": {"shots": shots, "drops": drops},
    });
    if let Some([before, after]) = found.spoiled {
        film["left_out_at_impacts"] = json!({"before": before, "after": after});
    }
    for FoundCorrection { which, value, std_error, adopted } in &found.corrections {
        film[which.name()] = entry(*value, *std_error, *adopted);
    }
    if let Some(noise) = found.noise_correlation {
        film["noise_correlation"] = entry(noise.value, noise.std_error, noise.adopted);
    }
    film
}

/// Where the data refute the model.
fn refuted(found: &Refuted) -> impl Serialize + use<> {
    let errors = found.if_model_held.iter();
    let errors = errors.map(|(parameter, error)| (parameter.name(), relative(*error, FEW)));
    entry! {
        reduced_chi2: significant(found.reduced_chi2, MANY),
        p_value: probability(found.p_value),
        sentence: found.sentence(),
        // no errors of the estimates: they would be if the model held
        std_errors_if_model_held: Ordered(errors.collect()),
        // the ratio of the normal velocities, which needs no model
        measured_e: found.restitution.map(|measured| entry! {
            estimate: to_error(measured.value, Some(measured.std_error)),
            std_error: relative(measured.std_error, FEW),
            scatter_between_shots: relative(measured.scatter, FEW),
            shots: measured.shots,
        }),
    }
}

fn with_reasons(shots: &[Rejected]) -> Vec<impl Serialize + '_> {
    shots.iter().map(|rejected| entry! { shot: &rejected.shot, reason: &rejected.reason }).collect()
}

fn parameter(estimate: &Estimate, plateau: Option<&Plateau>) -> (&'static str, impl Serialize + use<>) {
    let error = estimate.std_error.or(estimate.std_error_at_bound);
    let finite = |interval: [f64; 2]| {
        interval.iter().all(|end| end.is_finite()).then(|| interval.map(|end| digits::end(end, error)))
    };
    let interval = estimate.interval_95.and_then(finite);
    let method = if estimate.is_profiled() { "profile" } else { "hessian" };
    let entry = entry! {
        meaning: estimate.parameter.meaning(),
        unit: unit_of(estimate.parameter),
        estimate: to_error(estimate.value, error),
        std_error: estimate.std_error.map(|error| relative(error, FEW)),
        interval_95: interval,
        interval_method: interval.map(|_| method),
        interval_95_hessian: estimate.intervals.hessian.and_then(finite),
        interval_95_profile: estimate.intervals.profile.and_then(finite),
        std_error_at_bound: estimate.std_error_at_bound.map(|error| relative(error, FEW)),
        status: estimate.status.name(),
        // every value from the first to the second fits equally
        plateau: plateau.map(|found| [to_error(found.edge, None), found.bound]),
    };
    (estimate.parameter.name(), entry)
}

fn plateau<'a>(fit: &'a Fit, estimate: &Estimate) -> Option<&'a Plateau> {
    fit.diagnostics.plateaus.iter().find(|plateau| plateau.parameter == estimate.parameter)
}

/// NaN, and with it `null`, where a parameter has no standard error.
fn correlation(fit: &Fit) -> Vec<Vec<f64>> {
    fit.correlation.row_iter().map(|row| row.iter().map(|value| decimal(*value)).collect()).collect()
}

/// In the unit of the observable's column.
fn noise(noise: &Noise) -> impl Serialize + use<> {
    let unit_si = noise.observable.unit_si();
    entry! {
        observable: noise.observable.column(),
        unit: unit_name(noise.observable),
        count: noise.count,
        rms: significant(noise.rms / unit_si, FEW),
        estimated_sd: noise.estimated_sd.map(|sd| significant(sd / unit_si, FEW)),
    }
}
