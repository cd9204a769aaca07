//! How far a fit can be trusted, for fit.json.

use serde_json::{Map, Value, json};

use crate::fit::{
    Alternative, Bootstrap, Bound, Combination, Computed, Contour, Fit, FoundMinimum, Goodness,
    Identifiability, Influence, JointFit, Level, Robust, Starts, Trend,
};
use crate::parameters::Parameter;

/// The keys of fit.json that say it.
pub(super) fn entries(fit: &Fit) -> Map<String, Value> {
    let found = &fit.diagnostics;
    let mut entries = Map::new();
    let mut add = |key: &str, value: Value| entries.insert(key.to_owned(), value);
    add("computed", found.computed.iter().map(computed).collect());
    add("identifiability", found.identifiability.as_ref().map_or(Value::Null, identifiability));
    add("goodness", found.goodness.as_ref().map_or(Value::Null, goodness));
    add("robust", found.robust.as_ref().map_or(Value::Null, robust));
    add("constraints", found.relations.iter().map(constraint).collect());
    add("starts", found.starts.as_ref().map_or(Value::Null, starts));
    add("bootstrap", found.bootstrap.as_ref().map_or(Value::Null, bootstrap));
    add("contours", found.contours.iter().map(contour).collect());
    add("model_comparison", found.alternatives.iter().map(alternative).collect());
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
    let errors: Map<String, Value> =
        found.std_errors.iter().map(|(p, error)| (p.name().to_owned(), json!(error))).collect();
    json!({"std_errors": errors, "shots": found.shots})
}

fn joint(found: &JointFit) -> Value {
    let friction = |(value, error): (f64, f64)| json!({"value": value, "std_error": error});
    json!({
        "mu_k": friction(found.sliding),
        "mu_r": friction(found.rolling),
        "observations": found.observations,
        "shot_unknowns": found.unknowns,
    })
}

fn bootstrap(found: &Bootstrap) -> Value {
    let parameters: Map<String, Value> = (found.estimates.iter())
        .map(|one| {
            let entry = json!({
                "std_error": one.std_error,
                "bias": one.bias,
                "interval_95_percentile": one.percentile,
                "interval_95_bca": one.bca,
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

fn contour(contour: &Contour) -> Value {
    let level = |level: &Level| {
        json!({
            "probability": level.probability,
            "chi2_rise": level.rise,
            "edge": level.edge,
        })
    };
    json!({
        "parameters": names(&contour.parameters),
        "centre": contour.centre,
        "levels": contour.levels.iter().map(level).collect::<Vec<_>>(),
    })
}

fn alternative(model: &Alternative) -> Value {
    let values: Map<String, Value> =
        model.values.iter().map(|(parameter, value)| (parameter.name().to_owned(), json!(value))).collect();
    let ratio = model.likelihood_ratio.map(|r| json!({"statistic": r.statistic, "p_value": r.p_value}));
    json!({
        "model": model.name,
        "failed": model.failed,
        "values": values,
        "fitted_parameters": model.parameters,
        "delta_aic": model.delta_aic,
        "delta_bic": model.delta_bic,
        "likelihood_ratio": ratio,
    })
}

fn goodness(found: &Goodness) -> Value {
    let trend = |trend: &Trend| {
        json!({
            "residuals_of": trend.quantity,
            "against": trend.variable.name(),
            "slope_sd": trend.slope,
            "slope_per": trend.variable.unit(),
            "p_value": trend.p_value,
            "p_corrected": trend.p_corrected,
            "significant": trend.significant,
            "words": trend.words,
        })
    };
    let influence = |shot: &Influence| {
        let shifts: Map<String, Value> = shot
            .shifts
            .iter()
            .map(|(parameter, shift)| (parameter.name().to_owned(), json!(shift)))
            .collect();
        json!({
            "shot": shot.shot,
            "leverage": shot.leverage,
            "cook_distance": finite(shot.cook),
            "shift_without_it_in_std_errors": shifts,
        })
    };
    json!({
        "p_value": found.p_value,
        "stated_noise": found.noise.name(),
        "noise_factor": found.noise_factor,
        "trends": found.trends.iter().map(trend).collect::<Vec<_>>(),
        "normality": found.normality.map(|n| json!({"anderson_darling": n.statistic, "p_value": n.p_value})),
        "influence": found.influence.iter().map(influence).collect::<Vec<_>>(),
        "influential_from_cook_distance": found.influential_from,
    })
}

/// JSON has no infinity: the largest number stands for it.
fn finite(value: f64) -> f64 {
    value.min(f64::MAX)
}

fn robust(found: &Robust) -> Value {
    let weight = |(shot, weight): &(String, f64)| json!({"shot": shot, "weight": weight});
    json!({
        "loss": found.loss.name(),
        "tuning_constant": found.loss.tuning(),
        "covariance": "sandwich",
        "weights_below_1": found.weights.iter().map(weight).collect::<Vec<_>>(),
    })
}

fn starts(found: &Starts) -> Value {
    let minimum = |minimum: &FoundMinimum| {
        let values: Map<String, Value> = minimum
            .values
            .iter()
            .map(|(parameter, value)| (parameter.name().to_owned(), json!(value)))
            .collect();
        json!({
            "values": values,
            "minus_2_log_likelihood_above_best": minimum.above_best,
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
        "singular_values": found.singular_values,
        "condition_number": found.condition,
        "worst": found.worst.as_ref().map(combination),
        "silent": names(&found.silent),
    })
}

fn combination(worst: &Combination) -> Value {
    let terms: Map<String, Value> =
        worst.terms.iter().map(|(parameter, step)| (parameter.name().to_owned(), json!(step))).collect();
    let determined = worst
        .determined
        .as_ref()
        .map(|(name, value, error)| json!({"name": name, "estimate": value, "std_error": error}));
    json!({
        "words": worst.words,
        "one_standard_error_along": terms,
        "weak": worst.weak,
        "undetermined": worst.undetermined,
        "determined": determined,
    })
}
