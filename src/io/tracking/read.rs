//! Recognition of a file's format by its content.

use std::fs;

use super::formats::FORMATS;
use super::heading::{Heading, Rows, TITLES, headings};
use super::raw::{Job, RawShot, RawTrack, Subject};
use super::reader::{self, Body, Layout};
use super::settings::{Column, Columns, Format, angle_unit};
use super::words::{FRAMES, TIMES, Unit, find};
use super::{finish, json};
use crate::io::error::did_you_mean;
use crate::io::text::{decode, filled_lines, shortened, value, without_separator_line};

/// Returns the shots of a file, with clips separated and pieces of tracks joined. `alone`: the
/// names of clips are their numbers, without the file's name.
pub(super) fn file(job: Job, alone: bool) -> Option<Vec<RawShot>> {
    let wrong = |error| job.wrong(None, None, format!("cannot be read: {error}"));
    let bytes = fs::read(job.file).map_err(wrong).ok()?;
    let (text, latin) = decode(&bytes);
    if let Some(line) = latin {
        let message = "is not UTF-8 text from here on; read as Latin-1, which matters to names only";
        job.note(Subject::Format, line, message);
    }
    let (text, _) = without_separator_line(text);
    let is_archive = job.file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("trz"));
    let is_xml = text.trim_start().starts_with("<?xml");
    if is_archive || is_xml && text.contains("org.opensourcephysics.cabrillo.tracker") {
        job.wrong(None, None, TRACKER_PROJECT);
        return None;
    }
    let job = Job { text: &text, ..job };
    Some(finish::clips(as_written(job)?, alone, job))
}

fn as_written(job: Job) -> Option<Vec<RawShot>> {
    let settings = job.settings;
    let stated = settings.tracks.format;
    let wanted = |format: Format| stated == format || stated == Format::Auto;
    if let Some(columns) = &settings.tracks.columns {
        return Some(by_layout(&by_columns(job, columns)?, job));
    }
    if wanted(Format::Json) && json::detect(job.text) {
        return json::read(job);
    }
    let before = job.problems.len();
    let headings = headings(job.text, TITLES);
    for (_, layout) in FORMATS.into_iter().filter(|(format, _)| wanted(*format)) {
        if let Some(layout) = layout(&headings, job) {
            return Some(by_layout(&layout, job));
        }
        if job.problems.len() > before {
            return None;
        }
    }
    complain_of_format(&headings, job);
    None
}

fn by_layout(layout: &Layout, job: Job) -> Vec<RawShot> {
    layout.note(job);
    let mut shots = reader::read(job, layout);
    for shot in shots.iter_mut().filter(|_| layout.stated.format == Format::Qualisys) {
        begin_at_zero(shot, job);
    }
    // no column and no names of columns separate the balls
    let is_unnamed = |body: &Body| body.ball.is_none() && body.name.is_empty();
    if layout.stated.format == Format::Columns && layout.bodies.iter().all(is_unnamed) {
        finish::follow(&mut shots, job);
    }
    shots
}

/// Counts the times of Qualisys from the first row on, and turns positions at 0, 0 into gaps.
fn begin_at_zero(shot: &mut RawShot, job: Job) {
    let first = shot.times().first().copied().unwrap_or_default();
    shot.map_times(|time| time - first);
    for RawTrack { name, rows, .. } in &mut shot.tracks {
        for row in rows.iter_mut().filter(|row| row.place == [0.0, 0.0]) {
            row.lose();
            job.note(Subject::Gaps, row.line, format!("\"{name}\" is at 0, 0: taken as a gap"));
        }
    }
}

const TRACKER_PROJECT: &str =
    "is a project of the program Tracker; expected its data: export them there (File, Export, Data File)";
const ANY_FORMAT: &str = "a long table (shot,frame,ball,x,y), an export of Tracker, Kinovea or Qualisys, JSON (an array of shots with balls with samples), or a \
     section [tracks.columns] in dataset.toml that says which column is what";

fn complain_of_format(headings: &[Heading], job: Job) {
    let Some((line, first)) = filled_lines(job.text).next() else {
        return job.wrong(None, None, "is empty; expected tracked positions");
    };
    let format = job.settings.tracks.format;
    let expected = match format {
        Format::Auto => ANY_FORMAT.to_owned(),
        _ => format!("{}, as [tracks] format states", format.name()),
    };
    let is_of_long = matches!(format, Format::Auto | Format::Long);
    let lacking = headings.iter().filter(|_| is_of_long).find_map(lacking).unwrap_or_default();
    let is_text = !first.contains(|c: char| c.is_control() && !c.is_whitespace());
    let others = if is_text { "" } else { "; not the film itself, nor a workbook (save its sheet as CSV)" };
    let begin = shortened(first.trim());
    job.wrong(
        line,
        None,
        format!("no format begins like this, \"{begin}\"{lacking}; expected {expected}{others}"),
    );
}

fn lacking(heading: &Heading) -> Option<String> {
    let is_missing = |any: &&str| any.split(" or ").all(|name| heading.at(name).is_none());
    let missing: Vec<&str> = ["ball", "x", "y", "frame or t"].into_iter().filter(is_missing).collect();
    let missing = (1..=2).contains(&missing.len()).then(|| missing.join(" and "))?;
    Some(format!(", and what may be the names of columns, in line {}, are without {missing}", heading.line))
}

/// Maximum number of lines searched for the names of the columns, or for the first row.
const MAX_LINES: usize = 100;

