//! Tables with a row per ball and frame: canonical, or described by `[tracks.columns]`.

use super::heading::{Heading, TITLES};
use super::input::{Input, quoted};
use super::layout::{At, Block, Body, Detected, Layout, Name, Refused};
use super::raw::{Clock, FORMAT, REPEATED};
use super::settings::TimeUnit;
use super::units::AngleUnit;
use crate::io::rows::near_miss;
use crate::io::text::{Separator, lines, trimmed};

/// The columns of the canonical table.
const KNOWN: [&str; 10] = ["shot", "frame", "t", "ball", "x", "y", "z", "point", "x_sd", "y_sd"];

/// Returns the layout of a text that begins like the canonical table, perhaps below a title.
pub(super) fn layout(input: &Input) -> Detected {
    let is_comment = |line: &str| line.trim().is_empty() || line.trim_start().starts_with('#');
    let top = lines(input.text).filter(|(_, line)| !is_comment(line)).take(TITLES);
    let heading = top.into_iter().find_map(|(line, content)| {
        let separators = Separator::ALL.into_iter().filter(|separator| *separator != Separator::Char(' '));
        separators.into_iter().find_map(|separator| {
            let names: Vec<_> = trimmed(content, separator)?.iter().map(|name| name.to_lowercase()).collect();
            // most lines are no header: looked at more closely only if it may be one
            if !names.iter().any(|name| name == "ball") {
                return None;
            }
            let heading = Heading::new(input.text, line, separator, names);
            let has = |name: &str| heading.position(name).is_some();
            let is_header = ["ball", "x", "y"].into_iter().all(has) && (has("frame") || has("t"));
            is_header.then_some(heading)
        })
    })?;
    Some(checked(heading, input))
}

/// Complains about the header of the canonical table and notes its columns.
fn checked(heading: Heading, input: &Input) -> Result<Layout, Refused> {
    let before = input.problems.len();
    let mut strange = Vec::new();
    let has = |name: &str| heading.bare.iter().any(|own| own == name);
    for (i, name) in heading.bare.iter().enumerate() {
        if KNOWN.contains(&name.as_str()) {
            if heading.bare[..i].contains(name) {
                input.wrong(heading.line, name.as_str(), "stands twice in the header");
            }
            continue;
        }
        if let Some(meant) = near_miss(name, &KNOWN, has) {
            let message = format!(
                "is not a known name, but nearly {meant}; write {meant}, or give the column another name"
            );
            input.wrong(heading.line, name.as_str(), message);
        }
        strange.push(name);
    }
    if has("x_sd") != has("y_sd") {
        input.wrong(heading.line, None, "x_sd and y_sd go together; expected both or neither");
    }
    let passed = if strange.is_empty() {
        String::new()
    } else {
        format!("; columns passed over: {}", quoted(strange))
    };
    let heights = if has("z") {
        "; heights (z) are not used: how high a ball flies follows from its path seen from above"
    } else {
        ""
    };
    let separator = heading.separator.name();
    let known: Vec<Option<usize>> = KNOWN.iter().map(|name| heading.position(name)).collect();
    let at = |name: &str| known[KNOWN.iter().position(|own| *own == name)?];
    let layout = of_balls(at, None, heading, input).ok_or(Refused)?;
    if input.problems.len() > before {
        return Err(Refused);
    }
    input.log.add(FORMAT, None, format!("read as a long table, {separator} between cells{passed}{heights}"));
    note_comments(&layout, input);
    Ok(layout)
}

/// Returns the layout of a table whose columns `at` finds by key; `None` if a necessary one is
/// missing. Complains if the header contradicts itself or dataset.toml about units. Without a
/// column of balls, the paths separate the balls.
pub(super) fn of_balls(
    at: impl Fn(&str) -> Option<usize>,
    angle: Option<(usize, AngleUnit)>,
    heading: Heading,
    input: &Input,
) -> Option<Layout> {
    let (time, is_frame) = time(&at, input)?;
    let pair = |x: &str, y: &str| Some([at(x)?, at(y)?]);
    let name = at("ball").map_or(Name::Fixed(String::new()), Name::Column);
    let body = Body {
        point: at("point"),
        sd: pair("x_sd", "y_sd"),
        marker: pair("marker_x", "marker_y"),
        angle,
        ..Body::at(name, At::of(&at, "")?)
    };
    let blocks = vec![Block::below(&heading, vec![body])];
    let unit = heading.length(&Layout::lengths(&blocks), input);
    let clock = if is_frame { TimeUnit::Frames } else { heading.time(time, input) };
    let shot = at("shot");
    Some(Layout { shot, unit, ..Layout::new(heading, blocks, Some(time), Clock::In(clock)) })
}

/// Returns the column of times, and whether it holds numbers of frames.
pub(super) fn time(at: impl Fn(&str) -> Option<usize>, input: &Input) -> Option<(usize, bool)> {
    let (frame, time) = (at("frame"), at("t"));
    let frame = frame.filter(|_| input.is_by_frame() || time.is_none());
    Some((frame.or(time)?, frame.is_some()))
}

/// Notes rows that are read as comments since the name of their shot begins with #.
fn note_comments(layout: &Layout, input: &Input) {
    let Layout { heading, shot, time, blocks, .. } = layout;
    if *shot != Some(0) || !input.text.contains("\n#") {
        return;
    }
    let x = blocks.iter().flat_map(|block| &block.bodies).map(|body| body.at.x);
    let numbers: Vec<usize> = time.iter().copied().chain(x).collect();
    let is_row = |line: &str| {
        let cells = trimmed(line, heading.separator).unwrap_or_default();
        cells.len() == heading.names.len() && numbers.iter().all(|i| cells[*i].parse::<f64>().is_ok())
    };
    let below = lines(input.text).skip(heading.line);
    let mut commented = below.filter(|(_, line)| line.starts_with('#') && is_row(line));
    if let Some((first, _)) = commented.next() {
        let message = format!(
            "{} rows from here on begin with #: passed over as comments. If # belongs to the name of a shot, put the \
             name in quotation marks",
            commented.count() + 1
        );
        input.log.add(REPEATED, first, message);
    }
}
