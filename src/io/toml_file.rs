//! TOML files, and all their problems in plain words, each with its place.

use std::ops::Range;
use std::path::Path;

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};

use super::error::{DatasetError, Problems, did_you_mean};
use super::table::read_utf8;
use crate::measurement::fault::{Condition, Fault};

/// A TOML file that is read, and the list of its problems.
pub(crate) struct Source<'a> {
    pub(crate) path: &'a Path,
    pub(crate) text: &'a str,
    pub(crate) problems: &'a Problems,
}

impl Source<'_> {
    /// Returns line and position in it, from 1.
    fn place(&self, span: &Range<usize>) -> (usize, String) {
        let before = &self.text.as_bytes()[..span.start.min(self.text.len())];
        let line = before.split(|byte| *byte == b'\n').count();
        let rest = before.rsplit(|byte| *byte == b'\n').next().unwrap_or_default();
        let position = String::from_utf8_lossy(rest).chars().count() + 1;
        (line, position.to_string())
    }

    /// Returns line and position of the value of a key.
    pub(crate) fn place_of(&self, key: &str) -> (usize, String) {
        self.place(&self.span(key).unwrap_or_default())
    }

    /// Returns the range of the value of a key: `fit.mu.lower`, or `kind.2.side` in a list.
    fn span(&self, key: &str) -> Option<Range<usize>> {
        let table = DeTable::parse(self.text).ok()?;
        let mut keys = key.split('.');
        let mut value = table.get_ref().get(keys.next()?)?;
        for key in keys {
            value = match value.get_ref() {
                DeValue::Table(table) => table.get(key)?,
                DeValue::Array(values) => values.get(key.parse::<usize>().ok()?)?,
                _ => return None,
            };
        }
        Some(value.span())
    }

    /// Returns the value of a key as it is written; `None` if the key is not stated.
    pub(crate) fn written(&self, key: &str) -> Option<&str> {
        self.text.get(self.span(key)?)
    }

    /// Adds a problem at the value of a key, or at its table if the key is not stated.
    pub(crate) fn wrong(&self, key: &str, message: impl Into<String>) {
        let table = key.rsplit_once('.').map_or(key, |(table, _)| table);
        self.wrong_of_first(&[key, table], message);
    }

    pub(crate) fn wrong_if(&self, is_wrong: bool, key: &str, message: &str) {
        if is_wrong {
            self.wrong(key, message);
        }
    }

    /// Adds a problem at the value of the first of some keys that is stated.
    pub(crate) fn wrong_of_first(&self, keys: &[&str], message: impl Into<String>) {
        self.wrong_at(&keys.iter().find_map(|key| self.span(key)).unwrap_or_default(), message);
    }

    fn wrong_at(&self, span: &Range<usize>, message: impl Into<String>) {
        let (line, position) = self.place(span);
        self.problems.add(self.path, line, position.as_str(), message);
    }

    /// Returns the given number, and adds a problem if it does not meet the condition.
    pub(crate) fn number(&self, key: &str, given: Option<f64>, condition: Condition) -> Option<f64> {
        if let Some(fault) = Fault::of_number(key, given?, condition) {
            let value = self.written(key).map_or(fault.value, str::to_owned);
            self.add(&Fault { value, ..fault });
        }
        given
    }

    /// Adds a faulty value. Places in lists are left out of the message.
    pub(crate) fn add(&self, fault: &Fault) {
        let names: Vec<_> = fault.key.split('.').filter(|name| name.parse::<usize>().is_err()).collect();
        self.wrong(&fault.key, Fault { key: names.join("."), ..fault.clone() }.to_string());
    }
}

/// Reads a TOML file of another shape; `check` adds problems of the parsed value.
pub(crate) fn read_checked<T: DeserializeOwned, U>(
    path: &Path,
    check: impl FnOnce(T, &Source) -> U,
) -> Result<U, DatasetError> {
    let problems = Problems::new(format!("{} cannot be used:", path.display()));
    let text = read_utf8(path, &problems);
    checked(path, text.as_deref(), problems, check)
}

/// Returns the result of `check` for a TOML text; `None`: the problems say why it is missing.
pub(crate) fn checked<T: DeserializeOwned, U>(
    path: &Path,
    text: Option<&str>,
    problems: Problems,
    check: impl FnOnce(T, &Source) -> U,
) -> Result<U, DatasetError> {
    // a byte order mark is not part of the first line
    let source = text.map(|text| text.strip_prefix('\u{feff}').unwrap_or(text));
    let source = source.map(|text| Source { path, text, problems: &problems });
    let checked = source.and_then(|source| Some(check(parse(&source)?, &source)));
    match checked {
        Some(checked) => problems.into_result(checked),
        None => Err(problems.into_error()),
    }
}

