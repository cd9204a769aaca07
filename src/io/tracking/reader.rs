//! Reading of a file's rows to shots and tracks, for all formats.

use std::borrow::Cow;

use indexmap::IndexMap;

use super::heading::Heading;
use super::raw::{Job, RawShot, RawTrack, Row, Stated, stem};
use super::settings::Format;
use super::time::count_frames;
use super::words::{Clock, Unit, clock};
use crate::io::error::{Subject, listed, message};
use crate::io::text::{self, Mark, Place, lines, name_of, shortened, wrong_width};

/// Number of problems of a file after which reading ends.
const MAX_PROBLEMS: usize = 100;
/// Least likelihood of a position, unless stated: the default of `DeepLabCut`.
const LIKELY: f64 = 0.6;

/// Reads the rows of a file; reports those with a wrong number of cells.
pub(super) fn read(job: Job, layout: &Layout) -> Vec<RawShot> {
    let mut reader = Reader::new(job, layout);
    let limit = job.log.len() + MAX_PROBLEMS;
    let Heading { names, separator, .. } = &layout.heading;
    for (line, text) in lines(job.text).take_while(|_| job.log.len() < limit) {
        let content = text.trim_start();
        let bodies = layout.bodies_at(line);
        // a row of empty cells may be a frame if rows are counted
        let is_empty = content.is_empty() || layout.time.is_some() && !text::is_filled(content);
        if is_empty || bodies.is_empty() {
            continue;
        }
        let cells = text::cells(text, *separator);
        if content.starts_with('#') {
            if cells.is_ok_and(|cells| layout.shot == Some(0) && cells.len() == names.len()) {
                let message = "rows that begin with #, passed over as comments: quote names of shots that begin with it";
                job.note(Subject::Repeated, line, message);
            }
            continue;
        }
        let Ok(mut cells) = cells else {
            job.wrong(line, None, "a quotation mark does not close in this line, or text follows it");
            continue;
        };
        // spreadsheets continue with empty cells
        while cells.len() > names.len() && cells.last().is_some_and(|cell| cell.is_empty()) {
            cells.pop();
        }
        let is_open = names.last().is_some_and(String::is_empty) && cells.len() + 1 == names.len();
        if (matches!(separator, None | Some(' ' | '\t')) || is_open) && cells.len() < names.len() {
            cells.resize(names.len(), Cow::Borrowed(""));
        }
        if cells.len() == names.len() {
            reader.add(line, &cells, bodies);
        } else {
            job.wrong(line, None, wrong_width(cells.len(), names.len(), layout.heading.line, *separator));
        }
    }
    reader.finish()
}

/// Rows already read, sorted into shots and tracks, and the properties that all cells share.
pub(super) struct Reader<'a> {
    job: Job<'a>,
    layout: &'a Layout,
    /// The name of the file's only shot.
    stem: Cow<'a, str>,
    times: Mark,
    positions: Mark,
    /// The mark before the fraction of the first time if it is that of a clock, with its line.
    clock: Option<(Option<char>, usize)>,
    /// Largest number of digits of such fractions.
    digits: usize,
    /// The shots by their names, with rows in the order of the file.
    shots: IndexMap<String, RawShot>,
}

impl<'a> Reader<'a> {
    pub(super) fn new(job: Job<'a>, layout: &'a Layout) -> Self {
        let (times, positions, shots) = (Mark::default(), Mark::default(), IndexMap::new());
        Self { job, layout, stem: stem(job.file), times, positions, clock: None, digits: 0, shots }
    }

