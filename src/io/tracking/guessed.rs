//! A guess of the section `[tracks]` that fits a table, as values: a draft shows it, and the loader reads by it.

use super::boxes;
use super::column_names::{AngleUnit, Column, ColumnNames};
use super::settings::{TimeUnit, TracksSection};

/// What of `[tracks]` fits a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::io) struct Guess {
    /// `[tracks.columns]`.
    pub columns: Vec<Guessed>,
    pub angle_unit: Option<AngleUnit>,
    /// Whether the table has angles, which only discs do.
    pub has_angles: bool,
    /// The unit of times, where only their steps show it.
    pub time_unit: Option<TimeUnit>,
    /// Pairs of columns for x and y that are no positions of balls.
    pub passed: Vec<String>,
    /// A column that may be one of times or of numbers of frames.
    pub perhaps_time: Option<String>,
}

/// A key of `[tracks.columns]` and the column that it may be.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::io) struct Guessed {
    pub key: &'static str,
    pub column: Column,
    /// When the key is right, where that is not certain: it is drafted as a comment.
    pub doubt: Option<String>,
}

impl Guess {
    /// Returns the column for a key.
    pub(in crate::io) fn column(&self, key: &str) -> Option<&Column> {
        self.columns.iter().find(|guessed| guessed.key == key).map(|guessed| &guessed.column)
    }

    /// Returns what is certain as a section of dataset.toml.
    pub(super) fn section(&self) -> TracksSection {
        let mut names = ColumnNames { angle_unit: self.angle_unit, ..ColumnNames::default() };
        for guessed in self.columns.iter().filter(|guessed| guessed.doubt.is_none()) {
            names.set(guessed.key, guessed.column.clone());
        }
        TracksSection::of_columns((!self.columns.is_empty()).then_some(names), self.time_unit)
    }

    /// Returns whether x and y are certainly not those of the ball, but of a box about it.
    pub(super) fn has_boxes(&self) -> bool {
        let is_certain = |guessed: &Guessed| guessed.doubt.is_none();
        let is_box = |guessed: &Guessed| [boxes::SIZE[0], boxes::CORNER[0]].contains(&guessed.key);
        self.columns.iter().any(|guessed| is_certain(guessed) && is_box(guessed))
    }
}
