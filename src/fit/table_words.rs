//! What was found of a table, in words.

use super::causes::{Cause, Explanation};
use crate::measurement::number::{count_of, plain};
use crate::problem::{Effect, Id, RowsFit};

/// Returns the compliance that was adopted, if it was.
pub(super) fn compliance(fit: &RowsFit) -> Option<Explanation> {
    let effect = fit.effects.iter().find(|effect| effect.adopted && effect.name == "compliance")?;
    let kappa = fit.solution.get(Id::Kappa);
    Some(Explanation {
        cause: Cause::Compliance,
        estimate: fit.solution.value(Id::Kappa),
        std_error: kappa.and_then(|kappa| kappa.std_error).unwrap_or(f64::NAN),
        delta_2logl: -effect.fall,
        adopted: true,
        sentence: effect_in_words(fit, effect),
    })
}

/// Returns what is said of the effects that were tried, each as a note.
pub(super) fn effects(fit: &RowsFit) -> Vec<String> {
    fit.effects.iter().map(|effect| effect_in_words(fit, effect)).collect()
}

fn effect_in_words(fit: &RowsFit, effect: &Effect) -> String {
    let Effect { name, shots, fall, adopted } = effect;
    let shots = count_of(*shots, "shot");
    let kappa = plain(fit.solution.value(Id::Kappa), 4);
    match (*name, adopted) {
        ("compliance", true) => format!(
            "The contact between the balls gives way along its surface (κ = {kappa}, as follows from Poisson's ratio), which shows in \
             {shots}: −2 log L is {fall:.1} lower than with a rigid contact, which kappa = {{ fixed = 0 }} under [fit] asks for."
        ),
        ("compliance", false) => format!(
            "A contact that gives way along its surface would show in {shots}, but they do not tell whether it does (−2 log L {}): \
             left out.",
            change(*fall)
        ),
        (_, true) => format!(
            "The balls' weight and what the cloth does during the impact are simulated in {shots} (--fidelity contact): −2 log L is \
             {fall:.1} lower with them."
        ),
        (_, false) => format!(
            "The balls' weight and what the cloth does during the impact act on {shots}, but these do not tell whether they do \
             (−2 log L {}): left out.",
            change(*fall)
        ),
    }
}

/// Returns a change of −2 log L in words.
fn change(fall: f64) -> String {
    if fall < 0.0 { format!("higher by {:.1} with it", -fall) } else { format!("lower by {fall:.1} with it") }
}
