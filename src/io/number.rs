//! Numbers as programs of all countries write them.

use std::path::Path;

use crate::io::error::Problems;

/// A cell of a table, and where it stands.
#[derive(Clone, Copy)]
pub(crate) struct Place<'a> {
    pub file: &'a Path,
    pub line: usize,
    pub column: &'a str,
    pub text: &'a str,
    pub problems: &'a Problems,
}

impl Place<'_> {
    pub(crate) fn wrong(&self, message: impl Into<String>) {
        self.problems.add(self.file, self.line, self.column, message);
    }

    /// The number and its mark; a cell that holds none, and is no gap, is a problem.
    fn read(&self) -> Option<(f64, Option<char>)> {
        match parse(self.text) {
            Ok(Cell::Empty) => None,
            Ok(Cell::Number(number, mark)) => Some((number, mark)),
            Err(why) => {
                let text = shortened(self.text.trim());
                self.wrong(format!("\"{text}\" {why}; expected a finite number, or {GAP}"));
                None
            }
        }
    }
}

/// What a cell holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Cell {
    Empty,
    /// With the decimal mark that it is written with, if any.
    Number(f64, Option<char>),
}

/// What programs write where there is no number, in small letters.
const GAPS: [&str; 16] = [
    "nan", "na", "n/a", "n/d", "#n/a", "#div/0!", "#value!", "null", "none", "nil", "?", "\\n", "-", "--",
    "\u{2013}", "\u{2014}",
];

/// No number has so many characters.
const LONGEST: usize = 64;

/// How to write that there is none, for messages.
const GAP: &str = "an empty cell where there is none";

/// Reads a cell, `Err` with what is wrong with it. The whole cell must be a number: sign (`-`, `+` or
/// U+2212), digits with at most one decimal mark (point or comma), exponent.
pub(crate) fn parse(cell: &str) -> Result<Cell, &'static str> {
    let cell = cell.trim();
    // as most programs write it
    let is_plain = |byte: u8| byte.is_ascii_digit() || b".-eE".contains(&byte);
    if cell.len() <= LONGEST
        && cell.bytes().all(is_plain)
        && let Ok(number) = cell.parse::<f64>()
        && number.is_finite()
    {
        return Ok(Cell::Number(number, cell.contains('.').then_some('.')));
    }
    if cell.is_empty() || GAPS.iter().any(|gap| cell.eq_ignore_ascii_case(gap)) {
        return Ok(Cell::Empty);
    }
    if cell.len() > LONGEST {
        return Err("is too long for a number");
    }
    let mut plain = String::with_capacity(cell.len());
    let (mut mark, mut digits, mut exponent) = (None, 0, false);
    let mut before = ' ';
    for c in cell.chars() {
        match c {
            '0'..='9' => {
                digits += 1;
                plain.push(c);
            }
            '-' | '+' | '\u{2212}' if before == ' ' || before == 'e' => {
                plain.push(if c == '+' { '+' } else { '-' });
            }
            '.' | ',' if exponent => return Err("is no number"),
            '.' | ',' if mark.is_some() => {
                return Err("has two decimal marks: export without a mark between thousands");
            }
            '.' | ',' => {
                mark = Some(c);
                plain.push('.');
            }
            // Fortran has d for e
            'e' | 'E' | 'd' | 'D' if !exponent && digits > 0 => {
                exponent = true;
                digits = 0;
                plain.push('e');
            }
            _ => return Err("is no number"),
        }
        before = if matches!(c, 'E' | 'd' | 'D') { 'e' } else { c };
    }
    if digits == 0 {
        return Err("is no number");
    }
    match plain.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(Cell::Number(number, mark)),
        _ => Err("is no finite number"),
    }
}

/// The number that a cell holds, if it holds one.
pub(crate) fn value(cell: &str) -> Option<f64> {
    match parse(cell) {
        Ok(Cell::Number(number, _)) => Some(number),
        _ => None,
    }
}

/// The decimal mark of the cells of one kind (times, or coordinates): it must be the same in all, and no mark of thousands.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mark {
    /// With the line of the first.
    seen: Option<(char, usize)>,
    complained: bool,
    /// The first cell like 1,874, which may be thousands: line, column and cell.
    grouped: Option<(usize, String, String)>,
    /// A whole number of three digits without a mark, with its line: it goes with thousands.
    hundreds: Option<(usize, String)>,
    /// Some cell has a mark that can only be a decimal one.
    decimal: bool,
}

impl Mark {
    /// The number of a cell, `None` if it is empty or wrong; the latter is a problem, located.
    pub(crate) fn number(&mut self, cell: Place) -> Option<f64> {
        let (number, mark) = cell.read()?;
        self.see(mark, cell);
        Some(number)
    }

    /// The same, of what stands beside these cells in a unit of its own: it tells nothing of thousands.
    pub(crate) fn beside(&mut self, cell: Place) -> Option<f64> {
        let (number, mark) = cell.read()?;
        if let Some(mark) = mark {
            self.check(mark, cell);
        }
        Some(number)
    }

