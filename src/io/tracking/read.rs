//! Recognition of a file's format by its content, and the reading of JSON.

use std::borrow::Cow;
use std::fs;

use indexmap::IndexMap;
use serde::Deserialize;
use serde_json::value::RawValue;

use super::finish::clips;
use super::follow::follow;
use super::formats::FORMATS;
use super::heading::{Heading, Rows, TITLES, headings};
use super::raw::{Job, RawShot, RawTrack, Stated, stem};
use super::reader::{self, Body, Layout, Reader, number_twins};
use super::settings::{Columns, Format};
use super::words::{FRAMES, TIMES, Unit, find};
use crate::io::error::{Subject, did_you_mean, message};
use crate::io::text::{decode, filled_lines, shortened, value, without_separator_line};
use crate::measurement::number::count_of;

/// Returns the shots of a file, with clips separated and pieces of tracks joined. `alone`: the
/// names of clips are their numbers, without the file's name.
pub(super) fn file(job: Job, alone: bool) -> Option<Vec<RawShot>> {
    let wrong = |error| job.wrong(None, None, format!("cannot be read: {error}"));
    let bytes = fs::read(job.file).map_err(wrong).ok()?;
    let (text, latin) = decode(&bytes);
    if let Some(line) = latin {
        let message = "is not UTF-8 text from here on; read as Latin-1, which matters to names only";
        job.note(Subject::Format, line, message);
    }
    let (text, _) = without_separator_line(text);
    let ending = job.file.extension().unwrap_or_default();
    let is_project = |[archive, word, ..]: &&[&str; 4]| {
        ending.eq_ignore_ascii_case(archive) || text.trim_start().starts_with('<') && text.contains(word)
    };
    if let Some([.., program, data]) = PROJECTS.iter().find(is_project) {
        let message = format!("is a project of the program {program}; expected its data: export {data}");
        return job.refuse(None, message);
    }
    let job = Job { text: &text, ..job };
    Some(clips(as_written(job)?, alone, job))
}

fn as_written(job: Job) -> Option<Vec<RawShot>> {
    let stated = job.settings.tracks.format;
    let wanted = |format: Format| stated == format || stated == Format::Auto;
    if let Some(columns) = &job.settings.tracks.columns {
        return Some(by_layout(&by_columns(job, columns)?, job));
    }
    if wanted(Format::Json) && is_json(job.text) {
        return read_json(job);
    }
    let before = job.log.len();
    let headings = headings(job.text, TITLES);
    for (_, layout) in FORMATS.into_iter().filter(|(format, _)| wanted(*format)) {
        if let Some(layout) = layout(&headings, job) {
            return Some(by_layout(&layout, job));
        }
        if job.log.len() > before {
            return None;
        }
    }
    let Some((line, first)) = filled_lines(job.text).next() else {
        return job.refuse(None, "is empty; expected tracked positions");
    };
    let is_text = !first.contains(|c: char| c.is_control() && !c.is_whitespace());
    let (begin, format) = (shortened(first.trim()), stated.name());
    let lacking = headings.iter().find_map(|heading| {
        let mut lacking = ["ball", "x", "y"].into_iter().filter(|name| heading.at(name).is_none());
        lacking.next().filter(|_| lacking.next().is_none())
    });
    job.refuse(line, message!("unknown_format", begin, lacking, format, is_text))
}

/// Reads the rows of a table; times of Qualisys begin at 0, and positions at 0, 0 are its gaps.
fn by_layout(layout: &Layout, job: Job) -> Vec<RawShot> {
    layout.note(job);
    let mut shots = reader::read(job, layout);
    for shot in shots.iter_mut().filter(|_| layout.stated.format == Format::Qualisys) {
        let first = shot.times().first().copied().unwrap_or_default();
        shot.map_times(|time| time - first);
        for RawTrack { name, rows, .. } in &mut shot.tracks {
            for row in rows.iter_mut().filter(|row| row.place == [0.0, 0.0]) {
                row.lose();
                job.note(Subject::Gaps, row.line, format!("\"{name}\" is at 0, 0: taken as a gap"));
            }
        }
    }
    // no column and no names of columns separate the balls
    if layout.ball.is_none() && layout.bodies.iter().all(|body| body.name.is_empty()) {
        follow(&mut shots, job);
    }
    shots
}

/// Endings of archived projects, a word in those that are XML, their program, and what to export.
const PROJECTS: [[&str; 4]; 2] = [
    ["trz", "org.opensourcephysics.cabrillo.tracker", "Tracker", "them there (File, Export, Data File)"],
    ["kva", "<Kinovea", "Kinovea", "the trajectories there, as text or CSV"],
];
/// Maximum number of lines searched for the names of the columns, or for the first row.
const MAX_LINES: usize = 100;

