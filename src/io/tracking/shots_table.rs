//! `[tracks] shots`: properties of single shots that no camera sees, a row per shot.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

use indexmap::IndexMap;

use super::raw::{RawShot, listed};
use super::settings::{NAMED, Names, TrackSettings};
use crate::io::error::{Problems, did_you_mean};
use crate::io::manifest::StatedSpin;
use crate::io::table::{OMEGA, Table};
use crate::measurement::fault::{FINITE, POSITIVE};
use crate::measurement::spin::Spin;

/// Columns with a meaning; all others are labels.
pub(crate) const KNOWN: &str = "shot cue_spin omega_x omega_y omega_z skip note file cue object cue_markers \
                                object_markers capture_fps";

/// Separator of several names of tracks in a cell.
const BETWEEN: char = ';';

/// Statements about a shot: those of its row or, for empty cells and without a row, of dataset.toml.
#[derive(Clone)]
pub(super) struct Facts {
    line: usize,
    /// The reason, if the shot is to be skipped.
    pub(crate) skip: Option<String>,
    pub(crate) stated: StatedSpin,
    /// The file that holds the shot, as written.
    file: Option<String>,
    pub(crate) labels: BTreeMap<String, String>,
    /// Names of tracks, in the order of [`NAMED`].
    pub(crate) names: [Names; 4],
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

/// The rows of the table by the names of shots, in the order of the file.
pub(super) struct ShotsTable<'a> {
    pub(crate) settings: &'a TrackSettings,
    pub(crate) problems: &'a Problems,
    rows: IndexMap<String, Facts>,
    /// The facts of shots without a row, whose labels are empty.
    pub(crate) others: Facts,
    /// A note on the columns that are labels.
    pub(crate) note: Option<String>,
    pub(crate) has_rates: bool,
}

impl<'a> ShotsTable<'a> {
    pub(super) fn read(settings: &'a TrackSettings, assumed: StatedSpin, problems: &'a Problems) -> Self {
        let others = Facts {
            line: 0,
            skip: None,
            stated: assumed,
            file: None,
            labels: BTreeMap::new(),
            names: settings.names.clone(),
            names_balls: false,
            capture_fps: settings.fps(),
        };
        let mut all =
            Self { settings, problems, rows: IndexMap::new(), others, note: None, has_rates: false };
        let read = |path: &PathBuf| Table::read(path, problems);
        let Some(table) = settings.shots.as_ref().and_then(read) else { return all };
        let [x, y, z] = OMEGA.map(|name| (name, 1.0, FINITE));
        let table = table.with(KNOWN, &[x, y, z, ("capture_fps", 1.0, POSITIVE)], "shot");
        all.note = table.note(None);
        all.others.labels = table.labels().map(|label| (label.to_owned(), String::new())).collect();
        for (row, stated) in table.spins(OMEGA, assumed).into_iter().enumerate() {
            let Some(shot) = table.text("shot", row) else { continue };
            let names = NAMED.map(|column| names(&table, row, column));
            let rate = table.at("capture_fps", row).map(|rate| rate.value).filter(|rate| *rate > 0.0);
            all.has_rates |= rate.is_some();
            let facts = Facts {
                line: table.line(row),
                skip: skip(&table, row),
                // a wrong one was reported
                stated: stated.unwrap_or(assumed),
                file: table.text("file", row).map(str::to_string),
                labels: table.labels_at(row),
                names_balls: names[..2].iter().any(Option::is_some),
                names: [0, 1, 2, 3].map(|i| names[i].as_ref().unwrap_or(&all.others.names[i]).clone()),
                capture_fps: rate.or(all.others.capture_fps),
            };
            if settings.discs && !matches!(facts.spin(), Spin::Stun | Spin::Unknown) {
                let message = "discs do not roll; expected stun (no disc turns before the impact) or unknown: points on the discs \
                               show how they turn";
                table.wrong(row, "cue_spin", message);
            }
            if let Some(Facts { line, .. }) = all.rows.insert(shot.to_string(), facts) {
                let message = format!("\"{shot}\" also stands in line {line}; expected each shot once");
                table.wrong(row, "shot", message);
            }
        }
        all
    }

    /// Complains about a cell of the table.
    fn wrong(&self, line: usize, column: &str, message: String) {
        self.problems.add(self.settings.shots.as_deref().unwrap_or(Path::new("")), line, column, message);
    }

    pub(super) fn facts(&self, shot: &str) -> &Facts {
        self.rows.get(shot).unwrap_or(&self.others)
    }

    /// Gives shots the names that the table has for their files.
    pub(super) fn name_by_file(&self, raw: &mut [RawShot]) {
        let mut named: HashMap<usize, usize> = HashMap::new();
        for (name, Facts { line, file, .. }) in &self.rows {
            let Some(file) = file else { continue };
            let of_file: Vec<usize> = (0..raw.len()).filter(|i| raw[*i].file.ends_with(file)).collect();
            let own = of_file.iter().copied().find(|i| raw[*i].name == *name);
            let message = match (of_file.as_slice(), own) {
                ([], _) => {
                    let files = raw.iter().filter_map(|shot| shot.file.file_name()?.to_str());
                    let near = did_you_mean(file, files);
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
                    let names: Vec<&String> = many.iter().map(|i| &raw[*i].name).collect();
                    let names = listed(&names);
                    format!(
                        "\"{file}\" holds no shot \"{name}\"; expected one of its shots under shot: {names}"
                    )
                }
            };
            self.wrong(*line, "file", message);
        }
    }

    pub(super) fn check_names(&self, known: &HashSet<&str>) {
        for (shot, row) in self.rows.iter().filter(|(shot, _)| !known.contains(shot.as_str())) {
            let near = did_you_mean(shot, known.iter().copied());
            let message = format!("there is no shot \"{shot}\" in the data{near}");
            self.wrong(row.line, "shot", message);
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
        "true" | "1" | "yes" => Some(table.text("note", row).unwrap_or("skip in the shots table").to_owned()),
        "false" | "0" | "no" => None,
        _ => {
            let message = format!("\"{word}\" is not true or false; expected true, false, 1, 0, yes or no");
            table.wrong(row, "skip", message);
            None
        }
    }
}
