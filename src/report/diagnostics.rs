//! How far a fit can be trusted, for fit.json.

use serde_json::{Map, Value, json};

use super::digits::{FEW, MANY, decimal, edge, end, probability, relative, significant, to_error};

use crate::fit::{
    Alternative, Bootstrap, Bound, Combination, Computed, Contour, Fit, FoundMinimum, Goodness,
    Identifiability, Influence, JointFit, Level, Profile, Robust, SharedEstimate, SharedKind, Starts, Trend,
};
use crate::measurement::parameter::Parameter;

/// The standard error of each parameter that has one: what its values elsewhere are rounded by.
type Errors<'a> = &'a dyn Fn(Parameter) -> Option<f64>;

/// The keys of fit.json that say it.
pub(super) fn entries(fit: &Fit) -> Map<String, Value> {
    let found = &fit.diagnostics;
    let error = |parameter: Parameter| {
        fit.estimates.iter().find(|e| e.parameter == parameter).and_then(|e| e.std_error)
    };
    let tested = fit.tested().name();
    let mut entries = Map::new();
    let mut add = |key: &str, value: Value| entries.insert(key.to_owned(), value);
    add("computed", found.computed.iter().map(computed).collect());
    add("identifiability", found.identifiability.as_ref().map_or(Value::Null, identifiability));
    add("goodness", found.goodness.as_ref().map_or(Value::Null, |found| goodness(found, tested)));
    add("robust", found.robust.as_ref().map_or(Value::Null, robust));
    add("constraints", found.relations.iter().map(constraint).collect());
    add("starts", found.starts.as_ref().map_or(Value::Null, |found| starts(found, &error)));
    add("bootstrap", found.bootstrap.as_ref().map_or(Value::Null, |found| bootstrap(found, &error)));
    add("contours", found.contours.iter().map(|found| contour(found, &error)).collect());
    add("profiles", found.profiles.iter().map(|found| profile(found, &error)).collect());
    add(
        "model_comparison",
        found
            .alternatives
            .iter()
            .map(|found| alternative(found, fit.refuted.is_none().then_some(&error)))
            .collect(),
    );
    add("information_bound", found.bound.as_ref().map_or(Value::Null, bound));
    add("joint", found.joint.as_ref().map_or(Value::Null, joint));
    entries
}

pub(super) fn computed(found: &Computed) -> Value {
    let on: Vec<_> = found.effects.list().into_iter().filter_map(|(name, on)| on.then_some(name)).collect();
    json!({"fidelity": found.fidelity.name(), "effects": on, "shots": found.shots})
}

pub(super) fn constraint((text, active): &(String, bool)) -> Value {
    json!({"text": text, "holds_with_equality": active})
}

fn bound(found: &Bound) -> Value {
    let errors: Map<String, Value> = found
        .std_errors
        .iter()
        .map(|(p, error)| (p.name().to_owned(), json!(relative(*error, FEW))))
        .collect();
    json!({"std_errors": errors, "shots": found.shots})
}

fn joint(found: &JointFit) -> Value {
    let mut all = Map::new();
    // those of the camera are told in `camera`
    for SharedEstimate { kind, value, std_error, interval_95 } in &found.shared {
        if !matches!(kind, SharedKind::Camera(_)) {
            let error = Some(*std_error);
            let interval = interval_95.map(|ends| ends.map(|value| end(value, error)));
            let entry = json!({"value": to_error(*value, error), "std_error": relative(*std_error, FEW), "interval_95": interval});
            all.insert(kind.name().to_owned(), entry);
        }
    }
    all.insert("p_value".to_owned(), json!(found.p_value.map(probability)));
    all.insert("observations".to_owned(), json!(found.observations));
    all.insert("shot_unknowns".to_owned(), json!(found.unknowns));
    Value::Object(all)
}

