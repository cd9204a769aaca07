//! Reading of a file's rows to shots and tracks, for all formats.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use super::clock::{Style, count_frames, is_clock, seconds};
use super::input::{Input, Subject};
use super::layout::{Body, Layout, Part};
use super::raw::{Clock, RawShot, RawTrack, Row};
use super::settings::Format;
use super::units::{AngleUnit, TimeUnit};
use crate::io::number::{Mark, Place, shortened};
use crate::io::text::{self, Separator, lines};

/// Number of problems of a file after which reading ends.
const MAX_PROBLEMS: usize = 100;

/// Least likelihood of a position, unless stated: the default of `DeepLabCut`.
const LIKELY: f64 = 0.6;

/// Reads the rows of a file. Skips comments (`#`) and blank lines; reports rows with a wrong number
/// of cells.
pub(super) fn read(input: &Input, layout: &Layout) -> Vec<RawShot> {
    let mut reader = Reader::new(input, layout);
    let limit = input.problems.len() + MAX_PROBLEMS;
    let mut blocks = layout.blocks.iter();
    let Some(mut block) = blocks.next() else { return Vec::new() };
    let mut first_body = 0;
    for (line, text) in lines(input.text) {
        while line > block.last {
            first_body += block.bodies.len();
            let Some(next) = blocks.next() else { return reader.finish() };
            block = next;
        }
        if input.problems.len() >= limit {
            break;
        }
        let content = text.trim_start();
        if line <= block.above || content.is_empty() {
            continue;
        }
        let cells = text::cells(text, layout.heading.separator);
        if content.starts_with('#') {
            if cells.is_ok_and(|cells| layout.shot == Some(0) && cells.len() == layout.heading.names.len()) {
                let message = "rows that begin with #, passed over as comments: quote names of shots that begin with it";
                input.log.add(Subject::Repeated, line, message);
            }
            continue;
        }
        let Ok(cells) = cells else {
            input.wrong(line, None, "a quotation mark does not close in this line, or text follows it");
            continue;
        };
        match with_width(cells, layout) {
            Ok(cells) => reader.add(line, &cells, &block.bodies, first_body),
            Err(message) => input.wrong(line, None, message),
        }
    }
    reader.finish()
}

/// Returns as many cells as there are names; `Err` with a message if there are more or less.
fn with_width<'a>(mut cells: Vec<Cow<'a, str>>, layout: &Layout) -> Result<Vec<Cow<'a, str>>, String> {
    let (names, separator) = (&layout.heading.names, layout.heading.separator);
    let width = names.len();
    // spreadsheets continue with empty cells
    while cells.len() > width && cells.last().is_some_and(|cell| cell.is_empty()) {
        cells.pop();
    }
    let is_open = names.last().is_some_and(String::is_empty) && cells.len() + 1 == width;
    if (separator.is_white() || is_open) && cells.len() < width {
        cells.resize(width, Cow::Borrowed(""));
    }
    if cells.len() == width {
        return Ok(cells);
    }
    let hint = if separator == Separator::Char(',') && cells.len() > width {
        "; if they are decimal commas, export with another separator, such as semicolons or tabs"
    } else {
        ""
    };
    Err(format!("{} cells; expected {width}, as in line {}{hint}", cells.len(), layout.heading.line))
}

/// Rows already read, sorted into shots and tracks, and the properties that all cells share.
pub(super) struct Reader<'a> {
    input: &'a Input<'a>,
    layout: &'a Layout,
    file: Arc<PathBuf>,
    times: Mark,
    positions: Mark,
    /// How the first time is written, with its line: as that of a clock or, `None`, as a number.
    clock: Option<(Option<Style>, usize)>,
    shots: Vec<RawShot>,
    /// The rows of each track of each shot, with their times.
    written: Vec<Vec<Vec<(f64, Row)>>>,
    by_name: HashMap<String, usize>,
    /// The shot of the row above.
    last: usize,
    /// The first row that belongs to no track.
    trackless: Option<usize>,
}

impl<'a> Reader<'a> {
    pub(super) fn new(input: &'a Input, layout: &'a Layout) -> Self {
        Self {
            input,
            layout,
            file: Arc::new(input.file.to_path_buf()),
            times: Mark::default(),
            positions: Mark::default(),
            clock: None,
            shots: Vec::new(),
            written: Vec::new(),
            by_name: HashMap::new(),
            last: usize::MAX,
            trackless: None,
        }
    }

