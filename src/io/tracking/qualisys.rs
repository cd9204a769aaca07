//! Qualisys Track Manager: TSV with a block of keys above the rows.

use std::collections::HashMap;

use super::heading::Heading;
use super::input::{Input, quoted};
use super::layout::{Body, Layout};
use super::raw::{Clock, FORMAT, GAPS, RawShot};
use super::sample::Rows;
use super::units::Unit;
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

    /// Returns the number of a key with its line; `Err` with a problem if it is not a number.
    fn number(&self, key: &str, input: &Input) -> Result<Option<(usize, f64)>, ()> {
        let Some((line, cells)) = self.keys.get(key) else { return Ok(None) };
        let text = cells.first().map_or("", String::as_str);
        let number = value(text).map(|number| Some((*line, number)));
        number.ok_or_else(|| input.wrong(*line, key, format!("\"{text}\" is not a number; expected one")))
    }
}

pub(super) fn layout(input: &Input) -> Option<Layout> {
    let (_, first) = filled_lines(input.text).next()?;
    if !["NO_OF_FRAMES", "FILE_VERSION"].iter().any(|key| first.starts_with(key)) {
        return None;
    }
    let mut head = Head::of(input.text);
    let missing = |what: &str| {
        let message = format!("{what} is missing above the rows; expected an export of 3D markers");
        input.wrong(None, None, message);
    };
    let fps = head.number("FREQUENCY", input).ok()?;
    head.number("NO_OF_FRAMES", input).ok()?;
    let Some((line, mut markers)) = head.keys.remove("MARKER_NAMES") else {
        missing("MARKER_NAMES");
        return None;
    };
    let Some((_, fps)) = fps.filter(|(_, fps)| *fps > 0.0) else {
        missing("FREQUENCY");
        return None;
    };
    markers.retain(|name| !name.is_empty());
    let (header, names) = head.names.unwrap_or_else(|| {
        // without a row of names: the columns of the format
        let counted = if head.width == 3 * markers.len() + 2 { &["Frame", "Time"][..] } else { &[] };
        let names = markers.iter().flat_map(|name| ["X", "Y", "Z"].map(|axis| format!("{name} {axis}")));
        (line, counted.iter().map(ToString::to_string).chain(names).collect())
    });
    let column = |name: &str| names.iter().position(|own| own == name);
    let mut bodies = Vec::new();
    for name in &markers {
        let [Some(x), Some(y)] = ["X", "Y"].map(|axis| column(&format!("{name} {axis}"))) else {
            let message = format!("no columns \"{name} X\" and \"{name} Y\" for the marker \"{name}\"");
            input.wrong(header, None, message);
            return None;
        };
        bodies.push(Body::new(name, [x, y]));
    }
    input.log.add(FORMAT, None, format!("read as Qualisys, {fps} fps, markers {}", quoted(&markers)));
    let time = column("Frame").or(column("Time")).map(|column| (column, true));
    let layout = Layout::below(Heading::plain(header, head.above, TAB, names), bodies, time, input);
    Some(Layout { unit: Some(Unit::Mm), clock: Clock::FramesAt(fps), ..layout })
}

/// Counts frames from the first row on, and turns positions at 0, 0 into gaps.
pub(super) fn finish(shots: &mut [RawShot], layout: &Layout, input: &Input) {
    let Clock::FramesAt(fps) = layout.clock else { return };
    let column = |name: &str| layout.heading.position(name);
    let (frame, time) = (column("Frame"), column("Time"));
    if let (Some(frame), Some(time)) = (frame, time) {
        Rows::of(input.text, &layout.heading).check_clock(&layout.heading, [frame, time], fps, input);
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
            for row in track.rows.iter_mut().filter(|row| row.place() == [0.0, 0.0]) {
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
