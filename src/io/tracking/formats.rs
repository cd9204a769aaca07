//! Formats of tables that are recognised by their content.

use super::heading::{Heading, MAX_TRACKS, Rows};
use super::raw::{Job, Stated, stem};
use super::reader::{Body, Layout};
use super::settings::Format;
use super::words::{BALLS, Kind, SHOTS, Unit, find, pairs};
use crate::io::error::{Subject, listed, message};
use crate::io::table::near_miss;
use crate::io::text::{Separator, filled_lines, lines, parse, trimmed, value};

/// Returns the layout of a file that begins so; `None` for another format, or with a problem.
type Detect = fn(&[Heading], Job) -> Option<Layout>;

pub(super) const FORMATS: [(Format, Detect); 4] = [
    (Format::Qualisys, qualisys),
    (Format::Kinovea, kinovea),
    (Format::Long, long),
    (Format::Tracker, tracker),
];

/// Beginning of exports of Motive (OptiTrack), whose height is y.
pub(super) const MOTIVE: &str = "Format Version";
/// The columns of the canonical table, a row per ball and frame.
const LONG: [&str; 10] = ["shot", "frame", "t", "ball", "x", "y", "z", "point", "x_sd", "y_sd"];

fn long(headings: &[Heading], job: Job) -> Option<Layout> {
    let is_long = |heading: &&Heading| {
        let has_all = ["ball", "x", "y"].into_iter().all(|name| heading.at(name).is_some());
        !heading.is_comment && has_all && heading.at("frame").or(heading.at("t")).is_some()
    };
    let heading = headings.iter().find(is_long)?.clone();
    for name in heading.own.iter().filter(|name| !LONG.contains(&name.as_str())) {
        if let Some(advice) = near_miss(name, &LONG, |name| heading.at(name).is_some()) {
            job.wrong(heading.line, name.as_str(), format!("{advice}, or another name"));
            return None;
        }
    }
    if heading.at("x_sd").is_some() != heading.at("y_sd").is_some() {
        return job.refuse(heading.line, "x_sd and y_sd go together; expected both, or leave both out");
    }
    if !heading.has_once(&LONG, &heading.own, job) {
        return None;
    }
    let at = |name: &str| heading.at(name).filter(|_| LONG.contains(&name));
    let shot = at("shot");
    let time = heading.clock([at("frame"), at("t"), shot], job);
    let bodies = Body::of_keys("", "", |_| None, at)?;
    Some(Layout { shot, ball: at("ball"), ..Layout::new(Format::Long, heading, bodies, time, job) })
}

