//! TOML files, checked against the JSON Schema of their structs: all problems, with their places.

use std::ops::Range;
use std::path::Path;

use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema};
use serde::de::DeserializeOwned;
use serde_json::Value as Json;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{DatasetError, Log, did_you_mean};
use super::text::{read_utf8, shortened};
use crate::measurement::fault::Fault;

/// Types of a schema with the types of TOML that fit them, and their words.
const TYPES: [(&str, &str, &str); 6] = [
    ("number", "float", "a number without quotation marks"),
    ("number", "integer", "a number without quotation marks"),
    ("integer", "integer", "a whole number"),
    ("string", "string", "text in quotation marks"),
    ("array", "array", ""),
    ("object", "table", ""),
];

/// A bound of numbers in a schema: its key, its words, and the relation of number and bound.
struct Bound(&'static str, &'static str, fn(&f64, &f64) -> bool);

const BOUNDS: [Bound; 3] = [
    Bound("exclusiveMinimum", "more than", f64::gt),
    Bound("minimum", "at least", f64::ge),
    Bound("maximum", "at most", f64::le),
];

/// Returns the JSON Schema (draft 2020-12) of a file, whose tables have no other keys.
pub(crate) fn schema<T: JsonSchema>() -> Schema {
    let close = |schema: &mut Schema| {
        if schema.get("properties").is_some() {
            schema.insert("additionalProperties".to_owned(), false.into());
        }
    };
    let settings = SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
    settings.with_transform(RecursiveTransform(close)).into_generator().into_root_schema_for::<T>()
}

/// A TOML file that is read, and the list of its problems.
pub(crate) struct Source<'a> {
    pub(crate) path: &'a Path,
    pub(crate) log: &'a Log,
    text: &'a str,
    table: Spanned<DeTable<'a>>,
}

impl<'a> Source<'a> {
    /// Returns a text with its tree; the errors of its syntax are problems.
    pub(crate) fn new(path: &'a Path, text: &'a str, log: &'a Log) -> Self {
        let (table, mut errors) = DeTable::parse_recoverable(text);
        // later ones may be consequences of the first
        errors.sort_by_key(|error| error.span().map(|span| span.start));
        let source = Self { path, log, text, table };
        for error in errors {
            let span = error.span().unwrap_or_default();
            let (message, written) = (error.message(), source.shown(&span));
            // the comma stands at the place, or just before it
            let near = &text.as_bytes()[span.start.saturating_sub(2)..];
            let is_comma = |near: &[u8]| matches!(near, [b'0'..=b'9', b',', b'0'..=b'9']);
            let hint = match near {
                _ if near.windows(3).take(2).any(is_comma) => "; write decimals with a point, not a comma",
                _ if near.iter().take(3).any(|byte| *byte == b'\\') => "; write / between folders, not \\",
                _ => "",
            };
            source.wrong_at(&span, format!("{written}: {message}{hint}").trim_start_matches(": "));
        }
        source
    }

