//! All fits in one table, a line each, as `caromfit fit --all` prints it.

use super::aligned;
use super::content::Table;
use super::number::{plain, with_error, with_interval};
use super::{noise_estimated, reduced_chi2};
use crate::fit::{Estimate, Fit, Grade, Status};
use crate::measurement::parameter::Parameter;

/// One line per fit, and below the table what its marks mean.
#[must_use]
pub fn render(fits: &[Fit]) -> String {
    let parameters = parameters(fits);
    let rows: Vec<Vec<String>> = fits.iter().map(|fit| row(fit, &parameters)).collect();
    let legend = legend(fits, &rows);
    let mut text = aligned::table(&Table::new(head(&parameters, &["χ²/dof", "verdict"]), rows), "");
    if !legend.is_empty() {
        text.push('\n');
        text.push_str(&legend);
    }
    text
}

/// The heads of columns: of data sets and shots, of parameters with their units, and `last`.
pub(super) fn head(parameters: &[Parameter], last: &[&str]) -> Vec<String> {
    let symbols = parameters.iter().map(|parameter| with_unit(parameter.symbol(), parameter.unit(), ", "));
    let ends = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
    ends(&["data set", "shots"]).into_iter().chain(symbols).chain(ends(last)).collect()
}

/// The parameters that have a column: those of some fit, without the ratios of the balls, which few readers look for.
pub(super) fn parameters(fits: &[Fit]) -> Vec<Parameter> {
    let has =
        |parameter: &Parameter| fits.iter().flat_map(|fit| &fit.estimates).any(|e| e.parameter == *parameter);
    let is_shown = |p: &Parameter| Parameter::COEFFICIENTS.contains(p) || has(p) && !p.is_of_balls();
    Parameter::ALL.into_iter().filter(is_shown).collect()
}

/// What stands in the place of ±.
pub(super) const INTERVAL: &str = "[…]: the 95 % interval, where it is far from ± two standard errors";

/// What the symbols of columns mean that few data sets have.
pub(super) fn columns(parameters: &[Parameter]) -> Vec<String> {
    let rare = parameters.iter().filter(|parameter| !Parameter::COEFFICIENTS.contains(parameter));
    rare.map(|parameter| format!("{}: {}", parameter.symbol(), parameter.meaning())).collect()
}

/// With its unit, where it has one.
pub(super) fn with_unit(text: &str, unit: &str, space: &str) -> String {
    if unit.is_empty() { text.to_owned() } else { format!("{text}{space}{unit}") }
}

/// A value to so many digits, with its unit.
pub(super) fn quantity(value: f64, digits: usize, unit: &str) -> String {
    with_unit(&plain(value, digits), unit, " ")
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
    if let Some([edge, bound]) = fit.plateau(estimate.parameter) {
        let sign = if bound >= edge { '≥' } else { '≤' };
        return format!("{sign} {}", plain(edge, 3));
    }
    if let Some(interval) = estimate.lopsided().filter(|_| estimate.status == Status::Free) {
        return with_interval(estimate.value, interval);
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

/// An estimate in the cell of a table of fits: no number where none can be used.
pub(super) fn brief(fit: &Fit, parameter: Parameter) -> String {
    let Some(own) = fit.estimates.iter().find(|e| e.parameter == parameter) else { return "–".to_owned() };
    match own.status {
        _ if fit.verdict().grade == Grade::Unusable => "–".to_owned(),
        _ if fit.plateau(parameter).is_some() => estimate(fit, own),
        Status::NotIdentified => "–".to_owned(),
        Status::AtLowerBound | Status::AtUpperBound => format!("{} (bound)", plain(own.value, 4)),
        Status::Free | Status::Fixed => estimate(fit, own),
    }
}

/// The data set, and the label of a fit of one.
pub(super) fn name(fit: &Fit) -> String {
    match &fit.group {
        Some((_, label)) => format!("{} / {label}", fit.dataset),
        None => fit.dataset.clone(),
    }
}

/// How many shots were used, of how many.
pub(super) fn shots(fit: &Fit) -> String {
    match fit.shots_rejected.len() {
        0 => fit.shots_used.to_string(),
        rejected => format!("{} of {}", fit.shots_used, fit.shots_used + rejected),
    }
}

fn row(fit: &Fit, parameters: &[Parameter]) -> Vec<String> {
    let chi2 = match reduced_chi2(fit) {
        Some(chi2) if noise_estimated(fit) => format!("{} *", chi2_text(chi2)),
        Some(chi2) => chi2_text(chi2),
        None => "–".to_owned(),
    };
    let mut cells = vec![name(fit), shots(fit)];
    cells.extend(parameters.iter().map(|parameter| brief(fit, *parameter)));
    cells.extend([chi2, fit.verdict().grade.name().to_owned()]);
    cells
}

/// Two decimals, or three digits where those show nothing.
pub(super) fn chi2_text(chi2: f64) -> String {
    if (0.01..100.0).contains(&chi2) { format!("{chi2:.2}") } else { plain(chi2, 3) }
}

/// Whether a mark stands in some cell of a row behind the data set and its shots.
pub(super) fn shows(row: &[String], mark: &str) -> bool {
    row.iter().skip(2).any(|cell| cell.contains(mark))
}

/// A line for each mark that some usable fit carries.
fn legend(fits: &[Fit], rows: &[Vec<String>]) -> String {
    let is_usable = |fit: &Fit| fit.verdict().grade != Grade::Unusable;
    // but χ²/dof and the verdict
    let usable = || {
        fits.iter().zip(rows).filter(|(fit, _)| is_usable(fit)).map(|(fit, row)| (fit, &row[..row.len() - 2]))
    };
    let has = |mark: &str| usable().any(|(_, cells)| shows(cells, mark));
    let has_no_error =
        |is_free: fn(&Fit) -> bool| usable().any(|(fit, cells)| is_free(fit) && shows(cells, "no error"));
    let lines = [
        (has("±"), "±: one standard error"),
        (has("["), INTERVAL),
        (!fits.iter().all(is_usable), "unusable: the numbers of that fit mean nothing; its report says why"),
        (has("≥") || has("≤"), "≥, ≤: every larger (smaller) value fits equally"),
        (has("(fixed)"), "fixed: held at this value, not fitted"),
        (
            has("(bound)"),
            "bound: the best value within the allowed range is at its end; the data pull beyond it or leave it open",
        ),
        (has("–"), "–: these shots say nothing about it"),
        (has_no_error(|fit| fit.dof == 0), "no error: no degrees of freedom are left to tell one from"),
        (has_no_error(|fit| fit.dof > 0), "no error: these data do not determine one; see the warnings"),
        (
            rows.iter().any(|cells| shows(cells, " *")),
            "*: noise estimated from the residuals of this fit, so that χ²/dof is near 1 whatever the model",
        ),
    ];
    let marks: String = lines.iter().filter(|(used, _)| *used).map(|(_, line)| format!("{line}\n")).collect();
    let corrected = fits.iter().filter_map(|fit| {
        let sentence = fit.camera.as_ref()?.sentence()?;
        Some(format!("{}: {sentence}\n", super::title(fit)))
    });
    let columns = columns(&parameters(fits)).into_iter().map(|line| line + "\n");
    marks + &columns.chain(corrected).collect::<String>()
}
