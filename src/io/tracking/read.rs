//! Which format a file is in, by what stands in it.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::heading::{Heading, TITLES};
use super::raw::{Clock, FORMAT, Notes, RawShot, RawTrack};
use super::settings::{Format, TrackSettings, Unit};
use super::sheet::Sheet;
use super::{columns, json, kinovea, long, qualisys, tracker, typed};
use crate::io::error::Problems;
use crate::io::number::shortened;
use crate::io::text::{Separator, decode, lines, trimmed, unmarked, without_separator_line};

/// What was read from a file.
pub(super) struct Tracked {
    pub shots: Vec<RawShot>,
    pub format: Format,
    /// Unit of its lengths, where the file or its format states it.
    pub unit: Option<Unit>,
}

/// The shots of a file.
pub(super) fn file(
    file: &Path,
    settings: &TrackSettings,
    problems: &mut Problems,
    notes: &mut Notes,
) -> Option<Tracked> {
    match fs::read(file) {
        Ok(content) => bytes(file, &content, settings, problems, notes),
        Err(error) => {
            problems.add(file, None, None, format!("cannot be read: {error}"));
            None
        }
    }
}

/// The same, of a file's content.
pub(super) fn bytes(
    file: &Path,
    bytes: &[u8],
    settings: &TrackSettings,
    problems: &mut Problems,
    notes: &mut Notes,
) -> Option<Tracked> {
    let (text, latin) = decode(bytes);
    if let Some(line) = latin {
        let message = "is not UTF-8 text from here on; read as Latin-1, which matters to names only";
        notes.add(FORMAT, file, Some(line), message);
    }
    let (text, _) = without_separator_line(text);
    let stem = file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    if let Some(wanted) = &settings.columns {
        let (shots, unit) = columns::read(file, &text, &stem, wanted, settings, problems, notes)?;
        return Some(Tracked { shots, format: Format::Columns, unit });
    }
    let wanted = |format: Format| settings.format == format || settings.format == Format::Auto;
    if wanted(Format::Json) && json::detect(&text) {
        let (shots, unit) = json::read(file, &text, &stem, settings, problems, notes)?;
        return Some(Tracked { shots, format: Format::Json, unit });
    }
    if wanted(Format::Qualisys) && qualisys::detect(&text) {
        let (clock, tracks) = qualisys::read(file, &text, problems, notes)?;
        return Some(one_shot(file, &stem, clock, tracks, Format::Qualisys, Some(Unit::Mm)));
    }
    if wanted(Format::Kinovea)
        && let Some(head) = kinovea::detect(&text)
    {
        let (clock, tracks) = kinovea::read(file, &text, head, problems, notes)?;
        return Some(one_shot(file, &stem, clock, tracks, Format::Kinovea, None));
    }
    if wanted(Format::Long)
        && let Some(head) = long::detect(&text, settings)
    {
        let long::Stated { clock, unit } = long::check_head(&head, file, settings, problems, notes)?;
        long::note_comments(&text, &head, file, notes);
        let columns = head.columns;
        let mut gather = long::Gather::new(file, &stem, clock);
        let sheet = Sheet {
            file,
            text: &text,
            separator: head.heading.separator,
            header: head.heading.line,
            above: head.heading.above,
            offset: 0,
            names: head.heading.names,
        };
        typed::read(&sheet, &columns, &mut gather, problems, notes);
        return Some(Tracked { shots: gather.shots, format: Format::Long, unit });
    }
    if wanted(Format::Tracker)
        && let Some(head) = tracker::detect(&text)
    {
        let (clock, tracks, unit) = tracker::read(file, &text, head, &stem, settings, problems, notes)?;
        return Some(one_shot(file, &stem, clock, tracks, Format::Tracker, unit));
    }
    unknown(file, &text, settings.format, problems);
    None
}

/// A file that is one shot, named after it.
fn one_shot(
    file: &Path,
    stem: &str,
    clock: Clock,
    tracks: Vec<RawTrack>,
    format: Format,
    unit: Option<Unit>,
) -> Tracked {
    let line = tracks.iter().map(RawTrack::line).min().unwrap_or(1);
    let file: Arc<PathBuf> = Arc::new(file.to_path_buf());
    Tracked { shots: vec![RawShot { name: stem.to_string(), file, line, clock, tracks }], format, unit }
}

fn unknown(file: &Path, text: &str, format: Format, problems: &mut Problems) {
    let first = lines(text).find(|(_, line)| !line.trim().is_empty());
    let Some((line, first)) = first else {
        problems.add(file, None, None, "is empty; expected tracked positions");
        return;
    };
    let expected = match format {
        Format::Auto => {
            "expected a long table (shot,frame,ball,x,y), an export of Tracker, Kinovea or Qualisys, JSON (an array of shots with balls with samples), or a section \
             [tracks.columns] in dataset.toml that says which column is what"
        }
        Format::Long => "expected the header of a long table, such as shot,frame,ball,x,y",
        Format::Tracker => {
            "expected an export of Tracker: a line of columns with t, x and y below the track's name"
        }
        Format::Kinovea => "expected an export of Kinovea, text or CSV",
        Format::Qualisys => "expected an export of Qualisys, which begins with NO_OF_FRAMES or FILE_VERSION",
        Format::Json => "expected JSON: an array of shots, each with balls, each with samples",
        Format::Columns => "expected the columns that [tracks.columns] names",
    };
    let lacking = if matches!(format, Format::Auto | Format::Long) { lacking(text) } else { String::new() };
    let message = format!("no format begins like this, \"{}\"{lacking}; {expected}", shortened(first.trim()));
    problems.add(file, Some(line), None, message);
}

/// What a header that is nearly that of a long table lacks, as a part of a sentence.
fn lacking(text: &str) -> String {
    let header =
        lines(text).filter(|(_, line)| !line.trim().is_empty()).take(TITLES).find_map(|(line, content)| {
            Separator::ALL.into_iter().find_map(|separator| {
                let names = trimmed(unmarked(content), separator)?;
                let heading = Heading::new("", line, separator, names);
                let names: Vec<String> = heading.bare.iter().map(|name| name.to_lowercase()).collect();
                let has = |name: &str| names.iter().any(|own| own == name);
                let parts = [
                    ("ball", has("ball")),
                    ("x", has("x")),
                    ("y", has("y")),
                    ("frame or t", has("frame") || has("t")),
                ];
                let missing: Vec<&str> =
                    parts.iter().filter(|(_, there)| !there).map(|(name, _)| *name).collect();
                (1..=2).contains(&missing.len()).then(|| (line, missing.join(" and ")))
            })
        });
    header.map_or(String::new(), |(line, missing)| {
        format!(", and what may be the names of columns, in line {line}, are without {missing}")
    })
}
