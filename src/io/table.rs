//! A table with commas, semicolons or tabs between its cells: read by polars, with the place of every cell in its file.

use std::borrow::Cow;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use polars::error::PolarsError;
use polars::prelude::{CsvReadOptions, DataFrame, SerReader};

use super::error::{Problems, nearest};
use super::number::{Cell, Mark, parse};
use super::text::{Separator, decode, lines, without_separator_line};

/// The rows of a file, all cells as text without the blanks around them.
pub(crate) struct Table {
    pub path: PathBuf,
    frame: DataFrame,
    /// Where it is no comma, decimals may have one.
    separator: char,
    /// Line of the column names.
    header: usize,
    /// Line of each row.
    lines: Vec<usize>,
}

/// A record of the file: the line where it starts, and its cells without the blanks around them.
#[derive(Debug, PartialEq)]
struct Record {
    line: usize,
    cells: Vec<String>,
}

impl Table {
    /// Comments (`#`) and lines with nothing but blanks and commas are passed over. `None` if it cannot
    /// be read; what is wrong is then among the problems.
    pub(crate) fn read(path: &Path, problems: &mut Problems) -> Option<Self> {
        let text = read_utf8(path, problems)?;
        let (text, told) = without_separator_line(text.into());
        let separator = told.unwrap_or_else(|| separator(&text));
        let (records, slips) = records(&text, separator);
        for (line, message) in &slips {
            problems.add(path, Some(*line), None, *message);
        }
        let mut records = records.into_iter();
        let Some(header) = records.next() else {
            if slips.is_empty() {
                problems.add(
                    path,
                    None,
                    None,
                    "is empty; expected a line of column names, and rows below it",
                );
            }
            return None;
        };
        check_header(path, &header, problems)?;
        let (mut lines, mut rows, mut ragged) = (Vec::new(), Vec::new(), false);
        for record in records {
            let (found, expected) = (record.cells.len(), header.cells.len());
            if found == expected {
                lines.push(record.line);
                rows.push(record.cells);
                continue;
            }
            ragged = true;
            let name = Separator::Char(separator).name();
            let hint = match (found > expected, separator) {
                (true, ',') => {
                    "; write decimals with a point, and text that has commas in quotation marks".to_string()
                }
                (true, _) => format!("; write text that has {name} in quotation marks"),
                (false, _) => format!("; leave a cell empty, but keep its {}", name.trim_end_matches('s')),
            };
            let message = format!(
                "{found} cell{}; expected {expected}, as in the header{hint}",
                if found == 1 { "" } else { "s" }
            );
            problems.add(path, Some(record.line), None, message);
        }
        if rows.is_empty() {
            if !ragged && slips.is_empty() {
                let hint = if text.contains("\n#") { " (lines that begin with # are comments)" } else { "" };
                let message = format!("no rows below the column names; expected at least one{hint}");
                problems.add(path, Some(header.line), None, message);
            }
            return None;
        }
        match frame(&header.cells, &rows) {
            Ok(frame) if frame.height() == lines.len() => {
                Some(Self { path: path.to_path_buf(), frame, separator, header: header.line, lines })
            }
            Ok(_) => {
                problems.add(path, None, None, "cannot be read as CSV: rows and lines do not match");
                None
            }
            Err(error) => {
                problems.add(path, None, None, format!("cannot be read as CSV: {error}"));
                None
            }
        }
    }

    pub(crate) fn rows(&self) -> usize {
        self.lines.len()
    }

    /// Line of the column names.
    pub(crate) fn header(&self) -> usize {
        self.header
    }

    /// The row that begins in a line.
    pub(crate) fn row(&self, line: usize) -> Option<usize> {
        self.lines.binary_search(&line).ok()
    }

    /// Line of a row in the file.
    pub(crate) fn line(&self, row: usize) -> usize {
        self.lines[row]
    }

