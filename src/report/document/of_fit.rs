//! A [`Fit`] → [`FitDocument`].

use serde::{Serialize, Serializer};

use super::diagnostics::by_parameter;
use super::fit::Body;
use super::{
    BudgetPart, ByName, Correlation, Estimated, Explanation, FilmEntry, FitDocument, FittedParameter,
    Goodness, Group, Joint, Made, MeasuredE, Noise, Refuted, Scatter, SharedUnknown, Unknown, each, finite,
};
use crate::fit::{self, Fit, FoundCamera, FoundCorrection, JointFit};
use crate::measurement::dataset::{Measured, ObjectBall};
use crate::problem::{self, Budget, Id};
use crate::report::{reduced_chi2, unit_name, unit_of};

/// As fit.json.
impl Serialize for Fit {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        FitDocument::from(self).serialize(serializer)
    }
}

impl From<&Fit> for FitDocument {
    fn from(fit: &Fit) -> Self {
        let found = &fit.diagnostics;
        let has_object = fit.discs.is_some() || fit.object.is_some();
        let scatter = fit.scatter.filter(|scatter| scatter.is_estimated);
        Self {
            dataset: fit.dataset.clone(),
            group: fit.group.clone().map(|(column, label)| Group { column, label }),
            verdict: Some(fit.verdict().into()),
            cloth: fit.cloth.clone(),
            source: fit.source.clone(),
            ball: Some(body(fit, 0)),
            object: has_object.then(|| body(fit, 1)),
            mu_k: fit.sliding.map(Estimated::from),
            mu_r: fit.rolling.map(Estimated::from),
            made: Made::default(),
            fidelity: fit.fidelity.to_owned(),
            method: fit.method_name().to_owned(),
            effects: fit.effects.iter().map(|(name, on)| ((*name).to_owned(), *on)).collect(),
            warnings: fit.warnings.clone(),
            notes: fit.notes.clone(),
            parameters: fit.estimates.iter().map(|estimate| parameter(fit, estimate)).collect(),
            correlation: correlation(fit),
            counted: fit.counted().name().to_owned(),
            chi2: finite(fit.chi2),
            chi2_of_priors: finite(fit.prior_chi2),
            dof: fit.dof,
            reduced_chi2: reduced_chi2(fit).and_then(finite),
            refuted: fit.refuted.as_ref().map(Refuted::from),
            film: fit.camera.as_ref().map(film),
            unknowns: each(&fit.unknowns),
            budget: fit.budget.iter().map(|own| (own.id.name().to_owned(), budget(own))).collect(),
            explanations: each(&fit.explanations),
            observations: found.joint.as_ref().map_or(fit.residuals.len(), |joint| joint.observations),
            noise: each(&fit.noise),
            computed: each(&found.computed),
            identifiability: found.identifiability.as_ref().map(Into::into),
            goodness: found.goodness.as_ref().map(|goodness| Goodness::of(goodness, fit.tested())),
            robust: found.robust.as_ref().map(Into::into),
            bootstrap: found.bootstrap.as_ref().map(Into::into),
            contours: each(&found.contours),
            profiles: each(&found.profiles),
            model_comparison: each(&found.alternatives),
            information_bound: found.bound.as_ref().map(Into::into),
            joint: found.joint.as_ref().map(Joint::from),
            shots_used: fit.shots_used,
            shots_rejected: each(&fit.shots_rejected),
            shots_doubtful: Vec::new(),
            scatter: scatter
                .map(|scatter| Scatter { e: scatter.restitution, impulse_ratio: scatter.impulse_ratio }),
            converged: fit.converged,
            termination: fit.termination.clone(),
            iterations: fit.iterations,
            seconds: fit.seconds,
        }
    }
}

impl From<Measured> for Estimated {
    fn from(measured: Measured) -> Self {
        Self { estimate: measured.value, std_error: measured.sd }
    }
}

/// Returns the cue ball or the object ball, or one of two discs (0 or 1): of discs with the mass only if it is stated, of balls with
/// the standard deviations of what is stated if they count.
fn body(fit: &Fit, which: usize) -> Body {
    let radii = fit.discs.and_then(|discs| discs.radii);
    let ball = fit.object.filter(|_| which == 1).map_or(fit.ball, |object| object.ball);
    let sd =
        |of: fn(ObjectBall) -> [f64; 2]| fit.object.map(|object| of(object)[which]).filter(|sd| *sd > 0.0);
    Body {
        radius_m: radii.map_or(ball.radius, |radii| radii[which]),
        mass_kg: match fit.discs {
            Some(discs) => discs.masses.map(|masses| masses[which]),
            None => Some(ball.mass),
        },
        inertia: ball.inertia,
        radius_m_sd: sd(|object| object.radius_sd),
        mass_kg_sd: sd(|object| object.mass_sd.unwrap_or_default()),
    }
}

