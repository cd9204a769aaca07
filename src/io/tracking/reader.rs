//! Reading of a file's rows to shots and tracks, for all formats.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

use super::cells::CellReader;
use super::input::{Input, Row};
use super::layout::{Block, Body, Layout, Name};
use super::raw::{self, Clock, GAPS, RawShot, RawTrack};
use super::settings::TimeUnit;
use crate::io::text::{self, Separator, lines};

/// Number of problems of a file after which reading ends.
const MAX_PROBLEMS: usize = 100;

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
    each_row(input, layout, |row, block| gathered.add(row, block));
    gathered.finish()
}

/// Calls `each` with every row and the number of its block. Skips comments (`#`) and blank lines;
/// reports a wrong number of cells.
fn each_row(input: &Input, layout: &Layout, mut each: impl FnMut(&Row, usize)) {
    let (names, separator) = (layout.heading.names.as_slice(), layout.heading.separator);
    let width = names.len();
    let is_open = names.last().is_some_and(String::is_empty);
    let before = input.problems.len();
    let mut number = 0;
    for (line, text) in lines(input.text) {
        while layout.blocks.get(number).is_some_and(|block| line > block.last) {
            number += 1;
        }
        let Some(Block { header, above, .. }) = layout.blocks.get(number) else { return };
        if input.problems.len() >= before + MAX_PROBLEMS {
            return;
        }
        let content = text.trim_start();
        if line <= *above || content.is_empty() || content.starts_with('#') {
            continue;
        }
        let Ok(mut cells) = text::cells(text, separator) else {
            input.wrong(line, None, "a quotation mark does not close in this line, or text follows it");
            continue;
        };
        // spreadsheets continue with empty cells
        while cells.len() > width && cells.last().is_some_and(|cell| cell.is_empty()) {
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

/// Rows already read, sorted into shots and tracks.
struct Gathered<'a> {
    input: &'a Input<'a>,
    layout: &'a Layout,
    cells: CellReader<'a>,
    shots: Vec<RawShot>,
    by_name: HashMap<String, usize>,
    /// The shot of the row above.
    last: usize,
    /// Number of rows of `last` since its name followed another one.
    count: usize,
    /// Lines of rows that belong to no track.
    trackless: Vec<usize>,
}

impl Gathered<'_> {
    fn add(&mut self, row: &Row, block: usize) {
        let bodies = &self.layout.blocks[block].bodies;
        let first_body: usize = self.layout.blocks[..block].iter().map(|block| block.bodies.len()).sum();
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

    /// Returns whether a row is left out since it names no ball; complains if it must name one.
    fn names_no_ball(&mut self, row: &Row, bodies: &[Body]) -> bool {
        for body in bodies {
            let Name::Column(column) = body.name else { continue };
            if !row.text(column).is_empty() {
                continue;
            }
            if self.layout.may_lack_ball {
                self.trackless.push(row.line);
                return true;
            }
            row.at(column).wrong("is empty; expected the name of a ball");
        }
        false
    }

    /// Complains about a row with a position but without a time.
    fn complain_of_no_time(&self, row: &Row, bodies: &[Body]) {
        let Some(column) = self.layout.time else { return };
        let is_long = bodies.iter().any(|body| matches!(body.name, Name::Column(_)));
        if is_long || bodies.iter().any(|body| !row.text(body.at.x).is_empty()) {
            let is_frame = self.layout.clock == Clock::In(TimeUnit::Frames);
            let expected = if is_frame { "the number of a frame" } else { "a time" };
            row.at(column).wrong(format!("is empty; expected {expected}"));
        }
    }

    fn add_body(&mut self, row: &Row, time: f64, number: usize, body: &Body) {
        let name = match &body.name {
            Name::Fixed(name) => name,
            Name::Column(column) => row.text(*column),
        };
        let point = body.point.map(|column| row.text(column)).filter(|point| {
            !(point.is_empty() || ["centre", "center"].iter().any(|word| point.eq_ignore_ascii_case(word)))
        });
        let [x, y] = self.cells.place(row, body.at);
        let marker = body.marker.map(|columns| self.cells.position(row, columns));
        let sd = body.sd.map_or([f64::NAN; 2], |columns| self.cells.deviations(row, columns));
        let angle = body.angle.map(|(column, unit)| (self.cells.beside(row.at(column)), unit));
        let place = raw::Row::new(time, [x, y], row.line);
        self.track(number, name, point, false).rows.push(raw::Row { sd, ..place });
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

    /// Makes the shot of this name the current one.
    fn begin(&mut self, name: &str, line: usize) {
        if self.is_present(name) {
            return;
        }
        self.count = 0;
        self.last = self.by_name.get(name).copied().unwrap_or(self.shots.len());
        if self.last == self.shots.len() {
            self.by_name.insert(name.to_string(), self.last);
            let (file, clock) = (Arc::new(self.input.file.to_path_buf()), self.layout.clock);
            let file = self.shots.first().map_or(file, |shot| Arc::clone(&shot.file));
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

    /// Reports problems of all rows, and returns the shots.
    fn finish(self) -> Vec<RawShot> {
        self.say_trackless();
        let mut shots = self.shots;
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
            Name::Column(column) => Some(column),
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
