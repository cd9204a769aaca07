//! `[tracks] shots`: properties of single shots that no camera sees, a row per shot.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

use indexmap::IndexMap;

use super::input::quoted;
use super::raw::RawShot;
use super::settings::{NAMED, Names, TrackSettings};
use crate::io::error::{Problems, did_you_mean};
use crate::io::manifest::StatedSpin;
use crate::io::rows::{OMEGA, Rows};
use crate::io::table::Table;
use crate::measurement::fault::{FINITE, POSITIVE};
use crate::measurement::spin::Spin;

/// Columns with a meaning; all others are labels.
pub(crate) const KNOWN: [&str; 13] = [
    "shot",
    "cue_spin",
    "omega_x",
    "omega_y",
    "omega_z",
    "skip",
    "note",
    "file",
    "cue",
    "object",
    "cue_markers",
    "object_markers",
    "capture_fps",
];

/// Separator of several names of tracks in a cell.
const BETWEEN: char = ';';

/// Statements of the table of shots, or else of dataset.toml, about a shot.
#[derive(Clone, Debug, Default)]
pub(super) struct Facts {
    pub(crate) spin: Spin,
    pub(crate) labels: BTreeMap<String, String>,
    /// Names of tracks, in the order of [`NAMED`].
    pub(crate) names: [Names; 4],
    /// Whether its own row, or its tracks, name one of the balls.
    pub(crate) names_balls: bool,
    pub(crate) capture_fps: Option<f64>,
}

/// The rows of the table, and the defaults of shots without a row.
pub(super) struct ShotsTable<'a> {
    path: PathBuf,
    problems: &'a Problems,
    /// The rows by the names of shots, in the order of the file.
    rows: IndexMap<String, ShotRow>,
    assumed: StatedSpin,
    pub(crate) labels: Vec<String>,
    /// A note on the columns that are labels.
    pub(super) note: Option<String>,
}

struct ShotRow {
    line: usize,
    /// The reason, if the shot is to be skipped.
    skip: Option<String>,
    /// `None`: the statement is wrong.
    spin: Option<StatedSpin>,
    /// The file that holds the shot, as written.
    file: Option<String>,
    labels: BTreeMap<String, String>,
    names: [Option<Names>; 4],
    capture_fps: Option<f64>,
}

impl<'a> ShotsTable<'a> {
    pub(super) fn read(path: Option<&Path>, assumed: StatedSpin, problems: &'a Problems) -> Self {
        let table = path.and_then(|path| Table::read(path, problems));
        let path = path.map(Path::to_path_buf).unwrap_or_default();
        let mut all = Self { path, problems, rows: IndexMap::new(), assumed, labels: Vec::new(), note: None };
        let Some(table) = table else { return all };
        let columns =
            OMEGA.map(|name| (name, 1.0, FINITE)).into_iter().chain([("capture_fps", 1.0, POSITIVE)]);
        let rows = Rows::read(&table, &KNOWN, columns, "shot");
        let spins = rows.spins(OMEGA, assumed);
        all.labels = rows.labels().map(str::to_string).collect();
        all.note = rows.note(None);
        for row in 0..table.rows() {
            let Some(shot) = table.text("shot", row) else { continue };
            let read = ShotRow {
                line: table.line(row),
                skip: skip(&table, row),
                spin: spins[row],
                file: table.text("file", row).map(str::to_string),
                labels: rows.labels_at(row),
                names: NAMED.map(|column| names(&table, row, column)),
                capture_fps: rows.at("capture_fps", row).map(|rate| rate.value).filter(|rate| *rate > 0.0),
            };
            if let Some(ShotRow { line, .. }) = all.rows.insert(shot.to_string(), read) {
                let message = format!("\"{shot}\" also stands in line {line}; expected each shot once");
                table.wrong(row, "shot", message);
            }
        }
        all
    }

    pub(super) fn skip(&self, shot: &str) -> Option<&str> {
        self.rows.get(shot)?.skip.as_deref()
    }

