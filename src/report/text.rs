//! A report as text, for the terminal.

use std::fmt::Write;

use super::content::{Align, Block, Cell, Report, Table};
use super::title;
use crate::fit::Fit;

/// What must not be overlooked of several fits, a line each.
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

/// The fit with what each number means.
#[must_use]
pub fn render(fit: &Fit) -> String {
    walk(&super::fit::content(fit))
}

/// The whole report but its pictures.
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

/// Columns padded to the widest cell, two spaces apart, `indent` before each line. The last cell of a short row may reach
/// beyond its column. A head without words is left out.
pub(super) fn table(table: &Table, indent: &str) -> String {
    let columns = table.head.len();
    let has_head = table.head.iter().any(|cell| !cell.text.is_empty());
    let rows: Vec<&Vec<Cell>> = has_head.then_some(&table.head).into_iter().chain(&table.rows).collect();
    let length = |cell: &Cell| cell.text.chars().count();
    let spans = |row: &[Cell], column: usize| row.len() < columns && column + 1 == row.len();
    let width = |column: usize| {
        let own = rows.iter().filter(|row| !spans(row, column)).filter_map(|row| row.get(column));
        own.map(length).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = indent.to_owned();
        for (Cell { text, align }, width) in row.iter().zip(&widths) {
            line.push_str(&match align {
                Align::Left => format!("{text:<width$}  "),
                Align::Right => format!("{text:>width$}  "),
            });
        }
        push(&mut text, line.trim_end());
    }
    text
}

fn push(text: &mut String, line: &str) {
    // Writing into a String cannot fail.
    let _ = writeln!(text, "{line}");
}
