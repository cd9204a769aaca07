//! Survey of files of tracks for a draft, with a guess of `[tracks.columns]` for an unknown table.

use std::path::Path;

use indexmap::IndexMap;
use minijinja::value::Serde;
use minijinja::{Value as Values, context};

use super::formats::MOTIVE;
use super::heading::{Heading, MAX_TRACKS, Rows, TITLES, headings};
use super::names::groups;
use super::raw::{Job, RawShot, RawTrack, sorted, span};
use super::read;
use super::settings::{Columns, Format, TrackSettings};
use super::time::followed;
use super::words::{
    self, FRAMES, Kind, PERHAPS_BALLS, SHOTS, TIMES, Unit, beside, boxes, find, is_angle, pairs,
};
use crate::io::error::{Log, Problem, grouped, quoted};
use crate::io::text::value;
use crate::io::toml_file::Source;
use crate::measurement::number::count_of;
use crate::numerics::median;
use crate::physics::ball::Ball;

/// Least difference of the beginnings of motion, as a part of the film, that shows the cue ball.
const EARLIER: f64 = 0.05;
/// Least frame rate of a film of balls: no film is as slow as times in ms would be in seconds.
const LEAST_FPS: f64 = 2.0;
/// Plausible extents of positions, m: a table is 2.84 m long; films show a few centimetres.
const METRES: std::ops::Range<f64> = 0.02..4.0;
/// Plausible diameters of balls, m, with allowance for noise and slow cameras.
const DIAMETERS: std::ops::Range<f64> = 0.045..0.072;
/// Largest ratio of a diameter to the distance of centres that noise explains.
const NEARER: f64 = 1.02;

/// The tracks of files, and what is guessed of them; empty for other files.
#[derive(Default)]
pub(crate) struct Survey {
    files: usize,
    shots: Vec<RawShot>,
    /// Guessed `[tracks.columns]`: certain ones, and the size of a box where names leave open if x
    /// and y are its corner or its middle.
    pub(crate) columns: [Columns; 2],
    /// Cells and rows that cannot be read, as the loader reports them.
    problems: Vec<Problem>,
}

impl Survey {
    /// Surveys a file with this text. Columns are guessed for a table in no known format, and for a
    /// long one with boxes. `Err`: the problems of a file that cannot be read.
    pub(crate) fn of(file: &Path, text: &str) -> Result<Self, Vec<Problem>> {
        let plain = Self::read(file, Default::default());
        if plain.as_ref().is_ok_and(|plain| plain.format() != Some(Format::Long)) {
            return plain;
        }
        let has = |guess: &[Columns; 2], key: &str| guess.iter().any(|columns| columns.contains_key(key));
        let is_needed = |guess: &[Columns; 2]| plain.is_err() || has(guess, "width") || has(guess, "x2");
        let guess = columns(text).filter(is_needed);
        guess.and_then(|guess| Self::read(file, guess).ok()).map_or(plain, Ok)
    }

    fn read(file: &Path, columns: [Columns; 2]) -> Result<Self, Vec<Problem>> {
        let log = Log::default();
        let source = Source::new(file, "", &log);
        let is_guessed = !columns[0].is_empty();
        let mut settings = TrackSettings::default().checked(&source);
        settings.tracks.columns = is_guessed.then(|| columns[0].clone());
        let job = Job { file, text: "", settings: &settings, log: &log };
        let read = read::file(job, true);
        let problems = log.into_error("").problems().to_vec();
        match read {
            // without rows, only names support the guess
            Some(shots) if !shots.is_empty() || is_guessed => Ok(Self { files: 1, shots, columns, problems }),
            _ => Err(problems),
        }
    }

    fn format(&self) -> Option<Format> {
        Some(self.shots.first()?.stated.format)
    }

    pub(crate) fn and(mut self, other: Self) -> Self {
        self.files += other.files;
        self.shots.extend(other.shots);
        self.problems.extend(other.problems);
        self
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.problems.is_empty() && self.tracks().is_empty()
    }

    /// Returns whether points keep their distances in two groups, or have angles.
    pub(crate) fn are_discs(&self) -> bool {
        let are_discs = |shot: &RawShot| shot.tracks.len() > 5 && groups(&shot.tracks).len() == 2;
        self.columns[0].keys().any(|key| key.ends_with("angle")) || self.shots.iter().any(are_discs)
    }

    /// Returns the names of tracks in the order of appearance, and at which part of the time each
    /// begins to move (median).
    pub(crate) fn tracks(&self) -> Vec<(&str, f64)> {
        let begins = self.shots.iter().flat_map(|shot| {
            let tracks = shot.tracks.iter().filter(|track| !track.is_angle);
            tracks.filter_map(|track| Some((track.name.as_str(), shot.beginning(track)?)))
        });
        grouped(begins).into_iter().map(|(name, all)| (name, median(all))).collect()
    }

