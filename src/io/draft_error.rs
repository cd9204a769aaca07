//! Why no data set can be drafted.

use std::path::PathBuf;

use super::tracking::TRACKER_PROJECT;

/// Endings of tables, where a folder is named.
pub(super) const TABLES: [&str; 4] = ["csv", "txt", "tsv", "dat"];

/// Joins files of one frame each, whose names end in its number.
const JOIN: &str = "awk -v W=1920 -v H=1080 'BEGIN {print \"frame class x_center y_center width height\"} \
                    {n = FILENAME; sub(/\\.[^.]*$/, \"\", n); sub(/.*[^0-9]/, \"\", n); print n+0, $1, $2*W, $3*H, $4*W, $5*H}' \
                    *.txt > ../shot1.dat";

/// Why no dataset.toml can be drafted.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InitError {
    /// A file cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why it cannot be read.
        source: std::io::Error,
    },
    /// A file is empty.
    #[error("{}: is empty; expected a table of tracks or measurements", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// A file is no text.
    #[error("{}: is no text; expected a table of tracks or measurements, not the film itself, nor a workbook (save its sheet as CSV)", path.display())]
    NoText {
        /// The file.
        path: PathBuf,
    },
    /// A file is a project of Tracker.
    #[error("{}: {TRACKER_PROJECT}", path.display())]
    TrackerProject {
        /// The file.
        path: PathBuf,
    },
    /// A file is JSON of another kind than shots with balls and samples.
    #[error(
        "{}: is JSON; expected a table (CSV, tab-separated or text) of tracks or measurements, or an array of shots, each with balls, \
         each with samples of t (or frame), x and y\n  {why}",
        path.display()
    )]
    Json {
        /// The file.
        path: PathBuf,
        /// What is wrong with it as an array of shots.
        why: String,
    },
    /// A folder holds no table.
    #[error("{}: holds no table (a file that ends in .{}); name the files, and save a workbook's sheet as CSV", path.display(), TABLES.join(", ."))]
    NoTables {
        /// The folder.
        path: PathBuf,
    },
    /// Every file holds the boxes of one frame.
    #[error(
        "{}: {count} files like {example} hold one frame each, as YOLO writes them: class, x, y, width, height. Expected one table per \
         shot, with the frame in each row: join the files of each shot, here of a picture of 1920 by 1080 pixels, in their folder by\n  {JOIN}\n\
         (x and y in pixels already: W=1 and H=1), then caromfit init on the folder of the tables",
        folder.display()
    )]
    Frames {
        /// The folder of the first files.
        folder: PathBuf,
        /// How many files there are.
        count: usize,
        /// The name of the first one.
        example: String,
    },
    /// The files are of different kinds.
    #[error("{} is {what}, but {} is {other}; expected files of one kind: name those of one data set", path.display(), other_path.display())]
    Mixed {
        /// The file that differs from the first one.
        path: PathBuf,
        /// Its kind, in words.
        what: &'static str,
        /// The first file.
        other_path: PathBuf,
        /// Its kind, in words.
        other: &'static str,
    },
}
