//! A report as text, for the terminal.

use super::aligned::sections;
use super::content::Report;
use super::title;
use crate::fit::Fit;

/// The warnings of several fits, a line each.
#[must_use]
pub fn warnings(fits: &[Fit]) -> String {
    let of = |fit: &Fit| {
        fit.warnings().into_iter().map(|one| format!("{}: {one}\n", title(fit))).collect::<String>()
    };
    let text: String = fits.iter().map(of).collect();
    if text.is_empty() { text } else { format!("\n{text}") }
}

/// A report as text, without its pictures.
#[must_use]
pub fn walk(report: &Report) -> String {
    let verdict = &report.verdict;
    let mut text = format!("{}\nVerdict: {}. {}\n", report.title, verdict.grade.name(), verdict.sentence);
    for [name, fact] in &report.facts {
        text += &format!("  {name}: {fact}\n");
    }
    if !report.warnings.is_empty() {
        text.push('\n');
    }
    for warning in &report.warnings {
        text += &format!("Warning: {warning}\n");
    }
    text + &sections(&report.sections)
}
