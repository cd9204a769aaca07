//! Kinovea: text exports with a section per object, and CSV.

use std::path::Path;

use super::raw::{Clock, FORMAT, Notes, RawTrack, Row};
use super::sheet::{Place, Reader, Sheet};
use crate::io::error::Problems;
use crate::io::text::{Separator, cells, lines, trimmed};

/// Which of the two.
pub(super) enum Head {
    Text,
    Csv { separator: Separator, header: usize, names: Vec<String> },
}

const FILTERED: &str = "coordinates that come from its kinematics window are filtered, which smears an impact: \
                        export the trajectories themselves";

/// Whether the text is such an export.
pub(super) fn detect(text: &str) -> Option<Head> {
    let (header, first) = lines(text).find(|(_, line)| !line.trim().is_empty())?;
    let line = first.trim();
    if line.starts_with("#Kinovea") || line.eq_ignore_ascii_case("#T X Y") {
        return Some(Head::Text);
    }
    Separator::ALL.into_iter().find_map(|separator| {
        let names = trimmed(first, separator)?;
        let coordinate = |name: &&String| name.ends_with("/X") || name.ends_with("/Y");
        let fits =
            names.first().is_some_and(|name| name == "Time") && names.iter().any(|name| coordinate(&name));
        fits.then_some(Head::Csv { separator, header, names })
    })
}

pub(super) fn read(
    file: &Path,
    text: &str,
    head: Head,
    problems: &mut Problems,
    notes: &mut Notes,
) -> Option<(Clock, Vec<RawTrack>)> {
    match head {
        Head::Text => Some(sections(file, text, problems, notes)),
        Head::Csv { separator, header, names } => {
            csv(Sheet { file, text, separator, header, above: header, offset: 0, names }, problems, notes)
        }
    }
}

/// Rows of time, x and y below a comment with the object's name.
fn sections(file: &Path, text: &str, problems: &mut Problems, notes: &mut Notes) -> (Clock, Vec<RawTrack>) {
    let mut tracks: Vec<RawTrack> = Vec::new();
    let mut reader = Reader::new(file);
    let start = problems.len();
    for (line, text) in lines(text) {
        let text = text.trim();
        if text.is_empty() || text.starts_with("#Kinovea") || text.eq_ignore_ascii_case("#T X Y") {
            continue;
        }
        if problems.len() > start + 100 {
            break;
        }
        if let Some(name) = text.strip_prefix('#') {
            tracks.push(RawTrack::new(name.trim(), None));
            continue;
        }
        let row = cells(text, Separator::Blanks).unwrap_or_default();
        let [time, x, y] = row.as_slice() else {
            let message = format!("{} cells; expected 3, time, x and y", row.len());
            problems.add(file, Some(line), None, message);
            continue;
        };
        let found = problems.len();
        let Some(time) = reader.time(line, time, "T", problems) else {
            if problems.len() == found {
                problems.add(file, Some(line), Some("T"), format!("\"{time}\" is no time; expected one"));
            }
            continue;
        };
        let [x, y] = reader.position(line, [x, y], ["X", "Y"], problems, notes);
        if tracks.is_empty() {
            tracks.push(RawTrack::new("1", None));
        }
        if let Some(track) = tracks.last_mut() {
            track.rows.push(Row { time, x, y, line: line as u32 });
        }
    }
    tracks.retain(|track| !track.rows.is_empty());
    say(file, "text", &tracks, notes);
    let clock = reader.finish(tracks.iter_mut(), problems, notes).unwrap_or(Clock::Unsaid);
    (clock, tracks)
}

/// `Time`, `name/0/X`, `name/0/Y`, ….
fn csv(sheet: Sheet, problems: &mut Problems, notes: &mut Notes) -> Option<(Clock, Vec<RawTrack>)> {
    let mut places: Vec<Place> = Vec::new();
    let mut taken = vec![false; sheet.names.len()];
    for x in 1..sheet.names.len() {
        let Some(stem) = sheet.names[x].strip_suffix("/X") else { continue };
        let y_name = format!("{stem}/Y");
        let Some(y) = (1..sheet.names.len()).find(|y| !taken[*y] && sheet.names[*y] == y_name) else {
            let message = format!("the column {y_name} is missing");
            problems.add(sheet.file, Some(sheet.header), Some(&sheet.names[x]), message);
            return None;
        };
        taken[y] = true;
        places.push(Place { name: stem.to_string(), point: None, x, y });
    }
    // An object of one point is called by the object's name.
    let object = |name: &str| name.rsplit_once('/').map_or(name, |(object, _)| object).to_string();
    let objects: Vec<String> = places.iter().map(|place| object(&place.name)).collect();
    let full: Vec<String> = places.iter().map(|place| place.name.clone()).collect();
    for (i, place) in places.iter_mut().enumerate() {
        let alone = (0..full.len()).all(|j| objects[j] != objects[i] || full[j] == full[i]);
        if alone {
            place.name.clone_from(&objects[i]);
        }
    }
    let (tracks, clock) = sheet.wide(Some(0), places, problems, notes);
    say(sheet.file, &format!("CSV, {} between cells", sheet.separator.name()), &tracks, notes);
    Some((clock.unwrap_or(Clock::Unsaid), tracks))
}

fn say(file: &Path, kind: &str, tracks: &[RawTrack], notes: &mut Notes) {
    let names: Vec<_> = tracks.iter().map(|track| format!("\"{}\"", track.name)).collect();
    let message = format!("read as Kinovea ({kind}), tracks {}; {FILTERED}", names.join(", "));
    notes.add(FORMAT, file, None, message);
}
