//! A table inside a text file: rows of cells below a line of names.

use std::borrow::Cow;

use super::boxes::Rest;
use super::heading::Heading;
use super::input::Input;
use super::raw::{CLOCK, Clock, FORMAT, GAPS, RawTrack, Row};
use super::settings::TimeUnit;
use super::timecode::{Style, count_frames, is_clock, seconds};
use crate::io::number::{Mark, Place, shortened};
use crate::io::text::{Separator, cells, line_end, lines_by};

/// After so many problems of a file the rest of it is not read.
pub(super) const ENOUGH: usize = 100;

/// DeepLabCut itself leaves out what is less likely than this, where nothing else is said.
pub(super) const LIKELY: f64 = 0.6;

pub(super) struct Sheet<'a> {
    pub input: &'a Input<'a>,
    /// The file, or whole lines of it.
    pub text: &'a str,
    pub heading: Heading,
    /// Lines of the file above the text.
    pub offset: usize,
    /// The last line of the table, where others follow below it.
    pub last: usize,
}

/// A row of a table.
pub(super) struct Cells<'a> {
    pub line: usize,
    sheet: &'a Sheet<'a>,
    row: &'a [Cow<'a, str>],
}

impl Cells<'_> {
    pub(super) fn at(&self, column: usize) -> Place<'_> {
        self.sheet.input.cell(self.line, &self.sheet.heading.names[column], &self.row[column])
    }

    pub(super) fn text(&self, column: usize) -> &str {
        self.row[column].trim()
    }

    /// The name of the row's shot, which must be there where the table has a column of them.
    pub(super) fn shot(&self, column: Option<usize>) -> Option<&str> {
        let column = column?;
        if self.text(column).is_empty() {
            self.at(column).wrong("is empty; expected the name of a shot");
        }
        Some(self.text(column))
    }
}

/// What was followed, and where its coordinates stand.
pub(super) struct Body {
    pub name: String,
    pub at: At,
}

/// The columns of a position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct At {
    pub x: usize,
    pub y: usize,
    /// Of a box that has a corner in x and y.
    pub rest: Option<Rest>,
    /// How likely the position is one.
    pub likelihood: Option<usize>,
}

impl At {
    pub(super) fn plain(x: usize, y: usize) -> Self {
        Self { x, y, rest: None, likelihood: None }
    }

    /// Of the keys of `[tracks.columns]` that begin like this.
    pub(super) fn of(at: impl Fn(&str) -> Option<usize>, begin: &str) -> Option<Self> {
        let of = |key: &str| at(&format!("{begin}{key}"));
        Some(Self { x: of("x")?, y: of("y")?, rest: Rest::of(&at, begin), likelihood: of("likelihood") })
    }

    /// The columns that hold lengths.
    pub(super) fn lengths(self) -> impl Iterator<Item = usize> {
        [self.x, self.y].into_iter().chain(self.rest.into_iter().flat_map(Rest::columns))
    }
}

impl<'a> Sheet<'a> {
    pub(super) fn new(input: &'a Input<'a>, heading: Heading) -> Self {
        Self { input, text: input.text, heading, offset: 0, last: usize::MAX }
    }

    /// Calls `each` with every row. Comments (`#`) and blank lines are passed over; a wrong number of cells is a problem.
    pub(super) fn rows(&self, mut each: impl FnMut(&Cells)) {
        let Heading { line: header, above, separator, names, .. } = &self.heading;
        let width = names.len();
        let open = names.last().is_some_and(|name| name.is_empty());
        let before = self.input.problems.len();
        // a part of a file has the ends of lines of the whole
        let end = if self.offset > 0 { '\n' } else { line_end(self.text) };
        for (line, text) in lines_by(self.text, end).take(self.last).skip(*above) {
            if self.input.problems.len() >= before + ENOUGH {
                return;
            }
            if text.trim().is_empty() || text.trim_start().starts_with('#') {
                continue;
            }
            let line = line + self.offset;
            let Some(mut row) = cells(text, *separator) else {
                let message = "a quotation mark does not close in this line, or text follows it";
                self.input.wrong(line, None, message);
                continue;
            };
            // spreadsheets go on with empty cells
            while row.len() > width && row.last().is_some_and(|cell| cell.trim().is_empty()) {
                row.pop();
            }
            let short = separator.is_white() || (open && row.len() + 1 == width);
            if short && row.len() < width {
                row.resize(width, Cow::Borrowed(""));
            }
            if row.len() != width {
                let hint = if *separator == Separator::Char(',') && row.len() > width {
                    "; if they are decimal commas, export with another separator, such as semicolons or tabs"
                } else {
                    ""
                };
                let message = format!("{} cells; expected {width}, as in line {header}{hint}", row.len());
                self.input.wrong(line, None, message);
                continue;
            }
            each(&Cells { line, sheet: self, row: &row });
        }
    }

