//! The one way from the rows of a file to shots and tracks.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use super::cells::CellReader;
use super::input::Input;
use super::layout::{Block, Body, Layout, Name};
use super::raw::{self, Clock, GAPS, RawShot, RawTrack};
use super::settings::TimeUnit;
use crate::io::number::Place;
use crate::io::text::{Separator, lines, split_into};

/// After so many problems of a file the rest of it is not read.
const ENOUGH: usize = 100;

/// A row of a table.
pub(super) struct Row<'a> {
    pub line: usize,
    input: &'a Input<'a>,
    names: &'a [String],
    cells: &'a [Cow<'a, str>],
}

impl Row<'_> {
    pub(super) fn at(&self, column: usize) -> Place<'_> {
        let Input { file, problems, .. } = *self.input;
        Place { file, line: self.line, column: &self.names[column], text: &self.cells[column], problems }
    }

    fn text(&self, column: usize) -> &str {
        self.cells[column].trim()
    }
}

/// Reads all rows of a file.
pub(super) fn read(input: &Input, layout: &Layout) -> Vec<RawShot> {
    let mut gathered = Gathered {
        input,
        layout,
        cells: CellReader::new(input),
        shots: Vec::new(),
        by_name: HashMap::new(),
        last: usize::MAX,
        count: 0,
        trackless: Vec::new(),
    };
    let mut first_body = 0;
    let mut present = 0;
    each_row(input, layout, |row, block| {
        while present < block {
            first_body += layout.blocks[present].bodies.len();
            present += 1;
        }
        gathered.add(row, first_body, &layout.blocks[block].bodies);
    });
    gathered.finish()
}

/// Calls `each` with every row and the number of its block. Comments (`#`) and blank lines are passed over; a wrong number of cells
/// is a problem.
fn each_row(input: &Input, layout: &Layout, mut each: impl FnMut(&Row, usize)) {
    let (names, separator) = (layout.heading.names.as_slice(), layout.heading.separator);
    let width = names.len();
    let is_open = names.last().is_some_and(String::is_empty);
    let before = input.problems.len();
    let (mut cells, mut number) = (Vec::new(), 0);
    for (line, text) in lines(input.text) {
        while layout.blocks.get(number).is_some_and(|block| line > block.last) {
            number += 1;
        }
        let Some(Block { header, above, .. }) = layout.blocks.get(number) else { return };
        if input.problems.len() >= before + ENOUGH {
            return;
        }
        let content = text.trim_start();
        if line <= *above || content.is_empty() || content.starts_with('#') {
            continue;
        }
        if !split_into(&mut cells, text, separator) {
            input.wrong(line, None, "a quotation mark does not close in this line, or text follows it");
            continue;
        }
        // spreadsheets go on with empty cells
        while cells.len() > width && cells.last().is_some_and(|cell| cell.trim().is_empty()) {
            cells.pop();
        }
        let may_be_short =
            !layout.has_all_cells && (separator.is_white() || (is_open && cells.len() + 1 == width));
        if may_be_short && cells.len() < width {
            cells.resize(width, Cow::Borrowed(""));
        }
        if cells.len() != width {
            let hint = if separator == Separator::Char(',') && cells.len() > width {
                "; if they are decimal commas, export with another separator, such as semicolons or tabs"
            } else {
                ""
            };
            let message = format!("{} cells; expected {width}, as in line {header}{hint}", cells.len());
            input.wrong(line, None, message);
            continue;
        }
        each(&Row { line, input, names, cells: &cells }, number);
    }
}

/// The rows so far, sorted into shots and tracks.
struct Gathered<'a> {
    input: &'a Input<'a>,
    layout: &'a Layout,
    cells: CellReader<'a>,
    shots: Vec<Shot>,
    by_name: HashMap<String, usize>,
    /// The shot of the row above.
    last: usize,
    /// Rows of that shot since its name stood above another one.
    count: usize,
    /// Lines of rows that belong to no track.
    trackless: Vec<usize>,
}

struct Shot {
    name: String,
    line: usize,
    tracks: Vec<Track>,
}

struct Track {
    /// The number of the body, since two may have the same name.
    body: usize,
    track: RawTrack,
}