/// Returns the layout of a table whose columns are stated; without times, rows are frames.
fn by_columns(job: Job, wanted: &Columns) -> Option<Layout> {
    let is_numbered = wanted.values().any(toml::Value::is_integer);
    let heading = if is_numbered { numbered(job, wanted) } else { header(job, wanted) }?;
    let column = |key: &str| {
        let stated = wanted.get(key)?;
        number(stated).map(|number| number - 1).or_else(|| heading.position(stated.as_str()?.trim()))
    };
    let shot = column("shot");
    let read: Vec<usize> = wanted.keys().filter_map(|key| column(key)).collect();
    let time = heading.clock([column("frame"), column("t"), shot], job);
    let time = time.or_else(|| unstated_time(&heading, &read, shot, job));
    let [cue, object] = job.settings.first_names();
    let is_wide = wanted.contains_key("cue_x");
    let unit = |column: usize| {
        let stated = wanted.get("angle_unit").and_then(|unit| Unit::of(unit.as_str()?));
        let stated = stated.map(|unit| (unit, "[tracks.columns] angle_unit states".to_string()));
        let unit = heading.unit([column], Unit::Rad, stated, job);
        if unit.is_none() {
            let message = "the unit of these angles is not stated; expected [tracks.columns] angle_unit = \"rad\" or \"deg\"";
            job.wrong(heading.line, heading.bare[column].as_str(), message);
        }
        unit
    };
    let balls = if is_wide { vec![(cue, "cue_"), (object, "object_")] } else { vec![("", "")] };
    let bodies = balls.into_iter().map(|(name, begin)| Body::of_keys(name, begin, unit, column));
    // of all balls, so that no unit that lacks goes unnamed
    let bodies: Vec<_> = bodies.collect();
    let bodies = bodies.into_iter().collect::<Option<Vec<_>>>()?.concat();
    Some(Layout { shot, ball: column("ball"), ..Layout::new(Format::Columns, heading, bodies, time, job) })
}

/// Returns the column of frame numbers (flag) or times that [tracks.columns] does not name: by its
/// name, if its numbers grow from row to row of a shot. Otherwise rows are counted.
fn unstated_time(heading: &Heading, used: &[usize], shot: Option<usize>, job: Job) -> Option<(usize, bool)> {
    let (names, rows) = (heading.small(), Rows::of(job.text, heading));
    let grows = |column: &usize| !used.contains(column) && rows.grows(*column, shot);
    let frame = find(&names, FRAMES).filter(|column| grows(column) && rows.is_whole(*column));
    let clock = heading.clock([frame, find(&names, TIMES).filter(grows), shot], job);
    let name = |column: usize| heading.names[column].as_str();
    let growing = rows.growing(heading, shot).find(|column| !used.contains(column)).map(name);
    let (taken, is_frame) = clock.map(|(column, is_frame)| (name(column), is_frame)).unzip();
    job.note(Subject::Clock, heading.line, message!("unstated_time", taken, is_frame, growing));
    clock
}

/// Returns the number of a column, from 1, unless it is stated by its name.
fn number(column: &toml::Value) -> Option<usize> {
    column.as_integer().and_then(|number| number.try_into().ok()).filter(|number| *number > 0)
}

/// Returns the heading in the first line that has all the names.
fn header(job: Job, wanted: &Columns) -> Option<Heading> {
    let names = wanted.iter().filter(|(key, _)| *key != "angle_unit");
    let names: Vec<&str> = names.filter_map(|(_, column)| column.as_str()).map(str::trim).collect();
    let held = |heading: &Heading| names.iter().filter(|name| heading.position(name).is_some()).count();
    // the first heading that has the largest number of names
    let Some(heading) = headings(job.text, MAX_LINES).into_iter().rev().max_by_key(held) else {
        return job.refuse(None, "is empty; expected the columns that [tracks.columns] names");
    };
    let Some(missing) = names.iter().find(|name| heading.position(name).is_none()) else {
        let are_single = [&heading.names, &heading.bare].iter().all(|all| heading.has_once(&names, all, job));
        return are_single.then_some(heading);
    };
    let near = did_you_mean(missing, heading.names.iter().map(String::as_str));
    let all = shortened(&heading.names.join(" | "));
    let message = format!("of the columns in [tracks.columns], \"{missing}\" is missing here{near}: {all}");
    job.refuse(heading.line, message)
}

