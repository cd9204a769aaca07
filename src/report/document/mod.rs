//! The documents that programs read: each is one struct, which is written, read back and described
//! by its JSON Schema.
//!
//! Numbers are SI and radians, unless a unit stands beside them or in the key; `null` stands
//! for what is not known. Keys may be added, and not renamed or dropped while `FORMAT_VERSION`
//! stays.

mod fit;
mod printed;

pub(crate) use fit::*;
pub(crate) use printed::*;
use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::ReportError;
pub(crate) use crate::name::ByName;

/// `format_version` of the documents: raised if a key is renamed or dropped, or changes its
/// meaning.
pub(crate) const FORMAT_VERSION: u32 = 1;

/// Defines documents: each key stands once, with its meaning, its type, and its value.
///
/// `Name(of: Type) { /// Meaning.\n key: Type = value, }` is a struct with that public field, which
/// is written as JSON and described by a schema, and a function `new(of)`, which gives each field
/// its value. `[made: Made]` stands for a document of its own, `[made: Made, of Source]` for that
/// of a type, which is then written as it.
macro_rules! document {
    ($(
        $(#[$about:meta])*
        $name:ident($($of:ident: $type:ty),+) $([$made:ident: $maker:ty $(, of $source:ty)?])? {
            $($(#[$meaning:meta])* $key:ident: $kind:ty = $value:expr,)+
        }
    )+) => { $(
        $(#[$about])*
        #[derive(Clone, Debug, serde::Serialize, schemars::JsonSchema)]
        pub(crate) struct $name {
            $($(#[$meaning])* pub(crate) $key: $kind,)+
            $(
                /// The program that made it.
                #[serde(flatten)]
                pub(crate) $made: $maker,
            )?
        }

        impl $name {
            /// Returns the document.
            pub(crate) fn new($($of: $type),+) -> Self {
                Self { $($key: $value,)+ $($made: <$maker>::default(),)? }
            }
        }

        $($(
            /// As this document.
            impl serde::Serialize for $source {
                fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                    $name::new(self).serialize(serializer)
                }
            }
        )?)?
    )+ };
}
use document;

/// Returns a document as text, with a newline at its end and numbers rounded to `DIGITS`. Numbers
/// that are not finite become `null`.
///
/// # Errors
/// The document cannot be serialized.
pub fn text(document: &(impl Serialize + ?Sized)) -> Result<String, ReportError> {
    let mut value = serde_json::to_value(document)?;
    round(&mut value);
    exact_text(&value)
}

/// Returns a document as text, with a newline at its end and all digits. Numbers that are not
/// finite become `null`.
///
/// # Errors
/// The document cannot be serialized.
pub(crate) fn exact_text(document: &(impl Serialize + ?Sized)) -> Result<String, ReportError> {
    Ok(serde_json::to_string_pretty(document)? + "\n")
}

/// Returns whether two texts of fit.json hold the same result, after any number of steps: a step
/// more or less is a matter of roundings.
pub(super) fn is_same_result(one: &str, other: &str) -> bool {
    const EFFORT: [&str; 2] = ["  \"seconds\":", "  \"iterations\":"];
    let result = |line: &&str| !EFFORT.iter().any(|key| line.starts_with(key));
    one.lines().filter(result).eq(other.lines().filter(result))
}

/// Significant digits of numbers in files: more than any error leaves, fewer than what differs
/// between processors.
pub(crate) const DIGITS: usize = 8;

/// Returns a number rounded to [`DIGITS`].
pub(super) fn rounded(number: f64) -> f64 {
    let places = DIGITS as f64 - 1.0 - number.abs().log10().floor();
    // whole numbers and these powers of ten are exact, so that a ratio of both is rounded once
    if (0.0..=22.0).contains(&places) {
        let power = 10_f64.powi(places as i32);
        return (number * power).round() / power;
    }
    format!("{number:.*e}", DIGITS - 1).parse().unwrap_or(number)
}

/// Rounds all numbers of a document that are not whole.
fn round(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(round),
        Value::Object(entries) => entries.values_mut().for_each(round),
        Value::Number(number) if number.is_f64() => {
            *value = number.as_f64().map_or(Value::Null, |number| rounded(number).into());
        }
        _ => {}
    }
}

/// Returns the JSON Schema (draft 2020-12) of a document as it is written.
fn schema<T: JsonSchema>() -> Schema {
    SchemaSettings::draft2020_12().for_serialize().into_generator().into_root_schema_for::<T>()
}

/// A command and the schema of what it prints with `--json`; `dataset` stands for dataset.toml.
type CommandSchema = (&'static str, fn() -> Schema);

pub(crate) const SCHEMAS: [CommandSchema; 9] = [
    ("fit", schema::<FitDocument>),
    ("compare", schema::<CompareDocument>),
    ("accuracy", schema::<AccuracyDocument>),
    ("check", schema::<CheckDocument>),
    ("collide", schema::<CollideDocument>),
    ("design", schema::<DesignDocument>),
    ("extract", schema::<ExtractDocument>),
    ("synth", schema::<SynthDocument>),
    ("dataset", crate::io::schema),
];

/// The program that made a document.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub(crate) struct Made {
    /// Version of caromfit.
    pub(crate) version: String,
    /// 1; raised if a key is renamed or dropped, or changes its meaning.
    pub(crate) format_version: u32,
}

impl Default for Made {
    fn default() -> Self {
        Self { version: env!("CARGO_PKG_VERSION").to_owned(), format_version: FORMAT_VERSION }
    }
}

/// Returns what is made of each of some things.
fn each<T, U>(all: &[T], one: impl FnMut(&T) -> U) -> Vec<U> {
    all.iter().map(one).collect()
}

/// Returns what is made of each of some things, by its name.
fn named<T, U>(all: &[T], one: impl Fn(&T) -> (&str, U)) -> ByName<U> {
    all.iter().map(one).map(|(name, made)| (name.to_owned(), made)).collect()
}

fn finite(number: f64) -> Option<f64> {
    number.is_finite().then_some(number)
}
