//! Reading of a file's rows to shots and tracks, for all formats.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

use super::clock::{Style, is_clock, seconds};
use super::input::{Input, Subject};
use super::layout::{Body, Layout, Name};
use super::raw::{Clock, RawShot, RawTrack, Row};
use super::settings::Format;
use crate::io::number::{Mark, Place, shortened};
use crate::io::text::{self, Separator, lines};

/// Number of problems of a file after which reading ends.
const MAX_PROBLEMS: usize = 100;

/// Least likelihood of a position, unless stated: the default of `DeepLabCut`.
pub(super) const LIKELY: f64 = 0.6;

/// Reads the rows of a file. Skips comments (`#`) and blank lines; reports rows with a wrong number
/// of cells.
pub(super) fn read(input: &Input, layout: &Layout) -> Vec<RawShot> {
    let mut reader = Reader::new(input, layout);
    let before = input.problems.len();
    let mut blocks = layout.blocks.iter();
    let Some(mut block) = blocks.next() else { return Vec::new() };
    let mut first_body = 0;
    for (line, text) in lines(input.text) {
        while line > block.last {
            first_body += block.bodies.len();
            let Some(next) = blocks.next() else { return reader.finish() };
            block = next;
        }
        if input.problems.len() >= before + MAX_PROBLEMS {
            break;
        }
        let content = text.trim_start();
        if line <= block.above || content.is_empty() {
            continue;
        }
        if content.starts_with('#') {
            reader.see_comment(line, text);
            continue;
        }
        let Ok(cells) = text::cells(text, layout.heading.separator) else {
            input.wrong(line, None, "a quotation mark does not close in this line, or text follows it");
            continue;
        };
        match with_width(cells, layout, block.header) {
            Ok(cells) => reader.add(line, &cells, &block.bodies, first_body),
            Err(message) => input.wrong(line, None, message),
        }
    }
    reader.finish()
}

/// Returns as many cells as there are names; `Err` with a message if there are more or less.
fn with_width<'a>(
    mut cells: Vec<Cow<'a, str>>,
    layout: &Layout,
    header: usize,
) -> Result<Vec<Cow<'a, str>>, String> {
    let (names, separator) = (&layout.heading.names, layout.heading.separator);
    let width = names.len();
    // spreadsheets continue with empty cells
    while cells.len() > width && cells.last().is_some_and(|cell| cell.is_empty()) {
        cells.pop();
    }
    let is_open = names.last().is_some_and(String::is_empty);
    let may_be_short =
        !layout.has_all_cells && (separator.is_white() || (is_open && cells.len() + 1 == width));
    if may_be_short && cells.len() < width {
        cells.resize(width, Cow::Borrowed(""));
    }
    if cells.len() == width {
        return Ok(cells);
    }
    let is_decimal = separator == Separator::Char(',') && cells.len() > width;
    let hint = if is_decimal {
        "; if they are decimal commas, export with another separator, such as semicolons or tabs"
    } else {
        ""
    };
    Err(format!("{} cells; expected {width}, as in line {header}{hint}", cells.len()))
}

/// The cells of a row.
struct TextRow<'a> {
    line: usize,
    input: &'a Input<'a>,
    names: &'a [String],
    cells: &'a [Cow<'a, str>],
}

impl TextRow<'_> {
    fn at(&self, column: usize) -> Place<'_> {
        let Input { file, problems, .. } = *self.input;
        Place { file, line: self.line, column: &self.names[column], text: &self.cells[column], problems }
    }

    fn text(&self, column: usize) -> &str {
        &self.cells[column]
    }
}

/// Rows already read, sorted into shots and tracks, and the properties that all cells share.
pub(super) struct Reader<'a> {
    input: &'a Input<'a>,
    layout: &'a Layout,
    times: Mark,
    positions: Mark,
    /// How the first time is written, with its line: as that of a clock or, `None`, as a number.
    clock: Option<(Option<Style>, usize)>,
    shots: Vec<RawShot>,
    by_name: HashMap<String, usize>,
    /// The shot of the row above.
    last: usize,
    /// Number of rows of `last` since its name followed another one.
    count: usize,
    /// Lines of rows that belong to no track, and of rows that are comments.
    trackless: Vec<usize>,
    commented: Vec<usize>,
}

impl<'a> Reader<'a> {
    pub(super) fn new(input: &'a Input, layout: &'a Layout) -> Self {
        Self {
            input,
            layout,
            times: Mark::default(),
            positions: Mark::default(),
            clock: None,
            shots: Vec::new(),
            by_name: HashMap::new(),
            last: usize::MAX,
            count: 0,
            trackless: Vec::new(),
            commented: Vec::new(),
        }
    }

