//! Formats of tables that are recognised by their content.

use std::collections::HashMap;

use super::clock::seconds;
use super::heading::{Heading, Top};
use super::input::Input;
use super::layout::{Block, Body, Layout, Name};
use super::raw::Clock;
use super::sample::Rows;
use super::settings::Format;
use super::units::Unit;
use super::words::{Kind, Role, boxes, find, pairs};
use crate::io::number::{parse, value};
use crate::io::rows::near_miss;
use crate::io::text::{Separator, filled_lines, lines, trimmed};

/// Returns the layout of a file that begins with these lines; `None` if it is in another format or,
/// with a problem, faulty.
type Detect = fn(&[Top], &Input) -> Option<Layout>;

pub(super) const FORMATS: [(Format, Detect); 4] = [
    (Format::Qualisys, qualisys),
    (Format::Kinovea, kinovea),
    (Format::Long, long),
    (Format::Tracker, tracker),
];

/// The columns of the canonical table, a row per ball and frame.
const LONG: [&str; 10] = ["shot", "frame", "t", "ball", "x", "y", "z", "point", "x_sd", "y_sd"];

fn long(tops: &[Top], input: &Input) -> Option<Layout> {
    let is_long = |heading: &Heading| {
        let has = |name: &str| heading.position(name).is_some();
        ["ball", "x", "y"].into_iter().all(has) && (has("frame") || has("t"))
    };
    let heading = tops.iter().filter(|top| !top.is_comment()).find_map(|top| {
        let names: Vec<String> = top.names.iter().map(|name| name.to_lowercase()).collect();
        // most lines are no header: looked at more closely only if it may be one
        let may_be = names.iter().any(|name| name == "ball");
        may_be.then(|| Heading::new(input.text, top, names)).filter(is_long)
    })?;
    let before = input.problems.len();
    heading.complain_of_twins(LONG, input);
    let has = |name: &str| heading.bare.iter().any(|own| own == name);
    for name in heading.bare.iter().filter(|name| !LONG.contains(&name.as_str())) {
        if let Some(meant) = near_miss(name, &LONG, has) {
            let message = format!(
                "is not a known name, but nearly {meant}; write {meant}, or give the column another name"
            );
            input.wrong(heading.line, name.as_str(), message);
        }
    }
    if has("x_sd") != has("y_sd") {
        input.wrong(heading.line, None, "x_sd and y_sd go together; expected both or neither");
    }
    let at = |name: &str| heading.position(name).filter(|_| LONG.contains(&name));
    let (shot, time) = (at("shot"), time(at, input));
    let body = Body::of_keys(Name::Column(at("ball")?), "", at)?;
    let block = Block::below(&heading, vec![body]);
    let layout = Layout { shot, ..Layout::new(Format::Long, heading, vec![block], time, input) };
    (input.problems.len() == before).then_some(layout)
}

/// Returns the column of times, and whether it holds numbers of frames.
pub(super) fn time(at: impl Fn(&str) -> Option<usize>, input: &Input) -> Option<(usize, bool)> {
    let (frame, time) = (at("frame"), at("t").or_else(|| at("time")));
    let frame = frame.filter(|_| input.is_by_frame() || time.is_none());
    Some((frame.or(time)?, frame.is_some()))
}

/// Finds exports of Tracker: of one track, or of several beside or below each other.
fn tracker(tops: &[Top], input: &Input) -> Option<Layout> {
    let top = tops.iter().find(|top| !top.is_comment() && is_tracker(top))?;
    let heading = Heading::new(input.text, top, top.names.clone());
    let names = heading.small();
    let at = |name: &str| names.iter().position(|own| own == name);
    let time = time(at, input)?;
    // each track was copied below the last
    let mut heads: Vec<usize> = vec![heading.line];
    let first = heading.names[0].as_str();
    let is_head = |line: &str| {
        line.contains(first) && trimmed(line, heading.separator).as_ref() == Some(&heading.names)
    };
    heads.extend(
        lines(input.text).skip(heading.above).filter(|(_, line)| is_head(line)).map(|(line, _)| line),
    );
    // several balls below each other
    let are_two = || Rows::of(input.text, &heading).are_pairs(time.0, None);
    if heads.len() == 1 && names.iter().filter(|name| *name == "x").count() == 1 && are_two() {
        return None;
    }
    let mut blocks = Vec::new();
    for (i, header) in heads.iter().copied().enumerate() {
        let above = heading.above + header - heading.line;
        let (tracks, last) = if heads.len() == 1 {
            let title = tops.iter().rev().find(|other| other.line < top.line && !other.is_comment());
            let title = title.and_then(|title| trimmed(title.content, heading.separator));
            (title.unwrap_or_default(), usize::MAX)
        } else {
            let name = title(input.text, header).map_or("", |(_, title)| title);
            let name = name.trim_matches(|c: char| c.is_whitespace() || "#,;\"".contains(c));
            let name = if name.is_empty() { (i + 1).to_string() } else { name.to_string() };
            let next = heads.get(i + 1).map(|next| title(input.text, *next).map_or(*next, |(line, _)| line));
            (vec![name], next.map_or(usize::MAX, |next| next - 1))
        };
        blocks.push(Block { header, above, last, bodies: tracked(&names, &tracks, header, input)? });
    }
    Some(Layout::new(Format::Tracker, heading, blocks, Some(time), input))
}

