//! The text of a file of any kind, its lines, their cells, and the numbers in them.

use std::borrow::Cow;
use std::fs;
use std::path::Path;

use super::error::{Log, message};

/// The mark between cells; `None` stands for any number of blanks and tabs.
pub(crate) type Separator = Option<char>;

/// Separators with their names.
pub(crate) const SEPARATORS: [(char, &str); 5] =
    [('\t', "tabs"), (';', "semicolons"), (',', "commas"), ('|', "bars"), (' ', "blanks")];

pub(crate) fn name_of(separator: Separator) -> &'static str {
    SEPARATORS.iter().find(|(own, _)| separator == Some(*own)).map_or("blanks", |(_, name)| *name)
}

/// Returns the text without byte order mark, and the first line that is not UTF-8, but Latin-1.
pub(crate) fn decode(bytes: &[u8]) -> (Cow<'_, str>, Option<usize>) {
    let utf16 = |rest: &[u8], unit: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = rest.chunks_exact(2).map(|pair| unit([pair[0], pair[1]])).collect();
        (Cow::Owned(String::from_utf16_lossy(&units)), None)
    };
    match bytes {
        [0xff, 0xfe, rest @ ..] => utf16(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => utf16(rest, u16::from_be_bytes),
        // without a mark, two letters of any table begin like this
        [1..=255, 0, 1..=255, 0, ..] => utf16(bytes, u16::from_le_bytes),
        [0, 1..=255, 0, 1..=255, ..] => utf16(bytes, u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, rest @ ..] | rest => match std::str::from_utf8(rest) {
            Ok(text) => (Cow::Borrowed(text), None),
            Err(error) => {
                let end = if rest.contains(&b'\n') { b'\n' } else { b'\r' };
                let line = rest[..error.valid_up_to()].iter().filter(|byte| **byte == end).count() + 1;
                (Cow::Owned(rest.iter().map(|b| char::from(*b)).collect()), Some(line))
            }
        },
    }
}

/// Returns a file as text without byte order mark; `None`, with a problem, if that fails.
pub(crate) fn read_utf8(path: &Path, log: &Log) -> Option<String> {
    let wrong = |error| log.add(path, None, None, format!("cannot be read: {error}"));
    match decode(&fs::read(path).map_err(wrong).ok()?) {
        (text, None) => Some(text.into_owned()),
        (_, line) => {
            log.add(path, line, None, "is not UTF-8 text; save the file as UTF-8");
            None
        }
    }
}

/// Returns the text with a first line such as `sep=;` made blank, and the separator.
pub(crate) fn without_separator_line(text: Cow<'_, str>) -> (Cow<'_, str>, Option<char>) {
    let first = lines(&text).next().map_or("", |(_, line)| line);
    let bare = first.trim_start().trim_end_matches(['\r', '\n', ' ']).trim_matches('"');
    match bare.split_at_checked(4) {
        Some((start, mark)) if start.eq_ignore_ascii_case("sep=") && mark.chars().count() < 2 => {
            (Cow::Owned(text[first.len()..].to_string()), mark.chars().next())
        }
        _ => (text, None),
    }
}

/// Returns a line of names without a comment mark: `# t x y` (numpy), `% t x y` (MATLAB).
pub(crate) fn unmarked(line: &str) -> &str {
    let line = line.trim_end_matches(' ');
    line.trim_start().strip_prefix(['#', '%']).map_or(line, |rest| rest.trim_start_matches(' '))
}

/// Returns the end of lines of a text, without a carriage return before it.
pub(crate) fn line_end(text: &str) -> char {
    if text.contains('\n') { '\n' } else { '\r' }
}

/// Returns lines with their numbers, from 1. Ends of lines may be LF, CRLF or CR.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> + Clone {
    let lines = text.split(line_end(text)).map(|line| line.strip_suffix('\r').unwrap_or(line));
    (1..).zip(lines)
}

/// Returns whether a cell of a line is filled: a spreadsheet ends with rows of empty ones.
pub(crate) fn is_filled(line: &str) -> bool {
    line.contains(|c: char| !c.is_whitespace() && !",;".contains(c))
}

pub(crate) fn filled_lines(text: &str) -> impl Iterator<Item = (usize, &str)> + Clone {
    lines(text).filter(|(_, line)| is_filled(line))
}

