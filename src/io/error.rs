//! All problems of a data set at once.

use std::cell::RefCell;
use std::hash::Hash;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use indexmap::{IndexMap, IndexSet};

use crate::words::Sentences;

/// Maximum number of problems listed; the rest are counted.
const LISTED: usize = 20;
/// Maximum number of places of the same problem that are named.
const MAX_PLACES: usize = 3;

/// The words of problems and notes that do not fit a line of code.
pub(crate) static MESSAGES: LazyLock<Sentences> =
    LazyLock::new(|| Sentences::of(include_str!("messages.jinja")));

/// Returns the message of messages.jinja that has a name, with some values.
macro_rules! message {
    ($name:literal $(, $($values:tt)+)?) => {
        $crate::io::error::MESSAGES.sentence(minijinja::context! { message => $name, $($($values)+)? })
    };
}
pub(crate) use message;

/// A problem and its place.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}: {}", self.place(), self.said())]
pub struct Problem {
    /// The file that is wrong.
    pub file: PathBuf,
    /// The line, from 1, with every line of the file counted; `None` for the file as a whole.
    pub line: Option<usize>,
    /// The name of a table's column, or the position in a line of dataset.toml.
    pub column: Option<String>,
    /// The wrong value, and what was expected.
    pub message: String,
}

impl Problem {
    /// Returns a problem of a whole file.
    pub(crate) fn new(file: &Path, message: impl Into<String>) -> Self {
        Self { file: file.to_path_buf(), line: None, column: None, message: message.into() }
    }

    fn place(&self) -> String {
        let line = self.line.map_or(String::new(), |line| format!(":{line}"));
        format!("{}{line}", self.file.display())
    }

    /// Returns what is wrong at the place.
    fn said(&self) -> String {
        let column = self.column.as_ref().map_or(String::new(), |column| format!("column {column}: "));
        harmless(&(column + &self.message))
    }
}

/// Returns at most `lines` lines, in which each problem or note stands once, with at most `most` of
/// its places; `more` follows the number of the other lines.
fn lines_of<'p>(
    all: impl Iterator<Item = &'p Problem>,
    most: usize,
    lines: usize,
    more: &str,
) -> Vec<String> {
    let groups = grouped(all.map(|problem| (problem.said(), problem.place())));
    let others = groups.len().saturating_sub(lines);
    let others = (others > 0).then(|| format!("and {others} more{more}"));
    let line = |(said, places): (String, Vec<String>)| {
        let places: IndexSet<String> = places.into_iter().collect();
        let named: Vec<&str> = places.iter().take(most).map(String::as_str).collect();
        format!("{}{}: {said}", named.join(", "), and_more(places.len().saturating_sub(most)))
    };
    groups.into_iter().take(lines).map(line).chain(others).collect()
}

/// Returns a text with control characters escaped, which would act on a terminal.
pub(crate) fn harmless(text: &str) -> String {
    let is_harmful = |c: char| c.is_control() && c != '\n';
    text.chars().map(|c| if is_harmful(c) { c.escape_default().to_string() } else { c.to_string() }).collect()
}

/// A data set, or a table, that cannot be used as it is.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what}{}", self.listed())]
#[non_exhaustive]
pub struct DatasetError {
    what: String,
    problems: Vec<Problem>,
}

impl DatasetError {
    /// Every problem found.
    pub fn problems(&self) -> &[Problem] {
        &self.problems
    }

    /// Returns the problems, each in a line of its own.
    fn listed(&self) -> String {
        let lines = lines_of(self.problems.iter(), MAX_PLACES, LISTED, "");
        lines.iter().map(|line| format!("\n  {line}")).collect()
    }
}

/// Subject of a note, in the order of the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum Subject {
    /// A fault of one shot, which can be left out.
    Damage,
    Format,
    Clock,
    Swapped,
    Gaps,
    Names,
    Order,
    Repeated,
}

/// Problems, and notes about detections and repairs, as they are found.
#[derive(Debug, Default)]
pub(crate) struct Log {
    problems: RefCell<Vec<Problem>>,
    notes: RefCell<Vec<(Subject, Problem)>>,
}

