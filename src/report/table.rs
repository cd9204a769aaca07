//! The table that `caromfit fit` prints: one line per fit.

use super::content::{Cell, Table};
use super::number::{plain, with_error};
use super::{noise_estimated, reduced_chi2, text};
use crate::fit::{Estimate, Fit, Status};
use crate::measurement::parameter::Parameter;

/// One line per fit, and below the table what its marks mean.
#[must_use]
pub fn render(fits: &[Fit]) -> String {
    let has =
        |parameter: &Parameter| fits.iter().flat_map(|fit| &fit.estimates).any(|e| e.parameter == *parameter);
    // b and c where some friction falls
    let parameters: Vec<Parameter> =
        Parameter::ALL.into_iter().filter(|p| Parameter::COEFFICIENTS.contains(p) || has(p)).collect();
    let header = ["data set", "shots"]
        .into_iter()
        .map(str::to_owned)
        .chain(parameters.iter().map(|parameter| with_unit(parameter.symbol(), parameter.unit(), ", ")))
        .chain(["χ²/dof", "status"].map(str::to_owned))
        .collect();
    let mut rows = vec![header];
    rows.extend(fits.iter().map(|fit| row(fit, &parameters)));
    let mut text = aligned(&rows, "");
    let legend = legend(fits);
    if !legend.is_empty() {
        text.push('\n');
        text.push_str(&legend);
    }
    text
}

/// Rows of a table, the first its head, as [`text::table`] lays them out.
pub(super) fn aligned(rows: &[Vec<String>], indent: &str) -> String {
    let mut rows = rows.iter().map(|row| row.iter().map(Cell::text).collect::<Vec<_>>());
    let head = rows.next().unwrap_or_default();
    text::table(&Table { head, rows: rows.collect() }, indent)
}

/// With its unit, where it has one.
pub(super) fn with_unit(text: &str, unit: &str, space: &str) -> String {
    if unit.is_empty() { text.to_owned() } else { format!("{text}{space}{unit}") }
}

/// An estimate in one cell. Of a refuted model: the restitution that was measured without it, where there is one, else the
/// bare estimate.
pub(super) fn estimate(fit: &Fit, estimate: &Estimate) -> String {
    let value = plain(estimate.value, 4);
    if let Some(refuted) = fit.refuted.as_ref().filter(|_| estimate.status == Status::Free) {
        return match refuted.restitution.filter(|_| estimate.parameter == Parameter::E) {
            Some(measured) => {
                format!("measured {} (fit refuted)", with_error(measured.value, measured.std_error))
            }
            None => format!("{value} (refuted)"),
        };
    }
    match (estimate.status, estimate.std_error) {
        (Status::Free, Some(error)) if error.is_finite() => with_error(estimate.value, error),
        (Status::Free, _) => format!("{value} (no error)"),
        (Status::Fixed, _) => format!("{value} (fixed)"),
        (Status::AtLowerBound, _) => format!("{value} (at lower bound)"),
        (Status::AtUpperBound, _) => format!("{value} (at upper bound)"),
        (Status::NotIdentified, _) => "– (not identified)".to_owned(),
    }
}

fn row(fit: &Fit, parameters: &[Parameter]) -> Vec<String> {
    let name = match &fit.group {
        Some((_, label)) => format!("{} / {label}", fit.dataset),
        None => fit.dataset.clone(),
    };
    let rejected = fit.shots_rejected.len();
    let shots = if rejected == 0 {
        fit.shots_used.to_string()
    } else {
        format!("{} of {}", fit.shots_used, fit.shots_used + rejected)
    };
    let chi2 = match reduced_chi2(fit) {
        Some(chi2) if noise_estimated(fit) => format!("{} *", chi2_text(chi2)),
        Some(chi2) => chi2_text(chi2),
        None => "–".to_owned(),
    };
    let mut cells = vec![name, shots];
    let own = |parameter: &Parameter| fit.estimates.iter().find(|e| e.parameter == *parameter);
    cells.extend(
        parameters.iter().map(|parameter| own(parameter).map_or("–".to_owned(), |e| estimate(fit, e))),
    );
    cells.extend([chi2, status(fit)]);
    cells
}

/// Two decimals, or three digits where those show nothing.
pub(super) fn chi2_text(chi2: f64) -> String {
    if (0.01..100.0).contains(&chi2) { format!("{chi2:.2}") } else { plain(chi2, 3) }
}

fn status(fit: &Fit) -> String {
    let warnings = match fit.warnings.len() {
        0 => None,
        1 => Some("1 warning".to_owned()),
        n => Some(format!("{n} warnings")),
    };
    let refuted = fit.refuted.as_ref().map(|_| "refuted".to_owned());
    let failed = (!fit.converged).then(|| "not converged".to_owned());
    let said: Vec<String> = [refuted, failed, warnings].into_iter().flatten().collect();
    if said.is_empty() { "ok".to_owned() } else { said.join(", ") }
}

/// A line for each mark that some fit carries.
fn legend(fits: &[Fit]) -> String {
    let has = |status: Status| fits.iter().flat_map(|fit| &fit.estimates).any(|e| e.status == status);
    let free = || fits.iter().flat_map(|fit| fit.estimates.iter().map(move |estimate| (fit, estimate)));
    let refuted = || fits.iter().filter_map(|fit| fit.refuted.as_ref());
    let free = || free().filter(|(fit, estimate)| estimate.status == Status::Free && fit.refuted.is_none());
    let no_error = |(_, estimate): &(&Fit, &Estimate)| !estimate.std_error.is_some_and(f64::is_finite);
    let lines = [
        (
            free().any(|pair| !no_error(&pair)) || refuted().any(|r| r.restitution.is_some()),
            "±: one standard error",
        ),
        (
            refuted().next().is_some(),
            "refuted: χ² rules the model out; the value is where χ² is least, and has no standard error, which would hold only \
             if the model did",
        ),
        (
            refuted().any(|r| r.restitution.is_some()),
            "measured: the ratio of the normal velocities after and before the impact, without any model of the friction",
        ),
        (has(Status::Fixed), "fixed: held at this value, not fitted"),
        (
            has(Status::AtLowerBound) || has(Status::AtUpperBound),
            "at … bound: the best value within the allowed range is at its end; the data pull beyond it or leave it open",
        ),
        (
            has(Status::NotIdentified),
            "not identified: these data say nothing about it; it stayed at its initial value",
        ),
        (
            free().filter(no_error).any(|(fit, _)| fit.dof == 0),
            "no error: no degrees of freedom are left to tell one from",
        ),
        (
            free().filter(no_error).any(|(fit, _)| fit.dof > 0),
            "no error: these data do not determine one; see the warnings",
        ),
        (
            fits.iter().any(|fit| noise_estimated(fit) && fit.dof > 0),
            "*: noise estimated from the residuals of this fit, so that χ²/dof is near 1 whatever the model",
        ),
    ];
    let marks: String = lines.iter().filter(|(used, _)| *used).map(|(_, line)| format!("{line}\n")).collect();
    let corrected = fits.iter().filter_map(|fit| {
        let sentence = fit.camera.as_ref()?.sentence()?;
        Some(format!("{}: {sentence}\n", super::title(fit)))
    });
    marks + &corrected.collect::<String>()
}
