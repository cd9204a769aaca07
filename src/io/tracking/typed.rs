//! The fast way through a long table: polars reads numbers as numbers, a stretch of lines at a time.
//! Whatever is not plain (quotation marks, comments, decimal commas, half positions, errors) is left to
//! the reader of cells, stretch by stretch, which gives the same rows and says what is wrong.

use std::io::Cursor;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::thread;

use polars::prelude::{
    CsvParseOptions, CsvReadOptions, DataFrame, DataType, Field, Float64Chunked, Schema, SerReader,
    StringChunked,
};

use super::long::{self, Columns, Gather};
use super::raw::Row;
use super::sheet::{ENOUGH, Sheet};
use super::timecode::is_clock;
use crate::io::text::{Separator, trimmed};

/// Bytes read at a time.
const STRETCH: usize = 1 << 25;

/// Reads all rows of a table.
pub(super) fn read(sheet: &Sheet, columns: &Columns, gather: &mut Gather) {
    read_by(STRETCH, sheet, columns, gather);
}

fn read_by(stretch: usize, sheet: &Sheet, columns: &Columns, gather: &mut Gather) {
    let Sheet { input, heading, .. } = sheet;
    let start = input.problems.len();
    let by_clock = |rows: &&str| {
        let first = rows.lines().find(|line| !line.trim().is_empty());
        let cells = first.and_then(|line| trimmed(line, heading.separator)).unwrap_or_default();
        cells.get(columns.time).is_some_and(|cell| is_clock(cell))
    };
    let Some(rows) = below(sheet.text, heading.above).filter(|rows| !by_clock(rows)) else {
        // a file with CR for ends of lines, or with times that only the whole of it explains
        long::read(sheet, columns, gather);
        return;
    };
    let mut above = heading.above;
    // of the stretches so far, with the line where the first of them begins
    let mut seen: Option<(char, usize)> = None;
    let read = |part: &str| Plain::of(part, heading.separator, heading.names.len(), columns);
    let (mut part, mut rest) = first_lines(rows, stretch);
    let mut plain = read(part);
    while !part.is_empty() && input.problems.len() < start + ENOUGH {
        let (next, after) = first_lines(rest, stretch);
        // the numbers of the next stretch are read while the rows of this one are sorted into shots
        let (mark, ahead) = thread::scope(|scope| {
            let ahead = (!next.is_empty()).then(|| scope.spawn(|| read(next)));
            let mark = if let Some(plain) = &plain {
                plain.hand_on(above, gather);
                part.contains('.').then_some('.')
            } else {
                let mut heading = heading.clone();
                heading.above = 0;
                long::read(
                    &Sheet { input, text: part, heading, offset: above, last: usize::MAX },
                    columns,
                    gather,
                )
            };
            (mark, ahead.and_then(|ahead| ahead.join().unwrap_or_else(|panic| resume_unwind(panic))))
        });
        if let Some(mark) = mark {
            let (other, line) = *seen.get_or_insert((mark, above + 1));
            if other != mark {
                let message = format!(
                    "decimal marks from here on differ from those from line {line} on; expected points or commas \
                     throughout"
                );
                input.wrong(above + 1, None, message);
                return;
            }
        }
        above += part.bytes().filter(|byte| *byte == b'\n').count();
        (part, rest, plain) = (next, after, ahead);
    }
}

/// The first whole lines of a text, at least so many bytes, and the rest.
fn first_lines(text: &str, least: usize) -> (&str, &str) {
    let bytes = text.as_bytes();
    let from = least.min(bytes.len());
    text.split_at(bytes[from..].iter().position(|byte| *byte == b'\n').map_or(bytes.len(), |i| from + i + 1))
}

/// The text below so many lines.
fn below(text: &str, lines: usize) -> Option<&str> {
    let mut rest = text;
    for _ in 0..lines {
        rest = rest.split_once('\n')?.1;
    }
    Some(rest)
}

/// The numbers and names of a stretch of whole lines.
struct Plain {
    rows: usize,
    time: Float64Chunked,
    x: Float64Chunked,
    y: Float64Chunked,
    sds: Option<[Float64Chunked; 2]>,
    ball: StringChunked,
    shot: Option<StringChunked>,
    point: Option<StringChunked>,
}