    /// Returns the value of `fit.mu.lower`, or of `kind.2.side` in a list.
    fn value(&self, key: &str) -> Option<&Spanned<DeValue<'a>>> {
        let mut keys = key.split('.');
        let first = self.table.get_ref().get(keys.next()?)?;
        keys.try_fold(first, |value, key| match value.get_ref() {
            DeValue::Table(table) => table.get(key),
            DeValue::Array(values) => values.get(key.parse::<usize>().ok()?),
            _ => None,
        })
    }

    /// Returns the value of a key as it is written; empty if the key is not stated.
    pub(crate) fn written(&self, key: &str) -> &'a str {
        self.value(key).and_then(|value| self.text.get(value.span())).unwrap_or_default()
    }

    fn shown(&self, span: &Range<usize>) -> String {
        let written = self.text.get(span.clone()).unwrap_or_default();
        shortened(written.lines().next().unwrap_or_default())
    }

    /// Adds a problem at the first stated of some keys, else at the table of the first of them.
    pub(crate) fn wrong(&self, keys: &str, message: impl Into<String>) {
        let first = keys.split(' ').next().unwrap_or_default();
        let tables = first.rmatch_indices('.').map(|(end, _)| &first[..end]);
        let value = keys.split(' ').chain(tables).find_map(|key| self.value(key));
        self.wrong_at(&value.map(Spanned::span).unwrap_or_default(), message);
    }

    /// Adds a problem with its line and its position in the line, from 1.
    fn wrong_at(&self, span: &Range<usize>, message: impl Into<String>) {
        let before = self.text.get(..span.start).unwrap_or(self.text);
        let line = before.matches('\n').count() + 1;
        let position = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        self.log.add(self.path, line, position.to_string().as_str(), message);
    }

    /// Adds faulty values. Places in lists are left out of the messages.
    pub(crate) fn add(&self, faults: &[Fault]) {
        for fault in faults {
            let names = fault.key.split('.').filter(|name| name.parse::<usize>().is_err());
            let key = names.collect::<Vec<_>>().join(".");
            self.wrong(&fault.key, Fault { key, ..fault.clone() }.to_string());
        }
    }

    /// Returns all that is stated; nothing if the syntax is wrong.
    pub(crate) fn stated(&self) -> toml::Table {
        toml::from_str(self.text).unwrap_or_default()
    }

    /// Adds all that is wrong with a value, by the schema that it is to fit.
    fn compare(&self, key: &str, value: &Spanned<DeValue>, schema: &Json) {
        let (span, kind) = (value.span(), value.get_ref().type_str());
        let all = alternatives(schema);
        let fits =
            |schema: &&&Json| TYPES.iter().any(|(own, toml, _)| *own == type_of(schema) && *toml == kind);
        let meant: Vec<&Json> = all.iter().filter(fits).copied().collect();
        let Some(schema) = meant.first() else {
            let (written, expected) = (self.shown(&span), expected(&all));
            return self.wrong_at(&span, format!("{written} is of the wrong type; expected {expected}"));
        };
        match value.get_ref() {
            DeValue::String(word) => {
                let known: Vec<&str> = meant.iter().flat_map(|schema| words(schema)).collect();
                if !known.is_empty() && !known.contains(&word.as_ref()) {
                    let (near, expected) = (did_you_mean(word, known), expected(&all));
                    self.wrong_at(&span, format!("unknown word \"{word}\"{near}; expected {expected}"));
                }
            }
            DeValue::Integer(_) | DeValue::Float(_) => self.compare_number(key, &span, schema),
            DeValue::Array(items) => items.iter().for_each(|item| self.compare(key, item, &schema["items"])),
            DeValue::Table(table) => self.compare_keys(key, &span, table, schema),
            DeValue::Boolean(_) | DeValue::Datetime(_) => {}
        }
    }

    fn compare_number(&self, key: &str, span: &Range<usize>, schema: &Json) {
        let number = self.shown(span).parse::<toml::Value>().ok();
        let number = number.and_then(|value| value.as_float().or(value.as_integer().map(|n| n as f64)));
        let number = number.filter(|number| number.is_finite());
        let (mut is_good, mut expected) = (true, Vec::new());
        for Bound(word, words, is_met) in BOUNDS {
            let Some(bound) = schema[word].as_f64() else { continue };
            is_good &= number.is_some_and(|number| is_met(&number, &bound));
            expected.push(format!("{words} {bound}"));
        }
        if !is_good {
            let units = [("_m", ", in metres"), ("_kg", ", in kilograms")];
            let unit = units.into_iter().find(|(end, _)| key.ends_with(end)).map_or("", |(_, unit)| unit);
            self.wrong_at(span, Fault::new(key, self.shown(span), expected.join(", ") + unit).to_string());
        }
    }

    fn compare_keys(&self, key: &str, span: &Range<usize>, table: &DeTable, schema: &Json) {
        let mut entries: Vec<_> = table.iter().collect();
        entries.sort_by_key(|(name, _)| name.span().start);
        let known =
            || schema["properties"].as_object().into_iter().flatten().map(|(known, _)| known.as_str());
        for (name, value) in entries {
            let (span, name) = (name.span(), name.get_ref().as_ref());
            if let Some(schema) = schema["properties"].get(name) {
                self.compare(format!("{key}.{name}").trim_start_matches('.'), value, schema);
            } else {
                let (near, known) = (did_you_mean(name, known()), known().collect::<Vec<_>>().join(", "));
                self.wrong_at(&span, format!("unknown key \"{name}\"{near}; expected one of {known}"));
            }
        }
        for key in texts(&schema["required"]).filter(|key| !table.contains_key(*key)) {
            let expected = expected(&alternatives(&schema["properties"][key]));
            self.wrong_at(span, format!("the key {key} is missing; expected {key} = {expected}"));
        }
        for (key, needed) in schema["dependentRequired"].as_object().into_iter().flatten() {
            let missing = texts(needed).find(|needed| !table.contains_key(*needed));
            if let (Some(missing), Some(value)) = (missing, table.get(key.as_str())) {
                self.wrong_at(&value.span(), format!("{key} needs {missing} beside it"));
            }
        }
    }
}

