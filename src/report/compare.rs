//! A [`Comparison`] → table, compare.json and pictures.

use serde_json::{Value as Json, json};

use super::number::{interval, plain, with_error};
use super::plot::compare as plot;
use super::table::aligned;
use super::{ReportError, html};
use crate::compare::{Compared, Comparison, Difference, Value};

/// The files of a comparison: name and content.
pub fn files(comparison: &Comparison) -> Result<Vec<(&'static str, Vec<u8>)>, ReportError> {
    let (residuals, spots) = plot::residuals_svg(comparison)?;
    let forest = plot::forest_svg(comparison)?;
    let report = html::of_comparison(comparison, &forest, &residuals, &spots)?;
    Ok(vec![
        ("forest.svg", forest.into_bytes()),
        ("forest.png", plot::forest_png(comparison)?),
        ("residuals.svg", residuals.into_bytes()),
        ("residuals.png", plot::residuals_png(comparison)?),
        ("report.html", report.into_bytes()),
        ("compare.json", json(comparison)?.into_bytes()),
    ])
}

/// The table that `caromfit compare` prints.
#[must_use]
pub fn table(comparison: &Comparison) -> String {
    let mut text = String::new();
    let mut header = vec![comparison.told_by.clone(), "shots".to_owned()];
    header.extend(comparison.quantities.iter().map(|q| q.quantity.symbol().to_owned()));
    let mut rows = vec![header];
    for (label, name) in comparison.labels.iter().enumerate() {
        let shots: usize = comparison.samples.iter().filter(|s| s.label == label).map(|s| s.shots_used).sum();
        let mut row = vec![name.clone(), shots.to_string()];
        row.extend(comparison.quantities.iter().map(|q| cell(q, label)));
        rows.push(row);
    }
    text.push_str(&aligned(&rows, ""));
    text.push_str("\n±: one standard error; (shared): one value for all; –: says nothing about it\n");
    for compared in &comparison.quantities {
        text.push_str(&format!("\n{}, {}\n", compared.quantity.symbol(), compared.quantity.meaning()));
        for line in lines(comparison, compared) {
            text.push_str(&format!("  {line}\n"));
        }
    }
    for warning in &comparison.warnings {
        text.push_str(&format!("\nWarning: {warning}\n"));
    }
    text
}

/// An estimate of a label.
pub(super) fn cell(compared: &Compared, label: usize) -> String {
    if compared.left_out.iter().any(|(out, _)| *out == label) {
        return "–".to_owned();
    }
    let own = |value: &&Value| value.label.is_none_or(|own| own == label);
    compared.estimates.iter().find(own).map_or("–".to_owned(), |value| {
        let number = match value.std_error {
            Some(error) if value.fitted => with_error(value.value, error),
            _ if value.fitted => plain(value.value, 4),
            _ => format!("{} (fixed)", plain(value.value, 4)),
        };
        if compared.shared && value.fitted { format!("{number} (shared)") } else { number }
    })
}

/// Everything that is said of one quantity, most important first.
pub(super) fn lines(comparison: &Comparison, compared: &Compared) -> Vec<String> {
    let name = |label: usize| comparison.labels[label].as_str();
    let mut lines = Vec::new();
    if let Some(test) = compared.same_or_different {
        let verdict = if test.p_value < Difference::LEVEL { "different" } else { "no difference is seen" };
        lines.push(format!(
            "same or different: {verdict} (p = {}, likelihood ratio {} for {} more parameter(s), ΔAIC {:+.1} for \
             \"different\")",
            p_text(test.p_value),
            plain(test.statistic, 3),
            test.extra_parameters,
            test.delta_aic
        ));
    }
    for d in &compared.differences {
        let verdict = if d.is_real() { "real" } else { "may be chance" };
        lines.push(format!(
            "{} − {}: {} {}, p = {}, corrected {}: {verdict}",
            name(d.second),
            name(d.first),
            with_error(d.value, d.std_error),
            interval(d.interval_95, Some(d.std_error)),
            p_text(d.p_value),
            p_text(d.p_holm)
        ));
        if let Some(words) = d.words.as_ref().filter(|_| d.is_real()) {
            lines.push(format!("  {words}"));
        }
    }
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    for (label, why) in &compared.left_out {
        match reasons.iter_mut().find(|(known, _)| known == why) {
            Some((_, labels)) => labels.push(name(*label)),
            None => reasons.push((why, vec![name(*label)])),
        }
    }
    for (why, labels) in reasons {
        let are = if labels.len() == 1 { "is" } else { "are each" };
        lines.push(format!("{} {are} left out: {why}", labels.join(", ")));
    }
    if lines.is_empty() {
        lines.push("nothing to compare: it is held, or one label only tells it".to_owned());
    }
    lines
}

pub(super) fn p_text(p: f64) -> String {
    if p < 1e-4 { "below 0.0001".to_owned() } else { plain(p, 2) }
}

/// compare.json as text.
pub fn json(comparison: &Comparison) -> Result<String, ReportError> {
    serde_json::to_string_pretty(&document(comparison))
        .map(|text| text + "\n")
        .map_err(|source| ReportError::Json { dataset: "the comparison".to_owned(), source })
}

/// What compare.json holds. What is not finite becomes `null`.
#[must_use]
pub fn document(comparison: &Comparison) -> Json {
    let name = |label: usize| comparison.labels[label].clone();
    let quantity = |q: &Compared| {
        let estimate = |v: &Value| {
            json!({"label": v.label.map(name), "estimate": v.value, "std_error": v.std_error,
                   "interval_95": v.interval_95, "fitted": v.fitted, "at_bound": v.at_bound})
        };
        let difference = |d: &Difference| {
            json!({"first": name(d.first), "second": name(d.second), "difference": d.value, "std_error": d.std_error,
                   "interval_95": d.interval_95, "p_value": d.p_value, "p_holm": d.p_holm, "real": d.is_real(),
                   "effect": d.words})
        };
        let test = q.same_or_different.map(|t| {
            json!({"likelihood_ratio": t.statistic, "extra_parameters": t.extra_parameters,
                   "p_value": t.p_value, "delta_aic": t.delta_aic})
        });
        let left_out = |(label, why): &(usize, String)| json!({"label": name(*label), "reason": why});
        json!({"parameter": q.quantity.name(), "meaning": q.quantity.meaning(), "shared": q.shared,
               "estimates": q.estimates.iter().map(estimate).collect::<Vec<_>>(),
               "differences": q.differences.iter().map(difference).collect::<Vec<_>>(),
               "same_or_different": test,
               "left_out": q.left_out.iter().map(left_out).collect::<Vec<_>>()})
    };
    let sample = |s: &crate::compare::SampleSummary| {
        let rejected = |r: &crate::fit::Rejected| json!({"shot": r.shot, "reason": r.reason});
        json!({"title": s.title, "label": name(s.label), "shots_used": s.shots_used,
               "shots_rejected": s.shots_rejected.iter().map(rejected).collect::<Vec<_>>()})
    };
    json!({"version": env!("CARGO_PKG_VERSION"), "fidelity": comparison.fidelity, "told_by": comparison.told_by,
           "labels": comparison.labels, "warnings": comparison.warnings,
           "samples": comparison.samples.iter().map(sample).collect::<Vec<_>>(),
           "parameters": comparison.quantities.iter().map(quantity).collect::<Vec<_>>(),
           "chi2": comparison.chi2, "dof": comparison.dof, "noise_estimated": comparison.noise_estimated,
           "converged": comparison.converged, "termination": comparison.termination})
}