fn is_tracker(top: &Top) -> bool {
    let names = top.small();
    let has = |name: &str| names.iter().any(|own| own == name);
    if !(has("x") && has("y") && ["frame", "t", "time"].into_iter().any(has)) {
        return false;
    }
    let is_long = [Role::Ball, Role::Shot].into_iter().any(|role| find(&names, role).is_some())
        || !boxes(&names, false).is_empty();
    // other programs write both balls beside each other: X, Y, X 2, Y 2
    let begins_with_x = top.names.iter().any(|name| name.starts_with('x'));
    let is_single = begins_with_x && !["x2", "x 2", "x_2"].into_iter().any(has);
    let positions = || pairs(&names).iter().filter(|(_, kind)| *kind == Kind::Position).count();
    !is_long && (is_single || positions() == 1)
}

fn title(text: &str, head: usize) -> Option<(usize, &str)> {
    let (line, title) = filled_lines(text).take_while(|(line, _)| *line < head).last()?;
    let is_number = |cell: &str| !cell.is_empty() && value(cell).is_some();
    (!title.split([',', ';', '\t', ' ']).any(is_number)).then_some((line, title))
}

/// Finds the columns of tracks by their names, each above its first column; a track without a name
/// is named after the file.
fn tracked(names: &[String], tracks: &[String], header: usize, input: &Input) -> Option<Vec<Body>> {
    // each track has its columns side by side, in any order
    let begin = |column: usize| (0..tracks.len().min(column + 1)).rev().find(|i| !tracks[*i].is_empty());
    let mut bodies: Vec<Body> = Vec::new();
    for x in (0..names.len()).filter(|i| names[*i] == "x") {
        let name = begin(x).map_or(input.stem, |i| tracks[i].as_str());
        let beside = |axis: &str| -> Vec<usize> {
            (0..names.len()).filter(|i| names[*i] == axis && begin(*i) == begin(x)).collect()
        };
        let (xs, ys) = (beside("x"), beside("y"));
        let ([_], [y]) = (xs.as_slice(), ys.as_slice()) else {
            let message = format!(
                "track \"{name}\" has {} columns x and {} columns y; expected one of each, and a name above the columns of each track",
                xs.len(),
                ys.len()
            );
            input.wrong(header, None, message);
            return None;
        };
        bodies.push(Body::new(name, [x, *y]));
    }
    Some(bodies)
}

/// Finds exports of Kinovea: text with a section per object, or CSV with the columns `Time`,
/// `name/0/X`, `name/0/Y`, ….
fn kinovea(tops: &[Top], input: &Input) -> Option<Layout> {
    let first = tops.first()?;
    if is_kinovea_title(first.content.trim()) {
        return Some(sections(input));
    }
    let is_coordinate = |name: &String| name.ends_with("/X") || name.ends_with("/Y");
    let is_csv = |top: &&Top| {
        let is_time = top.small().first().is_some_and(|name| name == "time");
        top.line == first.line && is_time && top.names.iter().any(is_coordinate)
    };
    let top = tops.iter().find(is_csv)?;
    let heading = Heading::new("", top, top.names.clone());
    let names = &heading.names;
    let mut stems: Vec<(&str, [usize; 2])> = Vec::new();
    for x in 1..names.len() {
        let Some(stem) = names[x].strip_suffix("/X") else { continue };
        let y_name = format!("{stem}/Y");
        let Some(y) = (x + 1..names.len()).find(|y| names[*y] == y_name) else {
            input.wrong(heading.line, names[x].as_str(), format!("the column {y_name} is missing"));
            return None;
        };
        stems.push((stem, [x, y]));
    }
    // an object of one point is called by the object's name
    let object = |stem: &'_ str| stem.rsplit_once('/').map_or(stem, |(object, _)| object).to_string();
    let is_only = |stem: &str| stems.iter().all(|(other, _)| *other == stem || object(other) != object(stem));
    let bodies = stems.iter().map(|(stem, xy)| {
        let name = if is_only(stem) { object(stem) } else { (*stem).to_string() };
        Body::new(name, *xy)
    });
    let block = Block::below(&heading, bodies.collect());
    let has_unit = heading.has_unit(0);
    let layout = Layout::new(Format::Kinovea, heading, vec![block], Some((0, false)), input);
    Some(Layout { clock: if has_unit { layout.clock } else { Clock::Unsaid }, unit: None, ..layout })
}