/// Maximum number of entries that are reported as wrong.
const MAX_WRONG_ENTRIES: usize = 20;

/// Parses a text; adds all wrong entries, each found after the line of the last was made a comment.
fn parse<T: DeserializeOwned>(source: &Source) -> Option<T> {
    let mut text = source.text.to_string();
    for found in 0..MAX_WRONG_ENTRIES {
        let error = match toml::from_str(&text) {
            Ok(parsed) => return (found == 0).then_some(parsed),
            Err(error) => error,
        };
        // the key may be in an entry that was set aside
        if found > 0 && error.message().starts_with("missing field") {
            return None;
        }
        complain(&error, source);
        set_aside(&mut text, error.span()?)?;
    }
    None
}

/// Makes the line of an entry a comment; `None` if it is a section or has several lines, whose rest
/// would be wrong as a consequence.
fn set_aside(text: &mut String, entry: Range<usize>) -> Option<()> {
    let line = text.get(..entry.start)?.rfind('\n').map_or(0, |end| end + 1);
    let is_key = |c: char| c.is_ascii_alphanumeric() || c == '"' || c == '_';
    let is_entry = text.get(line..)?.trim_start_matches([' ', '\t']).starts_with(is_key);
    if !is_entry || text.get(entry)?.contains('\n') {
        return None;
    }
    text.replace_range(line..=line, "#");
    Some(())
}

/// Adds an error of toml or serde in plain words.
fn complain(error: &toml::de::Error, source: &Source) {
    let written = |span: &Range<usize>| source.text.get(span.clone()).unwrap_or_default();
    // the span of a key missing at the top is the whole file
    let whole =
        |span: &Range<usize>| error.message().starts_with("missing field") && !written(span).starts_with('[');
    let span = error.span().filter(|span| !whole(span));
    let message = in_plain_words(error.message(), span.as_ref().map_or("", written));
    let Some(span) = span else { return source.problems.add(source.path, None, None, message) };
    let hint = if is_decimal_comma(source.text, span.start) {
        "; write decimals with a point, not a comma"
    } else if message.contains("escape") {
        "; write / between folders, not \\"
    } else {
        ""
    };
    source.wrong_at(&span, message + hint);
}

/// Returns the message of toml or serde about `written` in plain words.
fn in_plain_words(message: &str, written: &str) -> String {
    let message = message.trim().replace('\n', " ");
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    match (message.split(' ').take(2).collect::<Vec<_>>().as_slice(), quoted.as_slice()) {
        (["unknown", what], [word, known @ ..]) if !known.is_empty() => {
            let what = if *what == "field" { "key" } else { "word" };
            let near = did_you_mean(word, known.iter().copied());
            let one_of = if known.len() > 1 { "one of " } else { "" };
            format!("unknown {what} \"{word}\"{near}; expected {one_of}{}", known.join(", "))
        }
        (["missing", "field"], [key]) => {
            let place = if written.is_empty() { String::new() } else { format!(" in {written}") };
            let expected = match *key {
                "kind" => "; expected kind = \"tracks\", \"impacts\" or \"angles\"",
                "files" => "; expected files = [\"…\"], the tables, relative to this file",
                _ => "",
            };
            format!("the key {key} is missing{place}{expected}")
        }
        (["duplicate", "key"], _) => format!("the key {written} stands twice"),
        (["invalid", "type:"] | ["expected", _], _) if !written.contains('\n') => {
            let expected = match message.split_once(", expected ") {
                Some((_, "f64")) => "a number, without quotation marks",
                Some((_, "a string")) => "text in quotation marks",
                Some((_, "a sequence")) => "a list, as in [\"a\", \"b\"]",
                Some((_, other)) if message.starts_with("invalid") => other,
                _ => message.trim_start_matches("expected "),
            };
            format!("{written} is of the wrong type; expected {expected}")
        }
        _ => message,
    }
}

/// Returns whether the comma between two digits stands just before or at a place.
fn is_decimal_comma(text: &str, place: usize) -> bool {
    let text = text.as_bytes();
    let digit = |i: usize| text.get(i).is_some_and(u8::is_ascii_digit);
    (place.saturating_sub(1)..=place)
        .any(|i| text.get(i) == Some(&b',') && i > 0 && digit(i - 1) && digit(i + 1))
}