    /// Reads a table with a row per frame: calls `each` with every row, the number of a body and where it was. Without a column of
    /// times, the rows of a shot are counted.
    pub(super) fn frames(
        &self,
        shot: Option<usize>,
        time: Option<usize>,
        bodies: &[Body],
        mut each: impl FnMut(&mut Reader<'a>, &Cells, Option<&str>, usize, Row),
    ) -> Reader<'a> {
        let mut reader = Reader::new(self.input);
        let (mut current, mut count) = (String::new(), 0.0);
        self.rows(|cells| {
            let name = cells.shot(shot);
            if name.is_some_and(|name| name != current) {
                (current, count) = (name.unwrap_or_default().to_string(), 0.0);
            }
            let counted = count;
            count += 1.0;
            let Some(time) = time.map_or(Some(counted), |time| reader.time(cells.at(time))) else {
                if bodies.iter().any(|body| !cells.text(body.at.x).is_empty()) {
                    reader.no_time(cells.line);
                }
                return;
            };
            for (i, body) in bodies.iter().enumerate() {
                let [x, y] = reader.place(cells, body.at);
                let row = Row { time, x, y, line: cells.line };
                each(&mut reader, cells, name, i, row);
            }
        });
        reader
    }

    /// The tracks of such a table, each of one body, and the clock if its times are those of one.
    pub(super) fn tracks(&self, time: Option<usize>, bodies: &[Body]) -> (Vec<RawTrack>, Option<Clock>) {
        let mut tracks: Vec<_> = bodies.iter().map(|body| RawTrack::new(body.name.as_str(), None)).collect();
        let reader = self.frames(None, time, bodies, |_, _, _, i, row| tracks[i].rows.push(row));
        let clock = reader.finish(tracks.iter_mut());
        (tracks, clock)
    }
}

/// Reads cells into rows, with an eye on the decimal marks.
pub(super) struct Reader<'a> {
    input: &'a Input<'a>,
    times: Mark,
    positions: Mark,
    timeless: bool,
    /// If times are those of a clock, how they are written, with the line of the first.
    clock: Option<(Style, usize)>,
    plain: bool,
}

impl<'a> Reader<'a> {
    pub(super) fn new(input: &'a Input<'a>) -> Self {
        let [times, positions] = [(); 2].map(|()| Mark::default());
        Self { input, times, positions, timeless: false, clock: None, plain: false }
    }

    pub(super) fn time(&mut self, cell: Place) -> Option<f64> {
        let found = self.input.problems.len();
        let time = match self.clock_time(cell) {
            Ok(Some(time)) => Some(time),
            Ok(None) => self.times.number(cell),
            Err(wrong) => {
                cell.wrong(format!("\"{}\" {wrong}", shortened(cell.text.trim())));
                None
            }
        };
        self.timeless = self.input.problems.len() > found;
        time
    }

