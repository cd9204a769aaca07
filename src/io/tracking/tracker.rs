//! Tracker: exports of one track or several (`#multi:`), and tables copied from it.

use std::collections::HashMap;
use std::path::Path;

use super::guess::pairs;
use super::heading::{Heading, TITLES};
use super::raw::{Clock, FORMAT, Notes, RawTrack};
use super::settings::{TimeUnit, TrackSettings, Unit};
use super::sheet::{Place, Sheet};
use super::words::{Kind, Role, find};
use crate::io::error::Problems;
use crate::io::number::{Cell, parse};
use crate::io::text::{Separator, lines, trimmed};

/// Names of the columns of time, the best first.
const TIMES: [&str; 3] = ["frame", "t", "time"];

/// The parts of an export above its rows.
pub(super) struct Head {
    heading: Heading,
    /// Names of tracks, each in the first of its columns.
    tracks: Vec<String>,
    multi: bool,
}

/// Whether the text is such an export.
pub(super) fn detect(text: &str) -> Option<Head> {
    let (mut multi, mut above) = (false, None);
    for (line, content) in lines(text).filter(|(_, content)| !content.trim().is_empty()).take(TITLES) {
        if content.trim_start().starts_with('#') {
            multi |= content.trim().trim_end_matches(':').eq_ignore_ascii_case("#multi");
            continue;
        }
        let fits = |separator: &Separator| {
            let Some(names) = trimmed(content, *separator) else { return false };
            let is_own = names.iter().any(|name| name.starts_with('x'));
            let names = small(&Heading::new("", line, *separator, names));
            let has = |name: &str| names.iter().any(|own| own == name);
            let is_long = || [Role::Ball, Role::Shot].into_iter().any(|role| find(&names, role).is_some());
            has("x") && has("y") && TIMES.iter().any(|t| has(t)) && !is_long()
                // other programs write both balls beside each other: X, Y, X 2, Y 2
                && (is_own || pairs(&names).iter().filter(|(_, kind)| *kind == Kind::Position).count() == 1)
        };
        if let Some(separator) = Separator::ALL.into_iter().find(fits) {
            let heading = Heading::new(text, line, separator, trimmed(content, separator)?);
            if are_several(text, &heading) {
                return None;
            }
            let tracks = above.and_then(|text| trimmed(text, separator)).unwrap_or_default();
            return Some(Head { heading, tracks, multi });
        }
        above = Some(content);
    }
    None
}

/// The names of columns without units, in small letters.
fn small(heading: &Heading) -> Vec<String> {
    heading.bare.iter().map(|name| name.to_lowercase()).collect()
}

/// Whether one pair of columns is at two places at the same time: several balls, below each other, which no export of Tracker is.
fn are_several(text: &str, heading: &Heading) -> bool {
    let names = small(heading);
    let of = |name: &str| names.iter().position(|own| own == name);
    let is_one = names.iter().filter(|name| *name == "x").count() == 1;
    let (Some(x), Some(y)) = (of("x").filter(|_| is_one), of("y")) else { return false };
    let Some(time) = TIMES.iter().find_map(|time| of(time)) else { return false };
    let rows = lines(text).skip(heading.above).filter_map(|(_, line)| {
        let mut row = trimmed(line, heading.separator).filter(|row| row.len() == names.len())?;
        let at =
            [x, y].map(|i| if let Ok(Cell::Number(number, _)) = parse(&row[i]) { number } else { f64::NAN });
        (at[0].is_finite() && at[1].is_finite()).then(|| (std::mem::take(&mut row[time]), at))
    });
    let rows: Vec<(String, [f64; 2])> = rows.collect();
    let mut last: HashMap<&str, usize> = HashMap::new();
    let (mut apart, mut beside) = (0, Vec::new());
    for (i, (time, at)) in rows.iter().enumerate() {
        match last.insert(time, i) {
            Some(before) if rows[before].1 == *at => {}
            Some(before) if before + 1 == i => beside.push(i),
            Some(_) => apart += 1,
            None => {}
        }
    }
    // a coarse clock shows a time twice, too: but then a ball is nearer after one row than after two
    let distance = |i: usize, j: usize| (rows[i].1[0] - rows[j].1[0]).hypot(rows[i].1[1] - rows[j].1[1]);
    let jumps = |i: &&usize| **i > 1 && distance(**i, **i - 1) > distance(**i, **i - 2);
    let alternate = beside.iter().filter(jumps).count();
    3 * (apart + alternate) > rows.len()
}

