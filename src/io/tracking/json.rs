//! JSON as tools in the browser save it: an array of shots, each with balls, each with samples.

use std::borrow::Cow;

use indexmap::IndexMap;
use serde_json::value::RawValue;

use super::heading::Heading;
use super::raw::{Job, RawShot, Stated, Subject, stem};
use super::reader::{Body, Layout, Reader};
use super::settings::Format;
use super::words::Unit;
use crate::io::text::{shortened, value};
use crate::measurement::number::count_of;

/// Keys with one meaning, the most common first.
const BALLS: [&str; 3] = ["balls", "tracks", "objects"];
const SAMPLES: [&str; 3] = ["samples", "points", "positions"];
const NAME: [&str; 5] = ["name", "shot", "ball", "id", "label"];
const FPS: [&str; 3] = ["fps", "capture_fps", "frame_rate"];

const EXPECTED: &str = "expected an array of shots, each with \"balls\", each with a \"name\" and \"samples\" of t (seconds) or frame, \
                        x and y";

pub(super) fn detect(text: &str) -> bool {
    let text = text.trim_start();
    text.starts_with('{')
        || text.strip_prefix('[').is_some_and(|rest| rest.trim_start().starts_with(['{', ']']))
}

type Object<'t> = IndexMap<String, &'t RawValue>;

/// Returns an object, empty for another value. The text has been checked as a whole.
fn object(raw: &RawValue) -> Object<'_> {
    serde_json::from_str(raw.get()).unwrap_or_default()
}

fn list(raw: &RawValue) -> Vec<&RawValue> {
    serde_json::from_str(raw.get()).unwrap_or_default()
}

fn get<'t>(object: &Object<'t>, keys: &[&str]) -> Option<&'t RawValue> {
    keys.iter().find_map(|key| object.get(*key)).copied()
}

/// Returns a value as a cell of a table: text without quotation marks, empty for null.
fn cell(raw: &RawValue) -> String {
    let text = raw.get();
    if text == "null" { String::new() } else { serde_json::from_str(text).unwrap_or(text.to_string()) }
}

fn get_cell(object: &Object, keys: &[&str]) -> Option<String> {
    Some(cell(get(object, keys)?).trim().to_string()).filter(|cell| !cell.is_empty())
}

