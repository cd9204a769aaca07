//! The first rows of an unknown table, and tests of its columns.

use std::collections::{HashMap, HashSet};

use super::heading::Heading;
use super::input::Input;
use super::time::first_contradiction;
use crate::io::number::value;
use crate::io::text::{filled_lines, trimmed};

/// Maximum number of rows examined.
const MAX_ROWS: usize = 20_000;
/// Maximum number of tracks of balls in a file.
const MAX_TRACKS: usize = 20;

/// The cells of rows.
pub(super) struct Rows(Vec<Vec<String>>);

impl Rows {
    pub(super) fn of(text: &str, heading: &Heading) -> Self {
        let rows = filled_lines(text).filter(|(line, _)| *line > heading.above);
        let cells = rows.filter_map(|(_, line)| trimmed(line, heading.separator));
        Self(cells.filter(|cells| cells.len() >= heading.names.len()).take(MAX_ROWS).collect())
    }

    fn column(&self, column: usize) -> impl Iterator<Item = &str> {
        self.0.iter().map(move |row| row[column].as_str())
    }

    fn numbers(&self, column: usize) -> Option<Vec<f64>> {
        let numbers: Vec<f64> = self.column(column).map(value).collect::<Option<_>>()?;
        (numbers.len() > 2).then_some(numbers)
    }

    pub(super) fn largest(&self, column: usize) -> f64 {
        self.column(column).filter_map(value).map(f64::abs).fold(0.0, f64::max)
    }

    /// Returns whether a column grows from row to row of each shot.
    pub(super) fn grows(&self, column: usize, shot: Option<usize>) -> bool {
        let Some(numbers) = self.numbers(column) else { return false };
        let mut last: HashMap<&str, f64> = HashMap::new();
        let shots = self.0.iter().map(|row| shot.map_or("", |shot| row[shot].as_str()));
        let mut rows = shots.zip(numbers);
        rows.all(|(shot, number)| last.insert(shot, number).is_none_or(|before| before < number))
    }

    /// Returns whether most values of a column stand in two rows of their shot.
    pub(super) fn are_pairs(&self, column: usize, shot: Option<usize>) -> bool {
        let mut counts: HashMap<(&str, &str), usize> = HashMap::new();
        for row in &self.0 {
            let group = (shot.map_or("", |shot| row[shot].as_str()), row[column].as_str());
            *counts.entry(group).or_default() += 1;
        }
        counts.len() > 2 && 3 * counts.values().filter(|count| **count == 2).count() > 2 * counts.len()
    }

    /// Complains if a column of frames and one of seconds contradict each other at a rate.
    pub(super) fn check_clock(&self, heading: &Heading, columns: [usize; 2], rate: f64, input: &Input) {
        let [Some(frames), Some(seconds)] = columns.map(|column| self.numbers(column)) else { return };
        let Some(row) = first_contradiction(&frames, &seconds, rate) else { return };
        let [frame, time] = columns.map(|column| heading.names[column].as_str());
        let since = format!("{} frames, but {} s", frames[row] - frames[0], seconds[row] - seconds[0]);
        let message = format!(
            "{frame} and {time} contradict each other at {rate} fps: this row is {since} after the first one; expected columns that \
             agree, or one of them in [tracks.columns], or another frame rate"
        );
        let mut below = filled_lines(input.text).filter(|(line, _)| *line > heading.above);
        input.wrong(below.nth(row).map(|(line, _)| line), time, message);
    }

    pub(super) fn is_empty(&self, column: usize) -> bool {
        self.column(column).all(str::is_empty)
    }

    pub(super) fn is_whole(&self, column: usize) -> bool {
        self.numbers(column).is_some_and(|numbers| numbers.iter().all(|number| number.fract() == 0.0))
    }

    /// Returns whether a column has few values, and rows differ only with it.
    pub(super) fn distinguishes_rows(&self, column: usize, others: &[usize]) -> bool {
        let values = self.values(column);
        let keys: HashSet<Vec<&String>> =
            self.0.iter().map(|row| others.iter().chain([&column]).map(|i| &row[*i]).collect()).collect();
        (2..=MAX_TRACKS).contains(&values) && 2 * values <= self.0.len() && keys.len() == self.0.len()
    }

    pub(super) fn values(&self, column: usize) -> usize {
        self.column(column).collect::<HashSet<_>>().len()
    }
}
