//! A row per ball and frame: the canonical table and others like it.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use super::heading::{Heading, TITLES};
use super::input::{Input, quoted};
use super::raw::{Clock, FORMAT, GAPS, REPEATED, RawShot, RawTrack, Row};
use super::settings::{TimeUnit, Unit};
use super::sheet::{At, Reader, Sheet};
use crate::io::rows::near_miss;
use crate::io::text::{Separator, lines, trimmed};

/// Columns of a long table, by their position.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Columns {
    pub shot: Option<usize>,
    pub time: usize,
    pub frames: bool,
    /// `None`: the balls are told apart by their paths.
    pub ball: Option<usize>,
    pub point: Option<usize>,
    pub at: At,
    pub sd: Option<[usize; 2]>,
    pub marker: Option<[usize; 2]>,
    /// How far a disc has turned.
    pub angle: Option<Angle>,
    /// Rows that name no ball are detections that belong to no track: they are left out.
    pub has_trackless: bool,
}

/// A column of angles, with the radians in its unit.
pub(super) type Angle = (usize, f64);

/// The parts of a long table above its rows.
#[derive(Clone, Debug)]
pub(super) struct Head {
    pub heading: Heading,
    pub columns: Columns,
}

/// What the header says of times and lengths.
pub(super) struct Stated {
    pub clock: TimeUnit,
    pub unit: Option<Unit>,
}

/// The columns of the canonical table.
const KNOWN: [&str; 10] = ["shot", "frame", "t", "ball", "x", "y", "z", "point", "x_sd", "y_sd"];

/// Whether the text begins like the canonical table, below a title perhaps.
pub(super) fn detect(input: &Input) -> Option<Head> {
    let no_comment = |line: &str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
    lines(input.text).filter(|(_, line)| no_comment(line)).take(TITLES).find_map(|(line, content)| {
        let named = |separator: Separator| {
            let names: Vec<_> = trimmed(content, separator)?.iter().map(|name| name.to_lowercase()).collect();
            // most lines are no header: looked at more closely only if it may be one
            if !names.iter().any(|name| name == "ball") {
                return None;
            }
            let heading = Heading::new(input.text, line, separator, names);
            let position = |name: &str| heading.position(name).filter(|_| KNOWN.contains(&name));
            let columns = Columns::of(position, input).filter(|columns| columns.ball.is_some())?;
            Some(Head { heading, columns })
        };
        Separator::ALL.into_iter().filter(|s| !s.is_white() || *s == Separator::Char('\t')).find_map(named)
    })
}

/// Complaints and notes about the header. `None` if the table cannot be read.
pub(super) fn check_head(head: &Head, input: &Input) -> Option<Stated> {
    let (heading, before) = (&head.heading, input.problems.len());
    let mut strange = Vec::new();
    for (i, name) in heading.bare.iter().enumerate() {
        if !KNOWN.contains(&name.as_str()) {
            if let Some(meant) = near_miss(name, &KNOWN, |name| heading.bare.iter().any(|own| own == name)) {
                let message = format!(
                    "is no known name, but nearly {meant}; write {meant}, or give the column another name"
                );
                input.wrong(heading.line, name.as_str(), message);
            }
            strange.push(name);
        } else if heading.bare[..i].contains(name) {
            input.wrong(heading.line, name.as_str(), "stands twice in the header");
        }
    }
    let has = |name: &str| heading.bare.iter().any(|own| own == name);
    if has("x_sd") != has("y_sd") {
        input.wrong(heading.line, None, "x_sd and y_sd go together; expected both or neither");
    }
    let stated = head.columns.stated(heading, input);
    if input.problems.len() > before {
        return None;
    }
    let passed = if strange.is_empty() {
        String::new()
    } else {
        format!("; columns passed over: {}", quoted(strange))
    };
    let heights = if has("z") {
        "; heights (z) are not used: how high a ball flies follows from its path seen from above"
    } else {
        ""
    };
    let message =
        format!("read as a long table, {} between cells{passed}{heights}", heading.separator.name());
    input.log.add(FORMAT, None, message);
    Some(stated)
}

