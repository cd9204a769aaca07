//! What a comparison found, in words.

use super::number::{plain, with_error};
use crate::compare::{Compared, Comparison, Difference, Effect, Finding, Quantity, Reason};
use crate::fit::{Verdict, film_words};
use crate::measurement::parameter::Parameter;
use crate::problem::Severity;

/// Returns the findings of at least this severity, or only those that are less severe than doubts.
fn sentences(comparison: &Comparison, wanted: impl Fn(Severity) -> bool) -> Vec<String> {
    let findings = comparison.findings.iter().filter(|finding| wanted(finding.severity()));
    findings.map(|finding| sentence(comparison, finding)).collect()
}

/// Returns what a reader must know, the most important first.
pub fn warnings(comparison: &Comparison) -> Vec<String> {
    sentences(comparison, |severity| severity > Severity::Note)
}

/// Returns what else a reader may want to know.
pub fn notes(comparison: &Comparison) -> Vec<String> {
    sentences(comparison, |severity| severity == Severity::Note)
}

/// Returns how the data rule the model out, if they do.
pub(super) fn refuted(comparison: &Comparison) -> Option<String> {
    let is_refuted = |finding: &&Finding| matches!(finding, Finding::Refuted { .. });
    comparison.findings.iter().find(is_refuted).map(|finding| sentence(comparison, finding))
}

/// Returns why the search ended.
pub(super) fn termination(comparison: &Comparison) -> &'static str {
    if comparison.converged {
        "converged: no step promises a smaller χ²"
    } else {
        "no step lowered χ² though one was promised to, or there were too many steps"
    }
}

/// Returns whether the comparison can be used: what differs, the first reason for doubt, or why it cannot.
pub(super) fn verdict(comparison: &Comparison) -> Verdict {
    let unusable = sentences(comparison, |severity| severity == Severity::Unusable);
    let differences: Vec<String> =
        comparison.quantities.iter().filter_map(|q| outcome(comparison, q)).collect();
    let sentence = match (unusable.first(), warnings(comparison).first(), differences.is_empty()) {
        (Some(first), ..) | (None, Some(first), true) => first.clone(),
        (None, Some(first), false) => format!("{}. But: {first}", differences.join("; ")),
        (None, None, true) => {
            "There is nothing to compare: no quantity is determined by two of them.".to_owned()
        }
        (None, None, false) => format!("{}.", differences.join("; ")),
    };
    Verdict { grade: comparison.grade(), sentence }
}

/// Returns whether a quantity differs, if it is compared.
fn outcome(comparison: &Comparison, compared: &Compared) -> Option<String> {
    let symbol = compared.quantity.symbol();
    let real = compared.differences.iter().filter(|difference| difference.is_real()).count();
    match compared.differences.as_slice() {
        [] => None,
        [only] => {
            let [first, second] = [only.first, only.second].map(|label| comparison.labels[label].as_str());
            let size = with_error(only.value, only.std_error);
            Some(if only.is_real() {
                format!("{symbol} differs: {second} − {first} = {size}")
            } else {
                format!("no difference in {symbol} is seen ({second} − {first} = {size})")
            })
        }
        pairs if real == 0 => {
            Some(format!("no difference in {symbol} is seen in any of {} pairs", pairs.len()))
        }
        pairs => Some(format!("{symbol} differs in {real} of {} pairs", pairs.len())),
    }
}

