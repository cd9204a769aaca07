//! Qualisys Track Manager: TSV with a block of keys above the rows.

use std::path::Path;

use super::raw::{Clock, FORMAT, GAPS, Notes, RawTrack};
use super::sheet::{Place, Sheet};
use crate::io::error::Problems;
use crate::io::number::{Cell, parse};
use crate::io::text::{Separator, lines, trimmed};

/// Whether the text is such an export.
pub(super) fn detect(text: &str) -> bool {
    lines(text)
        .find(|(_, line)| !line.trim().is_empty())
        .is_some_and(|(_, line)| ["NO_OF_FRAMES", "FILE_VERSION"].iter().any(|key| line.starts_with(key)))
}

pub(super) fn read(
    file: &Path,
    text: &str,
    problems: &mut Problems,
    notes: &mut Notes,
) -> Option<(Clock, Vec<RawTrack>)> {
    const TAB: Separator = Separator::Char('\t');
    let (mut markers, mut fps, mut frames) = (None, None, None);
    let mut names: Option<(usize, Vec<String>)> = None;
    let (mut above, mut width) = (0, 0);
    for (line, text) in lines(text) {
        let Some(row) = trimmed(text, TAB) else { break };
        match row[0].as_str() {
            "MARKER_NAMES" => {
                let named = row[1..].iter().filter(|name| !name.is_empty()).cloned();
                markers = Some((line, named.collect::<Vec<_>>()));
            }
            "FREQUENCY" | "NO_OF_FRAMES" => {
                let value = row.get(1).map_or("", String::as_str);
                let Some(Cell::Number(number, _)) = parse(value).ok().filter(|_| !value.is_empty()) else {
                    let message = format!("\"{value}\" is no number; expected one");
                    problems.add(file, Some(line), Some(&row[0]), message);
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
    let missing = |what: &str, problems: &mut Problems| {
        problems.add(
            file,
            None,
            None,
            format!("{what} is missing above the rows; expected an export of 3D markers"),
        );
    };
    let Some((line, markers)) = markers else {
        missing("MARKER_NAMES", problems);
        return None;
    };
    let Some((_, fps)) = fps.filter(|(_, fps)| *fps > 0.0) else {
        missing("FREQUENCY", problems);
        return None;
    };
    let (header, names) = names.unwrap_or_else(|| {
        // without a row of names: those that the format always has
        let counted = if width == 3 * markers.len() + 2 { &["Frame", "Time"][..] } else { &[] };
        let names = markers.iter().flat_map(|name| ["X", "Y", "Z"].map(|axis| format!("{name} {axis}")));
        (line, counted.iter().map(ToString::to_string).chain(names).collect())
    });
    let mut places = Vec::new();
    for name in &markers {
        let column = |axis: &str| names.iter().position(|n| *n == format!("{name} {axis}"));
        let (Some(x), Some(y)) = (column("X"), column("Y")) else {
            let message = format!("no columns \"{name} X\" and \"{name} Y\" for the marker \"{name}\"");
            problems.add(file, Some(header), None, message);
            return None;
        };
        places.push(Place { name: name.clone(), point: None, x, y });
    }
    let shown: Vec<_> = markers.iter().map(|name| format!("\"{name}\"")).collect();
    let message = format!("read as Qualisys, {fps} fps, markers {}", shown.join(", "));
    notes.add(FORMAT, file, None, message);
    let sheet = Sheet { file, text, separator: TAB, header, above, offset: 0, names };
    let (mut tracks, _) = sheet.wide(None, places, problems, notes);
    for track in &mut tracks {
        for row in track.rows.iter_mut().filter(|row| row.x == 0.0 && row.y == 0.0) {
            (row.x, row.y) = (f64::NAN, f64::NAN);
            notes.add(
                GAPS,
                file,
                Some(row.line as usize),
                format!("\"{}\" is at 0, 0: taken as a gap", track.name),
            );
        }
    }
    let rows = tracks.first().map_or(0, |track| track.rows.len());
    if let Some((line, frames)) = frames.filter(|(_, frames)| *frames != rows as f64) {
        notes.add(GAPS, file, Some(line), format!("says {frames} frames, but there are {rows} rows"));
    }
    Some((Clock::FramesAt(fps), tracks))
}
