//! The part of a draft that is about a table in no known format, and about rows that cannot be read.

use std::path::{Path, PathBuf};

use super::Survey;
use super::draft_files::numbers;
use super::draft_scale::describe_y_axis;
use super::draft_text::Draft;
use super::draft_text::{OBJECT, quoted};
use super::text::decode;
use super::tracking::Guessed;

/// So many columns of a table are listed, and so many characters of the name of one.
const MOST_COLUMNS: usize = 30;
const LONGEST_COLUMN: usize = 40;

/// So many rows that cannot be read are shown.
const MOST_PROBLEMS: usize = 3;

/// What `[tracks.columns]` most likely is, with the columns of both balls exchanged or not.
pub(super) fn describe_guess(survey: &Survey, exchanged: bool, draft: &mut Draft) {
    if survey.guess.columns.is_empty() {
        return;
    }
    draft.find("In no known format: [tracks.columns] is guessed from the names of columns; check it.");
    if !survey.guess.passed.is_empty() {
        draft.find(format!("No positions of balls, and passed over: {}.", survey.guess.passed.join(", ")));
    }
    draft.line("\n[tracks.columns]              # guessed: check it");
    if let Some(name) = &survey.guess.perhaps_time {
        let why = "its numbers grow from row to row: frame, if they number the frames, or t and [tracks] time_unit, if they are times; \
                   else each row is taken as one frame";
        draft.blank_line("which column is what", &format!("# frame = {}", quoted(name)), why);
    }
    for Guessed { key, column, doubt } in &survey.guess.columns {
        // the same keys in the same order, with the columns of the other ball
        let other = other_ball(key).filter(|_| exchanged);
        let column = other.and_then(|key| survey.guess.column(&key)).unwrap_or(column).shown();
        match doubt.as_deref() {
            None => draft.line(format!("{key} = {column}")),
            Some("") => draft.line(format!("# {key} = {column}")),
            Some(why) => draft.line(format!("# {key} = {column}   # {why}")),
        }
    }
    if let Some(unit) = survey.guess.angle_unit {
        draft.line(format!("angle_unit = \"{}\"", unit.name()));
    }
}

/// Returns the key for the other ball.
fn other_ball(key: &str) -> Option<String> {
    let object = |rest| format!("object_{rest}");
    let cue = |rest| format!("cue_{rest}");
    key.strip_prefix("cue_").map(object).or_else(|| key.strip_prefix("object_").map(cue))
}

/// What has to be corrected in the files before anything is read from them.
pub(super) fn describe_problems(all: &[(&PathBuf, &Survey)], draft: &mut Draft) {
    let problems: Vec<&String> = all.iter().flat_map(|(_, survey)| &survey.problems).collect();
    if problems.is_empty() {
        return;
    }
    let more = problems.len().saturating_sub(MOST_PROBLEMS);
    let more = if more > 0 { format!(" (and {more} more)") } else { String::new() };
    let shown: Vec<String> =
        problems.iter().take(MOST_PROBLEMS).map(|problem| format!("\n  {problem}")).collect();
    draft.find(format!("To be corrected in the files{more}:{}", shown.concat()));
}

/// A text, or how a long one begins.
fn cut(text: &str, longest: usize) -> String {
    let mut short: String = text.chars().take(longest).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}

/// So many lines of a header, and so many characters of each line, are shown.
const MOST_HEADERS: usize = 6;
const LONGEST_LINE: usize = 160;

/// What stands above the first row of numbers, and that row.
struct Top {
    header: Vec<String>,
    row: Option<String>,
    second: String,
}

/// The top of a table; a header may have several lines, of which none names the columns alone.
fn top(file: &Path) -> Top {
    let bytes = std::fs::read(file).unwrap_or_default();
    let text = decode(&bytes).0;
    let lines: Vec<&str> = text.lines().map(str::trim_end).filter(|line| !line.is_empty()).collect();
    // numbers in a header stand alone
    let is_row = |line: &&str| numbers(line) >= 3 && 2 * numbers(line) > line.split([',', ';', '\t']).count();
    let row = lines.iter().position(is_row);
    let header = &lines[..row.unwrap_or(lines.len().min(1))];
    let shown = |line: &&str| cut(line.trim_start(), LONGEST_LINE);
    Top {
        header: header[header.len().saturating_sub(MOST_HEADERS)..].iter().map(shown).collect(),
        row: row.map(|row| lines[row].to_owned()),
        second: lines.get(1).map(|line| (*line).to_owned()).unwrap_or_default(),
    }
}

/// What some programs write that no column tells, and what to do.
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

/// What is said of a table in no known format.
pub(super) fn describe_columns(file: &Path, names: &[String], draft: &mut Draft) {
    let mut listed: Vec<String> =
        names.iter().take(MOST_COLUMNS).map(|name| quoted(&cut(name, LONGEST_COLUMN))).collect();
    if names.len() > MOST_COLUMNS {
        listed.push(format!("… ({} in all)", names.len()));
    }
    let top = top(file);
    let is_deep = top.header.len() > 1;
    let shown = if is_deep {
        format!("above its first row of numbers are {} lines", top.header.len())
    } else {
        format!("its first line is {}", listed.join(", "))
    };
    draft.find(format!(
        "{}: no known format; {shown}. Say under [tracks.columns] which column is what, by its name or by its number, from 1 on.",
        file.display(),
    ));
    if let Some(hint) = hint(names, &top.second) {
        draft.find(hint);
    }
    draft.line("\n[video]");
    draft.blank("capture_fps", "frames per second that the camera recorded at");
    draft.line("\n[scale]");
    draft.blank("length_unit", "m, cm, mm, in, ft, or px (the balls are then the ruler)");
    describe_y_axis(draft);
    draft.line("\n[tracks]");
    draft.noted("# cue = \"…\"", "only of a table with one row per ball and frame: its name of the cue ball");
    draft.noted(OBJECT, "and of the object ball");
    if is_deep {
        draft.line(format!("# Above the first row of numbers:\n#   {}", top.header.join("\n#   ")));
    } else {
        draft.line(format!("# The first line of the file:\n#   {}", listed.join(", ")));
    }
    if let Some(row) = &top.row {
        let separator = [';', '\t', ','].into_iter().find(|c| row.contains(*c)).unwrap_or(' ');
        let cells = row.split(separator).filter(|cell| separator != ' ' || !cell.is_empty());
        let numbered = cells.take(MOST_COLUMNS).enumerate();
        let numbered: Vec<String> =
            numbered.map(|(i, cell)| format!("{}: {}", i + 1, cut(cell.trim(), LONGEST_COLUMN))).collect();
        draft.line(format!(
            "# The first row of numbers, with the number of each column:\n#   {}",
            numbered.join("  ")
        ));
    }
    draft.line("[tracks.columns]              # a column by its name, t = \"time\", or by its number, t = 1");
    draft.blank_line(
        "which column is what",
        "# t = …",
        "time in seconds, or frame = …; without either, each row is a frame",
    );
    draft.line("# One row per frame:\n# cue_x = …\n# cue_y = …\n# object_x = …\n# object_y = …");
    draft.line("# Or one row per ball and frame:\n# ball = …\n# x = …\n# y = …");
}
