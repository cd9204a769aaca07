//! Tracker: exports of one track or several (`#multi:`), and tables copied from it.

use std::collections::HashMap;

use super::heading::{Heading, TITLES};
use super::input::{Input, quoted};
use super::layout::{Block, Body, Layout};
use super::raw::FORMAT;
use super::words::{Kind, Role, boxes, find, pairs};
use crate::io::number::value;
use crate::io::text::{Separator, filled_lines, lines, trimmed};

/// Names of the columns of time, the best first.
const TIMES: [&str; 3] = ["frame", "t", "time"];

pub(super) fn layout(input: &Input) -> Option<Layout> {
    let (mut is_multi, mut above) = (false, None);
    for (line, content) in filled_lines(input.text).take(TITLES) {
        if content.trim_start().starts_with('#') {
            is_multi |= content.trim().trim_end_matches(':').eq_ignore_ascii_case("#multi");
            continue;
        }
        let found = Separator::ALL.into_iter().find_map(|separator| {
            let names = trimmed(content, separator)?;
            is_header(&names, line, separator).then_some((separator, names))
        });
        if let Some((separator, names)) = found {
            let heading = Heading::new(input.text, line, separator, names);
            let heads = repeated(input.text, &heading);
            if are_several(input.text, &heading, heads.first().copied()) {
                return None;
            }
            let tracks = above.and_then(|text| trimmed(text, separator)).unwrap_or_default();
            return columns(heading, tracks, heads, is_multi, input);
        }
        above = Some(content);
    }
    None
}

/// Returns whether a line holds the names of an export's columns.
fn is_header(names: &[String], line: usize, separator: Separator) -> bool {
    let begins_with_x = names.iter().any(|name| name.starts_with('x'));
    let names = Heading::new("", line, separator, names.to_vec()).small();
    let has = |name: &str| names.iter().any(|own| own == name);
    if !(has("x") && has("y") && TIMES.iter().any(|time| has(time))) {
        return false;
    }
    let is_long = [Role::Ball, Role::Shot].into_iter().any(|role| find(&names, role).is_some())
        || !boxes(&names, false).is_empty();
    // other programs write both balls beside each other: X, Y, X 2, Y 2
    let is_single = begins_with_x && !["x2", "x 2", "x_2"].iter().any(|second| has(second));
    let positions = || pairs(&names).iter().filter(|(_, kind)| *kind == Kind::Position).count();
    !is_long && (is_single || positions() == 1)
}

/// Returns whether one pair of columns is at two places at the same time: several balls below each
/// other, which is not an export of Tracker. `next`: the line that repeats the header.
fn are_several(text: &str, heading: &Heading, next: Option<usize>) -> bool {
    let names = heading.small();
    let at = |name: &str| names.iter().position(|own| own == name);
    let is_one = names.iter().filter(|name| *name == "x").count() == 1;
    let (Some(x), Some(y)) = (at("x").filter(|_| is_one), at("y")) else { return false };
    let Some(time) = TIMES.iter().find_map(|time| at(time)) else { return false };
    let mut rows: Vec<(String, [f64; 2])> = Vec::new();
    for (_, line) in lines(text).take(next.map_or(usize::MAX, |next| next - 1)).skip(heading.above) {
        let row = trimmed(line, heading.separator).filter(|row| row.len() == names.len());
        let Some(mut row) = row else { continue };
        if let (Some(x), Some(y)) = (value(&row[x]), value(&row[y])) {
            rows.push((row.swap_remove(time), [x, y]));
        }
    }
    // a coarse clock also repeats times, but then a ball is nearer after one row than after two
    let distance = |i: usize, j: usize| (rows[i].1[0] - rows[j].1[0]).hypot(rows[i].1[1] - rows[j].1[1]);
    let mut last: HashMap<&str, usize> = HashMap::new();
    let mut apart = 0;
    for (i, (time, place)) in rows.iter().enumerate() {
        let Some(before) = last.insert(time, i).filter(|before| rows[*before].1 != *place) else { continue };
        let jumps = || i > 1 && distance(i, i - 1) > distance(i, i - 2);
        apart += usize::from(before + 1 != i || jumps());
    }
    3 * apart > rows.len()
}

