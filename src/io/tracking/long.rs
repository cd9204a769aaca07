//! A row per ball and frame: the canonical table and others like it.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::heading::{Heading, TITLES};
use super::raw::{Clock, FORMAT, Notes, REPEATED, RawShot, RawTrack, Row};
use super::settings::{TimeUnit, TrackSettings, Unit};
use super::sheet::{Reader, Sheet};
use crate::io::error::Problems;
use crate::io::text::{Separator, lines, trimmed};

/// Columns of a long table, by their position.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Columns {
    pub shot: Option<usize>,
    pub time: usize,
    pub frames: bool,
    pub ball: usize,
    pub point: Option<usize>,
    pub x: usize,
    pub y: usize,
    pub sd: Option<[usize; 2]>,
    pub marker: Option<[usize; 2]>,
    /// How far a disc has turned, with the radians in its unit.
    pub angle: Option<(usize, f64)>,
}

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

/// Whether the text begins like the canonical table, below a title perhaps.
pub(super) fn detect(text: &str, settings: &TrackSettings) -> Option<Head> {
    let no_comment = |line: &str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
    lines(text).filter(|(_, line)| no_comment(line)).take(TITLES).find_map(|(line, content)| {
        let named = |separator: Separator| {
            let names: Vec<_> = trimmed(content, separator)?.iter().map(|name| name.to_lowercase()).collect();
            // most lines are no header: looked at more closely only if it may be one
            if !names.iter().any(|name| name == "ball") {
                return None;
            }
            let heading = Heading::new(text, line, separator, names);
            let position = |name: &str| heading.position(name);
            let by_frame = settings.capture_fps.is_some() || position("t").is_none();
            let frame = position("frame").filter(|_| by_frame);
            let columns = Columns {
                shot: position("shot"),
                time: frame.or(position("t"))?,
                frames: frame.is_some(),
                ball: position("ball")?,
                point: position("point"),
                x: position("x")?,
                y: position("y")?,
                sd: position("x_sd").zip(position("y_sd")).map(|(x, y)| [x, y]),
                marker: None,
                angle: None,
            };
            Some(Head { heading, columns })
        };
        Separator::ALL.into_iter().filter(|s| !s.is_white() || *s == Separator::Char('\t')).find_map(named)
    })
}

/// Complaints and notes about the header. `None` if the table cannot be read.
pub(super) fn check_head(
    head: &Head,
    file: &Path,
    settings: &TrackSettings,
    problems: &mut Problems,
    notes: &mut Notes,
) -> Option<Stated> {
    const KNOWN: [&str; 10] = ["shot", "frame", "t", "ball", "x", "y", "z", "point", "x_sd", "y_sd"];
    let (heading, before) = (&head.heading, problems.len());
    let mut strange = Vec::new();
    for (i, name) in heading.bare.iter().enumerate() {
        if heading.bare[..i].contains(name) && KNOWN.contains(&name.as_str()) {
            problems.add(file, Some(heading.line), Some(name), "stands twice in the header");
        } else if !KNOWN.contains(&name.as_str()) {
            strange.push(format!("\"{name}\""));
        }
    }
    let has = |name: &str| heading.bare.iter().any(|own| own == name);
    if has("x_sd") != has("y_sd") {
        problems.add(file, Some(heading.line), None, "x_sd and y_sd go together; expected both or neither");
    }
    let stated = head.columns.stated(heading, file, settings, problems);
    if problems.len() > before {
        return None;
    }
    let passed = if strange.is_empty() {
        String::new()
    } else {
        format!("; columns passed over: {}", strange.join(", "))
    };
    let heights = if has("z") {
        "; heights (z) are not used: how high a ball flies follows from its path seen from above"
    } else {
        ""
    };
    let message =
        format!("read as a long table, {} between cells{passed}{heights}", heading.separator.name());
    notes.add(FORMAT, file, None, message);
    Some(stated)
}

impl Columns {
    /// The units that the header gives these columns; complaints where it contradicts itself or dataset.toml.
    pub(super) fn stated(
        &self,
        heading: &Heading,
        file: &Path,
        settings: &TrackSettings,
        problems: &mut Problems,
    ) -> Stated {
        let lengths: Vec<usize> =
            [[self.x, self.y]].into_iter().chain(self.sd).chain(self.marker).flatten().collect();
        let unit = heading.length(&lengths, file, problems);
        let clock = if self.frames {
            TimeUnit::Frames
        } else {
            heading.time(self.time, settings.time_unit, file, problems).unwrap_or(TimeUnit::S)
        };
        Stated { clock, unit }
    }
}

