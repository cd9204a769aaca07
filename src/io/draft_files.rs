//! The files of a draft: tables in folders, without other files beside them, and their content.

use std::path::{Path, PathBuf};

use glob::{MatchOptions, Pattern, glob_with};

use super::error::Problem;
use super::table::separator;
use super::text::{Separator, decode, filled_lines, trimmed, without_separator_line};
use super::tracking::shots_table::KNOWN;
use super::tracking::{Survey, TRACKER_PROJECT, is_tracker_project};

/// Endings of tables, if a folder is named.
const TABLES: [&str; 4] = ["csv", "txt", "tsv", "dat"];

/// Endings of files considered if tables are missing; ImageJ calls its tables .xls, OpenSim .trc,
/// Tracker its projects .trk and .trz.
const OTHER_ENDINGS: [&str; 5] = ["json", "xls", "trc", "trk", "trz"];

/// Least number of one-frame files that are not tables of shots, and maximum of boxes in each.
const FRAMES: usize = 10;
const BOXES: usize = 5;

/// Least number of rows of a table, and of numbers in each.
const ROWS: usize = 2;
const NUMBERS: usize = 2;

/// The content of a file.
pub(super) struct Seen {
    pub(super) file: PathBuf,
    /// `tracks`, `impacts` or `angles`.
    pub(super) kind: &'static str,
    /// `None` for a table of impacts or angles, or of unknown columns.
    pub(super) survey: Option<Survey>,
    pub(super) has_spins: bool,
}

pub(super) fn refused(file: &Path, message: impl Into<String>) -> Problem {
    Problem { file: file.to_path_buf(), line: None, column: None, message: message.into() }
}

/// Returns the files; a folder is replaced by its tables.
pub(super) fn listed(files: &[PathBuf]) -> Result<Vec<PathBuf>, Problem> {
    let each = files.iter().map(|file| if file.is_dir() { tables(file) } else { Ok(vec![file.clone()]) });
    let all = each.collect::<Result<Vec<_>, _>>()?.concat();
    if let [first, .., last] = all.as_slice()
        && all.len() >= FRAMES
        && is_frame(first)
        && is_frame(last)
    {
        let name = first.file_name().unwrap_or_default().to_string_lossy();
        let count = all.len();
        let message = format!(
            "{count} files like {name} hold one frame each, as YOLO writes them. Expected one table per shot: join its files below a \
             line frame class x_center y_center width height, with the number of the frame in each row and lengths in pixels"
        );
        return Err(refused(first.parent().unwrap_or(first), message));
    }
    Ok(all)
}

/// Returns the tables in a folder or, if it lacks tables, in its subfolders, or in theirs.
fn tables(folder: &Path) -> Result<Vec<PathBuf>, Problem> {
    let options =
        MatchOptions { case_sensitive: false, require_literal_leading_dot: true, ..MatchOptions::new() };
    let escaped = PathBuf::from(Pattern::escape(&folder.to_string_lossy()));
    for depth in ["", "*/", "*/*/"] {
        for endings in [&TABLES[..], &OTHER_ENDINGS[..]] {
            let patterns = endings.iter().map(|ending| escaped.join(format!("{depth}*.{ending}")));
            let paths = patterns.flat_map(|pattern| glob_with(&pattern.to_string_lossy(), options));
            let mut tables: Vec<PathBuf> = paths.flatten().flatten().filter(|path| path.is_file()).collect();
            if !tables.is_empty() {
                tables.sort();
                return Ok(tables);
            }
        }
    }
    let message =
        "holds no table (a file that ends in .csv, .txt, .tsv or .dat); save a workbook's sheet as CSV";
    Err(refused(folder, message))
}

/// Returns whether a file, whose name ends in a number, holds the boxes of a frame: class, x, y,
/// width, height, and perhaps a confidence.
fn is_frame(file: &Path) -> bool {
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    let text = std::fs::read_to_string(file).unwrap_or_default();
    let are_boxes = text.lines().all(|row| (5..=7).contains(&numbers(row)));
    name.ends_with(|c: char| c.is_ascii_digit()) && (1..=BOXES).contains(&text.lines().count()) && are_boxes
}

/// Returns whether a file is obviously not a table: it has few rows of numbers.
fn is_no_table(file: &Path) -> bool {
    let Ok(bytes) = std::fs::read(file) else { return false };
    let text = decode(&bytes).0;
    text.split(['\n', '\r']).filter(|line| numbers(line) >= NUMBERS).take(ROWS).count() < ROWS
}

