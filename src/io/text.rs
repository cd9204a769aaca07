//! The text of a file of any kind, its lines and their cells.

use std::borrow::Cow;

/// What stands between cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Separator {
    Char(char),
    /// Any number of blanks and tabs.
    Blanks,
}

impl Separator {
    pub(crate) const ALL: [Self; 5] =
        [Self::Char('\t'), Self::Char(';'), Self::Char(','), Self::Char('|'), Self::Char(' ')];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Char('\t') => "tabs",
            Self::Char(';') => "semicolons",
            Self::Char(',') => "commas",
            Self::Char('|') => "bars",
            Self::Char(_) | Self::Blanks => "blanks",
        }
    }

    /// Programs and editors drop such separators at the end of a line.
    pub(crate) fn is_white(self) -> bool {
        matches!(self, Self::Blanks | Self::Char(' ' | '\t'))
    }
}

/// The text of a file, without byte order mark, and the line from which on it was read as Latin-1 since it is not UTF-8.
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
                let good = &rest[..error.valid_up_to()];
                let end = if rest.contains(&b'\n') { b'\n' } else { b'\r' };
                let line = good.iter().filter(|byte| **byte == end).count() + 1;
                (Cow::Owned(rest.iter().map(|b| char::from(*b)).collect()), Some(line))
            }
        },
    }
}

/// The text without a first line that only tells a spreadsheet what stands between cells, as `sep=;` does; a blank line is in its
/// place, so that all others keep their numbers. With the separator that it tells.
pub(crate) fn without_separator_line(text: Cow<'_, str>) -> (Cow<'_, str>, Option<char>) {
    let first = lines(&text).next().map_or("", |(_, line)| line);
    let Some(told) = separator_line(first) else { return (text, None) };
    let rest = text[first.len()..].to_string();
    (Cow::Owned(rest), told)
}

/// Whether a line is `sep=;` or like it, and the separator that it tells.
fn separator_line(line: &str) -> Option<Option<char>> {
    let bare = line.trim_start().trim_end_matches(['\r', '\n', ' ']).trim_matches('"');
    bare.get(..4).filter(|start| start.eq_ignore_ascii_case("sep="))?;
    let mut rest = bare[4..].chars();
    let told = rest.next();
    rest.next().is_none().then_some(told)
}

/// A line of names that programs have marked as a comment, without the mark: `# t x y` (numpy), `% t x y` (MATLAB).
pub(crate) fn unmarked(line: &str) -> &str {
    let line = line.trim_end_matches(' ');
    line.trim_start().strip_prefix(['#', '%']).map_or(line, |rest| rest.trim_start_matches(' '))
}

/// Lines with their numbers, from 1. Ends of lines may be LF, CRLF or CR.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> + Clone {
    let end = if text.contains('\n') { '\n' } else { '\r' };
    let lines = text.split(end).map(|line| line.strip_suffix('\r').unwrap_or(line));
    (1..).zip(lines)
}

/// Those that are not blank.
pub(crate) fn filled_lines(text: &str) -> impl Iterator<Item = (usize, &str)> + Clone {
    lines(text).filter(|(_, line)| !line.trim().is_empty())
}

/// The first of them below so many lines.
pub(crate) fn filled_below(text: &str, above: usize) -> Option<(usize, &str)> {
    lines(text).skip(above).find(|(_, line)| !line.trim().is_empty())
}

/// Returns the cells of a line, without quotation marks around them (`""` inside is one). `None` if a quotation mark does not close.
pub(crate) fn cells(line: &str, separator: Separator) -> Option<Vec<Cow<'_, str>>> {
    let mut cells = Vec::new();
    split_into(&mut cells, line, separator).then_some(cells)
}

/// Puts the cells of a line in the place of others, as [`cells`] does; returns whether all quotation marks close.
pub(crate) fn split_into<'t>(cells: &mut Vec<Cow<'t, str>>, line: &'t str, separator: Separator) -> bool {
    cells.clear();
    let separator = match separator {
        Separator::Blanks => {
            cells.extend(line.split_whitespace().map(Cow::Borrowed));
            return true;
        }
        Separator::Char(c) => c,
    };
    if !line.contains('"') {
        cells.extend(line.split(separator).map(Cow::Borrowed));
        return true;
    }
    let is_blank = |c: char| c.is_whitespace() && c != separator;
    let mut rest = line;
    loop {
        let Some(quoted) = rest.trim_start_matches(is_blank).strip_prefix('"') else {
            let Some((cell, after)) = rest.split_once(separator) else {
                cells.push(Cow::Borrowed(rest));
                return true;
            };
            cells.push(Cow::Borrowed(cell));
            rest = after;
            continue;
        };
        let Some((inside, after)) = quoted_cell(quoted) else { return false };
        cells.push(Cow::Owned(inside.replace("\"\"", "\"")));
        let after = after.trim_start_matches(is_blank);
        if after.is_empty() {
            return true;
        }
        let Some(next) = after.strip_prefix(separator) else { return false };
        rest = next;
    }
}

/// Splits after a quotation mark into what is before the one that closes it and what is after.
pub(crate) fn quoted_cell(text: &str) -> Option<(&str, &str)> {
    let mut from = 0;
    loop {
        let at = from + text[from..].find('"')?;
        if !text[at + 1..].starts_with('"') {
            return Some((&text[..at], &text[at + 1..]));
        }
        from = at + 2;
    }
}

/// The cells of a line, trimmed.
pub(crate) fn trimmed(line: &str, separator: Separator) -> Option<Vec<String>> {
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
    }

    #[test]
    fn encodings() {
        for bytes in
            [&b"\xef\xbb\xbft,x"[..], b"\xff\xfet\0,\0x\0", b"\xfe\xff\0t\0,\0x", b"t\0,\0x\0", b"\0t\0,\0x"]
        {
            assert_eq!(decode(bytes), ("t,x".into(), None), "{bytes:?}");
        }
        assert_eq!(decode(b"m\xe9t"), ("mét".into(), Some(1)));
        assert_eq!(decode(b"a\rm\xe9t"), ("a\rmét".into(), Some(2)));
    }

    #[test]
    fn what_a_spreadsheet_is_told_of_separators() {
        let told = [("sep=;", ';'), ("SEP=,", ','), ("\"sep=;\"", ';'), ("sep=\t", '\t')];
        for (line, separator) in told {
            assert_eq!(separator_line(line), Some(Some(separator)), "{line:?}");
        }
        assert_eq!(separator_line("sep="), Some(None));
        for line in ["sep=;;", "t;x;y", "", "ça=;"] {
            assert_eq!(separator_line(line), None, "{line:?}");
        }
        assert_eq!(without_separator_line("sep=;\r\na;b".into()), ("\r\na;b".into(), Some(';')));
    }

    #[test]
    fn names_behind_the_mark_of_a_comment() {
        for line in ["# t x", "#t x", "  % t x ", "t x"] {
            assert_eq!(unmarked(line), "t x", "{line:?}");
        }
        // an aligned table keeps its margin
        assert_eq!(unmarked("  t x"), "  t x");
    }
}
