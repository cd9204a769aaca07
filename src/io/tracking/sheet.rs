//! A table inside a text file: rows of cells below a line of names.

use std::borrow::Cow;
use std::path::Path;

use super::number::{Mark, shortened};
use super::raw::{Clock, FORMAT, GAPS, Notes, RawTrack, Row};
use super::text::{Separator, cells, line_end, lines_by};
use crate::io::error::Problems;

/// After so many problems of a file the rest of it is not read.
const ENOUGH: usize = 100;

pub(super) struct Sheet<'a> {
    pub file: &'a Path,
    pub text: &'a str,
    pub separator: Separator,
    /// Line of the names.
    pub header: usize,
    /// Rows are below this line.
    pub above: usize,
    /// Lines of the file above the text.
    pub offset: usize,
    pub names: Vec<String>,
}

/// Where a track's coordinates stand.
pub(super) struct Place {
    pub name: String,
    pub point: Option<String>,
    pub x: usize,
    pub y: usize,
}

impl<'a> Sheet<'a> {
    /// Calls `each` with every row's line and cells. Comments (`#`) and blank lines are passed over; a
    /// wrong number of cells is a problem.
    pub(super) fn rows(
        &self,
        problems: &mut Problems,
        mut each: impl FnMut(usize, &[Cow<'a, str>], &mut Problems),
    ) {
        let width = self.names.len();
        let open = self.names.last().is_some_and(|name| name.is_empty());
        let before = problems.len();
        // a part of a file has the ends of lines of the whole
        let end = if self.offset > 0 { '\n' } else { line_end(self.text) };
        for (line, text) in lines_by(self.text, end).skip(self.above) {
            if problems.len() >= before + ENOUGH {
                return;
            }
            if text.trim().is_empty() || text.trim_start().starts_with('#') {
                continue;
            }
            let line = line + self.offset;
            let Some(mut row) = cells(text, self.separator) else {
                let message = "a quotation mark does not close in this line, or text follows it";
                problems.add(self.file, Some(line), None, message);
                continue;
            };
            if row.len() == width + 1 && row.last().is_some_and(|cell| cell.trim().is_empty()) {
                row.pop();
            }
            let short = self.separator.is_white() || (open && row.len() + 1 == width);
            if short && row.len() < width {
                row.resize(width, Cow::Borrowed(""));
            }
            if row.len() != width {
                let hint = if self.separator == Separator::Char(',') && row.len() > width {
                    "; if they are decimal commas, export with another separator, such as semicolons or tabs"
                } else {
                    ""
                };
                let message =
                    format!("{} cells; expected {width}, as in line {}{hint}", row.len(), self.header);
                problems.add(self.file, Some(line), None, message);
                continue;
            }
            each(line, &row, problems);
        }
    }

    /// The tracks of a table with a row per frame, and the clock if its times are h:mm:ss:cs, which they
    /// may be if `clock`. Without a column of times, rows are counted.
    pub(super) fn wide(
        &self,
        time: Option<usize>,
        places: Vec<Place>,
        clock: bool,
        problems: &mut Problems,
        notes: &mut Notes,
    ) -> (Vec<RawTrack>, Option<Clock>) {
        let mut tracks: Vec<_> =
            places.iter().map(|place| RawTrack::new(place.name.as_str(), place.point.clone())).collect();
        let mut reader = Reader::new(self.file);
        if clock {
            reader = reader.with_clock();
        }
        let mut count = 0.0;
        self.rows(problems, |line, row, problems| {
            let t = match time {
                Some(time) => reader.time(line, &row[time], &self.names[time], problems),
                None => Some(count),
            };
            count += 1.0;
            let Some(time) = t else {
                if places.iter().any(|place| !row[place.x].trim().is_empty()) && time.is_some() {
                    reader.no_time(line, problems);
                }
                return;
            };
            for (place, track) in places.iter().zip(&mut tracks) {
                let [x, y] = reader.position(
                    line,
                    [&row[place.x], &row[place.y]],
                    [&self.names[place.x], &self.names[place.y]],
                    problems,
                    notes,
                );
                track.rows.push(Row { time, x, y, line: line as u32 });
            }
        });
        let clock = reader.clock();
        reader.finish(notes);
        (tracks, clock)
    }
}

/// Reads cells into rows, with an eye on the decimal marks.
pub(super) struct Reader<'a> {
    file: &'a Path,
    times: Mark,
    positions: Mark,
    timeless: bool,
    /// Times may be h:mm:ss:cs.
    clocks: bool,
    /// If they are, the digits of their last part, with the line of the first time.
    clock: Option<(usize, usize)>,
    plain: bool,
}

impl<'a> Reader<'a> {
    pub(super) fn new(file: &'a Path) -> Self {
        Self {
            file,
            times: Mark::default(),
            positions: Mark::default(),
            timeless: false,
            clocks: false,
            clock: None,
            plain: false,
        }
    }

    /// Lets times be h:mm:ss:cs.
    pub(super) fn with_clock(mut self) -> Self {
        self.clocks = true;
        self
    }

