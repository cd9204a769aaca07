//! A table inside a text file: rows of cells below a line of names.

use std::borrow::Cow;
use std::path::Path;

use super::raw::{CLOCK, Clock, FORMAT, GAPS, Notes, RawTrack, Row};
use super::settings::TimeUnit;
use super::timecode::{Style, count_frames, is_clock, seconds};
use crate::io::error::Problems;
use crate::io::number::{Mark, shortened};
use crate::io::text::{Separator, cells, line_end, lines_by};

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

    /// The tracks of a table with a row per frame, and the clock if its times are those of one. Without a column of times, rows are
    /// counted.
    pub(super) fn wide(
        &self,
        time: Option<usize>,
        places: Vec<Place>,
        problems: &mut Problems,
        notes: &mut Notes,
    ) -> (Vec<RawTrack>, Option<Clock>) {
        let mut tracks: Vec<_> =
            places.iter().map(|place| RawTrack::new(place.name.as_str(), place.point.clone())).collect();
        let mut reader = Reader::new(self.file);
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
        let clock = reader.finish(tracks.iter_mut(), problems, notes);
        (tracks, clock)
    }
}

/// Reads cells into rows, with an eye on the decimal marks.
pub(super) struct Reader<'a> {
    file: &'a Path,
    times: Mark,
    positions: Mark,
    timeless: bool,
    /// If times are those of a clock, how they are written, with the line of the first.
    clock: Option<(Style, usize)>,
    plain: bool,
}

impl<'a> Reader<'a> {
    pub(super) fn new(file: &'a Path) -> Self {
        Self {
            file,
            times: Mark::default(),
            positions: Mark::default(),
            timeless: false,
            clock: None,
            plain: false,
        }
    }

    pub(super) fn time(
        &mut self,
        line: usize,
        cell: &str,
        column: &str,
        problems: &mut Problems,
    ) -> Option<f64> {
        self.timeless = false;
        let wrong = if is_clock(cell) {
            match (seconds(cell), self.clock) {
                (None, _) => Some("is no time; expected h:mm:ss.fff, h:mm:ss:cs or a number".to_string()),
                (Some(_), _) if self.plain => {
                    Some("is h:mm:ss, but times above are plain numbers".to_string())
                }
                (Some((time, Style::Fraction(digits))), None | Some((Style::Fraction(_), _))) => {
                    let (style, _) = self.clock.get_or_insert((Style::Fraction(digits), line));
                    if matches!(style, Style::Fraction(most) if *most < digits) {
                        *style = Style::Fraction(digits);
                    }
                    return Some(time);
                }
                (Some((_, style)), Some((other, at))) if style != other => {
                    Some(format!("is not written like the time in line {at}"))
                }
                (Some((time, style)), _) => {
                    self.clock.get_or_insert((style, line));
                    return Some(time);
                }
            }
        } else {
            self.plain = true;
            let clock = self.clock.filter(|_| !cell.trim().is_empty());
            clock.map(|(_, at)| format!("is a plain number, but line {at} h:mm:ss"))
        };
        if let Some(wrong) = wrong {
            self.timeless = true;
            let message = format!("\"{}\" {wrong}", shortened(cell.trim()));
            problems.add(self.file, Some(line), Some(column), message);
            return None;
        }
        let found = problems.len();
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
        self.positions.beside(cell, self.file, line, column, problems)
    }

    /// The decimal mark of the positions.
    pub(super) fn mark(&self) -> Option<char> {
        self.positions.seen()
    }

    /// Says what is known once all rows are read. Gives the clock, if times are those of one; those that count frames become
    /// numbers of frames in the tracks.
    pub(super) fn finish<'t>(
        self,
        tracks: impl Iterator<Item = &'t mut RawTrack>,
        problems: &mut Problems,
        notes: &mut Notes,
    ) -> Option<Clock> {
        self.times.finish(self.file, problems);
        self.positions.finish(self.file, problems);
        if self.positions.is_comma() || self.times.is_comma() {
            let which = match (self.positions.is_comma(), self.times.is_comma()) {
                (true, false) => " in the coordinates, not in the times",
                (false, true) => " in the times, not in the coordinates",
                _ => "",
            };
            notes.add(FORMAT, self.file, None, format!("decimal comma{which}"));
        }
        let (style, line) = self.clock?;
        if style == Style::Colon(2)
            && let Some(rate) = count_frames(&mut tracks.collect::<Vec<_>>())
        {
            let message = format!(
                "times are time codes, h:mm:ss:ff with {rate} frames to a second: read as numbers of frames"
            );
            notes.add(CLOCK, self.file, Some(line), message);
            return Some(Clock::In(TimeUnit::Frames));
        }
        Some(Clock::Rounded(style.resolution()))
    }
}