impl Log {
    pub(crate) fn add<'a>(
        &self,
        file: &Path,
        line: impl Into<Option<usize>>,
        column: impl Into<Option<&'a str>>,
        message: impl Into<String>,
    ) {
        let (line, column) = (line.into(), column.into().map(str::to_string));
        self.problems.borrow_mut().push(Problem { line, column, ..Problem::new(file, message) });
    }

    pub(crate) fn note(
        &self,
        subject: Subject,
        file: &Path,
        line: impl Into<Option<usize>>,
        message: impl Into<String>,
    ) {
        let line = line.into();
        self.notes.borrow_mut().push((subject, Problem { line, ..Problem::new(file, message) }));
    }

    /// Adds the entries of another log; returns the damage among them.
    pub(crate) fn append(&self, other: Self) -> Vec<Problem> {
        let (damage, notes): (Vec<_>, Vec<_>) =
            other.notes.into_inner().into_iter().partition(|(subject, _)| *subject == Subject::Damage);
        self.problems.borrow_mut().extend(other.problems.into_inner());
        self.notes.borrow_mut().extend(notes);
        damage.into_iter().map(|(_, problem)| problem).collect()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the number of problems.
    pub(crate) fn len(&self) -> usize {
        self.problems.borrow().len()
    }

    /// Returns `value`, or the problems if there are any, which prevent `what`.
    pub(crate) fn into_result<T>(self, value: T, what: impl Into<String>) -> Result<T, DatasetError> {
        if self.is_empty() { Ok(value) } else { Err(self.into_error(what)) }
    }

    pub(crate) fn into_error(self, what: impl Into<String>) -> DatasetError {
        DatasetError { what: what.into(), problems: self.problems.into_inner() }
    }

    /// Returns each note once, with its first place and the number of others.
    pub(crate) fn notes(&self) -> Vec<String> {
        /// Maximum number of notes of a subject that are listed.
        const MAX_LISTED: usize = 8;
        let mut notes = self.notes.borrow().clone();
        notes.sort_by_key(|(subject, _)| *subject);
        let subjects = notes.chunk_by(|a, b| a.0 == b.0).map(|notes| notes.iter().map(|(_, note)| note));
        subjects.flat_map(|notes| lines_of(notes, 1, MAX_LISTED, " like this")).collect()
    }
}

/// Returns ` and 3 more`; an empty text for 0.
fn and_more(others: usize) -> String {
    if others > 0 { format!(" and {others} more") } else { String::new() }
}

pub(crate) fn quoted<S: AsRef<str>>(names: impl IntoIterator<Item = S>) -> String {
    let quoted: Vec<String> = names.into_iter().map(|name| format!("\"{}\"", name.as_ref())).collect();
    quoted.join(", ")
}

/// Returns the first of these names, and the number of the others.
pub(crate) fn listed<S: AsRef<str>>(names: &[S]) -> String {
    const MAX_NAMED: usize = 12;
    quoted(names.iter().take(MAX_NAMED)) + &and_more(names.len().saturating_sub(MAX_NAMED))
}

/// Returns the values of each key, in the order in which the keys appear.
pub(crate) fn grouped<K: Hash + Eq, V>(pairs: impl IntoIterator<Item = (K, V)>) -> IndexMap<K, Vec<V>> {
    let mut groups: IndexMap<K, Vec<V>> = IndexMap::new();
    for (key, value) in pairs {
        groups.entry(key).or_default().push(value);
    }
    groups
}

/// Returns the similarity in any case: Jaro–Winkler, plus 1 if one slip of the pen is between them.
fn similarity(word: &str, name: &str) -> f64 {
    let (word, name) = (word.to_lowercase(), name.to_lowercase());
    let one_slip = name.len() > 1 && strsim::damerau_levenshtein(&word, &name) <= 1;
    strsim::jaro_winkler(&word, &name) + f64::from(one_slip)
}

/// Returns ` (did you mean "throw_deg"?)`, or an empty text if no name is similar.
pub(crate) fn did_you_mean<'a>(word: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    /// Least similarity: less than that of a short word with two letters swapped.
    const MIN_SIMILARITY: f64 = 0.75;
    let near = names.into_iter().max_by(|a, b| similarity(word, a).total_cmp(&similarity(word, b)));
    let near = near.filter(|near| similarity(word, near) > MIN_SIMILARITY);
    near.map_or(String::new(), |name| format!(" (did you mean \"{name}\"?)"))
}
