//! Tracked paths of both balls in the formats of tracking programs.
//!
//! Bytes become text; a format says which column is what ([`layout`]); one reader makes
//! rows, tracks and shots, in the file's units ([`raw`]); balls are assigned, times converted and
//! faults of the camera repaired ([`finish`]).

pub(crate) mod camera;
mod finish;
mod formats;
mod heading;
mod json;
mod names;
mod pieces;
mod raw;
mod read;
mod reader;
mod repair;
pub(crate) mod settings;
pub(crate) mod shots_table;
mod survey;
mod time;
mod units;
mod words;

use std::fs;
use std::path::PathBuf;

use raw::{Job, Notes, RawShot, Stated, Subject, listed};
use rayon::prelude::*;
use repair::Wrong;
use settings::{Format, TrackSettings};
use shots_table::{Facts, ShotsTable};
use units::Unit;

use super::check_unique;
use super::error::Problems;
use super::manifest::{Manifest, StatedSpin};
use super::toml_file::Source;
use crate::measurement::dataset::Tracks;

pub(super) use read::{TRACKER_PROJECT, is_tracker_project};
pub(crate) use survey::Survey;

/// Least number of shots that a core gets at a time.
const MIN_SHOTS_PER_CORE: usize = 64;

/// Loads every file of the manifest; adds to the problems.
pub(crate) fn load(manifest: &Manifest, settings: &TrackSettings, source: &Source) -> Tracks {
    let (path, problems) = (source.path, source.problems);
    let table = ShotsTable::read(settings, manifest.assume, problems);
    if let Some(by) = manifest.dataset.by.as_ref().filter(|by| !table.others.labels.contains_key(*by)) {
        let message =
            format!("[fit] by is \"{by}\"; expected a column of the table that [tracks] shots names");
        source.wrong("fit.by", message);
    }
    let notes = Notes::default();
    let canonical = |path: &PathBuf| fs::canonicalize(path).ok();
    let of_shots = settings.shots.as_ref().and_then(canonical);
    let is_shots = |file: &&PathBuf| of_shots.is_some() && canonical(file) == of_shots;
    let files: Vec<&PathBuf> = manifest.files.iter().filter(|file| !is_shots(file)).collect();
    let (mut shots, mut is_motion_capture) = (Vec::new(), true);
    for file in &files {
        let before = problems.len();
        let job = Job { file, settings, notes: &notes };
        let Some(read) = read::file(job, problems, files.len() == 1) else { continue };
        if let Some(first) = read.first() {
            is_motion_capture &= first.stated.format == Format::Qualisys;
            check_unit(first.stated, job, problems);
        }
        // consequences of unreadable rows are not reported
        if problems.len() > before {
            continue;
        }
        if read.iter().flat_map(|shot| &shot.tracks).all(|track| track.rows.is_empty()) {
            problems.add(file, None, None, "has no rows below its header; expected positions");
        }
        shots.extend(read);
    }
    let are_whole = problems.is_empty();
    names::pair(&mut shots, settings, &notes);
    table.name_by_file(&mut shots);
    if settings.video.has_unknown_rate() && table.has_rates {
        let message = "[video] capture_fps is \"unknown\", but the table of shots states capture_fps; expected it for all \
                       shots or for none";
        problems.add(path, None, None, message);
    }
    names::name_by_folder(&mut shots, &notes);
    let names = shots.iter().map(|shot| (shot.name.as_str(), shot.file.as_path(), shot.line));
    let remedy = ": another name of the file, or a table under [tracks] shots with the columns shot and file";
    check_unique(names.clone(), remedy, problems);
    if are_whole {
        table.check_names(&names.map(|(name, ..)| name).collect());
    }
    let mut tracks = Tracks::default();
    shots.retain(|shot| {
        let skip = &table.facts(&shot.name).skip;
        tracks.left_out.extend(skip.iter().map(|reason| (shot.name.clone(), format!("skipped: {reason}"))));
        skip.is_none()
    });
    let names = shots.iter().map(|shot| shot.name.as_str());
    check_spins(names.filter(|name| table.facts(name).stated == StatedSpin::Unstated), UNSTATED, source);
    finish_all(shots, &table, &notes, &mut tracks);
    let unmeasured = tracks.shots.iter().filter(|shot| manifest.discs.is_none() && shot.markers.is_empty());
    let names = unmeasured.map(|shot| shot.name.as_str());
    check_spins(names.filter(|name| table.facts(name).stated == StatedSpin::Measured), UNMEASURED, source);
    Tracks {
        left_out: tracks.left_out,
        notes: settings.notes.iter().cloned().chain(notes.into_lines()).chain(table.note).collect(),
        discs: manifest.discs,
        camera: settings.camera.values(is_motion_capture),
        rate_sd: settings.rate_sd(),
        tilt_sd: settings.tilt_sd,
        topspin_sd: settings.topspin_sd,
        from_balls: settings.from_balls,
        scale_sd: (!settings.from_balls).then(|| settings.scale.sd.unwrap_or(Tracks::SCALE_SD)),
        ..Tracks::new(tracks.shots)
    }
}

