//! Which format a file is in, by what stands in it.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::number::shortened;
use super::raw::{Clock, Notes, RawShot, RawTrack};
use super::settings::{Format, TrackSettings, Unit};
use super::sheet::Sheet;
use super::text::{decode, lines};
use super::{columns, json, kinovea, long, qualisys, tracker, typed};
use crate::io::error::Problems;
use crate::io::table::is_separator_line;

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
    let mut text = decode(bytes, file, notes);
    let stem = file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let first = lines(&text).next().map_or("", |(_, line)| line);
    if is_separator_line(first) {
        // a blank line in its place, so that all others keep their numbers
        text = Cow::Owned(text[first.len()..].to_string());
    }
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
    let message = format!("no format begins like this, \"{}\"; {expected}", shortened(first.trim()));
    problems.add(file, Some(line), None, message);
}