/// Returns the first line that is not blank or a comment.
pub(crate) fn line_of_names(text: &str) -> &str {
    let mut lines = filled_lines(text).map(|(_, line)| line);
    lines.find(|line| !line.trim_start().starts_with('#')).unwrap_or_default()
}

/// A quotation mark that does not close, or text after a closing one.
#[derive(Debug, PartialEq)]
pub(crate) enum Slip {
    Open,
    Text,
}

/// Returns the cells of a line without surrounding blanks and quotation marks (`""` inside is one).
pub(crate) fn cells(line: &str, separator: Separator) -> Result<Vec<Cow<'_, str>>, Slip> {
    let Some(separator) = separator else {
        return Ok(line.split_whitespace().map(Cow::Borrowed).collect());
    };
    // one allocation is enough for most tables
    let mut cells = Vec::with_capacity(12);
    if !line.contains('"') {
        cells.extend(line.split(separator).map(|cell| Cow::Borrowed(cell.trim())));
        return Ok(cells);
    }
    let is_blank = |c: char| c.is_whitespace() && c != separator;
    let mut rest = line;
    loop {
        let after = if let Some(quoted) = rest.trim_start_matches(is_blank).strip_prefix('"') {
            // a doubled quotation mark does not close the cell
            let end = quoted.replace("\"\"", "  ").find('"').ok_or(Slip::Open)?;
            cells.push(Cow::Owned(quoted[..end].replace("\"\"", "\"").trim().to_string()));
            quoted[end + 1..].trim_start_matches(is_blank)
        } else {
            let end = rest.find(separator).unwrap_or(rest.len());
            cells.push(Cow::Borrowed(rest[..end].trim()));
            &rest[end..]
        };
        if after.is_empty() {
            return Ok(cells);
        }
        rest = after.strip_prefix(separator).ok_or(Slip::Text)?;
    }
}

/// Returns the cells as strings; `None` if quotation marks are wrong.
pub(crate) fn trimmed(line: &str, separator: Separator) -> Option<Vec<String>> {
    Some(cells(line, separator).ok()?.into_iter().map(Cow::into_owned).collect())
}

/// Returns the fault of a row of `count` cells, below a line with `expected` names.
pub(crate) fn wrong_width(count: usize, expected: usize, line: usize, separator: Separator) -> String {
    message!("wrong_width", count, expected, line, separator => name_of(separator))
}

/// A cell of a table, and its place.
#[derive(Clone, Copy)]
pub(crate) struct Place<'a> {
    pub(crate) file: &'a Path,
    pub(crate) line: usize,
    pub(crate) column: &'a str,
    pub(crate) text: &'a str,
    pub(crate) log: &'a Log,
}

impl Place<'_> {
    pub(crate) fn wrong(&self, message: impl Into<String>) {
        self.log.add(self.file, self.line, self.column, message);
    }
}

/// Words that programs write instead of a missing number, in small letters.
const GAPS: &str = "nan na n/a n/d #n/a #div/0! #value! null none nil ? \\n - -- \u{2013} \u{2014}";
/// Largest number of bytes of a number.
const LONGEST: usize = 64;

/// Reads a cell; `None` if it is empty. A number has a sign (`-`, `+`, U+2212), at most one decimal
/// mark (point or comma) and an exponent (after e or, as in Fortran, d).
pub(crate) fn parse(cell: &str) -> Result<Option<f64>, &'static str> {
    let cell = cell.trim();
    let is_plain =
        |text: &str| text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'.' | b'+' | b'-' | b'e' | b'E'));
    let plain = |c| match c {
        '\u{2212}' => '-',
        ',' => '.',
        'd' | 'D' => 'e',
        c => c,
    };
    // most cells are plain, and are not copied
    let text: Cow<str> = if is_plain(cell) { cell.into() } else { cell.chars().map(plain).collect() };
    let may_be_number = matches!(text, Cow::Borrowed(_)) || is_plain(&text);
    match text.parse().ok().filter(|_| may_be_number) {
        _ if cell.len() > LONGEST => Err("is too long for a number"),
        Some(value) if f64::is_finite(value) => Ok(Some(value)),
        Some(_) => Err("is not a finite number"),
        None if cell.is_empty() || GAPS.split(' ').any(|gap| cell.eq_ignore_ascii_case(gap)) => Ok(None),
        None if may_be_number && cell.matches(MARKS).count() > 1 => {
            Err("has two decimal marks: export without a mark between thousands")
        }
        None => Err("is not a number"),
    }
}

