//! Tracked paths of both balls in the formats of tracking programs.
//!
//! Bytes become text; a format says which column is what ([`layout`]); one reader makes shots of
//! tracks of rows of it, in the file's units ([`raw`]); balls are assigned, times converted and
//! faults of the camera repaired ([`finish`]).

mod calibration;
pub(crate) mod camera;
mod clock;
mod column_names;
mod columns;
mod discs;
mod finish;
mod formats;
mod guess;
mod heading;
mod input;
mod json;
mod layout;
mod names;
mod pieces;
mod raw;
mod read;
mod reader;
mod repair;
mod sample;
pub(crate) mod settings;
pub(crate) mod shots_table;
mod survey;
mod time;
mod units;
mod words;

use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};

use calibration::Calibration;
use input::{Context, Notes, Subject};
use raw::RawShot;
use rayon::prelude::*;
use repair::Wrong;
use settings::{Format, TrackSettings};
use shots_table::{Facts, ShotsTable};
use units::Unit;

use super::check_unique;
use super::error::Problems;
use super::manifest::Manifest;
use crate::measurement::dataset::Tracks;
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;

pub(super) use column_names::Column;
pub(super) use guess::Guess;
pub(super) use read::{TRACKER_PROJECT, is_tracker_project};
pub(crate) use survey::{Survey, survey};

/// Least number of shots that a core gets at a time.
const MIN_SHOTS_PER_CORE: usize = 64;

/// Returns the metres of a unit of dataset.toml; `None` for pixels.
pub(super) fn metres(unit: &str) -> Option<f64> {
    Unit::of(unit)?.metres().map(|(times, over)| times / over)
}

/// Loads every file of the manifest; adds to the problems.
pub(crate) fn load(manifest: &Manifest, settings: &TrackSettings, problems: &Problems) -> Tracks {
    let path = manifest.dataset.path.as_path();
    let table = ShotsTable::read(settings.shots.as_deref(), manifest.assume, problems);
    if let Some(by) = &manifest.dataset.by
        && !table.has_label(by)
    {
        let (line, position) = &manifest.place_of_by;
        let message =
            format!("[fit] by is \"{by}\"; expected a column of the table that [tracks] shots names");
        problems.add(path, *line, position.as_str(), message);
    }
    let notes = Notes::default();
    let context = Context { settings, problems, notes: &notes };
    let Files { mut shots, calibrations, is_motion_capture } = read_all(&manifest.files, context);
    let are_whole = problems.is_empty();
    names::pair(&mut shots, settings, &notes);
    table.name_by_file(&mut shots);
    if settings.has_unknown_rate() && table.has_rates() {
        let message = "[video] capture_fps is \"unknown\", but the table of shots states capture_fps; expected it for all \
                       shots or for none";
        problems.add(path, None, None, message);
    }
    name_by_folder(&mut shots, &notes);
    let names = shots.iter().map(|shot| (shot.name.as_str(), shot.file.as_path(), shot.line));
    let remedy = ": another name of the file, or a table under [tracks] shots with the columns shot and file";
    check_unique(names.clone(), remedy, problems);
    if are_whole {
        table.check_names(&names.map(|(name, ..)| name).collect());
    }
    let mut left_out = Vec::new();
    shots.retain(|shot| {
        let skip = table.skip(&shot.name);
        left_out.extend(skip.map(|reason| (shot.name.clone(), format!("skipped: {reason}"))));
        skip.is_none()
    });
    let mut work = with_facts(shots, &table, manifest, context);
    discs::group(&mut work, settings, &calibrations, &notes);
    let (shots, damaged) = finish_all(work, &calibrations, context);
    left_out.extend(damaged);
    if manifest.discs.is_none() {
        name_unmeasured(&shots, &table, path, problems);
    }
    let stated = &settings.stated;
    let mut lines = settings.notes.clone();
    lines.append(&mut notes.into_lines());
    lines.extend(table.note());
    Tracks {
        left_out,
        notes: lines,
        discs: manifest.discs,
        camera: stated.camera.values(is_motion_capture),
        rate_sd: stated.video.relative_sd(),
        tilt_sd: stated.tilt_sd,
        topspin_sd: stated.topspin_sd,
        from_balls: settings.from_balls,
        scale_sd: (!settings.from_balls).then(|| stated.scale.sd.unwrap_or(Tracks::SCALE_SD)),
        ..Tracks::new(shots)
    }
}