/// Reads the tracks of an export. `stem` names a track that has no name.
pub(super) fn read(
    file: &Path,
    text: &str,
    head: Head,
    stem: &str,
    settings: &TrackSettings,
    problems: &mut Problems,
    notes: &mut Notes,
) -> Option<(Clock, Vec<RawTrack>, Option<Unit>)> {
    let Head { heading, tracks, multi } = head;
    let (separator, header, names) = (heading.separator, heading.line, small(&heading));
    let position = |name: &str| names.iter().position(|n| n == name);
    // The number of a frame cannot follow a wrong rate, but needs the right one.
    let by_frame = settings.capture_fps.is_some() || !names.iter().any(|n| n == "t" || n == "time");
    let time = TIMES.iter().filter(|name| by_frame || **name != "frame").find_map(|name| position(name))?;
    let named = |column: usize| {
        tracks.iter().take(column + 1).rev().find(|name| !name.is_empty()).map_or(stem, String::as_str)
    };
    // Each track has its columns side by side, in any order.
    let starts: Vec<usize> = (0..tracks.len()).filter(|i| !tracks[*i].is_empty()).collect();
    let begin = |column: usize| starts.iter().copied().rev().find(|start| *start <= column);
    let mut places: Vec<Place> = Vec::new();
    let mut good = true;
    for (x, _) in names.iter().enumerate().filter(|(_, name)| *name == "x") {
        let ys: Vec<_> = (0..names.len()).filter(|y| names[*y] == "y" && begin(*y) == begin(x)).collect();
        let xs = (0..names.len()).filter(|i| names[*i] == "x" && begin(*i) == begin(x)).count();
        let [y] = ys.as_slice() else {
            let message = format!("track \"{}\" has {} columns y; expected one", named(x), ys.len());
            problems.add(file, Some(header), None, message);
            good = false;
            continue;
        };
        if xs > 1 {
            let message = format!(
                "{xs} columns x belong to the track \"{}\"; expected a name above the columns of each track",
                named(x)
            );
            problems.add(file, Some(header), None, message);
            return None;
        }
        places.push(Place { name: named(x).to_string(), point: None, x, y: *y });
    }
    if !good {
        return None;
    }
    let ignored: Vec<&str> = names
        .iter()
        .map(String::as_str)
        .filter(|name| !name.is_empty() && !["x", "y"].contains(name) && !TIMES.contains(name))
        .collect();
    let passed = if ignored.is_empty() {
        String::new()
    } else {
        format!("; columns passed over: {}", ignored.join(", "))
    };
    let found: Vec<_> = places.iter().map(|place| format!("\"{}\"", place.name)).collect();
    let kind = if multi { "Tracker (several tracks)" } else { "Tracker" };
    let message =
        format!("read as {kind}, {} between cells, tracks {}{passed}", separator.name(), found.join(", "));
    notes.add(FORMAT, file, None, message);
    let clock = if names[time] == "frame" {
        TimeUnit::Frames
    } else {
        heading.time(time, settings.time_unit, file, problems).unwrap_or(TimeUnit::S)
    };
    let lengths: Vec<usize> = places.iter().flat_map(|place| [place.x, place.y]).collect();
    let unit = heading.length(&lengths, file, problems);
    let sheet =
        Sheet { file, text, separator, header, above: heading.above, offset: 0, names: heading.names };
    let (tracks, shown) = sheet.wide(Some(time), places, problems, notes);
    Some((shown.unwrap_or(Clock::In(clock)), tracks, unit))
}