/// Returns the heading of a table without names, from the first row with the expected numbers.
fn numbered(job: Job, wanted: &Columns) -> Option<Heading> {
    let columns = wanted.iter().filter_map(|(key, column)| Some((key.as_str(), number(column)?)));
    let least = columns.clone().map(|(_, number)| number).max()?;
    let are_numbers = columns.filter(|(key, _)| !["shot", "ball", "point"].contains(key));
    let mut numbers: Vec<usize> = are_numbers.map(|(_, number)| number).collect();
    let is_row = |Heading { is_comment, own: cells, .. }: &Heading| {
        let is_number = |number: &usize| value(&cells[number - 1]).is_some();
        !is_comment && cells.len() >= least && numbers.iter().all(is_number)
    };
    if let Some(Heading { line, separator, own: cells, .. }) =
        headings(job.text, MAX_LINES).into_iter().find(is_row)
    {
        let is_open = cells.len() > least && cells.last().is_some_and(String::is_empty);
        return Some(Heading::unnamed(line, separator, cells.len() - usize::from(is_open)));
    }
    numbers.sort_unstable();
    job.refuse(None, format!("none of the first {MAX_LINES} lines has numbers in the columns {numbers:?}"))
}

/// Keys with one meaning, the most common first.
const BALLS: [&str; 3] = ["balls", "tracks", "objects"];
const SAMPLES: [&str; 3] = ["samples", "points", "positions"];
const NAME: [&str; 5] = ["name", "shot", "ball", "id", "label"];
const FPS: [&str; 3] = ["fps", "capture_fps", "frame_rate"];

const EXPECTED: &str = "expected an array of shots, each with \"balls\", each with a \"name\" and \"samples\" of t (seconds) or frame, \
                        x and y";

/// Returns whether a text is JSON, as tools in the browser save it.
fn is_json(text: &str) -> bool {
    let text = text.trim_start();
    text.starts_with('{')
        || text.strip_prefix('[').is_some_and(|rest| rest.trim_start().starts_with(['{', ']']))
}

type Object<'t> = IndexMap<String, &'t RawValue>;

/// Returns an object or a list, empty for another value. The text has been checked as a whole.
fn parsed<'t, T: Deserialize<'t> + Default>(raw: &'t RawValue) -> T {
    serde_json::from_str(raw.get()).unwrap_or_default()
}

fn get<'t>(object: &Object<'t>, keys: &[&str]) -> Option<&'t RawValue> {
    let find = |key: &&str| object.iter().find(|(own, _)| own.eq_ignore_ascii_case(key));
    keys.iter().find_map(find).map(|(_, raw)| *raw)
}

/// Returns a value as a cell of a table: text without quotation marks, empty for null.
fn cell(raw: &RawValue) -> String {
    let text = raw.get();
    if text == "null" { String::new() } else { serde_json::from_str(text).unwrap_or(text.to_string()) }
}

fn get_cell(object: &Object, keys: &[&str]) -> Option<String> {
    Some(cell(get(object, keys)?).trim().to_string()).filter(|cell| !cell.is_empty())
}

fn read_json(job: Job) -> Option<Vec<RawShot>> {
    let not_json = |error: serde_json::Error| {
        let hint = if job.text.contains("NaN") { "; expected null, not NaN" } else { "" };
        job.wrong(error.line(), None, format!("is not JSON: {error}{hint}"));
    };
    let whole: &RawValue = serde_json::from_str(job.text).map_err(not_json).ok()?;
    let file = File { job, line_ends: job.text.match_indices('\n').map(|(at, _)| at).collect() };
    let root: Object = parsed(whole);
    let shots: Vec<&RawValue> = match get(&root, &["shots"]) {
        None if get(&root, &BALLS).is_some() => vec![whole],
        shots => parsed(shots.unwrap_or(whole)),
    };
    if shots.is_empty() {
        return file.refuse(whole, "holds no shots");
    }
    let word = get_cell(&root, &["length_unit", "unit"]);
    let unit = word.as_ref().and_then(|word| Unit::M.alike().find(|unit| Unit::of(word) == Some(*unit)));
    if let (Some(word), None) = (word, unit) {
        let word = shortened(&word);
        let line = file.line(whole);
        return job.refuse(line, format!("the unit \"{word}\" is unknown; expected m, cm, mm, in, ft or px"));
    }
    let mut read = Vec::new();
    for (number, raw) in (1..).zip(&shots) {
        let number = if shots.len() == 1 { String::new() } else { format!("-{number}") };
        read.extend(file.shot(raw, &root, format!("{}{number}", stem(job.file)), unit)?);
    }
    job.note(Subject::Format, None, format!("read as JSON, {}", count_of(read.len(), "shot")));
    Some(read)
}