/// Finds exports of Tracker: of one track, or of several beside or below each other.
fn tracker(headings: &[Heading], job: Job) -> Option<Layout> {
    let is_of_tracks = |heading: &&Heading| {
        let has_any = |any: &[&str]| any.iter().any(|name| heading.at(name).is_some());
        let has_columns = has_any(&["x"]) && has_any(&["y"]) && has_any(&["frame", "t", "time"]);
        let is_long = [BALLS, SHOTS].into_iter().any(|role| find(&heading.own, role).is_some());
        // other programs write both balls beside each other: X, Y, X 2, Y 2
        let are_two = has_any(&["x2", "x 2", "x_2", "x.1"]);
        let is_position = |pair: &&([usize; 2], Kind)| pair.1 == Kind::Position;
        let is_single = || pairs(&heading.own).iter().filter(is_position).count() == 1;
        !heading.is_comment && has_columns && !is_long && (!are_two || is_single())
    };
    let heading = headings.iter().find(is_of_tracks).filter(|_| !job.text.starts_with(MOTIVE))?.clone();
    let time = heading.clock([heading.at("frame"), heading.at("t").or(heading.at("time")), None], job)?;
    let is_position = |pair: &[usize; 2]| pair.map(|column| heading.own[column].as_str()) == ["x", "y"];
    let positions = pairs(&heading.small()).into_iter().map(|(pair, _)| pair).filter(is_position);
    let positions: Vec<[usize; 2]> = positions.collect();
    // each track was copied below the last
    let header = lines(job.text).nth(heading.line - 1).map_or("", |(_, line)| line.trim_end());
    let heads = lines(job.text).filter(|(_, line)| line.trim_end() == header);
    let heads: Vec<usize> = heads.map(|(line, _)| line).collect();
    let are_below = heads.len() > 1;
    // several balls below each other
    let are_several = || Rows::of(job.text, &heading).are_shared(time.0, None, MAX_TRACKS);
    if !are_below && positions.len() == 1 && are_several() {
        return None;
    }
    let is_number = |cell: &str| !cell.is_empty() && value(cell).is_some();
    let is_row = |line: &str| line.split([',', ';', '\t', ' ']).any(is_number);
    let mut bodies: Vec<Body> = Vec::new();
    for (i, header) in heads.into_iter().enumerate() {
        let title = filled_lines(job.text).take_while(|(line, _)| *line < header).last();
        let (begin, title) = title.filter(|(_, line)| i == 0 || !is_row(line)).unwrap_or((header, ""));
        let title = title.trim_matches(|c: char| c.is_whitespace() || "#,;|\"".contains(c));
        let above = heading.above + header - heading.line;
        bodies.extend(positions.iter().map(|xy| {
            // of several beside each other, those above have been put before the x
            let beside = heading.bare[xy[0]].trim_end_matches(['x', 'X']).trim_end();
            let name = match [beside, title] {
                ["", ""] if are_below => (i + 1).to_string(),
                ["", ""] => stem(job.file).into_owned(),
                ["", title] => title.to_owned(),
                [beside, _] => beside.to_owned(),
            };
            Body { begin, above, ..Body::new(name, *xy) }
        }));
    }
    Some(Layout::new(Format::Tracker, heading, bodies, Some(time), job))
}

/// Finds exports of Kinovea: a section per object, or CSV with `Time`, `name/0/X`, `name/0/Y`, ….
fn kinovea(headings: &[Heading], job: Job) -> Option<Layout> {
    let (line, first) = filled_lines(job.text).next()?;
    if is_kinovea_title(first.trim()) {
        return Some(sections(job));
    }
    let is_csv = |heading: &&Heading| {
        let is_time = heading.own.first().is_some_and(|name| name == "time");
        heading.line == line && is_time && heading.names.iter().any(|name| name.ends_with("/X"))
    };
    let heading = headings.iter().find(is_csv)?.clone();
    let body = |([x, y], _): ([usize; 2], Kind)| {
        let stem = heading.bare[x].strip_suffix("/X")?;
        // an object of one point is called by the object's name
        let object = stem.rsplit_once('/').map_or(stem, |(object, _)| object);
        let is_of_object = |name: &&String| name.ends_with("/X") && name.starts_with(&format!("{object}/"));
        let points = heading.bare.iter().filter(is_of_object).count();
        Some(Body::new(if points > 1 { stem } else { object }, [x, y]))
    };
    let bodies = pairs(&heading.small()).into_iter().filter_map(body).collect();
    let has_unit = heading.units[0].is_some();
    let layout = Layout::new(Format::Kinovea, heading, bodies, Some((0, false)), job);
    let time = layout.stated.time.filter(|_| has_unit);
    Some(Layout { stated: Stated { time, unit: None, ..layout.stated }, ..layout })
}

fn is_kinovea_title(line: &str) -> bool {
    line.starts_with("#Kinovea") || line.eq_ignore_ascii_case("#T X Y")
}

