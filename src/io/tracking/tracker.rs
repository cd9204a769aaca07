//! Tracker: exports of one track or several (`#multi:`), and tables copied from it.

use std::collections::HashMap;

use super::boxes;
use super::heading::{Heading, TITLES};
use super::input::{Input, quoted};
use super::layout::{Block, Body, Detected, Layout, Refused};
use super::raw::{Clock, FORMAT};
use super::settings::TimeUnit;
use super::words::{Kind, Role, find, pairs};
use crate::io::number::value;
use crate::io::text::{Separator, filled_lines, lines, trimmed};

/// Names of the columns of time, the best first.
const TIMES: [&str; 3] = ["frame", "t", "time"];

pub(super) fn layout(input: &Input) -> Detected {
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
            if are_several(input.text, &heading) {
                return None;
            }
            let tracks = above.and_then(|text| trimmed(text, separator)).unwrap_or_default();
            return Some(columns(heading, tracks, is_multi, input));
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
        || !boxes::named(&names).is_empty();
    let is_own = begins_with_x && !["x2", "x 2", "x_2"].iter().any(|second| has(second));
    // other programs write both balls beside each other: X, Y, X 2, Y 2
    let positions = || pairs(&names).iter().filter(|(_, kind)| *kind == Kind::Position).count();
    !is_long && (is_own || positions() == 1)
}

/// Returns whether one pair of columns is at two places at the same time: several balls below each
/// other, which is not an export of Tracker.
fn are_several(text: &str, heading: &Heading) -> bool {
    let names = heading.small();
    let of = |name: &str| names.iter().position(|own| own == name);
    let is_one = names.iter().filter(|name| *name == "x").count() == 1;
    let (Some(x), Some(y)) = (of("x").filter(|_| is_one), of("y")) else { return false };
    let Some(time) = TIMES.iter().find_map(|time| of(time)) else { return false };
    let last = repeated(text, heading).first().map_or(usize::MAX, |next| next - 1);
    let rows = lines(text).take(last).skip(heading.above).filter_map(|(_, line)| {
        let mut row = trimmed(line, heading.separator).filter(|row| row.len() == names.len())?;
        let at = [value(&row[x])?, value(&row[y])?];
        Some((std::mem::take(&mut row[time]), at))
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
    // a coarse clock also repeats times, but then a ball is nearer after one row than after two
    let distance = |i: usize, j: usize| (rows[i].1[0] - rows[j].1[0]).hypot(rows[i].1[1] - rows[j].1[1]);
    let jumps = |i: &&usize| **i > 1 && distance(**i, **i - 1) > distance(**i, **i - 2);
    let alternate = beside.iter().filter(jumps).count();
    3 * (apart + alternate) > rows.len()
}

/// Returns the lines that repeat the names of the columns: each track was copied below the last.
fn repeated(text: &str, heading: &Heading) -> Vec<usize> {
    let first = heading.names[0].as_str();
    let is_one = |line: &str| {
        line.contains(first) && trimmed(line, heading.separator).is_some_and(|cells| cells == heading.names)
    };
    lines(text).skip(heading.above).filter(|(_, line)| is_one(line)).map(|(line, _)| line).collect()
}

/// Returns the names of the tracks and the last row of tables below each other; `heads` are the
/// lines of their names of columns.
fn tables(input: &Input, heads: &[usize]) -> Vec<(Vec<String>, usize)> {
    let title = |head: usize| {
        let filled = filled_lines(input.text).take_while(|(line, _)| *line < head).last();
        filled.filter(|(_, title)| {
            !title.split([',', ';', '\t', ' ']).any(|cell| value(cell).is_some_and(|_| !cell.is_empty()))
        })
    };
    let of = |(i, head): (usize, &usize)| {
        let name = title(*head).map_or(String::new(), |(_, title)| {
            title.trim_matches(|c: char| c.is_whitespace() || "#,;\"".contains(c)).to_string()
        });
        let next = heads.get(i + 1).map(|next| title(*next).map_or(*next, |(line, _)| line));
        let name = if name.is_empty() { (i + 1).to_string() } else { name };
        (vec![name], next.map_or(usize::MAX, |next| next - 1))
    };
    heads.iter().enumerate().map(of).collect()
}

/// Finds the columns of the tracks; a track without a name is named after the file.
fn columns(heading: Heading, tracks: Vec<String>, is_multi: bool, input: &Input) -> Result<Layout, Refused> {
    let names = heading.small();
    let position = |name: &str| names.iter().position(|own| own == name);
    let by_frame = input.is_by_frame() || !TIMES[1..].iter().any(|name| position(name).is_some());
    let times = TIMES.iter().filter(|name| by_frame || **name != "frame");
    let time = times.into_iter().find_map(|name| position(name)).ok_or(Refused)?;
    let mut heads = vec![heading.line];
    heads.extend(repeated(input.text, &heading));
    let tables = if heads.len() > 1 { tables(input, &heads) } else { vec![(tracks, usize::MAX)] };
    let mut blocks = Vec::new();
    for (head, (tracks, last)) in heads.iter().zip(tables) {
        let bodies = bodies(input, &heading, &tracks)?;
        blocks.push(Block { header: *head, above: heading.above + head - heading.line, last, bodies });
    }
    let is_ignored = |name: &&str| !name.is_empty() && !["x", "y"].contains(name) && !TIMES.contains(name);
    let ignored: Vec<&str> = names.iter().map(String::as_str).filter(is_ignored).collect();
    let passed = if ignored.is_empty() {
        String::new()
    } else {
        format!("; columns passed over: {}", ignored.join(", "))
    };
    let clock = if names[time] == "frame" { TimeUnit::Frames } else { heading.time(time, input) };
    let unit = heading.length(&Layout::lengths(&blocks), input);
    let layout = Layout { unit, ..Layout::new(heading, blocks, Some(time), Clock::In(clock)) };
    let message = format!(
        "read as {}, {} between cells, tracks {}{passed}",
        if is_multi || heads.len() > 1 { "Tracker (several tracks)" } else { "Tracker" },
        layout.heading.separator.name(),
        quoted(layout.names())
    );
    input.log.add(FORMAT, None, message);
    Ok(layout)
}

/// Finds the columns of the tracks by their names, each above its first column.
fn bodies(input: &Input, heading: &Heading, tracks: &[String]) -> Result<Vec<Body>, Refused> {
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
            return Err(Refused);
        }
        bodies.push(Body::new(named(x), x, y));
    }
    if input.problems.len() == before { Ok(bodies) } else { Err(Refused) }
}
