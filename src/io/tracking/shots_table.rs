//! `[tracks] shots`: properties of single shots that no camera sees, a row per shot.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use indexmap::IndexMap;

use super::finish::{Facts, Own};
use super::input::quoted;
use super::raw::RawShot;
use super::settings::{NAMED, Names};
use crate::io::error::{Problems, did_you_mean};
use crate::io::manifest::Assume;
use crate::io::rows::{self, labels_note};
use crate::io::table::Table;
use crate::measurement::dataset::Measured;
use crate::measurement::spin::Spin;

const OMEGA: [&str; 3] = ["omega_x", "omega_y", "omega_z"];
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

/// The rows of the table, and the defaults of shots without a row.
pub(super) struct ShotsTable<'a> {
    path: PathBuf,
    problems: &'a Problems,
    /// By the names of shots, in the order of the file.
    rows: IndexMap<String, ShotRow>,
    assume: Option<Assume>,
    labels: Vec<String>,
}

struct ShotRow {
    line: usize,
    /// The reason, if the shot is to be skipped.
    skip: Option<String>,
    spin: Option<Spin>,
    /// Whether the spin is stated as measured without numbers.
    by_markers: bool,
    /// The file that holds the shot, as written.
    file: Option<String>,
    own: Own,
    labels: BTreeMap<String, String>,
}

impl<'a> ShotsTable<'a> {
    pub(super) fn read(path: Option<&Path>, assume: Option<Assume>, problems: &'a Problems) -> Self {
        let (rows, labels) = (IndexMap::new(), Vec::new());
        let table = path.and_then(|path| Table::read(path, problems));
        let path = path.unwrap_or(Path::new("")).to_path_buf();
        let mut all = Self { path, problems, rows, assume, labels };
        let Some(table) = table else { return all };
        rows::check_names(&table, &KNOWN);
        table.require("shot", &["shot"]);
        let present = OMEGA.iter().filter(|column| table.has(column)).count();
        if (1..3).contains(&present) {
            let message = format!("expected all three of {}, or none", OMEGA.join(", "));
            problems.add(&table.path, None, None, message);
        }
        let columns = OMEGA.map(|column| rows::values(&table, column, 1.0));
        let rates = table.numbers("capture_fps");
        let labels = table.names().filter(|name| !KNOWN.contains(name) && !name.ends_with("_sd"));
        all.labels = labels.map(str::to_string).collect();
        for row in 0..table.rows() {
            let Some(shot) = table.text("shot", row) else { continue };
            let skip = skip(&table, row);
            let omega = columns.each_ref().map(|values| values.as_ref().and_then(|values| values[row]));
            let spin = spin(&table, row, omega, assume);
            let own = own(&table, row, rates.as_ref().and_then(|rates| rates[row]));
            let stated = table.text("cue_spin", row).map_or(assume, |word| Assume::of(word).or(assume));
            let read = ShotRow {
                line: table.line(row),
                skip,
                spin,
                by_markers: spin == Some(Spin::Unknown) && stated == Some(Assume::Measured),
                file: table.text("file", row).map(str::to_string),
                own,
                labels: rows::labels(&table, &KNOWN, row),
            };
            if let Some(ShotRow { line, .. }) = all.rows.insert(shot.to_string(), read) {
                let message = format!("\"{shot}\" also stands in line {line}; expected each shot once");
                table.wrong(row, "shot", message);
            }
        }
        all
    }

    pub(super) fn has_label(&self, label: &str) -> bool {
        self.labels.iter().any(|own| own == label)
    }

    pub(super) fn note(&self) -> Option<String> {
        labels_note(&self.path, &self.labels)
    }

    pub(super) fn skip(&self, shot: &str) -> Option<&str> {
        self.rows.get(shot)?.skip.as_deref()
    }

    pub(super) fn facts(&self, shot: &str) -> Option<Facts> {
        let row = self.rows.get(shot);
        let facts = Facts::of(row.and_then(|row| row.spin).or(self.assume.map(of_word))?);
        Some(match row {
            Some(row) => Facts { labels: row.labels.clone(), own: row.own.clone(), ..facts },
            None => {
                let labels = self.labels.iter().map(|label| (label.clone(), String::new()));
                Facts { labels: labels.collect(), ..facts }
            }
        })
    }

    /// Returns whether the spin is stated as measured and only markers can show it.
    pub(super) fn is_by_markers(&self, shot: &str) -> bool {
        self.rows.get(shot).map_or(self.assume == Some(Assume::Measured), |row| row.by_markers)
    }

    pub(super) fn has_rates(&self) -> bool {
        self.rows.values().any(|row| row.own.capture_fps.is_some())
    }

