//! Tracked paths: a format says which column of a file is what ([`formats`]), one reader makes
//! shots in the file's units ([`raw`]), and balls are assigned and faults repaired ([`finish`]).

pub(crate) mod camera;
mod finish;
mod follow;
mod formats;
mod heading;
mod names;
mod raw;
mod read;
mod reader;
mod repair;
pub(crate) mod settings;
mod survey;
mod time;
mod words;

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::PathBuf;

use indexmap::IndexMap;
use raw::{Job, RawShot, Stated};
use rayon::prelude::*;
use settings::{Format, NAMED, TrackSettings};
use words::Unit;

use super::check_unique;
use super::error::{Log, Subject, did_you_mean, message};
use super::manifest::{Manifest, StatedSpin};
use super::table::{OMEGA, Table};
use super::toml_file::Source;
use crate::measurement::dataset::Tracks;
use crate::measurement::fault::{Condition, FINITE};
use crate::measurement::spin::Spin;

pub(crate) use survey::Survey;

/// Loads every file of the manifest; adds to the log of the source.
pub(crate) fn load(manifest: &Manifest, settings: &TrackSettings, source: &Source) -> Tracks {
    let log = source.log;
    let table = ShotsTable::read(settings, manifest, log);
    if let Some(by) = manifest.dataset.by.as_ref().filter(|by| !table.others.labels.contains_key(*by)) {
        source.wrong("fit.by", message!("no_label", by));
    }
    let is_shots = |file: &PathBuf| settings.shots.as_ref() == Some(file);
    let files: Vec<&PathBuf> = manifest.files.iter().filter(|file| !is_shots(file)).collect();
    let (mut shots, mut is_motion_capture) = (Vec::new(), true);
    for file in &files {
        let before = log.len();
        let job = Job { file, text: "", settings, log };
        let Some(read) = read::file(job, files.len() == 1) else { continue };
        if let Some(first) = read.first() {
            is_motion_capture &= first.stated.format == Format::Qualisys;
            check_unit(first.stated, job);
        }
        // consequences of unreadable rows are not reported
        if log.len() == before {
            if read.iter().flat_map(|shot| &shot.tracks).all(|track| track.rows.is_empty()) {
                job.wrong(None, None, "has no rows below its header; expected positions");
            }
            shots.extend(read);
        }
    }
    let are_whole = log.is_empty();
    let job = Job { file: source.path, text: "", settings, log };
    names::pair(&mut shots, job);
    table.name_by_file(&mut shots, log);
    names::name_by_folder(&mut shots, job);
    let names = shots.iter().map(|shot| (shot.name.as_str(), shot.file.as_path(), shot.line));
    let remedy = ": another name of the file, or a table under [tracks] shots with the columns shot and file";
    check_unique(names.clone(), remedy, log);
    if are_whole {
        table.check_names(&names.map(|(name, ..)| name).collect(), log);
    }
    let mut tracks = settings.film.clone();
    shots.retain(|shot| {
        let skip = &table.facts(&shot.name).skip;
        tracks.left_out.extend(skip.iter().map(|reason| (shot.name.clone(), format!("skipped: {reason}"))));
        skip.is_none()
    });
    finish_all(shots, &table, job, &mut tracks);
    tracks.notes.extend(log.notes().into_iter().chain(table.note));
    tracks.camera = settings.camera.values(is_motion_capture);
    tracks.fps = tracks.shots.first().map(|shot| shot.fps);
    tracks
}

/// Notes the unit of lengths that a file states or lacks; complains if it contradicts dataset.toml.
fn check_unit(stated: Stated, job: Job) {
    match (job.settings.scale.length_unit, stated.unit) {
        (given, Some(own)) if given.map_or(own == Unit::Px, |given| given != own) => {
            job.wrong(None, None, message!("other_unit", unit => own.name()));
        }
        (None, own) if own.is_some() || stated.format != Format::Long => {
            job.note(Subject::Format, None, message!("unit", stated => own.map(Unit::name)));
        }
        _ => {}
    }
}