    pub(super) fn add(&mut self, line: usize, cells: &[Cow<str>], bodies: &[Body]) {
        let (job, layout) = (self.job, self.layout);
        let Job { file, log, .. } = job;
        let at = |column: usize| {
            let (column, text) = (layout.heading.names[column].as_str(), cells[column].as_ref());
            Place { file, line, column, text, log }
        };
        let before = log.len();
        for (what, column) in [("shot", layout.shot), ("ball", layout.ball)] {
            let Some(cell) = column.map(at).filter(|cell| cell.text.is_empty()) else { continue };
            if what == "ball" && layout.stated.format == Format::Columns {
                let message = format!("rows that belong to no track ({} is empty): left out", cell.column);
                return job.note(Subject::Gaps, line, message);
            }
            cell.wrong(format!("is empty; expected the name of a {what}"));
        }
        let time = layout.time.map(|column| self.time(at(column)));
        if let (Some(column), Some(None)) = (layout.time, time) {
            let is_seen = |body: &Body| layout.ball.is_some() || !at(body.xy[0]).text.is_empty();
            if log.len() == before && bodies.iter().any(is_seen) {
                at(column).wrong("is empty; expected a time, or the number of a frame");
            }
            return;
        }
        let name = layout.shot.map_or(&*self.stem, |column| at(column).text);
        // rows of one shot mostly follow each other
        let is_last = self.shots.last().is_some_and(|(last, _)| last == name);
        let known = if is_last { Some(self.shots.len() - 1) } else { self.shots.get_index_of(name) };
        let shot = known.unwrap_or_else(|| {
            let (file, name, stated) = (file.to_path_buf(), name.to_string(), layout.stated);
            let shot = RawShot { name, file, line, stated, tracks: Vec::new() };
            self.shots.insert_full(shot.name.clone(), shot).0
        });
        // without times, rows of a shot are counted
        let rows = self.shots[shot].tracks.first().map_or(0, |track| track.rows.len());
        // −0 is 0
        let time = time.flatten().unwrap_or(rows as f64) + 0.0;
        for body in bodies {
            let row = Row { time, place: self.place(body, at), sd: self.deviations(body, at), line };
            let name = layout.ball.map_or(body.name.as_str(), |column| at(column).text);
            let point = body.point.map_or(body.part, |column| at(column).text);
            let is_centre = ["", "centre", "center"].iter().any(|word| point.eq_ignore_ascii_case(word));
            let point = (!is_centre).then_some(point);
            let tracks = &mut self.shots[shot].tracks;
            // hands write White and white for one ball
            let is_name = |own: &str| own == name || layout.ball.is_some() && own.eq_ignore_ascii_case(name);
            let is_it = |known: &RawTrack| known.point.as_deref() == point && is_name(&known.name);
            let track = tracks.iter().position(is_it).unwrap_or_else(|| {
                let (name, point) = (name.to_string(), point.map(str::to_string));
                let is_angle = body.angle.is_some();
                tracks.push(RawTrack { name, point, is_angle, ..RawTrack::default() });
                tracks.len() - 1
            });
            tracks[track].rows.push(row);
        }
    }

    /// Reads a time, written as the first one is.
    fn time(&mut self, cell: Place) -> Option<f64> {
        let wrong = |why: &str| cell.wrong(format!("\"{}\" {why}", shortened(cell.text.trim())));
        let (time, mark) = if !cell.text.contains(':') {
            (self.times.number(cell)?, None)
        } else if let Some(Clock { seconds, has_colon, digits }) = clock(cell.text) {
            self.digits = self.digits.max(digits);
            (seconds, Some(if has_colon { ':' } else { '.' }))
        } else {
            wrong("is not a time; expected h:mm:ss.fff, h:mm:ss:cs or a number");
            return None;
        };
        let (first, at) = *self.clock.get_or_insert((mark, cell.line));
        if first != mark {
            wrong(&format!("is not written like the time in line {at}"));
            return None;
        }
        Some(time)
    }

