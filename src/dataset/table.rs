//! A CSV table: read by polars, with the place of every cell in its file.

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use polars::prelude::{
    ChunkCast, Column, CsvReadOptions, DataFrame, DataType, IntoColumn, SerReader, StringChunked,
};

use super::error::{Problems, did_you_mean};

/// The rows of a file, all cells as text without the blanks around them.
pub(crate) struct Table {
    pub path: PathBuf,
    frame: DataFrame,
    /// Line of each row.
    lines: Vec<usize>,
}

/// A record of the file: where it starts and how many cells it has.
struct Record<'a> {
    line: usize,
    text: &'a str,
    cells: usize,
}

impl Table {
    /// Comments (`#`) and blank lines are passed over. `None` if it cannot be read; what is wrong is
    /// then among the problems.
    pub(crate) fn read(path: &Path, problems: &mut Problems) -> Option<Self> {
        let bytes = match fs::read(path) {
            Ok(bytes) => bytes,
            Err(error) => {
                problems.add(path, None, None, format!("cannot be read: {error}"));
                return None;
            }
        };
        let text = match std::str::from_utf8(&bytes) {
            Ok(text) => text.strip_prefix('\u{feff}').unwrap_or(text),
            Err(error) => {
                let line = bytes[..error.valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
                problems.add(path, Some(line), None, "is not UTF-8 text; save it as UTF-8");
                return None;
            }
        };
        let mut records = match records(text) {
            Ok(records) => records.into_iter(),
            Err(line) => {
                problems.add(path, Some(line), None, "a quotation mark opens here and never closes");
                return None;
            }
        };
        let Some(header) = records.next() else {
            problems.add(path, None, None, "is empty; expected a line of column names");
            return None;
        };
        let mut good = true;
        let mut lines = Vec::new();
        let mut clean = header.text.to_string();
        for record in records {
            if record.cells == header.cells {
                lines.push(record.line);
                clean.push('\n');
                clean.push_str(record.text);
            } else {
                let message = format!("{} cells; expected {}, as in the header", record.cells, header.cells);
                problems.add(path, Some(record.line), None, message);
                good = false;
            }
        }
        let frame = match read_text(clean) {
            Ok(frame) => frame,
            Err(error) => {
                problems.add(path, None, None, format!("cannot be read as CSV: {error}"));
                return None;
            }
        };
        let names = header_names(header.text);
        for (i, name) in names.iter().enumerate() {
            if name.is_empty() {
                problems.add(path, Some(header.line), None, format!("column {} has no name", i + 1));
                good = false;
            } else if names[..i].contains(name) {
                problems.add(path, Some(header.line), Some(name), "stands twice in the header");
                good = false;
            }
        }
        if lines.is_empty() && good {
            problems.add(path, Some(header.line), None, "no rows below the header; expected at least one");
            good = false;
        }
        let frame = good.then(|| tidy(frame, &names)).flatten();
        if good && frame.as_ref().is_none_or(|frame| frame.height() != lines.len()) {
            problems.add(path, None, None, "cannot be read as CSV: rows and lines do not match");
            return None;
        }
        Some(Self { path: path.to_path_buf(), frame: frame?, lines })
    }

    pub(crate) fn rows(&self) -> usize {
        self.lines.len()
    }

    /// Line of a row in the file.
    pub(crate) fn line(&self, row: usize) -> usize {
        self.lines[row]
    }

    pub(crate) fn names(&self) -> Vec<&str> {
        self.frame.get_column_names().into_iter().map(|name| name.as_str()).collect()
    }

    pub(crate) fn has(&self, column: &str) -> bool {
        self.frame.column(column).is_ok()
    }

    /// The cell, `None` if it is empty or there is no such column.
    pub(crate) fn text(&self, column: &str, row: usize) -> Option<&str> {
        let text = self.frame.column(column).ok()?.str().ok()?.get(row)?;
        (!text.is_empty()).then_some(text)
    }

    /// A column of numbers: `None` where a cell is empty, and a problem for each that is no finite
    /// number. `None` for the column if it is not there.
    pub(crate) fn numbers(&self, column: &str, problems: &mut Problems) -> Option<Vec<Option<f64>>> {
        let text = self.frame.column(column).ok()?.str().ok()?;
        let parsed = text.cast(&DataType::Float64);
        let parsed = parsed.ok()?;
        let parsed = parsed.f64().ok()?;
        let mut numbers = Vec::with_capacity(self.rows());
        for row in 0..self.rows() {
            let cell = text.get(row).unwrap_or_default();
            let number = parsed.get(row).filter(|x| x.is_finite());
            if number.is_none() && !cell.is_empty() {
                let hint = if cell.contains(',') { "; write a decimal point" } else { "" };
                let message = format!("\"{cell}\" is not a finite number{hint}");
                problems.add(&self.path, Some(self.line(row)), Some(column), message);
            }
            numbers.push(number);
        }
        Some(numbers)
    }

    /// Complains about a column that must be there and full.
    pub(crate) fn require(&self, column: &str, problems: &mut Problems) {
        if !self.has(column) {
            let near = did_you_mean(column, self.names());
            problems.add(&self.path, None, None, format!("the column {column} is missing{near}"));
            return;
        }
        for row in (0..self.rows()).filter(|row| self.text(column, *row).is_none()) {
            problems.add(&self.path, Some(self.line(row)), Some(column), "is empty; expected a value");
        }
    }
}

/// Every cell as text.
fn read_text(text: String) -> Result<DataFrame, polars::error::PolarsError> {
    CsvReadOptions::default()
        .with_has_header(true)
        .with_infer_schema_length(Some(0))
        .into_reader_with_file_handle(Cursor::new(text.into_bytes()))
        .finish()
}

/// The frame with the header's own names and without blanks around cells.
fn tidy(frame: DataFrame, names: &[String]) -> Option<DataFrame> {
    let height = frame.height();
    let trim = |(column, name): (&Column, &String)| {
        let text = column.str().ok()?;
        let trimmed: StringChunked = text.iter().map(|cell| cell.map(str::trim)).collect();
        Some(trimmed.into_column().with_name(name.as_str().into()))
    };
    let columns: Option<Vec<Column>> = frame.columns().iter().zip(names).map(trim).collect();
    DataFrame::new(height, columns?).ok()
}

/// Splits into records at line ends outside quotation marks. `Err` is the line of a quotation mark
/// that never closes.
fn records(text: &str) -> Result<Vec<Record<'_>>, usize> {
    let mut records = Vec::new();
    let (mut line, mut first_line, mut start, mut cells) = (1, 1, 0, 1);
    let mut quoted = false;
    let mut quote_line = 1;
    let mut push = |start: usize, end: usize, line: usize, cells: usize| {
        let record = text[start..end].trim_end_matches('\r');
        let comment = record.trim_start().starts_with('#');
        if !comment && !record.trim().is_empty() {
            records.push(Record { line, text: record, cells });
        }
    };
    let bytes = text.as_bytes();
    let mut comment = text.trim_start_matches([' ', '\t']).starts_with('#');
    for (i, byte) in bytes.iter().enumerate() {
        match byte {
            b'"' if !comment => {
                quoted = !quoted;
                quote_line = line;
            }
            b',' if !quoted => cells += 1,
            b'\n' => {
                line += 1;
                if !quoted {
                    push(start, i, first_line, cells);
                    (start, first_line, cells) = (i + 1, line, 1);
                    comment = text[i + 1..].trim_start_matches([' ', '\t']).starts_with('#');
                }
            }
            _ => {}
        }
    }
    if quoted {
        return Err(quote_line);
    }
    push(start, text.len(), first_line, cells);
    Ok(records)
}

/// Names in the header, without blanks and quotation marks.
fn header_names(header: &str) -> Vec<String> {
    let mut names = vec![String::new()];
    let mut quoted = false;
    for c in header.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => names.push(String::new()),
            c => names.last_mut().into_iter().for_each(|name| name.push(c)),
        }
    }
    names.into_iter().map(|name| name.trim().to_string()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_know_their_lines() {
        let text = "# a \"comment\na,b\r\n1,2\r\n\n\"x\ny\",3\n  # more\n4,5";
        let found: Vec<_> = records(text).unwrap().iter().map(|r| (r.line, r.cells)).collect();
        assert_eq!(found, [(2, 2), (3, 2), (5, 2), (8, 2)]);
        assert_eq!(records("a\n\"b\n").err(), Some(2));
    }
}
