//! Which files a draft is about: tables in folders, and what lies beside them and is no table.

use std::path::{Path, PathBuf};

use super::draft_text::InitError;
use super::text::decode;

/// Endings of tables, if a folder is named.
const TABLES: [&str; 4] = ["csv", "txt", "tsv", "dat"];

/// Endings of files that are looked at if there is no table; ImageJ calls its tables .xls, OpenSim
/// .trc, Tracker its projects .trk and .trz.
const OTHERS: [&str; 5] = ["json", "xls", "trc", "trk", "trz"];

/// Number of folders below the named one in which tables are looked for.
const DEPTH: usize = 2;

/// Least number of files of one frame each, and most boxes in one, that are not tables of shots.
const FRAMES: usize = 10;
const BOXES: usize = 20;
/// Most rows that are not a track.
const FEW: usize = 5;

/// How the names of files begin that tell of the data and are no tables.
const WORDS: [&str; 7] = ["readme", "read me", "license", "licence", "notes", "changelog", "copying"];

/// Least number of rows of a table, and of numbers in each.
const ROWS: usize = 2;
const NUMBERS: usize = 2;

/// Returns the files, and in the place of a folder the tables in it or, if it holds none, those in
/// its folders, or in theirs.
pub(super) fn listed(files: &[PathBuf]) -> Result<Vec<PathBuf>, InitError> {
    let mut all = Vec::new();
    for file in files {
        if !file.is_dir() {
            all.push(file.clone());
            continue;
        }
        let mut levels = vec![entries(file)?];
        for level in 0..DEPTH {
            let is_hidden =
                |path: &Path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
            let folders = levels[level].iter().filter(|path| path.is_dir() && !is_hidden(path));
            levels.push(folders.map(|folder| entries(folder)).collect::<Result<Vec<_>, _>>()?.concat());
        }
        let endings = [&TABLES[..], &OTHERS[..]];
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
        let message = format!(
            "{} files like {} hold one frame each, as YOLO writes them: class, x, y, width, height. Expected one table per \
             shot: join the files of each shot below a line frame class x_center y_center width height, with the number of its \
             frame in each row and lengths times the width and height of the picture in pixels",
            all.len(),
            first.file_name().unwrap_or_default().to_string_lossy()
        );
        return Err(InitError::new(first.parent().unwrap_or(first), message));
    }
    Ok(all)
}

/// Returns whether a file, whose name ends in a number, holds the boxes of a frame: class, x, y,
/// width, height, and perhaps how sure that is.
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
    let read = folder.read_dir().map_err(|error| InitError::unread(folder, &error))?;
    Ok(read.flatten().map(|entry| entry.path()).collect())
}

/// Returns the files among paths that have one of these endings.
fn ending_with(paths: &[PathBuf], endings: &[&str]) -> Vec<PathBuf> {
    let is_one = |path: &&PathBuf| {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        path.is_file() && endings.contains(&ending.as_str())
    };
    paths.iter().filter(is_one).cloned().collect()
}

/// Returns whether a file that is in no known format is obviously no table: by its name, or because
/// it has no rows of numbers.
pub(super) fn is_no_table(file: &Path) -> bool {
    let name = file.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    if WORDS.iter().any(|word| name.starts_with(word)) {
        return true;
    }
    let Ok(bytes) = std::fs::read(file) else { return false };
    let text = decode(&bytes).0;
    text.split(['\n', '\r']).filter(|line| numbers(line) >= NUMBERS).take(ROWS).count() < ROWS
}

/// Returns the number of cells of a row that are numbers, whatever separates them.
pub(super) fn numbers(row: &str) -> usize {
    let cells = row.split([',', ';', '\t', ' ', '|']);
    cells.filter(|cell| cell.trim_matches('"').parse::<f64>().is_ok()).count()
}