fn bootstrap(found: &Bootstrap, error: Errors) -> Value {
    let parameters: Map<String, Value> = (found.estimates.iter())
        .map(|one| {
            let error = error(one.parameter).or(Some(one.std_error));
            let rounded = |value: f64| to_error(value, error);
            let entry = json!({
                "std_error": relative(one.std_error, FEW),
                "bias": rounded(one.bias),
                "interval_95_percentile": one.percentile.map(rounded),
                "interval_95_bca": one.bca.map(rounded),
            });
            (one.parameter.name().to_owned(), entry)
        })
        .collect();
    json!({
        "replicates": found.replicates,
        "seed": found.seed,
        "failed": found.failed,
        "parameters": parameters,
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
        "levels": contour.levels.iter().map(level).collect::<Vec<_>>(),
    })
}

/// Without values where the data refute the model: they need not be determined, and differ with the last digits of the data.
fn alternative(model: &Alternative, error: Option<Errors>) -> Value {
    let values: Map<String, Value> = model
        .values
        .iter()
        .filter_map(|(p, value)| Some((p.name().to_owned(), json!(to_error(*value, error?(*p))))))
        .collect();
    let ratio = model.likelihood_ratio;
    let ratio = ratio.map(|r| json!({"statistic": decimal(r.statistic), "p_value": probability(r.p_value)}));
    json!({
        "model": model.name,
        "failed": model.failed,
        "values": values,
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
        let shifts: Map<String, Value> = shot
            .shifts
            .iter()
            .map(|(parameter, shift)| (parameter.name().to_owned(), json!(decimal(*shift))))
            .collect();
        json!({
            "shot": shot.shot,
            "leverage": significant(shot.leverage, FEW),
            "cook_distance": significant(finite(shot.cook), FEW),
            "shift_without_it_in_std_errors": shifts,
        })
    };
    json!({
        "counted": tested,
        "chi2": significant(found.chi2, MANY),
        "dof": found.dof,
        "p_value": found.p_value.map(probability),
        "stated_noise": found.noise.name(),
        "noise_factor": found.noise_factor.map(|factor| significant(factor, FEW)),
        "trends": found.trends.iter().map(trend).collect::<Vec<_>>(),
        "normality": found.normality.map(|n| json!({"anderson_darling": decimal(n.statistic), "p_value": probability(n.p_value)})),
        "influence": found.influence.iter().map(influence).collect::<Vec<_>>(),
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
        "weights_below_1": found.weights.iter().map(weight).collect::<Vec<_>>(),
    })
}

fn starts(found: &Starts, error: Errors) -> Value {
    let minimum = |minimum: &FoundMinimum| {
        let values: Map<String, Value> = minimum
            .values
            .iter()
            .map(|(p, value)| (p.name().to_owned(), json!(to_error(*value, error(*p)))))
            .collect();
        json!({
            "values": values,
            "minus_2_log_likelihood_above_best": decimal(minimum.above_best),
            "starts": minimum.starts,
        })
    };
    json!({
        "count": found.count,
        "seed": found.seed,
        "agree": found.agree(),
        "failed": found.failed,
        "minima": found.minima.iter().map(minimum).collect::<Vec<_>>(),
    })
}

fn names(parameters: &[Parameter]) -> Vec<&'static str> {
    parameters.iter().map(|parameter| parameter.name()).collect()
}

fn identifiability(found: &Identifiability) -> Value {
    json!({
        "parameters": names(&found.parameters),
        "singular_values": found.singular_values.iter().map(|s| significant(*s, FEW)).collect::<Vec<_>>(),
        "condition_number": significant(found.condition, FEW),
        "worst": found.worst.as_ref().map(combination),
        "silent": names(&found.silent),
    })
}

fn combination(worst: &Combination) -> Value {
    let terms: Map<String, Value> =
        worst.terms.iter().map(|(p, step)| (p.name().to_owned(), json!(significant(*step, FEW)))).collect();
    let determined = worst
        .determined
        .as_ref()
        .map(|(name, value, error)| json!({"name": name, "estimate": to_error(*value, Some(*error)), "std_error": relative(*error, FEW)}));
    json!({
        "words": worst.words,
        "one_standard_error_along": terms,
        "weak": worst.weak,
        "undetermined": worst.undetermined,
        "determined": determined,
    })
}