    /// Adds a row; `first_body` is the number of bodies in the blocks above.
    pub(super) fn add(&mut self, line: usize, cells: &[Cow<str>], bodies: &[Body], first_body: usize) {
        let row = &TextRow { line, input: self.input, names: &self.layout.heading.names, cells };
        let shot = self.layout.shot.map_or(self.input.stem, |column| row.text(column));
        if let Some(column) = self.layout.shot.filter(|_| shot.is_empty()) {
            row.at(column).wrong("is empty; expected the name of a shot");
        }
        let ball = self.layout.ball();
        if let Some(column) = ball.filter(|column| row.text(*column).is_empty()) {
            if self.layout.format == Format::Columns {
                return self.trackless.push(line);
            }
            row.at(column).wrong("is empty; expected the name of a ball");
        }
        let before = self.input.problems.len();
        let time = match self.layout.time {
            Some(column) => self.time(row.at(column)),
            None => Some(if self.is_present(shot) { self.count as f64 } else { 0.0 }),
        };
        let Some(time) = time else {
            let has_position = ball.is_some() || bodies.iter().any(|body| !row.text(body.xy[0]).is_empty());
            if let Some(column) =
                self.layout.time.filter(|_| has_position && self.input.problems.len() == before)
            {
                row.at(column).wrong("is empty; expected a time, or the number of a frame");
            }
            return;
        };
        self.begin(shot, line);
        self.count += 1;
        for (i, body) in bodies.iter().enumerate() {
            self.add_body(row, time, first_body + i, body);
        }
    }

    /// Records a comment that may be a row of a shot whose name begins with #.
    fn see_comment(&mut self, line: usize, text: &str) {
        let Layout { heading, shot, time, .. } = self.layout;
        let Some(time) = time.filter(|_| *shot == Some(0)) else { return };
        let cells = text::cells(text, heading.separator).unwrap_or_default();
        if cells.len() == heading.names.len() && cells[time].parse::<f64>().is_ok() {
            self.commented.push(line);
        }
    }

    fn add_body(&mut self, row: &TextRow, time: f64, number: usize, body: &Body) {
        let name = match &body.name {
            Name::Fixed(name) => name,
            Name::Column(column) => row.text(*column),
        };
        let is_centre =
            |point: &&str| ["", "centre", "center"].iter().any(|word| point.eq_ignore_ascii_case(word));
        let point = body.point.map(|column| row.text(column)).filter(|point| !is_centre(point));
        let place = self.place(row, body);
        let marker = body.marker.map(|columns| self.position(row, columns));
        let sd = body.sd.map_or([f64::NAN; 2], |columns| self.deviations(row, columns));
        let angle = body.angle.map(|(column, unit)| {
            let angle = self.positions.beside(row.at(column));
            angle.map_or(f64::NAN, |angle| unit.radians() * angle)
        });
        let at = |place| Row::new(time, place, row.line);
        self.track(number, name, point, false).rows.push(Row { sd, ..at(place) });
        if let Some(place) = marker {
            self.track(number, name, Some("marker"), false).rows.push(at(place));
        }
        if let Some(angle) = angle {
            self.track(number, name, Some("angle"), true).rows.push(at([angle, 0.0]));
        }
    }

    fn is_present(&self, shot: &str) -> bool {
        self.shots.get(self.last).is_some_and(|last| last.name == shot)
    }

    fn begin(&mut self, name: &str, line: usize) {
        if self.is_present(name) {
            return;
        }
        self.count = 0;
        self.last = self.by_name.get(name).copied().unwrap_or(self.shots.len());
        if self.last == self.shots.len() {
            self.by_name.insert(name.to_string(), self.last);
            let first = self.shots.first().map(|shot| Arc::clone(&shot.file));
            let file = first.unwrap_or_else(|| Arc::new(self.input.file.to_path_buf()));
            let clock = self.layout.clock;
            self.shots.push(RawShot { name: name.to_string(), file, line, clock, tracks: Vec::new() });
        }
    }

    fn track(&mut self, body: usize, name: &str, point: Option<&str>, is_angle: bool) -> &mut RawTrack {
        let tracks = &mut self.shots[self.last].tracks;
        let is_it = |known: &RawTrack| {
            known.body == body
                && known.is_angle == is_angle
                && known.point.as_deref() == point
                && known.name == name
        };
        let i = tracks.iter().position(is_it).unwrap_or(tracks.len());
        if i == tracks.len() {
            tracks.push(RawTrack { body, is_angle, ..RawTrack::new(name, point.map(str::to_string)) });
        }
        &mut tracks[i]
    }