    /// Takes account of a cell that holds a number with this mark, if any.
    pub(crate) fn see(&mut self, mark: Option<char>, cell: Place) {
        let text = cell.text.trim();
        let Some(mark) = mark else {
            if self.hundreds.is_none() && is_three_digits(text) {
                self.hundreds = Some((cell.line, text.to_string()));
            }
            return;
        };
        if !self.decimal {
            if !may_be_thousands(text, mark) {
                self.decimal = true;
            } else if self.grouped.is_none() {
                self.grouped = Some((cell.line, cell.column.to_string(), text.to_string()));
            }
        }
        self.check(mark, cell);
    }

    /// Complains where nothing tells whether 1,874 beside 998 is 1.874 or 1874.
    pub(crate) fn finish(&self, file: &Path, problems: &Problems) {
        let (Some((line, column, cell)), Some((other, plain)), false) =
            (&self.grouped, &self.hundreds, self.decimal)
        else {
            return;
        };
        let message = format!(
            "\"{cell}\" beside \"{plain}\" (line {other}) may be thousands or have a decimal {}; expected numbers without a mark \
             between thousands, and more digits where it is decimal",
            self.seen.map_or("mark", |(mark, _)| word(mark))
        );
        problems.add(file, *line, column.as_str(), message);
    }

    fn check(&mut self, mark: char, cell: Place) {
        let (other, at) = *self.seen.get_or_insert((mark, cell.line));
        if other != mark && !self.complained {
            self.complained = true;
            cell.wrong(format!(
                "\"{}\" has a decimal {}, but line {at} a decimal {}; expected one of them throughout",
                cell.text.trim(),
                word(mark),
                word(other)
            ));
        }
    }

    pub(crate) fn is_comma(&self) -> bool {
        self.seen.is_some_and(|(mark, _)| mark == ',')
    }
}

fn unsigned(cell: &str) -> &str {
    cell.strip_prefix(['-', '+', '\u{2212}']).unwrap_or(cell)
}

fn is_digits(text: &str) -> bool {
    text.bytes().all(|byte| byte.is_ascii_digit())
}

fn is_three_digits(cell: &str) -> bool {
    let digits = unsigned(cell);
    digits.len() == 3 && !digits.starts_with('0') && is_digits(digits)
}

/// Whether a number is written like 1,874 or -12,005: up to three digits, the mark, and three digits.
fn may_be_thousands(cell: &str, mark: char) -> bool {
    unsigned(cell).split_once(mark).is_some_and(|(whole, rest)| {
        (1..=3).contains(&whole.len())
            && !whole.starts_with('0')
            && rest.len() == 3
            && is_digits(whole)
            && is_digits(rest)
    })
}

fn word(mark: char) -> &'static str {
    if mark == ',' { "comma" } else { "point" }
}

/// For messages: no more than 40 characters.
pub(crate) fn shortened(text: &str) -> String {
    if text.chars().count() <= 40 {
        return text.to_string();
    }
    text.chars().take(40).chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_of_writing_a_number() {
        let number = |cell: &str| match parse(cell) {
            Ok(Cell::Number(number, _)) => number,
            other => panic!("{cell}: {other:?}"),
        };
        assert_eq!(number("\u{2212}1,555276E1"), -15.55276);
        assert_eq!(number("1,000000E\u{2212}2"), 0.01);
        assert_eq!(number(" +.5 "), 0.5);
        assert_eq!(number("5."), 5.0);
        assert_eq!(number("1e-4"), 1e-4);
        assert_eq!(number("6.25D-01"), 0.625);
        for gap in ["", "  ", "NaN", "nan", "NA", "-", "--", "n/a", "#N/A", "None", "null", "\\N"] {
            assert_eq!(parse(gap), Ok(Cell::Empty));
        }
        let wrong = "1.234,5|1,234,567|1 2|0x1|inf|1e999|e5|.|---|--1|1e|1e1.5|1-2|1_0|１|1e5e5|+-1";
        for wrong in wrong.split('|') {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn thousands_are_not_taken_for_decimals() {
        let said = |cells: &[&str]| {
            let (mut mark, problems, file) = (Mark::default(), Problems::new(""), Path::new("a.csv"));
            for (i, text) in cells.iter().enumerate() {
                mark.number(Place { file, line: i + 2, column: "x", text, problems: &problems });
            }
            mark.finish(file, &problems);
            problems.into_error().to_string()
        };
        for cells in [["998", "1,002"], ["1.002", "-998"]] {
            let said = said(&cells);
            assert!(
                said.contains("a.csv:") && said.contains("column x") && said.contains("thousands"),
                "{said}"
            );
        }
        for cells in [
            &["998", "1,002", "0,5"][..],
            &["1,002", "0,998"],
            &["12", "1,002"],
            &["998", "1.5"],
            &["1.002", "0"],
        ] {
            assert!(!said(cells).contains("thousands"), "{cells:?}");
        }
    }
}
