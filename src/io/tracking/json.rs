//! JSON as tools in the browser save it: an array of shots, each with balls, each with samples.

use std::path::PathBuf;
use std::sync::Arc;

use super::input::{Input, Shots};
use super::json_text::{Node, Value, parse};
use super::raw::{Clock, FORMAT, RawShot, RawTrack, Row};
use super::settings::{TimeUnit, Unit};
use crate::io::number::shortened;
use crate::measurement::number::count_of;

/// Keys that mean the same, the usual one first.
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

/// Whether the text is JSON.
pub(super) fn detect(text: &str) -> bool {
    let text = text.trim_start();
    text.starts_with('{')
        || text.strip_prefix('[').is_some_and(|rest| rest.trim_start().starts_with(['{', ']']))
}

/// The shots of a file, and the unit of lengths that it states.
pub(super) fn read(input: &Input) -> Option<Shots> {
    let before = input.problems.len();
    let (shots, unit) = Reader { input, clock: None }.file().filter(|_| input.problems.len() == before)?;
    input.log.add(FORMAT, None, format!("read as JSON, {}", count_of(shots.len(), "shot")));
    Some((shots, unit))
}

struct Reader<'a> {
    input: &'a Input<'a>,
    /// What the times of the present shot are in.
    clock: Option<Clock>,
}

impl Reader<'_> {
    /// Complains, of a key where there is one. Always `None`.
    fn wrong<T>(&self, line: usize, key: &str, message: String) -> Option<T> {
        self.input.wrong(line, Some(key).filter(|key| !key.is_empty()), message);
        None
    }

    fn file(&mut self) -> Option<Shots> {
        let root = match parse(self.input.text) {
            Ok(root) => root,
            Err((line, message)) => return self.wrong(line, "", format!("is no JSON: {message}")),
        };
        let shots: &[Node] = match root.get(&SHOTS).map_or(&root.value, |shots| &shots.value) {
            Value::List(list) => list,
            _ if root.get(&BALLS).is_some() => std::slice::from_ref(&root),
            _ => &[],
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
        let unit = match root.get(&LENGTH).or(shots[0].get(&LENGTH)) {
            Some(Node { line, value: Value::Text(word) }) => Unit::of(word).or_else(|| {
                let message = format!("\"{}\" is no unit; expected m, cm, mm, in, ft or px", shortened(word));
                self.wrong(*line, "length_unit", message)
            }),
            _ => None,
        };
        Some((found, unit))
    }

    fn shot(&mut self, root: &Node, shot: &Node, own: String, file: &Arc<PathBuf>) -> Option<RawShot> {
        let shot_name = name(shot).unwrap_or(own);
        let Some(balls) = shot.get(&BALLS) else {
            let message = format!("the shot \"{}\" has no \"balls\"; {EXPECTED}", shortened(&shot_name));
            return self.wrong(shot.line, "", message);
        };
        self.clock = None;
        let number = |i: usize| (i + 1).to_string();
        let named: Vec<(String, &Node)> = match &balls.value {
            Value::List(list) => {
                let named = |(i, ball)| (name(ball).unwrap_or_else(|| number(i)), ball);
                list.iter().enumerate().map(named).collect()
            }
            Value::Object(entries) => entries.iter().map(|(key, ball)| (key.clone(), ball)).collect(),
            _ => return self.wrong(balls.line, "balls", format!("{}; {EXPECTED}", balls.what())),
        };
        let tracks = named.into_iter().map(|(name, ball)| self.ball(ball, name)).collect::<Option<_>>()?;
        let fps = match shot.get(&FPS).or(root.get(&FPS)) {
            None | Some(Node { value: Value::Null, .. }) => None,
            Some(Node { value: Value::Number(fps), .. }) if *fps > 0.0 => Some(*fps),
            Some(other) => {
                let message = format!("{}; expected frames per second", other.what());
                return self.wrong(other.line, "fps", message);
            }
        };
        let clock = match (self.clock.unwrap_or(Clock::In(TimeUnit::Frames)), fps) {
            (Clock::In(TimeUnit::Frames), Some(fps)) => Clock::FramesAt(fps),
            (clock, _) => clock,
        };
        Some(RawShot { name: shot_name, file: file.clone(), line: shot.line, clock, tracks })
    }

    fn ball(&mut self, ball: &Node, name: String) -> Option<RawTrack> {
        let samples = ball.get(&SAMPLES).unwrap_or(ball);
        let Value::List(list) = &samples.value else {
            let message = format!("the ball \"{}\" has no \"samples\"; {EXPECTED}", shortened(&name));
            return self.wrong(ball.line, "", message);
        };
        let rows = list.iter().map(|sample| self.sample(sample)).collect::<Option<_>>()?;
        Some(RawTrack { rows, ..RawTrack::new(name, None) })
    }

    /// `{t, x, y}`, with the position perhaps in an object of its own, or `[t, x, y]`.
    fn sample(&mut self, sample: &Node) -> Option<Row> {
        let line = sample.line;
        if let Value::List(list) = &sample.value {
            let [time, x, y] = list.as_slice() else {
                let message = format!("{} values; expected 3, time, x and y", list.len());
                return self.wrong(sample.line, "", message);
            };
            self.clock(Clock::Unsaid, sample.line)?;
            let time = self.number(time, "t")?;
            let [x, y] = [self.coordinate(Some(x), "x")?, self.coordinate(Some(y), "y")?];
            return Some(Row::new(time, [x, y], line));
        }
        let by_frame =
            self.input.is_by_frame() || TIMES[..3].iter().all(|(key, _)| sample.get(&[key]).is_none());
        let mut times = TIMES.iter().filter_map(|(key, unit)| Some((*key, *unit, sample.get(&[key])?)));
        let frame = times.clone().find(|(_, unit, _)| by_frame && *unit == TimeUnit::Frames);
        let Some((key, unit, time)) = frame.or_else(|| times.next()) else {
            let message =
                format!("{} without t or frame; expected t (seconds) or frame, x and y", sample.what());
            return self.wrong(sample.line, "", message);
        };
        self.clock(Clock::In(unit), sample.line)?;
        let time = self.number(time, key)?;
        let position = sample.get(&["position", "pos", "centre", "center"]).unwrap_or(sample);
        let at = |keys: &[&str], i: usize| match &position.value {
            Value::List(list) => list.get(i),
            _ => position.get(keys),
        };
        let [x, y] = [self.coordinate(at(&["x"], 0), "x")?, self.coordinate(at(&["y"], 1), "y")?];
        Some(Row::new(time, [x, y], line))
    }

    /// All times of a shot are of one kind.
    fn clock(&mut self, clock: Clock, line: usize) -> Option<()> {
        if *self.clock.get_or_insert(clock) == clock {
            return Some(());
        }
        let message =
            "has another kind of time than the samples above; expected t or frame throughout a shot";
        self.wrong(line, "", message.to_string())
    }

    fn number(&self, node: &Node, key: &str) -> Option<f64> {
        if let Value::Number(number) = node.value {
            return Some(number);
        }
        let message = format!("{}; expected a number, without quotation marks", node.what());
        self.wrong(node.line, key, message)
    }

    /// Not a number in a gap.
    fn coordinate(&self, node: Option<&Node>, key: &str) -> Option<f64> {
        match node {
            None | Some(Node { value: Value::Null, .. }) => Some(f64::NAN),
            Some(node) => self.number(node, key),
        }
    }
}

fn name(node: &Node) -> Option<String> {
    match &node.get(&NAME)?.value {
        Value::Text(text) => Some(text.trim().to_string()),
        Value::Number(number) => Some(number.to_string()),
        _ => None,
    }
}
