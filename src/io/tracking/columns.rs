//! Tables of any other shape, read by `[tracks.columns]`.

use super::column_names::{Column, ColumnNames};
use super::heading::{Heading, blanks};
use super::input::{Input, quoted};
use super::layout::{At, Block, Body, Layout, Name, Refused};
use super::long;
use super::raw::{CLOCK, Clock, FORMAT};
use super::sample::Rows;
use super::settings::TimeUnit;
use super::time::first_contradiction;
use super::units::AngleUnit;
use super::words::{Role, find};
use crate::io::error::did_you_mean;
use crate::io::number::{shortened, value};
use crate::io::text::{Separator, filled_lines, trimmed, unmarked};

/// Maximum number of lines searched for the names of the columns, or for the first row.
const MAX_LINES: usize = 100;

pub(super) fn layout(input: &Input, wanted: &ColumnNames) -> Result<Layout, Refused> {
    let heading = if wanted.is_numbered() { numbered(input, wanted) } else { header(input, wanted) };
    let heading = heading.ok_or(Refused)?;
    let column = |key: &str| position(&heading, wanted, key);
    let shape = if wanted.is_wide() { "a row per frame" } else { "a row per ball and frame" };
    let place = if wanted.is_numbered() {
        format!("by number, rows from line {} on", heading.above + 1)
    } else {
        format!("names in line {}", heading.line)
    };
    let mut read: Vec<usize> = wanted.all().filter_map(|(key, _)| column(key)).collect();
    let time = long::time(column, input).or_else(|| unnamed_time(&heading, &read, column("shot"), input));
    read.extend(time.map(|(column, _)| column));
    let passed = if wanted.is_numbered() { String::new() } else { passed_over(&heading, &read) };
    let message = format!(
        "read by [tracks.columns], {} between cells, {place}, {shape}{passed}",
        heading.separator.name()
    );
    input.log.add(FORMAT, None, message);
    if wanted.is_wide() {
        return wide(input, wanted, heading, time).ok_or(Refused);
    }
    let angle = angle(&heading, wanted, "angle", input);
    let known: Vec<(&str, Option<usize>)> = wanted.all().map(|(key, _)| (key, column(key))).collect();
    let at = |key: &str| known.iter().find(|(own, _)| *own == key)?.1;
    let layout = long::of_balls(at, angle, heading, input).ok_or(Refused)?;
    Ok(Layout { may_lack_ball: true, ..layout })
}

