//! A report as text, for the terminal.

use std::fmt::Write;

use super::aligned::table;
use super::content::{Block, Report};
use super::title;
use crate::fit::Fit;

/// The warnings of several fits, a line each.
#[must_use]
pub fn warnings(fits: &[Fit]) -> String {
    let mut text = String::new();
    for fit in fits {
        for warning in &fit.warnings {
            push(&mut text, &format!("{}: {warning}", title(fit)));
        }
    }
    if text.is_empty() { text } else { format!("\n{text}") }
}

/// The report of a fit as text, which says what each number means.
#[must_use]
pub fn render(fit: &Fit) -> String {
    walk(&super::fit::content(fit))
}

/// A report as text, without its pictures.
#[must_use]
pub fn walk(report: &Report) -> String {
    let mut text = report.title.clone();
    text.push('\n');
    push(&mut text, &format!("Verdict: {}. {}", report.verdict.grade, report.verdict.sentence));
    for fact in &report.facts {
        push(&mut text, &format!("  {}: {}", fact.name, fact.text));
    }
    if !report.warnings.is_empty() {
        text.push('\n');
    }
    for warning in &report.warnings {
        push(&mut text, &format!("Warning: {warning}"));
    }
    for section in &report.sections {
        let mut body = String::new();
        for block in &section.blocks {
            match block {
                Block::Lines(lines) => lines.iter().for_each(|line| push(&mut body, &format!("  {line}"))),
                Block::Table(own) => body.push_str(&table(own, "  ")),
                Block::Figure(_) | Block::Shots(_) => {}
            }
        }
        if body.is_empty() {
            continue;
        }
        let about = if section.about.is_empty() { String::new() } else { format!(" ({})", section.about) };
        push(&mut text, &format!("\n{}{about}", section.title));
        text.push_str(&body);
    }
    text
}

fn push(text: &mut String, line: &str) {
    // Writing into a String cannot fail.
    let _ = writeln!(text, "{line}");
}
