//! Tables of any shape, read by `[tracks.columns]`.

use super::column_names::{Column, Columns, angle_unit};
use super::heading::{Heading, Rows, headings};
use super::input::{Input, Subject};
use super::layout::{Block, Body, Layout};
use super::settings::Format;
use super::units::Unit;
use super::words::{FRAMES, TIMES, find};
use crate::io::error::did_you_mean;
use crate::io::number::{shortened, value};

/// Maximum number of lines searched for the names of the columns, or for the first row.
const MAX_LINES: usize = 100;

/// Returns the layout of a table whose columns are stated. Without a column of balls, the paths
/// separate the balls; without times, the rows of a wide table are frames.
pub(super) fn layout(input: &Input, wanted: &Columns) -> Option<Layout> {
    let is_numbered = wanted.values().any(|column| matches!(column, Column::Number(_)));
    let heading = if is_numbered { numbered(input, wanted) } else { header(input, wanted) }?;
    let column = |key: &str| match wanted.get(key)? {
        Column::Name(name) => heading.position(name.trim()),
        Column::Number(number) => Some(number.get() - 1),
    };
    let shot = column("shot");
    let read: Vec<usize> = wanted.keys().filter_map(|key| column(key)).collect();
    let time = input.frame_or_time(column("frame"), column("t"));
    let time = time.or_else(|| unnamed_time(&heading, &read, shot, input));
    let [cue, object] = input.job.settings.first_names();
    let is_wide = wanted.contains_key("cue_x");
    let mut bodies = Vec::new();
    for (name, begin) in if is_wide { vec![(cue, "cue_"), (object, "object_")] } else { vec![("", "")] } {
        let angle = match column(&format!("{begin}angle")) {
            Some(column) => Some((column, angle_unit_of(&heading, column, wanted, input)?)),
            None => None,
        };
        bodies.append(&mut Body::of_keys(name, begin, column, angle)?);
    }
    if time.is_none() {
        let message = "no column of times: every row is taken as one frame after the row above it";
        input.job.note(Subject::Clock, None, message);
    }
    let block = Block::below(&heading, bodies);
    Some(Layout { shot, ..Layout::new(Format::Columns, heading, vec![block], time, input) })
}

fn angle_unit_of(heading: &Heading, column: usize, wanted: &Columns, input: &Input) -> Option<Unit> {
    let stated = angle_unit(wanted).map(|unit| (unit, "[tracks.columns] angle_unit states".to_string()));
    let unit = heading.unit([column], Unit::Rad, stated, input);
    if unit.is_some() {
        return unit;
    }
    let message =
        "the unit of these angles is not stated; expected [tracks.columns] angle_unit = \"rad\" or \"deg\"";
    input.wrong(heading.line, heading.bare[column].as_str(), message);
    None
}

/// Returns the column of frame numbers or times if [tracks.columns] does not name them, and whether
/// it is of frames: it is recognised by its name, and its numbers grow from row to row of a shot.
fn unnamed_time(
    heading: &Heading,
    used: &[usize],
    shot: Option<usize>,
    input: &Input,
) -> Option<(usize, bool)> {
    let names = heading.small();
    let rows = Rows::of(input.text, heading);
    let grows = |column: &usize| !used.contains(column) && rows.grows(*column, shot);
    let frame = find(&names, FRAMES).filter(|column| grows(column) && rows.is_whole(*column));
    let time = find(&names, TIMES).filter(grows);
    let settings = input.job.settings;
    let rate = settings.video.playback_fps.or(settings.fps());
    if let (Some(frame), Some(time), Some(rate)) = (frame, time, rate)
        && heading.time(time, input) == Unit::S
    {
        rows.check_clock(heading, [frame, time], rate, input);
    }
    let (column, is_frame) = input.frame_or_time(frame, time)?;
    let what = if is_frame { "the number of the frame" } else { "the time" };
    let name = &heading.names[column];
    let message = format!("[tracks.columns] names no column of times: \"{name}\" is taken as {what}");
    input.job.note(Subject::Clock, heading.line, message);
    Some((column, is_frame))
}

/// Returns the heading in the first line that has all the names.
fn header(input: &Input, wanted: &Columns) -> Option<Heading> {
    let names =
        wanted.iter().filter(|(key, _)| *key != "angle_unit").filter_map(|(_, column)| match column {
            Column::Name(name) => Some(name.trim()),
            Column::Number(_) => None,
        });
    let names: Vec<&str> = names.collect();
    let held = |heading: &Heading| names.iter().filter(|name| heading.position(name).is_some()).count();
    // the first heading that has the largest number of names
    let Some(heading) = headings(input.text, MAX_LINES).into_iter().rev().max_by_key(held) else {
        input.wrong(None, None, "is empty; expected the columns that [tracks.columns] names");
        return None;
    };
    let Some(missing) = names.iter().find(|name| heading.position(name).is_none()) else {
        let are_single =
            [&heading.names, &heading.bare].iter().all(|all| heading.has_once(&names, all, input));
        return are_single.then_some(heading);
    };
    let near = did_you_mean(missing, heading.names.iter().map(String::as_str));
    let all = shortened(&heading.names.join(" | "));
    let message = format!("of the columns in [tracks.columns], \"{missing}\" is missing here{near}: {all}");
    input.wrong(heading.line, None, message);
    None
}

/// Returns the heading of a table without names, from the first row with the expected numbers.
fn numbered(input: &Input, wanted: &Columns) -> Option<Heading> {
    let numbers = wanted.iter().filter_map(|(key, column)| match column {
        Column::Number(number) => Some((key.as_str(), number.get())),
        Column::Name(_) => None,
    });
    let least = numbers.clone().map(|(_, number)| number).max()?;
    let is_number = |key: &str| !["shot", "ball", "point"].contains(&key);
    let mut numbers: Vec<usize> =
        numbers.filter(|(key, _)| is_number(key)).map(|(_, number)| number).collect();
    for Heading { line, separator, own: cells, .. } in
        headings(input.text, MAX_LINES).into_iter().filter(|heading| !heading.is_comment)
    {
        if cells.len() >= least && numbers.iter().all(|number| value(&cells[number - 1]).is_some()) {
            let is_open = cells.len() > least && cells.last().is_some_and(String::is_empty);
            return Some(Heading::unnamed(line, separator, cells.len() - usize::from(is_open)));
        }
    }
    numbers.sort_unstable();
    let numbers = numbers.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
    let message = format!("none of the first {MAX_LINES} lines has numbers in the columns {numbers}");
    input.wrong(None, None, message);
    None
}
