//! A [`Fit`] → [`FitDocument`].

use serde::{Serialize, Serializer};

use super::fit::Body;
use super::{
    BudgetPart, ByName, Correlation, FilmEntry, FitDocument, FittedParameter, Group, Made, MeasuredE, Noise,
    Refuted, Unknown, finite,
};
use crate::fit::{self, Fit, FoundCamera, FoundCorrection};
use crate::problem::{self, Budget};
use crate::report::{reduced_chi2, unit_name, unit_of};

/// As fit.json.
impl Serialize for Fit {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        FitDocument::from(self).serialize(serializer)
    }
}

impl From<&Fit> for FitDocument {
    fn from(fit: &Fit) -> Self {
        let joint = fit.diagnostics.joint.as_ref();
        let has_object = fit.discs.is_some() || fit.object.is_some();
        Self {
            dataset: fit.dataset.clone(),
            group: fit.group.clone().map(|(column, label)| Group { column, label }),
            verdict: Some(fit.verdict()),
            cloth: fit.cloth.clone(),
            source: fit.source.clone(),
            ball: Some(body(fit, 0)),
            object: has_object.then(|| body(fit, 1)),
            mu_k: fit.sliding,
            mu_r: fit.rolling,
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
            unknowns: fit.unknowns.iter().map(Unknown::from).collect(),
            budget: fit.budget.iter().map(|own| (own.id.name().to_owned(), budget(own))).collect(),
            explanations: fit.explanations.clone(),
            observations: joint.map_or(fit.residuals.len(), |joint| joint.observations),
            noise: fit.noise.iter().map(Noise::from).collect(),
            diagnostics: fit.diagnostics.clone(),
            shots_used: fit.shots_used,
            shots_rejected: fit.shots_rejected.clone(),
            scatter: fit.scatter.filter(|scatter| scatter.is_estimated),
            converged: fit.converged,
            termination: fit.termination.clone(),
            iterations: fit.iterations,
            seconds: fit.seconds,
        }
    }
}

/// Returns the cue ball or the object ball, or one of two discs (0 or 1): of discs with the mass only if it is stated.
fn body(fit: &Fit, which: usize) -> Body {
    let ball = fit.object.filter(|_| which == 1).map_or(fit.ball, |object| object.ball);
    let body = Body::new(&ball, fit.object.as_ref(), which);
    match fit.discs {
        Some(discs) => Body {
            radius_m: discs.radii.map_or(ball.radius, |radii| radii[which]),
            mass_kg: discs.masses.map(|masses| masses[which]),
            ..body
        },
        None => body,
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
        let if_held = found.if_model_held.iter();
        Self {
            reduced_chi2: finite(found.reduced_chi2),
            p_value: finite(found.p_value),
            sentence: found.sentence(),
            std_errors_if_model_held: if_held.map(|(p, error)| (p.name().to_owned(), *error)).collect(),
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
    let correction = |value: f64, std_error: f64| FilmEntry {
        estimate: finite(value),
        std_error: finite(std_error),
        ..FilmEntry::default()
    };
    let mut film = ByName::new();
    let mut add = |name: &str, entry: FilmEntry| film.insert(name.to_owned(), entry);
    for FoundCorrection { which, value, std_error, .. } in &found.corrections {
        add(which.name(), correction(*value, *std_error));
    }
    if let Some(noise) = found.noise_correlation {
        add("noise_correlation", correction(noise, f64::NAN));
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