impl Columns {
    /// Those that a table has, where `at` tells the positions of ours; `None` where it lacks one that must be there.
    pub(super) fn of(at: impl Fn(&str) -> Option<usize>, input: &Input) -> Option<Self> {
        let (time, frames) = time(&at, input)?;
        let pair = |x: &str, y: &str| Some([at(x)?, at(y)?]);
        Some(Self {
            shot: at("shot"),
            time,
            frames,
            ball: at("ball"),
            point: at("point"),
            at: At::of(&at, "")?,
            sd: pair("x_sd", "y_sd"),
            marker: pair("marker_x", "marker_y"),
            angle: None,
            has_trackless: false,
        })
    }

    /// The units that the header gives these columns; complaints where it contradicts itself or dataset.toml.
    pub(super) fn stated(&self, heading: &Heading, input: &Input) -> Stated {
        let others = [self.sd, self.marker].into_iter().flatten().flatten();
        let lengths: Vec<usize> = self.at.lengths().chain(others).collect();
        let unit = heading.length(&lengths, input);
        let clock = if self.frames { TimeUnit::Frames } else { heading.time(self.time, input) };
        Stated { clock, unit }
    }
}

/// The column of times, and whether these are numbers of frames.
pub(super) fn time(at: impl Fn(&str) -> Option<usize>, input: &Input) -> Option<(usize, bool)> {
    let (frame, time) = (at("frame"), at("t"));
    let frame = frame.filter(|_| input.is_by_frame() || time.is_none());
    Some((frame.or(time)?, frame.is_some()))
}

/// Notes rows that are taken for comments since the name of their shot begins with #.
pub(super) fn note_comments(head: &Head, input: &Input) {
    if head.columns.shot != Some(0) || !input.text.contains("\n#") {
        return;
    }
    let is_row = |line: &str| {
        let cells = trimmed(line, head.heading.separator).unwrap_or_default();
        cells.len() == head.heading.names.len()
            && [head.columns.time, head.columns.at.x].iter().all(|i| cells[*i].parse::<f64>().is_ok())
    };
    let below = lines(input.text).skip(head.heading.line);
    let mut commented = below.filter(|(_, line)| line.starts_with('#') && is_row(line));
    if let Some((first, _)) = commented.next() {
        let message = format!(
            "{} rows from here on begin with #: passed over as comments. If # belongs to the name of a shot, put the \
             name in quotation marks",
            commented.count() + 1
        );
        input.log.add(REPEATED, first, message);
    }
}

/// Gathers the rows of a table into shots and tracks.
pub(super) struct Gather {
    file: Arc<PathBuf>,
    stem: String,
    clock: Clock,
    pub shots: Vec<RawShot>,
    by_name: HashMap<String, usize>,
    last: usize,
}

impl Gather {
    pub(super) fn new(input: &Input, unit: TimeUnit) -> Self {
        Self {
            file: Arc::new(input.file.to_path_buf()),
            stem: input.stem.to_string(),
            clock: Clock::In(unit),
            shots: Vec::new(),
            by_name: HashMap::new(),
            last: usize::MAX,
        }
    }

    /// Adds a row. Where the table has no column of shots, the file is one.
    pub(super) fn push(
        &mut self,
        shot: Option<&str>,
        ball: &str,
        point: &str,
        row: Row,
        sd: Option<[f64; 2]>,
    ) {
        let centre =
            point.is_empty() || point.eq_ignore_ascii_case("centre") || point.eq_ignore_ascii_case("center");
        let track = self.track(shot, ball, (!centre).then_some(point), false, row.line);
        track.rows.push(row);
        if let Some(sd) = sd {
            track.sds.push(sd);
        }
    }

    /// Adds the angle by which a disc has turned in this row, with the radians in its unit.
    pub(super) fn push_angle(
        &mut self,
        shot: Option<&str>,
        ball: &str,
        row: Row,
        (_, unit): Angle,
        angle: Option<f64>,
    ) {
        let x = angle.map_or(f64::NAN, |angle| unit * angle);
        self.track(shot, ball, Some("angle"), true, row.line).rows.push(Row { x, y: 0.0, ..row });
    }

