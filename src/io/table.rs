//! A table with commas, semicolons or tabs between its cells, with the place of every cell in its file.

use crate::measurement::number::count_of;
use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use super::error::{Problems, nearest};
use super::number::{Cell, Mark, Place, parse};
use super::text::{Separator, decode, filled_lines, quoted_cell, without_separator_line};

/// The rows of a file, all cells as text without the blanks around them, and where what is wrong with them is put.
pub(crate) struct Table<'a> {
    pub path: PathBuf,
    pub problems: &'a Problems,
    /// Where it is no comma, decimals may have one.
    separator: char,
    header: Record,
    /// Each with as many cells as the header.
    rows: Vec<Record>,
}

/// A record of the file: the line where it starts, and its cells without the blanks around them.
#[derive(Debug, PartialEq)]
struct Record {
    line: usize,
    cells: Vec<String>,
}

impl<'a> Table<'a> {
    /// Comments (`#`) and lines with nothing but blanks and commas are passed over. `None` if it cannot
    /// be read; what is wrong is then among the problems.
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
        let header = rows.remove(0);
        check_header(path, &header, problems)?;
        let expected = header.cells.len();
        let all = rows.len();
        rows.retain(|record| {
            let found = record.cells.len();
            let name = Separator::Char(separator).name();
            let hint = match (found > expected, separator) {
                _ if found == expected => return true,
                (true, ',') => {
                    "write decimals with a point, and text that has commas in quotation marks".to_string()
                }
                (true, _) => format!("write text that has {name} in quotation marks"),
                (false, _) => format!("leave a cell empty, but keep its {}", name.trim_end_matches('s')),
            };
            let cells = count_of(found, "cell");
            let message = format!("{cells}; expected {expected}, as in the header; {hint}");
            problems.add(path, record.line, None, message);
            false
        });
        if rows.is_empty() {
            if all == 0 && slips.is_empty() {
                let hint = if text.contains("\n#") { " (lines that begin with # are comments)" } else { "" };
                let message = format!("no rows below the column names; expected at least one{hint}");
                problems.add(path, header.line, None, message);
            }
            return None;
        }
        Some(Self { path: path.to_path_buf(), problems, separator, header, rows })
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
        self.problems.add(&self.path, self.header.line, column, message);
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows.len()
    }

    /// The row that begins in a line.
    pub(crate) fn row(&self, line: usize) -> Option<usize> {
        self.rows.binary_search_by_key(&line, |row| row.line).ok()
    }

    /// Line of a row in the file.
    pub(crate) fn line(&self, row: usize) -> usize {
        self.rows[row].line
    }

    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.header.cells.iter().map(String::as_str)
    }

    pub(crate) fn has(&self, column: &str) -> bool {
        self.names().any(|name| name == column)
    }

    /// The cell, `None` if it is empty or there is no such column.
    pub(crate) fn text(&self, column: &str, row: usize) -> Option<&str> {
        let column = self.names().position(|name| name == column)?;
        Some(self.rows[row].cells[column].as_str()).filter(|text| !text.is_empty())
    }

    /// A column of numbers: `None` where a cell is empty, and a problem for each that is no finite
    /// number. `None` for the column if it is not there.
    pub(crate) fn numbers(&self, column: &str) -> Option<Vec<Option<f64>>> {
        if !self.has(column) {
            return None;
        }
        let mut marks = Mark::default();
        let number = |row| {
            let text = self.text(column, row)?;
            let cell =
                Place { file: &self.path, line: self.line(row), column, text, problems: self.problems };
            let mut plain = Cow::Borrowed(text);
            if self.separator != ','
                && let Ok(Cell::Number(_, mark)) = parse(text)
            {
                plain = text.replacen(',', ".", 1).into();
                marks.see(mark, cell);
            }
            let number = plain.parse().ok().filter(|x: &f64| x.is_finite());
            if number.is_none() {
                cell.wrong(format!("\"{text}\" is not a finite number; expected {}", remedy(text)));
            }
            number
        };
        let numbers = (0..self.rows()).map(number).collect();
        marks.finish(&self.path, self.problems);
        Some(numbers)
    }

    /// Complains about a column that must be there and full. `known` are the columns that mean
    /// something: a misspelled one is not among them.
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

/// A file as text, without byte order mark. `None` if that fails; why is then among the problems.
pub(crate) fn read_utf8(path: &Path, problems: &Problems) -> Option<String> {
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
    let names = filled_lines(text).find(|(_, line)| !line.trim_start().starts_with('#'));
    let first = names.map_or("", |(_, line)| line);
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
fn check_header(path: &Path, header: &Record, problems: &Problems) -> Option<()> {
    let before = problems.len();
    for (i, name) in header.cells.iter().enumerate() {
        if name.is_empty() {
            problems.add(path, header.line, None, format!("column {} has no name", i + 1));
        } else if header.cells[..i].contains(name) {
            problems.add(path, header.line, name.as_str(), "stands twice among the column names");
        }
    }
    (problems.len() == before).then_some(())
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