/// Returns the layout of a table whose columns are stated; without times, rows are frames.
fn by_columns(job: Job, wanted: &Columns) -> Option<Layout> {
    let is_numbered = wanted.values().any(|column| matches!(column, Column::Number(_)));
    let heading = if is_numbered { numbered(job, wanted) } else { header(job, wanted) }?;
    let column = |key: &str| match wanted.get(key)? {
        Column::Name(name) => heading.position(name.trim()),
        Column::Number(number) => Some(number.get() - 1),
    };
    let shot = column("shot");
    let read: Vec<usize> = wanted.keys().filter_map(|key| column(key)).collect();
    let time = job.frame_or_time(column("frame"), column("t"));
    let time = time.or_else(|| unnamed_time(&heading, &read, shot, job));
    let [cue, object] = job.settings.first_names();
    let is_wide = wanted.contains_key("cue_x");
    let unit = |column: usize| {
        let stated = angle_unit(wanted).map(|unit| (unit, "[tracks.columns] angle_unit states".to_string()));
        let unit = heading.unit([column], Unit::Rad, stated, job);
        if unit.is_none() {
            let message = "the unit of these angles is not stated; expected [tracks.columns] angle_unit = \"rad\" or \"deg\"";
            job.wrong(heading.line, heading.bare[column].as_str(), message);
        }
        unit
    };
    let balls = if is_wide { vec![(cue, "cue_"), (object, "object_")] } else { vec![("", "")] };
    let bodies = balls.into_iter().map(|(name, begin)| Body::of_keys(name, begin, unit, column));
    let bodies = bodies.collect::<Option<Vec<_>>>()?.concat();
    if time.is_none() {
        let message = "no column of times: every row is taken as one frame after the row above it";
        job.note(Subject::Clock, None, message);
    }
    Some(Layout { shot, ..Layout::new(Format::Columns, heading, bodies, time, job) })
}

/// Returns the column of frame numbers (flag) or times that [tracks.columns] does not name: by its
/// name, if its numbers grow from row to row of a shot.
fn unnamed_time(heading: &Heading, used: &[usize], shot: Option<usize>, job: Job) -> Option<(usize, bool)> {
    let names = heading.small();
    let rows = Rows::of(job.text, heading);
    let grows = |column: &usize| !used.contains(column) && rows.grows(*column, shot);
    let frame = find(&names, FRAMES).filter(|column| grows(column) && rows.is_whole(*column));
    let time = find(&names, TIMES).filter(grows);
    let settings = job.settings;
    let rate = settings.video.playback_fps.or(settings.fps());
    if let (Some(frame), Some(time), Some(rate)) = (frame, time, rate)
        && heading.time(time, job) == Unit::S
    {
        rows.check_clock(heading, [frame, time], rate, job);
    }
    let (column, is_frame) = job.frame_or_time(frame, time)?;
    let what = if is_frame { "the number of the frame" } else { "the time" };
    let name = &heading.names[column];
    let message = format!("[tracks.columns] names no column of times: \"{name}\" is taken as {what}");
    job.note(Subject::Clock, heading.line, message);
    Some((column, is_frame))
}

/// Returns the heading in the first line that has all the names.
fn header(job: Job, wanted: &Columns) -> Option<Heading> {
    let names = wanted.iter().filter_map(|(key, column)| match column {
        Column::Name(name) if key != "angle_unit" => Some(name.trim()),
        _ => None,
    });
    let names: Vec<&str> = names.collect();
    let held = |heading: &Heading| names.iter().filter(|name| heading.position(name).is_some()).count();
    // the first heading that has the largest number of names
    let Some(heading) = headings(job.text, MAX_LINES).into_iter().rev().max_by_key(held) else {
        job.wrong(None, None, "is empty; expected the columns that [tracks.columns] names");
        return None;
    };
    let Some(missing) = names.iter().find(|name| heading.position(name).is_none()) else {
        let are_single = [&heading.names, &heading.bare].iter().all(|all| heading.has_once(&names, all, job));
        return are_single.then_some(heading);
    };
    let near = did_you_mean(missing, heading.names.iter().map(String::as_str));
    let all = shortened(&heading.names.join(" | "));
    let message = format!("of the columns in [tracks.columns], \"{missing}\" is missing here{near}: {all}");
    job.wrong(heading.line, None, message);
    None
}

/// Returns the heading of a table without names, from the first row with the expected numbers.
fn numbered(job: Job, wanted: &Columns) -> Option<Heading> {
    let numbers = wanted.iter().filter_map(|(key, column)| match column {
        Column::Number(number) => Some((key.as_str(), number.get())),
        Column::Name(_) => None,
    });
    let least = numbers.clone().map(|(_, number)| number).max()?;
    let is_number = |key: &str| !["shot", "ball", "point"].contains(&key);
    let mut numbers: Vec<usize> =
        numbers.filter(|(key, _)| is_number(key)).map(|(_, number)| number).collect();
    for Heading { line, separator, own: cells, .. } in
        headings(job.text, MAX_LINES).into_iter().filter(|heading| !heading.is_comment)
    {
        if cells.len() >= least && numbers.iter().all(|number| value(&cells[number - 1]).is_some()) {
            let is_open = cells.len() > least && cells.last().is_some_and(String::is_empty);
            return Some(Heading::unnamed(line, separator, cells.len() - usize::from(is_open)));
        }
    }
    numbers.sort_unstable();
    let numbers = numbers.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
    let message = format!("none of the first {MAX_LINES} lines has numbers in the columns {numbers}");
    job.wrong(None, None, message);
    None
}
