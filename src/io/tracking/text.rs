//! The text of a file, its lines and their cells.

use std::borrow::Cow;
use std::path::Path;

use super::raw::{FORMAT, Notes};

/// What stands between cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    Char(char),
    /// Any number of blanks and tabs.
    Blanks,
}

impl Separator {
    pub(super) const ALL: [Self; 5] =
        [Self::Char('\t'), Self::Char(';'), Self::Char(','), Self::Char('|'), Self::Char(' ')];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Char('\t') => "tabs",
            Self::Char(';') => "semicolons",
            Self::Char(',') => "commas",
            Self::Char('|') => "bars",
            Self::Char(_) | Self::Blanks => "blanks",
        }
    }

    /// Programs and editors drop such separators at the end of a line.
    pub(super) fn is_white(self) -> bool {
        matches!(self, Self::Blanks | Self::Char(' ' | '\t'))
    }
}

/// The text of a file, without byte order mark.
pub(super) fn decode<'a>(bytes: &'a [u8], file: &Path, notes: &mut Notes) -> Cow<'a, str> {
    let utf16 = |rest: &[u8], unit: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = rest.chunks_exact(2).map(|pair| unit([pair[0], pair[1]])).collect();
        Cow::Owned(String::from_utf16_lossy(&units))
    };
    match bytes {
        [0xff, 0xfe, rest @ ..] => utf16(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => utf16(rest, u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, rest @ ..] | rest => match std::str::from_utf8(rest) {
            Ok(text) => Cow::Borrowed(text),
            Err(error) => {
                let line = rest[..error.valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
                let message = "is not UTF-8 text from here on; read as Latin-1, which matters to names only";
                notes.add(FORMAT, file, Some(line), message);
                Cow::Owned(rest.iter().map(|b| char::from(*b)).collect())
            }
        },
    }
}

/// Lines with their numbers, from 1. Ends of lines may be LF, CRLF or CR.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> + Clone {
    lines_by(text, line_end(text))
}

pub(super) fn line_end(text: &str) -> char {
    if text.contains('\n') { '\n' } else { '\r' }
}

pub(super) fn lines_by(text: &str, end: char) -> impl Iterator<Item = (usize, &str)> + Clone {
    let lines = text.split(end).map(|line| line.strip_suffix('\r').unwrap_or(line));
    lines.enumerate().map(|(i, line)| (i + 1, line))
}

/// The cells of a line, without quotation marks around them (`""` inside is one). `None` where a
/// quotation mark does not close.
pub(super) fn cells(line: &str, separator: Separator) -> Option<Vec<Cow<'_, str>>> {
    let separator = match separator {
        Separator::Blanks => return Some(line.split_whitespace().map(Cow::Borrowed).collect()),
        Separator::Char(c) => c,
    };
    if !line.contains('"') {
        return Some(line.split(separator).map(Cow::Borrowed).collect());
    }
    let mut cells = Vec::new();
    let mut rest = line;
    loop {
        let blanks =
            rest.len() - rest.trim_start_matches(|c: char| c.is_whitespace() && c != separator).len();
        let Some(quoted) = rest[blanks..].strip_prefix('"') else {
            let Some((cell, after)) = rest.split_once(separator) else {
                cells.push(Cow::Borrowed(rest));
                return Some(cells);
            };
            cells.push(Cow::Borrowed(cell));
            rest = after;
            continue;
        };
        let mut cell = String::new();
        let mut inside = quoted;
        let after = loop {
            let (text, after) = inside.split_once('"')?;
            cell.push_str(text);
            match after.strip_prefix('"') {
                Some(more) => {
                    cell.push('"');
                    inside = more;
                }
                None => break after,
            }
        };
        cells.push(Cow::Owned(cell));
        let after = after.trim_start_matches(|c: char| c.is_whitespace() && c != separator);
        if after.is_empty() {
            return Some(cells);
        }
        rest = after.strip_prefix(separator)?;
    }
}

/// The same, trimmed.
pub(super) fn trimmed(line: &str, separator: Separator) -> Option<Vec<String>> {
    Some(cells(line, separator)?.iter().map(|cell| cell.trim().to_string()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_with_and_without_quotation_marks() {
        let split = |line, separator| cells(line, Separator::Char(separator)).map(|c| c.join("|"));
        assert_eq!(split("a,\"b,c\", \"d\"\"e\" ,", ',').unwrap(), "a|b,c|d\"e|");
        assert_eq!(split("\"a\"", ';').unwrap(), "a");
        assert_eq!(split("", ';').unwrap(), "");
        assert_eq!(split("\"a", ';'), None);
        assert_eq!(split("\"a\"b;c", ';'), None);
        assert_eq!(cells(" 1  2 ", Separator::Blanks).unwrap(), ["1", "2"]);
        assert_eq!(split("\t\"a\"\t\"b\"", '\t').unwrap(), "|a|b");
    }

    #[test]
    fn ends_of_lines() {
        for text in ["a\nb", "a\r\nb", "a\rb"] {
            assert_eq!(lines(text).collect::<Vec<_>>(), [(1, "a"), (2, "b")]);
        }
        let mut notes = Notes::default();
        let file = Path::new("x");
        assert_eq!(decode(b"\xef\xbb\xbfa", file, &mut notes), "a");
        assert_eq!(decode(b"\xff\xfea\0", file, &mut notes), "a");
        assert_eq!(decode(b"m\xe9t", file, &mut notes), "mét");
        assert_eq!(notes.into_lines().len(), 1);
    }
}
