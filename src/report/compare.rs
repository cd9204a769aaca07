//! A [`Comparison`] → table, compare.json and pictures.

use super::compare_words as words;
use super::content::{Block, Report, Section, Table, facts};
use super::number::{count_of, interval, plain, with_error};
use super::plot::compare::forest;
use super::plot::of_comparison as residuals;
use super::shots::shot_list;
use super::trust::{computed, down_weighted};
use super::{LEAST_P, ReportError, csv, document, html, p_text, text};
use crate::compare::{Compared, Comparison, Difference, Value};
use crate::fit::{Counted, Rejected};

/// What was compared.
fn method(comparison: &Comparison) -> &'static str {
    if comparison.is_filmed {
        "all frames of all data sets at once; residuals are those of the velocities after the impacts"
    } else {
        "the measured numbers of all data sets at once"
    }
}

/// Returns the files of a comparison: name and content.
///
/// # Errors
/// A figure or document that cannot be made.
pub fn files(comparison: &Comparison) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    let texts = [
        ("residuals.csv", csv::of_comparison(comparison)),
        ("report.html", html::render(&content(comparison))?),
        ("compare.json", document::text(comparison)?),
    ];
    let texts = texts.map(|(name, text)| (name.to_owned(), text.into_bytes()));
    let pictures = [forest(comparison).files("forest")?, residuals(comparison).files("residuals")?];
    Ok(pictures.into_iter().flatten().chain(texts).collect())
}

/// Returns the text that `caromfit compare` prints.
#[must_use]
pub fn table(comparison: &Comparison) -> String {
    text::walk(&content(comparison))
}

/// Returns what is said of a comparison.
fn content(comparison: &Comparison) -> Report {
    let forest = Block::figure("Estimates with their intervals", forest(comparison));
    let legend = "±: one standard error; (shared): one value for all; –: not determined";
    let estimates = Section::new("Estimates", legend, [estimates(comparison).into(), forest]);
    let quantities = comparison.quantities.iter().map(|q| {
        let title = format!("{}, {}", q.quantity.symbol(), q.quantity.meaning());
        Section::new(title, "", [Block::Lines(lines(comparison, q))])
    });
    let weights = comparison.robust.as_ref().and_then(|robust| {
        let named = |(sample, shot, weight): &(usize, String, f64)| {
            (format!("{}, shot {shot}", comparison.samples[*sample].title), *weight)
        };
        down_weighted(&robust.losses.join(" and "), robust.weights.iter().map(named))
    });
    let rejected = comparison.samples.iter().flat_map(|sample| {
        let row = |r: &Rejected| [format!("{}, {}", sample.title, r.shot), r.reason.clone()];
        sample.shots_rejected.iter().map(row)
    });
    let shots = comparison.residuals.iter().map(|one| (comparison.shot_name(one), &one.of_shot));
    let others = [
        Section::new("Residuals", "", [Block::figure("Residuals of all, by colour", residuals(comparison))]),
        computed(&comparison.computed),
        weights,
        Section::of_rejected(rejected),
        Section::new("Notes", "", [Block::Lines(notes(comparison))]),
        Section::new("Shots, the largest residuals first", "", [Block::Shots(shot_list(shots))]),
    ];
    let shots: usize = comparison.samples.iter().map(|sample| sample.shots_used).sum();
    Report {
        title: format!("Comparison by {}", comparison.told_by),
        verdict: words::verdict(comparison),
        warnings: words::warnings(comparison),
        facts: facts([
            ("model", comparison.fidelity.to_owned()),
            ("method", method(comparison).to_owned()),
            ("shots", shots.to_string()),
            ("χ²", chi2(comparison)),
        ]),
        sections: [estimates].into_iter().chain(quantities).chain(others).flatten().collect(),
    }
}

/// What the sum of squares counts.
pub(super) fn counted(comparison: &Comparison) -> Counted {
    if comparison.is_filmed {
        return Counted::Coordinates;
    }
    Counted::of(comparison.residuals.iter().map(|residual| &residual.of_shot.observable))
}

fn chi2(comparison: &Comparison) -> String {
    let noise = if comparison.noise_estimated { "; noise estimated from the residuals" } else { "" };
    format!(
        "{} of {} for {} degrees of freedom, χ²/dof = {}{noise}",
        plain(comparison.chi2, 4),
        counted(comparison).words(),
        comparison.dof,
        plain(comparison.chi2 / comparison.dof.max(1) as f64, 3)
    )
}