/// Notes rows that are taken for comments since the name of their shot begins with #.
pub(super) fn note_comments(text: &str, head: &Head, file: &Path, notes: &mut Notes) {
    if head.columns.shot != Some(0) || !text.contains("\n#") {
        return;
    }
    let is_row = |line: &str| {
        let cells = trimmed(line, head.heading.separator).unwrap_or_default();
        cells.len() == head.heading.names.len()
            && [head.columns.time, head.columns.x].iter().all(|i| cells[*i].parse::<f64>().is_ok())
    };
    let commented =
        lines(text).skip(head.heading.line).filter(|(_, line)| line.starts_with('#') && is_row(line));
    let mut lines = commented.map(|(line, _)| line);
    if let Some(first) = lines.next() {
        let message = format!(
            "{} rows from here on begin with #: passed over as comments. If # belongs to the name of a shot, put the \
             name in quotation marks",
            lines.count() + 1
        );
        notes.add(REPEATED, file, Some(first), message);
    }
}

/// Gathers the rows of a long table into shots and tracks.
pub(super) struct Gather {
    file: Arc<PathBuf>,
    stem: String,
    clock: Clock,
    pub shots: Vec<RawShot>,
    by_name: HashMap<String, usize>,
    last: usize,
}

impl Gather {
    pub(super) fn new(file: &Path, stem: &str, unit: TimeUnit) -> Self {
        let clock = Clock::In(unit);
        let file = Arc::new(file.to_path_buf());
        Self {
            file,
            stem: stem.to_string(),
            clock,
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

    /// Adds an angle in radians, not a number in a gap, by which a disc has turned.
    pub(super) fn push_angle(&mut self, shot: Option<&str>, ball: &str, time: f64, angle: f64, line: u32) {
        self.track(shot, ball, Some("angle"), true, line).rows.push(Row { time, x: angle, y: 0.0, line });
    }

    /// Says what is known once all rows are read.
    pub(super) fn finish(&mut self, reader: Reader, problems: &mut Problems, notes: &mut Notes) {
        let tracks = self.shots.iter_mut().flat_map(|shot| &mut shot.tracks);
        if let Some(clock) = reader.finish(tracks, problems, notes) {
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
        line: u32,
    ) -> &mut RawTrack {
        let name = shot.unwrap_or(&self.stem);
        if self.shots.get(self.last).is_none_or(|last| last.name != name) {
            self.last = self.by_name.get(name).copied().unwrap_or(self.shots.len());
            if self.last == self.shots.len() {
                self.by_name.insert(name.to_string(), self.last);
                self.shots.push(RawShot {
                    name: name.to_string(),
                    file: self.file.clone(),
                    line: line as usize,
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
pub(super) fn read(
    sheet: &Sheet,
    columns: &Columns,
    gather: &mut Gather,
    problems: &mut Problems,
    notes: &mut Notes,
) -> Option<char> {
    let file = sheet.file;
    let name = |i: usize| sheet.names[i].as_str();
    let mut reader = Reader::new(file);
    sheet.rows(problems, |line, row, problems| {
        let ball = row[columns.ball].trim();
        let shot = columns.shot.map(|i| row[i].trim());
        let point = columns.point.map_or("", |i| row[i].trim());
        if let Some(i) = columns.shot.filter(|_| shot == Some("")) {
            problems.add(file, Some(line), Some(name(i)), "is empty; expected the name of a shot");
        }
        if ball.is_empty() {
            problems.add(file, Some(line), Some(name(columns.ball)), "is empty; expected the name of a ball");
        }
        let found = problems.len();
        let Some(time) = reader.time(line, &row[columns.time], name(columns.time), problems) else {
            if problems.len() == found {
                let expected = if columns.frames { "the number of a frame" } else { "a time" };
                let message = format!("is empty; expected {expected}");
                problems.add(file, Some(line), Some(name(columns.time)), message);
            }
            return;
        };
        let mut position = |at: [usize; 2], problems: &mut Problems| {
            let [x, y] = at.map(|i| row[i].as_ref());
            reader.position(line, [x, y], at.map(name), problems, notes)
        };
        let [x, y] = position([columns.x, columns.y], problems);
        let marker = columns.marker.map(|at| position(at, problems));
        let sd = columns.sd.map(|at| {
            at.map(|i| {
                let sd = reader.extra(line, &row[i], name(i), problems);
                if let Some(sd) = sd.filter(|sd| *sd <= 0.0) {
                    let message = format!("{sd} is no standard deviation; expected more than 0");
                    problems.add(file, Some(line), Some(name(i)), message);
                }
                sd.unwrap_or(f64::NAN)
            })
        });
        let line = line as u32;
        gather.push(shot, ball, point, Row { time, x, y, line }, sd);
        if let Some([x, y]) = marker {
            gather.push(shot, ball, "marker", Row { time, x, y, line }, None);
        }
        if let Some((i, unit)) = columns.angle {
            let angle = reader.extra(line as usize, &row[i], name(i), problems);
            gather.push_angle(shot, ball, time, angle.map_or(f64::NAN, |angle| unit * angle), line);
        }
    });
    let mark = reader.mark();
    gather.finish(reader, problems, notes);
    mark
}
