//! What the data determine: the singular values of the Jacobian, and in words the combination of
//! parameters that they tell worst.

use crate::measurement::parameter::Parameter;
use crate::problem::{self, Id, Invariant};

/// What the data determine of the free parameters, at the minimum.
#[derive(Clone, Debug, PartialEq)]
pub struct Identifiability {
    /// The free parameters that some observation depends on.
    pub parameters: Vec<Parameter>,
    /// The singular values of the whitened Jacobian, the largest first. Its columns are scaled to length 1 (and made
    /// orthogonal to errors that the shots share), so that all are 1 where the parameters do not interfere.
    pub singular_values: Vec<f64>,
    /// Largest over smallest singular value.
    pub condition: f64,
    /// The direction of the smallest singular value. `None` with fewer than two parameters.
    pub worst: Option<Combination>,
    /// Free parameters that no observation depends on.
    pub silent: Vec<Parameter>,
}

/// A direction in which the residuals change least.
#[derive(Clone, Debug, PartialEq)]
pub struct Combination {
    /// How far each parameter goes for one standard error along it; undetermined: for a step of some
    /// length.
    pub terms: Vec<(Parameter, f64)>,
    /// Whether the condition number is beyond 30, so that the direction is hardly determined.
    pub weak: bool,
    /// Whether no residual changes along it at all.
    pub undetermined: bool,
    /// What the data do determine of it, where that has a name: name, value, standard error.
    pub determined: Option<(String, f64, f64)>,
    /// The direction in words.
    pub words: String,
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
            (name, remains.value, remains.std_error)
        });
        let (weak, undetermined) = (found.is_weak, found.is_undetermined);
        let words = words(&terms, weak, undetermined, determined.as_ref());
        Combination { terms, weak, undetermined, determined, words }
    });
    Some(Identifiability { parameters: parameters.to_vec(), singular_values, condition, worst, silent })
}

fn words(
    terms: &[(Parameter, f64)],
    weak: bool,
    undetermined: bool,
    determined: Option<&(String, f64, f64)>,
) -> String {
    let names: Vec<_> = terms.iter().map(|(parameter, _)| parameter.symbol()).collect();
    let names = names.join(" and ");
    let moves: Vec<_> = terms
        .iter()
        .map(|(parameter, step)| {
            let verb = if *step > 0.0 { "rises" } else { "falls" };
            format!("{} {verb} by {:.2e}", parameter.symbol(), step.abs())
        })
        .collect();
    let moves = moves.join(" and ");
    match (undetermined, weak, determined) {
        (true, _, Some((name, ..))) => format!("only {name} is determined by these shots"),
        (true, _, None) if terms.len() > 1 => format!(
            "only a combination of {names} is determined by these shots: nothing changes when {moves} in \
             proportion"
        ),
        (_, true, Some((name, value, error))) => format!(
            "these shots hardly tell {names} apart: {name} = {value:.4} ± {error:.1e} is known far better than \
             either"
        ),
        (_, true, None) if terms.len() > 1 => {
            format!("these shots hardly tell {names} apart: little changes when {moves}")
        }
        (_, _, _) if terms.len() > 1 => {
            format!("worst determined together: {names}; within one standard error {moves}")
        }
        _ => format!("worst determined: {names} alone; the others do not depend on it"),
    }
}