impl Plain {
    /// `None` if anything about the lines is unusual.
    fn of(text: &str, separator: Separator, width: usize, columns: &Columns) -> Option<Self> {
        let Separator::Char(separator) = separator else { return None };
        let separator = u8::try_from(separator).ok()?;
        let bytes = text.as_bytes();
        let count = |wanted: u8| bytes.iter().filter(|byte| **byte == wanted).count();
        let rows = count(b'\n') + usize::from(bytes.last().is_some_and(|byte| *byte != b'\n'));
        if count(separator) != rows * (width - 1) || bytes.iter().any(|byte| *byte == b'"' || *byte == b'#') {
            return None;
        }
        let frame = parse(text, separator, width, columns)?;
        if frame.height() != rows {
            return None;
        }
        let numbers = |i: usize| Some(frame.column(&name(i)).ok()?.f64().ok()?.rechunk().into_owned());
        let words = |i: usize| Some(frame.column(&name(i)).ok()?.str().ok()?.rechunk().into_owned());
        let optional = |i: Option<usize>| i.map(words).map_or(Some(None), |column| column.map(Some));
        let (time, x, y) = (numbers(columns.time)?, numbers(columns.at.x)?, numbers(columns.at.y)?);
        let (ball, shot, point) = (words(columns.ball?)?, optional(columns.shot)?, optional(columns.point)?);
        let sds = match columns.sd {
            Some([x, y]) => Some([numbers(x)?, numbers(y)?]),
            None => None,
        };
        let missing = |column: &StringChunked| {
            column.null_count() > 0
                || column.iter().any(|cell| cell.is_none_or(|cell| cell.trim().is_empty()))
        };
        let is_finite = |x: Option<f64>| x.is_none_or(f64::is_finite);
        let half =
            x.iter().zip(y.iter()).any(|(x, y)| x.is_some() != y.is_some() || !is_finite(x) || !is_finite(y));
        let wrong_sd = |sd: &Float64Chunked| sd.iter().flatten().any(|sd| !(sd > 0.0 && sd.is_finite()));
        let is_unusual = half
            || may_have_thousands(&[&time])
            || may_have_thousands(&[&x, &y])
            || time.iter().any(|t| t.is_none_or(|t| !t.is_finite()))
            || missing(&ball)
            || shot.as_ref().is_some_and(missing)
            || sds.as_ref().is_some_and(|sds| sds.iter().any(wrong_sd));
        (!is_unusual).then_some(Self { rows, time, x, y, sds, ball, shot, point })
    }

    /// Row by row; the first is below so many lines.
    fn hand_on(&self, above: usize, gather: &mut Gather) {
        for row in 0..self.rows {
            let number = |column: &Float64Chunked| column.get(row).unwrap_or(f64::NAN);
            let line = above + row + 1;
            let shot = self.shot.as_ref().and_then(|shot| shot.get(row)).map(str::trim);
            let point = self.point.as_ref().and_then(|point| point.get(row)).map_or("", str::trim);
            let sd = self.sds.as_ref().map(|sds| sds.each_ref().map(number));
            let row_of = Row { time: number(&self.time), x: number(&self.x), y: number(&self.y), line };
            gather.push(shot, self.ball.get(row).unwrap_or_default().trim(), point, row_of, sd);
        }
    }
}

/// Whether all fractions may be thousands, 1.874 beside 998: the reader of cells then looks at how they are written.
fn may_have_thousands(columns: &[&Float64Chunked]) -> bool {
    let (mut fraction, mut hundreds) = (false, false);
    for value in columns.iter().flat_map(|column| column.iter()).flatten().map(f64::abs) {
        if value.fract() == 0.0 {
            hundreds |= (100.0..1000.0).contains(&value);
            continue;
        }
        let thousand = 1000.0 * value;
        if value < 1.0 || (thousand - thousand.round()).abs() > 1e-6 {
            return false;
        }
        fraction = true;
    }
    fraction && hundreds
}

