//! How far a fit can be trusted, for fit.json.

use serde_json::{Map, Value, json};

use crate::fit::{Combination, Fit, Identifiability};
use crate::parameters::Parameter;

/// The keys of fit.json that say it.
pub(super) fn entries(fit: &Fit) -> Map<String, Value> {
    let found = &fit.diagnostics;
    let mut entries = Map::new();
    let mut add = |key: &str, value: Value| entries.insert(key.to_owned(), value);
    add("identifiability", found.identifiability.as_ref().map_or(Value::Null, identifiability));
    entries
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