    /// Reads the position of a body (the middle of a box; a gap if it is unlikely) or an angle.
    fn place<'c>(&mut self, body: &Body, at: impl Fn(usize) -> Place<'c>) -> [f64; 2] {
        if let Some(unit) = body.angle {
            let angle = self.positions.beside(at(body.xy[0])).unwrap_or(f64::NAN);
            return [if unit == Unit::Deg { 1.0_f64.to_radians() * angle } else { angle }, 0.0];
        }
        let place = [0, 1].map(|axis: usize| {
            let mut number = |pair: [usize; 2]| self.positions.number(at(pair[axis])).unwrap_or(f64::NAN);
            let place = number(body.xy);
            let place = body.corner.map_or(place, |corner| f64::midpoint(place, number(corner)));
            body.size.map_or(place, |size| place + 0.5 * number(size))
        });
        let line = at(body.xy[0]).line;
        if place[0].is_nan() != place[1].is_nan() {
            self.job.note(Subject::Gaps, line, "half a position; taken as a gap");
        }
        let likelihood = body.likelihood.and_then(|column| self.positions.beside(at(column)));
        if place[0].is_nan() || likelihood.is_none_or(|likelihood| likelihood >= LIKELY) {
            return place;
        }
        let message = format!("a position of a likelihood below {LIKELY}: taken as a gap");
        self.job.note(Subject::Gaps, line, message);
        [f64::NAN; 2]
    }

    fn deviations<'c>(&mut self, body: &Body, at: impl Fn(usize) -> Place<'c>) -> Option<[f64; 2]> {
        let [x, y] = body.sd?.map(at).map(|cell| {
            let sd = self.positions.beside(cell)?;
            if sd <= 0.0 {
                cell.wrong(format!("{sd} is not a standard deviation; expected more than 0"));
            }
            Some(sd)
        });
        Some([x?, y?])
    }

    /// Reports properties of all rows; time codes become numbers of frames.
    pub(super) fn finish(self) -> Vec<RawShot> {
        let job = self.job;
        // numbers of JSON have no mark between thousands
        if self.layout.stated.format != Format::Json {
            self.times.finish(job.file, job.log);
            self.positions.finish(job.file, job.log);
        }
        if self.positions.is_comma() || self.times.is_comma() {
            job.note(Subject::Format, None, "decimal comma");
        }
        let mut shots: Vec<RawShot> = self.shots.into_values().collect();
        for RawTrack { rows, .. } in shots.iter_mut().flat_map(|shot| &mut shot.tracks) {
            let (mut midnight, mut before) = (0.0, 0.0);
            // the clock begins again at 0
            for row in rows.iter_mut().filter(|_| matches!(self.clock, Some((Some(_), _)))) {
                if row.time + midnight < before - 43_200.0 {
                    midnight += 86_400.0;
                }
                row.time += midnight;
                before = row.time;
            }
            rows.sort_by(|a, b| a.time.total_cmp(&b.time));
        }
        if let Some((Some(mark), line)) = self.clock {
            let rounding = Some(1.0 / 10.0_f64.powi(self.digits as i32));
            let mut stated = Stated { time: Some(Unit::S), rounding, ..self.layout.stated };
            let rate = if (mark, self.digits) == (':', 2) { count_frames(&mut shots) } else { None };
            if let Some(rate) = rate {
                let message = format!("times are time codes h:mm:ss:ff with {rate} frames to a second");
                job.note(Subject::Clock, line, message);
                stated = Stated { time: Some(Unit::Frames), rounding: None, ..stated };
            }
            for shot in &mut shots {
                shot.stated = stated;
            }
        }
        shots
    }
}

#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(crate) heading: Heading,
    /// The columns that name the shot and the ball of a row.
    pub(crate) shot: Option<usize>,
    pub(crate) ball: Option<usize>,
    /// The column of times; `None`: the rows of a shot are counted.
    pub(crate) time: Option<usize>,
    pub(crate) stated: Stated,
    /// In the order of their lines.
    pub(crate) bodies: Vec<Body>,
}

/// A tracked body, or a point on it, and the columns of its position.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Body {
    /// The first line of its title, which ends bodies above, and the line above its rows, unless
    /// that is the heading.
    pub(crate) begin: usize,
    pub(crate) above: usize,
    /// The name, unless the layout has a column of balls.
    pub(crate) name: String,
    /// The column that names the point in a table with a row per ball and frame.
    pub(crate) point: Option<usize>,
    /// The name of a point that no column names, "marker" or "angle".
    pub(crate) part: &'static str,
    /// The unit if the column x holds angles of a disc.
    pub(crate) angle: Option<Unit>,
    pub(crate) xy: [usize; 2],
    /// The columns of the other corner of a box with a corner at x and y, or of its size.
    pub(crate) corner: Option<[usize; 2]>,
    pub(crate) size: Option<[usize; 2]>,
    /// The columns of the position's likelihood, and of its standard deviations.
    pub(crate) likelihood: Option<usize>,
    pub(crate) sd: Option<[usize; 2]>,
}

impl Body {
    pub(super) fn new(name: impl Into<String>, xy: [usize; 2]) -> Self {
        Self { name: name.into(), xy, ..Self::default() }
    }

