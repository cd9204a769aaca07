//! JSON as tools in the browser save it: an array of shots, each with balls, each with samples.

use std::path::PathBuf;
use std::sync::Arc;

use indexmap::IndexMap;
use serde_json::value::RawValue;

use super::input::{Input, Shots};
use super::raw::{Clock, FORMAT, RawShot, RawTrack, Row};
use super::settings::{TimeUnit, Unit};
use crate::io::number::shortened;
use crate::measurement::number::count_of;

/// Keys with one meaning, the most common first.
const SHOTS: [&str; 1] = ["shots"];
const BALLS: [&str; 3] = ["balls", "tracks", "objects"];
const SAMPLES: [&str; 5] = ["samples", "points", "positions", "frames", "data"];
const NAME: [&str; 6] = ["name", "shot", "ball", "id", "label", "color"];
const FPS: [&str; 3] = ["capture_fps", "fps", "frame_rate"];
const LENGTH: [&str; 3] = ["length_unit", "unit", "units"];
const TIMES: [(&str, TimeUnit); 4] =
    [("t", TimeUnit::S), ("time", TimeUnit::S), ("t_ms", TimeUnit::Ms), ("frame", TimeUnit::Frames)];

const EXPECTED: &str = "expected an array of shots, each with \"balls\", each with a \"name\" and \"samples\" of t (seconds) or frame, \
                        x and y";

pub(super) fn detect(text: &str) -> bool {
    let text = text.trim_start();
    text.starts_with('{')
        || text.strip_prefix('[').is_some_and(|rest| rest.trim_start().starts_with(['{', ']']))
}

/// Returns the shots of a file, and the unit of lengths that it states.
pub(super) fn read(input: &Input) -> Option<Shots> {
    let before = input.problems.len();
    let line_ends = input.text.match_indices('\n').map(|(at, _)| at).collect();
    let mut reader = Reader { input, line_ends, clock: None };
    let (shots, unit) = reader.file().filter(|_| input.problems.len() == before)?;
    input.log.add(FORMAT, None, format!("read as JSON, {}", count_of(shots.len(), "shot")));
    Some((shots, unit))
}

/// A value of the text, without those inside it.
struct Node<'t> {
    line: usize,
    value: Value<'t>,
}

enum Value<'t> {
    List(Vec<&'t RawValue>),
    /// An object, in the order of the file.
    Object(IndexMap<String, &'t RawValue>),
    Scalar(serde_json::Value),
}

impl Node<'_> {
    /// Returns it as messages name it.
    fn shown(&self) -> String {
        match &self.value {
            Value::List(list) => format!("an array of {}", list.len()),
            Value::Object(_) => "an object".to_string(),
            Value::Scalar(serde_json::Value::Bool(_)) => "true or false".to_string(),
            Value::Scalar(serde_json::Value::String(text)) => format!("\"{}\"", shortened(text)),
            Value::Scalar(other) => other.to_string(),
        }
    }

    fn number(&self) -> Option<f64> {
        if let Value::Scalar(scalar) = &self.value { scalar.as_f64() } else { None }
    }

    fn text(&self) -> Option<&str> {
        if let Value::Scalar(scalar) = &self.value { scalar.as_str() } else { None }
    }

    fn is_null(&self) -> bool {
        matches!(self.value, Value::Scalar(serde_json::Value::Null))
    }
}

struct Reader<'a> {
    input: &'a Input<'a>,
    line_ends: Vec<usize>,
    /// The unit of the times of the current shot.
    clock: Option<Clock>,
}

impl<'a> Reader<'a> {
    /// Adds a problem, of a key unless it is empty. Always `None`.
    fn wrong<T>(&self, line: usize, key: &str, message: impl Into<String>) -> Option<T> {
        self.input.wrong(line, Some(key).filter(|key| !key.is_empty()), message);
        None
    }

