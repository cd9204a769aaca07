//! Tables of any shape, read by `[tracks.columns]`.

use super::column_names::{Column, ColumnNames};
use super::formats;
use super::heading::{Heading, tops};
use super::input::{Input, Subject};
use super::layout::{Block, Body, Layout, Name};
use super::sample::Rows;
use super::settings::Format;
use super::units::{AngleUnit, Measure, TimeUnit};
use super::words::{Role, find};
use crate::io::error::did_you_mean;
use crate::io::number::{shortened, value};

/// Maximum number of lines searched for the names of the columns, or for the first row.
const MAX_LINES: usize = 100;

/// Returns the layout of a table whose columns are stated. Without a column of balls, the paths
/// separate the balls; without times, the rows of a wide table are frames.
pub(super) fn layout(input: &Input, wanted: &ColumnNames) -> Option<Layout> {
    let heading = if wanted.is_numbered() { numbered(input, wanted) } else { header(input, wanted) }?;
    let column = |key: &str| match wanted.get(key)? {
        Column::Name(name) => heading.position(name.trim()),
        Column::Number(number) => Some(number.get() - 1),
    };
    let shot = column("shot");
    let read: Vec<usize> = wanted.all().filter_map(|(key, _)| column(key)).collect();
    let time = formats::time(column, input).or_else(|| unnamed_time(&heading, &read, shot, input));
    let body = |name: Name, begin: &str| {
        let mut body = Body::of_keys(name, begin, column)?;
        if let Some(column) = column(&format!("{begin}angle")) {
            body.angle = Some((column, angle_unit(&heading, column, wanted.angle_unit, input)?));
        }
        Some(body)
    };
    let bodies = if wanted.has("cue_x") {
        let [cue, object] = input.settings.first_names().map(|name| Name::Fixed(name.to_string()));
        vec![body(cue, "cue_")?, body(object, "object_")?]
    } else {
        time?;
        vec![body(column("ball").map_or(Name::Fixed(String::new()), Name::Column), "")?]
    };
    if time.is_none() {
        let message = "no column of times: every row is taken as one frame after the row above it";
        input.log.add(Subject::Clock, None, message);
    }
    let block = Block::below(&heading, bodies);
    Some(Layout { shot, ..Layout::new(Format::Columns, heading, vec![block], time, input) })
}

fn angle_unit(
    heading: &Heading,
    column: usize,
    stated: Option<AngleUnit>,
    input: &Input,
) -> Option<AngleUnit> {
    let place = stated.map(|unit| (Measure::Angle(unit), "[tracks.columns] angle_unit states"));
    match heading.unit(column, Measure::Angle(AngleUnit::Rad), place, input) {
        Some(Measure::Angle(unit)) => Some(unit),
        None if !heading.has_unit(column) && stated.is_none() => {
            let message = "the unit of these angles is not stated; expected [tracks.columns] angle_unit = \"rad\" or \"deg\"";
            input.wrong(heading.line, heading.bare[column].as_str(), message);
            None
        }
        _ => stated,
    }
}

/// Returns the column of frame numbers or times if [tracks.columns] names neither, and whether it
/// is of frames: it is recognised by its name, and its numbers grow from row to row of a shot.
fn unnamed_time(
    heading: &Heading,
    used: &[usize],
    shot: Option<usize>,
    input: &Input,
) -> Option<(usize, bool)> {
    let names = heading.small();
    let rows = Rows::of(input.text, heading);
    let grows = |column: &usize| !used.contains(column) && rows.grows(*column, shot);
    let frame = find(&names, Role::Frame).filter(|column| grows(column) && rows.is_whole(*column));
    let time = find(&names, Role::Time).filter(grows);
    let rate = input.settings.playback_fps.or(input.settings.capture_fps);
    if let (Some(frame), Some(time), Some(rate)) = (frame, time, rate)
        && heading.time(time, input) == TimeUnit::S
    {
        rows.check_clock(heading, [frame, time], rate, input);
    }
    let frame = frame.filter(|_| input.is_by_frame() || time.is_none());
    let column = frame.or(time)?;
    let message = format!(
        "[tracks.columns] names no column of times: \"{}\" is taken as {}",
        heading.names[column],
        if frame.is_some() { "the number of the frame" } else { "the time" }
    );
    input.log.add(Subject::Clock, heading.line, message);
    Some((column, frame.is_some()))
}

/// Returns the heading in the first line that has all the names.
fn header(input: &Input, wanted: &ColumnNames) -> Option<Heading> {
    let names = wanted.all().filter_map(|(_, column)| match column {
        Column::Name(name) => Some(name.trim()),
        Column::Number(_) => None,
    });
    let names: Vec<&str> = names.collect();
    let mut nearest: Option<(usize, Heading)> = None;
    for top in tops(input.text, MAX_LINES) {
        let heading = Heading::deep(input.text, &top);
        let here = names.iter().filter(|name| heading.position(name).is_some()).count();
        if here == names.len() {
            let before = input.problems.len();
            heading.complain_of_twins(names, input);
            return (input.problems.len() == before).then_some(heading);
        }
        if nearest.as_ref().is_none_or(|(most, _)| here > *most) {
            nearest = Some((here, heading));
        }
    }
    let Some((_, heading)) = nearest else {
        input.wrong(None, None, "is empty; expected the columns that [tracks.columns] names");
        return None;
    };
    let missing = names.into_iter().find(|name| heading.position(name).is_none()).unwrap_or_default();
    let near = did_you_mean(missing, heading.names.iter().map(String::as_str));
    let message = format!(
        "no line has all the columns that [tracks.columns] names; \"{missing}\" is missing here{near}: {}",
        shortened(&heading.names.join(" | "))
    );
    input.wrong(heading.line, None, message);
    None
}

/// Returns the heading of a table without names, from the first row with the expected numbers.
fn numbered(input: &Input, wanted: &ColumnNames) -> Option<Heading> {
    let number = |(key, column): (&str, &Column)| match column {
        Column::Number(number) if !["shot", "ball", "point"].contains(&key) => Some(number.get() - 1),
        _ => None,
    };
    let numbers: Vec<usize> = wanted.all().filter_map(number).collect();
    let last =
        wanted.all().map(|(_, column)| if let Column::Number(number) = column { number.get() } else { 1 });
    let least = last.max()?;
    for top in tops(input.text, MAX_LINES).iter().filter(|top| !top.is_comment()) {
        let cells = &top.names;
        if cells.len() >= least && numbers.iter().all(|column| value(&cells[*column]).is_some()) {
            let is_open = cells.len() > least && cells.last().is_some_and(String::is_empty);
            return Some(Heading::unnamed(top.line, top.separator, cells.len() - usize::from(is_open)));
        }
    }
    let numbers: Vec<String> = numbers.iter().map(|column| (column + 1).to_string()).collect();
    let message = format!(
        "none of the first {MAX_LINES} lines has numbers in the columns {} that [tracks.columns] gives",
        numbers.join(", ")
    );
    input.wrong(None, None, message);
    None
}
