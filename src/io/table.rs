//! Tables with commas, semicolons or tabs between cells, with the place of every cell in its file.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use polars::prelude::{Column, DataFrame, StringChunked};

use super::error::Problems;
use super::number::{Mark, Place, parse};
use super::text::{Separator, Slip, cells, decode, filled_lines, line_end, without_separator_line};
use crate::measurement::number::count_of;

/// The rows of a file as a data frame of text, with the line of each.
pub(crate) struct Table<'a> {
    pub(crate) path: PathBuf,
    pub(crate) problems: &'a Problems,
    /// The separator of cells; unless it is a comma, decimals may have one.
    separator: char,
    /// The line of the names of columns.
    header: usize,
    lines: Vec<usize>,
    /// Cells without the blanks around them, null if they are empty.
    frame: DataFrame,
}

/// A record of the file: the number of its first line, and its cells.
#[derive(Debug, PartialEq)]
struct Record<'t> {
    line: usize,
    cells: Vec<Cow<'t, str>>,
}

impl<'a> Table<'a> {
    /// Reads a file without comments (`#`) and lines of blanks and commas only. `None` if it cannot
    /// be read; the reason is then among the problems.
    pub(crate) fn read(path: &Path, problems: &'a Problems) -> Option<Self> {
        let text = read_utf8(path, problems)?;
        let (text, stated) = without_separator_line(text.into());
        let separator = stated.unwrap_or_else(|| separator(&text));
        let before = problems.len();
        let wrong = |line: Option<usize>, message: String| problems.add(path, line, None, message);
        let mut rows = records(&text, separator, &|line, message| wrong(Some(line), message.to_owned()));
        let has_slips = problems.len() > before;
        if rows.is_empty() && !has_slips {
            wrong(None, "is empty; expected a line of column names, and rows below it".to_owned());
        }
        let Record { line: header, cells: names } = rows.drain(..1.min(rows.len())).next()?;
        if !are_good(path, header, &names, problems) {
            return None;
        }
        if rows.is_empty() && !has_slips {
            let hint = if text.contains("\n#") { " (lines that begin with # are comments)" } else { "" };
            wrong(Some(header), format!("no rows below the column names; expected at least one{hint}"));
        }
        rows.retain(|Record { line, cells }| {
            if cells.len() != names.len() {
                wrong(Some(*line), wrong_width(cells.len(), names.len(), separator));
            }
            cells.len() == names.len()
        });
        let column = |(i, name): (usize, &Cow<str>)| {
            let cells = rows.iter().map(|row| Some(row.cells[i].as_ref()).filter(|cell| !cell.is_empty()));
            Column::new(name.as_ref().into(), cells.collect::<Vec<Option<&str>>>())
        };
        let frame = DataFrame::new(rows.len(), names.iter().enumerate().map(column).collect());
        let lines = rows.iter().map(|row| row.line).collect();
        let table = Self { path: path.to_path_buf(), problems, separator, header, lines, frame: frame.ok()? };
        (table.rows() > 0).then_some(table)
    }

    /// Complains about a cell.
    pub(crate) fn wrong<'c>(
        &self,
        row: usize,
        column: impl Into<Option<&'c str>>,
        message: impl Into<String>,
    ) {
        self.problems.add(&self.path, self.line(row), column, message);
    }

    /// Complains about the name of a column, or about all names.
    pub(crate) fn wrong_name<'c>(&self, column: impl Into<Option<&'c str>>, message: impl Into<String>) {
        self.problems.add(&self.path, self.header, column, message);
    }

    pub(crate) fn rows(&self) -> usize {
        self.lines.len()
    }

    pub(crate) fn line(&self, row: usize) -> usize {
        self.lines[row]
    }

    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.frame.columns().iter().map(|column| column.name().as_str())
    }

    pub(crate) fn has(&self, column: &str) -> bool {
        self.column(column).is_some()
    }

    fn column(&self, name: &str) -> Option<&StringChunked> {
        let column = self.frame.get_column_index(name)?;
        self.frame.columns()[column].str().ok()
    }

    /// Returns a cell; `None` if it is empty or the column is missing.
    pub(crate) fn text(&self, column: &str, row: usize) -> Option<&str> {
        self.column(column)?.get(row)
    }

    /// Returns whether a cell is empty, or a word for a missing number.
    pub(crate) fn is_gap(&self, column: &str, row: usize) -> bool {
        self.text(column, row).is_none_or(|text| parse(text) == Ok(None))
    }

    /// Returns a column of numbers: `None` for a gap, and a problem for each other cell.
    /// `None` if the column is missing.
    pub(crate) fn numbers(&self, column: &str) -> Option<Vec<Option<f64>>> {
        let (file, problems) = (self.path.as_path(), self.problems);
        let mut marks = Mark::default();
        let number = |(line, text): (&usize, Option<&str>)| {
            marks.number(Place { file, line: *line, column, text: text?, problems })
        };
        let numbers = self.lines.iter().zip(self.column(column)?.iter()).map(number).collect();
        if self.separator != ',' {
            marks.finish(file, problems);
        }
        Some(numbers)
    }
}