    /// Gives shots the names that the table has for their files.
    pub(super) fn name_by_file(&self, raw: &mut [RawShot]) {
        let mut named: HashMap<usize, usize> = HashMap::new();
        for (name, ShotRow { line, file, .. }) in &self.rows {
            let Some(file) = file else { continue };
            let wrong = |message: String| self.problems.add(&self.path, *line, "file", message);
            let of_file = of_file(raw, file);
            let own = of_file.iter().copied().find(|i| raw[*i].name == *name);
            match (of_file.as_slice(), own) {
                ([], _) => {
                    let files = raw.iter().filter_map(|shot| shot.file.file_name());
                    let known: Vec<String> = files.map(|name| name.to_string_lossy().into_owned()).collect();
                    let near = did_you_mean(file, known.iter().map(String::as_str));
                    wrong(format!(
                        "\"{file}\" is not among the files with shots that dataset.toml names under files{near}"
                    ));
                }
                (_, Some(shot)) | (&[shot], None) => {
                    if let Some(line) = named.insert(shot, *line) {
                        wrong(format!("\"{file}\" is also the file of line {line}; expected each shot once"));
                    }
                    raw[shot].name.clone_from(name);
                }
                (many, None) => {
                    let names = quoted(many.iter().take(12).map(|i| &raw[*i].name));
                    wrong(format!(
                        "\"{file}\" holds no shot \"{name}\"; expected one of its shots under shot: {names}"
                    ));
                }
            }
        }
    }

    pub(super) fn check_names(&self, known: &HashMap<&str, usize>) {
        for (shot, row) in self.rows.iter().filter(|(shot, _)| !known.contains_key(shot.as_str())) {
            let near = did_you_mean(shot, known.keys().copied());
            let message = format!("there is no shot \"{shot}\" in the data{near}");
            self.problems.add(&self.path, row.line, "shot", message);
        }
    }
}

/// Returns the shots of the file that a cell names; programs on Windows write backslashes, and
/// drives of another computer.
fn of_file(raw: &[RawShot], cell: &str) -> Vec<usize> {
    let ends = |path: &str| (0..raw.len()).filter(|i| raw[*i].file.ends_with(path)).collect::<Vec<_>>();
    let as_written = ends(cell);
    if !as_written.is_empty() || !cell.contains('\\') {
        return as_written;
    }
    let path = cell.replace('\\', "/");
    let path = path.trim_start_matches("./");
    let found = ends(path);
    let is_on_a_drive = path.split('/').next().is_some_and(|first| first.is_empty() || first.ends_with(':'));
    if found.is_empty() && is_on_a_drive { ends(path.rsplit('/').next().unwrap_or_default()) } else { found }
}

fn own(table: &Table, row: usize, rate: Option<f64>) -> Own {
    let names = NAMED.map(|column| {
        let cell = table.text(column, row)?;
        let names = Names::of(cell.split(BETWEEN));
        if !names.are_good() {
            let message =
                format!("\"{cell}\"; expected names of tracks, each once, with {BETWEEN} between them");
            table.wrong(row, column, message);
        }
        Some(names)
    });
    if let Some(rate) = rate.filter(|rate| *rate <= 0.0) {
        table.wrong(row, "capture_fps", format!("{rate} is not a frame rate; expected more than 0"));
    }
    Own { names, capture_fps: rate }
}

fn skip(table: &Table, row: usize) -> Option<String> {
    let word = table.text("skip", row).unwrap_or("no");
    match word.to_lowercase().as_str() {
        "true" | "1" | "yes" => {
            Some(table.text("note", row).unwrap_or("skip in the shots table").to_string())
        }
        "false" | "0" | "no" => None,
        _ => {
            let message =
                format!("\"{word}\" is neither true nor false; expected true, false, 1, 0, yes or no");
            table.wrong(row, "skip", message);
            None
        }
    }
}

fn spin(table: &Table, row: usize, omega: [Option<Measured>; 3], assume: Option<Assume>) -> Option<Spin> {
    match (omega, rows::spin_word(table, row).ok()?) {
        ([Some(_), Some(_), Some(_)], None | Some(Assume::Measured)) => rows::measured(omega),
        ([Some(_), Some(_), Some(_)] | [None, None, None], word) => word.or(assume).map(of_word),
        (omega, _) => {
            let empty = omega.iter().position(Option::is_none).unwrap_or(0);
            table.wrong(row, OMEGA[empty], rows::EMPTY_COMPONENT);
            None
        }
    }
}

/// Returns the spin of a word; a measured one without numbers is unknown until markers show it.
fn of_word(word: Assume) -> Spin {
    word.spin().unwrap_or(Spin::Unknown)
}