    /// Returns the frame rate that the times follow, and their unit unless it is that of the file.
    pub(crate) fn times(&self) -> (Option<f64>, Option<&'static str>) {
        let Some(fps) = self.shots.iter().find_map(followed) else { return (None, None) };
        let mut rates = Unit::S.alike().filter_map(|unit| Some((fps / unit.seconds()?, unit)));
        match rates.find(|(rate, _)| *rate >= LEAST_FPS) {
            _ if (fps - 1.0).abs() < 1e-3 => (None, Some(Unit::Frames.name())),
            Some((rate, unit)) if unit != Unit::S => (Some(rate), Some(unit.name())),
            _ => (Some(fps), None),
        }
    }

    /// Returns the values of the draft that the tracks show.
    pub(crate) fn values(&self) -> Values {
        let ((fps, time_unit), tracks) = (self.times(), self.tracks());
        let is_single = self.files > 1 && self.shots.len() == self.files;
        // the names of the balls in the order of their motion, if it is clear
        let order = match tracks.as_slice() {
            [a, b] if a.1 + EARLIER < b.1 => Some([a.0, b.0]),
            [a, b] if b.1 + EARLIER < a.1 => Some([b.0, a.0]),
            _ => None,
        };
        let written = |columns: &Columns| -> IndexMap<String, String> {
            columns.iter().map(|(key, column)| (key.clone(), column.to_string())).collect()
        };
        context! {
            count => count_of(self.files, "file"),
            format => (self.files > 0).then(|| self.format().unwrap_or(Format::Columns).name()),
            shots => count_of(self.shots.len(), "shot"),
            are_single => is_single && self.shots.iter().all(|shot| shot.tracks.len() == 1),
            are_discs => self.are_discs(),
            stated_fps => self.shots.first().and_then(|shot| shot.stated.fps).map(|fps| fps.to_string()),
            fps => fps.map(|fps| ((1e4 * fps).round() / 1e4).to_string()),
            time_unit,
            faults => self.problems.iter().map(ToString::to_string).collect::<Vec<String>>(),
            tracks => quoted(tracks.iter().map(|(name, _)| name)),
            first => order.map(|[cue, _]| cue),
            cue => order.map(|[cue, _]| toml::Value::from(cue).to_string()),
            object => order.map(|[_, object]| toml::Value::from(object).to_string()),
            columns => Serde(written(&self.columns[0])),
            doubtful => Serde(written(&self.columns[1])),
            ..self.lengths()
        }
    }

    /// Returns the extent, its unit if stated or plausible, and the largest balls that fit.
    fn lengths(&self) -> Values {
        // the longer side of the box about a shot's positions
        let extent = |shot: &RawShot| {
            let tracks = shot.tracks.iter().filter(|track| !track.is_angle);
            let places = tracks.flat_map(RawTrack::seen).map(|row| row.place);
            let sides = [0, 1].map(|axis| span(places.clone().map(|place| place[axis])));
            sides.map(|[low, high]| high - low).into_iter().fold(0.0, f64::max)
        };
        let extent = self.shots.iter().map(extent).fold(0.0, f64::max);
        let closest = |shot: &RawShot| {
            let [one, other] = shot.centres()?;
            one.distances(other).into_iter().min_by(f64::total_cmp)
        };
        // frames may be wrong, and slow cameras miss the contact: the first quartile of the shots
        let closest = sorted(self.shots.iter().filter_map(closest));
        let nearest = closest.get(closest.len() / 4).copied().unwrap_or(f64::INFINITY);
        let may_touch = self.are_discs() || nearest.is_infinite() || DIAMETERS.contains(&nearest);
        let stated = self.shots.first().and_then(|shot| shot.stated.unit);
        let unit = stated.or((METRES.contains(&extent) && may_touch).then_some(Unit::M));
        let diameter = unit.and_then(Unit::size).map(|(times, over)| nearest * times / over);
        let diameter = diameter.filter(|nearest| *nearest < DIAMETERS.end).unwrap_or(0.0);
        let ball = Ball::GAMES.into_iter().find(|(_, radius)| *radius <= 0.5 * NEARER * diameter);
        context! {
            extent => format!("{extent:.3}"),
            is_table_sized => METRES.contains(&extent),
            nearest => format!("{nearest:.4}"),
            nearest_mm => format!("{:.1}", 1e3 * diameter),
            stated_unit => stated.map(Unit::name),
            unit => unit.map(Unit::name),
            ball => ball.map(|(name, _)| name),
            radius => ball.map(|(_, radius)| radius.to_string()),
        }
    }
}

