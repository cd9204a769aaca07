//! A guess of the section `[tracks]` for a table, by which a draft is written and files are read.

use super::boxes::{self, Boxed, Rest};
use super::cells::LIKELY;
use super::column_names::{Column, ColumnNames};
use super::heading::Heading;
use super::sample::Rows;
use super::settings::{TimeUnit, TracksSection};
use super::units::AngleUnit;
use super::words::{Role, find};

/// Guessed settings of `[tracks]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::io) struct Guess {
    /// `[tracks.columns]`.
    pub columns: Vec<Guessed>,
    pub angle_unit: Option<AngleUnit>,
    /// Whether the table has angles, which only discs do.
    pub has_angles: bool,
    /// The unit of times, if only their steps show it.
    pub time_unit: Option<TimeUnit>,
    /// Pairs of columns for x and y that are not positions of balls.
    pub passed: Vec<String>,
    /// A column that may be one of times or of numbers of frames.
    pub perhaps_time: Option<String>,
}

/// A key of `[tracks.columns]` and its possible column.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::io) struct Guessed {
    pub key: &'static str,
    pub column: Column,
    /// The condition under which an uncertain key is right: it is drafted as a comment.
    pub doubt: Option<String>,
}

impl Guess {
    pub(in crate::io) fn column(&self, key: &str) -> Option<&Column> {
        self.columns.iter().find(|guessed| guessed.key == key).map(|guessed| &guessed.column)
    }

    /// Returns the certain keys as a section of dataset.toml.
    pub(super) fn section(&self) -> TracksSection {
        let mut names = ColumnNames { angle_unit: self.angle_unit, ..ColumnNames::default() };
        for guessed in self.columns.iter().filter(|guessed| guessed.doubt.is_none()) {
            names.set(guessed.key, guessed.column.clone());
        }
        TracksSection::of_columns((!self.columns.is_empty()).then_some(names), self.time_unit)
    }

    /// Returns whether x and y are certainly those of a box instead of the ball.
    pub(super) fn has_boxes(&self) -> bool {
        let is_certain = |guessed: &Guessed| guessed.doubt.is_none();
        let is_box = |guessed: &Guessed| [boxes::SIZE[0], boxes::CORNER[0]].contains(&guessed.key);
        self.columns.iter().any(|guessed| is_certain(guessed) && is_box(guessed))
    }
}

/// A table with names of columns, and the growing guess of their meaning.
pub(super) struct Table<'a> {
    pub heading: &'a Heading,
    pub small: Vec<String>,
    pub rows: Rows,
    pub taken: Vec<usize>,
    pub guess: Guess,
}

impl Table<'_> {
    pub(super) fn add<const N: usize>(&mut self, keys: [&'static str; N], columns: [usize; N]) {
        for (key, column) in keys.into_iter().zip(columns) {
            self.guess_column(key, column, None);
        }
        self.taken.extend(columns);
    }

    fn guess_column(&mut self, key: &'static str, column: usize, doubt: Option<String>) {
        let column = Column::Name(self.heading.names[column].clone());
        self.guess.columns.push(Guessed { key, column, doubt });
    }

    pub(super) fn is_free(&self, column: usize) -> bool {
        !self.taken.contains(&column) && !self.small[column].is_empty()
    }

    /// Adds the column of times or frames: by its name, or else the one that grows in each group.
    pub(super) fn add_time(&mut self, groups: &[usize], others: &[usize]) {
        let known = |role| find(&self.small, role).filter(|column| self.is_free(*column));
        match (known(Role::Frame), known(Role::Time)) {
            (Some(frame), _) => return self.add(["frame"], [frame]),
            (None, Some(time)) => return self.add(["t"], [time]),
            (None, None) => {}
        }
        let grows = |column: usize| Some((column, self.rows.least_step(column, groups)?));
        let mut free =
            (0..self.small.len()).filter(|column| self.is_free(*column) && !others.contains(column));
        let Some((column, step)) = free.find_map(grows) else { return };
        match (self.rows.is_whole(column), step) {
            (true, 1.0) => self.add(["frame"], [column]),
            (false, ..0.5) => self.add(["t"], [column]),
            (false, ..200.0) => {
                self.add(["t"], [column]);
                self.guess.time_unit = Some(TimeUnit::Ms);
            }
            _ => self.guess.perhaps_time = Some(self.heading.names[column].clone()),
        }
    }

    /// Adds the columns that determine the middle of boxes. The size is added as a comment if
    /// neither names nor paths show whether x and y are a corner or the middle.
    pub(super) fn add_boxes(&mut self, positions: &[[usize; 2]], boxes: &[Boxed], ball: Option<usize>) {
        for (i, position) in positions.iter().enumerate() {
            let which = if positions.len() == 1 { 0 } else { i + 1 };
            if let Some(Boxed { rest, .. }) = boxes.get(i) {
                let keys = match rest {
                    Rest::Corner(_) => CORNERS,
                    Rest::Size(_) => WIDTHS,
                };
                self.add(keys[which], rest.columns());
                continue;
            }
            let Some(size) = boxes::size(&self.small, position[0]) else { continue };
            match self.rows.is_corner(*position, size, ball) {
                Some(true) => self.add(WIDTHS[which], size),
                Some(false) => {}
                None => {
                    let why =
                        "of a box: take the # away, from both, if x and y are its corner, and not its middle";
                    self.guess_column(WIDTHS[which][0], size[0], Some(why.to_string()));
                    self.guess_column(WIDTHS[which][1], size[1], Some(String::new()));
                }
            }
        }
    }

    /// Adds the columns of likelihoods, and of confidences as a comment: their scale is unknown.
    pub(super) fn add_likelihoods(&mut self, positions: &[[usize; 2]]) {
        for (i, [x, _]) in positions.iter().enumerate() {
            let which = if positions.len() == 1 { 0 } else { i + 1 };
            let named = |names: &[&str]| names.iter().find_map(|name| boxes::beside(&self.small, *x, name));
            let alone = |names: &[&str]| {
                let found = names.iter().find_map(|name| self.small.iter().position(|own| own == name));
                found.filter(|_| which == 0)
            };
            let of =
                |names: &[&str]| named(names).or_else(|| alone(names)).filter(|column| self.is_free(*column));
            if let Some(column) = of(&["likelihood"]) {
                self.add([LIKELIHOODS[which]], [column]);
            } else if let Some(column) = of(&["confidence", "conf", "score", "probability"]) {
                let why = format!("take the # away to leave out positions below {LIKELY}");
                self.guess_column(LIKELIHOODS[which], column, Some(why));
            }
        }
    }
}

/// Keys of `[tracks.columns]` for long tables, for the cue ball and for the object ball.
const CORNERS: [[&str; 2]; 3] = [boxes::CORNER, ["cue_x2", "cue_y2"], ["object_x2", "object_y2"]];
const WIDTHS: [[&str; 2]; 3] = [boxes::SIZE, ["cue_width", "cue_height"], ["object_width", "object_height"]];
const LIKELIHOODS: [&str; 3] = ["likelihood", "cue_likelihood", "object_likelihood"];