    /// Adds a row; `first_body` is the number of bodies in the blocks above.
    pub(super) fn add(&mut self, line: usize, cells: &[Cow<str>], bodies: &[Body], first_body: usize) {
        let Input { file, problems, stem, log, .. } = *self.input;
        let layout = self.layout;
        let at = |column: usize| {
            let (column, text) = (layout.heading.names[column].as_str(), cells[column].as_ref());
            Place { file, line, column, text, problems }
        };
        let before = problems.len();
        let ball = layout.ball();
        for (what, column) in [("shot", layout.shot), ("ball", ball)] {
            let Some(cell) = column.map(at).filter(|cell| cell.text.is_empty()) else { continue };
            if what == "ball" && layout.format == Format::Columns {
                self.trackless.get_or_insert(line);
                let message = format!("rows that belong to no track ({} is empty): left out", cell.column);
                return log.add(Subject::Gaps, line, message);
            }
            cell.wrong(format!("is empty; expected the name of a {what}"));
        }
        let mut time = None;
        if let Some(cell) = layout.time.map(at) {
            time = self.time(cell);
            let has_position = ball.is_some() || bodies.iter().any(|body| !at(body.xy[0]).text.is_empty());
            if time.is_none() && has_position && problems.len() == before {
                cell.wrong("is empty; expected a time, or the number of a frame");
            }
            if time.is_none() {
                return;
            }
        }
        self.begin(layout.shot.map_or(stem, |column| at(column).text), line);
        // without times, rows of a shot are counted
        let rows = self.written[self.last].first().map_or(0, Vec::len);
        // −0 is 0
        let time = time.unwrap_or(rows as f64) + 0.0;
        for (body, number) in bodies.iter().zip(first_body..) {
            let place = self.place(body, at);
            let row = Row { place, sd: self.deviations(body, at), line };
            let name = body.ball.map_or(body.name.as_str(), |column| at(column).text);
            let point = match body.part {
                Part::Centre => body.point.map(|column| at(column).text),
                Part::Marker => Some("marker"),
                Part::Angle(_) => Some("angle"),
            };
            let is_centre =
                |point: &&str| ["", "centre", "center"].iter().any(|word| point.eq_ignore_ascii_case(word));
            let track = self.track(number, name, point.filter(|point| !is_centre(point)), body.part);
            self.written[self.last][track].push((time, row));
        }
    }

    fn begin(&mut self, name: &str, line: usize) {
        if self.shots.get(self.last).is_some_and(|last| last.name == name) {
            return;
        }
        self.last = self.by_name.get(name).copied().unwrap_or(self.shots.len());
        if self.last == self.shots.len() {
            self.by_name.insert(name.to_string(), self.last);
            let (file, clock) = (Arc::clone(&self.file), self.layout.clock);
            let (unit, name) = (self.layout.unit, name.to_string());
            let (times, tracks) = (Vec::new(), Vec::new());
            self.shots.push(RawShot { name, file, line, clock, unit, times, tracks });
            self.written.push(Vec::new());
        }
    }

    fn track(&mut self, body: usize, name: &str, point: Option<&str>, part: Part) -> usize {
        let tracks = &mut self.shots[self.last].tracks;
        let is_it =
            |known: &RawTrack| known.body == body && known.point.as_deref() == point && known.name == name;
        let i = tracks.iter().position(is_it).unwrap_or(tracks.len());
        if i == tracks.len() {
            let (name, point) = (name.to_string(), point.map(str::to_string));
            let is_angle = matches!(part, Part::Angle(_));
            tracks.push(RawTrack { name, body, point, is_angle, ..RawTrack::default() });
            self.written[self.last].push(Vec::new());
        }
        i
    }

    /// Reads a time, a number or that of a clock; `None` if the cell is empty or wrong. All are
    /// written as the first one is; of fractions of seconds the most digits count.
    fn time(&mut self, cell: Place) -> Option<f64> {
        let shown = || shortened(cell.text.trim());
        let (time, style) = if !is_clock(cell.text) {
            (self.times.number(cell)?, None)
        } else if let Some((time, style)) = seconds(cell.text) {
            (time, Some(style))
        } else {
            cell.wrong(format!(
                "\"{}\" is not a time; expected h:mm:ss.fff, h:mm:ss:cs or a number",
                shown()
            ));
            return None;
        };
        let (first, at) = self.clock.get_or_insert((style, cell.line));
        if let (Some(Style::Fraction(most)), Some(Style::Fraction(digits))) = (first.as_mut(), style) {
            *most = digits.max(*most);
        } else if *first != style {
            cell.wrong(format!("\"{}\" is not written like the time in line {at}", shown()));
            return None;
        }
        Some(time)
    }