/// Adds the finished shots, on all cores, in order. Damaged ones are left out with a reason; a
/// fault of the file or of dataset.toml is a problem of the data set, as is that no shot remains.
fn finish_all(shots: Vec<RawShot>, table: &ShotsTable, Job { settings, log, .. }: Job, tracks: &mut Tracks) {
    let finish = |raw: RawShot| {
        let (name, file, log) = (raw.name.clone(), raw.file.clone(), Log::default());
        let shot = finish::shot(raw, table.facts(&name), Job { file: &file, text: "", settings, log: &log });
        (name, shot, log)
    };
    let done: Vec<_> = shots.into_par_iter().map(finish).collect();
    let mut damaged = Vec::new();
    for (name, shot, own_log) in done {
        damaged.extend(log.append(own_log).into_iter().map(|damage| (name.clone(), damage)));
        tracks.shots.extend(shot);
    }
    for (name, damage) in damaged {
        if tracks.shots.is_empty() {
            log.add(&damage.file, damage.line, None, damage.message);
        } else {
            tracks.left_out.push((name, damage.to_string()));
        }
    }
}

/// Frame rates of cameras, frames/s.
const RATE: Condition = (|fps| fps > 0.0 && fps <= 1e5, "more than 0, at most 100000");
/// Columns of the table of shots with a meaning; all others are labels.
pub(super) const KNOWN: &str =
    "shot cue_spin omega_x omega_y omega_z skip note file cue object cue_markers object_markers capture_fps";
/// Separator of several names of tracks in a cell.
const BETWEEN: char = ';';

/// Statements about a shot: of its row or, for empty cells and without a row, of dataset.toml.
#[derive(Clone, Default)]
pub(super) struct Facts {
    line: usize,
    /// The reason, if the shot is to be skipped.
    skip: Option<String>,
    pub(crate) stated: StatedSpin,
    /// The file that holds the shot, as written.
    file: Option<String>,
    pub(crate) labels: BTreeMap<String, String>,
    /// Names of tracks, in the order of [`NAMED`].
    pub(crate) names: [Vec<String>; 4],
    /// Whether its own row, or its tracks, name one of the balls.
    pub(crate) names_balls: bool,
    pub(crate) capture_fps: Option<f64>,
}

impl Facts {
    /// Returns the spin, which is unknown if it is not stated, or until markers show it.
    pub(super) fn spin(&self) -> Spin {
        if let StatedSpin::Is(spin) = self.stated { spin } else { Spin::Unknown }
    }
}

/// The rows of the table that `[tracks] shots` names, by the names of shots, in the file's order.
#[derive(Default)]
struct ShotsTable {
    path: PathBuf,
    rows: IndexMap<String, Facts>,
    /// The facts of shots without a row, whose labels are empty.
    others: Facts,
    note: Option<String>,
}

