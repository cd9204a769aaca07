//! The canonical table: a row per ball and frame.

use super::heading::{Heading, TITLES};
use super::input::{Input, quoted};
use super::layout::{At, Block, Body, Detected, Layout, Name, Refused};
use super::raw::{Clock, FORMAT, REPEATED};
use super::settings::TimeUnit;
use crate::io::rows::near_miss;
use crate::io::text::{Separator, lines, trimmed};

/// The columns of the canonical table.
const KNOWN: [&str; 10] = ["shot", "frame", "t", "ball", "x", "y", "z", "point", "x_sd", "y_sd"];

/// Returns the layout of a text that begins like the canonical table, below a title perhaps.
pub(super) fn layout(input: &Input) -> Detected {
    let is_comment = |line: &str| line.trim().is_empty() || line.trim_start().starts_with('#');
    let top = lines(input.text).filter(|(_, line)| !is_comment(line)).take(TITLES);
    let (heading, columns) = top.into_iter().find_map(|(line, content)| {
        let separators = Separator::ALL.into_iter().filter(|separator| *separator != Separator::Char(' '));
        separators.into_iter().find_map(|separator| {
            let names: Vec<_> = trimmed(content, separator)?.iter().map(|name| name.to_lowercase()).collect();
            // most lines are no header: looked at more closely only if it may be one
            if !names.iter().any(|name| name == "ball") {
                return None;
            }
            let heading = Heading::new(input.text, line, separator, names);
            let columns = Columns::of(known(&heading), input).filter(|columns| columns.has_ball())?;
            Some((heading, columns))
        })
    })?;
    Some(checked(heading, columns, input))
}

/// Returns a function that finds columns of the canonical table.
fn known(heading: &Heading) -> impl Fn(&str) -> Option<usize> {
    |name| heading.position(name).filter(|_| KNOWN.contains(&name))
}

/// Complains about the header and says what was found.
fn checked(heading: Heading, columns: Columns, input: &Input) -> Result<Layout, Refused> {
    let before = input.problems.len();
    let mut strange = Vec::new();
    let has = |name: &str| heading.bare.iter().any(|own| own == name);
    for (i, name) in heading.bare.iter().enumerate() {
        if !KNOWN.contains(&name.as_str()) {
            if let Some(meant) = near_miss(name, &KNOWN, has) {
                let message = format!(
                    "is no known name, but nearly {meant}; write {meant}, or give the column another name"
                );
                input.wrong(heading.line, name.as_str(), message);
            }
            strange.push(name);
        } else if heading.bare[..i].contains(name) {
            input.wrong(heading.line, name.as_str(), "stands twice in the header");
        }
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
    let layout = columns.layout(heading, input);
    if input.problems.len() > before {
        return Err(Refused);
    }
    input.log.add(FORMAT, None, format!("read as a long table, {separator} between cells{passed}{heights}"));
    note_comments(&layout, input);
    Ok(layout)
}

/// Columns of a table with a row per ball and frame.
pub(super) struct Columns {
    shot: Option<usize>,
    time: usize,
    is_frame: bool,
    pub body: Body,
}

impl Columns {
    /// Returns those that a table has, where `at` finds the columns by our names; `None` if it lacks one that must be there. Without a
    /// column of balls, the balls are told apart by their paths.
    pub(super) fn of(at: impl Fn(&str) -> Option<usize>, input: &Input) -> Option<Self> {
        let (time, is_frame) = time(&at, input)?;
        let pair = |x: &str, y: &str| Some([at(x)?, at(y)?]);
        let name = match at("ball") {
            Some(column) => Name::Column { column, may_be_empty: false },
            None => Name::Fixed(String::new()),
        };
        let body = Body {
            point: at("point"),
            sd: pair("x_sd", "y_sd"),
            marker: pair("marker_x", "marker_y"),
            ..Body::at(name, At::of(&at, "")?)
        };
        Some(Self { shot: at("shot"), time, is_frame, body })
    }

    pub(super) fn has_ball(&self) -> bool {
        matches!(self.body.name, Name::Column { .. })
    }

    /// Returns the layout of the table; complains if its header contradicts itself or dataset.toml about units.
    pub(super) fn layout(self, heading: Heading, input: &Input) -> Layout {
        let Self { shot, time, is_frame, body } = self;
        let blocks = vec![Block::below(&heading, vec![body])];
        let unit = heading.length(&Layout::lengths(&blocks), input);
        let clock = if is_frame { TimeUnit::Frames } else { heading.time(time, input) };
        Layout {
            heading,
            shot,
            time: Some(time),
            clock: Clock::In(clock),
            unit,
            has_all_cells: false,
            blocks,
        }
    }
}

/// Returns the column of times, and whether these are numbers of frames.
pub(super) fn time(at: impl Fn(&str) -> Option<usize>, input: &Input) -> Option<(usize, bool)> {
    let (frame, time) = (at("frame"), at("t"));
    let frame = frame.filter(|_| input.is_by_frame() || time.is_none());
    Some((frame.or(time)?, frame.is_some()))
}

/// Notes rows that are taken for comments since the name of their shot begins with #.
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
