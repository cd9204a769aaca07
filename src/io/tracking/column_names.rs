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
    pub cue_x: Option<Column>,
    pub cue_y: Option<Column>,
    pub object_x: Option<Column>,
    pub object_y: Option<Column>,
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

    /// Whether the columns make a table, long or wide.
    pub(super) fn check(&self) -> Result<(), String> {
        let wide = [&self.cue_x, &self.cue_y, &self.object_x, &self.object_y];
        let long = [&self.ball, &self.x, &self.y];
        let rest = [&self.point, &self.x_sd, &self.y_sd, &self.marker_x, &self.marker_y];
        let any_wide = wide.iter().any(|name| name.is_some());
        let any_long = long.iter().chain(&rest).any(|name| name.is_some());
        if any_wide && any_long {
            return Err(
                "[tracks.columns] mixes a wide table (cue_x, cue_y, object_x, object_y) with a long \
                        one (ball, x, y); expected one of them"
                    .to_string(),
            );
        }
        let full = |names: &[&Option<Column>]| names.iter().all(|name| name.is_some());
        if !full(&wide) && !full(&long) {
            return Err("[tracks.columns] needs ball, x and y (a long table: a row per ball and frame) or \
                        cue_x, cue_y, object_x and object_y (a wide one: a row per frame)"
                .to_string());
        }
        if self.frame.is_none() && self.t.is_none() && !any_wide {
            return Err("[tracks.columns] has neither frame nor t; expected one of them (only a table with a row per \
                        frame can do without: its rows are counted)"
                .to_string());
        }
        let pairs = [
            (&self.x_sd, &self.y_sd, "x_sd and y_sd"),
            (&self.marker_x, &self.marker_y, "marker_x and marker_y"),
        ];
        for (one, other, names) in pairs {
            if one.is_some() != other.is_some() {
                return Err(format!("[tracks.columns]: {names} go together"));
            }
        }
        if self.is_numbered() && self.all().iter().any(|column| matches!(column, Column::Name(_))) {
            return Err(
                "[tracks.columns] gives some columns by name and some by number; expected one of them \
                        throughout"
                    .to_string(),
            );
        }
        if let Some(separator) = &self.separator
            && ![",", ";", "\t", " ", "|"].contains(&separator.as_str())
        {
            return Err(format!(
                "separator is {separator:?}; expected \",\", \";\", \"\\t\", \"|\" or \" \""
            ));
        }
        Ok(())
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
            &self.cue_x,
            &self.cue_y,
            &self.object_x,
            &self.object_y,
        ];
        all.into_iter().flatten().collect()
    }
}
