//! A [`Comparison`] → table, compare.json and pictures.

use serde_json::{Value as Json, json};

use super::html::ShotPicture;
use super::number::{interval, plain, with_error};
use super::plot;
use super::plot::compare::{forest_png, forest_svg, residuals_png, residuals_svg};
use super::table::aligned;
use super::trust::computed;
use super::{ReportError, diagnostics, html};
use crate::compare::{Compared, Comparison, Difference, LabelResidual, Value};
use crate::fit::DOWN_WEIGHTED;
use crate::impact::{Impact, Scene};
use crate::track::TrackShot;

/// What a comparison fits of footage.
pub(super) const METHOD: &str = "velocities extracted from the footage, or as the data give them (two-stage); frames are not fitted jointly";

/// What the report calls a shot.
pub(super) fn shot_name(comparison: &Comparison, residual: &LabelResidual) -> String {
    format!("{}, {}", comparison.samples[residual.sample].title, residual.of_shot.shot)
}

/// The pictures of the shots with the largest residuals, for [`files`]; `filmed`: what was extracted from each data set.
pub fn pictures(
    comparison: &Comparison,
    filmed: &[(Vec<(TrackShot, Impact)>, Scene)],
) -> Result<Vec<ShotPicture>, ReportError> {
    let mut worst: Vec<&LabelResidual> = comparison.residuals.iter().collect();
    let size = |r: &LabelResidual| {
        if r.of_shot.standardized.is_finite() { r.of_shot.standardized.abs() } else { 0.0 }
    };
    worst.sort_by(|a, b| size(b).total_cmp(&size(a)));
    let mut seen: Vec<(usize, &str)> = Vec::new();
    let mut drawn = Vec::new();
    for residual in worst {
        let shot = (residual.sample, residual.of_shot.shot.as_str());
        if seen.contains(&shot) {
            continue;
        }
        if seen.len() == html::MOST_PICTURES {
            break;
        }
        seen.push(shot);
        let Some((extracted, scene)) = filmed.get(comparison.samples[residual.sample].dataset) else {
            continue;
        };
        if let Some((track, impact)) = extracted.iter().find(|(track, _)| track.name == shot.1) {
            drawn.push((shot_name(comparison, residual), plot::track::svg(track, impact, scene)?));
        }
    }
    Ok(drawn)
}

/// The files of a comparison: name and content.
pub fn files(
    comparison: &Comparison,
    pictures: &[ShotPicture],
) -> Result<Vec<(&'static str, Vec<u8>)>, ReportError> {
    let (residuals, spots) = residuals_svg(comparison)?;
    let forest = forest_svg(comparison)?;
    let report = html::of_comparison(comparison, &forest, &residuals, &spots, pictures)?;
    Ok(vec![
        ("forest.svg", forest.into_bytes()),
        ("forest.png", forest_png(comparison)?),
        ("residuals.svg", residuals.into_bytes()),
        ("residuals.png", residuals_png(comparison)?),
        ("report.html", report.into_bytes()),
        ("compare.json", json(comparison)?.into_bytes()),
    ])
}

/// Smaller probabilities are not told apart.
const LEAST_P: f64 = 1e-4;

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
    for (title, lines) in about(comparison) {
        text.push_str(&format!("\n{title}\n"));
        for line in lines {
            text.push_str(&format!("  {line}\n"));
        }
    }
    for warning in &comparison.warnings {
        text.push_str(&format!("\nWarning: {warning}\n"));
    }
    for note in notes(comparison) {
        text.push_str(&format!("\n{note}\n"));
    }
    text
}

/// What was done to the shots: what each was computed with, constraints, shots that count less.
pub(super) fn about(comparison: &Comparison) -> Vec<(String, Vec<String>)> {
    /// Beyond these the rest is counted.
    const LISTED: usize = 20;
    let mut about = Vec::new();
    if comparison.computed.len() > 1 {
        about.push(computed(&comparison.computed));
    }
    if !comparison.relations.is_empty() {
        let state = |active: bool| if active { "holds with equality" } else { "holds with room" };
        let lines = comparison.relations.iter().map(|(text, active)| format!("{text}: {}", state(*active)));
        about.push(("Constraints".to_owned(), lines.collect()));
    }
    if let Some(robust) = &comparison.robust {
        let clear: Vec<_> = robust.weights.iter().filter(|(.., weight)| *weight < DOWN_WEIGHTED).collect();
        let line = |(sample, shot, weight): &&(usize, String, f64)| {
            let title = &comparison.samples[*sample].title;
            format!("{title}, shot {shot}: weight {} (1: counts fully)", plain(*weight, 2))
        };
        let mut lines: Vec<String> = clear.iter().take(LISTED).map(line).collect();
        if clear.is_empty() {
            lines.push(format!("no shot has a weight below {DOWN_WEIGHTED} (1: counts fully)"));
        } else if clear.len() > LISTED {
            lines.push(format!("and {} more", clear.len() - LISTED));
        }
        about.push((format!("Shots that count less, {} loss", robust.losses.join(" and ")), lines));
    }
    about
}

/// What a reader may want to know.
pub(super) fn notes(comparison: &Comparison) -> Vec<String> {
    let mut notes = comparison.notes.clone();
    if comparison.robust.is_some() {
        notes.push(
            "Outlying shots count less. χ² is weighted; errors, p-values and Wald statistics are from the scatter of the \
             shots (sandwich), whatever their noise; ΔAIC is by the Wald statistic."
                .to_owned(),
        );
    }
    notes
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
            "same or different: {verdict} ({}, {} {} for {} more parameter(s), ΔAIC {:+.1} for \
             \"different\")",
            p_is(test.p_value),
            test.by.name(),
            plain(test.statistic, 3),
            test.extra_parameters,
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

fn p_is(p: f64) -> String {
    if p < LEAST_P { format!("p < {LEAST_P}") } else { format!("p = {}", plain(p, 2)) }
}

pub(super) fn p_text(p: f64) -> String {
    if p < LEAST_P { format!("below {LEAST_P}") } else { plain(p, 2) }
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
            json!({"likelihood_ratio": t.statistic, "test": t.by.name(), "extra_parameters": t.extra_parameters,
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
    let robust = comparison.robust.as_ref().map(|robust| {
        let weight = |(sample, shot, weight): &(usize, String, f64)| {
            json!({"sample": comparison.samples[*sample].title, "shot": shot, "weight": weight})
        };
        json!({"losses": robust.losses, "weights": robust.weights.iter().map(weight).collect::<Vec<_>>()})
    });
    json!({"version": env!("CARGO_PKG_VERSION"), "fidelity": comparison.fidelity,
           "computed": comparison.computed.iter().map(diagnostics::computed).collect::<Vec<_>>(),
           "robust": robust, "constraints": comparison.relations.iter().map(diagnostics::constraint).collect::<Vec<_>>(),
           "notes": comparison.notes, "told_by": comparison.told_by,
           "labels": comparison.labels, "warnings": comparison.warnings,
           "samples": comparison.samples.iter().map(sample).collect::<Vec<_>>(),
           "parameters": comparison.quantities.iter().map(quantity).collect::<Vec<_>>(),
           "chi2": comparison.chi2, "dof": comparison.dof, "noise_estimated": comparison.noise_estimated,
           "converged": comparison.converged, "termination": comparison.termination})
}
