//! Tables of any other shape: `[tracks.columns]` says which column is what.

use std::path::Path;

use super::column_names::{Column, ColumnNames};
use super::heading::{Heading, blanks};
use super::long;
use super::long::{Columns, Gather};
use super::raw::{CLOCK, FORMAT, Notes, RawShot, Row};
use super::settings::{TimeUnit, TrackSettings, Unit};
use super::sheet::{Reader, Sheet};
use crate::io::error::{Problems, did_you_mean};
use crate::io::number::{Cell, parse, shortened};
use crate::io::text::{Separator, lines, trimmed, unmarked};

/// The names of the columns, or the first row where they have none, are within so many lines.
const WITHIN: usize = 100;

/// The shots of a file, and the unit of lengths that its header states.
pub(super) fn read(
    file: &Path,
    text: &str,
    stem: &str,
    wanted: &ColumnNames,
    settings: &TrackSettings,
    problems: &mut Problems,
    notes: &mut Notes,
) -> Option<(Vec<RawShot>, Option<Unit>)> {
    let heading = if wanted.is_numbered() {
        numbered(file, text, wanted, problems)?
    } else {
        header(file, text, wanted, problems)?
    };
    let shape = if wanted.is_wide() { "a row per frame" } else { "a row per ball and frame" };
    let place = if wanted.is_numbered() {
        format!("by number, rows from line {} on", heading.above + 1)
    } else {
        format!("names in line {}", heading.line)
    };
    let message =
        format!("read by [tracks.columns], {} between cells, {place}, {shape}", heading.separator.name());
    notes.add(FORMAT, file, None, message);
    if wanted.is_wide() {
        return wide(file, text, stem, wanted, heading, settings, problems, notes);
    }
    let position = |column: &Option<Column>| position(&heading, column.as_ref()?);
    let frame = position(&wanted.frame).filter(|_| settings.capture_fps.is_some() || wanted.t.is_none());
    let columns = Columns {
        shot: position(&wanted.shot),
        time: frame.or(position(&wanted.t))?,
        frames: frame.is_some(),
        ball: position(&wanted.ball)?,
        point: position(&wanted.point),
        x: position(&wanted.x)?,
        y: position(&wanted.y)?,
        sd: position(&wanted.x_sd).zip(position(&wanted.y_sd)).map(|(x, y)| [x, y]),
        marker: position(&wanted.marker_x).zip(position(&wanted.marker_y)).map(|(x, y)| [x, y]),
        angle: angle(&heading, wanted.angle.as_ref(), wanted, file, problems),
    };
    let stated = columns.stated(&heading, file, settings, problems);
    let mut gather = Gather::new(file, stem, stated.clock);
    long::read(&sheet(file, text, heading), &columns, &mut gather, problems, notes);
    Some((gather.shots, stated.unit))
}

fn position(heading: &Heading, column: &Column) -> Option<usize> {
    match column {
        Column::Name(name) => heading.position(name),
        Column::Number(number) => Some(number - 1),
    }
}

/// A column of angles, with the radians in its unit.
fn angle(
    heading: &Heading,
    column: Option<&Column>,
    wanted: &ColumnNames,
    file: &Path,
    problems: &mut Problems,
) -> Option<(usize, f64)> {
    let column = position(heading, column?)?;
    Some((column, heading.angle(column, wanted.angle_unit, file, problems)?.radians()))
}

fn sheet<'a>(file: &'a Path, text: &'a str, heading: Heading) -> Sheet<'a> {
    let Heading { line, above, separator, names, .. } = heading;
    Sheet { file, text, separator, header: line, above, offset: 0, names }
}

/// Reads a table with both balls in a row. Where it has no column of times, the rows of a shot are its frames.
#[expect(clippy::too_many_arguments, reason = "those of `read`, and the heading")]
fn wide(
    file: &Path,
    text: &str,
    stem: &str,
    wanted: &ColumnNames,
    heading: Heading,
    settings: &TrackSettings,
    problems: &mut Problems,
    notes: &mut Notes,
) -> Option<(Vec<RawShot>, Option<Unit>)> {
    let column = |column: &Option<Column>| position(&heading, column.as_ref()?);
    let frame = column(&wanted.frame).filter(|_| settings.capture_fps.is_some() || wanted.t.is_none());
    let time = frame.or(column(&wanted.t));
    let balls = [
        (settings.cue.0.first()?, column(&wanted.cue_x)?, column(&wanted.cue_y)?),
        (settings.object.0.first()?, column(&wanted.object_x)?, column(&wanted.object_y)?),
    ];
    let mut turn = |column: &Option<Column>| angle(&heading, column.as_ref(), wanted, file, problems);
    let turns = [turn(&wanted.cue_angle), turn(&wanted.object_angle)];
    let shot = column(&wanted.shot);
    let unit = heading.length(&balls.map(|(_, x, y)| [x, y]).concat(), file, problems);
    let clock = match time {
        Some(time) if frame.is_none() => {
            heading.time(time, settings.time_unit, file, problems).unwrap_or(TimeUnit::S)
        }
        _ => TimeUnit::Frames,
    };
    if time.is_none() {
        notes.add(
            CLOCK,
            file,
            None,
            "no column of times: every row is taken as one frame after the row above it",
        );
    }
    let mut gather = Gather::new(file, stem, clock);
    let sheet = sheet(file, text, heading);
    let mut reader = Reader::new(file);
    let (mut current, mut count) = (String::new(), 0.0);
    sheet.rows(problems, |line, row, problems| {
        let shot_name = shot.map(|i| row[i].trim());
        if let Some(i) = shot.filter(|_| shot_name == Some("")) {
            problems.add(file, Some(line), Some(&sheet.names[i]), "is empty; expected the name of a shot");
        }
        if shot_name.is_some_and(|name| name != current) {
            (current, count) = (shot_name.unwrap_or_default().to_string(), 0.0);
        }
        let counted = count;
        count += 1.0;
        let now = match time {
            Some(time) => reader.time(line, &row[time], &sheet.names[time], problems),
            None => Some(counted),
        };
        let Some(time) = now else {
            if balls.iter().any(|(_, x, _)| !row[*x].trim().is_empty()) {
                reader.no_time(line, problems);
            }
            return;
        };
        for ((ball, x, y), turn) in balls.into_iter().zip(turns) {
            let names = [sheet.names[x].as_str(), sheet.names[y].as_str()];
            let [x, y] = reader.position(line, [&row[x], &row[y]], names, problems, notes);
            gather.push(shot_name, ball, "", Row { time, x, y, line: line as u32 }, None);
            if let Some((i, unit)) = turn {
                let angle = reader.extra(line, &row[i], &sheet.names[i], problems);
                gather.push_angle(
                    shot_name,
                    ball,
                    time,
                    angle.map_or(f64::NAN, |angle| unit * angle),
                    line as u32,
                );
            }
        }
    });
    gather.finish(reader, problems, notes);
    Some((gather.shots, unit))
}

