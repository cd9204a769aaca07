//! `[tracks.columns]`: the file's column for each key.

use std::num::NonZero;

use indexmap::IndexMap;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;

use super::units::Unit;
use crate::io::toml_file::Source;

/// A column of `[tracks.columns]`, or the unit of angles.
#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(untagged)]
pub(in crate::io) enum Column {
    Name(String),
    /// Number from 1, for files without names of columns.
    Number(NonZero<usize>),
}

impl Column {
    /// Returns it as dataset.toml writes it.
    pub(in crate::io) fn shown(&self) -> String {
        match self {
            Self::Name(name) => toml::Value::from(name.as_str()).to_string(),
            Self::Number(number) => number.to_string(),
        }
    }
}

/// `[tracks.columns]`: the column of each key of [`KEYS`], [`ONE_EACH`] or [`EACH`].
pub(super) type Columns = IndexMap<String, Column>;

/// Keys of a table with a row per frame or per ball and frame, and of the latter only.
const KEYS: [&str; 4] = ["shot", "frame", "t", ANGLE_UNIT];
const ONE_EACH: [&str; 6] = ["ball", "point", "x_sd", "y_sd", "marker_x", "marker_y"];
/// Keys of each ball, which follow `cue_` and `object_` in a table with a row per frame. A box has
/// its other corner in x2 and y2, or its size in width and height.
const EACH: [&str; 8] = ["x", "y", "x2", "y2", "width", "height", "likelihood", "angle"];
const ANGLE_UNIT: &str = "angle_unit";
/// Keys that go together.
const PAIRS: [[&str; 2]; 4] = [["x_sd", "y_sd"], ["marker_x", "marker_y"], ["x2", "y2"], ["width", "height"]];

fn keys() -> impl Iterator<Item = String> {
    let each = ["", "cue_", "object_"].into_iter().flat_map(|begin| EACH.map(|key| format!("{begin}{key}")));
    [KEYS.as_slice(), &ONE_EACH].concat().into_iter().map(str::to_string).chain(each)
}

pub(super) fn schema_of_columns(generator: &mut SchemaGenerator) -> Schema {
    let column = generator.subschema_for::<Column>();
    let mut properties: IndexMap<String, Schema> = keys().map(|key| (key, column.clone())).collect();
    let units = json_schema!({ "type": "string", "enum": Unit::Rad.names_alike() });
    properties.insert(ANGLE_UNIT.to_owned(), units);
    let each = ["", "cue_", "object_"];
    let pairs = each.into_iter().flat_map(|begin| PAIRS.map(|pair| pair.map(|key| format!("{begin}{key}"))));
    let both = pairs.flat_map(|[one, other]| [(one.clone(), [other.clone()]), (other, [one])]);
    let both: IndexMap<String, [String; 1]> = both.collect();
    json_schema!({ "type": "object", "properties": properties, "dependentRequired": both })
}

/// Complains if some columns are stated by name and some by number.
pub(super) fn check(columns: &Columns, source: &Source) {
    let mut each = columns.iter().filter(|(key, _)| *key != ANGLE_UNIT).map(|(_, column)| column);
    let is_number = |column: &Column| matches!(column, Column::Number(_));
    let first = each.next().is_some_and(is_number);
    if each.any(|column| is_number(column) != first) {
        let message =
            "[tracks.columns] gives some columns by name and some by number; expected one of them throughout";
        source.wrong("tracks.columns", message);
    }
}

/// Returns the unit of angles that `[tracks.columns]` states.
pub(super) fn angle_unit(columns: &Columns) -> Option<Unit> {
    let Column::Name(word) = columns.get(ANGLE_UNIT)? else { return None };
    Unit::of(word)
}
