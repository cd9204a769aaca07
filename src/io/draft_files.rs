//! The files of a draft: tables in folders, without other files beside them, and their content.

use std::path::{Path, PathBuf};

use super::draft_text::{Draft, InitError};
use super::text::decode;
use super::tracking::shots_table::KNOWN;
use super::tracking::{TRACKER_PROJECT, is_tracker_project};
use super::{Survey, header, survey};

/// Endings of tables, if a folder is named.
const TABLES: [&str; 4] = ["csv", "txt", "tsv", "dat"];

/// Endings of files considered if there is no table; ImageJ calls its tables .xls, OpenSim .trc,
/// Tracker its projects .trk and .trz.
const OTHER_ENDINGS: [&str; 5] = ["json", "xls", "trc", "trk", "trz"];

/// Maximum depth below the named folder at which tables are searched for.
const MAX_DEPTH: usize = 2;

/// Least number of one-frame files that are not tables of shots, and maximum of boxes in each.
const FRAMES: usize = 10;
const BOXES: usize = 20;
/// Maximum number of rows that are not a track.
const MAX_UNTRACKED_ROWS: usize = 5;

/// Beginnings of names of files about the data that are not tables.
const TEXT_NAMES: [&str; 7] = ["readme", "read me", "license", "licence", "notes", "changelog", "copying"];

/// Least number of rows of a table, and of numbers in each.
const ROWS: usize = 2;
const NUMBERS: usize = 2;

/// The content of a file.
pub(super) enum Seen {
    Tracks(Box<Survey>),
    Impacts,
    /// Whether it has columns of spins.
    Angles(bool),
    /// A table of unknown columns.
    Unknown,
}

impl Seen {
    pub(super) fn kind(&self) -> (&'static str, &'static str) {
        match self {
            Self::Tracks(_) => ("tracks", "a file of tracks"),
            Self::Impacts => ("impacts", "a table of impacts"),
            Self::Angles(_) => ("angles", "a table of angles"),
            Self::Unknown => ("tracks", "in no known format"),
        }
    }

    fn is_empty(&self) -> bool {
        matches!(self, Self::Tracks(survey) if survey.tracks.is_empty() && survey.problems.is_empty())
    }
}

/// Returns the files; a folder is replaced by its tables or, if it has none, by those of its
/// subfolders, down to [`MAX_DEPTH`].
pub(super) fn listed(files: &[PathBuf]) -> Result<Vec<PathBuf>, InitError> {
    let mut all = Vec::new();
    for file in files {
        if !file.is_dir() {
            all.push(file.clone());
            continue;
        }
        let mut levels = vec![entries(file)?];
        for level in 0..MAX_DEPTH {
            let is_hidden =
                |path: &Path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
            let folders = levels[level].iter().filter(|path| path.is_dir() && !is_hidden(path));
            levels.push(folders.map(|folder| entries(folder)).collect::<Result<Vec<_>, _>>()?.concat());
        }
        let endings = [&TABLES[..], &OTHER_ENDINGS[..]];
        let mut tables = levels.iter().flat_map(|paths| endings.map(|endings| ending_with(paths, endings)));
        let Some(mut tables) = tables.find(|tables| !tables.is_empty()) else {
            let message = format!(
                "holds no table (a file that ends in .{}); name the files, and save a workbook's sheet as CSV",
                TABLES.join(", .")
            );
            return Err(InitError::new(file, message));
        };
        tables.sort();
        all.append(&mut tables);
    }
    if let [first, .., last] = all.as_slice()
        && all.len() >= FRAMES
        && is_frame(first)
        && is_frame(last)
    {
        let name = first.file_name().unwrap_or_default().to_string_lossy();
        let message = format!(
            "{} files like {name} hold one frame each, as YOLO writes them. Expected one table per shot: join its files below a line \
             frame class x_center y_center width height, with the number of the frame in each row and lengths in pixels",
            all.len()
        );
        return Err(InitError::new(first.parent().unwrap_or(first), message));
    }
    Ok(all)
}

