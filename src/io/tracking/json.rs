//! JSON as tools in the browser save it: an array of shots, each with balls, each with samples. Every
//! sample becomes a row of a long table.

use std::borrow::Cow;
use std::collections::HashMap;

use indexmap::IndexMap;
use serde_json::value::RawValue;

use super::heading::Heading;
use super::input::{Input, Subject};
use super::layout::{Block, Body, Layout, Name};
use super::raw::{Clock, RawShot};
use super::reader::Reader;
use super::settings::Format;
use super::units::{TimeUnit, Unit};
use crate::io::number::{shortened, value};
use crate::io::text::Separator;
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

/// A value: the elements of a list, or the entries of an object in the order of the file.
struct Node<'t> {
    line: usize,
    raw: &'t RawValue,
    list: Vec<&'t RawValue>,
    entries: IndexMap<String, &'t RawValue>,
}

impl Node<'_> {
    /// Returns it as a cell of a table: text without quotation marks, nothing for null.
    fn cell(&self) -> String {
        let text = self.raw.get();
        if text == "null" { String::new() } else { serde_json::from_str(text).unwrap_or(text.to_string()) }
    }
}

struct File<'t> {
    input: &'t Input<'t>,
    line_ends: Vec<usize>,
}

/// Returns the shots of a file, and the unit of lengths that it states; `None` with a problem.
pub(super) fn read(input: &Input) -> Option<(Vec<RawShot>, Option<Unit>)> {
    let line_ends = input.text.match_indices('\n').map(|(at, _)| at).collect();
    let (shots, unit) = File { input, line_ends }.read()?;
    let message = format!("read as JSON, {}", count_of(shots.len(), "shot"));
    input.log.add(Subject::Format, None, message);
    Some((shots, unit))
}

impl<'t> File<'t> {
    fn refuse<T>(&self, node: &Node, message: &str) -> Option<T> {
        self.input.wrong(node.line, None, format!("{message}; {EXPECTED}"));
        None
    }

