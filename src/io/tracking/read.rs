//! Recognition of a file's format by its content.

use std::fs;
use std::path::Path;

use super::formats::FORMATS;
use super::heading::{Heading, TITLES, headings};
use super::input::{Input, Job, Subject, stem};
use super::layout::Layout;
use super::raw::{RawShot, RawTrack};
use super::settings::Format;
use super::{columns, json, pieces, reader};
use crate::io::error::Problems;
use crate::io::number::shortened;
use crate::io::text::{decode, filled_lines, without_separator_line};

/// Returns the shots of a file, with clips separated and pieces of tracks joined. `alone`: the
/// names of clips are their numbers, without the file's name.
pub(super) fn file(job: Job, problems: &Problems, alone: bool) -> Option<Vec<RawShot>> {
    let file = job.file;
    let wrong = |error| problems.add(file, None, None, format!("cannot be read: {error}"));
    let bytes = fs::read(file).map_err(wrong).ok()?;
    let (text, latin) = decode(&bytes);
    if let Some(line) = latin {
        let message = "is not UTF-8 text from here on; read as Latin-1, which matters to names only";
        job.note(Subject::Format, line, message);
    }
    let (text, _) = without_separator_line(text);
    if is_tracker_project(file, &text) {
        problems.add(file, None, None, TRACKER_PROJECT);
        return None;
    }
    let input = Input { job, text: &text, stem: &stem(file), problems };
    Some(pieces::clips(as_written(&input)?, alone, job))
}

fn as_written(input: &Input) -> Option<Vec<RawShot>> {
    let settings = input.job.settings;
    let stated = settings.tracks.format;
    let wanted = |format: Format| stated == format || stated == Format::Auto;
    if let Some(columns) = &settings.tracks.columns {
        return Some(by_layout(&columns::layout(input, columns)?, input));
    }
    if wanted(Format::Json) && json::detect(input.text) {
        return json::read(input);
    }
    let before = input.problems.len();
    let headings = headings(input.text, TITLES);
    for (_, layout) in FORMATS.into_iter().filter(|(format, _)| wanted(*format)) {
        if let Some(layout) = layout(&headings, input) {
            return Some(by_layout(&layout, input));
        }
        if input.problems.len() > before {
            return None;
        }
    }
    complain_of_format(&headings, input);
    None
}

fn by_layout(layout: &Layout, input: &Input) -> Vec<RawShot> {
    layout.note(input);
    let mut shots = reader::read(input, layout);
    for shot in shots.iter_mut().filter(|_| layout.stated.format == Format::Qualisys) {
        begin_at_zero(shot, input);
    }
    if layout.is_of_paths() {
        pieces::follow(&mut shots, input);
    }
    shots
}

/// Counts the times of Qualisys from the first row on, and turns positions at 0, 0 into gaps.
fn begin_at_zero(shot: &mut RawShot, input: &Input) {
    let first = shot.times().first().copied().unwrap_or_default();
    shot.map_times(|time| time - first);
    for RawTrack { name, rows, .. } in &mut shot.tracks {
        for row in rows.iter_mut().filter(|row| row.place == [0.0, 0.0]) {
            row.lose();
            input.job.note(Subject::Gaps, row.line, format!("\"{name}\" is at 0, 0: taken as a gap"));
        }
    }
}

pub(in crate::io) const TRACKER_PROJECT: &str =
    "is a project of the program Tracker; expected its data: export them there (File, Export, Data File)";

/// Returns whether a file is a project of Tracker: XML, or an archive with it.
pub(in crate::io) fn is_tracker_project(file: &Path, text: &str) -> bool {
    let is_archive = file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("trz"));
    let is_xml = || text.trim_start().starts_with("<?xml");
    is_archive || is_xml() && text.contains("org.opensourcephysics.cabrillo.tracker")
}

fn complain_of_format(headings: &[Heading], input: &Input) {
    let Some((line, first)) = filled_lines(input.text).next() else {
        return input.wrong(None, None, "is empty; expected tracked positions");
    };
    let format = input.job.settings.tracks.format;
    let expected = match format {
        Format::Auto => {
            "a long table (shot,frame,ball,x,y), an export of Tracker, Kinovea or Qualisys, JSON (an array of shots with balls with samples), or a section \
             [tracks.columns] in dataset.toml that says which column is what"
                .to_owned()
        }
        _ => format!("{}, as [tracks] format states", format.name()),
    };
    let is_of_long = matches!(format, Format::Auto | Format::Long);
    let lacking = headings.iter().filter(|_| is_of_long).find_map(lacking).unwrap_or_default();
    let begin = shortened(first.trim());
    input.wrong(line, None, format!("no format begins like this, \"{begin}\"{lacking}; expected {expected}"));
}

fn lacking(heading: &Heading) -> Option<String> {
    let is_missing = |any: &&str| any.split(" or ").all(|name| heading.at(name).is_none());
    let missing: Vec<&str> = ["ball", "x", "y", "frame or t"].into_iter().filter(is_missing).collect();
    let missing = (1..=2).contains(&missing.len()).then(|| missing.join(" and "))?;
    Some(format!(", and what may be the names of columns, in line {}, are without {missing}", heading.line))
}
