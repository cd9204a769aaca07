//! Identifiability: the singular values of the Jacobian, and in words the combination of
//! parameters that the data determine worst.

use schemars::JsonSchema;
use serde::Serialize;

use crate::measurement::parameter::Parameter;
use crate::measurement::written;
use crate::problem::{self, Id, Invariant};

/// Which combinations of parameters the data determine, at the minimum.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Identifiability {
    /// Names of the free parameters that some observation depends on.
    pub parameters: Vec<Parameter>,
    /// Singular values of the whitened Jacobian, the largest first. Its columns are scaled to length 1 (and made orthogonal to errors
    /// that the shots share), so that all are 1 if the parameters do not interfere.
    pub singular_values: Vec<f64>,
    /// Largest over smallest singular value: large if parameters can hardly be distinguished; null if it is infinite.
    #[serde(rename = "condition_number")]
    #[schemars(with = "Option<f64>")]
    pub condition: f64,
    /// The combination of parameters that is determined worst; null if at most one parameter is free.
    pub worst: Option<Combination>,
    /// Names of free parameters that change no prediction.
    pub silent: Vec<Parameter>,
}

/// A combination of parameters that is determined badly: the direction in which the residuals change least.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Combination {
    /// The combination as a sentence.
    pub words: String,
    /// How each parameter moves along the combination by one standard error, in its unit; undetermined: by a step of some length.
    #[serde(rename = "one_standard_error_along", serialize_with = "written::by_parameter")]
    #[schemars(with = "std::collections::BTreeMap<String, Option<f64>>")]
    pub terms: Vec<(Parameter, f64)>,
    /// Whether it is determined, but badly: the condition number is beyond 30.
    pub weak: bool,
    /// Whether the data do not determine it.
    pub undetermined: bool,
    /// The combination that is determined instead; null if there is none.
    pub determined: Option<Determined>,
}

/// A combination of parameters that is determined.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Determined {
    /// The combination, as in the product μ·μ_s.
    pub name: String,
    /// Its value.
    pub estimate: f64,
    /// Its standard error.
    #[schemars(with = "Option<f64>")]
    pub std_error: f64,
}

/// Returns what the data determine of some parameters, from their worst determined direction, which there
/// is of two and more; `silent` are those that no number depends on.
pub(in crate::fit) fn identify(
    parameters: &[Parameter],
    found: Option<&problem::Combination>,
    silent: Vec<Parameter>,
) -> Option<Identifiability> {
    let own = || found.map(|found| found.singular_values.clone());
    let singular_values = if parameters.len() == 1 { vec![1.0] } else { own()? };
    let (largest, smallest) = (singular_values.first()?, singular_values.last()?);
    let condition = largest / smallest;
    let worst = found.map(|found| {
        let parameter = |id: Id| Parameter::ALL.into_iter().find(|p| Id::from(*p) == id);
        let terms: Vec<(Parameter, f64)> =
            found.terms.iter().filter_map(|(id, step)| Some((parameter(*id)?, *step))).collect();
        let determined = found.remains.map(|remains| {
            let [first, second] = [0, 1].map(|i| terms.get(i).map_or("", |(p, _)| p.symbol()));
            let name = match remains.invariant {
                Invariant::Product => format!("the product {first}·{second}"),
                Invariant::Ratio => format!("the ratio {first}/{second}"),
            };
            Determined { name, estimate: remains.value, std_error: remains.std_error }
        });
        let (weak, undetermined) = (found.is_weak, found.is_undetermined);
        let combination = Combination { words: String::new(), terms, weak, undetermined, determined };
        Combination { words: combination.in_words(), ..combination }
    });
    Some(Identifiability { parameters: parameters.to_vec(), singular_values, condition, worst, silent })
}

impl Combination {
    fn in_words(&self) -> String {
        let names: Vec<&str> = self.terms.iter().map(|(parameter, _)| parameter.symbol()).collect();
        let names = names.join(" and ");
        let moves = self.terms.iter().map(|(parameter, step)| {
            let verb = if *step > 0.0 { "rises" } else { "falls" };
            format!("{} {verb} by {:.2e}", parameter.symbol(), step.abs())
        });
        let moves = moves.collect::<Vec<_>>().join(" and ");
        let is_alone = self.terms.len() < 2;
        match &self.determined {
            Some(Determined { name, .. }) if self.undetermined => {
                format!("only {name} is determined by these shots")
            }
            Some(Determined { name, estimate, std_error }) if self.weak => format!(
                "these shots hardly tell {names} apart: {name} = {estimate:.4} ± {std_error:.1e} is known far better than \
                 either"
            ),
            _ if is_alone => format!("worst determined: {names} alone; the others do not depend on it"),
            _ if self.undetermined => format!(
                "only a combination of {names} is determined by these shots: nothing changes when {moves} in \
                 proportion"
            ),
            _ if self.weak => {
                format!("these shots hardly tell {names} apart: little changes when {moves}")
            }
            _ => format!("worst determined together: {names}; within one standard error {moves}"),
        }
    }
}