fn numbers(row: &str) -> usize {
    let cells = row.split([',', ';', '\t', ' ', '|']);
    cells.filter(|cell| cell.trim_matches('"').parse::<f64>().is_ok()).count()
}

/// Returns the files of one kind; obviously wrong or empty ones are left out if others remain.
pub(super) fn look_at(files: &[PathBuf], found: &mut Vec<String>) -> Result<Vec<Seen>, Problem> {
    let (mut seen, mut unclear) = (Vec::new(), Vec::new());
    for file in files {
        let now = look(file);
        let is_unclear = match &now {
            Ok(Seen { survey: Some(survey), .. }) => survey.is_empty(),
            Ok(now) => now.kind == "tracks" && is_no_table(file),
            Err(_) => is_no_table(file),
        };
        if is_unclear { unclear.push((file, now)) } else { seen.push(now?) }
    }
    for (file, now) in unclear {
        if seen.iter().all(|seen| seen.survey.is_none() && seen.kind == "tracks") {
            seen.push(now?);
        } else {
            let why = "no table of positions or measurements, or one without rows; left out";
            found.push(format!("{}: {why}.", file.display()));
        }
    }
    let what = |seen: &Seen| match (seen.kind, &seen.survey) {
        ("tracks", None) => "in no known format".to_owned(),
        (kind, _) => format!("of kind {kind}"),
    };
    if let [first, others @ ..] = seen.as_slice()
        && let Some(other) = others.iter().find(|other| what(other) != what(first))
    {
        let (file, own, other_is) = (first.file.display(), what(first), what(other));
        let message = format!("is {other_is}, but {file} is {own}; expected files of one data set");
        return Err(refused(&other.file, message));
    }
    Ok(seen)
}

fn look(file: &Path) -> Result<Seen, Problem> {
    let bytes = std::fs::read(file).map_err(|error| refused(file, format!("cannot be read: {error}")))?;
    let names = header(&bytes);
    let is_odd = |c: char| c == char::REPLACEMENT_CHARACTER || c.is_control();
    if is_tracker_project(file, &decode(&bytes).0) {
        return Err(refused(file, TRACKER_PROJECT));
    } else if names.iter().all(String::is_empty) {
        return Err(refused(file, "is empty; expected a table of tracks or measurements"));
    } else if names.iter().any(|name| name.contains(is_odd)) {
        let message = "is not text; expected a table of tracks or measurements, not the film itself, nor a workbook (save its sheet \
                       as CSV)";
        return Err(refused(file, message));
    }
    let has = |name: &str| names.iter().any(|own| own == name);
    let seen = Seen { file: file.to_path_buf(), kind: "tracks", survey: None, has_spins: false };
    if has("nx") && has("ny") && has("cue_vx") {
        return Ok(Seen { kind: "impacts", ..seen });
    } else if has("cut_deg") {
        return Ok(Seen { kind: "angles", has_spins: has("cue_spin") || has("omega_x"), ..seen });
    }
    match Survey::of(file) {
        Err(problems) if names[0].starts_with(['{', '[']) => {
            let why = problems.first().map_or(String::new(), |first| first.to_string());
            let what = "expected a table of tracks or measurements, or an array of shots in JSON";
            Err(refused(file, format!("cannot be read; {what}\n  {why}")))
        }
        survey => Ok(Seen { survey: survey.ok(), ..seen }),
    }
}

pub(super) fn is_shots_table(file: &Path) -> bool {
    let names = header(&std::fs::read(file).unwrap_or_default());
    let has = |name: &str| names.iter().any(|own| own == name);
    has("shot") && KNOWN.split(' ').skip(1).any(has) && !["cut_deg", "nx", "x"].into_iter().any(has)
}

/// Returns the names of the columns in the first line that is not blank or a comment.
fn header(bytes: &[u8]) -> Vec<String> {
    let (text, stated) = without_separator_line(decode(bytes).0);
    let mut lines = filled_lines(&text).map(|(_, line)| line);
    let first = lines.clone().find(|line| !line.trim_start().starts_with('#'));
    let first = first.or_else(|| lines.next()).unwrap_or_default();
    let separator = Separator::Char(stated.unwrap_or_else(|| separator(first)));
    trimmed(first, separator).unwrap_or_else(|| vec![first.to_string()])
}