/// Returns whether a file, whose name ends in a number, holds the boxes of a frame: class, x, y,
/// width, height, and perhaps a confidence.
fn is_frame(file: &Path) -> bool {
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    let Ok(text) = std::fs::read_to_string(file) else { return false };
    let class = |row: &str| {
        let first = row.split(' ').next()?.parse::<u32>().ok()?;
        (5..=7).contains(&numbers(row)).then_some(first)
    };
    let Some(classes) = text.lines().map(class).collect::<Option<Vec<u32>>>() else { return false };
    // frame numbers increase through a track, which has more rows than a frame has boxes
    let counts = classes.len() > MAX_UNTRACKED_ROWS && classes.is_sorted_by(|a, b| a < b);
    name.ends_with(|c: char| c.is_ascii_digit()) && (1..=BOXES).contains(&classes.len()) && !counts
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, InitError> {
    let read = folder.read_dir().map_err(|error| InitError::unread(folder, &error))?;
    Ok(read.flatten().map(|entry| entry.path()).collect())
}

fn ending_with(paths: &[PathBuf], endings: &[&str]) -> Vec<PathBuf> {
    let is_one = |path: &&PathBuf| {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        path.is_file() && endings.contains(&ending.as_str())
    };
    paths.iter().filter(is_one).cloned().collect()
}

/// Returns whether a file is obviously not a table, by its name or without rows of numbers.
fn is_no_table(file: &Path) -> bool {
    let name = file.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    if TEXT_NAMES.iter().any(|word| name.starts_with(word)) {
        return true;
    }
    let Ok(bytes) = std::fs::read(file) else { return false };
    let text = decode(&bytes).0;
    text.split(['\n', '\r']).filter(|line| numbers(line) >= NUMBERS).take(ROWS).count() < ROWS
}

pub(super) fn numbers(row: &str) -> usize {
    let cells = row.split([',', ';', '\t', ' ', '|']);
    cells.filter(|cell| cell.trim_matches('"').parse::<f64>().is_ok()).count()
}

/// Returns the files of one kind; obviously wrong or empty ones are left out if others remain.
pub(super) fn look_at(files: &[PathBuf], draft: &mut Draft) -> Result<Vec<(PathBuf, Seen)>, InitError> {
    let (mut seen, mut unclear): (Vec<(PathBuf, Seen)>, Vec<_>) = (Vec::new(), Vec::new());
    for file in files {
        let now = look(file);
        let is_unclear = match &now {
            Ok(now) => now.is_empty() || matches!(now, Seen::Unknown) && is_no_table(file),
            Err(_) => is_no_table(file),
        };
        if is_unclear { unclear.push((file, now)) } else { seen.push((file.clone(), now?)) }
    }
    for (file, now) in unclear {
        if seen.iter().all(|(_, seen)| matches!(seen, Seen::Unknown)) {
            seen.push((file.clone(), now?));
        } else {
            let why = "no table of positions or measurements, or one without rows; left out";
            draft.find(format!("{}: {why}.", file.display()));
        }
    }
    if let Some((other_path, other)) = seen.first()
        && let Some((path, now)) = seen.iter().find(|(_, now)| now.kind() != other.kind())
    {
        let [(_, what), (_, other)] = [now, other].map(Seen::kind);
        let other_path = other_path.display();
        let message = format!(
            "is {what}, but {other_path} is {other}; expected files of one kind: name those of one data set"
        );
        return Err(InitError::new(path, message));
    }
    Ok(seen)
}

fn look(file: &Path) -> Result<Seen, InitError> {
    let bytes = std::fs::read(file).map_err(|error| InitError::unread(file, &error))?;
    if is_tracker_project(file, &decode(&bytes).0) {
        return Err(InitError::new(file, TRACKER_PROJECT));
    }
    let names = header(file).map_err(|error| InitError::unread(file, &error))?;
    if names.is_empty() {
        return Err(InitError::new(file, "is empty; expected a table of tracks or measurements"));
    }
    if names.iter().any(|name| name.contains(|c: char| c == char::REPLACEMENT_CHARACTER || c.is_control())) {
        let message = "is not text; expected a table of tracks or measurements, not the film itself, nor a workbook (save its sheet \
                       as CSV)";
        return Err(InitError::new(file, message));
    }
    let has = |name: &str| names.iter().any(|n| n == name);
    if has("nx") && has("ny") && has("cue_vx") {
        return Ok(Seen::Impacts);
    }
    if has("cut_deg") {
        return Ok(Seen::Angles(has("cue_spin") || has("omega_x")));
    }
    match survey(file) {
        Ok(survey) => Ok(Seen::Tracks(Box::new(survey))),
        Err(problems) if names.first().is_some_and(|name| name.starts_with(['{', '['])) => {
            let why = problems.first().map_or(String::new(), |first| first.to_string());
            let message =
                format!("is JSON; expected a table of tracks or measurements, or an array of shots\n  {why}");
            Err(InitError::new(file, message))
        }
        Err(_) => Ok(Seen::Unknown),
    }
}

pub(super) fn is_shots_table(file: &Path) -> bool {
    let names = header(file).unwrap_or_default();
    let has = |name: &str| names.iter().any(|own| own == name);
    has("shot") && KNOWN[1..].iter().any(|known| has(known)) && !["cut_deg", "nx", "x"].into_iter().any(has)
}
