//! A file that is read, and what is said of it on the way.

use std::borrow::Cow;
use std::path::Path;

use super::raw::{Log, Notes, RawShot};
use super::settings::{TrackSettings, Unit};
use crate::io::error::Problems;
use crate::io::number::Place;

/// What a reader makes of a file: its shots, and the unit of its lengths, where the file or its format states it.
pub(super) type Shots = (Vec<RawShot>, Option<Unit>);

/// What dataset.toml says of tracks, and where problems and notes are put.
#[derive(Clone, Copy)]
pub(super) struct Context<'a> {
    pub settings: &'a TrackSettings,
    pub problems: &'a Problems,
    pub notes: &'a Notes,
}

/// A file that is read, and where its reader puts problems and notes.
#[derive(Clone, Copy)]
pub(super) struct Input<'a> {
    pub file: &'a Path,
    pub text: &'a str,
    /// Its name without what follows the last point: that of its shot, where nothing else names it.
    pub stem: &'a str,
    pub settings: &'a TrackSettings,
    pub problems: &'a Problems,
    /// For notes.
    pub log: Log<'a>,
}

impl Input<'_> {
    pub(super) fn wrong<'c>(
        &self,
        line: impl Into<Option<usize>>,
        column: impl Into<Option<&'c str>>,
        message: impl Into<String>,
    ) {
        self.problems.add(self.file, line, column, message);
    }

    /// Whether times are numbers of frames where a file has both: these cannot follow a wrong rate, but need the right one.
    pub(super) fn is_by_frame(&self) -> bool {
        self.settings.capture_fps.is_some()
    }
}

/// A row of a table.
pub(super) struct Row<'a> {
    pub line: usize,
    pub input: &'a Input<'a>,
    pub names: &'a [String],
    pub cells: &'a [Cow<'a, str>],
}

impl Row<'_> {
    pub(super) fn at(&self, column: usize) -> Place<'_> {
        let Input { file, problems, .. } = *self.input;
        Place { file, line: self.line, column: &self.names[column], text: &self.cells[column], problems }
    }

    pub(super) fn text(&self, column: usize) -> &str {
        &self.cells[column]
    }
}

/// The name of a file without what follows its last point.
pub(super) fn stem(file: &Path) -> String {
    file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Names of tracks for sentences: `"A", "B"`.
pub(super) fn quoted<S: AsRef<str>>(names: impl IntoIterator<Item = S>) -> String {
    let quoted: Vec<String> = names.into_iter().map(|name| format!("\"{}\"", name.as_ref())).collect();
    quoted.join(", ")
}
