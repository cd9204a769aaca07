//! `[tracks.columns]`: the file's column for each key.

use std::num::NonZero;

use indexmap::IndexMap;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;

use super::units::{AngleUnit, Measure};
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
    let units = json_schema!({ "type": "string", "enum": AngleUnit::ALL.map(AngleUnit::name) });
    properties.insert(ANGLE_UNIT.to_owned(), units);
    let each = ["", "cue_", "object_"];
    let pairs = each.into_iter().flat_map(|begin| PAIRS.map(|pair| pair.map(|key| format!("{begin}{key}"))));
    let both = pairs.flat_map(|[one, other]| [(one.clone(), [other.clone()]), (other, [one])]);
    let both: IndexMap<String, [String; 1]> = both.collect();
    json_schema!({ "type": "object", "properties": properties, "dependentRequired": both })
}

/// Complains unless the columns make a table, long or wide.
pub(super) fn check(columns: &Columns, discs: bool, source: &Source) {
    let has = |key: &str| columns.contains_key(key);
    let is_wide = |key: &str| key.starts_with("cue_") || key.starts_with("object_");
    let any_wide = columns.keys().any(|key| is_wide(key));
    let is_beside = |key: &String| !is_wide(key) && !KEYS.contains(&key.as_str());
    let numbers = columns.values().filter(|column| matches!(column, Column::Number(_))).count();
    let has_angles = columns.keys().any(|key| key.ends_with("angle"));
    let is_mixed = numbers > 0 && columns.len() > numbers + usize::from(has(ANGLE_UNIT));
    let faults = [
        (
            any_wide && columns.keys().any(is_beside),
            "mixes a wide table (cue_x, cue_y, object_x, object_y) with a long one (ball, x, y); expected one of them",
        ),
        (
            !(["cue_x", "cue_y", "object_x", "object_y"].into_iter().all(has) || has("x") && has("y")),
            "needs ball, x and y (a row per ball and frame) or cue_x, cue_y, object_x and object_y (a row per frame)",
        ),
        (
            !has("ball") && ["point", "x_sd", "marker_x", "angle"].into_iter().any(has),
            "has point, x_sd, marker_x or angle, but not ball: only plain positions can be assigned by their paths",
        ),
        (
            !any_wide && !has("frame") && !has("t"),
            "has no frame and no t; expected one of them (only the rows of a wide table can be counted)",
        ),
        (is_mixed, "gives some columns by name and some by number; expected one of them throughout"),
        (
            has_angles && !discs,
            "has angles, which do not show how a ball turns; expected them with [ball] shape = \"disc\" only",
        ),
        (
            ["", "cue_", "object_"]
                .into_iter()
                .any(|begin| has(&format!("{begin}x2")) && has(&format!("{begin}width"))),
            "has both x2, y2 and width, height; expected the other corner of the box, or its size",
        ),
    ];
    if let Some((_, message)) = faults.iter().find(|(is_wrong, _)| *is_wrong) {
        source.wrong("tracks.columns", format!("[tracks.columns] {message}"));
    }
}

/// Returns the unit of angles that `[tracks.columns]` states.
pub(super) fn angle_unit(columns: &Columns) -> Option<AngleUnit> {
    let Column::Name(word) = columns.get(ANGLE_UNIT)? else { return None };
    if let Measure::Angle(unit) = Measure::of(word)? { Some(unit) } else { None }
}
