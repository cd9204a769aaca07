//! Outputs of a [`Fit`] for people and for programs. Programs read [`document`] and [`csv`];
//! `templates` render documents as text and HTML for people. Only `write` touches the disk.

pub mod compare;
pub mod csv;
pub(crate) mod design;
pub mod document;
pub(crate) mod export;
pub(crate) mod extracted;
pub mod fit;
mod plot;
mod shots;
pub mod stored;
pub(crate) mod templates;
pub mod terminal;
pub(crate) mod write;

#[cfg(feature = "cli")]
pub(crate) use write::fit_folder;
pub use write::{folder_name, group_folders, write};

use crate::fit::{Counted, Fit};
use crate::measurement::number::plain;
use crate::physics::disc::Discs;
use crate::problem::{self, Id};
use crate::words::symbol;

/// Why a report cannot be made: a file that cannot be written, or a figure, a page or a JSON
/// document that cannot be made.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ReportError(String);

impl From<serde_json::Error> for ReportError {
    fn from(error: serde_json::Error) -> Self {
        Self(format!("the result cannot be written as JSON: {error}"))
    }
}

impl From<minijinja::Error> for ReportError {
    fn from(error: minijinja::Error) -> Self {
        Self(format!("the report cannot be rendered: {error:#}"))
    }
}

/// Returns the title of the fit: the data set and, if labels are fitted separately, the label.
pub(crate) fn title(fit: &Fit) -> String {
    match &fit.group {
        Some((column, label)) => format!("{}, {column} = {label}", fit.dataset),
        None => fit.dataset.clone(),
    }
}

/// Returns χ² per degree of freedom, what it counts, and whether the noise of some observable was
/// estimated from the residuals of this very fit, which draws χ²/dof towards 1 for any the model.
fn chi2_words(fit: &Fit) -> String {
    chi2_of(fit.counted(), fit.chi2, fit.dof, fit.noise.iter().any(|noise| noise.estimated_sd.is_some()))
}

/// Returns χ² per degree of freedom in words.
fn chi2_of(counted: Counted, chi2: f64, dof: usize, is_estimated: bool) -> String {
    if dof == 0 {
        return "no degrees of freedom: the fit passes through the data and cannot be tested".to_owned();
    }
    let reduced = chi2 / dof as f64;
    // three digits if two decimals are 0
    let text = if (0.01..100.0).contains(&reduced) { format!("{reduced:.2}") } else { plain(reduced, 3) };
    let how = if is_estimated { "; noise estimated from the residuals" } else { "" };
    format!("χ²/dof of {} = {text} (χ² = {}, {dof} dof{how})", counted.words(), plain(chi2, 4))
}

/// Returns a unit in files for programs: plain ASCII, `1` for a ratio.
fn ascii(unit: &'static str) -> &'static str {
    match unit {
        "°" => "deg",
        "" => "1",
        unit => unit,
    }
}

fn speed_unit(discs: &Discs) -> &'static str {
    if discs.in_seconds { "m/s" } else { "m per frame" }
}

/// Sources of the standard error of a parameter, by their symbols, the largest first, without those
/// below a tenth of the standard error.
struct Budget {
    of: Id,
    std_error: f64,
    parts: Vec<(String, f64)>,
}

fn budgets(fit: &Fit) -> Vec<Budget> {
    let budget = |found: &problem::Budget| {
        let parts = document::budget(found).into_iter();
        let parts = parts.filter_map(|part| Some((symbol(&part.source).to_owned(), part.std_error?)));
        let mut parts: Vec<_> = parts.collect();
        let std_error = parts.iter().map(|(_, error)| error.powi(2)).sum::<f64>().sqrt();
        parts.retain(|(_, error)| *error >= 0.1 * std_error);
        Budget { of: found.id, std_error, parts }
    };
    fit.budget.iter().map(budget).collect()
}
