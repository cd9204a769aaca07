//! A [`Comparison`] → files, report, and what it found in words.

use std::path::Path;

use minijinja::value::Serde;
use minijinja::{Value as Values, context};

use super::document::{self, CompareDocument, ComparedParameter};
use super::plot::{forest, of_comparison};
use super::shots::shot_list;
use super::templates::{self, COMPARE};
use super::write::Staged;
use super::{ReportError, chi2_of, csv};
use crate::compare::{Compared, Comparison, Finding, Quantity, Reason, Value};
use crate::fit::{Counted, Verdict, film_words};
use crate::measurement::number::{plain, with_error};
use crate::measurement::parameter::Parameter;
use crate::problem::Severity;

/// Writes the files of a comparison.
pub(crate) fn write(comparison: &Comparison, out: &Path) -> Result<(), ReportError> {
    Staged::new(out)?
        .figure("forest", &forest(comparison))?
        .figure("residuals", &of_comparison(comparison))?
        .add("residuals.csv", csv::of_comparison(comparison))?
        .add("report.html", page(comparison)?)?
        .add("compare.json", document::text(&CompareDocument::new(comparison))?)?
        .put()
}

/// Returns the text that `caromfit compare` prints.
pub fn table(comparison: &Comparison) -> String {
    templates::text(COMPARE, content(comparison))
}

fn page(comparison: &Comparison) -> Result<String, ReportError> {
    let shots = comparison.residuals.iter().map(|one| (comparison.shot_name(one), &one.of_shot));
    let figures = context! {
        forest => Serde(forest(comparison)),
        residuals => Serde(of_comparison(comparison)),
    };
    let shots_of_page = Serde(shot_list(shots));
    templates::page(COMPARE, context! { figures, shots_of_page, ..content(comparison) })
}

fn content(comparison: &Comparison) -> Values {
    let document = CompareDocument::new(comparison);
    let chi2 = chi2_of(document.counted, document.chi2, document.dof, document.noise_estimated);
    let row = |label: &String| {
        let own = document.samples.iter().filter(|sample| sample.label == *label);
        let shots: usize = own.map(|sample| sample.shots_used).sum();
        let cells = document.parameters.iter().map(|one| cell(one, label, comparison.is_refuted()));
        [label.clone(), shots.to_string()].into_iter().chain(cells).collect::<Vec<_>>()
    };
    let estimates: Vec<_> = document.labels.iter().map(row).collect();
    context! { chi2, estimates, ..Serde(&document) }
}

fn cell(parameter: &ComparedParameter, label: &String, is_refuted: bool) -> String {
    let is_left_out = parameter.left_out.iter().any(|out| out.label == *label);
    let is_own = |one: &&Value| one.label.as_ref().is_none_or(|own| own == label);
    let Some(own) = parameter.estimates.iter().find(is_own).filter(|_| !is_left_out) else {
        return "–".to_owned();
    };
    let number = match own.std_error {
        _ if !own.fitted => return format!("{} (fixed)", plain(own.estimate, 4)),
        Some(error) => with_error(own.estimate, error),
        None => plain(own.estimate, 4) + if is_refuted { " (refuted)" } else { "" },
    };
    if parameter.shared { format!("{number} (shared)") } else { number }
}

pub(super) fn counted(comparison: &Comparison) -> Counted {
    if comparison.is_filmed {
        return Counted::Coordinates;
    }
    Counted::of(comparison.residuals.iter().map(|residual| &residual.of_shot.observable))
}

/// Returns the sentences of findings of some severities.
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

pub(super) fn termination(comparison: &Comparison) -> &'static str {
    if comparison.converged {
        "converged: no step promises a smaller χ²"
    } else {
        "no step lowered χ² though one was promised to, or there were too many steps"
    }
}

/// Returns whether the comparison can be used: what differs, the first reason for doubt, or why it
/// cannot.
pub(super) fn verdict(comparison: &Comparison) -> Verdict {
    let unusable = sentences(comparison, |severity| severity == Severity::Unusable).into_iter().next();
    let outcomes = comparison.quantities.iter().filter_map(outcome);
    let outcomes = outcomes.collect::<Vec<_>>().join("; ");
    let doubt = unusable.clone().or_else(|| warnings(comparison).into_iter().next());
    let sentence = match doubt {
        Some(first) if outcomes.is_empty() || unusable.is_some() => first,
        Some(first) => format!("{outcomes}. But: {first}"),
        None if outcomes.is_empty() => {
            "A comparison is impossible: no quantity is determined by two of them.".to_owned()
        }
        None => format!("{outcomes}."),
    };
    Verdict { grade: comparison.grade(), sentence }
}

