//! The text of a file of any kind, its lines and their cells.

use std::borrow::Cow;
use std::fs;
use std::path::Path;

use super::error::Problems;

/// The mark between cells; `None` stands for any number of blanks and tabs.
pub(crate) type Separator = Option<char>;

/// Separators with their names.
pub(crate) const SEPARATORS: [(char, &str); 5] =
    [('\t', "tabs"), (';', "semicolons"), (',', "commas"), ('|', "bars"), (' ', "blanks")];

pub(crate) fn name_of(separator: Separator) -> &'static str {
    SEPARATORS.iter().find(|(own, _)| separator == Some(*own)).map_or("blanks", |(_, name)| *name)
}

/// Returns the text of a file without byte order mark, and the first line that is not UTF-8: from
/// it on the file was read as Latin-1.
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

/// Returns the text with a first line such as `sep=;`, which names the separator for spreadsheets,
/// made blank, and that separator.
pub(crate) fn without_separator_line(text: Cow<'_, str>) -> (Cow<'_, str>, Option<char>) {
    let first = lines(&text).next().map_or("", |(_, line)| line);
    let bare = first.trim_start().trim_end_matches(['\r', '\n', ' ']).trim_matches('"');
    if !bare.get(..4).is_some_and(|start| start.eq_ignore_ascii_case("sep=")) || bare[4..].chars().count() > 1
    {
        return (text, None);
    }
    (Cow::Owned(text[first.len()..].to_string()), bare[4..].chars().next())
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

pub(crate) fn filled_lines(text: &str) -> impl Iterator<Item = (usize, &str)> + Clone {
    lines(text).filter(|(_, line)| !line.trim().is_empty())
}

/// A quotation mark that does not close, or text after a closing one, with its byte.
#[derive(Debug, PartialEq)]
pub(crate) enum Slip {
    Open(usize),
    Text(usize),
}

/// Returns the cells of a line without surrounding blanks and quotation marks (`""` inside is one).
pub(crate) fn cells(line: &str, separator: Separator) -> Result<Vec<Cow<'_, str>>, Slip> {
    let Some(separator) = separator else {
        return Ok(line.split_whitespace().map(Cow::Borrowed).collect());
    };
    if !line.contains('"') {
        return Ok(line.split(separator).map(|cell| Cow::Borrowed(cell.trim())).collect());
    }
    let is_blank = |c: char| c.is_whitespace() && c != separator;
    let (mut cells, mut rest) = (Vec::new(), line);
    loop {
        let at = |part: &str| line.len() - part.len();
        let after = if let Some(quoted) = rest.trim_start_matches(is_blank).strip_prefix('"') {
            // a doubled quotation mark does not close the cell
            let end = quoted.replace("\"\"", "  ").find('"').ok_or(Slip::Open(at(quoted)))?;
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
        rest = after.strip_prefix(separator).ok_or(Slip::Text(at(after)))?;
    }
}

/// Returns the cells of a line as strings; `None` if its quotation marks are wrong.
pub(crate) fn trimmed(line: &str, separator: Separator) -> Option<Vec<String>> {
    Some(cells(line, separator).ok()?.into_iter().map(Cow::into_owned).collect())
}