fn name(i: usize) -> String {
    format!("c{i}")
}

fn parse(text: &str, separator: u8, width: usize, columns: &Columns) -> Option<DataFrame> {
    let mut used = vec![columns.time, columns.at.x, columns.at.y];
    used.extend(columns.sd.into_iter().flatten());
    let fields = (0..width).map(|i| {
        let kind = if used.contains(&i) { DataType::Float64 } else { DataType::String };
        Field::new(name(i).into(), kind)
    });
    let schema: Schema = fields.collect();
    used.extend([columns.ball, columns.shot, columns.point].into_iter().flatten());
    used.sort_unstable();
    CsvReadOptions::default()
        .with_has_header(false)
        .with_schema(Some(Arc::new(schema)))
        .with_projection(Some(Arc::new(used)))
        .with_parse_options(CsvParseOptions::default().with_separator(separator).with_quote_char(None))
        .into_reader_with_file_handle(Cursor::new(text.as_bytes()))
        .finish()
        .ok()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::io::error::Problems;
    use crate::io::tracking::input::Input;
    use crate::io::tracking::raw::Notes;
    use crate::io::tracking::settings::TimeUnit;

    /// Both ways through the same table.
    fn both(text: &str) {
        let (file, stem) = (Path::new("a.csv"), "a");
        let settings = &crate::io::tracking::settings::tests::settings("[video]\ncapture_fps = 10");
        let run = |fast: usize| {
            let (problems, notes) = (Problems::new(""), Notes::default());
            let input = Input { file, text, stem, settings, problems: &problems, log: notes.of(file) };
            let long::Head { heading, columns } = long::detect(&input).expect("a long table");
            let unit = if columns.frames { TimeUnit::Frames } else { TimeUnit::S };
            let (mut gather, sheet) = (Gather::new(&input, unit), Sheet::new(&input, heading));
            if fast > 0 {
                read_by(fast, &sheet, &columns, &mut gather);
            } else {
                long::read(&sheet, &columns, &mut gather);
            }
            // not-a-number is not equal to itself
            (format!("{:?}", gather.shots), format!("{}", problems.into_error()))
        };
        let slow = run(0);
        for stretch in [1, 20, 1000] {
            assert_eq!(run(stretch), slow, "{text:?}");
        }
    }

    #[test]
    fn both_ways_give_the_same() {
        let head = "shot,frame,ball,x,y\n";
        for body in [
            "1,0,A,1.5,2\n1,1,A,,\n1,2,B,-1e-3,+.5\n2,0,A,0.1,7\n",
            "1,0,A,1.5,2\r\n1,1,A,,\r\n1,2,B,-1e-3,5\r\n",
            "1,0, A ,1.5,2\n 1,1,A, 1 , 2\n\n# no\n1,2,B,1,2",
            "1,0,A,nan,2\n1,1,A,inf,1\n1,1,A,1e999,1\n1,2,A,1,\n",
            "1,0,A,1\n1,1,A,1,2,3\n,1,A,1,2\n1,,A,1,2\n1,1,,1,2\n",
            "\"1\",0,A,1,2\n1,0,A,\"1\",2\n1,0,A,1..2,2\n1,0,A,1_0,0x3\n",
            "01,0,A,0.1,0.30000000000000004\n1,1,A,123456789.123456789123,5e-324\n1,0.5,A,1,2\n",
            "1,0,A,\u{2212}1,2\n1,1,é,1,2\n1,1,null,null,NA\n",
            "a\rb,0,A,1,2\n",
            // found by damaging files: a last line with CR inside
            "1,0,A,1,2\n1,1,A,1,2\r1,2,A,1,2\r",
        ] {
            both(&format!("{head}{body}"));
        }
        both("t;ball;point;x;y;x_sd;y_sd\n0,1;A;m1;1,5;2,5;0,1;0,1\n0,2;A;;1;2;;\n0,3;A;;1;2;0;1\n");
        both("z\tt\tball\tx\ty\n\t0.1\tA\t1\t2\nw\t0.2\tA\t1\t2\n");
    }
}
