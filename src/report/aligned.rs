//! Tables and sections in columns of characters.

use super::content::{Align, Block, Cell, Section, Table};

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
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

/// Sections without their pictures, each after an empty line; those of pictures alone are left out.
pub(super) fn sections<'a>(sections: impl IntoIterator<Item = &'a Section>) -> String {
    let mut text = String::new();
    for section in sections {
        let body: String = section
            .blocks
            .iter()
            .map(|block| match block {
                Block::Lines(lines) => lines.iter().map(|line| format!("  {line}\n")).collect(),
                Block::Table(own) => table(own, "  "),
                Block::Figure(_) | Block::Shots(_) => String::new(),
            })
            .collect();
        if body.is_empty() {
            continue;
        }
        let about = if section.about.is_empty() { String::new() } else { format!(" ({})", section.about) };
        text += &format!("\n{}{about}\n{body}", section.title);
    }
    text
}