pub(super) fn read(job: Job) -> Option<Vec<RawShot>> {
    let line_ends = job.text.match_indices('\n').map(|(at, _)| at).collect();
    let shots = File { job, line_ends }.read()?;
    let message = format!("read as JSON, {}", count_of(shots.len(), "shot"));
    job.note(Subject::Format, None, message);
    Some(shots)
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
        self.job.wrong(self.line(at), None, format!("{}; {EXPECTED}", why.as_ref()));
        None
    }

    fn read(&self) -> Option<Vec<RawShot>> {
        let not_json = |error: serde_json::Error| {
            let message = error.to_string();
            let bare = message.rsplit_once(" at line ").map_or(message.as_str(), |(bare, _)| bare);
            self.job.wrong(error.line(), None, format!("is not JSON: {bare}"));
        };
        let whole: &RawValue = serde_json::from_str(self.job.text).map_err(not_json).ok()?;
        let root = object(whole);
        let shots = match get(&root, &["shots"]) {
            None if get(&root, &BALLS).is_some() => vec![whole],
            shots => list(shots.unwrap_or(whole)),
        };
        if shots.is_empty() {
            return self.refuse(whole, "holds no shots");
        }
        let word = get_cell(&root, &["length_unit", "unit"]);
        let unit = word.as_ref().and_then(|word| Unit::M.alike().find(|unit| Unit::of(word) == Some(*unit)));
        if let (Some(word), None) = (word, unit) {
            let word = shortened(&word);
            return self
                .refuse(whole, format!("\"{word}\" is not a unit of length: m, cm, mm, in, ft or px"));
        }
        let mut read = Vec::new();
        for (number, raw) in (1..).zip(&shots) {
            let number = if shots.len() == 1 { String::new() } else { format!("-{number}") };
            read.extend(self.shot(raw, &root, format!("{}{number}", stem(self.job.file)), unit)?);
        }
        Some(read)
    }

    /// Reads a shot, which is called `unnamed` unless it has a name; `root` may state its frame
    /// rate.
    fn shot(
        &self,
        raw: &RawValue,
        root: &Object,
        unnamed: String,
        unit: Option<Unit>,
    ) -> Option<Vec<RawShot>> {
        let shot = object(raw);
        let name = get_cell(&shot, &NAME).unwrap_or(unnamed);
        let lacks = |what, name: &str, key| format!("the {what} \"{}\" has no \"{key}\"", shortened(name));
        let balls = get(&shot, &BALLS).filter(|balls| balls.get().starts_with(['{', '[']));
        let balls = balls.or_else(|| self.refuse(raw, lacks("shot", &name, "balls")))?;
        let in_list = list(balls)
            .into_iter()
            .enumerate()
            .map(|(i, ball)| (get_cell(&object(ball), &NAME).unwrap_or_else(|| (i + 1).to_string()), ball));
        let (mut time, mut rows, mut bodies) = (None, Vec::new(), Vec::new());
        for (index, (ball_name, ball)) in in_list.chain(object(balls)).enumerate() {
            let samples = get(&object(ball), &SAMPLES).unwrap_or(ball);
            if !samples.get().starts_with('[') {
                return self.refuse(ball, lacks("ball", &ball_name, "samples"));
            }
            for sample in list(samples) {
                let (own, [t, x, y]) = self.cells(sample)?;
                if *time.get_or_insert(own) != own {
                    return self.refuse(sample, "has another kind of time than the samples above");
                }
                rows.push((self.line(sample), index, [name.clone().into(), t, x, y]));
            }
            bodies.push(Body { index, ..Body::new(ball_name, [2, 3]) });
        }
        let mut stated = Stated { format: Format::Json, unit, time: time.flatten(), ..Stated::default() };
        if let Some(fps) = get_cell(&shot, &FPS).or_else(|| get_cell(root, &FPS)) {
            let known = value(&fps).filter(|fps| *fps > 0.0);
            let known = known.or_else(|| self.refuse(raw, format!("fps is {fps}, not frames per second")))?;
            stated.fps = Some(known).filter(|_| stated.time == Some(Unit::Frames));
        }
        let heading = Heading::plain(1, 0, None, ["shot", "time", "x", "y"].map(str::to_string).to_vec());
        let layout = Layout { heading, shot: Some(0), time: Some(1), stated, bodies };
        let mut reader = Reader::new(self.job, &layout);
        for (line, body, cells) in &rows {
            reader.add(*line, cells, &layout.bodies[*body..=*body]);
        }
        Some(reader.finish())
    }

    /// Returns `{t, x, y}`, or `{frame, x, y}`, or `[t, x, y]`, whose unit of time is not stated, as
    /// cells of a table.
    fn cells(&self, raw: &RawValue) -> Option<(Option<Unit>, [Cow<'static, str>; 3])> {
        let cells = |values: [Option<&RawValue>; 3]| values.map(|at| at.map_or(String::new(), cell).into());
        if let [time, x, y] = list(raw)[..] {
            return Some((None, cells([Some(time), Some(x), Some(y)])));
        }
        let sample = object(raw);
        let [frame, x, y] = ["frame", "x", "y"].map(|key| get(&sample, &[key]));
        let time = self.job.frame_or_time(frame, get(&sample, &["t", "time"]));
        let (time, is_frame) = time.or_else(|| self.refuse(raw, "a sample without t or frame"))?;
        Some((Some(if is_frame { Unit::Frames } else { Unit::S }), cells([Some(time), x, y])))
    }
}