/// The content of all files.
struct Files {
    shots: Vec<RawShot>,
    calibrations: HashMap<PathBuf, Calibration>,
    is_motion_capture: bool,
}

fn read_all(files: &[PathBuf], context: Context) -> Files {
    let Context { settings, problems, .. } = context;
    let is_shots = |file: &&PathBuf| settings.shots.as_ref().is_some_and(|shots| is_same_file(shots, file));
    let files: Vec<&PathBuf> = files.iter().filter(|file| !is_shots(file)).collect();
    let mut all = Files { shots: Vec::new(), calibrations: HashMap::new(), is_motion_capture: true };
    for file in &files {
        let before = problems.len();
        let tracked = read::file(file, context, files.len() == 1);
        let Some(read::Tracked { mut shots, format, unit }) = tracked else { continue };
        all.is_motion_capture &= format == Format::Qualisys;
        let calibration = calibration_for(format, unit, file, context);
        // consequences of unreadable rows are not reported
        if problems.len() > before {
            continue;
        }
        if shots.iter().all(|shot| shot.rows().next().is_none()) {
            problems.add(file, None, None, "has no rows below its header; expected positions");
            continue;
        }
        all.calibrations.insert((*file).clone(), calibration);
        all.shots.append(&mut shots);
    }
    all
}

fn is_same_file(a: &Path, b: &Path) -> bool {
    a == b || matches!((fs::canonicalize(a), fs::canonicalize(b)), (Ok(a), Ok(b)) if a == b)
}

/// Returns the calibration in the unit of the file, or else of dataset.toml, or else metres.
fn calibration_for(format: Format, stated: Option<Unit>, file: &Path, context: Context) -> Calibration {
    let Context { settings, problems, notes } = context;
    let log = notes.of(file);
    match (settings.unit(), stated) {
        (None, Some(unit)) => match unit.metres() {
            Some(metres) => {
                log.add(Subject::Format, None, format!("lengths are in {}, as the file says", unit.name()));
                return Calibration { scale: metres, readout: None, ..settings.calibration.clone() };
            }
            None => {
                let message = "its positions are in pixels; expected [scale] length_unit = \"px\"";
                problems.add(file, None, None, message);
            }
        },
        (Some(given), Some(unit)) if given != unit => {
            let message = format!(
                "its positions are in {0}, but [scale] length_unit is \"{1}\"; expected [scale] length_unit = \"{0}\" or none",
                unit.name(),
                given.name()
            );
            problems.add(file, None, None, message);
        }
        (None, None) if format != Format::Long => {
            log.add(Subject::Format, None, "lengths are taken as metres ([scale] length_unit is not given)");
        }
        _ => {}
    }
    settings.calibration.clone()
}

/// Puts the folder before equal names of shots from different folders, as of A/1.csv and B/1.csv.
fn name_by_folder(raw: &mut [RawShot], notes: &Notes) {
    let folder = |shot: &RawShot| shot.file.parent()?.file_name().map(|name| name.display().to_string());
    let mut folders: HashMap<String, Vec<Option<String>>> = HashMap::new();
    for shot in raw.iter() {
        folders.entry(shot.name.clone()).or_default().push(folder(shot));
    }
    for shot in raw {
        let all = &folders[&shot.name];
        let different: HashSet<&String> = all.iter().flatten().collect();
        if all.len() > 1 && different.len() == all.len() {
            let message = "files in several folders have equal names: their shots are named with the folder";
            notes.of(&shot.file).add(Subject::Names, None, message);
            shot.name = format!("{}/{}", folder(shot).unwrap_or_default(), shot.name);
        }
    }
}