/// Guesses the columns of a table, certain and doubtful ones; `None` if it is not understood.
fn columns(text: &str) -> Option<[Columns; 2]> {
    let headings = headings(text, TITLES);
    for heading in headings.iter().filter(|heading| heading.own.len() > 2) {
        let Heading { line, separator, own, .. } = heading;
        if own.iter().all(|name| value(name).is_some()) {
            // names that are not understood may stand above the numbers
            let is_above = |other: &Heading| {
                other.line < *line && other.separator == *separator && other.own.len() == own.len()
            };
            let plain = Heading::unnamed(*line, *separator, own.len());
            return (!headings.iter().any(is_above)).then(|| numbered(&Rows::of(text, &plain), own.len()))?;
        }
        if let Some(guess) = named(text, heading) {
            return Some(guess);
        }
    }
    None
}

/// Guesses the columns of a table without names: time and two positions, or frame, ball, x, y and
/// the size of a box (MOT, a benchmark of trackers, with -1 as the ball of detections).
fn numbered(rows: &Rows, width: usize) -> Option<[Columns; 2]> {
    let keys = match width {
        7.. if rows.is_whole(0) && rows.values(1) > 1 && rows.is_whole(1) => "frame ball x y width height",
        7.. if rows.are_shared(0, None, 2) => "frame - x y width height",
        4 if rows.are_shared(0, None, MAX_TRACKS) && rows.distinguishes_rows(1, [Some(0), None]) => {
            "frame ball x y"
        }
        4 => "cue_x cue_y object_x object_y",
        5 if rows.is_whole(0) => "frame cue_x cue_y object_x object_y",
        5 => "t cue_x cue_y object_x object_y",
        _ => return None,
    };
    let numbered = keys.split(' ').zip(1_i64..).filter(|(key, _)| *key != "-");
    let columns = numbered.map(|(key, number)| (key.to_string(), number.into()));
    Some([columns.collect(), Columns::new()])
}