/// Lists the named columns that are not read, as the end of a sentence.
fn passed_over(heading: &Heading, read: &[usize]) -> String {
    /// Maximum number of columns listed.
    const MAX_NAMED: usize = 12;
    let is_passed = |(i, name): &(usize, &String)| !read.contains(i) && !name.is_empty();
    let passed: Vec<&String> =
        heading.names.iter().enumerate().filter(is_passed).map(|(_, name)| name).collect();
    let more = passed.len().saturating_sub(MAX_NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    if passed.is_empty() {
        return String::new();
    }
    format!("; columns passed over: {}{more}", quoted(passed.into_iter().take(MAX_NAMED)))
}

fn position(heading: &Heading, wanted: &ColumnNames, key: &str) -> Option<usize> {
    match wanted.get(key)? {
        Column::Name(name) => heading.position(name.trim()),
        Column::Number(number) => Some(number.get() - 1),
    }
}

fn angle(heading: &Heading, wanted: &ColumnNames, key: &str, input: &Input) -> Option<(usize, AngleUnit)> {
    let column = position(heading, wanted, key)?;
    Some((column, heading.angle(column, wanted.angle_unit, input)?))
}

/// Returns the layout of a table with both balls in a row. Without times, its rows are frames.
fn wide(
    input: &Input,
    wanted: &ColumnNames,
    heading: Heading,
    time: Option<(usize, bool)>,
) -> Option<Layout> {
    let column = |key: &str| position(&heading, wanted, key);
    let body = |name: &str, begin: &str| {
        let body = Body::at(Name::Fixed(name.to_string()), At::of(column, begin)?);
        Some(Body { angle: angle(&heading, wanted, &format!("{begin}angle"), input), ..body })
    };
    let [cue, object] = input.settings.first_names();
    let bodies = vec![body(cue, "cue_")?, body(object, "object_")?];
    let blocks = vec![Block::below(&heading, bodies)];
    let shot = column("shot");
    let unit = heading.length(&Layout::lengths(&blocks), input);
    let clock = match time {
        Some((time, false)) => heading.time(time, input),
        _ => TimeUnit::Frames,
    };
    if time.is_none() {
        let message = "no column of times: every row is taken as one frame after the row above it";
        input.log.add(CLOCK, None, message);
    }
    let time = time.map(|(column, _)| column);
    Some(Layout { shot, unit, ..Layout::new(heading, blocks, time, Clock::In(clock)) })
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
        && let (Some(frames), Some(seconds)) = (rows.numbers(frame), rows.numbers(time))
        && let Some(row) = first_contradiction(&frames, &seconds, rate)
    {
        let [frame_name, time_name] = [frame, time].map(|column| heading.names[column].as_str());
        let message = format!(
            "{frame_name} and {time_name} contradict each other at {rate} fps: from the first row to the one with {frame_name} {} there \
             are {} frames, but {} s; expected frame = \"{frame_name}\" or t = \"{time_name}\" in [tracks.columns], or another \
             capture_fps",
            frames[row],
            frames[row] - frames[0],
            seconds[row] - seconds[0],
        );
        input.wrong(heading.line, frame_name, message);
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

fn separators(wanted: &ColumnNames, blanks: Separator) -> Vec<Separator> {
    match wanted.separator.as_deref().and_then(|s| s.chars().next()) {
        Some(separator) => vec![Separator::Char(separator)],
        None => Separator::ALL.into_iter().filter(|s| *s != Separator::Char(' ')).chain([blanks]).collect(),
    }
}

/// Returns the heading in the first line that has all the names.
fn header(input: &Input, wanted: &ColumnNames) -> Option<Heading> {
    let wanted_names = wanted.all().filter_map(|(_, column)| match column {
        Column::Name(name) => Some(name.trim()),
        Column::Number(_) => None,
    });
    let wanted_names: Vec<&str> = wanted_names.collect();
    let separators = separators(wanted, Separator::Char(' '));
    let mut nearest: Option<(usize, usize, Vec<String>)> = None;
    for (line, content) in filled_lines(input.text).take(MAX_LINES) {
        for separator in &separators {
            let bare = unmarked(content);
            let separator =
                if *separator == Separator::Char(' ') { blanks(input.text, line, bare) } else { *separator };
            let Some(names) = trimmed(bare, separator) else { continue };
            let heading = Heading::deep(input.text, line, separator, names);
            let here = wanted_names.iter().filter(|name| heading.position(name).is_some()).count();
            if here == wanted_names.len() {
                if let Some(name) = wanted_names.iter().find(|name| heading.count(name) > 1) {
                    input.wrong(line, *name, "stands twice in the header; expected it once");
                    return None;
                }
                return Some(heading);
            }
            if nearest.as_ref().is_none_or(|(most, ..)| here > *most) {
                nearest = Some((here, line, heading.names));
            }
        }
    }
    let Some((_, line, names)) = nearest else {
        input.wrong(None, None, "is empty; expected the columns that [tracks.columns] names");
        return None;
    };
    let missing = wanted_names.iter().find(|name| !names.iter().any(|n| n == *name));
    let missing = missing.copied().unwrap_or_default();
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
    let index = |column: &Column| match column {
        Column::Number(number) => number.get() - 1,
        Column::Name(_) => 0,
    };
    let all: Vec<usize> = wanted.all().map(|(_, column)| index(column)).collect();
    let last = all.iter().copied().max()?;
    let words = ["shot", "ball", "point"].map(|key| wanted.get(key).map(index));
    let numbers: Vec<usize> = all.into_iter().filter(|column| !words.contains(&Some(*column))).collect();
    let separators = separators(wanted, Separator::Blanks);
    for (line, content) in filled_lines(input.text).take(MAX_LINES) {
        for separator in &separators {
            let Some(cells) = trimmed(content, *separator) else { continue };
            let number = |column: &usize| value(&cells[*column]).is_some();
            if cells.len() > last && numbers.iter().all(number) {
                let open = cells.len() > last + 1 && cells.last().is_some_and(String::is_empty);
                return Some(Heading::unnamed(line, *separator, cells.len() - usize::from(open)));
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
