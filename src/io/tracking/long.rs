//! The canonical table: a row per ball and frame.

use super::heading::{Heading, TITLES};
use super::input::{Input, quoted};
use super::layout::{Body, Layout, Name};
use super::raw::{FORMAT, REPEATED};
use crate::io::rows::near_miss;
use crate::io::text::{Separator, lines, trimmed};

/// The columns of the canonical table.
const KNOWN: [&str; 10] = ["shot", "frame", "t", "ball", "x", "y", "z", "point", "x_sd", "y_sd"];

/// Returns the layout of a text that begins like the canonical table, perhaps below a title.
pub(super) fn layout(input: &Input) -> Option<Layout> {
    let is_comment = |line: &str| line.trim().is_empty() || line.trim_start().starts_with('#');
    let mut top = lines(input.text).filter(|(_, line)| !is_comment(line)).take(TITLES);
    let heading = top.find_map(|(line, content)| {
        let mut separators = Separator::ALL.into_iter().filter(|one| *one != Separator::Char(' '));
        separators.find_map(|separator| {
            let names: Vec<_> = trimmed(content, separator)?.iter().map(|name| name.to_lowercase()).collect();
            // most lines are no header: looked at more closely only if it may be one
            if !names.iter().any(|name| name == "ball") {
                return None;
            }
            let heading = Heading::new(input.text, line, separator, names);
            let has = |name: &str| heading.position(name).is_some();
            (["ball", "x", "y"].into_iter().all(has) && (has("frame") || has("t"))).then_some(heading)
        })
    })?;
    checked(heading, input)
}

/// Complains about the header of the canonical table and notes its columns.
fn checked(heading: Heading, input: &Input) -> Option<Layout> {
    let before = input.problems.len();
    let has = |name: &str| heading.bare.iter().any(|own| own == name);
    let (known, others): (Vec<_>, Vec<_>) =
        heading.bare.iter().enumerate().partition(|(_, name)| KNOWN.contains(&name.as_str()));
    for (_, name) in known.into_iter().filter(|(i, name)| heading.bare[..*i].contains(name)) {
        input.wrong(heading.line, name.as_str(), "stands twice in the header");
    }
    for (_, name) in &others {
        if let Some(meant) = near_miss(name, &KNOWN, has) {
            let message = format!(
                "is not a known name, but nearly {meant}; write {meant}, or give the column another name"
            );
            input.wrong(heading.line, name.as_str(), message);
        }
    }
    if has("x_sd") != has("y_sd") {
        input.wrong(heading.line, None, "x_sd and y_sd go together; expected both or neither");
    }
    let names = quoted(others.iter().map(|(_, name)| name));
    let passed = if names.is_empty() { names } else { format!("; columns passed over: {names}") };
    let heights = if has("z") {
        "; heights (z) are not used: how high a ball flies follows from its path seen from above"
    } else {
        ""
    };
    let at = |name: &str| heading.position(name).filter(|_| KNOWN.contains(&name));
    let (shot, time) = (at("shot"), time(at, input));
    let body = Body::of_keys(Name::Column(at("ball")?), "", at)?;
    let layout = Layout { shot, ..Layout::below(heading, vec![body], time, input) };
    if input.problems.len() > before {
        return None;
    }
    let separator = layout.heading.separator.name();
    input.log.add(FORMAT, None, format!("read as a long table, {separator} between cells{passed}{heights}"));
    note_comments(&layout, input);
    Some(layout)
}

/// Returns the column of times, and whether it holds numbers of frames.
pub(super) fn time(at: impl Fn(&str) -> Option<usize>, input: &Input) -> Option<(usize, bool)> {
    let (frame, time) = (at("frame"), at("t"));
    let frame = frame.filter(|_| input.is_by_frame() || time.is_none());
    Some((frame.or(time)?, frame.is_some()))
}

/// Notes rows that are read as comments since the name of their shot begins with #.
fn note_comments(layout: &Layout, input: &Input) {
    let heading = &layout.heading;
    if layout.shot != Some(0) || !input.text.contains("\n#") {
        return;
    }
    let numbers: Vec<usize> = layout.time.into_iter().chain(layout.bodies().map(|body| body.xy[0])).collect();
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
