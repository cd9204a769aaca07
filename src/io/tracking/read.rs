//! Which format a file is in, by what stands in it.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::number::shortened;
use super::raw::{Clock, Notes, RawShot, RawTrack};
use super::settings::{Format, TrackSettings};
use super::sheet::Sheet;
use super::text::{decode, lines};
use super::{columns, kinovea, long, qualisys, tracker, typed};
use crate::io::error::Problems;

/// The shots of a file, and its format.
pub(super) fn file(
    file: &Path,
    settings: &TrackSettings,
    problems: &mut Problems,
    notes: &mut Notes,
) -> Option<(Vec<RawShot>, Format)> {
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
) -> Option<(Vec<RawShot>, Format)> {
    let text = decode(bytes, file, notes);
    let stem = file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    if let Some(wanted) = &settings.columns {
        let shots = columns::read(file, &text, &stem, wanted, settings, problems, notes)?;
        return Some((shots, Format::Columns));
    }
    let wanted = |format: Format| settings.format == format || settings.format == Format::Auto;
    if wanted(Format::Qualisys) && qualisys::detect(&text) {
        let (clock, tracks) = qualisys::read(file, &text, problems, notes)?;
        return Some(one_shot(file, &stem, clock, tracks, Format::Qualisys));
    }
    if wanted(Format::Kinovea)
        && let Some(head) = kinovea::detect(&text)
    {
        let (clock, tracks) = kinovea::read(file, &text, head, problems, notes)?;
        return Some(one_shot(file, &stem, clock, tracks, Format::Kinovea));
    }
    if wanted(Format::Long)
        && let Some(head) = long::detect(&text, settings)
    {
        if !long::check_head(&head, file, problems, notes) {
            return None;
        }
        long::note_comments(&text, &head, file, notes);
        let columns = head.columns;
        let mut gather = long::Gather::new(file, &stem, columns.frames);
        let sheet = Sheet {
            file,
            text: &text,
            separator: head.separator,
            header: head.header,
            above: head.header,
            offset: 0,
            names: head.names,
        };
        typed::read(&sheet, &columns, &mut gather, problems, notes);
        return Some((gather.shots, Format::Long));
    }
    if wanted(Format::Tracker)
        && let Some(head) = tracker::detect(&text)
    {
        let (clock, tracks) = tracker::read(file, &text, head, &stem, settings, problems, notes)?;
        return Some(one_shot(file, &stem, clock, tracks, Format::Tracker));
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
) -> (Vec<RawShot>, Format) {
    let line = tracks.iter().map(RawTrack::line).min().unwrap_or(1);
    let file: Arc<PathBuf> = Arc::new(file.to_path_buf());
    (vec![RawShot { name: stem.to_string(), file, line, clock, tracks }], format)
}

fn unknown(file: &Path, text: &str, format: Format, problems: &mut Problems) {
    let first = lines(text).find(|(_, line)| !line.trim().is_empty());
    let Some((line, first)) = first else {
        problems.add(file, None, None, "is empty; expected tracked positions");
        return;
    };
    let expected = match format {
        Format::Auto => {
            "expected a long table (shot,frame,ball,x,y), an export of Tracker, Kinovea or Qualisys, or a section \
             [tracks.columns] in dataset.toml that says which column is what"
        }
        Format::Long => "expected the header of a long table, such as shot,frame,ball,x,y",
        Format::Tracker => {
            "expected an export of Tracker: a line of columns with t, x and y below the track's name"
        }
        Format::Kinovea => "expected an export of Kinovea, text or CSV",
        Format::Qualisys => "expected an export of Qualisys, which begins with NO_OF_FRAMES",
        Format::Columns => "expected the columns that [tracks.columns] names",
    };
    let message = format!("no format begins like this, \"{}\"; {expected}", shortened(first.trim()));
    problems.add(file, Some(line), None, message);
}
