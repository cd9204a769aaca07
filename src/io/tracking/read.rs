//! Recognition of a file's format by its content.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use super::heading::{Heading, TITLES};
use super::input::{Context, Input, stem};
use super::layout::{Detect, Layout};
use super::raw::{FORMAT, RawShot};
use super::settings::Format;
use super::units::Unit;
use super::{clips, columns, json, kinovea, link, long, pieces, qualisys, reader, tracker};
use crate::io::number::shortened;
use crate::io::text::{Separator, decode, filled_lines, trimmed, unmarked, without_separator_line};

/// Formats of tables that are recognised by their content.
const FORMATS: [(Format, Detect); 4] = [
    (Format::Qualisys, qualisys::layout),
    (Format::Kinovea, kinovea::layout),
    (Format::Long, long::layout),
    (Format::Tracker, tracker::layout),
];

pub(super) struct Tracked {
    pub shots: Vec<RawShot>,
    pub format: Format,
    /// Unit of its lengths, if the file or its format states it.
    pub unit: Option<Unit>,
}

/// Returns the shots of a file, with clips separated and pieces of tracks joined. `alone`: the
/// names of clips are their numbers, without the file's name.
pub(super) fn file(file: &Path, context: Context, alone: bool) -> Option<Tracked> {
    let Context { settings, problems, notes } = context;
    let wrong = |error| problems.add(file, None, None, format!("cannot be read: {error}"));
    let bytes = fs::read(file).map_err(wrong).ok()?;
    let (text, latin) = decode(&bytes);
    let log = notes.of(file);
    if let Some(line) = latin {
        log.add(FORMAT, line, "is not UTF-8 text from here on; read as Latin-1, which matters to names only");
    }
    let (text, _) = without_separator_line(text);
    if is_tracker_project(file, &text) {
        problems.add(file, None, None, TRACKER_PROJECT);
        return None;
    }
    let stem = stem(file);
    let mut tracked = as_written(&Input { file, text: &text, stem: &stem, settings, problems, log })?;
    tracked.shots = clips::of_file(tracked.shots, settings.capture_fps, alone, notes);
    for shot in &mut tracked.shots {
        pieces::join(shot, settings, notes);
    }
    Some(tracked)
}

fn as_written(input: &Input) -> Option<Tracked> {
    let settings = input.settings;
    let wanted = |format: Format| settings.format == format || settings.format == Format::Auto;
    if let Some(columns) = &settings.columns {
        return Some(by_layout(Format::Columns, &columns::layout(input, columns)?, input));
    }
    if wanted(Format::Json) && json::detect(input.text) {
        return json::read(input).map(|(shots, unit)| Tracked { shots, format: Format::Json, unit });
    }
    let before = input.problems.len();
    for (format, layout) in FORMATS.into_iter().filter(|(format, _)| wanted(*format)) {
        if let Some(layout) = layout(input) {
            return Some(by_layout(format, &layout, input));
        }
        if input.problems.len() > before {
            return None;
        }
    }
    complain_of_format(input);
    None
}

fn by_layout(format: Format, layout: &Layout, input: &Input) -> Tracked {
    let mut shots = reader::read(input, layout);
    if shots.is_empty() && !matches!(format, Format::Long | Format::Columns) {
        // a file without rows is one shot nevertheless
        let (name, file) = (input.stem.to_string(), Arc::new(input.file.to_path_buf()));
        shots.push(RawShot { name, file, line: 1, clock: layout.clock, tracks: Vec::new() });
    }
    match format {
        Format::Qualisys => qualisys::finish(&mut shots, layout, input),
        Format::Columns if layout.names().any(str::is_empty) => link::part(&mut shots, input),
        _ => {}
    }
    Tracked { shots, format, unit: layout.unit }
}

pub(in crate::io) const TRACKER_PROJECT: &str =
    "is a project of the program Tracker; expected its data: export them there (File, Export, Data File)";

/// Returns whether a file is a project of Tracker: XML, or an archive with it.
pub(in crate::io) fn is_tracker_project(file: &Path, text: &str) -> bool {
    let is_archive = file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("trz"));
    let is_xml = || text.trim_start().starts_with("<?xml");
    is_archive || is_xml() && text.contains("org.opensourcephysics.cabrillo.tracker")
}

fn complain_of_format(input: &Input) {
    let (text, format) = (input.text, input.settings.format);
    let Some((line, first)) = filled_lines(text).next() else {
        return input.wrong(None, None, "is empty; expected tracked positions");
    };
    let expected = match format {
        Format::Auto => {
            "a long table (shot,frame,ball,x,y), an export of Tracker, Kinovea or Qualisys, JSON (an array of shots with balls with samples), or a section \
             [tracks.columns] in dataset.toml that says which column is what"
                .to_owned()
        }
        _ => format!("{}, as [tracks] format states", format.name()),
    };
    let lacking = Some(text).filter(|_| matches!(format, Format::Auto | Format::Long)).and_then(lacking);
    let lacking = lacking.map_or(String::new(), |(line, missing)| {
        format!(", and what may be the names of columns, in line {line}, are without {missing}")
    });
    let message =
        format!("no format begins like this, \"{}\"{lacking}; expected {expected}", shortened(first.trim()));
    input.wrong(line, None, message);
}

/// Returns the line of a header like that of a long table, and the columns that it lacks.
fn lacking(text: &str) -> Option<(usize, String)> {
    const NEEDED: [(&str, &[&str]); 4] =
        [("ball", &["ball"]), ("x", &["x"]), ("y", &["y"]), ("frame or t", &["frame", "t"])];
    filled_lines(text).take(TITLES).find_map(|(line, content)| {
        Separator::ALL.into_iter().find_map(|separator| {
            let names = trimmed(unmarked(content), separator)?;
            let names = Heading::new("", line, separator, names).small();
            let is_missing =
                |(_, any): &&(&str, &[&str])| !names.iter().any(|name| any.contains(&name.as_str()));
            let missing: Vec<&str> = NEEDED.iter().filter(is_missing).map(|(name, _)| *name).collect();
            (1..=2).contains(&missing.len()).then(|| (line, missing.join(" and ")))
        })
    })
}
