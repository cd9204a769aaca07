//! Qualisys Track Manager: TSV with a block of keys above the rows.

use super::heading::Heading;
use super::input::{Input, Shots, quoted};
use super::raw::{Clock, FORMAT, GAPS, RawTrack};
use super::sample::Rows;
use super::settings::Unit;
use super::sheet::{At, Body, Sheet};
use super::time::first_contradiction;
use crate::io::number::{parse, value};
use crate::io::text::{Separator, filled_lines, lines, trimmed};

/// Whether the text is such an export.
pub(super) fn detect(text: &str) -> bool {
    filled_lines(text)
        .next()
        .is_some_and(|(_, line)| ["NO_OF_FRAMES", "FILE_VERSION"].iter().any(|key| line.starts_with(key)))
}

pub(super) fn read(input: &Input) -> Option<Shots> {
    const TAB: Separator = Separator::Char('\t');
    let (mut markers, mut fps, mut frames) = (None, None, None);
    let mut names: Option<(usize, Vec<String>)> = None;
    let (mut above, mut width) = (0, 0);
    for (line, text) in lines(input.text) {
        let Some(row) = trimmed(text, TAB) else { break };
        match row[0].as_str() {
            "MARKER_NAMES" => {
                let named = row[1..].iter().filter(|name| !name.is_empty()).cloned();
                markers = Some((line, named.collect::<Vec<_>>()));
            }
            "FREQUENCY" | "NO_OF_FRAMES" => {
                let text = row.get(1).map_or("", String::as_str);
                let Some(number) = value(text) else {
                    input.wrong(line, row[0].as_str(), format!("\"{text}\" is no number; expected one"));
                    return None;
                };
                let slot = if row[0] == "FREQUENCY" { &mut fps } else { &mut frames };
                *slot = Some((line, number));
            }
            // the first row, which may begin with a gap
            first if markers.is_some() && row.len() > 1 && parse(first).is_ok() => {
                width = row.len() - usize::from(row.last().is_some_and(String::is_empty));
                break;
            }
            _ if row.iter().any(|cell| cell.ends_with(" X")) => names = Some((line, row)),
            _ => {}
        }
        above = line;
    }
    let missing = |what: &str| {
        let message = format!("{what} is missing above the rows; expected an export of 3D markers");
        input.wrong(None, None, message);
    };
    let Some((line, markers)) = markers else {
        missing("MARKER_NAMES");
        return None;
    };
    let Some((_, fps)) = fps.filter(|(_, fps)| *fps > 0.0) else {
        missing("FREQUENCY");
        return None;
    };
    let (header, names) = names.unwrap_or_else(|| {
        // without a row of names: those that the format always has
        let counted = if width == 3 * markers.len() + 2 { &["Frame", "Time"][..] } else { &[] };
        let names = markers.iter().flat_map(|name| ["X", "Y", "Z"].map(|axis| format!("{name} {axis}")));
        (line, counted.iter().map(ToString::to_string).chain(names).collect())
    });
    let mut bodies = Vec::new();
    for name in &markers {
        let column = |axis: &str| names.iter().position(|n| *n == format!("{name} {axis}"));
        let (Some(x), Some(y)) = (column("X"), column("Y")) else {
            let message = format!("no columns \"{name} X\" and \"{name} Y\" for the marker \"{name}\"");
            input.wrong(header, None, message);
            return None;
        };
        bodies.push(Body { name: name.clone(), at: At::plain(x, y) });
    }
    let log = input.log;
    log.add(FORMAT, None, format!("read as Qualisys, {fps} fps, markers {}", quoted(&markers)));
    let column = |name: &str| names.iter().position(|own| own == name);
    let (frame, time) = (column("Frame"), column("Time"));
    let sheet = Sheet::new(input, Heading::plain(header, above, TAB, names));
    let (mut tracks, _) = sheet.tracks(frame.or(time), &bodies);
    if let (Some(frame), Some(time)) = (frame, time) {
        check_clock(&sheet, [frame, time], fps);
    }
    let is_by_time = frame.is_none() && time.is_some();
    count_frames(&mut tracks, if is_by_time { fps } else { 1.0 });
    for track in &mut tracks {
        for row in track.rows.iter_mut().filter(|row| row.x == 0.0 && row.y == 0.0) {
            row.lose();
            log.add(GAPS, row.line, format!("\"{}\" is at 0, 0: taken as a gap", track.name));
        }
    }
    let rows = tracks.first().map_or(0, |track| track.rows.len());
    if let Some((line, frames)) = frames.filter(|(_, frames)| *frames != rows as f64) {
        log.add(GAPS, line, format!("says {frames} frames, but there are {rows} rows"));
    }
    Some((input.one_shot(Clock::FramesAt(fps), tracks), Some(Unit::Mm)))
}

/// Counts the frames of all rows from the first row on: their times are frames at a `rate` of 1, else seconds.
fn count_frames(tracks: &mut [RawTrack], rate: f64) {
    let first = tracks.first().and_then(|track| track.rows.first()).map_or(0.0, |row| row.time);
    for row in tracks.iter_mut().flat_map(|track| &mut track.rows) {
        let frames = (row.time - first) * rate;
        // times are rounded to digits
        row.time = if rate == 1.0 { frames } else { frames.round() };
    }
}

/// Complains if the columns Frame and Time contradict each other at the stated rate.
fn check_clock(sheet: &Sheet, columns: [usize; 2], fps: f64) {
    let rows = Rows::of(sheet.text, &sheet.heading);
    let [Some(frames), Some(seconds)] = columns.map(|column| rows.numbers(column)) else { return };
    if let Some(row) = first_contradiction(&frames, &seconds, fps) {
        let message = format!(
            "Time is {} s, {} s after the first row, but Frame {} is {} frames after it, {:.6} s at FREQUENCY {fps}; expected times and \
             frames that agree",
            seconds[row],
            seconds[row] - seconds[0],
            frames[row],
            frames[row] - frames[0],
            (frames[row] - frames[0]) / fps
        );
        sheet.input.wrong(sheet.heading.above + 1 + row, "Time", message);
    }
}