    fn node(&self, raw: &'a RawValue) -> Node<'a> {
        let text = raw.get();
        let begin = text.as_ptr() as usize - self.input.text.as_ptr() as usize;
        let line = self.line_ends.partition_point(|end| *end < begin) + 1;
        // the text has been checked as a whole
        let value = match text.as_bytes().first() {
            Some(b'[') => Value::List(serde_json::from_str(text).unwrap_or_default()),
            Some(b'{') => Value::Object(serde_json::from_str(text).unwrap_or_default()),
            _ => Value::Scalar(serde_json::from_str(text).unwrap_or_default()),
        };
        Node { line, value }
    }

    /// Returns the value of the first key that an object has, in small or capital letters.
    fn get(&self, node: &Node<'a>, keys: &[&str]) -> Option<Node<'a>> {
        let Value::Object(entries) = &node.value else { return None };
        let of_key = |key: &&str| entries.iter().find(|(own, _)| own.eq_ignore_ascii_case(key));
        keys.iter().find_map(of_key).map(|(_, raw)| self.node(raw))
    }

    fn name(&self, node: &Node<'a>) -> Option<String> {
        let name = self.get(node, &NAME)?;
        name.text().map(|text| text.trim().to_string()).or(name.number().map(|number| number.to_string()))
    }

    fn file(&mut self) -> Option<Shots> {
        let whole: &RawValue = match serde_json::from_str(self.input.text) {
            Ok(whole) => whole,
            Err(error) => {
                let message = error.to_string();
                let bare = message.rsplit_once(" at line ").map_or(message.as_str(), |(bare, _)| bare);
                return self.wrong(error.line(), "", format!("is not JSON: {bare}"));
            }
        };
        let root = self.node(whole);
        let shots = match &self.get(&root, &SHOTS).as_ref().unwrap_or(&root).value {
            Value::List(list) => list.iter().map(|shot| self.node(shot)).collect(),
            _ if self.get(&root, &BALLS).is_some() => vec![self.node(whole)],
            _ => Vec::new(),
        };
        if shots.is_empty() {
            return self.wrong(root.line, "", format!("holds no shots; {EXPECTED}"));
        }
        let (file, stem) = (Arc::new(self.input.file.to_path_buf()), self.input.stem);
        let mut found = Vec::with_capacity(shots.len());
        for (i, shot) in shots.iter().enumerate() {
            let own = if shots.len() == 1 { stem.to_string() } else { format!("{stem}-{}", i + 1) };
            found.push(self.shot(&root, shot, own, &file)?);
        }
        let unit = self.get(&root, &LENGTH).or_else(|| self.get(&shots[0], &LENGTH)).and_then(|unit| {
            let word = unit.text()?;
            Unit::of(word).or_else(|| {
                let message =
                    format!("\"{}\" is not a unit; expected m, cm, mm, in, ft or px", shortened(word));
                self.wrong(unit.line, "length_unit", message)
            })
        });
        Some((found, unit))
    }

    fn shot(
        &mut self,
        root: &Node<'a>,
        shot: &Node<'a>,
        own: String,
        file: &Arc<PathBuf>,
    ) -> Option<RawShot> {
        let shot_name = self.name(shot).unwrap_or(own);
        let Some(balls) = self.get(shot, &BALLS) else {
            let message = format!("the shot \"{}\" has no \"balls\"; {EXPECTED}", shortened(&shot_name));
            return self.wrong(shot.line, "", message);
        };
        self.clock = None;
        let named: Vec<(Option<String>, &RawValue)> = match &balls.value {
            Value::List(list) => list.iter().map(|ball| (self.name(&self.node(ball)), *ball)).collect(),
            Value::Object(entries) => entries.iter().map(|(key, ball)| (Some(key.clone()), *ball)).collect(),
            Value::Scalar(_) => {
                return self.wrong(balls.line, "balls", format!("{}; {EXPECTED}", balls.shown()));
            }
        };
        let mut tracks = Vec::with_capacity(named.len());
        for (i, (name, ball)) in named.into_iter().enumerate() {
            let ball = self.node(ball);
            tracks.push(self.ball(&ball, name.unwrap_or_else(|| (i + 1).to_string()))?);
        }
        let fps = self.get(shot, &FPS).or_else(|| self.get(root, &FPS)).filter(|fps| !fps.is_null());
        if let Some(fps) = fps.as_ref().filter(|fps| fps.number().is_none_or(|fps| fps <= 0.0)) {
            return self.wrong(fps.line, "fps", format!("{}; expected frames per second", fps.shown()));
        }
        let clock =
            match (self.clock.unwrap_or(Clock::In(TimeUnit::Frames)), fps.and_then(|fps| fps.number())) {
                (Clock::In(TimeUnit::Frames), Some(fps)) => Clock::FramesAt(fps),
                (clock, _) => clock,
            };
        Some(RawShot { name: shot_name, file: file.clone(), line: shot.line, clock, tracks })
    }

    fn ball(&mut self, ball: &Node<'a>, name: String) -> Option<RawTrack> {
        let samples = self.get(ball, &SAMPLES);
        let Value::List(list) = &samples.as_ref().unwrap_or(ball).value else {
            let message = format!("the ball \"{}\" has no \"samples\"; {EXPECTED}", shortened(&name));
            return self.wrong(ball.line, "", message);
        };
        let mut rows = Vec::with_capacity(list.len());
        for sample in list {
            rows.push(self.sample(&self.node(sample))?);
        }
        Some(RawTrack { rows, ..RawTrack::new(name, None) })
    }

    /// Reads `{t, x, y}`, with the position perhaps in an object of its own, or `[t, x, y]`.
    fn sample(&mut self, sample: &Node<'a>) -> Option<Row> {
        let line = sample.line;
        if let Value::List(list) = &sample.value {
            let [time, x, y] = list[..] else {
                return self.wrong(line, "", format!("{} values; expected 3, time, x and y", list.len()));
            };
            self.see_clock(Clock::Unsaid, line)?;
            let time = self.number(&self.node(time), "t")?;
            let place =
                [self.coordinate(Some(self.node(x)), "x")?, self.coordinate(Some(self.node(y)), "y")?];
            return Some(Row::new(time, place, line));
        }
        let times = TIMES.iter().filter_map(|(key, unit)| Some((*key, *unit, self.get(sample, &[key])?)));
        let mut times: Vec<(&str, TimeUnit, Node)> = times.collect();
        if self.input.is_by_frame() {
            times.sort_by_key(|(_, unit, _)| *unit != TimeUnit::Frames);
        }
        let Some((key, unit, time)) = times.first() else {
            let message =
                format!("{} without t or frame; expected t (seconds) or frame, x and y", sample.shown());
            return self.wrong(line, "", message);
        };
        self.see_clock(Clock::In(*unit), line)?;
        let time = self.number(time, key)?;
        let position = self.get(sample, &["position", "pos", "centre", "center"]);
        let position = position.as_ref().unwrap_or(sample);
        let at = |key: &str, i: usize| match &position.value {
            Value::List(list) => list.get(i).map(|raw| self.node(raw)),
            _ => self.get(position, &[key]),
        };
        let place = [self.coordinate(at("x", 0), "x")?, self.coordinate(at("y", 1), "y")?];
        Some(Row::new(time, place, line))
    }

    /// Checks that all times of a shot are of one kind.
    fn see_clock(&mut self, clock: Clock, line: usize) -> Option<()> {
        if *self.clock.get_or_insert(clock) == clock {
            return Some(());
        }
        let message =
            "has another kind of time than the samples above; expected t or frame throughout a shot";
        self.wrong(line, "", message)
    }

    fn number(&self, node: &Node, key: &str) -> Option<f64> {
        let message = || format!("{}; expected a number, without quotation marks", node.shown());
        node.number().or_else(|| self.wrong(node.line, key, message()))
    }

    /// Reads a coordinate, not a number in a gap.
    fn coordinate(&self, node: Option<Node>, key: &str) -> Option<f64> {
        match node.filter(|node| !node.is_null()) {
            None => Some(f64::NAN),
            Some(node) => self.number(&node, key),
        }
    }
}