fn is_kinovea_title(line: &str) -> bool {
    line.starts_with("#Kinovea") || line.eq_ignore_ascii_case("#T X Y")
}

/// Finds the sections: rows of time, x and y below a comment with the object's name or, in old
/// versions, below a blank line.
fn sections(input: &Input) -> Layout {
    let mut blocks: Vec<Block> = Vec::new();
    let (mut title, mut unnamed, mut is_apart, mut is_filled) = (1, 0, true, true);
    // time of the last row of the section
    let mut before: Option<f64> = None;
    for (line, text) in lines(input.text).map(|(line, text)| (line, text.trim())) {
        if text.is_empty() || is_kinovea_title(text) {
            is_apart = true;
            title = if text.is_empty() { title } else { line };
        } else if let Some(name) = text.strip_prefix('#') {
            begin_section(&mut blocks, is_filled, [title, line], name.trim());
            (is_apart, is_filled, before) = (false, false, None);
        } else {
            let row: Vec<&str> = text.split_whitespace().collect();
            let time = seconds(row[0]).map(|(time, _)| time).or_else(|| value(row[0]));
            // a blank line inside a section does not begin one
            let is_earlier = before.zip(time).is_some_and(|(before, time)| before >= time);
            if blocks.is_empty() || is_apart && is_earlier {
                unnamed += 1;
                begin_section(&mut blocks, true, [title, line - 1], &unnamed.to_string());
            }
            if row.len() == 3 && time.is_some() {
                (is_apart, before) = (false, time);
            }
            is_filled = true;
        }
    }
    if !is_filled {
        blocks.pop();
    }
    let names = ["T", "X", "Y"].map(str::to_string).to_vec();
    let heading = Heading::plain(1, 1, Separator::Blanks, names);
    let layout = Layout::new(Format::Kinovea, heading, blocks, Some((0, true)), input);
    Layout { has_all_cells: true, clock: Clock::Unsaid, ..layout }
}

/// Ends the section above, which is none without rows, and begins another one.
fn begin_section(blocks: &mut Vec<Block>, is_filled: bool, [header, above]: [usize; 2], name: &str) {
    if !is_filled {
        blocks.pop();
    } else if let Some(last) = blocks.last_mut() {
        last.last = above;
    }
    blocks.push(Block { header, above, last: usize::MAX, bodies: vec![Body::new(name, [1, 2])] });
}

/// Finds exports of Qualisys Track Manager: keys above the rows, three columns for each marker.
fn qualisys(tops: &[Top], input: &Input) -> Option<Layout> {
    const TAB: Separator = Separator::Char('\t');
    let first = tops.first()?.content;
    if !["NO_OF_FRAMES", "FILE_VERSION"].iter().any(|key| first.starts_with(key)) {
        return None;
    }
    let mut keys: HashMap<String, (usize, Vec<String>)> = HashMap::new();
    let (mut named, mut above, mut width) = (None, 0, 0);
    for (line, text) in lines(input.text) {
        let Some(mut row) = trimmed(text, TAB) else { break };
        // the first row, which may begin with a gap
        if keys.contains_key("MARKER_NAMES") && row.len() > 1 && parse(&row[0]).is_ok() {
            width = row.len() - usize::from(row.last().is_some_and(String::is_empty));
            break;
        }
        if row.iter().any(|cell| cell.ends_with(" X")) && row[0] != "MARKER_NAMES" {
            named = Some((line, row));
        } else {
            keys.insert(row.remove(0), (line, row));
        }
        above = line;
    }
    let missing = |key: &str| {
        let message = format!("{key} is missing above the rows; expected an export of 3D markers");
        input.wrong(None, None, message);
    };
    let Some((line, mut markers)) = keys.remove("MARKER_NAMES") else {
        missing("MARKER_NAMES");
        return None;
    };
    let number = |key: &str| keys.get(key).and_then(|(_, cells)| value(cells.first()?));
    let Some(fps) = number("FREQUENCY").filter(|fps| *fps > 0.0) else {
        missing("FREQUENCY");
        return None;
    };
    markers.retain(|name| !name.is_empty());
    let (header, names) = named.unwrap_or_else(|| {
        // without a row of names: the columns of the format
        let counted = if width == 3 * markers.len() + 2 { &["Frame", "Time"][..] } else { &[] };
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
    let (frame, time) = (column("Frame"), column("Time"));
    let heading = Heading::plain(header, above, TAB, names);
    if let (Some(frame), Some(time)) = (frame, time) {
        Rows::of(input.text, &heading).check_clock(&heading, [frame, time], fps, input);
    }
    let block = Block::below(&heading, bodies);
    let time = frame.map(|frame| (frame, true)).or(time.map(|time| (time, false)));
    let layout = Layout::new(Format::Qualisys, heading, vec![block], time, input);
    Some(Layout { unit: Some(Unit::Mm), clock: Clock::FramesAt(fps), rows: number("NO_OF_FRAMES"), ..layout })
}