    /// The clock, if times are h:mm:ss:cs.
    pub(super) fn clock(&self) -> Option<Clock> {
        self.clock.map(|(digits, _)| Clock::Rounded(0.1_f64.powi(digits as i32)))
    }

    pub(super) fn time(
        &mut self,
        line: usize,
        cell: &str,
        column: &str,
        problems: &mut Problems,
    ) -> Option<f64> {
        let found = problems.len();
        if self.clocks && cell.contains(':') {
            let read = hours(cell.trim());
            self.timeless = true;
            let message = match (read, self.clock) {
                (None, _) => {
                    format!("\"{}\" is no time; expected h:mm:ss:cs or a number", shortened(cell.trim()))
                }
                (Some((_, digits)), Some((other, at))) if digits != other => {
                    format!("\"{}\" is not written like the time in line {at}", cell.trim())
                }
                (Some(_), _) if self.plain => {
                    format!("\"{}\" is h:mm:ss:cs, but times above are plain numbers", cell.trim())
                }
                (Some((time, digits)), _) => {
                    self.clock.get_or_insert((digits, line));
                    self.timeless = false;
                    return Some(time);
                }
            };
            problems.add(self.file, Some(line), Some(column), message);
            return None;
        }
        self.plain = true;
        if let Some((_, at)) = self.clock.filter(|_| !cell.trim().is_empty()) {
            let message =
                format!("\"{}\" is a plain number, but line {at} h:mm:ss:cs", shortened(cell.trim()));
            problems.add(self.file, Some(line), Some(column), message);
            self.timeless = true;
            return None;
        }
        let time = self.times.number(cell, self.file, line, column, problems);
        self.timeless = problems.len() > found;
        time
    }

    /// Complains about a row with a position but no time, unless that was done already.
    pub(super) fn no_time(&mut self, line: usize, problems: &mut Problems) {
        if !self.timeless {
            problems.add(self.file, Some(line), None, "a position without a time; expected both, or neither");
        }
    }

    /// x and y, not numbers in a gap.
    pub(super) fn position(
        &mut self,
        line: usize,
        cells: [&str; 2],
        columns: [&str; 2],
        problems: &mut Problems,
        notes: &mut Notes,
    ) -> [f64; 2] {
        let found = problems.len();
        let mut number = |i: usize| self.positions.number(cells[i], self.file, line, columns[i], problems);
        match [number(0), number(1)] {
            [Some(x), Some(y)] => [x, y],
            [None, None] => [f64::NAN; 2],
            _ => {
                if problems.len() == found {
                    let message = format!(
                        "{} \"{}\" and {} \"{}\": half a position; taken as a gap",
                        columns[0],
                        shortened(cells[0].trim()),
                        columns[1],
                        shortened(cells[1].trim())
                    );
                    notes.add(GAPS, self.file, Some(line), message);
                }
                [f64::NAN; 2]
            }
        }
    }

    /// A number that goes with positions, such as a standard deviation.
    pub(super) fn extra(
        &mut self,
        line: usize,
        cell: &str,
        column: &str,
        problems: &mut Problems,
    ) -> Option<f64> {
        self.positions.number(cell, self.file, line, column, problems)
    }

    /// The decimal mark of the positions.
    pub(super) fn mark(&self) -> Option<char> {
        self.positions.seen()
    }

    pub(super) fn finish(self, notes: &mut Notes) {
        if self.positions.is_comma() || self.times.is_comma() {
            let which = match (self.positions.is_comma(), self.times.is_comma()) {
                (true, false) => " in the coordinates, not in the times",
                (false, true) => " in the times, not in the coordinates",
                _ => "",
            };
            notes.add(FORMAT, self.file, None, format!("decimal comma{which}"));
        }
    }
}

/// Seconds of h:mm:ss:cs (or mm:ss:cs), and the digits of the last part.
fn hours(cell: &str) -> Option<(f64, usize)> {
    let parts: Vec<&str> = cell.split(':').collect();
    let (last, rest) = parts.split_last()?;
    let digits =
        |part: &&str| !part.is_empty() && part.len() <= 4 && part.bytes().all(|b| b.is_ascii_digit());
    if !(2..=3).contains(&rest.len()) || !(2..=3).contains(&last.len()) || !parts.iter().all(digits) {
        return None;
    }
    let mut whole = 0.0;
    for (i, part) in rest.iter().enumerate() {
        let number: f64 = part.parse().ok()?;
        if i > 0 && number >= 60.0 {
            return None;
        }
        whole = whole * 60.0 + number;
    }
    let fraction: f64 = last.parse().ok()?;
    Some((whole + fraction / 10.0_f64.powi(last.len() as i32), last.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_a_clock() {
        assert_eq!(hours("1:02:03:45"), Some((3723.45, 2)));
        assert_eq!(hours("02:03:450"), Some((123.45, 3)));
        for wrong in ["1:2", "0:60:00:00", "0::0:00", "a:00:00:00", "0:00:00:1", "-0:00:00:00", "1:2:3:4:50"]
        {
            assert_eq!(hours(wrong), None, "{wrong}");
        }
    }
}