impl Gathered<'_> {
    /// Adds a row with these bodies, of which the first has this number.
    fn add(&mut self, row: &Row, first_body: usize, bodies: &[Body]) {
        let shot = self.layout.shot.map_or(self.input.stem, |column| row.text(column));
        if let Some(column) = self.layout.shot.filter(|_| shot.is_empty()) {
            row.at(column).wrong("is empty; expected the name of a shot");
        }
        if self.names_no_ball(row, bodies) {
            return;
        }
        let found = self.input.problems.len();
        let time = match self.layout.time {
            Some(column) => self.cells.time(row.at(column)),
            None => Some(if self.is_present(shot) { self.count as f64 } else { 0.0 }),
        };
        let Some(time) = time else {
            if self.input.problems.len() == found {
                self.complain_of_no_time(row, bodies);
            }
            return;
        };
        self.begin(shot, row.line);
        self.count += 1;
        for (i, body) in bodies.iter().enumerate() {
            self.add_body(row, time, first_body + i, body);
        }
    }

    /// Returns whether a row is to be left out since it names no ball; complains if it must name one.
    fn names_no_ball(&mut self, row: &Row, bodies: &[Body]) -> bool {
        for body in bodies {
            let Name::Column { column, may_be_empty } = body.name else { continue };
            if !row.text(column).is_empty() {
                continue;
            }
            if may_be_empty {
                self.trackless.push(row.line);
                return true;
            }
            row.at(column).wrong("is empty; expected the name of a ball");
        }
        false
    }

    /// Complains of a row without a time, unless it has no position either, as below the end of a film.
    fn complain_of_no_time(&self, row: &Row, bodies: &[Body]) {
        let Some(column) = self.layout.time else { return };
        let is_long = bodies.iter().any(|body| matches!(body.name, Name::Column { .. }));
        if is_long || bodies.iter().any(|body| !row.text(body.at.x).is_empty()) {
            let is_frame = self.layout.clock == Clock::In(TimeUnit::Frames);
            let expected = if is_frame { "the number of a frame" } else { "a time" };
            row.at(column).wrong(format!("is empty; expected {expected}"));
        }
    }

    fn add_body(&mut self, row: &Row, time: f64, number: usize, body: &Body) {
        let name = match &body.name {
            Name::Fixed(name) => name,
            Name::Column { column, .. } => row.text(*column),
        };
        let point = body.point.map(|column| row.text(column)).filter(|point| {
            !(point.is_empty() || ["centre", "center"].iter().any(|word| point.eq_ignore_ascii_case(word)))
        });
        let [x, y] = self.cells.place(row, body.at);
        let marker = body.marker.map(|columns| self.cells.position(row, columns));
        let sd = body.sd.map(|columns| self.cells.deviations(row, columns));
        let angle = body.angle.map(|(column, unit)| (self.cells.beside(row.at(column)), unit));
        let place = raw::Row { time, x, y, line: row.line };
        let track = self.track(number, name, point, false);
        track.rows.push(place);
        track.sds.extend(sd);
        if let Some([x, y]) = marker {
            self.track(number, name, Some("marker"), false).rows.push(raw::Row { x, y, ..place });
        }
        if let Some((angle, unit)) = angle {
            let x = angle.map_or(f64::NAN, |angle| unit.radians() * angle);
            self.track(number, name, Some("angle"), true).rows.push(raw::Row { x, y: 0.0, ..place });
        }
    }

    fn is_present(&self, shot: &str) -> bool {
        self.shots.get(self.last).is_some_and(|last| last.name == shot)
    }

    /// Makes the shot of this name the present one.
    fn begin(&mut self, name: &str, line: usize) {
        if self.is_present(name) {
            return;
        }
        self.count = 0;
        self.last = self.by_name.get(name).copied().unwrap_or(self.shots.len());
        if self.last == self.shots.len() {
            self.by_name.insert(name.to_string(), self.last);
            self.shots.push(Shot { name: name.to_string(), line, tracks: Vec::new() });
        }
    }

    /// Returns a track of the present shot.
    fn track(&mut self, body: usize, name: &str, point: Option<&str>, is_angle: bool) -> &mut RawTrack {
        let tracks = &mut self.shots[self.last].tracks;
        let is_it = |known: &Track| {
            known.body == body
                && known.track.is_angle == is_angle
                && known.track.point.as_deref() == point
                && known.track.name == name
        };
        let i = tracks.iter().position(is_it).unwrap_or(tracks.len());
        if i == tracks.len() {
            let track = RawTrack { is_angle, ..RawTrack::new(name, point.map(str::to_string)) };
            tracks.push(Track { body, track });
        }
        &mut tracks[i].track
    }

    /// Says what is known once all rows are read, and returns the shots.
    fn finish(self) -> Vec<RawShot> {
        self.say_trackless();
        let file: Arc<PathBuf> = Arc::new(self.input.file.to_path_buf());
        let shot = |Shot { name, line, tracks }: Shot| RawShot {
            name,
            file: file.clone(),
            line,
            clock: self.layout.clock,
            tracks: tracks.into_iter().map(|known| known.track).collect(),
        };
        let mut shots: Vec<RawShot> = self.shots.into_iter().map(shot).collect();
        if let Some(clock) = self.cells.finish(shots.iter_mut().flat_map(|shot| &mut shot.tracks)) {
            for shot in &mut shots {
                shot.clock = clock;
            }
        }
        shots
    }

    fn say_trackless(&self) {
        let bodies = self.layout.blocks.iter().flat_map(|block| &block.bodies);
        let column = bodies.clone().find_map(|body| match body.name {
            Name::Column { column, .. } => Some(column),
            Name::Fixed(_) => None,
        });
        let (Some(column), Some(first)) = (column, self.trackless.first()) else { return };
        let name = self.layout.heading.names[column].as_str();
        if self.shots.is_empty() {
            let message = "is empty in every row; expected names of tracks, or no ball in [tracks.columns]: both balls are then followed \
                           from frame to frame";
            self.input.wrong(*first, name, message);
        } else {
            let rows = self.trackless.len();
            let message = format!("{rows} rows from here on belong to no track ({name} is empty): left out");
            self.input.log.add(GAPS, *first, message);
        }
    }
}