/// Returns a file as text, without byte order mark; `None` if that fails, with a problem.
pub(crate) fn read_utf8(path: &Path, problems: &Problems) -> Option<String> {
    let wrong = |error| problems.add(path, None, None, format!("cannot be read: {error}"));
    match decode(&fs::read(path).map_err(wrong).ok()?) {
        (text, None) => Some(text.into_owned()),
        (_, line) => {
            problems.add(path, line, None, "is not UTF-8 text; save the file as UTF-8");
            None
        }
    }
}

/// Returns the most likely separator: the most frequent one in the line of names.
pub(crate) fn separator(text: &str) -> char {
    let names = filled_lines(text).find(|(_, line)| !line.trim_start().starts_with('#'));
    let first = names.map_or("", |(_, line)| line);
    // the last one of equally frequent ones
    ['\t', ';', ','].into_iter().max_by_key(|c| first.matches(*c).count()).unwrap_or(',')
}

/// Returns whether the names of columns are good; complains about missing and repeated ones.
fn are_good(path: &Path, line: usize, names: &[Cow<str>], problems: &Problems) -> bool {
    let before = problems.len();
    for (i, name) in names.iter().enumerate() {
        if name.is_empty() {
            problems.add(path, line, None, format!("column {} has no name", i + 1));
        } else if names[..i].contains(name) {
            problems.add(path, line, name.as_ref(), "stands twice among the column names");
        }
    }
    problems.len() == before
}

/// Returns the message about a row with another number of cells than the header.
fn wrong_width(found: usize, expected: usize, separator: char) -> String {
    let name = Separator::Char(separator).name();
    let hint = match separator {
        _ if found < expected => format!("leave a cell empty, but keep its {}", name.trim_end_matches('s')),
        ',' => "write decimals with a point, and text that has commas in quotation marks".to_string(),
        _ => format!("write text that has {name} in quotation marks"),
    };
    format!("{}; expected {expected}, as in the header; {hint}", count_of(found, "cell"))
}

/// Splits a text into records, which end at line ends outside quotation marks; calls `wrong` with
/// the line of each slip.
fn records<'t>(text: &'t str, separator: char, wrong: &dyn Fn(usize, &str)) -> Vec<Record<'t>> {
    let end = line_end(text);
    let mut records = Vec::new();
    let (mut rest, mut line) = (text, 1);
    while !rest.is_empty() {
        let length = |from: usize| rest[from..].find(end).map_or(rest.len(), |length| from + length);
        let mut record = &rest[..length(0)];
        let is_comment = record.trim_start().starts_with('#');
        let mut found = cells(record, Separator::Char(separator));
        while let Err(Slip::Open(_)) = &found
            && !is_comment
            && let Some(next) = rest[record.len()..].find('"')
        {
            // the cell goes on below, at least to the line of the next quotation mark
            record = &rest[..length(record.len() + next)];
            found = cells(record, Separator::Char(separator));
        }
        let line_of = |at: usize| line + record[..at].matches(end).count();
        match found {
            _ if is_comment => {}
            Ok(cells) if cells.iter().all(|cell| cell.is_empty()) => {}
            Ok(cells) => records.push(Record { line, cells }),
            Err(Slip::Text(at)) => wrong(
                line_of(at),
                "text follows a closing quotation mark; expected the end of the cell, or \"\" for a quotation mark within the cell",
            ),
            Err(Slip::Open(at)) => {
                wrong(line_of(at), "a quotation mark opens here and is never closed");
                return records;
            }
        }
        line = line_of(record.len()) + 1;
        rest = rest.get(record.len() + 1..).unwrap_or_default();
    }
    records
}