    /// Seconds of a cell that is a time of a clock; `None` where it is to be a number.
    fn clock_time(&mut self, cell: Place) -> Result<Option<f64>, String> {
        if !is_clock(cell.text) {
            self.plain = true;
            return match self.clock {
                Some((_, at)) if !cell.text.trim().is_empty() => {
                    Err(format!("is a plain number, but line {at} h:mm:ss"))
                }
                _ => Ok(None),
            };
        }
        let Some((time, style)) = seconds(cell.text) else {
            return Err("is no time; expected h:mm:ss.fff, h:mm:ss:cs or a number".to_string());
        };
        if self.plain {
            return Err("is h:mm:ss, but times above are plain numbers".to_string());
        }
        match (self.clock.get_or_insert((style, cell.line)), style) {
            // as many digits as any has
            ((Style::Fraction(most), _), Style::Fraction(digits)) => *most = digits.max(*most),
            ((other, at), _) if *other != style => {
                return Err(format!("is not written like the time in line {at}"));
            }
            _ => {}
        }
        Ok(Some(time))
    }

    /// Complains about a row with a position but no time, unless that was done already.
    pub(super) fn no_time(&mut self, line: usize) {
        if !self.timeless {
            self.input.wrong(line, None, "a position without a time; expected both, or neither");
        }
    }

    /// x and y, not numbers in a gap.
    pub(super) fn position(&mut self, cells: [Place; 2]) -> [f64; 2] {
        let found = self.input.problems.len();
        match cells.map(|cell| self.positions.number(cell)) {
            [Some(x), Some(y)] => return [x, y],
            [None, None] => {}
            _ if self.input.problems.len() == found => {
                let [x, y] = cells.map(|cell| shortened(cell.text.trim()));
                let [x_name, y_name] = cells.map(|cell| cell.column);
                let message =
                    format!("{x_name} \"{x}\" and {y_name} \"{y}\": half a position; taken as a gap");
                self.input.log.add(GAPS, cells[0].line, message);
            }
            _ => {}
        }
        [f64::NAN; 2]
    }

    /// Where a ball is: in the middle of a box perhaps, and not where a network that guessed it says that this is unlikely.
    pub(super) fn place(&mut self, cells: &Cells, at: At) -> [f64; 2] {
        let mut read = |columns: [usize; 2]| self.position(columns.map(|column| cells.at(column)));
        let corner = read([at.x, at.y]);
        let place = at.rest.map_or(corner, |rest| rest.middle(corner, read(rest.columns())));
        let likelihood = at.likelihood.and_then(|column| self.extra(cells.at(column)));
        if place[0].is_nan() || likelihood.is_none_or(|likelihood| likelihood >= LIKELY) {
            return place;
        }
        let message = format!("a position of a likelihood below {LIKELY}: taken as a gap");
        self.input.log.add(GAPS, cells.line, message);
        [f64::NAN; 2]
    }

    /// A number that goes with positions, such as a standard deviation.
    pub(super) fn extra(&mut self, cell: Place) -> Option<f64> {
        self.positions.beside(cell)
    }

    /// The decimal mark of the positions.
    pub(super) fn mark(&self) -> Option<char> {
        self.positions.seen()
    }

    /// Says what is known once all rows are read. Gives the clock, if times are those of one; those that count frames become
    /// numbers of frames in the tracks.
    pub(super) fn finish<'t>(self, tracks: impl Iterator<Item = &'t mut RawTrack>) -> Option<Clock> {
        let Input { file, problems, log, .. } = *self.input;
        self.times.finish(file, problems);
        self.positions.finish(file, problems);
        match (self.positions.is_comma(), self.times.is_comma()) {
            (true, true) => log.add(FORMAT, None, "decimal comma"),
            (true, false) => log.add(FORMAT, None, "decimal comma in the coordinates, not in the times"),
            (false, true) => log.add(FORMAT, None, "decimal comma in the times, not in the coordinates"),
            (false, false) => {}
        }
        let (style, line) = self.clock?;
        if style == Style::Colon(2)
            && let Some(rate) = count_frames(&mut tracks.collect::<Vec<_>>())
        {
            let message = format!(
                "times are time codes, h:mm:ss:ff with {rate} frames to a second: read as numbers of frames"
            );
            log.add(CLOCK, line, message);
            return Some(Clock::In(TimeUnit::Frames));
        }
        Some(Clock::Rounded(style.resolution()))
    }
}