fn sentence(comparison: &Comparison, finding: &Finding) -> String {
    let title = |sample: usize| comparison.samples[sample].title.as_str();
    match finding {
        Finding::Refuted { samples, reduced_chi2 } => {
            let named = samples
                .iter()
                .map(|(sample, reduced)| format!("{} (χ²/dof {})", title(*sample), plain(*reduced, 3)));
            let named: Vec<String> = named.collect();
            let whose = if named.is_empty() {
                format!("together (χ²/dof {})", plain(*reduced_chi2, 3))
            } else {
                format!("of {}", named.join(" and "))
            };
            format!(
                "The data {whose} refute the model. The estimates only mark the least χ²; they have no standard errors, and \
                 differences between them are not judged, since both hold only if the model does. Fit each data set alone: if \
                 each fits, they differ in what is shared here, and --per-dataset lets that differ; else something is wrong with the one that does not."
            )
        }
        Finding::NotConverged => {
            format!("The search for the best values did not converge: {}.", termination(comparison))
        }
        Finding::Undetermined => {
            "The data do not determine all of this together: there are no errors. Share more \
                                  parameters, or fix some under [fit]."
                .to_owned()
        }
        Finding::OfSample { sample, sentence, .. } => format!("{}: {sentence}", title(*sample)),
        Finding::NotShared { quantity, p_value } => {
            let (symbol, name) = (quantity.symbol(), quantity.name());
            format!(
                "{symbol} is shared, and the data contradict that it is the same for all (p = {}): other differences may \
                 be off. --per-dataset {name} lets it differ.",
                plain(*p_value, 2)
            )
        }
        Finding::AtBound { quantity, label, bound } => {
            let of = label.map_or(String::new(), |label| format!(" of {}", comparison.labels[label]));
            format!(
                "{}{of} ends on a bound, {bound}: its differences are those of the curvature there, which is cautious.",
                quantity.symbol()
            )
        }
        Finding::Compliance { fall } => format!(
            "The contact between the balls gives way along its surface: with it −2 log L is lower by {}. To state it, \
             set kappa under [fit] of each data set.",
            plain(*fall, 2)
        ),
        Finding::Scatter { sample, scatter } => {
            format!("{}: {}.", title(*sample), film_words::scatter(scatter))
        }
        Finding::MassRatios { quantity, std_error, part } => format!(
            "Of the error of a difference in {}, ± {}, {} is the mass ratio of the balls, one for each data set. If the \
             same balls were played, balls = \"LABEL\" in each dataset.toml says so; if not, weigh them to 0.1 g.",
            quantity.symbol(),
            plain(*std_error, 2),
            plain(*part, 2)
        ),
        Finding::OneCamera(unknowns) => {
            let all = unknowns.iter().map(|(id, value, error)| {
                format!("{} {}", id.name().replace('_', " "), with_error(*value, *error))
            });
            format!("One camera filmed all data sets: {}.", all.collect::<Vec<_>>().join(", "))
        }
    }
}

/// Returns why a label does not determine a quantity.
pub(super) fn reason(reason: Reason, quantity: Quantity) -> String {
    match (reason, quantity) {
        (Reason::NoShots, _) => "it has no shot that can be used".to_owned(),
        (Reason::Absent, _) => format!("its data set has no {}", quantity.symbol()),
        (Reason::Sticks, _) => {
            "its contacts stick at the best fit: the data show only that it is large".to_owned()
        }
        (Reason::Vanishes, _) => "nothing depends on it at the best fit".to_owned(),
        (Reason::Uncertain, _) => {
            "its observations hardly depend on it at the best fit: its error is larger than its \
                                   bounds are apart"
                .to_owned()
        }
        (Reason::Independent, Quantity::Sliding) => {
            "it has no paths after the impacts, which only footage shows".to_owned()
        }
        (Reason::Independent, Quantity::Parameter(Parameter::MuS)) => {
            "none of its shots has topspin, so the cloth never carries the object ball".to_owned()
        }
        (Reason::Independent, _) => {
            format!("none of its observations depends on the {}", quantity.meaning())
        }
    }
}

/// Returns what the second label of a difference does otherwise, as a player understands it.
pub(super) fn effect(comparison: &Comparison, difference: &Difference) -> Option<String> {
    let name = comparison.labels.get(difference.second)?;
    let more = |difference: f64, more: &'static str, less: &'static str| {
        if difference > 0.0 { more } else { less }
    };
    Some(match difference.effect? {
        Effect::Throw(angle) => format!(
            "with {name} the object ball is thrown {:.2}° {} on a half-ball stun shot at 2 m/s: {:.0} mm per metre",
            angle.abs().to_degrees(),
            more(angle, "more", "less"),
            1e3 * angle.abs().tan()
        ),
        Effect::FullRoll { object, cue } => format!(
            "with {name}, on a full natural-roll hit at 2 m/s, the object ball leaves {:.1} mm/s {} and the cue ball \
             {:.1} mm/s {}",
            1e3 * object.abs(),
            more(object, "faster", "slower"),
            1e3 * cue.abs(),
            more(cue, "faster", "slower")
        ),
        Effect::FullStun(cue) => format!(
            "with {name} the cue ball keeps {:.1} mm/s {} on a full stun hit at 2 m/s, and the object ball leaves as much {}",
            1e3 * cue.abs(),
            more(cue, "more", "less"),
            more(cue, "slower", "faster")
        ),
        Effect::Slide { further, way } => format!(
            "with {name} a ball shot without spin at 2 m/s slides {:.0} mm {} before it rolls ({way:.2} m)",
            1e3 * further.abs(),
            more(further, "further", "less far")
        ),
    })
}
