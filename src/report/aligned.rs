//! Tables in columns of characters.

use super::content::{Align, Cell, Table};

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

/// Rows of a table, the first its head, as [`table`] lays them out.
pub(super) fn aligned(rows: &[Vec<String>], indent: &str) -> String {
    let mut rows = rows.iter().map(|row| row.iter().map(Cell::text).collect::<Vec<_>>());
    let head = rows.next().unwrap_or_default();
    table(&Table { head, rows: rows.collect() }, indent)
}