/// Returns the schemas of which a value is to fit one.
fn alternatives(schema: &Json) -> Vec<&Json> {
    match schema["anyOf"].as_array().or(schema["oneOf"].as_array()) {
        Some(each) => each.iter().flat_map(alternatives).collect(),
        None => vec![schema],
    }
}

fn type_of(schema: &Json) -> &str {
    let types = &schema["type"];
    types.as_str().or(types[0].as_str()).unwrap_or_default()
}

/// Returns the words that a schema allows; an empty list if it allows every text.
fn words(schema: &Json) -> Vec<&str> {
    texts(&schema["enum"]).chain(schema["const"].as_str()).collect()
}

fn texts(list: &Json) -> impl Iterator<Item = &str> {
    list.as_array().into_iter().flatten().filter_map(Json::as_str)
}

/// Returns the values that one of some schemas allows, in words.
fn expected(schemas: &[&Json]) -> String {
    let names = |schema: &&Json| -> Vec<String> {
        if let Some(keys) = schema["properties"].as_object() {
            let keys: Vec<String> = keys.keys().map(|key| format!("{key} = …")).collect();
            return vec![format!("{{ {} }}", keys.join(", "))];
        }
        if schema["items"].is_object() {
            return vec![format!("[{}, …]", expected(&alternatives(&schema["items"])))];
        }
        let words: Vec<String> = words(schema).iter().map(|word| format!("\"{word}\"")).collect();
        let types =
            TYPES.iter().find(|(own, ..)| *own == type_of(schema)).map(|(.., words)| (*words).to_owned());
        if words.is_empty() { types.into_iter().collect() } else { words }
    };
    let mut each: Vec<String> = schemas.iter().flat_map(names).collect();
    let last = each.pop().unwrap_or_default();
    if each.is_empty() { last } else { format!("{} or {last}", each.join(", ")) }
}

/// Returns the result of `check`, which adds problems of the parsed value, for a TOML text (`None`:
/// that of the file `path`). `what` names the action that problems prevent.
pub(crate) fn checked<T: DeserializeOwned + JsonSchema, U>(
    path: &Path,
    text: Option<&str>,
    what: impl Into<String>,
    check: impl FnOnce(T, &Source) -> U,
) -> Result<U, DatasetError> {
    let log = Log::default();
    let text = text.map(str::to_owned).or_else(|| read_utf8(path, &log));
    let Some(text) = &text else { return Err(log.into_error(what)) };
    // a byte order mark is not part of the first line
    let text = text.trim_start_matches('\u{feff}');
    let source = Source::new(path, text, &log);
    if log.is_empty() {
        source.compare_keys("", &(0..0), source.table.get_ref(), &schema::<T>().into());
    }
    match toml::from_str(text) {
        Ok(parsed) => {
            let checked = check(parsed, &source);
            log.into_result(checked, what)
        }
        Err(error) => {
            if log.is_empty() {
                source.wrong_at(&error.span().unwrap_or_default(), error.message());
            }
            Err(log.into_error(what))
        }
    }
}
