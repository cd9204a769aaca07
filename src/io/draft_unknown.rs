//! The part of a draft about a table in no known format.

use std::path::Path;

use super::draft_files::numbers;
use super::draft_scale::suggest_y_axis;
use super::draft_text::{Draft, NUMBER, TEXT};
use super::text::decode;

/// Maximum number of lines of a header and of cells that are shown, and of characters of each.
const MOST_HEADERS: usize = 6;
const MOST_CELLS: usize = 30;
const LONGEST_LINE: usize = 160;
const LONGEST_CELL: usize = 40;

/// Shows the first lines of the table, and asks for the meaning of its columns.
pub(super) fn describe(file: &Path, names: &[String], draft: &mut Draft) {
    let cut = |text: &str, longest: usize| {
        let short: String = text.trim().chars().take(longest).collect();
        if short.len() < text.trim().len() { short + "…" } else { short }
    };
    let bytes = std::fs::read(file).unwrap_or_default();
    let text = decode(&bytes).0;
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    // numbers in a header stand alone
    let is_row = |line: &&str| numbers(line) >= 3 && 2 * numbers(line) > line.split([',', ';', '\t']).count();
    let row = lines.iter().position(is_row);
    let header = &lines[..row.unwrap_or(lines.len().min(1))];
    draft.find(format!(
        "{}: no known format. Say under [tracks.columns] which column is what, by its name or by its number, from 1 on.",
        file.display(),
    ));
    if let Some(hint) = hint(names, lines.get(1).unwrap_or(&"")) {
        draft.find(hint);
    }
    draft.line("\n[video]");
    draft.blank("capture_fps", "capture_fps", NUMBER, "frames per second that the camera recorded at");
    draft.line("\n[scale]");
    let units = "m, cm, mm, in, ft, or px (the balls are then the ruler)";
    draft.blank("length_unit", "length_unit", TEXT, units);
    suggest_y_axis(draft);
    draft.line("\n[tracks]");
    draft.suggest("cue", TEXT, "only of a table with one row per ball and frame: its name of the cue ball");
    draft.suggest("object", TEXT, "and of the object ball");
    let shown = header[header.len().saturating_sub(MOST_HEADERS)..].iter();
    let shown: Vec<String> = shown.map(|line| cut(line, LONGEST_LINE)).collect();
    draft.line(format!("# The names of the columns:\n#   {}", shown.join("\n#   ")));
    if let Some(row) = row.map(|row| lines[row]) {
        let separator = [';', '\t', ','].into_iter().find(|c| row.contains(*c)).unwrap_or(' ');
        let cells = row.split(separator).filter(|cell| separator != ' ' || !cell.is_empty());
        let numbered = (1..)
            .zip(cells.take(MOST_CELLS))
            .map(|(i, cell): (usize, &str)| format!("{i}: {}", cut(cell, LONGEST_CELL)));
        let numbered = numbered.collect::<Vec<_>>().join("  ");
        draft.line(format!("# The first row of numbers, with the number of each column:\n#   {numbered}"));
    }
    draft.line("[tracks.columns]              # a column by its name, t = \"time\", or by its number, t = 1");
    let why = "time in seconds, or frame = …; without either, each row is a frame";
    draft.blank("which column is what", "t", NUMBER, why);
    draft.line("# One row per frame:\n# cue_x = …\n# cue_y = …\n# object_x = …\n# object_y = …");
    draft.line("# Or one row per ball and frame:\n# ball = …\n# x = …\n# y = …");
}

/// Returns advice about tables of some programs that no column describes.
fn hint(names: &[String], second: &str) -> Option<&'static str> {
    let has = |part: &str| names.iter().any(|name| name.to_lowercase().contains(part));
    if has("run #2") || has("run 2:") {
        Some(
            "Several runs stand beside each other: export a file for each run, or put them below each other with a column shot.",
        )
    } else if second.contains(['(', '[']) {
        Some("Cells in brackets hold x and y together: write each into a column of its own.")
    } else if has("label") && has("area") {
        Some(
            "No column says which frame a row is of: in ImageJ, tick Stack position under Analyze, Set Measurements.",
        )
    } else {
        None
    }
}