    fn node(&self, raw: &'t RawValue) -> Node<'t> {
        let text = raw.get();
        let begin = text.as_ptr() as usize - self.input.text.as_ptr() as usize;
        let line = self.line_ends.partition_point(|end| *end < begin) + 1;
        // the text has been checked as a whole
        let list = serde_json::from_str(text).unwrap_or_default();
        Node { line, raw, list, entries: serde_json::from_str(text).unwrap_or_default() }
    }

    /// Returns the value of the first key that an object has, in small or capital letters.
    fn get(&self, node: &Node<'t>, keys: &[&str]) -> Option<Node<'t>> {
        let of_key = |key: &&str| node.entries.iter().find(|(own, _)| own.eq_ignore_ascii_case(key));
        keys.iter().find_map(of_key).map(|(_, raw)| self.node(raw))
    }

    fn cell(&self, node: &Node<'t>, keys: &[&str]) -> Option<String> {
        Some(self.get(node, keys)?.cell().trim().to_string()).filter(|cell| !cell.is_empty())
    }

    fn read(&self) -> Option<(Vec<RawShot>, Option<Unit>)> {
        let input = self.input;
        let not_json = |error: serde_json::Error| {
            let message = error.to_string();
            let bare = message.rsplit_once(" at line ").map_or(message.as_str(), |(bare, _)| bare);
            input.wrong(error.line(), None, format!("is not JSON: {bare}"));
        };
        let whole: &RawValue = serde_json::from_str(input.text).map_err(not_json).ok()?;
        let root = self.node(whole);
        let mut shots = self.get(&root, &SHOTS).map_or(self.node(whole).list, |shots| shots.list);
        if shots.is_empty() && self.get(&root, &BALLS).is_some() {
            shots = vec![whole];
        }
        let Some(first) = shots.first().map(|shot| self.node(shot)) else {
            return self.refuse(&root, "holds no shots");
        };
        let layout = layout(input);
        let mut reader = Reader::new(input, &layout);
        let mut clocks: HashMap<String, Clock> = HashMap::new();
        for (i, shot) in shots.iter().map(|shot| self.node(shot)).enumerate() {
            let own = || {
                if shots.len() == 1 { input.stem.to_string() } else { format!("{}-{}", input.stem, i + 1) }
            };
            let name = self.cell(&shot, &NAME).unwrap_or_else(own);
            let mut clock = self.shot(&shot, &name, &mut reader, &layout.blocks[0].bodies)?;
            let fps = self.cell(&shot, &FPS).or_else(|| self.cell(&root, &FPS));
            if let Some(fps) = fps {
                let Some(known) = value(&fps).filter(|fps| *fps > 0.0) else {
                    return self.refuse(&shot, &format!("fps is {fps}, not frames per second"));
                };
                clock = if clock == Clock::In(TimeUnit::Frames) { Clock::FramesAt(known) } else { clock };
            }
            if clocks.insert(name.clone(), clock).is_some() {
                return self.refuse(&shot, &format!("\"{}\" is the name of two shots", shortened(&name)));
            }
        }
        let mut found = reader.finish();
        for shot in &mut found {
            shot.clock = clocks.get(&shot.name).copied().unwrap_or(shot.clock);
        }
        let unit = self.cell(&root, &LENGTH).or_else(|| self.cell(&first, &LENGTH));
        let Some(unit) = unit else { return Some((found, None)) };
        if let Some(known) = Unit::of(&unit) {
            return Some((found, Some(known)));
        }
        self.refuse(
            &root,
            &format!("\"{}\" is not a unit of length: m, cm, mm, in, ft or px", shortened(&unit)),
        )
    }

    /// Reads the samples of a shot; returns the meaning of its times.
    fn shot(&self, shot: &Node<'t>, name: &str, reader: &mut Reader, bodies: &[Body]) -> Option<Clock> {
        let balls = self.get(shot, &BALLS).filter(|balls| balls.raw.get().starts_with(['{', '[']));
        let Some(balls) = balls else {
            return self.refuse(shot, &format!("the shot \"{}\" has no \"balls\"", shortened(name)));
        };
        let named = balls.entries.iter().map(|(name, ball)| (Some(name.clone()), *ball));
        let listed = balls.list.iter().map(|ball| (self.cell(&self.node(ball), &NAME), *ball));
        let mut clock = None;
        for (i, (ball_name, ball)) in named.chain(listed).enumerate() {
            let ball = self.node(ball);
            let ball_name = ball_name.unwrap_or_else(|| (i + 1).to_string());
            let samples = self.get(&ball, &SAMPLES).unwrap_or_else(|| self.node(ball.raw));
            if !samples.raw.get().starts_with('[') {
                let message = format!("the ball \"{}\" has no \"samples\"", shortened(&ball_name));
                return self.refuse(&ball, &message);
            }
            for sample in samples.list.iter().map(|sample| self.node(sample)) {
                let (own, row) = self.sample(&sample)?;
                if *clock.get_or_insert(own) != own {
                    return self.refuse(&sample, "has another kind of time than the samples above");
                }
                let [time, x, y] = row.map(Cow::Owned);
                let cells = [Cow::Borrowed(name), Cow::Owned(ball_name.clone()), time, x, y];
                reader.add(sample.line, &cells, bodies, 0);
            }
        }
        Some(clock.unwrap_or(Clock::In(TimeUnit::Frames)))
    }

    /// Reads `{t, x, y}`, with the position perhaps in an object or a list of its own, or `[t, x, y]`.
    fn sample(&self, sample: &Node<'t>) -> Option<(Clock, [String; 3])> {
        if let [time, x, y] = sample.list[..] {
            return Some((Clock::Unsaid, [time, x, y].map(|raw| self.node(raw).cell())));
        }
        let times = TIMES.iter().filter_map(|(key, unit)| Some((*unit, self.get(sample, &[key])?.cell())));
        let is_preferred = |unit: TimeUnit| (unit == TimeUnit::Frames) == self.input.is_by_frame();
        let Some((unit, time)) = times.min_by_key(|(unit, _)| !is_preferred(*unit)) else {
            return self.refuse(sample, "a sample without t or frame");
        };
        let position = self.get(sample, &POSITION);
        let position = position.as_ref().unwrap_or(sample);
        let at = |key: &str, i: usize| match position.list.get(i) {
            Some(raw) => self.node(raw).cell(),
            None => self.cell(position, &[key]).unwrap_or_default(),
        };
        Some((Clock::In(unit), [time, at("x", 0), at("y", 1)]))
    }
}

/// Returns the layout of the rows that samples become.
fn layout(input: &Input) -> Layout {
    let names = ["shot", "ball", "time", "x", "y"].map(str::to_string).to_vec();
    let heading = Heading::plain(1, 0, Separator::Char(','), names);
    let body = Body { name: Name::Column(1), ..Body::new("", [3, 4]) };
    let block = Block::below(&heading, vec![body]);
    Layout { shot: Some(0), ..Layout::new(Format::Json, heading, vec![block], Some((2, true)), input) }
}