    /// Says what is known once all rows are read.
    pub(super) fn finish(&mut self, reader: Reader) {
        if let Some(clock) = reader.finish(self.shots.iter_mut().flat_map(|shot| &mut shot.tracks)) {
            self.clock = clock;
            self.shots.iter_mut().for_each(|shot| shot.clock = clock);
        }
    }

    fn track(
        &mut self,
        shot: Option<&str>,
        ball: &str,
        point: Option<&str>,
        is_angle: bool,
        line: usize,
    ) -> &mut RawTrack {
        let name = shot.unwrap_or(&self.stem);
        if self.shots.get(self.last).is_none_or(|last| last.name != name) {
            self.last = self.by_name.get(name).copied().unwrap_or(self.shots.len());
            if self.last == self.shots.len() {
                self.by_name.insert(name.to_string(), self.last);
                self.shots.push(RawShot {
                    name: name.to_string(),
                    file: self.file.clone(),
                    line,
                    clock: self.clock,
                    tracks: Vec::new(),
                });
            }
        }
        let tracks = &mut self.shots[self.last].tracks;
        let same = |track: &RawTrack| {
            track.name == ball && track.point.as_deref() == point && track.is_angle == is_angle
        };
        let i = tracks.iter().position(same).unwrap_or(tracks.len());
        if i == tracks.len() {
            tracks.push(RawTrack { is_angle, ..RawTrack::new(ball, point.map(str::to_string)) });
        }
        &mut tracks[i]
    }
}

/// Reads cell by cell: slower than the typed reader, but says what is wrong where. Gives the decimal mark
/// of the positions.
pub(super) fn read(sheet: &Sheet, columns: &Columns, gather: &mut Gather) -> Option<char> {
    let mut reader = Reader::new(sheet.input);
    let mut trackless: Vec<usize> = Vec::new();
    sheet.rows(|cells| {
        let shot = cells.shot(columns.shot);
        let ball = columns.ball.map_or("", |i| cells.text(i));
        let point = columns.point.map_or("", |i| cells.text(i));
        if let Some(column) = columns.ball.filter(|_| ball.is_empty()) {
            if columns.has_trackless {
                trackless.push(cells.line);
                return;
            }
            cells.at(column).wrong("is empty; expected the name of a ball");
        }
        let found = sheet.input.problems.len();
        let Some(time) = reader.time(cells.at(columns.time)) else {
            if sheet.input.problems.len() == found {
                let expected = if columns.frames { "the number of a frame" } else { "a time" };
                cells.at(columns.time).wrong(format!("is empty; expected {expected}"));
            }
            return;
        };
        let [x, y] = reader.place(cells, columns.at);
        let marker = columns.marker.map(|at| reader.position(at.map(|i| cells.at(i))));
        let sd = columns.sd.map(|at| {
            at.map(|i| {
                let sd = reader.extra(cells.at(i));
                if let Some(sd) = sd.filter(|sd| *sd <= 0.0) {
                    cells.at(i).wrong(format!("{sd} is no standard deviation; expected more than 0"));
                }
                sd.unwrap_or(f64::NAN)
            })
        });
        let row = Row { time, x, y, line: cells.line };
        gather.push(shot, ball, point, row, sd);
        if let Some([x, y]) = marker {
            gather.push(shot, ball, "marker", Row { x, y, ..row }, None);
        }
        if let Some(angle) = columns.angle {
            gather.push_angle(shot, ball, row, angle, reader.extra(cells.at(angle.0)));
        }
    });
    if let (Some(column), Some(first)) = (columns.ball, trackless.first()) {
        let name = sheet.heading.names[column].as_str();
        if gather.shots.is_empty() {
            let message = "is empty in every row; expected names of tracks, or no ball in [tracks.columns]: both balls are then followed \
                           from frame to frame";
            sheet.input.wrong(*first, name, message);
        } else {
            let message = format!(
                "{} rows from here on belong to no track ({name} is empty): left out",
                trackless.len()
            );
            sheet.input.log.add(GAPS, *first, message);
        }
    }
    let mark = reader.mark();
    gather.finish(reader);
    mark
}
