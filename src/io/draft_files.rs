//! Which files a draft is about: tables in folders, and what lies beside them and is no table.

use std::path::{Path, PathBuf};

use super::draft_error::{InitError, TABLES};
use super::text::decode;

/// Of what is looked at where there is no table; ImageJ calls its tables .xls, OpenSim .trc, Tracker its projects .trk and .trz.
const OTHERS: [&str; 5] = ["json", "xls", "trc", "trk", "trz"];

/// Tables are looked for so many folders below the one that is named.
const DEPTH: usize = 2;

/// So many files of a frame each, with at most so many boxes, are no tables of shots.
const FRAMES: usize = 10;
const BOXES: usize = 20;
/// Fewer rows are no track.
const FEW: usize = 5;

/// How the names of files begin that tell of the data and are none.
const WORDS: [&str; 7] = ["readme", "read me", "license", "licence", "notes", "changelog", "copying"];

/// A row of a table of positions or measurements has so many numbers.
const NUMBERS: usize = 2;

/// So many rows of numbers make a table.
const ROWS: usize = 2;

/// The files, and in the place of a folder the tables in it or, where it holds none, those in its folders, or in theirs.
pub(super) fn listed(files: &[PathBuf]) -> Result<Vec<PathBuf>, InitError> {
    let mut all = Vec::new();
    for file in files {
        if !file.is_dir() {
            all.push(file.clone());
            continue;
        }
        let mut levels = vec![entries(file)?];
        for level in 0..DEPTH {
            let folders = levels[level].iter().filter(|path| path.is_dir() && !is_hidden(path));
            levels.push(folders.map(|folder| entries(folder)).collect::<Result<Vec<_>, _>>()?.concat());
        }
        let mut tables = levels
            .iter()
            .flat_map(|paths| [&TABLES[..], &OTHERS[..]].map(|endings| ending_with(paths, endings)));
        let Some(mut tables) = tables.find(|tables| !tables.is_empty()) else {
            return Err(InitError::NoTables { path: file.clone() });
        };
        tables.sort();
        all.append(&mut tables);
    }
    match all.as_slice() {
        [first, .., last] if all.len() >= FRAMES && [first, last].iter().all(|file| is_frame(file)) => {
            Err(InitError::Frames {
                folder: first.parent().map(Path::to_path_buf).unwrap_or_default(),
                count: all.len(),
                example: first.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            })
        }
        _ => Ok(all),
    }
}

/// Whether a file, which a number ends the name of, holds the boxes of a frame: class, x, y, width, height, and perhaps how sure that is.
fn is_frame(file: &Path) -> bool {
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    let Ok(text) = std::fs::read_to_string(file) else { return false };
    let class = |row: &str| {
        let first = row.split(' ').next()?.parse::<u32>().ok()?;
        (5..=7).contains(&numbers(row)).then_some(first)
    };
    let Some(classes) = text.lines().map(class).collect::<Option<Vec<u32>>>() else { return false };
    // numbers of frames count up through a track, which is longer than what is in one frame
    let counts = classes.len() > FEW && classes.is_sorted_by(|a, b| a < b);
    name.ends_with(|c: char| c.is_ascii_digit()) && (1..=BOXES).contains(&classes.len()) && !counts
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, InitError> {
    let read = folder.read_dir().map_err(|source| InitError::Read { path: folder.to_path_buf(), source })?;
    Ok(read.flatten().map(|entry| entry.path()).collect())
}

fn is_hidden(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'))
}

/// The tables among them, without what only tells of them.
fn ending_with(paths: &[PathBuf], endings: &[&str]) -> Vec<PathBuf> {
    let is_one = |path: &&PathBuf| {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        path.is_file() && endings.contains(&ending.as_str())
    };
    paths.iter().filter(is_one).cloned().collect()
}

/// Whether a file that is in no known format is obviously no table: by its name, or because it has no rows of numbers.
pub(super) fn is_no_table(file: &Path) -> bool {
    let name = file.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    if WORDS.iter().any(|word| name.starts_with(word)) {
        return true;
    }
    let Ok(bytes) = std::fs::read(file) else { return false };
    let text = decode(&bytes).0;
    text.split(['\n', '\r']).filter(|line| numbers(line) >= NUMBERS).take(ROWS).count() < ROWS
}

/// How many cells of a row are numbers, whatever separates them.
pub(super) fn numbers(row: &str) -> usize {
    let cells = row.split([',', ';', '\t', ' ', '|']);
    cells.filter(|cell| cell.trim_matches('"').parse::<f64>().is_ok()).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_numbers_are_told_from_prose() {
        for (row, count) in
            [("0;1,5;2", 4), ("0\t1.5\tx", 2), ("On 3 May we filmed.", 1), ("\"1\",\"2\"", 2), ("", 0)]
        {
            assert_eq!(numbers(row), count, "{row}");
        }
    }
}
