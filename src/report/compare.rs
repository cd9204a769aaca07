//! A [`Comparison`] → files, report, and its verdict.

use std::path::Path;

use minijinja::value::Serde;
use minijinja::{Value as Values, context};

use super::document::{self, CompareDocument};
use super::plot::{forest, of_comparison};
use super::shots::shot_list;
use super::templates;
use super::write::Staged;
use super::{ReportError, chi2_of, csv};
use crate::compare::{Comparison, NOT_CONVERGED};
use crate::fit::film_words::words_of;
use crate::fit::{Counted, Grade, Verdict};
use crate::problem::Block;

/// The template of the report.
const COMPARE: &str = include_str!("templates/compare.jinja");

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
    let shots = comparison
        .residuals()
        .map(|(sample, residual)| (format!("{}, {}", sample.title, residual.shot), residual));
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
    context! { chi2, is_refuted => comparison.is_refuted(), ..Serde(&document) }
}

pub(super) fn counted(comparison: &Comparison) -> Counted {
    let samples = &comparison.solution.problem.samples;
    if samples.iter().any(|sample| !matches!(sample.block, Block::Rows(_))) {
        return Counted::Coordinates;
    }
    Counted::of(comparison.residuals().map(|(_, residual)| &residual.observable))
}

pub(super) fn termination(comparison: &Comparison) -> &'static str {
    if comparison.solution.converged { "converged: no step promises a smaller χ²" } else { NOT_CONVERGED }
}

/// Returns whether the comparison can be used: what differs, the first reason for doubt, or why it
/// cannot.
pub(super) fn verdict(comparison: &Comparison) -> Verdict {
    let (grade, warnings) = (comparison.grade(), comparison.warnings());
    let quantities = Serde(&comparison.quantities);
    let first = warnings.first().copied();
    let values = context! { quantities, first, is_unusable => grade == Grade::Unusable };
    Verdict { grade, sentence: words_of("compared", values) }
}
