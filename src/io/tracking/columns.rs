//! `[tracks.columns]`: the file's column for each key, and the tables that are read by them.

use std::num::NonZero;

use schemars::JsonSchema;
use serde::Deserialize;

use super::formats;
use super::heading::{Heading, tops};
use super::input::{Input, Subject};
use super::layout::{Block, Body, Layout, Name};
use super::sample::Rows;
use super::settings::Format;
use super::units::{AngleUnit, Measure, TimeUnit};
use super::words::{Role, find};
use crate::io::error::did_you_mean;
use crate::io::number::{shortened, value};

/// Maximum number of lines searched for the names of the columns, or for the first row.
const MAX_LINES: usize = 100;

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
            pub angle_unit: Option<AngleUnit>,
        }

        /// All keys of columns.
        pub(super) const KEYS: [&str; [$(stringify!($key)),+].len()] = [$(stringify!($key)),+];

        impl ColumnNames {
            /// Returns all keys that are stated, each with the file's column.
            pub(super) fn all(&self) -> impl Iterator<Item = (&'static str, &Column)> {
                let all = [$((stringify!($key), &self.$key)),+];
                all.into_iter().filter_map(|(key, column)| Some((key, column.as_ref()?)))
            }

            /// States the file's column for a key.
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
    fn get(&self, key: &str) -> Option<&Column> {
        self.all().find(|(own, _)| *own == key).map(|(_, column)| column)
    }

    fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    fn is_numbered(&self) -> bool {
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

    /// Complains about half of a pair, and a box stated twice.
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

/// Returns the layout of a table whose columns are stated. Without a column of balls, the paths
/// separate the balls; without times, the rows of a wide table are frames.
pub(super) fn layout(input: &Input, wanted: &ColumnNames) -> Option<Layout> {
    let heading = if wanted.is_numbered() { numbered(input, wanted) } else { header(input, wanted) }?;
    let column = |key: &str| match wanted.get(key)? {
        Column::Name(name) => heading.position(name.trim()),
        Column::Number(number) => Some(number.get() - 1),
    };
    let shot = column("shot");
    let read: Vec<usize> = wanted.all().filter_map(|(key, _)| column(key)).collect();
    let time = formats::time(column, input).or_else(|| unnamed_time(&heading, &read, shot, input));
    let body = |name: Name, begin: &str| {
        let mut body = Body::of_keys(name, begin, column)?;
        if let Some(column) = column(&format!("{begin}angle")) {
            body.angle = Some((column, angle_unit(&heading, column, wanted.angle_unit, input)?));
        }
        Some(body)
    };
    let bodies = if wanted.has("cue_x") {
        let [cue, object] = input.settings.first_names().map(|name| Name::Fixed(name.to_string()));
        vec![body(cue, "cue_")?, body(object, "object_")?]
    } else {
        time?;
        vec![body(column("ball").map_or(Name::Fixed(String::new()), Name::Column), "")?]
    };
    if time.is_none() {
        let message = "no column of times: every row is taken as one frame after the row above it";
        input.log.add(Subject::Clock, None, message);
    }
    let block = Block::below(&heading, bodies);
    Some(Layout { shot, ..Layout::new(Format::Columns, heading, vec![block], time, input) })
}

fn angle_unit(
    heading: &Heading,
    column: usize,
    stated: Option<AngleUnit>,
    input: &Input,
) -> Option<AngleUnit> {
    let place = stated.map(|unit| (Measure::Angle(unit), "[tracks.columns] angle_unit states"));
    match heading.unit(column, Measure::Angle(AngleUnit::Rad), place, input) {
        Some(Measure::Angle(unit)) => Some(unit),
        None if !heading.has_unit(column) && stated.is_none() => {
            let message = "the unit of these angles is not stated; expected [tracks.columns] angle_unit = \"rad\" or \"deg\"";
            input.wrong(heading.line, heading.bare[column].as_str(), message);
            None
        }
        _ => stated,
    }
}

/// Returns the column of frame numbers or times if [tracks.columns] names neither, and whether it
/// is of frames: it is recognised by its name, and its numbers grow from row to row of a shot.
fn unnamed_time(
    heading: &Heading,
    used: &[usize],
    shot: Option<usize>,
    input: &Input,
) -> Option<(usize, bool)> {
    let names = heading.small();
    let rows = Rows::of(input.text, heading);
    let grows = |column: &usize| !used.contains(column) && rows.grows(*column, shot);
    let frame = find(&names, Role::Frame).filter(|column| grows(column) && rows.is_whole(*column));
    let time = find(&names, Role::Time).filter(grows);
    let rate = input.settings.playback_fps.or(input.settings.capture_fps);
    if let (Some(frame), Some(time), Some(rate)) = (frame, time, rate)
        && heading.time(time, input) == TimeUnit::S
    {
        rows.check_clock(heading, [frame, time], rate, input);
    }
    let frame = frame.filter(|_| input.is_by_frame() || time.is_none());
    let column = frame.or(time)?;
    let message = format!(
        "[tracks.columns] names no column of times: \"{}\" is taken as {}",
        heading.names[column],
        if frame.is_some() { "the number of the frame" } else { "the time" }
    );
    input.log.add(Subject::Clock, heading.line, message);
    Some((column, frame.is_some()))
}

/// Returns the heading in the first line that has all the names.
fn header(input: &Input, wanted: &ColumnNames) -> Option<Heading> {
    let names = wanted.all().filter_map(|(_, column)| match column {
        Column::Name(name) => Some(name.trim()),
        Column::Number(_) => None,
    });
    let names: Vec<&str> = names.collect();
    let mut nearest: Option<(usize, Heading)> = None;
    for top in tops(input.text, MAX_LINES) {
        let heading = Heading::deep(input.text, &top);
        let here = names.iter().filter(|name| heading.position(name).is_some()).count();
        if here == names.len() {
            let before = input.problems.len();
            heading.complain_of_twins(names, input);
            return (input.problems.len() == before).then_some(heading);
        }
        if nearest.as_ref().is_none_or(|(most, _)| here > *most) {
            nearest = Some((here, heading));
        }
    }
    let Some((_, heading)) = nearest else {
        input.wrong(None, None, "is empty; expected the columns that [tracks.columns] names");
        return None;
    };
    let missing = names.into_iter().find(|name| heading.position(name).is_none()).unwrap_or_default();
    let near = did_you_mean(missing, heading.names.iter().map(String::as_str));
    let message = format!(
        "no line has all the columns that [tracks.columns] names; \"{missing}\" is missing here{near}: {}",
        shortened(&heading.names.join(" | "))
    );
    input.wrong(heading.line, None, message);
    None
}

/// Returns the heading of a table without names, from the first row with the expected numbers.
fn numbered(input: &Input, wanted: &ColumnNames) -> Option<Heading> {
    let number = |(key, column): (&str, &Column)| match column {
        Column::Number(number) if !["shot", "ball", "point"].contains(&key) => Some(number.get() - 1),
        _ => None,
    };
    let numbers: Vec<usize> = wanted.all().filter_map(number).collect();
    let last =
        wanted.all().map(|(_, column)| if let Column::Number(number) = column { number.get() } else { 1 });
    let least = last.max()?;
    for top in tops(input.text, MAX_LINES).iter().filter(|top| !top.is_comment()) {
        let cells = &top.names;
        if cells.len() >= least && numbers.iter().all(|column| value(&cells[*column]).is_some()) {
            let is_open = cells.len() > least && cells.last().is_some_and(String::is_empty);
            return Some(Heading::unnamed(top.line, top.separator, cells.len() - usize::from(is_open)));
        }
    }
    let numbers: Vec<String> = numbers.iter().map(|column| (column + 1).to_string()).collect();
    let message = format!(
        "none of the first {MAX_LINES} lines has numbers in the columns {} that [tracks.columns] gives",
        numbers.join(", ")
    );
    input.wrong(None, None, message);
    None
}
