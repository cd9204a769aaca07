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

use minijinja::context;

use crate::fit::film_words::words_of;
use crate::fit::{Counted, Fit};
use crate::physics::disc::Discs;
use crate::problem::Budget;
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
    chi2_of(fit.counted(), fit.chi2(), fit.dof(), fit.noise.iter().any(|noise| noise.estimated_sd.is_some()))
}

/// Returns χ² per degree of freedom in words.
fn chi2_of(counted: Counted, chi2: f64, dof: usize, is_estimated: bool) -> String {
    words_of("chi2", context! { counted => counted.words(), chi2, dof, is_estimated })
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

/// Returns the sources of a standard error by their symbols, the largest first, without those below
/// a tenth of it.
fn sources(budget: &Budget) -> Vec<(&'static str, f64)> {
    let large = budget.parts.iter().filter(|(_, part)| *part >= 0.1 * budget.std_error());
    large.map(|(name, part)| (symbol(name), *part)).collect()
}