struct File<'t> {
    job: Job<'t>,
    line_ends: Vec<usize>,
}

impl File<'_> {
    fn line(&self, raw: &RawValue) -> usize {
        let begin = raw.get().as_ptr() as usize - self.job.text.as_ptr() as usize;
        self.line_ends.partition_point(|end| *end < begin) + 1
    }

    fn refuse<T>(&self, at: &RawValue, why: impl AsRef<str>) -> Option<T> {
        self.job.refuse(self.line(at), format!("{}; {EXPECTED}", why.as_ref()))
    }

    /// Reads a shot, called `unnamed` unless it has a name; `root` may state its frame rate.
    fn shot(
        &self,
        raw: &RawValue,
        root: &Object,
        unnamed: String,
        unit: Option<Unit>,
    ) -> Option<Vec<RawShot>> {
        let shot: Object = parsed(raw);
        let name = get_cell(&shot, &NAME).unwrap_or(unnamed);
        let lacks = |what, name: &str, key| format!("the {what} \"{}\" has no \"{key}\"", shortened(name));
        let balls = get(&shot, &BALLS).filter(|balls| balls.get().starts_with(['{', '[']));
        let balls = balls.or_else(|| self.refuse(raw, lacks("shot", &name, "balls")))?;
        let in_list = (1..).zip(parsed::<Vec<&RawValue>>(balls)).map(|(number, ball): (usize, _)| {
            (get_cell(&parsed(ball), &NAME).unwrap_or_else(|| number.to_string()), ball)
        });
        let mut all: Vec<(String, &RawValue)> = in_list.chain(parsed::<Object>(balls)).collect();
        number_twins(all.iter_mut().map(|(name, _)| name).collect());
        let (mut time, mut rows) = (None, Vec::new());
        for (ball_name, ball) in all {
            let samples = get(&parsed(ball), &SAMPLES).unwrap_or(ball);
            if !samples.get().starts_with('[') {
                return self.refuse(ball, lacks("ball", &ball_name, "samples"));
            }
            for sample in parsed::<Vec<&RawValue>>(samples) {
                let (own, [t, x, y]) = self.cells(sample)?;
                if *time.get_or_insert(own) != own {
                    return self.refuse(sample, "has another kind of time than the samples above");
                }
                rows.push((self.line(sample), [name.clone().into(), ball_name.clone().into(), t, x, y]));
            }
        }
        let mut stated = Stated { format: Format::Json, unit, time: time.flatten(), ..Stated::default() };
        if let Some(fps) = get_cell(&shot, &FPS).or_else(|| get_cell(root, &FPS)) {
            let known = value(&fps).filter(|fps| *fps > 0.0);
            let known = known.or_else(|| self.refuse(raw, format!("fps is {fps}, not frames per second")))?;
            stated.fps = Some(known).filter(|_| stated.time == Some(Unit::Frames));
        }
        let names = ["shot", "ball", "time", "x", "y"].map(str::to_string);
        let (heading, bodies) = (Heading::plain(1, 0, None, names.to_vec()), vec![Body::new("", [3, 4])]);
        let layout = Layout { heading, shot: Some(0), ball: Some(1), time: Some(2), stated, bodies };
        let mut reader = Reader::new(self.job, &layout);
        for (line, cells) in &rows {
            reader.add(*line, cells, &layout.bodies);
        }
        Some(reader.finish())
    }

    /// Returns the cells of `{t, x, y}`, `{frame, x, y}`, or `[t, x, y]`, without a unit of time.
    fn cells(&self, raw: &RawValue) -> Option<(Option<Unit>, [Cow<'static, str>; 3])> {
        let cells = |values: [Option<&RawValue>; 3]| values.map(|at| at.map_or(String::new(), cell).into());
        if let [time, x, y] = parsed::<Vec<&RawValue>>(raw)[..] {
            return Some((None, cells([Some(time), Some(x), Some(y)])));
        }
        let sample: Object = parsed(raw);
        let [frame, x, y] = ["frame", "x", "y"].map(|key| get(&sample, &[key]));
        let time = self.job.frame_or_time(frame, get(&sample, &["t", "time"]));
        let (time, is_frame) = time.or_else(|| self.refuse(raw, "a sample without t or frame"))?;
        Some((Some(if is_frame { Unit::Frames } else { Unit::S }), cells([Some(time), x, y])))
    }
}