fn separators(wanted: &ColumnNames, blanks: Separator) -> Vec<Separator> {
    match wanted.separator.as_deref().and_then(|s| s.chars().next()) {
        Some(separator) => vec![Separator::Char(separator)],
        None => Separator::ALL.into_iter().filter(|s| *s != Separator::Char(' ')).chain([blanks]).collect(),
    }
}

/// The first line that has all the names.
fn header(file: &Path, text: &str, wanted: &ColumnNames, problems: &mut Problems) -> Option<Heading> {
    let all = wanted.all();
    let wanted_names: Vec<&str> = all
        .iter()
        .filter_map(|column| if let Column::Name(name) = column { Some(name.as_str()) } else { None })
        .collect();
    let separators = separators(wanted, Separator::Char(' '));
    let mut nearest: Option<(usize, usize, Vec<String>)> = None;
    for (line, content) in lines(text).filter(|(_, content)| !content.trim().is_empty()).take(WITHIN) {
        for separator in &separators {
            let bare = unmarked(content);
            let separator =
                if *separator == Separator::Char(' ') { blanks(text, line, bare) } else { *separator };
            let Some(names) = trimmed(bare, separator) else { continue };
            let heading = Heading::new(text, line, separator, names);
            let here = wanted_names.iter().filter(|name| heading.position(name).is_some()).count();
            if here == wanted_names.len() {
                if let Some(name) = wanted_names.iter().find(|name| heading.count(name) > 1) {
                    problems.add(
                        file,
                        Some(line),
                        Some(name),
                        "stands twice in the header; expected it once",
                    );
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
        problems.add(file, None, None, "is empty; expected the columns that [tracks.columns] names");
        return None;
    };
    let missing = wanted_names.iter().find(|name| !names.iter().any(|n| n == *name));
    let missing = missing.copied().unwrap_or_default();
    let near = did_you_mean(missing, names.iter().map(String::as_str));
    let message = format!(
        "no line has all the columns that [tracks.columns] names; \"{missing}\" is missing here{near}: {}",
        shortened(&names.join(" | "))
    );
    problems.add(file, Some(line), None, message);
    None
}

/// Where the rows of a table without names begin: at the first line with numbers in all columns that hold numbers.
fn numbered(file: &Path, text: &str, wanted: &ColumnNames, problems: &mut Problems) -> Option<Heading> {
    let index = |column: &Column| match column {
        Column::Number(number) => number - 1,
        Column::Name(_) => 0,
    };
    let all: Vec<usize> = wanted.all().into_iter().map(index).collect();
    let last = all.iter().copied().max()?;
    let words = [&wanted.shot, &wanted.ball, &wanted.point].map(|column| column.as_ref().map(index));
    let numbers: Vec<usize> = all.into_iter().filter(|column| !words.contains(&Some(*column))).collect();
    let separators = separators(wanted, Separator::Blanks);
    for (line, content) in lines(text).filter(|(_, content)| !content.trim().is_empty()).take(WITHIN) {
        for separator in &separators {
            let Some(cells) = trimmed(content, *separator) else { continue };
            let number = |column: &usize| matches!(parse(&cells[*column]), Ok(Cell::Number(..)));
            if cells.len() > last && numbers.iter().all(number) {
                let open = cells.len() > last + 1 && cells.last().is_some_and(String::is_empty);
                return Some(Heading::unnamed(line, *separator, cells.len() - usize::from(open)));
            }
        }
    }
    let message = format!(
        "none of the first {WITHIN} lines has numbers in the columns {} that [tracks.columns] gives",
        numbers.iter().map(|column| (column + 1).to_string()).collect::<Vec<_>>().join(", ")
    );
    problems.add(file, None, None, message);
    None
}