/// Returns the shots with what the table of shots and dataset.toml state; complains about spins.
fn with_facts(
    shots: Vec<RawShot>,
    table: &ShotsTable,
    manifest: &Manifest,
    context: Context,
) -> Vec<(RawShot, Facts)> {
    let (path, problems) = (manifest.dataset.path.as_path(), context.problems);
    let mut is_complained = false;
    let mut work = Vec::with_capacity(shots.len());
    for shot in shots {
        let facts = table.facts(&shot.name, context.settings);
        // other faults of such shots are reported, too
        if !table.states_spin(&shot.name) && !is_complained {
            let message = format!(
                "the cue ball's spin of shot \"{}\" is not stated; expected [cue_spin] assume = \"stun\", \
                 \"natural-roll\" or \"unknown\", or cue_spin in the table that [tracks] shots names",
                shot.name
            );
            problems.add(path, None, None, message);
            is_complained = true;
        }
        if manifest.discs.is_some() && !matches!(facts.spin, Spin::Stun | Spin::Unknown) {
            let message = format!(
                "shot \"{}\" is of discs, which do not roll; expected cue_spin stun (neither disc turns before the impact) or \
                 unknown: points on the discs show how they turn",
                shot.name
            );
            problems.add(context.settings.shots.as_deref().unwrap_or(path), None, "cue_spin", message);
            continue;
        }
        work.push((shot, facts));
    }
    work
}

/// Finishes shots on all cores, in order. Damaged shots are left out, with name and reason. A fault
/// of the file or of dataset.toml is a problem of the data set, as is that no shot remains.
fn finish_all(
    work: Vec<(RawShot, Facts)>,
    calibrations: &HashMap<PathBuf, Calibration>,
    context: Context,
) -> (Vec<TrackShot>, Vec<(String, String)>) {
    let Context { settings, problems, notes } = context;
    let finish = |(raw, facts): (RawShot, Facts)| {
        let (name, file, notes) = (raw.name.clone(), raw.file.clone(), Notes::default());
        let calibration = calibrations.get(file.as_path())?;
        let shot = finish::shot(raw, facts, settings, calibration, &notes);
        Some((name, file, shot, notes))
    };
    let done: Vec<_> = work.into_par_iter().with_min_len(MIN_SHOTS_PER_CORE).filter_map(finish).collect();
    let (mut shots, mut damaged) = (Vec::with_capacity(done.len()), Vec::new());
    for (name, file, shot, own_notes) in done {
        notes.append(own_notes);
        for wrong in shot.map(|shot| shots.push(shot)).err().unwrap_or_default() {
            if wrong.is_damage {
                damaged.push((name.clone(), file.clone(), wrong));
            } else {
                problems.add(&file, wrong.line, None, wrong.message);
            }
        }
    }
    if shots.is_empty() {
        for (_, file, Wrong { line, message, .. }) in damaged.drain(..) {
            problems.add(&file, line, None, message);
        }
    }
    let reasons = damaged.into_iter().map(|(name, file, Wrong { line, message, .. })| {
        let line = line.map_or(String::new(), |line| format!(":{line}"));
        (name, format!("{}{line}: {message}", file.display()))
    });
    (shots, reasons.collect())
}

/// Complains about spins stated as measured without numbers or markers.
fn name_unmeasured(shots: &[TrackShot], table: &ShotsTable, path: &Path, problems: &Problems) {
    let is_unmeasured = |shot: &&TrackShot| shot.markers.is_empty() && table.is_by_markers(&shot.name);
    let mut names = shots.iter().filter(is_unmeasured).map(|shot| shot.name.as_str());
    let Some(first) = names.next() else { return };
    let others = names.count();
    let others = if others > 0 { format!(" and {others} more") } else { String::new() };
    let message = format!(
        "[cue_spin] assume is \"measured\", but the spin of shot \"{first}\"{others} is not measured; expected omega_x, omega_y and \
         omega_z in a table that [tracks] shots names, markers on the cue ball ([tracks] cue_markers), or assume = \"natural-roll\", \"stun\" or \"unknown\""
    );
    problems.add(path, None, None, message);
}