    fn position<'c>(&mut self, columns: [usize; 2], at: impl Fn(usize) -> Place<'c>) -> [f64; 2] {
        let Input { problems, log, .. } = *self.input;
        let before = problems.len();
        let cells = columns.map(at);
        match cells.map(|cell| self.positions.number(cell)) {
            [Some(x), Some(y)] => return [x, y],
            [None, None] => {}
            _ if problems.len() > before => {}
            _ => {
                let [x, y] = cells.map(|cell| format!("{} \"{}\"", cell.column, shortened(cell.text.trim())));
                let message = format!("{x} and {y}: half a position; taken as a gap");
                log.add(Subject::Gaps, cells[0].line, message);
            }
        }
        [f64::NAN; 2]
    }

    /// Reads the position of a body: the middle of a box, and a gap if it is too unlikely; or an
    /// angle.
    fn place<'c>(&mut self, body: &Body, at: impl Fn(usize) -> Place<'c> + Copy) -> [f64; 2] {
        if let Part::Angle(unit) = body.part {
            let angle = self.positions.beside(at(body.xy[0])).unwrap_or(f64::NAN);
            return [if unit == AngleUnit::Degrees { 1.0_f64.to_radians() * angle } else { angle }, 0.0];
        }
        let [x, y] = self.position(body.xy, at);
        let place = if let Some(corner) = body.corner {
            let [other_x, other_y] = self.position(corner, at);
            [f64::midpoint(x, other_x), f64::midpoint(y, other_y)]
        } else if let Some(size) = body.size {
            let [width, height] = self.position(size, at);
            [x + 0.5 * width, y + 0.5 * height]
        } else {
            [x, y]
        };
        let likelihood = body.likelihood.and_then(|column| self.positions.beside(at(column)));
        if place[0].is_nan() || likelihood.is_none_or(|likelihood| likelihood >= LIKELY) {
            return place;
        }
        let message = format!("a position of a likelihood below {LIKELY}: taken as a gap");
        self.input.log.add(Subject::Gaps, at(body.xy[0]).line, message);
        [f64::NAN; 2]
    }

    fn deviations<'c>(&mut self, body: &Body, at: impl Fn(usize) -> Place<'c>) -> [f64; 2] {
        let Some(columns) = body.sd else { return [f64::NAN; 2] };
        columns.map(at).map(|cell| {
            let sd = self.positions.beside(cell);
            if let Some(sd) = sd.filter(|sd| *sd <= 0.0) {
                cell.wrong(format!("{sd} is not a standard deviation; expected more than 0"));
            }
            sd.unwrap_or(f64::NAN)
        })
    }

    /// Reports properties of all rows, and returns the shots. Time codes become numbers of frames.
    pub(super) fn finish(self) -> Vec<RawShot> {
        let Input { file, problems, log, .. } = *self.input;
        if let (Some(column), Some(first), true) = (self.layout.ball(), self.trackless, self.shots.is_empty())
        {
            let message = "is empty in every row; expected names of tracks, or no ball in [tracks.columns]: both balls are then followed \
                           from frame to frame";
            self.input.wrong(first, self.layout.heading.names[column].as_str(), message);
        }
        self.times.finish(file, problems);
        self.positions.finish(file, problems);
        if self.positions.is_comma() || self.times.is_comma() {
            log.add(Subject::Format, None, "decimal comma");
        }
        let mut shots: Vec<RawShot> =
            self.shots.into_iter().zip(self.written).map(|(shot, written)| shot.on_grid(written)).collect();
        if let Some((Some(style), line)) = self.clock {
            let mut clock = Clock { rounding: Some(style.resolution()), ..Clock::of(TimeUnit::S) };
            if style == Style::Colon(2)
                && let Some(rate) = count_frames(&mut shots)
            {
                let message = format!("times are time codes h:mm:ss:ff with {rate} frames to a second");
                log.add(Subject::Clock, line, message);
                clock = Clock::of(TimeUnit::Frames);
            }
            for shot in &mut shots {
                shot.clock = clock;
            }
        }
        shots
    }
}
