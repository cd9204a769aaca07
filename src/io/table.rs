//! Tables with commas, semicolons or tabs between cells, with the place of every cell in its file.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use polars::prelude::{Column, DataFrame, StringChunked};

use super::error::{Problems, nearest};
use super::number::{Mark, Place, parse};
use super::text::{Separator, Slip, cells, decode, filled_lines, line_end, without_separator_line};
use crate::measurement::number::count_of;

/// The rows of a file as a data frame of text, with the line of each.
pub(crate) struct Table<'a> {
    pub path: PathBuf,
    pub problems: &'a Problems,
    /// The separator of cells; unless it is a comma, decimals may have one.
    separator: char,
    /// The line of the names of columns.
    header: usize,
    lines: Vec<usize>,
    /// Cells without the blanks around them, null if they are empty.
    frame: DataFrame,
}

/// A record of the file: the line where it starts, and its cells.
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
        let (text, told) = without_separator_line(text.into());
        let separator = told.unwrap_or_else(|| separator(&text));
        let (mut rows, slips) = records(&text, separator);
        for (line, message) in &slips {
            problems.add(path, *line, None, *message);
        }
        if rows.is_empty() {
            if slips.is_empty() {
                let message = "is empty; expected a line of column names, and rows below it";
                problems.add(path, None, None, message);
            }
            return None;
        }
        let Record { line: header, cells: names } = rows.remove(0);
        check_header(path, header, &names, problems)?;
        if rows.is_empty() && slips.is_empty() {
            let hint = if text.contains("\n#") { " (lines that begin with # are comments)" } else { "" };
            let message = format!("no rows below the column names; expected at least one{hint}");
            problems.add(path, header, None, message);
        }
        rows.retain(|row| has_width(row, names.len(), separator, path, problems));
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

    /// Complains about the name of a column, or about all of them.
    pub(crate) fn wrong_name<'c>(&self, column: impl Into<Option<&'c str>>, message: impl Into<String>) {
        self.problems.add(&self.path, self.header, column, message);
    }

    pub(crate) fn rows(&self) -> usize {
        self.lines.len()
    }

    /// Returns the row that begins in a line.
    pub(crate) fn row(&self, line: usize) -> Option<usize> {
        self.lines.binary_search(&line).ok()
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

    /// Returns a column of numbers: `None` for an empty cell, and a problem for each that is not a
    /// finite number. `None` if the column is missing.
    pub(crate) fn numbers(&self, column: &str) -> Option<Vec<Option<f64>>> {
        let cells = self.column(column)?;
        let mut marks = Mark::default();
        let number = |(row, text): (usize, Option<&str>)| {
            let text = text?;
            let cell =
                Place { file: &self.path, line: self.line(row), column, text, problems: self.problems };
            let mut plain = Cow::Borrowed(text);
            if self.separator != ','
                && let Ok(Some(number)) = parse(text)
            {
                plain = text.replacen(',', ".", 1).into();
                marks.see(number.mark, cell);
            }
            let number = plain.parse().ok().filter(|x: &f64| x.is_finite());
            if number.is_none() {
                cell.wrong(format!("\"{text}\" is not a finite number; expected {}", remedy(text)));
            }
            number
        };
        let numbers = cells.iter().enumerate().map(number).collect();
        marks.finish(&self.path, self.problems);
        Some(numbers)
    }

    /// Complains unless a column exists and is full. `known` are the columns with a meaning,
    /// which are not misspelled.
    pub(crate) fn require(&self, column: &str, known: &[&str]) {
        if !self.has(column) {
            let near = nearest(column, self.names().filter(|name| !known.contains(name)));
            let near = near.map_or(String::new(), |name| format!("; is \"{name}\" meant to be it?"));
            return self.wrong_name(column, format!("is missing from the column names{near}"));
        }
        for row in (0..self.rows()).filter(|row| self.text(column, *row).is_none()) {
            self.wrong(row, column, "is empty; expected a value");
        }
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

/// Returns what to write instead of a cell that is not a number.
fn remedy(cell: &str) -> String {
    let is_number = |text: &str| text.parse::<f64>().is_ok();
    let with_point = cell.replacen(',', ".", 1);
    let with_minus = cell.replacen(['−', '–'], "-", 1);
    if cell.contains(',') && is_number(&with_point) {
        format!("a decimal point, {with_point}")
    } else if cell != with_minus && is_number(&with_minus) {
        format!("a plain minus sign, {with_minus}")
    } else if parse(cell) == Ok(None) {
        "an empty cell if the value is not known".to_string()
    } else if is_number(cell) && cell.contains(|c: char| c.is_ascii_digit()) {
        format!("one between {:?} and {:?}", f64::MIN, f64::MAX)
    } else {
        "one such as -1.5 or 2e-3".to_string()
    }
}

/// Complains about the names of columns; returns `None` if they prevent reading the table.
fn check_header(path: &Path, line: usize, names: &[Cow<str>], problems: &Problems) -> Option<()> {
    let before = problems.len();
    for (i, name) in names.iter().enumerate() {
        if name.is_empty() {
            problems.add(path, line, None, format!("column {} has no name", i + 1));
        } else if names[..i].contains(name) {
            problems.add(path, line, name.as_ref(), "stands twice among the column names");
        }
    }
    (problems.len() == before).then_some(())
}

/// Returns whether a row has as many cells as the header; complains if not.
fn has_width(row: &Record, expected: usize, separator: char, path: &Path, problems: &Problems) -> bool {
    let found = row.cells.len();
    let name = Separator::Char(separator).name();
    let hint = match (found > expected, separator) {
        _ if found == expected => return true,
        (true, ',') => "write decimals with a point, and text that has commas in quotation marks".to_string(),
        (true, _) => format!("write text that has {name} in quotation marks"),
        (false, _) => format!("leave a cell empty, but keep its {}", name.trim_end_matches('s')),
    };
    let cells = count_of(found, "cell");
    problems.add(path, row.line, None, format!("{cells}; expected {expected}, as in the header; {hint}"));
    false
}

/// Splits a text into records, which end at line ends outside quotation marks. The second list
/// holds problems with their lines.
fn records(text: &str, separator: char) -> (Vec<Record<'_>>, Vec<(usize, &'static str)>) {
    let end = line_end(text);
    let (mut records, mut slips) = (Vec::new(), Vec::new());
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
            Err(Slip::Text(at)) => slips.push((
                line_of(at),
                "text follows a closing quotation mark; expected the end of the cell, or \"\" for a quotation mark within the cell",
            )),
            Err(Slip::Open(at)) => {
                slips.push((line_of(at), "a quotation mark opens here and is never closed"));
                return (records, slips);
            }
        }
        line = line_of(record.len()) + 1;
        rest = rest.get(record.len() + 1..).unwrap_or_default();
    }
    (records, slips)
}