impl ShotsTable {
    fn read(settings: &TrackSettings, manifest: &Manifest, log: &Log) -> Self {
        let (assumed, by) = (manifest.assume, manifest.dataset.by.as_deref().unwrap_or_default());
        let capture_fps = settings.fps();
        let mut others =
            Facts { stated: assumed, names: settings.names.clone(), capture_fps, ..Facts::default() };
        let table = settings.shots.as_ref().and_then(|path| Table::read(path, log));
        let Some(table) = table else { return Self { others, ..Self::default() } };
        let [x, y, z] = OMEGA.map(|name| (name, 1.0, FINITE));
        let table = table.with(KNOWN, &[x, y, z, ("capture_fps", 1.0, RATE)], "shot", by);
        others.labels = table.labels().map(|label| (label.to_owned(), String::new())).collect();
        let mut rows: IndexMap<String, Facts> = IndexMap::new();
        for (row, stated) in table.spins(OMEGA, assumed).into_iter().enumerate() {
            let Some(shot) = table.text("shot", row) else { continue };
            let mut names = NAMED.map(|column| names(&table, row, column));
            let rate = table.at("capture_fps", row).map(|rate| rate.value).filter(|rate| *rate > 0.0);
            let facts = Facts {
                line: table.line(row),
                skip: skip(&table, row),
                // a wrong one was reported
                stated: stated.unwrap_or(assumed),
                file: table.text("file", row).map(str::to_string),
                labels: table.labels_at(row),
                names_balls: names[..2].iter().any(Option::is_some),
                names: [0, 1, 2, 3].map(|i| names[i].take().unwrap_or_else(|| others.names[i].clone())),
                capture_fps: rate.or(capture_fps),
            };
            if rate.is_some() && settings.video.has_unknown_rate() {
                let message = "is stated, but [video] capture_fps is \"unknown\"; expected it for all shots or for none";
                table.wrong(row, "capture_fps", message);
            }
            if settings.film.discs.is_some() && !matches!(facts.spin(), Spin::Stun | Spin::Unknown) {
                table.wrong(row, "cue_spin", message!("rolling_disc"));
            }
            if let Some(Facts { line, .. }) = rows.insert(shot.to_string(), facts) {
                let message = format!("\"{shot}\" also stands in line {line}; expected each shot once");
                table.wrong(row, "shot", message);
            }
        }
        Self { path: table.path.clone(), rows, others, note: table.note(None) }
    }

    fn facts(&self, shot: &str) -> &Facts {
        self.rows.get(shot).unwrap_or(&self.others)
    }

    /// Gives shots the names that the table has for their files.
    fn name_by_file(&self, raw: &mut [RawShot], log: &Log) {
        let mut named: HashMap<usize, usize> = HashMap::new();
        for (name, Facts { line, file, .. }) in &self.rows {
            let Some(file) = file else { continue };
            let wrong = |message| log.add(&self.path, *line, "file", message);
            let in_file: Vec<usize> = (0..raw.len()).filter(|i| raw[*i].file.ends_with(file)).collect();
            if in_file.is_empty() {
                let near = did_you_mean(file, raw.iter().filter_map(|shot| shot.file.file_name()?.to_str()));
                wrong(message!("unknown_file", file, near));
            }
            let same = in_file.iter().find(|i| raw[**i].name == *name);
            let Some(shot) = same.or(in_file.first().filter(|_| in_file.len() == 1)) else { continue };
            raw[*shot].name.clone_from(name);
            if let Some(other) = named.insert(*shot, *line) {
                wrong(format!("\"{file}\" is also the file of line {other}; expected each shot once"));
            }
        }
    }

    fn check_names(&self, known: &HashSet<&str>, log: &Log) {
        for (shot, row) in self.rows.iter().filter(|(shot, _)| !known.contains(shot.as_str())) {
            let near = did_you_mean(shot, known.iter().copied());
            let message = format!("there is no shot \"{shot}\" in the data{near}");
            log.add(&self.path, row.line, "shot", message);
        }
    }
}

fn names(table: &Table, row: usize, column: &str) -> Option<Vec<String>> {
    let cell = table.text(column, row)?;
    let names: Vec<String> = cell.split(BETWEEN).map(|name| name.trim().to_owned()).collect();
    let is_bad = |i: usize| names[i].is_empty() || names[..i].contains(&names[i]);
    if (0..names.len()).any(is_bad) {
        let message = format!("\"{cell}\"; expected names of tracks, each once, with {BETWEEN} between them");
        table.wrong(row, column, message);
    }
    Some(names)
}

fn skip(table: &Table, row: usize) -> Option<String> {
    let word = table.text("skip", row)?;
    let is_one_of = |words: [&str; 3]| words.iter().any(|own| word.eq_ignore_ascii_case(own));
    let is_skipped = is_one_of(["true", "1", "yes"]);
    if !is_skipped && !is_one_of(["false", "0", "no"]) {
        let message = format!("\"{word}\" is not true or false; expected true, false, 1, 0, yes or no");
        table.wrong(row, "skip", message);
    }
    is_skipped.then(|| table.text("note", row).unwrap_or("skip in the shots table").to_owned())
}
