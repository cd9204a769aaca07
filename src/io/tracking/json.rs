//! JSON as tools in the browser save it: an array of shots, each with balls, each with samples.

use std::sync::Arc;

use indexmap::IndexMap;
use serde_json::value::RawValue;

use super::input::Input;
use super::raw::{Clock, FORMAT, RawShot, RawTrack, Row};
use super::units::{TimeUnit, Unit};
use crate::io::number::shortened;
use crate::measurement::number::count_of;

/// Keys with one meaning, the most common first.
const SHOTS: [&str; 1] = ["shots"];
const BALLS: [&str; 3] = ["balls", "tracks", "objects"];
const SAMPLES: [&str; 5] = ["samples", "points", "positions", "frames", "data"];
const POSITION: [&str; 4] = ["position", "pos", "centre", "center"];
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
pub(super) fn read(input: &Input) -> Option<(Vec<RawShot>, Option<Unit>)> {
    let line_ends = input.text.match_indices('\n').map(|(at, _)| at).collect();
    match (Reader { input, line_ends, clock: None }).file() {
        Ok((shots, unit)) => {
            input.log.add(FORMAT, None, format!("read as JSON, {}", count_of(shots.len(), "shot")));
            Some((shots, unit))
        }
        Err(Wrong { line, key, message }) => {
            input.wrong(line, key, message);
            None
        }
    }
}

/// A problem, of a key or of all that begins in a line.
struct Wrong {
    line: usize,
    key: Option<&'static str>,
    message: String,
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

    fn scalar(&self) -> Option<&serde_json::Value> {
        if let Value::Scalar(scalar) = &self.value { Some(scalar) } else { None }
    }

    fn number(&self) -> Option<f64> {
        self.scalar()?.as_f64()
    }

    fn wrong(&self, key: impl Into<Option<&'static str>>, message: impl Into<String>) -> Wrong {
        Wrong { line: self.line, key: key.into(), message: message.into() }
    }
}

struct Reader<'a> {
    input: &'a Input<'a>,
    line_ends: Vec<usize>,
    /// The unit of the times of the current shot.
    clock: Option<Clock>,
}

