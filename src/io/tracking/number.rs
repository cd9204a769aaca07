//! Numbers as programs of all countries write them.

use std::path::Path;

use crate::io::error::Problems;

/// What a cell holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cell {
    Empty,
    /// With the decimal mark that it is written with, if any.
    Number(f64, Option<char>),
}

/// Reads a cell, `Err` with what is wrong with it. The whole cell must be a number: sign (`-`, `+` or
/// U+2212), digits with at most one decimal mark (point or comma), exponent.
pub(super) fn parse(cell: &str) -> Result<Cell, &'static str> {
    let cell = cell.trim();
    if cell.is_empty() || ["nan", "na", "null"].iter().any(|gap| cell.eq_ignore_ascii_case(gap)) {
        return Ok(Cell::Empty);
    }
    if cell.len() > 64 {
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
                return Err("has two decimal marks (thousands are not to be grouped)");
            }
            '.' | ',' => {
                mark = Some(c);
                plain.push('.');
            }
            'e' | 'E' if !exponent && digits > 0 => {
                exponent = true;
                digits = 0;
                plain.push('e');
            }
            _ => return Err("is no number"),
        }
        before = if c == 'E' { 'e' } else { c };
    }
    if digits == 0 {
        return Err("is no number");
    }
    match plain.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(Cell::Number(number, mark)),
        _ => Err("is no finite number"),
    }
}

/// The decimal mark of the cells of one kind (times, or coordinates): it must be the same in all.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mark {
    /// With the line of the first.
    seen: Option<(char, usize)>,
    complained: bool,
}

impl Mark {
    /// The number of a cell, `None` if it is empty or wrong; the latter is a problem, located.
    pub(super) fn number(
        &mut self,
        cell: &str,
        file: &Path,
        line: usize,
        column: &str,
        problems: &mut Problems,
    ) -> Option<f64> {
        match parse(cell) {
            Ok(Cell::Empty) => None,
            Ok(Cell::Number(number, mark)) => {
                if let Some(mark) = mark {
                    self.check(mark, cell, file, line, column, problems);
                }
                Some(number)
            }
            Err(why) => {
                let message = format!("\"{}\" {why}; expected a finite number", shortened(cell.trim()));
                problems.add(file, Some(line), Some(column), message);
                None
            }
        }
    }

    fn check(
        &mut self,
        mark: char,
        cell: &str,
        file: &Path,
        line: usize,
        column: &str,
        problems: &mut Problems,
    ) {
        match self.seen {
            None => self.seen = Some((mark, line)),
            Some((other, at)) if other != mark && !self.complained => {
                self.complained = true;
                let message = format!(
                    "\"{}\" has a decimal {}, but line {at} a decimal {}; expected one of them throughout",
                    cell.trim(),
                    word(mark),
                    word(other)
                );
                problems.add(file, Some(line), Some(column), message);
            }
            Some(_) => {}
        }
    }

    pub(super) fn seen(self) -> Option<char> {
        self.seen.map(|(mark, _)| mark)
    }

    pub(super) fn is_comma(self) -> bool {
        self.seen.is_some_and(|(mark, _)| mark == ',')
    }
}

fn word(mark: char) -> &'static str {
    if mark == ',' { "comma" } else { "point" }
}

/// For messages: no more than 40 characters.
pub(super) fn shortened(text: &str) -> String {
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
        for gap in ["", "  ", "NaN", "nan", "NA"] {
            assert_eq!(parse(gap), Ok(Cell::Empty));
        }
        for wrong in [
            "1.234,5",
            "1,234,567",
            "1 2",
            "0x1",
            "inf",
            "1e999",
            "e5",
            ".",
            "-",
            "--1",
            "1e",
            "1e1.5",
            "1-2",
            "1_0",
            "１",
            "1e5e5",
            "+-1",
        ] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
