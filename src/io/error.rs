//! All problems of a data set at once.

use std::cell::RefCell;
use std::fmt;
use std::hash::Hash;
use std::path::{Path, PathBuf};

use indexmap::IndexMap;

/// Maximum number of problems listed; the rest are counted.
const LISTED: usize = 20;
/// Maximum number of other places of the same problem that are named.
const MAX_NAMED: usize = 2;

/// A problem and its place.
#[derive(Clone, Debug, PartialEq)]
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
    fn place(&self) -> String {
        let line = self.line.map_or(String::new(), |line| format!(":{line}"));
        format!("{}{line}", self.file.display())
    }
}

impl std::error::Error for Problem {}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.place())?;
        if let Some(column) = &self.column {
            write!(f, "column {}: ", harmless(column))?;
        }
        f.write_str(&harmless(&self.message))
    }
}

/// Returns a text with control characters escaped, which would act on a terminal.
pub(crate) fn harmless(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_control() && c != '\n' { shown.extend(c.escape_default()) } else { shown.push(c) }
    }
    shown
}

/// A data set, or a table, that cannot be used as it is.
#[derive(Clone, Debug, PartialEq)]
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
}

impl std::error::Error for DatasetError {}

impl fmt::Display for DatasetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.what)?;
        // the same problem in other places is listed once
        let groups =
            grouped(self.problems.iter().map(|problem| ((&problem.message, &problem.column), problem)));
        for group in groups.values().take(LISTED) {
            write!(f, "\n  {}", group[0])?;
            let named: Vec<String> = group[1..].iter().take(MAX_NAMED).map(|other| other.place()).collect();
            if !named.is_empty() {
                write!(f, "\n    the same in {}", named.join(", "))?;
            }
            if group.len() > 1 + MAX_NAMED {
                write!(f, " and {} more", group.len() - 1 - MAX_NAMED)?;
            }
        }
        let more: usize = groups.values().skip(LISTED).map(Vec::len).sum();
        if more > 0 {
            write!(f, "\n  and {more} more")?;
        }
        Ok(())
    }
}

/// Problems as they are found.
#[derive(Debug)]
pub(crate) struct Problems(RefCell<DatasetError>);

impl Problems {
    /// Returns an empty list; `what` names the action that problems prevent.
    pub(crate) fn new(what: impl Into<String>) -> Self {
        Self(RefCell::new(DatasetError { what: what.into(), problems: Vec::new() }))
    }

    pub(crate) fn add<'a>(
        &self,
        file: &Path,
        line: impl Into<Option<usize>>,
        column: impl Into<Option<&'a str>>,
        message: impl Into<String>,
    ) {
        let (line, column) = (line.into(), column.into().map(str::to_string));
        let problem = Problem { file: file.to_path_buf(), line, column, message: message.into() };
        self.0.borrow_mut().problems.push(problem);
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.len() == 0
    }

    pub(crate) fn len(&self) -> usize {
        self.0.borrow().problems.len()
    }

    /// Returns `value`, or the problems if there are any.
    pub(crate) fn into_result<T>(self, value: T) -> Result<T, DatasetError> {
        if self.is_empty() { Ok(value) } else { Err(self.into_error()) }
    }

    pub(crate) fn into_error(self) -> DatasetError {
        self.0.into_inner()
    }
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