pub(crate) fn value(cell: &str) -> Option<f64> {
    parse(cell).ok().flatten()
}

const MARKS: [char; 2] = ['.', ','];
const MARK_WORDS: [&str; 2] = ["point", "comma"];

/// The decimal mark of one kind of cells (times, or coordinates): the same in all.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mark {
    /// The first lines with each of [`MARKS`].
    seen: [Option<usize>; 2],
    /// The first cell like 1,874, which may be thousands: line, column and cell.
    grouped: Option<(usize, String, String)>,
    /// A whole number of three digits without a mark, with its line: it goes with thousands.
    hundreds: Option<(usize, String)>,
    /// Whether some cell has a mark that can only be a decimal one.
    is_decimal: bool,
}

impl Mark {
    /// Returns the number of a cell, `None` if it is empty or wrong; the latter is a problem.
    pub(crate) fn number(&mut self, cell: Place) -> Option<f64> {
        let value = self.beside(cell)?;
        // marks of the other cells are then no marks of thousands, either
        if self.is_decimal {
            return Some(value);
        }
        let text = cell.text.trim();
        let digits = text.strip_prefix(['-', '+', '\u{2212}']).unwrap_or(text);
        let is_group = |text: &str| text.len() == 3 && text.bytes().all(|byte| byte.is_ascii_digit());
        let begins_with_0 = digits.starts_with('0');
        match digits.split_once(MARKS) {
            None if !begins_with_0 && is_group(digits) => {
                self.hundreds.get_or_insert_with(|| (cell.line, text.to_string()));
            }
            None => {}
            // 1,874 or -12,005; positions of 100,000 and more are none
            Some((whole, rest)) if !begins_with_0 && matches!(whole.len(), 1..=2) && is_group(rest) => {
                self.grouped.get_or_insert_with(|| (cell.line, cell.column.to_string(), text.to_string()));
            }
            Some(_) => self.is_decimal = true,
        }
        Some(value)
    }

    /// Returns the number of a cell in another unit than these, which does not show if marks are of
    /// thousands. Complains once about a mark that differs from that of the cells above.
    pub(crate) fn beside(&mut self, cell: Place) -> Option<f64> {
        let wrong = |why| {
            let text = shortened(cell.text.trim());
            cell.wrong(format!("\"{text}\" {why}; expected a finite number or an empty cell"));
        };
        let value = parse(cell.text).map_err(wrong).ok().flatten()?;
        let mark_of = |byte: u8| MARKS.iter().position(|mark| *mark == char::from(byte));
        let Some(mark) = cell.text.bytes().find_map(mark_of) else { return Some(value) };
        if let (None, Some(line)) = (self.seen[mark], self.seen[1 - mark]) {
            let (text, [own, other]) = (cell.text.trim(), [mark, 1 - mark].map(|mark| MARK_WORDS[mark]));
            cell.wrong(message!("other_mark", text, own, line, other));
        }
        self.seen[mark].get_or_insert(cell.line);
        Some(value)
    }

    /// Complains if 1,874 beside 998 may be 1.874 or 1874.
    pub(crate) fn finish(&self, file: &Path, log: &Log) {
        if let (Some((line, column, cell)), Some((other, plain)), false) =
            (&self.grouped, &self.hundreds, self.is_decimal)
        {
            let mark = MARK_WORDS[usize::from(self.is_comma())];
            let message = message!("may_be_thousands", cell, plain, line => other, mark);
            log.add(file, *line, column.as_str(), message);
        }
    }

    pub(crate) fn is_comma(&self) -> bool {
        self.seen[1].is_some()
    }
}

/// Returns at most 40 characters of a text, for messages.
pub(crate) fn shortened(text: &str) -> String {
    beginning(text, 40)
}

pub(crate) fn beginning(text: &str, most: usize) -> String {
    let end = text.char_indices().nth(most).map(|(end, _)| end);
    end.map_or(text.to_string(), |end| format!("{}…", &text[..end]))
}