    /// Returns the body and its parts with the columns of the keys that begin with `begin`; `None`
    /// without x and y, or without a unit of angles.
    pub(super) fn of_keys(
        name: &str,
        begin: &str,
        angle_unit: impl Fn(usize) -> Option<Unit>,
        at: impl Fn(&str) -> Option<usize>,
    ) -> Option<Vec<Self>> {
        let column = |key: &str| at(&format!("{begin}{key}"));
        let pair = |one: &str, other: &str| Some([column(one)?, column(other)?]);
        let part = |part, xy| Self { part, ..Self::new(name, xy) };
        let centre = Self {
            point: column("point"),
            corner: pair("x2", "y2"),
            size: pair("width", "height"),
            likelihood: column("likelihood"),
            sd: pair("x_sd", "y_sd"),
            ..part("", pair("x", "y")?)
        };
        let marker = pair("marker_x", "marker_y").map(|xy| part("marker", xy));
        let mut bodies: Vec<Self> = [Some(centre), marker].into_iter().flatten().collect();
        if let Some(column) = column("angle") {
            bodies.push(Self { angle: Some(angle_unit(column)?), ..part("angle", [column; 2]) });
        }
        Some(bodies)
    }

    fn lengths(&self) -> impl Iterator<Item = usize> {
        let pairs = [Some(self.xy), self.corner, self.size, self.sd];
        pairs.into_iter().filter(|_| self.angle.is_none()).flatten().flatten()
    }
}

/// Numbers equal names, in their order: "A (1)", "A (2)".
pub(super) fn number_twins(names: Vec<&mut String>) {
    let given: Vec<String> = names.iter().map(|name| (*name).clone()).collect();
    for (i, name) in names.into_iter().enumerate() {
        let before = given[..i].iter().filter(|other| *other == name).count();
        if before > 0 || given[i + 1..].contains(name) {
            *name = format!("{name} ({})", before + 1);
        }
    }
}

impl Layout {
    /// Returns the layout of bodies; the flag marks frame numbers. Complains about other units.
    pub(super) fn new(
        format: Format,
        heading: Heading,
        mut bodies: Vec<Body>,
        time: Option<(usize, bool)>,
        job: Job,
    ) -> Self {
        let centres = bodies.iter_mut().filter(|body| body.part.is_empty());
        number_twins(centres.map(|body| &mut body.name).collect());
        let lengths = bodies.iter().flat_map(Body::lengths);
        let unit = heading.unit(lengths, Unit::M, None, job);
        let clock = time.filter(|(_, is_frame)| !is_frame).map(|(column, _)| heading.time(column, job));
        let stated = Stated { format, unit, time: clock.or(Some(Unit::Frames)), ..Stated::default() };
        Self { heading, shot: None, ball: None, time: time.map(|(column, _)| column), stated, bodies }
    }

    /// Returns the bodies of the row in a line.
    fn bodies_at(&self, line: usize) -> &[Body] {
        let begun = &self.bodies[..self.bodies.partition_point(|body| body.begin <= line)];
        let last = begun.chunk_by(|a, b| a.begin == b.begin).next_back();
        last.filter(|bodies| self.heading.above.max(bodies[0].above) < line).unwrap_or_default()
    }

    /// Notes how a file is read, and which of its columns are not.
    pub(super) fn note(&self, job: Job) {
        let Heading { names, separator, above, .. } = &self.heading;
        let others = |body: &Body| [body.point, body.likelihood, Some(body.xy[0])];
        let mut read: Vec<usize> = self.bodies.iter().flat_map(Body::lengths).collect();
        read.extend(self.bodies.iter().flat_map(others).chain([self.shot, self.ball, self.time]).flatten());
        let is_passed = |(i, name): &(usize, &String)| {
            !read.contains(i) && !name.is_empty() && !name.starts_with("column ")
        };
        let passed: Vec<&String> = names.iter().enumerate().filter(is_passed).map(|(_, name)| name).collect();
        let (format, separator, passed) = (self.stated.format.shown(), name_of(*separator), listed(&passed));
        job.note(Subject::Format, None, message!("format", format, separator, first => above + 1, passed));
    }
}
