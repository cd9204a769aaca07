//! A file that is read, and the lists of problems and notes.

use std::cell::RefCell;
use std::path::Path;

use indexmap::IndexMap;

use super::settings::TrackSettings;
use crate::io::error::{Problems, harmless};

/// A file that is read, or a shot of it, with the settings and the list of notes.
#[derive(Clone, Copy)]
pub(super) struct Job<'a> {
    pub(crate) file: &'a Path,
    pub(crate) settings: &'a TrackSettings,
    pub(crate) notes: &'a Notes,
}

impl Job<'_> {
    pub(super) fn note(self, subject: Subject, line: impl Into<Option<usize>>, message: impl AsRef<str>) {
        self.notes.add(self.file, subject, line, message);
    }
}

/// The text of a file for a reader.
#[derive(Clone, Copy)]
pub(super) struct Input<'a> {
    pub(crate) job: Job<'a>,
    pub(crate) text: &'a str,
    /// Name of the file without its ending: the default name of its shot.
    pub(crate) stem: &'a str,
    pub(crate) problems: &'a Problems,
}

impl Input<'_> {
    pub(super) fn wrong<'c>(
        &self,
        line: impl Into<Option<usize>>,
        column: impl Into<Option<&'c str>>,
        message: impl Into<String>,
    ) {
        self.problems.add(self.job.file, line, column, message);
    }

    /// Notes a position of which one coordinate is missing: it is a gap.
    pub(super) fn note_half(&self, place: [f64; 2], line: usize) {
        if place[0].is_nan() != place[1].is_nan() {
            self.job.note(Subject::Gaps, line, "half a position; taken as a gap");
        }
    }

    /// Returns the column to be read, and whether it holds numbers of frames: these are preferred
    /// if the frame rate is stated, since they cannot follow a wrong one.
    pub(super) fn frame_or_time<T>(&self, frame: Option<T>, time: Option<T>) -> Option<(T, bool)> {
        let frame = frame.filter(|_| time.is_none() || self.job.settings.fps().is_some());
        frame.map(|frame| (frame, true)).or(time.map(|time| (time, false)))
    }
}

pub(super) fn stem(file: &Path) -> String {
    file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

pub(super) fn quoted<S: AsRef<str>>(names: impl IntoIterator<Item = S>) -> String {
    let quoted: Vec<String> = names.into_iter().map(|name| format!("\"{}\"", name.as_ref())).collect();
    quoted.join(", ")
}

/// Returns the first of these names, and the number of the others.
pub(super) fn listed<S: AsRef<str>>(names: &[S]) -> String {
    const MAX_NAMED: usize = 12;
    quoted(names.iter().take(MAX_NAMED)) + &and_more(names.len().saturating_sub(MAX_NAMED))
}

fn and_more(others: usize) -> String {
    if others > 0 { format!(" and {others} more") } else { String::new() }
}

/// Subject of a note, in the order of the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum Subject {
    Format,
    Clock,
    Swapped,
    Gaps,
    Names,
    Order,
    Repeated,
}

/// Notes about detections and repairs, each once, with its first place and the number of places.
#[derive(Debug, Default)]
pub(super) struct Notes(RefCell<IndexMap<(Subject, String), (String, usize)>>);

impl Notes {
    pub(super) fn add(
        &self,
        file: &Path,
        subject: Subject,
        line: impl Into<Option<usize>>,
        message: impl AsRef<str>,
    ) {
        let line = line.into().map_or(String::new(), |line| format!(":{line}"));
        let message = harmless(message.as_ref()).into_owned();
        self.put((subject, message), format!("{}{line}", file.display()), 1);
    }

    fn put(&self, note: (Subject, String), first: String, count: usize) {
        let mut notes = self.0.borrow_mut();
        let (known, places) = notes.entry(note).or_insert_with(|| (first.clone(), 0));
        if *places == 0 || *known != first {
            *places += count;
        }
    }

    pub(super) fn append(&self, other: Self) {
        for (note, (first, count)) in other.0.into_inner() {
            self.put(note, first, count);
        }
    }

    pub(super) fn into_lines(self) -> Vec<String> {
        /// Maximum number of notes of a subject that are listed.
        const MAX_LISTED: usize = 8;
        let mut notes: Vec<_> = self.0.into_inner().into_iter().collect();
        notes.sort_by_key(|((subject, _), _)| *subject);
        let mut lines = Vec::new();
        for notes in notes.chunk_by(|a, b| a.0.0 == b.0.0) {
            for ((_, message), (first, count)) in notes.iter().take(MAX_LISTED) {
                lines.push(format!("{first}{}: {message}", and_more(count - 1)));
            }
            if notes.len() > MAX_LISTED {
                lines.push(format!("and {} more like this", notes.len() - MAX_LISTED));
            }
        }
        lines
    }
}