    pub(crate) fn names(&self) -> Vec<&str> {
        self.frame.get_column_names().into_iter().map(AsRef::as_ref).collect()
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
        if !self.has(column) {
            return None;
        }
        let mut marks = Mark::default();
        let mut number = |row| {
            let cell = self.text(column, row)?;
            let mut plain = Cow::Borrowed(cell);
            if self.separator != ','
                && let Ok(Cell::Number(_, mark)) = parse(cell)
            {
                plain = cell.replacen(',', ".", 1).into();
                marks.see(mark, cell, &self.path, self.line(row), column, problems);
            }
            let number = plain.parse().ok().filter(|x: &f64| x.is_finite());
            if number.is_none() {
                let message = format!("\"{cell}\" is not a finite number; expected {}", remedy(cell));
                problems.add(&self.path, Some(self.line(row)), Some(column), message);
            }
            number
        };
        let numbers = (0..self.rows()).map(&mut number).collect();
        marks.finish(&self.path, problems);
        Some(numbers)
    }

    /// Complains about a column that must be there and full. `known` are the columns that mean
    /// something: a misspelled one is not among them.
    pub(crate) fn require(&self, column: &str, known: &[&str], problems: &mut Problems) {
        if !self.has(column) {
            let others = self.names().into_iter().filter(|name| !known.contains(name));
            let near = nearest(column, others);
            let near = near.map_or(String::new(), |name| format!("; is \"{name}\" meant to be it?"));
            let message = format!("is missing from the column names{near}");
            problems.add(&self.path, Some(self.header), Some(column), message);
            return;
        }
        for row in (0..self.rows()).filter(|row| self.text(column, *row).is_none()) {
            problems.add(&self.path, Some(self.line(row)), Some(column), "is empty; expected a value");
        }
    }
}

/// A file as text, without byte order mark. `None` if that fails; why is then among the problems.
pub(crate) fn read_utf8(path: &Path, problems: &mut Problems) -> Option<String> {
    let bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) => {
            problems.add(path, None, None, format!("cannot be read: {error}"));
            return None;
        }
    };
    match decode(&bytes) {
        (text, None) => Some(text.into_owned()),
        (_, line) => {
            problems.add(path, line, None, "is not UTF-8 text; save the file as UTF-8");
            None
        }
    }
}

/// What most likely stands between the cells of a table: what its line of names has most of.
pub(crate) fn separator(text: &str) -> char {
    let is_name = |line: &&str| !(line.trim().is_empty() || line.trim_start().starts_with('#'));
    let first = lines(text).map(|(_, line)| line).find(is_name).unwrap_or_default();
    // of equally many the last one
    ['\t', ';', ','].into_iter().max_by_key(|c| first.matches(*c).count()).unwrap_or(',')
}

/// What to write instead of a cell that is no number.
fn remedy(cell: &str) -> String {
    let with_point = cell.replacen(',', ".", 1);
    let with_minus = cell.replacen(['−', '–'], "-", 1);
    if cell.contains(',') && with_point.parse::<f64>().is_ok() {
        format!("a decimal point, {with_point}")
    } else if cell != with_minus && with_minus.parse::<f64>().is_ok() {
        format!("a plain minus sign, {with_minus}")
    } else if matches!(
        cell.to_lowercase().as_str(),
        "nan" | "na" | "n/a" | "null" | "none" | "-" | "--" | "?"
    ) {
        "an empty cell where nothing is known".to_string()
    } else if cell.parse().is_ok_and(f64::is_infinite) && cell.contains(|c: char| c.is_ascii_digit()) {
        format!("one between {:?} and {:?}", f64::MIN, f64::MAX)
    } else {
        "one such as -1.5 or 2e-3".to_string()
    }
}

/// `None` if a table with these column names cannot be read.
fn check_header(path: &Path, header: &Record, problems: &mut Problems) -> Option<()> {
    let line = Some(header.line);
    let mut good = true;
    for (i, name) in header.cells.iter().enumerate() {
        if name.is_empty() {
            problems.add(path, line, None, format!("column {} has no name", i + 1));
            good = false;
        } else if header.cells[..i].contains(name) {
            problems.add(path, line, Some(name), "stands twice among the column names");
            good = false;
        }
    }
    good.then_some(())
}

/// Every cell as text. The records are written anew, all in quotation marks, so that polars cannot
/// see other cells in them.
fn frame(names: &[String], rows: &[Vec<String>]) -> Result<DataFrame, PolarsError> {
    let mut text = String::new();
    for row in std::iter::once(names).chain(rows.iter().map(Vec::as_slice)) {
        for (i, cell) in row.iter().enumerate() {
            text.push_str(if i > 0 { "," } else { "" });
            if !cell.is_empty() {
                text.push('"');
                text.push_str(&cell.replace('"', "\"\""));
                text.push('"');
            }
        }
        text.push('\n');
    }
    let mut frame = CsvReadOptions::default()
        .with_has_header(true)
        .with_infer_schema_length(Some(0))
        .into_reader_with_file_handle(Cursor::new(text.into_bytes()))
        .finish()?;
    frame.set_column_names(names)?;
    Ok(frame)
}