/// Returns the lines that repeat the names of the columns: each track was copied below the last.
fn repeated(text: &str, heading: &Heading) -> Vec<usize> {
    let first = heading.names[0].as_str();
    let is_one = |line: &str| {
        line.contains(first) && trimmed(line, heading.separator).is_some_and(|cells| cells == heading.names)
    };
    lines(text).skip(heading.above).filter(|(_, line)| is_one(line)).map(|(line, _)| line).collect()
}

/// Returns the line above a header that names its track.
fn title(text: &str, head: usize) -> Option<(usize, &str)> {
    let (line, title) = filled_lines(text).take_while(|(line, _)| *line < head).last()?;
    let is_number = |cell: &str| !cell.is_empty() && value(cell).is_some();
    (!title.split([',', ';', '\t', ' ']).any(is_number)).then_some((line, title))
}

/// Finds the columns of the tracks; a track without a name is named after the file.
fn columns(
    heading: Heading,
    tracks: Vec<String>,
    further: Vec<usize>,
    is_multi: bool,
    input: &Input,
) -> Option<Layout> {
    let names = heading.small();
    let position = |name: &str| names.iter().position(|own| own == name);
    let by_frame = input.is_by_frame() || !TIMES[1..].iter().any(|name| position(name).is_some());
    let mut times = TIMES.iter().filter(|name| by_frame || **name != "frame");
    let time = times.find_map(|name| position(name))?;
    let heads: Vec<usize> = [heading.line].into_iter().chain(further).collect();
    let mut blocks = Vec::new();
    for (i, header) in heads.iter().copied().enumerate() {
        let (mut tracks, mut last) = (tracks.clone(), usize::MAX);
        if heads.len() > 1 {
            let name = title(input.text, header).map_or("", |(_, title)| title);
            let name = name.trim_matches(|c: char| c.is_whitespace() || "#,;\"".contains(c));
            tracks = vec![if name.is_empty() { (i + 1).to_string() } else { name.to_string() }];
            let next = heads.get(i + 1);
            last =
                next.map_or(usize::MAX, |next| title(input.text, *next).map_or(*next, |(line, _)| line) - 1);
        }
        let bodies = bodies(input, &heading, &tracks)?;
        blocks.push(Block { header, above: heading.above + header - heading.line, last, bodies });
    }
    let is_ignored = |name: &&str| !name.is_empty() && !["x", "y"].contains(name) && !TIMES.contains(name);
    let ignored: Vec<&str> = names.iter().map(String::as_str).filter(is_ignored).collect();
    let passed = ignored.join(", ");
    let passed = if passed.is_empty() { passed } else { format!("; columns passed over: {passed}") };
    let is_frame = names[time] == "frame";
    let layout = Layout::of_blocks(heading, blocks, Some((time, is_frame)), input);
    let message = format!(
        "read as {}, {} between cells, tracks {}{passed}",
        if is_multi || heads.len() > 1 { "Tracker (several tracks)" } else { "Tracker" },
        layout.heading.separator.name(),
        quoted(layout.names())
    );
    input.log.add(FORMAT, None, message);
    Some(layout)
}

/// Finds the columns of the tracks by their names, each above its first column.
fn bodies(input: &Input, heading: &Heading, tracks: &[String]) -> Option<Vec<Body>> {
    let names = heading.small();
    // each track has its columns side by side, in any order
    let begin = |column: usize| (0..tracks.len().min(column + 1)).rev().find(|i| !tracks[*i].is_empty());
    let named = |column: usize| begin(column).map_or(input.stem, |i| tracks[i].as_str());
    let beside = |column: usize, axis: &str| -> Vec<usize> {
        (0..names.len()).filter(|i| names[*i] == axis && begin(*i) == begin(column)).collect()
    };
    let mut bodies: Vec<Body> = Vec::new();
    let before = input.problems.len();
    for x in (0..names.len()).filter(|i| names[*i] == "x") {
        let (xs, ys) = (beside(x, "x").len(), beside(x, "y"));
        let [y] = ys[..] else {
            let message = format!("track \"{}\" has {} columns y; expected one", named(x), ys.len());
            input.wrong(heading.line, None, message);
            continue;
        };
        if xs > 1 {
            let message = format!(
                "{xs} columns x belong to the track \"{}\"; expected a name above the columns of each track",
                named(x)
            );
            input.wrong(heading.line, None, message);
            return None;
        }
        bodies.push(Body::new(named(x), [x, y]));
    }
    (input.problems.len() == before).then_some(bodies)
}
