//! Qualisys Track Manager: TSV with a block of keys above the rows.

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
struct Keys {
    markers: Option<(usize, Vec<String>)>,
    fps: Option<f64>,
    /// The number of frames that the file states, with its line.
    frames: Option<(usize, f64)>,
    names: Option<(usize, Vec<String>)>,
    /// The last line above the rows.
    above: usize,
    /// How many cells the first row has.
    width: usize,
}

impl Keys {
    fn read(input: &Input) -> Result<Self, Refused> {
        let mut keys = Self::default();
        for (line, text) in lines(input.text) {
            let Some(row) = trimmed(text, TAB) else { break };
            match row[0].as_str() {
                "MARKER_NAMES" => {
                    let named = row[1..].iter().filter(|name| !name.is_empty()).cloned();
                    keys.markers = Some((line, named.collect()));
                }
                key @ ("FREQUENCY" | "NO_OF_FRAMES") => {
                    let text = row.get(1).map_or("", String::as_str);
                    let Some(number) = value(text) else {
                        input.wrong(line, key, format!("\"{text}\" is no number; expected one"));
                        return Err(Refused);
                    };
                    if key == "FREQUENCY" {
                        keys.fps = Some(number);
                    } else {
                        keys.frames = Some((line, number));
                    }
                }
                // the first row, which may begin with a gap
                first if keys.markers.is_some() && row.len() > 1 && parse(first).is_ok() => {
                    keys.width = row.len() - usize::from(row.last().is_some_and(String::is_empty));
                    break;
                }
                _ if row.iter().any(|cell| cell.ends_with(" X")) => keys.names = Some((line, row)),
                _ => {}
            }
            keys.above = line;
        }
        Ok(keys)
    }
}

/// Returns the layout of an export.
pub(super) fn layout(input: &Input) -> Detected {
    let (_, first) = filled_lines(input.text).next()?;
    let is_own = ["NO_OF_FRAMES", "FILE_VERSION"].iter().any(|key| first.starts_with(key));
    is_own.then(|| Keys::read(input).and_then(|keys| columns(keys, input)))
}

fn columns(keys: Keys, input: &Input) -> Result<Layout, Refused> {
    let missing = |what: &str| {
        let message = format!("{what} is missing above the rows; expected an export of 3D markers");
        input.wrong(None, None, message);
        Refused
    };
    let (line, markers) = keys.markers.ok_or_else(|| missing("MARKER_NAMES"))?;
    let fps = keys.fps.filter(|fps| *fps > 0.0).ok_or_else(|| missing("FREQUENCY"))?;
    let (header, names) = keys.names.unwrap_or_else(|| {
        // without a row of names: those that the format always has
        let counted = if keys.width == 3 * markers.len() + 2 { &["Frame", "Time"][..] } else { &[] };
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
    let heading = Heading::plain(header, keys.above, TAB, names);
    let blocks = vec![Block::below(&heading, bodies)];
    let clock = Clock::FramesAt(fps);
    Ok(Layout { heading, shot: None, time, clock, unit: Some(Unit::Mm), has_all_cells: false, blocks })
}

/// Counts frames from the first row on, and turns positions at 0, 0 into gaps.
pub(super) fn finish(shots: &mut [RawShot], layout: &Layout, input: &Input) {
    let Clock::FramesAt(fps) = layout.clock else { return };
    let column = |name: &str| layout.heading.position(name);
    let (frame, time) = (column("Frame"), column("Time"));
    if let (Some(frame), Some(time)) = (frame, time) {
        check_clock(&layout.heading, [frame, time], fps, input);
    }
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
        let stated = Keys::read(input).ok().and_then(|keys| keys.frames);
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