/// Guesses the columns of a table by their names; rows show only which columns name balls.
fn named(text: &str, heading: &Heading) -> Option<[Columns; 2]> {
    let names = heading.small();
    let rows = Rows::of(text, heading);
    let all = pairs(&names);
    let places = |wanted: Kind| -> Vec<[usize; 2]> {
        all.iter().filter(|(_, kind)| *kind == wanted).map(|(pair, _)| *pair).collect()
    };
    let [mut positions, markers, spreads] = [Kind::Position, Kind::Marker, Kind::Spread].map(places);
    let is_raw = |[x, _]: &[usize; 2]| !["filt", "smooth"].iter().any(|word| names[*x].contains(word));
    if positions.iter().any(is_raw) {
        positions.retain(is_raw);
    }
    let third: Vec<usize> = positions.iter().filter_map(|[x, _]| beside(&names, *x, "z")).collect();
    let heights: Vec<usize> = positions.iter().map(|[_, y]| *y).collect();
    let extent = |columns: &[usize]| columns.iter().map(|i| rows.extent(*i)).fold(0.0, f64::max);
    let is_up = || text.starts_with(MOTIVE) || extent(&heights) < extent(&third);
    if third.len() == positions.len() && is_up() {
        // seen from above, z, x and the height y are right-handed as x, y and z are
        positions = positions.iter().zip(third).map(|([x, _], z)| [z, *x]).collect();
    }
    let names_balls = |role| find(&names, role).is_some_and(|column| rows.values(column) > 1);
    let [frame, time, shot] = [FRAMES, TIMES, SHOTS].map(|role| find(&names, role));
    // without a column of balls, numbers that look like one box are those of two balls
    let has_up_to = |most| frame.or(time).is_some_and(|time| rows.are_shared(time, shot, most));
    let are_pairs = has_up_to(2);
    let names_ball = are_pairs || names_balls(words::BALLS) || names_balls(PERHAPS_BALLS);
    let (boxes, is_size) = boxes(&names, names_ball);
    let mut taken: Vec<usize> = all.iter().flat_map(|(pair, _)| *pair).collect();
    let is_free_angle = |i: &usize| !taken.contains(i) && is_angle(&names[*i]);
    let mut angles: Vec<usize> = (0..names.len()).filter(is_free_angle).collect();
    taken.extend(boxes.concat().concat());
    let is_free = |column: &usize| !taken.contains(column) && !names[*column].is_empty();
    // detectors leave the column empty, or name one ball beside two pairs of columns
    let names_one = |column: &usize| positions.len() == 2 && boxes.len() != 1 && rows.values(*column) < 2;
    let is_filled = |column: &usize| !rows.column(*column).all(str::is_empty) && !names_one(column);
    let is_stated = |column: &usize| boxes.len() < 2 && is_free(column) && is_filled(column);
    let is_one_body = positions.len() == 1 || boxes.len() == 1;
    let differs = |column: &usize| rows.distinguishes_rows(*column, [frame.or(time), shot]);
    let may_name = |column: &usize| is_one_body && is_free(column) && differs(column);
    let ball = find(&names, words::BALLS).filter(is_stated);
    let ball = ball.or_else(|| find(&names, PERHAPS_BALLS).filter(may_name));
    // ids that a tracker changed after it had lost a ball
    let ball = ball.filter(|ball| !(are_pairs && rows.values(*ball) > 2 && rows.is_whole(*ball)));
    if !boxes.is_empty() {
        positions = boxes.iter().map(|[corner, _]| *corner).collect();
    }
    // a striped ball beside a solid one
    let is_ball = |[x, _]: &[usize; 2]| names[*x].len() > 1;
    if ball.is_none() && markers.len() == 1 && positions.len() == 1 && positions.iter().all(is_ball) {
        positions.extend(&markers);
        positions.sort_unstable();
    }
    let are_all_known = (0..names.len()).filter(is_free).all(|i| [frame, time, shot].contains(&Some(i)));
    let is_single = are_all_known && frame.or(time).is_some_and(|time| rows.grows(time, shot));
    let begins: &[&str] = match (positions.len(), ball) {
        (2, None) => &["cue_", "object_"],
        // carom is played with three balls
        (1, _) if ball.is_some() || has_up_to(3) || is_single => &[""],
        _ => return None,
    };
    let is_other = |column: &usize| is_free(column) && ![shot, ball].contains(&Some(*column));
    let frame = frame.filter(is_other);
    let time = time.filter(is_other);
    let count = names.iter().position(|name| name == "n").filter(|_| time.is_none());
    let mut growing = rows.growing(heading, shot).filter(|_| frame.or(time).or(count).is_none());
    // an angle for each ball, or no column is one of angles
    if angles.len() != positions.len() || begins.len() == 1 && ball.is_none() {
        angles.clear();
    }
    let mut columns = [Columns::new(), Columns::new()];
    let mut add = |key: &str, column: Option<usize>| {
        let is_doubtful = boxes.is_empty() && (key.ends_with("width") || key.ends_with("height"));
        let name = column.map(|column| heading.names[column].as_str().into());
        columns[usize::from(is_doubtful)].extend(name.map(|name| (key.to_string(), name)));
    };
    for (key, column) in [("shot", shot), ("frame", frame.or(count)), ("t", time), ("ball", ball)] {
        add(key, column);
    }
    // deviations and markers of the ball that the row names
    let only = |pairs: &[[usize; 2]]| pairs.first().copied().filter(|_| pairs.len() == 1 && ball.is_some());
    for (i, (begin, xy)) in begins.iter().zip(&positions).enumerate() {
        let column = |word: &str| beside(&names, xy[0], word);
        let size = |width, height| Some([column(width)?, column(height)?]);
        let rest = boxes.get(i).map(|[_, rest]| *rest);
        let rest = rest.or_else(|| size("width", "height")).or_else(|| size("w", "h"));
        for (pair, [x, y]) in [
            (Some(*xy), ["x", "y"]),
            (only(&spreads), ["x_sd", "y_sd"]),
            (only(&markers), ["marker_x", "marker_y"]),
            (rest, if is_size { ["width", "height"] } else { ["x2", "y2"] }),
        ] {
            add(&format!("{begin}{x}"), pair.map(|pair| pair[0]));
            add(&format!("{begin}{y}"), pair.map(|pair| pair[1]));
        }
        add(&format!("{begin}angle"), angles.get(i).copied());
        add(&format!("{begin}likelihood"), column("likelihood"));
    }
    if angles.iter().any(|column| heading.units[*column].is_none()) {
        let numbers = angles.iter().flat_map(|column| rows.column(*column)).filter_map(value);
        let most = numbers.map(f64::abs).fold(0.0, f64::max);
        // two turns in radians are less than a tenth of one in degrees
        let unit = if most > 2.0 * std::f64::consts::TAU { "deg" } else { "rad" };
        columns[0].insert("angle_unit".to_string(), unit.into());
    }
    let growing = growing.find(is_other).map(|column| heading.names[column].as_str().into());
    columns[1].extend(growing.map(|name| ("t".to_owned(), name)));
    Some(columns)
}
