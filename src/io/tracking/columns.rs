//! Tables of any shape, read by `[tracks.columns]`.

use super::column_names::{Column, ColumnNames};
use super::heading::{Heading, blanks};
use super::input::{Input, quoted};
use super::layout::{Body, Layout, Name};
use super::long;
use super::raw::{CLOCK, FORMAT};
use super::sample::Rows;
use super::units::TimeUnit;
use super::words::{Role, find};
use crate::io::error::did_you_mean;
use crate::io::number::{shortened, value};
use crate::io::text::{Separator, filled_lines, trimmed, unmarked};

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
    let time = long::time(column, input).or_else(|| unnamed_time(&heading, &read, shot, input));
    note(&heading, wanted, &read, time, input);
    let angle = |key: &str| {
        let column = column(key)?;
        Some((column, heading.angle(column, wanted.angle_unit, input)?))
    };
    let bodies = if wanted.has("cue_x") {
        let [cue, object] = input.settings.first_names().map(|name| Name::Fixed(name.to_string()));
        let angles = [angle("cue_angle"), angle("object_angle")];
        let [cue, object] = [Body::of_keys(cue, "cue_", column)?, Body::of_keys(object, "object_", column)?];
        vec![Body { angle: angles[0], ..cue }, Body { angle: angles[1], ..object }]
    } else {
        time?;
        let name = column("ball").map_or(Name::Fixed(String::new()), Name::Column);
        vec![Body { angle: angle("angle"), ..Body::of_keys(name, "", column)? }]
    };
    if time.is_none() {
        let message = "no column of times: every row is taken as one frame after the row above it";
        input.log.add(CLOCK, None, message);
    }
    Some(Layout { shot, may_lack_ball: true, ..Layout::below(heading, bodies, time, input) })
}

/// Notes how the table is read, and the named columns that are not.
fn note(heading: &Heading, wanted: &ColumnNames, read: &[usize], time: Option<(usize, bool)>, input: &Input) {
    /// Maximum number of columns listed.
    const MAX_NAMED: usize = 12;
    let is_read = |column: usize| read.contains(&column) || time.is_some_and(|(time, _)| time == column);
    let named = heading.names.iter().enumerate();
    let passed = named.filter(|(i, name)| !is_read(*i) && !name.is_empty() && !wanted.is_numbered());
    let passed: Vec<&String> = passed.map(|(_, name)| name).collect();
    let more = passed.len().saturating_sub(MAX_NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let listed = quoted(passed.into_iter().take(MAX_NAMED));
    let passed = if listed.is_empty() { listed } else { format!("; columns passed over: {listed}{more}") };
    let (separator, first) = (heading.separator.name(), heading.above + 1);
    let message =
        format!("read by [tracks.columns], {separator} between cells, rows from line {first} on{passed}");
    input.log.add(FORMAT, None, message);
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
    let groups: Vec<usize> = shot.into_iter().collect();
    let grows = |column: &usize| !used.contains(column) && rows.least_step(*column, &groups).is_some();
    let frame = find(&names, Role::Frame).filter(|column| grows(column) && rows.is_whole(*column));
    let time = find(&names, Role::Time).filter(grows);
    if let (Some(frame), Some(time), Some(rate)) =
        (frame, time, input.settings.playback_fps.or(input.settings.capture_fps))
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
    input.log.add(CLOCK, heading.line, message);
    Some((column, frame.is_some()))
}

/// Returns the heading in the first line that has all the names.
fn header(input: &Input, wanted: &ColumnNames) -> Option<Heading> {
    let name = |(_, column): (_, &'_ Column)| match column {
        Column::Name(name) => name.trim().to_string(),
        Column::Number(_) => String::new(),
    };
    let wanted_names: Vec<String> = wanted.all().map(name).collect();
    let mut nearest: Option<(usize, Heading)> = None;
    for (line, content) in filled_lines(input.text).take(MAX_LINES) {
        let bare = unmarked(content);
        for separator in Separator::ALL {
            let is_blank = separator == Separator::Char(' ');
            let separator = if is_blank { blanks(input.text, line, bare) } else { separator };
            let Some(names) = trimmed(bare, separator) else { continue };
            let heading = Heading::deep(input.text, line, separator, names);
            let here = wanted_names.iter().filter(|name| heading.position(name).is_some()).count();
            if here == wanted_names.len() {
                if let Some(name) = wanted_names.iter().find(|name| heading.count(name) > 1) {
                    input.wrong(line, name.as_str(), "stands twice in the header; expected it once");
                    return None;
                }
                return Some(heading);
            }
            if nearest.as_ref().is_none_or(|(most, _)| here > *most) {
                nearest = Some((here, heading));
            }
        }
    }
    let Some((_, Heading { line, names, .. })) = nearest else {
        input.wrong(None, None, "is empty; expected the columns that [tracks.columns] names");
        return None;
    };
    let missing = wanted_names.iter().find(|name| !names.contains(name)).map_or("", String::as_str);
    let near = did_you_mean(missing, names.iter().map(String::as_str));
    let message = format!(
        "no line has all the columns that [tracks.columns] names; \"{missing}\" is missing here{near}: {}",
        shortened(&names.join(" | "))
    );
    input.wrong(line, None, message);
    None
}

/// Returns the heading of a table without names, from the first row with the expected numbers.
fn numbered(input: &Input, wanted: &ColumnNames) -> Option<Heading> {
    let number = |(key, column): (&'static str, &Column)| match column {
        Column::Number(number) => (key, number.get() - 1),
        Column::Name(_) => (key, 0),
    };
    let all: Vec<(&str, usize)> = wanted.all().map(number).collect();
    let last = all.iter().map(|(_, column)| *column).max()?;
    let is_text = |column: usize| {
        all.iter().any(|(key, own)| ["shot", "ball", "point"].contains(key) && *own == column)
    };
    let numbers: Vec<usize> =
        all.iter().map(|(_, column)| *column).filter(|column| !is_text(*column)).collect();
    for (line, content) in filled_lines(input.text).take(MAX_LINES) {
        for separator in Separator::ALL {
            let is_blank = separator == Separator::Char(' ');
            let separator = if is_blank { Separator::Blanks } else { separator };
            let Some(cells) = trimmed(content, separator).filter(|cells| cells.len() > last) else {
                continue;
            };
            if numbers.iter().all(|column| value(&cells[*column]).is_some()) {
                let is_open = cells.len() > last + 1 && cells.last().is_some_and(String::is_empty);
                return Some(Heading::unnamed(line, separator, cells.len() - usize::from(is_open)));
            }
        }
    }
    let message = format!(
        "none of the first {MAX_LINES} lines has numbers in the columns {} that [tracks.columns] gives",
        numbers.iter().map(|column| (column + 1).to_string()).collect::<Vec<_>>().join(", ")
    );
    input.wrong(None, None, message);
    None
}