/// Notes the unit of lengths that a file states, or that it does not state one; complains if it
/// contradicts dataset.toml.
fn check_unit(stated: Stated, job: Job, problems: &Problems) {
    let message = match (job.settings.scale.length_unit, stated.unit.map(|unit| (unit, unit.name()))) {
        (None, Some((Unit::Px, _))) => {
            "its positions are in pixels; expected [scale] length_unit = \"px\"".to_string()
        }
        (None, Some((_, unit))) => {
            return job.note(Subject::Format, None, format!("lengths are in {unit}, as the file says"));
        }
        (Some(given), Some((unit, name))) if given != unit => {
            let given = given.name();
            format!(
                "its positions are in {name}, but [scale] length_unit is \"{given}\"; expected [scale] length_unit = \"{name}\" or none"
            )
        }
        (None, None) if stated.format != Format::Long => {
            let message = "lengths are taken as metres ([scale] length_unit is not given)";
            return job.note(Subject::Format, None, message);
        }
        _ => return,
    };
    problems.add(job.file, None, None, message);
}

const UNSTATED: [&str; 2] = [
    "the cue ball's",
    "stated; expected [cue_spin] assume = \"stun\", \"natural-roll\" or \"unknown\", or cue_spin in the table that [tracks] shots \
     names",
];
const UNMEASURED: [&str; 2] = [
    "[cue_spin] assume is \"measured\", but the",
    "measured; expected omega_x, omega_y and omega_z in a table that [tracks] shots names, markers on the cue ball ([tracks] \
     cue_markers), or assume = \"natural-roll\", \"stun\" or \"unknown\"",
];

/// Complains about the spin of these shots, if there are any.
fn check_spins<'a>(shots: impl Iterator<Item = &'a str>, why: [&str; 2], source: &Source) {
    let names: Vec<&str> = shots.collect();
    if !names.is_empty() {
        let message = format!("{} spin of shot {} is not {}", why[0], listed(&names), why[1]);
        source.problems.add(source.path, None, None, message);
    }
}

/// Adds the finished shots, on all cores, in order. Damaged ones are left out, with name and reason.
/// A fault of the file or of dataset.toml is a problem of the data set, as is that no shot remains.
fn finish_all(shots: Vec<RawShot>, table: &ShotsTable, notes: &Notes, tracks: &mut Tracks) {
    let settings = table.settings;
    let work: Vec<_> = shots.into_iter().map(|raw| (table.facts(&raw.name).clone(), raw)).collect();
    let finish = |(facts, raw): (Facts, RawShot)| {
        let (name, file, notes) = (raw.name.clone(), raw.file.clone(), Notes::default());
        let shot = finish::shot(raw, facts, Job { file: &file, settings, notes: &notes });
        (name, file, shot, notes)
    };
    let done: Vec<_> = work.into_par_iter().with_min_len(MIN_SHOTS_PER_CORE).map(finish).collect();
    let mut faults = Vec::new();
    for (name, file, shot, own_notes) in done {
        notes.append(own_notes);
        match shot {
            Ok(shot) => tracks.shots.push(shot),
            Err(wrong) => faults.extend(wrong.into_iter().map(|wrong| (name.clone(), file.clone(), wrong))),
        }
    }
    for (name, file, Wrong { line, message, is_damage }) in faults {
        if is_damage && !tracks.shots.is_empty() {
            tracks.left_out.push((name, format!("{}:{line}: {message}", file.display())));
        } else {
            table.problems.add(&file, line, None, message);
        }
    }
}
