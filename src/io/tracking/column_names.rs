//! `[tracks.columns]`: the file's column for each key.

use std::num::NonZero;

use schemars::JsonSchema;
use serde::Deserialize;

use super::units::AngleUnit;

#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(untagged, expecting = "expected the name of a column, or its number, from 1 on")]
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

macro_rules! column_names {
    ($($key:ident)+) => {
        /// `[tracks.columns]`: the file's column for each key.
        #[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub(super) struct ColumnNames {
            $(pub $key: Option<Column>,)+
            pub(crate) angle_unit: Option<AngleUnit>,
        }

        /// All keys of columns.
        pub(super) const KEYS: [&str; [$(stringify!($key)),+].len()] = [$(stringify!($key)),+];

        impl ColumnNames {
            pub(super) fn all(&self) -> impl Iterator<Item = (&'static str, &Column)> {
                let all = [$((stringify!($key), &self.$key)),+];
                all.into_iter().filter_map(|(key, column)| Some((key, column.as_ref()?)))
            }

            pub(super) fn set(&mut self, key: &str, column: Column) {
                match key {
                    $(stringify!($key) => self.$key = Some(column),)+
                    _ => {}
                }
            }
        }
    };
}

// A box has its other corner in x2 and y2, or its size in width and height.
column_names! {
    shot frame t ball point x y x2 y2 width height likelihood x_sd y_sd marker_x marker_y angle
    cue_x cue_y object_x object_y cue_x2 cue_y2 object_x2 object_y2 cue_width cue_height object_width object_height
    cue_likelihood object_likelihood cue_angle object_angle
}

/// Keys that go together.
const PAIRS: [[&str; 2]; 4] = [["x_sd", "y_sd"], ["marker_x", "marker_y"], ["x2", "y2"], ["width", "height"]];

impl ColumnNames {
    pub(super) fn get(&self, key: &str) -> Option<&Column> {
        self.all().find(|(own, _)| *own == key).map(|(_, column)| column)
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    pub(super) fn is_numbered(&self) -> bool {
        self.all().any(|(_, column)| matches!(column, Column::Number(_)))
    }

    pub(super) fn has_angles(&self) -> bool {
        self.all().any(|(key, _)| key.ends_with("angle"))
    }

    /// Complains unless the columns make a table, long or wide.
    pub(super) fn check(&self) -> Result<(), String> {
        let has_all = |keys: &[&str]| keys.iter().all(|key| self.has(key));
        let has_any = |keys: &[&str]| keys.iter().any(|key| self.has(key));
        let is_wide = |key: &str| key.starts_with("cue_") || key.starts_with("object_");
        let any_wide = self.all().any(|(key, _)| is_wide(key));
        let is_beside = |key: &str| !is_wide(key) && !["shot", "frame", "t"].contains(&key);
        let has_name = self.all().any(|(_, column)| matches!(column, Column::Name(_)));
        let message = if any_wide && self.all().any(|(key, _)| is_beside(key)) {
            "mixes a wide table (cue_x, cue_y, object_x, object_y) with a long one (ball, x, y); expected one of them"
        } else if !has_all(&["cue_x", "cue_y", "object_x", "object_y"]) && !has_all(&["x", "y"]) {
            "needs ball, x and y (a long table: a row per ball and frame) or cue_x, cue_y, object_x and object_y (a wide \
             one: a row per frame)"
        } else if !self.has("ball") && has_any(&["point", "x_sd", "marker_x", "angle"]) {
            "has point, x_sd, marker_x or angle, but not ball; expected ball: only plain positions can be assigned to \
             balls by their paths"
        } else if !any_wide && !has_any(&["frame", "t"]) {
            "has neither frame nor t; expected one of them (only the rows of a wide table can be counted)"
        } else if has_name && self.is_numbered() {
            "gives some columns by name and some by number; expected one of them throughout"
        } else {
            return self.check_pairs();
        };
        Err(format!("[tracks.columns] {message}"))
    }

    fn check_pairs(&self) -> Result<(), String> {
        for begin in ["", "cue_", "object_"] {
            let pairs = PAIRS.map(|pair| pair.map(|key| format!("{begin}{key}")));
            if let Some([one, other]) = pairs.iter().find(|[one, other]| self.has(one) != self.has(other)) {
                return Err(format!("[tracks.columns]: {one} and {other} go together"));
            }
            if self.has(&pairs[2][0]) && self.has(&pairs[3][0]) {
                let message = "[tracks.columns] has both x2, y2 and width, height; expected the other corner of the box, or its size";
                return Err(message.to_string());
            }
        }
        Ok(())
    }
}
