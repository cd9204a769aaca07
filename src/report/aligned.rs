//! Tables and sections in columns of characters.

use super::content::{Block, Section, Table};

/// Sections without their pictures, each after an empty line; those of pictures alone are left out.
pub(super) fn sections<'a>(sections: impl IntoIterator<Item = &'a Section>) -> String {
    let mut text = String::new();
    for section in sections {
        let block = |block: &Block| match block {
            Block::Lines(lines) => lines.iter().map(|line| format!("  {line}\n")).collect(),
            Block::Table(own) => table(own, "  "),
            Block::Figure(_) | Block::Tracks(_) | Block::Shots(_) => String::new(),
        };
        let body: String = section.blocks.iter().map(block).collect();
        if body.is_empty() {
            continue;
        }
        let about = if section.about.is_empty() { String::new() } else { format!(" ({})", section.about) };
        text += &format!("\n{}{about}\n{body}", section.title);
    }
    text
}

/// Columns padded to the widest cell, two spaces apart, `indent` before each line. The last cell of a short row may reach
/// beyond its column. A head without words is left out.
pub(super) fn table(table: &Table, indent: &str) -> String {
    let has_head = table.head.iter().any(|cell| !cell.is_empty());
    let rows: Vec<&Vec<String>> = has_head.then_some(&table.head).into_iter().chain(&table.rows).collect();
    let width = |column: usize| {
        let own = rows.iter().filter(|row| !table.spans(row, column)).filter_map(|row| row.get(column));
        own.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..table.head.len()).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = indent.to_owned();
        for (i, (cell, width)) in row.iter().zip(&widths).enumerate() {
            let to_the_right = table.right[i] && !table.spans(row, i);
            line += &if to_the_right { format!("{cell:>width$}  ") } else { format!("{cell:<width$}  ") };
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}