    /// Reads a time, a number or that of a clock; `None` if the cell is empty or wrong.
    fn time(&mut self, cell: Place) -> Option<f64> {
        if !is_clock(cell.text) {
            let time = self.times.number(cell)?;
            return self.is_written_alike(None, cell).then_some(time);
        }
        let Some((time, style)) = seconds(cell.text) else {
            let text = shortened(cell.text.trim());
            cell.wrong(format!("\"{text}\" is not a time; expected h:mm:ss.fff, h:mm:ss:cs or a number"));
            return None;
        };
        self.is_written_alike(Some(style), cell).then_some(time)
    }

    /// Returns whether a time is written as the first one, and complains if not. Of fractions of
    /// seconds the most digits count.
    fn is_written_alike(&mut self, style: Option<Style>, cell: Place) -> bool {
        let (first, at) = self.clock.get_or_insert((style, cell.line));
        match (first, style) {
            (Some(Style::Fraction(most)), Some(Style::Fraction(digits))) => *most = digits.max(*most),
            (first, _) if *first != style => {
                let text = shortened(cell.text.trim());
                cell.wrong(format!("\"{text}\" is not written like the time in line {at}"));
                return false;
            }
            _ => {}
        }
        true
    }

    fn position(&mut self, row: &TextRow, columns: [usize; 2]) -> [f64; 2] {
        let before = self.input.problems.len();
        let cells = columns.map(|column| row.at(column));
        match cells.map(|cell| self.positions.number(cell)) {
            [Some(x), Some(y)] => return [x, y],
            [None, None] => {}
            _ if self.input.problems.len() == before => {
                let [x, y] = cells.map(|cell| format!("{} \"{}\"", cell.column, shortened(cell.text.trim())));
                let message = format!("{x} and {y}: half a position; taken as a gap");
                self.input.log.add(Subject::Gaps, row.line, message);
            }
            _ => {}
        }
        [f64::NAN; 2]
    }

    /// Reads the position of a ball: the middle of a box, and a gap if it is too unlikely.
    fn place(&mut self, row: &TextRow, body: &Body) -> [f64; 2] {
        let corner = self.position(row, body.xy);
        let middle = body.rest.map(|rest| rest.middle(corner, self.position(row, rest.columns)));
        let place = middle.unwrap_or(corner);
        let likelihood = body.likelihood.and_then(|column| self.positions.beside(row.at(column)));
        if place[0].is_nan() || likelihood.is_none_or(|likelihood| likelihood >= LIKELY) {
            return place;
        }
        let message = format!("a position of a likelihood below {LIKELY}: taken as a gap");
        self.input.log.add(Subject::Gaps, row.line, message);
        [f64::NAN; 2]
    }

    fn deviations(&mut self, row: &TextRow, columns: [usize; 2]) -> [f64; 2] {
        columns.map(|column| {
            let cell = row.at(column);
            let sd = self.positions.beside(cell);
            if let Some(sd) = sd.filter(|sd| *sd <= 0.0) {
                cell.wrong(format!("{sd} is not a standard deviation; expected more than 0"));
            }
            sd.unwrap_or(f64::NAN)
        })
    }

    /// Reports properties of all rows, and returns the shots. Time codes become numbers of frames.
    pub(super) fn finish(mut self) -> Vec<RawShot> {
        self.note_rows_left_out();
        let Input { file, problems, log, .. } = *self.input;
        self.times.finish(file, problems);
        self.positions.finish(file, problems);
        if self.positions.is_comma() || self.times.is_comma() {
            log.add(Subject::Format, None, "decimal comma");
        }
        for track in self.shots.iter_mut().flat_map(|shot| &mut shot.tracks) {
            track.rows.shrink_to_fit();
        }
        let Some((Some(style), _)) = self.clock else { return self.shots };
        let clock = Clock::Rounded(style.resolution());
        self.shots.iter_mut().for_each(|shot| shot.clock = clock);
        self.shots
    }

    fn note_rows_left_out(&self) {
        let Self { input, layout, trackless, commented, .. } = self;
        if let Some(first) = commented.first() {
            let message = format!(
                "{} rows from here on begin with #: passed over as comments. If # belongs to the name of a shot, put the \
                 name in quotation marks",
                commented.len()
            );
            input.log.add(Subject::Repeated, *first, message);
        }
        let (Some(column), Some(first)) = (layout.ball(), trackless.first()) else { return };
        let name = layout.heading.names[column].as_str();
        if self.shots.is_empty() {
            let message = "is empty in every row; expected names of tracks, or no ball in [tracks.columns]: both balls are then followed \
                           from frame to frame";
            input.wrong(*first, name, message);
        } else {
            let rows = trackless.len();
            let message = format!("{rows} rows from here on belong to no track ({name} is empty): left out");
            input.log.add(Subject::Gaps, *first, message);
        }
    }
}
