//! Qualisys Track Manager: TSV with a block of keys above the rows.

use std::collections::HashMap;

use super::heading::Heading;
use super::input::{Input, quoted};
use super::layout::{Block, Body, Detected, Layout, Refused};
use super::raw::{Clock, FORMAT, GAPS, RawShot};
use super::sample::Rows;
use super::settings::Unit;
use super::time::first_contradiction;
use crate::io::number::{parse, value};
use crate::io::text::{Separator, filled_lines, lines, trimmed};

const TAB: Separator = Separator::Char('\t');

/// The lines above the rows.
#[derive(Default)]
struct Head {
    /// The keys above the rows: the line and the cells behind the key.
    keys: HashMap<String, (usize, Vec<String>)>,
    names: Option<(usize, Vec<String>)>,
    /// The last line above the rows.
    above: usize,
    /// Number of cells of the first row.
    width: usize,
}

impl Head {
    fn of(text: &str) -> Self {
        let mut head = Self::default();
        for (line, text) in lines(text) {
            let Some(mut row) = trimmed(text, TAB) else { break };
            // the first row, which may begin with a gap
            if head.keys.contains_key("MARKER_NAMES") && row.len() > 1 && parse(&row[0]).is_ok() {
                head.width = row.len() - usize::from(row.last().is_some_and(String::is_empty));
                break;
            }
            if row.iter().any(|cell| cell.ends_with(" X")) && row[0] != "MARKER_NAMES" {
                head.names = Some((line, row));
            } else {
                head.keys.insert(row.remove(0), (line, row));
            }
            head.above = line;
        }
        head
    }

    fn number(&self, key: &str, input: &Input) -> Result<Option<(usize, f64)>, Refused> {
        let Some((line, cells)) = self.keys.get(key) else { return Ok(None) };
        let text = cells.first().map_or("", String::as_str);
        let number = value(text).map(|number| (*line, number));
        if number.is_none() {
            input.wrong(*line, key, format!("\"{text}\" is not a number; expected one"));
        }
        number.map(Some).ok_or(Refused)
    }
}

pub(super) fn layout(input: &Input) -> Detected {
    let (_, first) = filled_lines(input.text).next()?;
    let is_own = ["NO_OF_FRAMES", "FILE_VERSION"].iter().any(|key| first.starts_with(key));
    is_own.then(|| columns(Head::of(input.text), input))
}

fn columns(mut head: Head, input: &Input) -> Result<Layout, Refused> {
    let missing = |what: &str| {
        let message = format!("{what} is missing above the rows; expected an export of 3D markers");
        input.wrong(None, None, message);
        Refused
    };
    let fps = head.number("FREQUENCY", input)?;
    head.number("NO_OF_FRAMES", input)?;
    let (line, mut markers) = head.keys.remove("MARKER_NAMES").ok_or_else(|| missing("MARKER_NAMES"))?;
    markers.retain(|name| !name.is_empty());
    let (_, fps) = fps.filter(|(_, fps)| *fps > 0.0).ok_or_else(|| missing("FREQUENCY"))?;
    let (header, names) = head.names.unwrap_or_else(|| {
        // without a row of names: the columns of the format
        let counted = if head.width == 3 * markers.len() + 2 { &["Frame", "Time"][..] } else { &[] };
        let names = markers.iter().flat_map(|name| ["X", "Y", "Z"].map(|axis| format!("{name} {axis}")));
        (line, counted.iter().map(ToString::to_string).chain(names).collect())
    });
    let column = |name: &str| names.iter().position(|own| own == name);
    let mut bodies = Vec::new();
    for name in &markers {
        let axis = |axis: &str| column(&format!("{name} {axis}"));
        let (Some(x), Some(y)) = (axis("X"), axis("Y")) else {
            let message = format!("no columns \"{name} X\" and \"{name} Y\" for the marker \"{name}\"");
            input.wrong(header, None, message);
            return Err(Refused);
        };
        bodies.push(Body::new(name, x, y));
    }
    input.log.add(FORMAT, None, format!("read as Qualisys, {fps} fps, markers {}", quoted(&markers)));
    let time = column("Frame").or(column("Time"));
    let heading = Heading::plain(header, head.above, TAB, names);
    let blocks = vec![Block::below(&heading, bodies)];
    Ok(Layout { unit: Some(Unit::Mm), ..Layout::new(heading, blocks, time, Clock::FramesAt(fps)) })
}

/// Counts frames from the first row on, and turns positions at 0, 0 into gaps.
pub(super) fn finish(shots: &mut [RawShot], layout: &Layout, input: &Input) {
    let Clock::FramesAt(fps) = layout.clock else { return };
    let column = |name: &str| layout.heading.position(name);
    let (frame, time) = (column("Frame"), column("Time"));
    if let (Some(frame), Some(time)) = (frame, time) {
        check_clock(&layout.heading, [frame, time], fps, input);
    }
    let stated = Head::of(input.text).number("NO_OF_FRAMES", input).ok().flatten();
    for shot in shots {
        shot.clock = layout.clock;
        let first = shot.rows().next().map_or(0.0, |row| row.time);
        for row in shot.rows_mut() {
            let since = row.time - first;
            // times are rounded to digits
            row.time = if frame.is_none() && time.is_some() { (since * fps).round() } else { since };
        }
        for track in &mut shot.tracks {
            for row in track.rows.iter_mut().filter(|row| row.x == 0.0 && row.y == 0.0) {
                row.lose();
                input.log.add(GAPS, row.line, format!("\"{}\" is at 0, 0: taken as a gap", track.name));
            }
        }
        let rows = shot.tracks.first().map_or(0, |track| track.rows.len());
        if let Some((line, frames)) = stated.filter(|(_, frames)| *frames != rows as f64) {
            input.log.add(GAPS, line, format!("says {frames} frames, but there are {rows} rows"));
        }
    }
}

/// Complains if the columns Frame and Time contradict each other at the stated rate.
fn check_clock(heading: &Heading, columns: [usize; 2], fps: f64, input: &Input) {
    let rows = Rows::of(input.text, heading);
    let [Some(frames), Some(seconds)] = columns.map(|column| rows.numbers(column)) else { return };
    let Some(row) = first_contradiction(&frames, &seconds, fps) else { return };
    let after = frames[row] - frames[0];
    let message = format!(
        "Time is {} s, {} s after the first row, but Frame {} is {after} frames after it, {:.6} s at FREQUENCY {fps}; expected times \
         and frames that agree",
        seconds[row],
        seconds[row] - seconds[0],
        frames[row],
        after / fps
    );
    input.wrong(heading.above + 1 + row, "Time", message);
}