/// Returns whether a quantity differs, if it is compared.
fn outcome(compared: &Compared) -> Option<String> {
    let symbol = compared.quantity.symbol();
    let [only] = compared.differences.as_slice() else {
        let real = compared.differences.iter().filter(|difference| difference.real).count();
        let pairs = compared.differences.len();
        return (pairs > 0).then(|| format!("{symbol} differs in {real} of {pairs} pairs"));
    };
    let by = with_error(only.value, only.std_error);
    let difference = format!("{} − {} = {by}", only.second, only.first);
    Some(if only.real {
        format!("{symbol} differs: {difference}")
    } else {
        format!("no difference in {symbol} is seen ({difference})")
    })
}

fn sentence(comparison: &Comparison, finding: &Finding) -> String {
    let title = |sample: usize| comparison.samples[sample].title.as_str();
    match finding {
        Finding::Refuted { samples, reduced_chi2 } => {
            let named = samples.iter();
            let named = named.map(|(i, reduced)| format!("{} (χ²/dof {})", title(*i), plain(*reduced, 3)));
            let named: Vec<String> = named.collect();
            let whose = if named.is_empty() {
                format!("together (χ²/dof {})", plain(*reduced_chi2, 3))
            } else {
                format!("of {}", named.join(" and "))
            };
            format!(
                "The data {whose} refute the model. The estimates only mark the least χ²; they have no standard errors, and \
                 differences between them are not judged, since both hold only if the model does. Fit each data set alone: if each \
                 fits, they differ in what is shared here, and --per-dataset lets that differ; else something is wrong with the one \
                 that does not."
            )
        }
        Finding::NotConverged => {
            format!("The search for the best values did not converge: {}.", termination(comparison))
        }
        Finding::Undetermined => {
            "The data do not determine all of this together: there are no errors. Share more parameters, or \
                                  fix some under [fit]."
                .to_owned()
        }
        Finding::OfSample { sample, sentence, .. } => format!("{}: {sentence}", title(*sample)),
        Finding::NotShared { quantity, p_value } => {
            let (symbol, name, p) = (quantity.symbol(), quantity.name(), plain(*p_value, 2));
            format!(
                "{symbol} is shared, and the data contradict that it is the same for all (p = {p}): other differences may be off. \
                 --per-dataset {name} lets it differ."
            )
        }
        Finding::AtBound { quantity, label, bound } => {
            let of = label.as_ref().map_or(String::new(), |label| format!(" of {label}"));
            let symbol = quantity.symbol();
            format!(
                "{symbol}{of} ends on a bound, {bound}: its differences are those of the curvature there, which is cautious."
            )
        }
        Finding::Compliance { fall } => format!(
            "The contact between the balls is compliant along its surface: with it −2 log L is lower by {}. To state it, set kappa \
             under [fit] of each data set.",
            plain(*fall, 2)
        ),
        Finding::Scatter { sample, scatter } => {
            format!("{}: {}.", title(*sample), film_words::scatter(scatter))
        }
        Finding::MassRatios { quantity, std_error, part } => {
            let [error, part] = [std_error, part].map(|value| plain(*value, 2));
            format!(
                "Of the error of a difference in {}, ± {error}, {part} is the mass ratio of the balls, one for each data set. If the \
                 same balls were played, balls = \"LABEL\" in each dataset.toml says so; if not, weigh them to 0.1 g.",
                quantity.symbol()
            )
        }
    }
}

/// Returns why a label does not determine a quantity.
pub(super) fn reason(reason: Reason, quantity: Quantity) -> String {
    let words = match (reason, quantity) {
        (Reason::NoShots, _) => "it has no shot that can be used",
        (Reason::Absent, _) => return format!("its data set has no {}", quantity.symbol()),
        (Reason::Sticks, _) => "its contacts stick at the best fit: the data show only that it is large",
        (Reason::Uncertain, _) => {
            "its observations depend on it weakly at the best fit: its error is larger than its bounds are apart"
        }
        (Reason::Independent, Quantity::Sliding) => {
            "it has no paths after the impacts, which only footage shows"
        }
        (Reason::Independent, Quantity::Parameter(Parameter::MuS)) => {
            "its shots have no topspin, so the cloth never carries the object ball"
        }
        (Reason::Independent, _) => {
            return format!("its observations do not depend on the {}", quantity.meaning());
        }
    };
    words.to_owned()
}