/// Finds sections below a comment with the object's name or, in old versions, below a blank line.
fn sections(job: Job) -> Layout {
    let mut bodies: Vec<Body> = Vec::new();
    let (mut unnamed, mut is_apart) = (0, true);
    for (line, text) in lines(job.text).map(|(line, text)| (line, text.trim())) {
        if text.is_empty() || is_kinovea_title(text) {
            // a blank line may follow a name
            is_apart = bodies.last().is_none_or(|body| body.above + 1 < line);
        } else if let Some(name) = text.strip_prefix('#') {
            bodies.push(Body { begin: line, above: line, ..Body::new(name.trim(), [1, 2]) });
            is_apart = false;
        } else if std::mem::take(&mut is_apart) {
            unnamed += 1;
            bodies.push(Body { begin: line, above: line - 1, ..Body::new(unnamed.to_string(), [1, 2]) });
        }
    }
    let names = ["T", "X", "Y"].map(str::to_string).to_vec();
    let heading = Heading::plain(1, 1, None, names);
    let layout = Layout::new(Format::Kinovea, heading, bodies, Some((0, true)), job);
    Layout { stated: Stated { time: None, ..layout.stated }, ..layout }
}

/// Finds exports of Qualisys Track Manager: keys above the rows, three columns for each marker.
fn qualisys(_: &[Heading], job: Job) -> Option<Layout> {
    const TAB: Separator = Some('\t');
    let (_, first) = filled_lines(job.text).next()?;
    if !["NO_OF_FRAMES", "FILE_VERSION"].iter().any(|key| first.starts_with(key)) {
        return None;
    }
    let mut header: Vec<Vec<String>> = Vec::new();
    let mut rows = lines(job.text).map_while(|(_, text)| trimmed(text, TAB)).peekable();
    // the first row may begin with a gap
    let is_row = |header: &[Vec<String>], row: &[String]| {
        header.iter().any(|above| above[0] == "MARKER_NAMES") && row.len() > 1 && parse(&row[0]).is_ok()
    };
    while let Some(row) = rows.next_if(|row| !is_row(&header, row)) {
        header.push(row);
    }
    let values = |key: &str| header.iter().find(|row| row[0] == key).map(|row| &row[1..]);
    let number = |key: &str| value(values(key)?.first()?);
    let fps = number("FREQUENCY").filter(|fps| *fps > 0.0);
    let (Some(markers), Some(fps)) = (values("MARKER_NAMES"), fps) else {
        let key = if values("MARKER_NAMES").is_none() { "MARKER_NAMES" } else { "FREQUENCY" };
        let message = format!("{key} is missing above the rows; expected an export of 3D markers");
        return job.refuse(None, message);
    };
    let markers: Vec<&String> = markers.iter().filter(|name| !name.is_empty()).collect();
    let width =
        rows.peek().map_or(0, |row| row.len() - usize::from(row.last().is_some_and(String::is_empty)));
    let is_counted = values("Frame").is_some() || width == 3 * markers.len() + 2;
    let counts = if is_counted { &["Frame", "Time"][..] } else { &[] };
    let names = markers.iter().flat_map(|name| ["X", "Y", "Z"].map(|axis| format!("{name} {axis}")));
    let names: Vec<String> = counts.iter().map(ToString::to_string).chain(names).collect();
    let is_of_names =
        |row: &&Vec<String>| row[0] != "MARKER_NAMES" && row.iter().any(|cell| cell.ends_with(" X"));
    if let Some(row) = header.iter().rev().find(is_of_names).filter(|row| !row.starts_with(&names)) {
        let (found, expected) = (listed(&row[..row.len().min(names.len())]), listed(&names));
        return job.refuse(header.len(), message!("other_columns", found, expected));
    }
    let heading = Heading::plain(header.len(), header.len(), TAB, names);
    let columns = (counts.len()..).step_by(3);
    let bodies = markers.iter().zip(columns).map(|(name, x)| Body::new(*name, [x, x + 1])).collect();
    if is_counted {
        heading.check_clock([0, 1], None, fps, job);
    }
    let rows = heading.lines_below(job.text).count();
    if let Some(stated) = number("NO_OF_FRAMES").filter(|stated| *stated != rows as f64) {
        let message = format!("says {stated} frames, but there are {rows} rows");
        job.note(Subject::Gaps, None, message);
    }
    let layout = Layout::new(Format::Qualisys, heading, bodies, is_counted.then_some((0, true)), job);
    let stated = Stated { unit: Some(Unit::Mm), fps: Some(fps), ..layout.stated };
    Some(Layout { stated, ..layout })
}
