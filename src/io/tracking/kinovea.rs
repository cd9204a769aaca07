//! Kinovea: text exports with a section per object, and CSV.

use super::heading::Heading;
use super::input::{Input, Shots, quoted};
use super::raw::{Clock, FORMAT, RawTrack, Row};
use super::sheet::{At, Body, ENOUGH, Reader, Sheet};
use crate::io::text::{Separator, cells, filled_lines, lines, trimmed};

/// Which of the two.
pub(super) enum Head {
    Text,
    Csv(Heading),
}

const FILTERED: &str = "coordinates that come from its kinematics window are filtered, which smears an impact: \
                        export the trajectories themselves";

/// Whether the text is such an export.
pub(super) fn detect(text: &str) -> Option<Head> {
    let (line, first) = filled_lines(text).next()?;
    if is_title(first.trim()) {
        return Some(Head::Text);
    }
    Separator::ALL.into_iter().find_map(|separator| {
        let names = trimmed(first, separator)?;
        let is_coordinate = |name: &String| name.ends_with("/X") || name.ends_with("/Y");
        let heading = Heading::new("", line, separator, names);
        let is_time = heading.bare.first().is_some_and(|name| name == "Time");
        (is_time && heading.names.iter().any(is_coordinate)).then_some(Head::Csv(heading))
    })
}

/// Whether a line stands above the sections of a text.
fn is_title(line: &str) -> bool {
    line.starts_with("#Kinovea") || line.eq_ignore_ascii_case("#T X Y")
}

pub(super) fn read(input: &Input, head: Head) -> Option<Shots> {
    let mut stated = Clock::Unsaid;
    let (tracks, clock) = match head {
        Head::Text => sections(input),
        Head::Csv(heading) => {
            if heading.has_unit(0) {
                stated = Clock::In(heading.time(0, input));
            }
            csv(input, heading)?
        }
    };
    Some((input.one_shot(clock.unwrap_or(stated), tracks), None))
}

fn say(input: &Input, kind: &str, tracks: &[RawTrack]) {
    let names = quoted(tracks.iter().map(|track| &track.name));
    input.log.add(FORMAT, None, format!("read as Kinovea ({kind}), tracks {names}; {FILTERED}"));
}

type Read = (Vec<RawTrack>, Option<Clock>);

/// Rows of time, x and y below a comment with the object's name or, where old versions name none, below a blank line.
fn sections(input: &Input) -> Read {
    let mut tracks: Vec<RawTrack> = Vec::new();
    let (mut unnamed, mut apart) = (0, true);
    let mut reader = Reader::new(input);
    let start = input.problems.len();
    for (line, text) in lines(input.text).map(|(line, text)| (line, text.trim())) {
        if text.is_empty() || is_title(text) {
            apart = true;
            continue;
        }
        if input.problems.len() > start + ENOUGH {
            break;
        }
        if let Some(name) = text.strip_prefix('#') {
            tracks.push(RawTrack::new(name.trim(), None));
            apart = false;
            continue;
        }
        let row = cells(text, Separator::Blanks).unwrap_or_default();
        let [time, x, y] = row.as_slice() else {
            input.wrong(line, None, format!("{} cells; expected 3, time, x and y", row.len()));
            continue;
        };
        let found = input.problems.len();
        let Some(time) = reader.time(input.cell(line, "T", time)) else {
            if input.problems.len() == found {
                input.wrong(line, "T", format!("\"{time}\" is no time; expected one"));
            }
            continue;
        };
        let [x, y] = reader.position([input.cell(line, "X", x), input.cell(line, "Y", y)]);
        // a blank line inside a section does not begin one
        let begins = |track: &RawTrack| track.rows.last().is_some_and(|row| row.time >= time);
        if std::mem::take(&mut apart) && tracks.last().is_none_or(begins) {
            unnamed += 1;
            tracks.push(RawTrack::new(format!("{unnamed}"), None));
        }
        if let Some(track) = tracks.last_mut() {
            track.rows.push(Row { time, x, y, line });
        }
    }
    tracks.retain(|track| !track.rows.is_empty());
    say(input, "text", &tracks);
    let clock = reader.finish(tracks.iter_mut());
    (tracks, clock)
}

/// `Time`, `name/0/X`, `name/0/Y`, ….
fn csv(input: &Input, heading: Heading) -> Option<Read> {
    let (names, mut bodies) = (&heading.names, Vec::<Body>::new());
    for x in 1..names.len() {
        let Some(stem) = names[x].strip_suffix("/X") else { continue };
        let y_name = format!("{stem}/Y");
        let is_free = |y: &usize| bodies.iter().all(|body| body.at.y != *y);
        let Some(y) = (1..names.len()).find(|y| names[*y] == y_name && is_free(y)) else {
            let message = format!("the column {y_name} is missing");
            input.wrong(heading.line, names[x].as_str(), message);
            return None;
        };
        bodies.push(Body { name: stem.to_string(), at: At::plain(x, y) });
    }
    // an object of one point is called by the object's name
    let object = |name: &str| name.rsplit_once('/').map_or(name, |(object, _)| object).to_string();
    let full: Vec<String> = bodies.iter().map(|body| body.name.clone()).collect();
    for body in &mut bodies {
        let object_of = object(&body.name);
        if full.iter().all(|other| *other == body.name || object(other) != object_of) {
            body.name = object_of;
        }
    }
    let kind = format!("CSV, {} between cells", heading.separator.name());
    let (tracks, clock) = Sheet::new(input, heading).tracks(Some(0), &bodies);
    say(input, &kind, &tracks);
    Some((tracks, clock))
}