    /// Returns the statement about the spin of a shot; a wrong one was reported, and counts as that
    /// of dataset.toml.
    pub(super) fn spin(&self, shot: &str) -> StatedSpin {
        self.rows.get(shot).and_then(|row| row.spin).unwrap_or(self.assumed)
    }

    /// Returns the facts of a shot; the spin is unknown if it is not stated, or until markers show
    /// it.
    pub(super) fn facts(&self, shot: &str, settings: &TrackSettings) -> Facts {
        let spin = if let StatedSpin::Is(spin) = self.spin(shot) { spin } else { Spin::Unknown };
        let all = || self.labels.iter().map(|label| (label.clone(), String::new()));
        let row = self.rows.get(shot);
        let name = |i: usize| row.and_then(|row| row.names[i].as_ref()).unwrap_or(&settings.names[i]).clone();
        Facts {
            spin,
            labels: row.map_or_else(|| all().collect(), |row| row.labels.clone()),
            names: [0, 1, 2, 3].map(name),
            names_balls: row.is_some_and(|row| row.names[..2].iter().any(Option::is_some)),
            capture_fps: row.and_then(|row| row.capture_fps).or(settings.fps()),
        }
    }

    pub(super) fn has_rates(&self) -> bool {
        self.rows.values().any(|row| row.capture_fps.is_some())
    }

    /// Gives shots the names that the table has for their files.
    pub(super) fn name_by_file(&self, raw: &mut [RawShot]) {
        let mut named: HashMap<usize, usize> = HashMap::new();
        for (name, ShotRow { line, file, .. }) in &self.rows {
            let Some(file) = file else { continue };
            let of_file: Vec<usize> = (0..raw.len()).filter(|i| raw[*i].file.ends_with(file)).collect();
            let own = of_file.iter().copied().find(|i| raw[*i].name == *name);
            let message = match (of_file.as_slice(), own) {
                ([], _) => {
                    let files = raw.iter().filter_map(|shot| shot.file.file_name());
                    let known: Vec<String> = files.map(|name| name.to_string_lossy().into_owned()).collect();
                    let near = did_you_mean(file, known.iter().map(String::as_str));
                    format!(
                        "\"{file}\" is not among the files with shots that dataset.toml names under files{near}"
                    )
                }
                (_, Some(shot)) | (&[shot], None) => {
                    raw[shot].name.clone_from(name);
                    let Some(line) = named.insert(shot, *line) else { continue };
                    format!("\"{file}\" is also the file of line {line}; expected each shot once")
                }
                (many, None) => {
                    let names = quoted(many.iter().take(12).map(|i| &raw[*i].name));
                    format!(
                        "\"{file}\" holds no shot \"{name}\"; expected one of its shots under shot: {names}"
                    )
                }
            };
            self.problems.add(&self.path, *line, "file", message);
        }
    }

    pub(super) fn check_names(&self, known: &HashSet<&str>) {
        for (shot, row) in self.rows.iter().filter(|(shot, _)| !known.contains(shot.as_str())) {
            let near = did_you_mean(shot, known.iter().copied());
            let message = format!("there is no shot \"{shot}\" in the data{near}");
            self.problems.add(&self.path, row.line, "shot", message);
        }
    }
}

fn names(table: &Table, row: usize, column: &str) -> Option<Names> {
    let cell = table.text(column, row)?;
    let names = Names::of(cell.split(BETWEEN));
    if !names.are_good() {
        let message = format!("\"{cell}\"; expected names of tracks, each once, with {BETWEEN} between them");
        table.wrong(row, column, message);
    }
    Some(names)
}

fn skip(table: &Table, row: usize) -> Option<String> {
    let word = table.text("skip", row)?;
    match word.to_lowercase().as_str() {
        "true" | "1" | "yes" => {
            Some(table.text("note", row).unwrap_or("skip in the shots table").to_string())
        }
        "false" | "0" | "no" => None,
        _ => {
            let message = format!("\"{word}\" is not true or false; expected true, false, 1, 0, yes or no");
            table.wrong(row, "skip", message);
            None
        }
    }
}
