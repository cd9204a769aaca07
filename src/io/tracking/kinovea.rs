//! Kinovea: text exports with a section per object, and CSV.

use super::clock::seconds;
use super::heading::Heading;
use super::input::{Input, quoted};
use super::layout::{Block, Body, Layout};
use super::raw::{Clock, FORMAT};
use crate::io::number::value;
use crate::io::text::{Separator, filled_lines, lines, trimmed};

const FILTERED: &str = "coordinates that come from its kinematics window are filtered, which smears an impact: \
                        export the trajectories themselves";

pub(super) fn layout(input: &Input) -> Option<Layout> {
    let (line, first) = filled_lines(input.text).next()?;
    let (layout, kind) = if is_title(first.trim()) {
        (sections(input), "text".to_string())
    } else {
        let heading = Separator::ALL.into_iter().find_map(|separator| {
            let heading = Heading::new("", line, separator, trimmed(first, separator)?);
            let is_coordinate = |name: &String| name.ends_with("/X") || name.ends_with("/Y");
            let is_time = heading.bare.first().is_some_and(|name| name == "Time");
            (is_time && heading.names.iter().any(is_coordinate)).then_some(heading)
        })?;
        let kind = format!("CSV, {} between cells", heading.separator.name());
        (csv(heading, input)?, kind)
    };
    let tracks = quoted(layout.names());
    input.log.add(FORMAT, None, format!("read as Kinovea ({kind}), tracks {tracks}; {FILTERED}"));
    Some(layout)
}

/// Returns whether a line stands above the sections of a text.
fn is_title(line: &str) -> bool {
    line.starts_with("#Kinovea") || line.eq_ignore_ascii_case("#T X Y")
}

/// Finds the sections: rows of time, x and y below a comment with the object's name or, in old
/// versions, below a blank line.
fn sections(input: &Input) -> Layout {
    let mut blocks: Vec<Block> = Vec::new();
    let mut filled = Vec::new();
    let (mut title, mut unnamed, mut is_apart) = (1, 0, true);
    // time of the last row of the section
    let mut before: Option<f64> = None;
    let section = |header: usize, above: usize, name: &str| Block {
        header,
        above,
        last: usize::MAX,
        bodies: vec![Body::new(name, [1, 2])],
    };
    for (line, text) in lines(input.text).map(|(line, text)| (line, text.trim())) {
        if text.is_empty() || is_title(text) {
            is_apart = true;
            title = if text.is_empty() { title } else { line };
        } else if let Some(name) = text.strip_prefix('#') {
            blocks.push(section(title, line, name.trim()));
            (is_apart, before) = (false, None);
        } else {
            let row: Vec<&str> = text.split_whitespace().collect();
            let time = seconds(row[0]).map(|(time, _)| time).or_else(|| value(row[0]));
            // a blank line inside a section does not begin one
            let is_earlier = before.zip(time).is_some_and(|(before, time)| before >= time);
            if blocks.is_empty() || is_apart && is_earlier {
                unnamed += 1;
                blocks.push(section(title, line - 1, &unnamed.to_string()));
            }
            if row.len() == 3 && time.is_some() {
                (is_apart, before) = (false, time);
            }
            filled.push(blocks.len() - 1);
        }
    }
    for i in 1..blocks.len() {
        blocks[i - 1].last = blocks[i].above;
    }
    filled.dedup();
    let blocks = filled.into_iter().map(|i| blocks[i].clone()).collect();
    let heading = Heading::plain(1, 1, Separator::Blanks, ["T", "X", "Y"].map(str::to_string).to_vec());
    let layout = Layout::of_blocks(heading, blocks, Some((0, true)), input);
    Layout { has_all_cells: true, clock: Clock::Unsaid, ..layout }
}

/// Finds the columns `Time`, `name/0/X`, `name/0/Y`, ….
fn csv(heading: Heading, input: &Input) -> Option<Layout> {
    let names = &heading.names;
    let mut stems: Vec<(&str, [usize; 2])> = Vec::new();
    for x in 1..names.len() {
        let Some(stem) = names[x].strip_suffix("/X") else { continue };
        let y_name = format!("{stem}/Y");
        let is_free = |y: &usize| stems.iter().all(|(_, taken)| taken[1] != *y);
        let Some(y) = (1..names.len()).find(|y| names[*y] == y_name && is_free(y)) else {
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
    let (bodies, has_unit) = (bodies.collect(), heading.has_unit(0));
    let layout = Layout::below(heading, bodies, Some((0, false)), input);
    Some(Layout { clock: if has_unit { layout.clock } else { Clock::Unsaid }, unit: None, ..layout })
}
