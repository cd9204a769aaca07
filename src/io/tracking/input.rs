//! A file that is read, and the lists of problems and notes.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;

use indexmap::IndexMap;

use super::settings::TrackSettings;
use crate::io::error::{Problems, harmless};

/// Settings of dataset.toml for tracks, and the lists of problems and notes.
#[derive(Clone, Copy)]
pub(super) struct Context<'a> {
    pub(crate) settings: &'a TrackSettings,
    pub(crate) problems: &'a Problems,
    pub(crate) notes: &'a Notes,
}

/// A file for a reader, with the settings and the lists of problems and notes.
#[derive(Clone, Copy)]
pub(super) struct Input<'a> {
    pub(crate) file: &'a Path,
    pub(crate) text: &'a str,
    /// Name of the file without its ending: the default name of its shot.
    pub(crate) stem: &'a str,
    pub(crate) settings: &'a TrackSettings,
    pub(crate) problems: &'a Problems,
    /// Notes about the file.
    pub(crate) log: Log<'a>,
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

pub(super) fn stem(file: &Path) -> String {
    file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

pub(super) fn quoted<S: AsRef<str>>(names: impl IntoIterator<Item = S>) -> String {
    let quoted: Vec<String> = names.into_iter().map(|name| format!("\"{}\"", name.as_ref())).collect();
    quoted.join(", ")
}

/// Subject of a note, in the order of the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Subject {
    Format,
    Clock,
    Swapped,
    Gaps,
    Names,
    Order,
    Repeated,
}

/// Notes about detections and repairs: the first few of each subject, and the number of others.
#[derive(Debug, Default)]
pub(super) struct Notes(RefCell<BTreeMap<Subject, IndexMap<String, Places>>>);

/// The places of a note: the first one, and their number.
#[derive(Clone, Debug)]
struct Places {
    first: String,
    count: usize,
}

/// Notes about one file.
#[derive(Clone, Copy)]
pub(super) struct Log<'a> {
    file: &'a Path,
    notes: &'a Notes,
}

impl Log<'_> {
    pub(super) fn add(self, subject: Subject, line: impl Into<Option<usize>>, message: impl AsRef<str>) {
        let line = line.into().map_or(String::new(), |line| format!(":{line}"));
        let first = format!("{}{line}", self.file.display());
        let message = harmless(message.as_ref()).into_owned();
        self.notes.put(subject, message, Places { first, count: 1 });
    }
}

impl Notes {
    pub(super) fn of<'a>(&'a self, file: &'a Path) -> Log<'a> {
        Log { file, notes: self }
    }

    fn put(&self, subject: Subject, message: String, places: Places) {
        let mut subjects = self.0.borrow_mut();
        let notes = subjects.entry(subject).or_default();
        match notes.get_mut(&message) {
            Some(known) if known.first == places.first => {}
            Some(known) => known.count += places.count,
            None => _ = notes.insert(message, places),
        }
    }

    pub(super) fn append(&self, other: Self) {
        for (subject, notes) in other.0.into_inner() {
            for (message, places) in notes {
                self.put(subject, message, places);
            }
        }
    }

    pub(super) fn into_lines(self) -> Vec<String> {
        /// Maximum number of notes of a subject that are listed.
        const MAX_LISTED: usize = 8;
        let mut lines = Vec::new();
        for notes in self.0.into_inner().into_values() {
            for (message, Places { first, count }) in notes.iter().take(MAX_LISTED) {
                let others = if *count > 1 { format!(" and {} more", count - 1) } else { String::new() };
                lines.push(format!("{first}{others}: {message}"));
            }
            if notes.len() > MAX_LISTED {
                lines.push(format!("and {} more like this", notes.len() - MAX_LISTED));
            }
        }
        lines
    }
}