/// A row for each label.
fn estimates(comparison: &Comparison) -> Table {
    let symbols = comparison.quantities.iter().map(|q| q.quantity.symbol());
    let head = [comparison.told_by.as_str(), "shots"].into_iter().chain(symbols);
    let row = |(label, name): (usize, &String)| {
        let shots: usize = comparison.samples.iter().filter(|s| s.label == label).map(|s| s.shots_used).sum();
        let cells = comparison.quantities.iter().map(|q| cell(comparison, q, label));
        [name.clone(), shots.to_string()].into_iter().chain(cells).collect()
    };
    Table::new(head, comparison.labels.iter().enumerate().map(row))
}

/// What a reader may want to know.
fn notes(comparison: &Comparison) -> Vec<String> {
    let mut notes = words::notes(comparison);
    if comparison.robust.is_some() {
        notes.push(
            "Outlying shots count less. χ² is weighted and tests nothing; errors, p-values and Wald statistics are from the \
             scatter of the shots (sandwich), whatever their noise; ΔAIC is by the Wald statistic."
                .to_owned(),
        );
    }
    notes
}

/// An estimate of a label.
fn cell(comparison: &Comparison, compared: &Compared, label: usize) -> String {
    if compared.left_out.iter().any(|(out, _)| *out == label) {
        return "–".to_owned();
    }
    let own = |value: &&Value| value.label.is_none_or(|own| own == label);
    compared.estimates.iter().find(own).map_or("–".to_owned(), |value| {
        let number = match value.std_error {
            Some(error) if value.fitted => with_error(value.value, error),
            _ if value.fitted && comparison.is_refuted() => {
                format!("{} (refuted)", plain(value.value, 4))
            }
            _ if value.fitted => plain(value.value, 4),
            _ => format!("{} (fixed)", plain(value.value, 4)),
        };
        if compared.shared && value.fitted { format!("{number} (shared)") } else { number }
    })
}

/// Everything that is said of one quantity, most important first.
fn lines(comparison: &Comparison, compared: &Compared) -> Vec<String> {
    let name = |label: usize| comparison.labels[label].as_str();
    let mut lines = Vec::new();
    if let Some(test) = compared.same_or_different {
        let verdict = if test.p_value < Difference::LEVEL { "different" } else { "no difference is seen" };
        lines.push(format!(
            "same or different: {verdict} ({}, {} {} for {}, ΔAIC {:+.1} for \
             \"different\")",
            p_is(test.p_value),
            test.by.name(),
            plain(test.statistic, 3),
            count_of(test.extra_parameters, "more parameter"),
            test.delta_aic
        ));
    }
    for d in &compared.differences {
        let verdict = if d.is_real() { "real" } else { "may be chance" };
        lines.push(format!(
            "{} − {}: {} {}, {}, corrected {}: {verdict}",
            name(d.second),
            name(d.first),
            with_error(d.value, d.std_error),
            interval(d.interval_95, Some(d.std_error)),
            p_is(d.p_value),
            p_text(d.p_holm)
        ));
        if let (Some(effect), Some(line)) =
            (words::effect(comparison, d).filter(|_| d.is_real()), lines.last_mut())
        {
            line.push_str(&format!(". {effect}"));
        }
    }
    let mut reasons: document::ByName<Vec<&str>> = document::ByName::new();
    for (label, why) in &compared.left_out {
        reasons.entry(words::reason(*why, compared.quantity)).or_default().push(name(*label));
    }
    for (why, labels) in reasons {
        let are = if labels.len() == 1 { "is" } else { "are each" };
        lines.push(format!("{} {are} left out: {why}", labels.join(", ")));
    }
    if lines.is_empty() && comparison.is_refuted() {
        lines.push("not compared: the data refute the model".to_owned());
    }
    if lines.is_empty() {
        lines.push("nothing to compare: it is held, or only one label determines it".to_owned());
    }
    lines
}

fn p_is(p: f64) -> String {
    if p < LEAST_P { format!("p < {LEAST_P}") } else { format!("p = {}", plain(p, 2)) }
}
