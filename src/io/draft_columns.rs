//! The part of a draft that is about a table in no known format.

use std::path::Path;

use super::draft_sheet::{Sheet, quoted};

/// So many columns of a table are listed, and so many characters of the name of one.
const MOST_COLUMNS: usize = 30;
const LONGEST_COLUMN: usize = 40;

/// A name, or how a long one begins.
fn begin(name: &str) -> String {
    let mut short: String = name.chars().take(LONGEST_COLUMN).collect();
    if short.len() < name.len() {
        short.push('…');
    }
    short
}

/// What is said of a table in no known format.
pub(super) fn describe_columns(file: &Path, names: &[String], sheet: &mut Sheet) {
    let mut listed: Vec<String> = names.iter().take(MOST_COLUMNS).map(|name| quoted(&begin(name))).collect();
    if names.len() > MOST_COLUMNS {
        listed.push(format!("… ({} in all)", names.len()));
    }
    sheet.found.push(format!(
        "{}: no known format; its first line is {}. Say under [tracks.columns] which column is what.",
        file.display(),
        listed.join(", ")
    ));
    sheet.line("\n[video]");
    sheet.blank("capture_fps", "# capture_fps = …", "frames per second that the camera recorded at");
    sheet.line("\n[scale]");
    sheet.blank("length_unit", "# length_unit = \"…\"", "m, cm, mm, or px with m_per_px = …");
    sheet.line("\n[tracks]\n# The first line of the file: ");
    sheet.line(&format!("#   {}", listed.join(", ")));
    sheet.line("[tracks.columns]");
    sheet.blank("which column is what", "# t = \"…\"", "time in seconds, or frame = \"…\"");
    for key in ["cue_x", "cue_y", "object_x", "object_y"] {
        sheet.line(&format!("# {key} = \"…\""));
    }
}
