//! Tracked paths of both balls, as programs that follow them in a film write them.

mod calibration;
mod check;
mod columns;
mod finish;
#[cfg(test)]
mod fuzz;
mod kinovea;
mod long;
mod number;
mod pair;
mod qualisys;
mod raw;
mod read;
pub(super) mod settings;
mod sheet;
mod shots_table;
mod survey;
mod text;
mod time;
mod tracker;
mod typed;

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use calibration::Calibration;
use finish::{Facts, Wrong};
use raw::{Notes, RawShot};
use settings::{Format, TrackSettings, Unit};
use shots_table::ShotsTable;

pub use survey::{Survey, survey};

use super::error::Problems;
use super::manifest::Manifest;
use crate::disc::Discs;
use crate::track::TrackShot;

/// The filmed shots of a data set.
#[derive(Clone, Debug)]
pub struct Tracks {
    pub shots: Vec<TrackShot>,
    /// Shots that the shots table says to skip: name and reason.
    pub skipped: Vec<(String, String)>,
    /// What was detected and repaired, with file and line.
    pub notes: Vec<String>,
    /// `None`: balls.
    pub discs: Option<Discs>,
}

/// Loads every file that the manifest names; what is wrong is added to the problems.
pub(super) fn load(
    manifest: &Manifest,
    settings: &TrackSettings,
    path: &Path,
    problems: &mut Problems,
) -> Tracks {
    let table = ShotsTable::read(settings.shots.as_deref(), manifest.assume, problems);
    if let Some((by, line, position)) = &manifest.by
        && !table.has_label(by)
    {
        let message =
            format!("[fit] by is \"{by}\"; expected a column of the table that [tracks] shots names");
        problems.add(path, Some(*line), Some(position), message);
    }
    let mut notes = Notes::default();
    let mut raw: Vec<RawShot> = Vec::new();
    let mut calibrations = HashMap::new();
    for file in &manifest.files {
        if settings.shots.as_ref().is_some_and(|shots| same_file(shots, file)) {
            continue;
        }
        let before = problems.len();
        let Some((mut shots, format)) = read::file(file, settings, problems, &mut notes) else { continue };
        let calibration = calibration_for(format, settings, file, problems, &mut notes);
        // What follows from a row that could not be read need not be said.
        if problems.len() > before {
            continue;
        }
        if shots.iter().flat_map(|shot| &shot.tracks).all(|track| track.rows.is_empty()) {
            problems.add(file, None, None, "has no rows below its header; expected positions");
            continue;
        }
        calibrations.insert(file.clone(), calibration);
        raw.append(&mut shots);
    }
    let broken = !problems.is_empty();
    pair::pair(&mut raw, settings, &mut notes);
    let known = name_shots(&raw, problems);
    if !broken {
        table.check_names(&known, problems);
    }
    drop(known);
    let mut skipped = Vec::new();
    raw.retain(|shot| match table.skip(&shot.name) {
        Some(reason) => {
            skipped.push((shot.name.clone(), reason.to_string()));
            false
        }
        None => true,
    });
    let mut work = Vec::with_capacity(raw.len());
    for shot in raw {
        let Some(facts) = table.facts(&shot.name) else {
            let message = format!(
                "nothing says how the cue ball of shot \"{}\" spins; expected [cue_spin] assume = \"stun\", \
                 \"natural-roll\" or \"unknown\", or cue_spin in the table that [tracks] shots names",
                shot.name
            );
            problems.add(path, None, None, message);
            break;
        };
        work.push((shot, facts));
    }
    let shots = finish_all(work, settings, &calibrations, problems, &mut notes);
    let mut lines = settings.notes.clone();
    lines.append(&mut notes.into_lines());
    Tracks { shots, skipped, notes: lines, discs: manifest.discs }
}

fn same_file(a: &Path, b: &Path) -> bool {
    a == b || matches!((fs::canonicalize(a), fs::canonicalize(b)), (Ok(a), Ok(b)) if a == b)
}

/// Lengths of Qualisys are millimetres; elsewhere dataset.toml says, and metres are assumed.
fn calibration_for(
    format: Format,
    settings: &TrackSettings,
    file: &Path,
    problems: &mut Problems,
    notes: &mut Notes,
) -> Calibration {
    match settings.unit {
        None if format == Format::Qualisys => {
            notes.add(raw::FORMAT, file, None, "lengths are in mm, as always in this format");
            return settings.calibration.in_millimetres();
        }
        None if format != Format::Long => {
            notes.add(
                raw::FORMAT,
                file,
                None,
                "lengths are taken as metres ([scale] length_unit is not given)",
            );
        }
        Some(unit) if format == Format::Qualisys && unit != Unit::Mm => {
            let message =
                "is an export of Qualisys, which is in mm; expected [scale] length_unit = \"mm\" or none";
            problems.add(file, None, None, message);
        }
        _ => {}
    }
    settings.calibration.clone()
}

/// The shots by name, with complaints about names given twice.
fn name_shots<'a>(raw: &'a [RawShot], problems: &mut Problems) -> HashMap<&'a str, usize> {
    let mut known = HashMap::with_capacity(raw.len());
    for (i, shot) in raw.iter().enumerate() {
        if let Some(first) = known.insert(shot.name.as_str(), i) {
            let first = &raw[first];
            let message =
                format!("\"{}\" also names the shot of {}:{}", shot.name, first.file.display(), first.line);
            problems.add(&shot.file, Some(shot.line), Some("shot"), message);
        }
    }
    known
}

/// Finished shots, what is wrong with others, and notes.
type Done = (Vec<TrackShot>, Vec<(PathBuf, Wrong)>, Notes);

/// Finishes shots on all cores; the order stays.
fn finish_all(
    mut work: Vec<(RawShot, Facts)>,
    settings: &TrackSettings,
    calibrations: &HashMap<PathBuf, Calibration>,
    problems: &mut Problems,
    notes: &mut Notes,
) -> Vec<TrackShot> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let part = work.len().div_ceil(threads).max(64);
    let mut parts = Vec::new();
    while !work.is_empty() {
        let rest = work.split_off(part.min(work.len()));
        parts.push(std::mem::replace(&mut work, rest));
    }
    let finish = |part: Vec<(RawShot, Facts)>| -> Done {
        let (mut shots, mut wrong, mut notes) =
            (Vec::with_capacity(part.len()), Vec::new(), Notes::default());
        for (raw, facts) in part {
            let file = raw.file.clone();
            let Some(calibration) = calibrations.get(file.as_path()) else { continue };
            match finish::shot(raw, facts, settings, calibration, &mut notes) {
                Ok(shot) => shots.push(shot),
                Err(error) => wrong.push((file.to_path_buf(), error)),
            }
        }
        (shots, wrong, notes)
    };
    let done: Vec<Done> = std::thread::scope(|scope| {
        let handles: Vec<_> = parts.into_iter().map(|part| scope.spawn(move || finish(part))).collect();
        handles.into_iter().filter_map(|handle| handle.join().ok()).collect()
    });
    let mut shots = Vec::new();
    for (mut own, wrong, own_notes) in done {
        shots.append(&mut own);
        for (file, (line, message)) in wrong {
            problems.add(&file, line, None, message);
        }
        notes.append(own_notes);
    }
    shots
}
