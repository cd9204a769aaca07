//! How far a fit can be trusted, for fit.json.

use serde_json::{Value, json};

use super::digits::{FEW, MANY, decimal, edge, end, probability, relative, significant, to_error};
use super::{by_name, list};
use crate::fit::{
    Alternative, Bootstrap, Bound, Combination, Computed, Contour, Fit, Goodness, Identifiability, Influence,
    JointFit, Level, Profile, Robust, Trend,
};
use crate::measurement::parameter::Parameter;
use crate::problem::{Budget, Estimate, Id};

/// The standard error of each parameter that has one: what its values elsewhere are rounded by.
type Errors<'a> = &'a dyn Fn(Parameter) -> Option<f64>;

/// The keys of fit.json that say it.
pub(super) fn entries(fit: &Fit) -> Value {
    let found = &fit.diagnostics;
    let error = |parameter: Parameter| {
        fit.estimates.iter().find(|e| e.parameter == parameter).and_then(|e| e.std_error)
    };
    // the values of a refuted model need not be determined, and differ with the last digits of the data
    let holds = fit.refuted.is_none().then_some(&error as Errors);
    json!({
        "computed": list(&found.computed, computed),
        "identifiability": found.identifiability.as_ref().map(identifiability),
        "goodness": found.goodness.as_ref().map(|found| goodness(found, fit.tested().name())),
        "robust": found.robust.as_ref().map(robust),
        "bootstrap": found.bootstrap.as_ref().map(|found| bootstrap(found, &error)),
        "contours": list(&found.contours, |found| contour(found, &error)),
        "profiles": list(&found.profiles, |found| profile(found, &error)),
        "model_comparison": list(&found.alternatives, |found| alternative(found, holds)),
        "information_bound": found.bound.as_ref().map(bound),
        "joint": found.joint.as_ref().map(joint),
    })
}

pub(super) fn computed(found: &Computed) -> Value {
    let on: Vec<_> = found.effects.list().into_iter().filter_map(|(name, on)| on.then_some(name)).collect();
    json!({"fidelity": found.fidelity.name(), "effects": on, "shots": found.shots})
}

fn bound(found: &Bound) -> Value {
    let errors = found.std_errors.iter().map(|(p, error)| (*p, relative(*error, FEW)));
    json!({"std_errors": by_name(errors), "shots": found.shots})
}

fn joint(found: &JointFit) -> Value {
    let mut all = json!({
        "p_value": found.p_value.map(probability),
        "observations": found.observations,
        "shot_unknowns": found.unknowns,
    });
    // those of the camera are told in `film`
    for Estimate { id, value, std_error, .. } in &found.shared {
        let Some(error) = std_error.filter(|_| *id < Id::Scale) else { continue };
        let ends = [value - WIDE * error, value + WIDE * error];
        all[id.name()] = json!({
            "value": to_error(*value, *std_error),
            "std_error": relative(error, FEW),
            "interval_95": ends.map(|value| end(value, *std_error)),
        });
    }
    all
}

/// Normal quantile of 95 % intervals.
const WIDE: f64 = 1.96;

/// Every unknown that the shots share.
pub(super) fn unknowns(found: &[Estimate]) -> Vec<Value> {
    let unknown = |own: &Estimate| {
        let pull = own.prior.map(|prior| (own.value - prior.mean) / prior.sd);
        json!({
            "name": own.id.name(),
            "estimate": to_error(own.value, own.std_error),
            "std_error": own.std_error.map(|error| relative(error, FEW)),
            "prior": own.prior.map(|prior| [significant(prior.mean, MANY), significant(prior.sd, FEW)]),
            "prior_pull": pull.map(decimal),
        })
    };
    found.iter().map(unknown).collect()
}

/// What each source adds to the errors of μ, μ_s and e: squares add up to that of the standard error.
pub(super) fn budget(found: &[Budget]) -> Value {
    let part = |source: &str, variance: f64| json!({"source": source, "std_error": relative(variance.max(0.0).sqrt(), FEW)});
    let of = |own: &Budget| {
        let mut parts: Vec<(&str, f64)> =
            own.shares.iter().map(|share| (share.nuisance.name(), share.variance)).collect();
        parts.push(("noise", own.noise));
        parts.sort_by(|a, b| b.1.total_cmp(&a.1));
        let parts: Vec<Value> = parts.into_iter().map(|(source, variance)| part(source, variance)).collect();
        (own.id.name().to_owned(), Value::from(parts))
    };
    Value::Object(found.iter().map(of).collect())
}

fn bootstrap(found: &Bootstrap, error: Errors) -> Value {
    let parameters = found.estimates.iter().map(|one| {
        let error = error(one.parameter).or(Some(one.std_error));
        let rounded = |value: f64| to_error(value, error);
        let entry = json!({
            "std_error": relative(one.std_error, FEW),
            "bias": rounded(one.bias),
            "interval_95_percentile": one.percentile.map(rounded),
            "interval_95_bca": one.bca.map(rounded),
        });
        (one.parameter, entry)
    });
    json!({
        "replicates": found.replicates,
        "seed": found.seed,
        "failed": found.failed,
        "parameters": by_name(parameters),
    })
}

