//! A file that is read, and the lists of problems and notes.

use std::path::Path;

use super::raw::{Log, Notes};
use super::settings::TrackSettings;
use crate::io::error::Problems;

/// Settings of dataset.toml for tracks, and the lists of problems and notes.
#[derive(Clone, Copy)]
pub(super) struct Context<'a> {
    pub settings: &'a TrackSettings,
    pub problems: &'a Problems,
    pub notes: &'a Notes,
}

/// A file for a reader, with the settings and the lists of problems and notes.
#[derive(Clone, Copy)]
pub(super) struct Input<'a> {
    pub file: &'a Path,
    pub text: &'a str,
    /// Name of the file without its ending: the default name of its shot.
    pub stem: &'a str,
    pub settings: &'a TrackSettings,
    pub problems: &'a Problems,
    /// Notes about the file.
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

    /// Returns whether numbers of frames are preferred to times: they need the right frame rate,
    /// but cannot follow a wrong one.
    pub(super) fn is_by_frame(&self) -> bool {
        self.settings.capture_fps.is_some()
    }
}

/// Returns the name of a file without its ending.
pub(super) fn stem(file: &Path) -> String {
    file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Returns names of tracks for sentences: `"A", "B"`.
pub(super) fn quoted<S: AsRef<str>>(names: impl IntoIterator<Item = S>) -> String {
    let quoted: Vec<String> = names.into_iter().map(|name| format!("\"{}\"", name.as_ref())).collect();
    quoted.join(", ")
}