/// Splits into records: cells end at separators, records at line ends, unless within quotation marks,
/// which a cell begins and ends with and in which a doubled one stands for itself. The second list
/// says what is wrong in which line.
fn records(text: &str, separator: char) -> (Vec<Record>, Vec<(usize, &'static str)>) {
    // the line ends of old spreadsheets
    let carriage_returns = !text.contains('\n');
    let is_end = |c: char| c == '\n' || (carriage_returns && c == '\r');
    let is_blank = |c: char| c.is_whitespace() && !is_end(c) && c != separator;
    let (mut records, mut slips) = (Vec::new(), Vec::new());
    let (mut rest, mut line) = (text, 1);
    while !rest.is_empty() {
        let (first_line, mut cells, mut slipped) = (line, Vec::new(), false);
        let comment = rest.trim_start_matches(is_blank).starts_with('#');
        loop {
            let cell = rest.trim_start_matches(is_blank);
            if let Some(quoted) = cell.strip_prefix('"').filter(|_| !comment) {
                let Some((inside, after)) = quoted_cell(quoted) else {
                    slips.push((line, "a quotation mark opens here and is never closed"));
                    return (records, slips);
                };
                let lines = inside.matches(is_end).count();
                let after = after.trim_start_matches(is_blank);
                if !(after.is_empty() || after.starts_with(separator) || after.starts_with(is_end)) {
                    let message = "text follows a closing quotation mark; expected the end of the cell, or \"\" \
                                   for a quotation mark within the cell";
                    slips.push((line + lines, message));
                    slipped = true;
                }
                line += lines;
                cells.push(inside.replace("\"\"", "\"").trim().to_string());
                let end = after.find(|c| is_end(c) || (c == separator && !slipped)).unwrap_or(after.len());
                rest = &after[end..];
            } else {
                let end = cell.find(|c| is_end(c) || (c == separator && !comment)).unwrap_or(cell.len());
                cells.push(cell[..end].trim_end().to_string());
                rest = &cell[end..];
            }
            match rest.strip_prefix(separator) {
                Some(next) => rest = next,
                None => break,
            }
        }
        // past the line end
        rest = rest.get(1..).unwrap_or_default();
        line += 1;
        if !(comment || slipped || cells.iter().all(String::is_empty)) {
            records.push(Record { line: first_line, cells });
        }
    }
    (records, slips)
}

/// Splits after a quotation mark into what is before the one that closes it and what is after.
fn quoted_cell(text: &str) -> Option<(&str, &str)> {
    let mut from = 0;
    loop {
        let at = from + text[from..].find('"')?;
        if !text[at + 1..].starts_with('"') {
            return Some((&text[..at], &text[at + 1..]));
        }
        from = at + 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(line: usize, cells: &[&str]) -> Record {
        Record { line, cells: cells.iter().map(ToString::to_string).collect() }
    }

    #[test]
    fn records_know_their_lines() {
        let text = "# a \"comment, and\na,b\r\n1,\t2 \r\n\n \"x, \"\"\ny\" ,3\r\n , \n  # more\n4\",5";
        let expected = [
            record(2, &["a", "b"]),
            record(3, &["1", "2"]),
            record(5, &["x, \"\ny", "3"]),
            record(9, &["4\"", "5"]),
        ];
        assert_eq!(records(text, ','), (expected.into(), vec![]));
        assert_eq!(records("a,b\r1,\r", ','), (vec![record(1, &["a", "b"]), record(2, &["1", ""])], vec![]));
    }

    #[test]
    fn quotation_marks_that_do_not_fit() {
        let (found, slips) = records("a\n\"b\n\"c,\"d\ne\n\"f,g\n", ',');
        assert_eq!(found, [record(1, &["a"]), record(4, &["e"])]);
        assert_eq!(slips.iter().map(|(line, _)| *line).collect::<Vec<_>>(), [3, 5]);
    }
}