fn profile(profile: &Profile, error: Errors) -> Value {
    let error = error(profile.parameter);
    let (values, rises): (Vec<f64>, Vec<f64>) =
        profile.points.iter().map(|[value, rise]| (end(*value, error), significant(*rise, FEW))).unzip();
    json!({"parameter": profile.parameter.name(), "value": values, "chi2_rise": rises})
}

fn contour(contour: &Contour, error: Errors) -> Value {
    let at = |point: &[f64; 2]| [0, 1].map(|i| edge(point[i], error(contour.parameters[i])));
    let level = |level: &Level| {
        json!({
            "probability": level.probability,
            "chi2_rise": relative(level.rise, MANY),
            "edge": level.edge.iter().map(at).collect::<Vec<_>>(),
        })
    };
    json!({
        "parameters": names(&contour.parameters),
        "centre": at(&contour.centre),
        "levels": list(&contour.levels, level),
    })
}

/// Without values where the data refute the model: they need not be determined, and differ with the last digits of the data.
fn alternative(model: &Alternative, error: Option<Errors>) -> Value {
    let values = model.values.iter().filter_map(|(p, value)| Some((*p, to_error(*value, error?(*p)))));
    let ratio = model.likelihood_ratio;
    let ratio = ratio.map(|r| json!({"statistic": decimal(r.statistic), "p_value": probability(r.p_value)}));
    json!({
        "model": model.name,
        "failed": model.failed,
        "values": by_name(values),
        "fitted_parameters": model.parameters,
        "delta_aic": decimal(model.delta_aic),
        "delta_bic": decimal(model.delta_bic),
        "likelihood_ratio": ratio,
    })
}

fn goodness(found: &Goodness, tested: &str) -> Value {
    let trend = |trend: &Trend| {
        json!({
            "residuals_of": trend.quantity,
            "against": trend.variable.name(),
            "slope_sd": significant(trend.slope, FEW),
            "slope_per": trend.variable.unit(),
            "p_value": probability(trend.p_value),
            "p_corrected": probability(trend.p_corrected),
            "significant": trend.significant,
            "words": trend.words,
        })
    };
    let influence = |shot: &Influence| {
        let shifts = shot.shifts.iter().map(|(parameter, shift)| (*parameter, decimal(*shift)));
        json!({
            "shot": shot.shot,
            "leverage": significant(shot.leverage, FEW),
            "cook_distance": significant(finite(shot.cook), FEW),
            "shift_without_it_in_std_errors": by_name(shifts),
        })
    };
    json!({
        "counted": tested,
        "chi2": significant(found.chi2, MANY),
        "dof": found.dof,
        "p_value": found.p_value.map(probability),
        "stated_noise": found.noise.name(),
        "noise_factor": found.noise_factor.map(|factor| significant(factor, FEW)),
        "trends": list(&found.trends, trend),
        "normality": found.normality.map(|n| json!({"anderson_darling": decimal(n.statistic), "p_value": probability(n.p_value)})),
        "influence": list(&found.influence, influence),
        "influential_from_cook_distance": found.influential_from.map(|from| significant(from, FEW)),
    })
}

/// JSON has no infinity: the largest number stands for it.
fn finite(value: f64) -> f64 {
    value.min(f64::MAX)
}

fn robust(found: &Robust) -> Value {
    let weight = |(shot, weight): &(String, f64)| json!({"shot": shot, "weight": significant(*weight, FEW)});
    json!({
        "loss": found.loss.name(),
        "tuning_constant": found.loss.tuning(),
        "covariance": "sandwich",
        "weights_below_1": list(&found.weights, weight),
    })
}

fn names(parameters: &[Parameter]) -> Vec<&'static str> {
    parameters.iter().map(|parameter| parameter.name()).collect()
}

fn identifiability(found: &Identifiability) -> Value {
    /// Derivatives of integrated collisions are known to their tolerance.
    const DIGITS: usize = 3;
    json!({
        "parameters": names(&found.parameters),
        "singular_values": found.singular_values.iter().map(|s| significant(*s, DIGITS)).collect::<Vec<_>>(),
        "condition_number": significant(found.condition, DIGITS),
        "worst": found.worst.as_ref().map(combination),
        "silent": names(&found.silent),
    })
}

fn combination(worst: &Combination) -> Value {
    let terms = worst.terms.iter().map(|(p, step)| (*p, significant(*step, FEW)));
    let determined = worst
        .determined
        .as_ref()
        .map(|(name, value, error)| json!({"name": name, "estimate": to_error(*value, Some(*error)), "std_error": relative(*error, FEW)}));
    json!({
        "words": worst.words,
        "one_standard_error_along": by_name(terms),
        "weak": worst.weak,
        "undetermined": worst.undetermined,
        "determined": determined,
    })
}
