//! JSON as tools in the browser save it: an array of shots, each with balls, each with samples.
//! Every sample becomes a row of a long table.

use std::borrow::Cow;
use std::collections::HashMap;

use indexmap::IndexMap;
use serde_json::value::RawValue;

use super::heading::Heading;
use super::input::{Input, Subject};
use super::layout::{Block, Body, Layout};
use super::raw::{Clock, RawShot};
use super::reader::Reader;
use super::settings::Format;
use super::units::{TimeUnit, Unit};
use crate::io::number::{shortened, value};
use crate::io::text::Separator;
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

/// Returns a value as a cell of a table: text without quotation marks, empty for null.
fn cell(raw: &RawValue) -> String {
    let text = raw.get();
    if text == "null" { String::new() } else { serde_json::from_str(text).unwrap_or(text.to_string()) }
}

/// Returns the entries of an object, in their order, or the elements of a list with empty keys.
fn entries(raw: &RawValue) -> Vec<(String, &RawValue)> {
    // the text has been checked as a whole
    if let Ok(list) = serde_json::from_str::<Vec<&RawValue>>(raw.get()) {
        return list.into_iter().map(|raw| (String::new(), raw)).collect();
    }
    serde_json::from_str::<IndexMap<String, &RawValue>>(raw.get()).unwrap_or_default().into_iter().collect()
}

/// Returns the value of the first key that an object has.
fn get<'t>(entries: &[(String, &'t RawValue)], keys: &[&str]) -> Option<&'t RawValue> {
    let of_key = |key: &&str| entries.iter().find(|(own, _)| own == key);
    keys.iter().find_map(of_key).map(|(_, raw)| *raw)
}

fn get_cell(entries: &[(String, &RawValue)], keys: &[&str]) -> Option<String> {
    Some(cell(get(entries, keys)?).trim().to_string()).filter(|cell| !cell.is_empty())
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

impl File<'_> {
    fn line(&self, raw: &RawValue) -> usize {
        let begin = raw.get().as_ptr() as usize - self.input.text.as_ptr() as usize;
        self.line_ends.partition_point(|end| *end < begin) + 1
    }

    fn refuse<T>(&self, at: &RawValue, message: &str) -> Option<T> {
        self.input.wrong(self.line(at), None, format!("{message}; {EXPECTED}"));
        None
    }

    fn read(&self) -> Option<(Vec<RawShot>, Option<Unit>)> {
        let input = self.input;
        let not_json = |error: serde_json::Error| {
            let message = error.to_string();
            let bare = message.rsplit_once(" at line ").map_or(message.as_str(), |(bare, _)| bare);
            input.wrong(error.line(), None, format!("is not JSON: {bare}"));
        };
        let whole: &RawValue = serde_json::from_str(input.text).map_err(not_json).ok()?;
        let root = entries(whole);
        let shots = match get(&root, &["shots"]) {
            Some(shots) => entries(shots),
            None if get(&root, &BALLS).is_some() => vec![(String::new(), whole)],
            None => root.clone(),
        };
        if shots.is_empty() || shots.iter().any(|(key, _)| !key.is_empty()) {
            return self.refuse(whole, "holds no shots");
        }
        let names = ["shot", "ball", "time", "x", "y"].map(str::to_string).to_vec();
        let heading = Heading::plain(1, 0, Separator::Char(','), names);
        let body = Body { ball: Some(1), ..Body::new("", [3, 4]) };
        let blocks = vec![Block::below(&heading, vec![body])];
        let layout = Layout::new(Format::Json, heading, blocks, Some((2, true)), input);
        let layout = Layout { shot: Some(0), ..layout };
        let mut reader = Reader::new(input, &layout);
        let mut clocks: HashMap<String, Clock> = HashMap::new();
        for (i, (_, raw)) in shots.iter().enumerate() {
            let shot = entries(raw);
            let number = if shots.len() == 1 { String::new() } else { format!("-{}", i + 1) };
            let name = get_cell(&shot, &NAME).unwrap_or_else(|| format!("{}{number}", input.stem));
            let Some(balls) = get(&shot, &BALLS).filter(|balls| balls.get().starts_with(['{', '['])) else {
                return self.refuse(raw, &format!("the shot \"{}\" has no \"balls\"", shortened(&name)));
            };
            let mut clock = self.balls(balls, &name, &mut reader, &layout.blocks[0].bodies)?;
            if let Some(fps) = get_cell(&shot, &FPS).or_else(|| get_cell(&root, &FPS)) {
                let Some(known) = value(&fps).filter(|fps| *fps > 0.0) else {
                    return self.refuse(raw, &format!("fps is {fps}, not frames per second"));
                };
                clock.fps = Some(known).filter(|_| clock.unit == Some(TimeUnit::Frames));
            }
            if clocks.insert(name.clone(), clock).is_some() {
                return self.refuse(raw, &format!("\"{}\" is the name of two shots", shortened(&name)));
            }
        }
        let mut found = reader.finish();
        for shot in &mut found {
            shot.clock = clocks.get(&shot.name).copied().unwrap_or(shot.clock);
        }
        let unit = get_cell(&root, &["length_unit", "unit"]);
        let known = unit.as_deref().and_then(Unit::of);
        if let (Some(unit), None) = (unit, known) {
            let unit = shortened(&unit);
            return self
                .refuse(whole, &format!("\"{unit}\" is not a unit of length: m, cm, mm, in, ft or px"));
        }
        Some((found, known))
    }

    /// Reads the samples of all balls of a shot; returns the meaning of its times.
    fn balls(&self, balls: &RawValue, shot: &str, reader: &mut Reader, bodies: &[Body]) -> Option<Clock> {
        let mut clock = None;
        for (i, (key, raw)) in entries(balls).into_iter().enumerate() {
            let ball = entries(raw);
            let name = Some(key).filter(|key| !key.is_empty()).or_else(|| get_cell(&ball, &NAME));
            let name = name.unwrap_or_else(|| (i + 1).to_string());
            let samples = get(&ball, &SAMPLES).unwrap_or(raw);
            if !samples.get().starts_with('[') {
                return self.refuse(raw, &format!("the ball \"{}\" has no \"samples\"", shortened(&name)));
            }
            for (_, sample) in entries(samples) {
                let (own, row) = self.sample(sample)?;
                if *clock.get_or_insert(own) != own {
                    return self.refuse(sample, "has another kind of time than the samples above");
                }
                let [time, x, y] = row.map(Cow::Owned);
                let cells = [Cow::Borrowed(shot), Cow::Borrowed(name.as_str()), time, x, y];
                reader.add(self.line(sample), &cells, bodies, 0);
            }
        }
        Some(clock.unwrap_or(Clock::of(TimeUnit::Frames)))
    }

    /// Reads `{t, x, y}`, or `{frame, x, y}`, or `[t, x, y]`.
    fn sample(&self, raw: &RawValue) -> Option<(Clock, [String; 3])> {
        let sample = entries(raw);
        if let [(_, time), (_, x), (_, y)] = sample[..]
            && raw.get().starts_with('[')
        {
            return Some((Clock::default(), [time, x, y].map(cell)));
        }
        let [frame, time] = [["frame", "frame"], ["t", "time"]].map(|keys| get(&sample, &keys));
        let Some((own, is_frame)) = self.input.frame_or_time(frame, time) else {
            return self.refuse(raw, "a sample without t or frame");
        };
        let unit = if is_frame { TimeUnit::Frames } else { TimeUnit::S };
        let [x, y] = ["x", "y"].map(|key| get_cell(&sample, &[key]).unwrap_or_default());
        Some((Clock::of(unit), [cell(own), x, y]))
    }
}
