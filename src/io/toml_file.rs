//! TOML files, and all their problems in plain words, each with its place.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use serde::de::DeserializeOwned;
use toml::Value;
use toml::de::{DeTable, DeValue};

use super::error::{DatasetError, Problems, did_you_mean};
use super::table::read_utf8;
use crate::measurement::fault::{Condition, Fault};

/// Maximum number of entries that are reported as wrong.
const MAX_WRONG_ENTRIES: usize = 20;

/// A condition, and the keys of the numbers that are to meet it, with blanks between them.
pub(crate) type Rule = (Condition, &'static str);

/// A TOML file that is read, and the list of its problems.
pub(crate) struct Source<'a> {
    pub(crate) path: &'a Path,
    pub(crate) text: &'a str,
    pub(crate) problems: &'a Problems,
}

impl Source<'_> {
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

    /// Returns whether a key or a section is stated.
    pub(crate) fn has(&self, key: &str) -> bool {
        self.span(key).is_some()
    }

    /// Returns the value of a key as it is written; empty if the key is not stated.
    pub(crate) fn written(&self, key: &str) -> &str {
        self.span(key).and_then(|span| self.text.get(span)).unwrap_or_default()
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

    /// Adds a problem with its line and its position in the line, from 1.
    fn wrong_at(&self, span: &Range<usize>, message: impl Into<String>) {
        let before = self.text.get(..span.start).unwrap_or(self.text);
        let line = before.matches('\n').count() + 1;
        let position = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        self.problems.add(self.path, line, position.to_string().as_str(), message);
    }

    /// Adds the stated numbers that do not meet their conditions.
    pub(crate) fn check(&self, rules: &[Rule]) {
        let each =
            |(condition, keys): &Rule| keys.split(' ').map(|key| (key, *condition)).collect::<Vec<_>>();
        for (key, condition) in rules.iter().flat_map(each) {
            let Ok(value) = self.written(key).parse::<Value>() else { continue };
            let number = value.as_float().or(value.as_integer().map(|number| number as f64));
            let fault = number.and_then(|number| Fault::of_number(key, number, condition));
            let as_written = |fault| Fault { value: self.written(key).to_owned(), ..fault };
            fault.map(as_written).iter().for_each(|fault| self.add(fault));
        }
    }

    /// Adds what does not go together by the rules of a list in rules.toml.
    pub(crate) fn check_together(&self, list: &str) {
        for [_, keys, message] in self.rules(list) {
            self.wrong_of_first(&keys.split(' ').collect::<Vec<_>>(), message);
        }
    }

    /// Returns the rules of a list in rules.toml whose conditions hold, with values in their words.
    pub(crate) fn rules(&self, list: &str) -> Vec<[String; 3]> {
        let lists = toml::from_str::<BTreeMap<String, Vec<[String; 3]>>>(include_str!("rules.toml"));
        let mut rules = lists.unwrap_or_default().remove(list).unwrap_or_default();
        rules.retain(|[terms, ..]| {
            terms.split(' ').all(|terms| terms.split('|').any(|term| self.holds(term)))
        });
        for [.., message] in &mut rules {
            for key in ["kind", "ball.mass_kg"] {
                *message = message.replace(&format!("{{{key}}}"), self.written(key));
            }
        }
        rules
    }

    /// Returns whether a condition of a rule holds.
    fn holds(&self, term: &str) -> bool {
        let is = |key: &str, word: &str| self.written(key).trim_matches(['"', '\'']) == word;
        match (term.split_once("!="), term.split_once('='), term.strip_prefix('!')) {
            (Some((key, word)), ..) => !is(key, word),
            (_, Some((key, word)), _) => is(key, word),
            (.., Some(key)) => !self.has(key),
            _ => self.has(term),
        }
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
    let text = text.map(|text| text.trim_start_matches('\u{feff}'));
    let source = text.map(|text| Source { path, text, problems: &problems });
    match source.and_then(|source| Some(check(parse(&source)?, &source))) {
        Some(checked) => problems.into_result(checked),
        None => Err(problems.into_error()),
    }
}

/// Parses a text; adds all wrong entries, each found after the line of the last was made a comment.
fn parse<T: DeserializeOwned>(source: &Source) -> Option<T> {
    let mut text = source.text.to_string();
    for found in 0..MAX_WRONG_ENTRIES {
        match toml::from_str(&text) {
            Ok(parsed) => return (found == 0).then_some(parsed),
            // the key may be in an entry that was set aside
            Err(error) if found > 0 && error.message().starts_with("missing field") => return None,
            Err(error) => {
                complain(&error, source);
                set_aside(&mut text, error.span()?)?;
            }
        }
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
    let span = error.span().unwrap_or_default();
    let written = source.text.get(span.clone()).unwrap_or_default();
    // a key that is missing at the top, or the whole file
    if error.message().starts_with("missing field") && !written.starts_with('[') {
        return source.problems.add(source.path, None, None, in_plain_words(error.message(), ""));
    }
    let mut message = in_plain_words(error.message(), written);
    // the comma stands at the place, or just before it
    let near = &source.text.as_bytes()[span.start.saturating_sub(2)..];
    if near.windows(3).take(2).any(|near| matches!(near, [b'0'..=b'9', b',', b'0'..=b'9'])) {
        message += "; write decimals with a point, not a comma";
    } else if message.contains("escape") {
        message += "; write / between folders, not \\";
    }
    source.wrong_at(&span, message);
}

/// Returns the message of toml or serde about `written` in plain words.
fn in_plain_words(message: &str, written: &str) -> String {
    let message = message.trim().replace('\n', " ");
    let names: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    match (message.split(' ').take(2).collect::<Vec<_>>().as_slice(), names.as_slice()) {
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
        (["invalid", "type:"] | ["wanted", "string"] | ["expected", _], _) if !written.contains('\n') => {
            let expected = match message.split_once("expected ").map_or(message.as_str(), |(_, what)| what) {
                "f64" => "a number, without quotation marks",
                "a string" | "wanted string or table" => "text in quotation marks",
                "a sequence" => "a list, as in [\"a\", \"b\"]",
                other => other,
            };
            format!("{written} is of the wrong type; expected {expected}")
        }
        _ => message,
    }
}
