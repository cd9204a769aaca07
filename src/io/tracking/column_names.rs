//! `[tracks.columns]`: which column of a file is which of ours.

use std::fmt;

use serde::de::Visitor;
use serde::{Deserialize, Deserializer};

/// A column of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Column {
    Name(String),
    /// From 1; for files without names of columns.
    Number(usize),
}

impl<'de> Deserialize<'de> for Column {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl Visitor<'_> for Either {
            type Value = Column;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("the name of a column, or its number, from 1 on")
            }

            fn visit_str<E>(self, name: &str) -> Result<Column, E> {
                Ok(Column::Name(name.trim().to_string()))
            }

            fn visit_i64<E: serde::de::Error>(self, number: i64) -> Result<Column, E> {
                let wrong = || E::invalid_value(serde::de::Unexpected::Signed(number), &self);
                usize::try_from(number)
                    .ok()
                    .filter(|number| *number > 0)
                    .map(Column::Number)
                    .ok_or_else(wrong)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// `[tracks.columns]`: the file's column for each of ours.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ColumnNames {
    pub separator: Option<String>,
    pub shot: Option<Column>,
    pub frame: Option<Column>,
    pub t: Option<Column>,
    pub ball: Option<Column>,
    pub point: Option<Column>,
    pub x: Option<Column>,
    pub y: Option<Column>,
    pub x_sd: Option<Column>,
    pub y_sd: Option<Column>,
    pub marker_x: Option<Column>,
    pub marker_y: Option<Column>,
    pub angle: Option<Column>,
    pub cue_x: Option<Column>,
    pub cue_y: Option<Column>,
    pub object_x: Option<Column>,
    pub object_y: Option<Column>,
    pub cue_angle: Option<Column>,
    pub object_angle: Option<Column>,
    pub angle_unit: Option<AngleUnit>,
}

/// What columns of angles are in, where their header does not say it.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(super) enum AngleUnit {
    Rad,
    Deg,
}

impl AngleUnit {
    /// As dataset.toml names it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Rad => "rad",
            Self::Deg => "deg",
        }
    }

    /// Radians in one of it.
    pub(super) fn radians(self) -> f64 {
        match self {
            Self::Rad => 1.0,
            Self::Deg => 1.0_f64.to_radians(),
        }
    }
}

impl ColumnNames {
    /// Whether a row holds both balls.
    pub(super) fn is_wide(&self) -> bool {
        self.cue_x.is_some()
    }

    /// Whether the columns are given by their numbers.
    pub(super) fn is_numbered(&self) -> bool {
        self.all().iter().any(|column| matches!(column, Column::Number(_)))
    }

    /// Whether a column holds angles.
    pub(super) fn has_angles(&self) -> bool {
        [&self.angle, &self.cue_angle, &self.object_angle].into_iter().any(Option::is_some)
    }

    /// Whether the columns make a table, long or wide.
    pub(super) fn check(&self) -> Result<(), String> {
        let wide = [&self.cue_x, &self.cue_y, &self.object_x, &self.object_y];
        let long = [&self.ball, &self.x, &self.y];
        let rest = [&self.point, &self.x_sd, &self.y_sd, &self.marker_x, &self.marker_y, &self.angle];
        let turns = [&self.cue_angle, &self.object_angle];
        let any = |one: &[&Option<Column>], other: &[&Option<Column>]| {
            one.iter().chain(other).any(|column| column.is_some())
        };
        let full = |columns: &[&Option<Column>]| columns.iter().all(|column| column.is_some());
        let any_wide = any(&wide, &turns);
        let all = self.all();
        let numbers = all.iter().filter(|column| matches!(column, Column::Number(_))).count();
        let message = if any_wide && any(&long, &rest) {
            "[tracks.columns] mixes a wide table (cue_x, cue_y, object_x, object_y) with a long one (ball, x, y); expected \
             one of them"
        } else if !full(&wide) && !full(&long) {
            "[tracks.columns] needs ball, x and y (a long table: a row per ball and frame) or cue_x, cue_y, object_x and \
             object_y (a wide one: a row per frame)"
        } else if self.frame.is_none() && self.t.is_none() && !any_wide {
            "[tracks.columns] has neither frame nor t; expected one of them (only a table with a row per frame can do \
             without: its rows are counted)"
        } else if self.x_sd.is_some() != self.y_sd.is_some() {
            "[tracks.columns]: x_sd and y_sd go together"
        } else if self.marker_x.is_some() != self.marker_y.is_some() {
            "[tracks.columns]: marker_x and marker_y go together"
        } else if (1..all.len()).contains(&numbers) {
            "[tracks.columns] gives some columns by name and some by number; expected one of them throughout"
        } else {
            return match self.separator.as_deref() {
                None | Some("," | ";" | "\t" | " " | "|") => Ok(()),
                Some(other) => {
                    Err(format!("separator is {other:?}; expected \",\", \";\", \"\\t\", \"|\" or \" \""))
                }
            };
        };
        Err(message.to_string())
    }

    /// The file's columns that are asked for.
    pub(super) fn all(&self) -> Vec<&Column> {
        let all = [
            &self.shot,
            &self.frame,
            &self.t,
            &self.ball,
            &self.point,
            &self.x,
            &self.y,
            &self.x_sd,
            &self.y_sd,
            &self.marker_x,
            &self.marker_y,
            &self.angle,
            &self.cue_x,
            &self.cue_y,
            &self.object_x,
            &self.object_y,
            &self.cue_angle,
            &self.object_angle,
        ];
        all.into_iter().flatten().collect()
    }
}
