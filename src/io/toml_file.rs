//! TOML files, and all that is wrong with them in plain words, each with its place.

use std::ops::Range;
use std::path::Path;

use serde::de::DeserializeOwned;
use toml::Spanned;

use super::error::{DatasetError, Problems, did_you_mean};
use super::table::read_utf8;

/// A TOML file that is read, and where what is wrong with it is put.
pub(crate) struct Source<'a> {
    pub path: &'a Path,
    pub text: &'a str,
    pub problems: &'a Problems,
}

impl Source<'_> {
    /// Line and position in it, from 1.
    pub(crate) fn place(&self, span: &Range<usize>) -> (usize, String) {
        let before = &self.text.as_bytes()[..span.start.min(self.text.len())];
        let line = before.split(|byte| *byte == b'\n').count();
        let rest = before.rsplit(|byte| *byte == b'\n').next().unwrap_or_default();
        let position = String::from_utf8_lossy(rest).chars().count() + 1;
        (line, position.to_string())
    }

    /// What is written there.
    pub(crate) fn written(&self, span: &Range<usize>) -> &str {
        self.text.get(span.clone()).unwrap_or_default()
    }

    pub(crate) fn wrong<T>(&self, at: &Spanned<T>, message: impl Into<String>) {
        self.wrong_at(&at.span(), message);
    }

    pub(crate) fn wrong_at(&self, span: &Range<usize>, message: impl Into<String>) {
        let (line, position) = self.place(span);
        self.problems.add(self.path, line, position.as_str(), message);
    }

    /// The number that is given, else the default; a complaint where it does not pass.
    pub(crate) fn number(
        &self,
        given: Option<&Spanned<f64>>,
        key: &str,
        default: f64,
        (good, expected): Condition,
    ) -> f64 {
        let Some(given) = given else { return default };
        let value = *given.as_ref();
        if !(value.is_finite() && good(value)) {
            self.wrong(given, format!("{key} is {}; expected {expected}", self.written(&given.span())));
        }
        value
    }
}

/// A value without its place.
pub(crate) fn bare<'a, T: Copy + 'a>(given: impl Into<Option<&'a Spanned<T>>>) -> Option<T> {
    given.into().map(|given| *given.as_ref())
}

/// What a number has to be, and that in words.
pub(crate) type Condition = (fn(f64) -> bool, &'static str);

pub(crate) const POSITIVE: Condition = (|x| x > 0.0, "more than 0");

pub(crate) const NOT_NEGATIVE: Condition = (|x| x >= 0.0, "0 (exact) or more");

/// Reads a TOML file of another shape, with the same care for what is wrong with it.
pub(crate) fn read_toml<T: DeserializeOwned>(path: &Path) -> Result<T, DatasetError> {
    read_checked(path, |parsed, _| parsed)
}

/// Reads a TOML file of another shape; `check` says where what was parsed makes no sense.
pub(crate) fn read_checked<T: DeserializeOwned, U>(
    path: &Path,
    check: impl FnOnce(T, &Source) -> U,
) -> Result<U, DatasetError> {
    let problems = Problems::new(format!("{} cannot be used:", path.display()));
    let text = read_utf8(path, &problems);
    checked(path, text.as_deref(), problems, check)
}

/// What `check` makes of a text that is TOML; `None`: why there is no text is among the problems.
pub(crate) fn checked<T: DeserializeOwned, U>(
    path: &Path,
    text: Option<&str>,
    problems: Problems,
    check: impl FnOnce(T, &Source) -> U,
) -> Result<U, DatasetError> {
    // a byte order mark is no part of the first line
    let source = text.map(|text| text.strip_prefix('\u{feff}').unwrap_or(text));
    let source = source.map(|text| Source { path, text, problems: &problems });
    let checked = source.and_then(|source| Some(check(parse(&source)?, &source)));
    match checked {
        Some(checked) => problems.into_result(checked),
        None => Err(problems.into_error()),
    }
}

/// So many unknown keys are looked for.
const UNKNOWN_KEYS: usize = 20;

/// Says all that is unknown, where each is a line of its own: with that line made a comment, the next one is
/// found. Of any other errors the first.
fn parse<T: DeserializeOwned>(source: &Source) -> Option<T> {
    let mut text = source.text.to_string();
    for found in 0..UNKNOWN_KEYS {
        let error = match toml::from_str(&text) {
            Ok(parsed) => return (found == 0).then_some(parsed),
            Err(error) => error,
        };
        let unknown = error.message().starts_with("unknown field");
        // what follows from a value of several lines is none of its own
        if found > 0 && !unknown {
            return None;
        }
        complain(&error, source);
        let own_line = error.span().filter(|span| {
            let before = text[..span.start].rsplit('\n').next().unwrap_or_default();
            unknown && before.trim().is_empty() && text.is_char_boundary(span.start + 1)
        });
        text.replace_range(own_line.map(|span| span.start..span.start + 1)?, "#");
    }
    None
}

/// What toml or serde found, for people who write neither.
fn complain(error: &toml::de::Error, source: &Source) {
    // that of a key missing at the top says nothing
    let whole = |span: &Range<usize>| {
        error.message().starts_with("missing field") && !source.written(span).starts_with('[')
    };
    let span = error.span().filter(|span| !whole(span));
    let written = span.as_ref().map_or("", |span| source.written(span));
    let message = in_plain_words(error.message(), written);
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

/// The message of toml or serde about what is `written`, for people who write neither.
fn in_plain_words(message: &str, written: &str) -> String {
    let message = message.trim().replace('\n', " ");
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let names = |names: &[&str]| names.join(", ");
    match (message.split(' ').take(2).collect::<Vec<_>>().as_slice(), quoted.as_slice()) {
        (["unknown", what], [word, known @ ..]) if !known.is_empty() => {
            let what = if *what == "field" { "unknown key" } else { "unknown word" };
            let near = did_you_mean(word, known.iter().copied());
            format!(
                "{what} \"{word}\"{near}; expected {}{}",
                if known.len() > 1 { "one of " } else { "" },
                names(known)
            )
        }
        (["missing", "field"], [key]) => {
            let place = if written.is_empty() { String::new() } else { format!(" in {written}") };
            let expected = match *key {
                "radius_m" => "; expected radius_m = …, the ball's radius in metres (pool 0.028575)",
                "kind" => "; expected kind = \"tracks\", \"impacts\" or \"angles\"",
                "files" => "; expected files = [\"…\"], the tables, relative to this file",
                _ => "",
            };
            format!("the key {key} is missing{place}{expected}")
        }
        (["duplicate", "key"], _) => format!("the key {written} stands twice"),
        (["invalid", "type:"], _) => match message.split_once(", expected ") {
            Some((_, expected)) if !written.contains('\n') => {
                let expected = match expected {
                    "f64" => "a number, without quotation marks",
                    "a string" => "text in quotation marks",
                    "a sequence" => "a list, as in [\"shots.csv\"]",
                    other => other,
                };
                format!("{written} is of the wrong type; expected {expected}")
            }
            _ => message,
        },
        _ => message,
    }
}

/// Whether the comma between two digits stands just before or at a place.
fn is_decimal_comma(text: &str, place: usize) -> bool {
    let text = text.as_bytes();
    let digit = |i: usize| text.get(i).is_some_and(u8::is_ascii_digit);
    (place.saturating_sub(1)..=place)
        .any(|i| text.get(i) == Some(&b',') && i > 0 && digit(i - 1) && digit(i + 1))
}