fn parameter(fit: &Fit, estimate: &fit::Estimate) -> (String, FittedParameter) {
    let interval = |ends: Option<[f64; 2]>| ends.filter(|ends| ends.iter().all(|end| end.is_finite()));
    let interval_95 = interval(estimate.interval_95);
    let method = if estimate.is_profiled() { "profile" } else { "hessian" };
    let document = FittedParameter {
        meaning: estimate.parameter.meaning().to_owned(),
        unit: unit_of(estimate.parameter).to_owned(),
        estimate: estimate.value,
        std_error: estimate.std_error.and_then(finite),
        interval_95,
        interval_method: interval_95.map(|_| method.to_owned()),
        interval_95_hessian: interval(estimate.intervals.hessian),
        interval_95_profile: interval(estimate.intervals.profile),
        std_error_at_bound: estimate.std_error_at_bound.and_then(finite),
        status: estimate.status.name().to_owned(),
        plateau: fit.plateau(estimate.parameter),
    };
    (estimate.parameter.name().to_owned(), document)
}

fn correlation(fit: &Fit) -> Correlation {
    let row = |row: usize| fit.correlation.row(row).iter().map(|value| finite(*value)).collect();
    Correlation {
        order: fit.estimates.iter().map(|estimate| estimate.parameter.name().to_owned()).collect(),
        matrix: (0..fit.correlation.nrows()).map(row).collect(),
    }
}

impl From<&fit::Refuted> for Refuted {
    fn from(found: &fit::Refuted) -> Self {
        Self {
            reduced_chi2: finite(found.reduced_chi2),
            p_value: finite(found.p_value),
            sentence: found.sentence(),
            std_errors_if_model_held: by_parameter(&found.if_model_held, |error| *error),
            measured_e: found.restitution.map(|measured| MeasuredE {
                estimate: measured.value,
                std_error: finite(measured.std_error),
                scatter_between_shots: measured.scatter,
                shots: measured.shots,
            }),
        }
    }
}

/// Returns the camera as it was fitted, and what else was found of a film.
fn film(found: &FoundCamera) -> ByName<FilmEntry> {
    let correction = |value: f64, std_error: f64, adopted: bool| FilmEntry {
        estimate: finite(value),
        std_error: finite(std_error),
        adopted: Some(adopted),
        ..FilmEntry::default()
    };
    let mut film = ByName::new();
    let mut add = |name: &str, entry: FilmEntry| film.insert(name.to_owned(), entry);
    for FoundCorrection { which, value, std_error, adopted } in &found.corrections {
        add(which.name(), correction(*value, *std_error, *adopted));
    }
    if let Some(noise) = found.noise_correlation {
        add("noise_correlation", correction(noise, f64::NAN, true));
    }
    add("resolution_m", FilmEntry { estimate: Some(0.0), ..FilmEntry::default() });
    let [shots, drops] = found.drops.map(Some);
    add("dropped_frames", FilmEntry { shots, drops, ..FilmEntry::default() });
    if let Some(spoiled) = found.spoiled {
        let [before, after] = spoiled.map(Some);
        add("left_out_at_impacts", FilmEntry { before, after, ..FilmEntry::default() });
    }
    film
}

impl From<&problem::Estimate> for Unknown {
    fn from(found: &problem::Estimate) -> Self {
        Self {
            name: found.id.name().to_owned(),
            estimate: finite(found.value),
            std_error: found.std_error.and_then(finite),
            prior: found.prior.map(|prior| [prior.mean, prior.sd]),
            prior_pull: found.prior.and_then(|prior| finite((found.value - prior.mean) / prior.sd)),
        }
    }
}

/// Returns the parts of a standard error, the largest first.
pub(in crate::report) fn budget(found: &Budget) -> Vec<BudgetPart> {
    let mut parts: Vec<(&str, f64)> =
        found.shares.iter().map(|share| (share.nuisance.name(), share.variance)).collect();
    parts.push(("noise", found.noise));
    parts.sort_by(|a, b| b.1.total_cmp(&a.1));
    let part = |(source, variance): (&str, f64)| BudgetPart {
        source: source.to_owned(),
        std_error: finite(variance.max(0.0).sqrt()),
    };
    parts.into_iter().map(part).collect()
}

impl From<&fit::Explanation> for Explanation {
    fn from(found: &fit::Explanation) -> Self {
        Self {
            cause: found.cause.to_owned(),
            estimate: finite(found.estimate),
            std_error: finite(found.std_error),
            delta_2logl: finite(found.delta_2logl),
            adopted: found.adopted,
            sentence: found.sentence.clone(),
        }
    }
}

impl From<&fit::Noise> for Noise {
    fn from(noise: &fit::Noise) -> Self {
        let unit_si = noise.observable.unit_si();
        Self {
            observable: noise.observable.column().to_owned(),
            unit: unit_name(noise.observable).to_owned(),
            count: noise.count,
            rms: finite(noise.rms / unit_si),
            estimated_sd: noise.estimated_sd.and_then(|sd| finite(sd / unit_si)),
        }
    }
}

/// Quantile of the normal distribution that a 95 % interval takes.
const QUANTILE_95: f64 = 1.96;

impl From<&JointFit> for Joint {
    fn from(found: &JointFit) -> Self {
        // film holds the camera
        let shared = found.shared.iter().filter(|unknown| unknown.id < Id::Scale).filter_map(|unknown| {
            let std_error = unknown.std_error?;
            let interval_95 = [-QUANTILE_95, QUANTILE_95].map(|times| unknown.value + times * std_error);
            let shared = SharedUnknown { value: unknown.value, std_error, interval_95 };
            Some((unknown.id.name().to_owned(), shared))
        });
        Self {
            p_value: found.p_value,
            observations: found.observations,
            shot_unknowns: found.unknowns,
            shared: shared.collect(),
        }
    }
}