impl<'a> Reader<'a> {
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
        let text = name.scalar()?.as_str().map(|text| text.trim().to_string());
        text.or_else(|| Some(name.number()?.to_string()))
    }

    fn file(&mut self) -> Result<(Vec<RawShot>, Option<Unit>), Wrong> {
        let whole: &RawValue = serde_json::from_str(self.input.text).map_err(|error| {
            let message = error.to_string();
            let bare = message.rsplit_once(" at line ").map_or(message.as_str(), |(bare, _)| bare);
            Wrong { line: error.line(), key: None, message: format!("is not JSON: {bare}") }
        })?;
        let root = self.node(whole);
        let shots = match &self.get(&root, &SHOTS).as_ref().unwrap_or(&root).value {
            Value::List(list) => list.iter().map(|shot| self.node(shot)).collect(),
            _ if self.get(&root, &BALLS).is_some() => vec![self.node(whole)],
            _ => Vec::new(),
        };
        let Some(first) = shots.first() else {
            return Err(root.wrong(None, format!("holds no shots; {EXPECTED}")));
        };
        let mut found = Vec::with_capacity(shots.len());
        let file = Arc::new(self.input.file.to_path_buf());
        for (i, shot) in shots.iter().enumerate() {
            let stem = self.input.stem;
            let own = if shots.len() == 1 { stem.to_string() } else { format!("{stem}-{}", i + 1) };
            let name = self.name(shot).unwrap_or(own);
            let (tracks, clock) = self.shot(&root, shot, &name)?;
            found.push(RawShot { name, file: Arc::clone(&file), line: shot.line, clock, tracks });
        }
        let unit = self.get(&root, &LENGTH).or_else(|| self.get(first, &LENGTH));
        let Some(unit) = unit else { return Ok((found, None)) };
        let Some(word) = unit.scalar().and_then(|scalar| scalar.as_str()) else { return Ok((found, None)) };
        let message = || format!("\"{}\" is not a unit; expected m, cm, mm, in, ft or px", shortened(word));
        let known = Unit::of(word).ok_or_else(|| unit.wrong("length_unit", message()))?;
        Ok((found, Some(known)))
    }

    fn shot(
        &mut self,
        root: &Node<'a>,
        shot: &Node<'a>,
        name: &str,
    ) -> Result<(Vec<RawTrack>, Clock), Wrong> {
        let balls = self.get(shot, &BALLS).ok_or_else(|| {
            shot.wrong(None, format!("the shot \"{}\" has no \"balls\"; {EXPECTED}", shortened(name)))
        })?;
        self.clock = None;
        let named: Vec<(Option<String>, &RawValue)> = match &balls.value {
            Value::List(list) => list.iter().map(|ball| (self.name(&self.node(ball)), *ball)).collect(),
            Value::Object(entries) => entries.iter().map(|(key, ball)| (Some(key.clone()), *ball)).collect(),
            Value::Scalar(_) => {
                return Err(balls.wrong("balls", format!("{}; {EXPECTED}", balls.shown())));
            }
        };
        let mut tracks = Vec::with_capacity(named.len());
        for (i, (name, ball)) in named.into_iter().enumerate() {
            let ball = self.node(ball);
            tracks.push(self.ball(&ball, name.unwrap_or_else(|| (i + 1).to_string()))?);
        }
        let is_null = |node: &Node| node.scalar().is_some_and(serde_json::Value::is_null);
        let fps = self.get(shot, &FPS).or_else(|| self.get(root, &FPS)).filter(|fps| !is_null(fps));
        if let Some(fps) = fps.as_ref().filter(|fps| fps.number().is_none_or(|fps| fps <= 0.0)) {
            return Err(fps.wrong("fps", format!("{}; expected frames per second", fps.shown())));
        }
        let clock = self.clock.unwrap_or(Clock::In(TimeUnit::Frames));
        let fps = fps.and_then(|fps| fps.number()).filter(|_| clock == Clock::In(TimeUnit::Frames));
        Ok((tracks, fps.map_or(clock, Clock::FramesAt)))
    }

    fn ball(&mut self, ball: &Node<'a>, name: String) -> Result<RawTrack, Wrong> {
        let samples = self.get(ball, &SAMPLES);
        let Value::List(list) = &samples.as_ref().unwrap_or(ball).value else {
            let message = format!("the ball \"{}\" has no \"samples\"; {EXPECTED}", shortened(&name));
            return Err(ball.wrong(None, message));
        };
        let rows = list.iter().map(|sample| self.sample(&self.node(sample)));
        Ok(RawTrack { rows: rows.collect::<Result<_, _>>()?, ..RawTrack::new(name, None) })
    }

    /// Reads `{t, x, y}`, with the position perhaps in an object of its own, or `[t, x, y]`.
    fn sample(&mut self, sample: &Node<'a>) -> Result<Row, Wrong> {
        if let Value::List(list) = &sample.value {
            let [time, x, y] = list[..] else {
                let message = format!("{} values; expected 3, time, x and y", list.len());
                return Err(sample.wrong(None, message));
            };
            self.see_clock(Clock::Unsaid, sample)?;
            let time = number(&self.node(time), "t")?;
            let place = [coordinate(Some(self.node(x)), "x")?, coordinate(Some(self.node(y)), "y")?];
            return Ok(Row::new(time, place, sample.line));
        }
        let of_key = |(key, unit): (&'static str, TimeUnit)| Some((key, unit, self.get(sample, &[key])?));
        let mut times: Vec<(&str, TimeUnit, Node)> = TIMES.into_iter().filter_map(of_key).collect();
        if self.input.is_by_frame() {
            times.sort_by_key(|(_, unit, _)| *unit != TimeUnit::Frames);
        }
        let Some((key, unit, time)) = times.first() else {
            let message =
                format!("{} without t or frame; expected t (seconds) or frame, x and y", sample.shown());
            return Err(sample.wrong(None, message));
        };
        self.see_clock(Clock::In(*unit), sample)?;
        let time = number(time, key)?;
        let position = self.get(sample, &POSITION);
        let position = position.as_ref().unwrap_or(sample);
        let at = |key: &str, i: usize| match &position.value {
            Value::List(list) => list.get(i).map(|raw| self.node(raw)),
            _ => self.get(position, &[key]),
        };
        let place = [coordinate(at("x", 0), "x")?, coordinate(at("y", 1), "y")?];
        Ok(Row::new(time, place, sample.line))
    }

    /// Checks that all times of a shot are of one kind.
    fn see_clock(&mut self, clock: Clock, sample: &Node) -> Result<(), Wrong> {
        if *self.clock.get_or_insert(clock) == clock {
            return Ok(());
        }
        let message =
            "has another kind of time than the samples above; expected t or frame throughout a shot";
        Err(sample.wrong(None, message))
    }
}

fn number(node: &Node, key: &'static str) -> Result<f64, Wrong> {
    let message = || format!("{}; expected a number, without quotation marks", node.shown());
    node.number().ok_or_else(|| node.wrong(key, message()))
}

/// Reads a coordinate, not a number in a gap.
fn coordinate(node: Option<Node>, key: &'static str) -> Result<f64, Wrong> {
    match node.filter(|node| !node.scalar().is_some_and(serde_json::Value::is_null)) {
        None => Ok(f64::NAN),
        Some(node) => number(&node, key),
    }
}
