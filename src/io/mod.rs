//! Files of measured collisions: `dataset.toml`, and the tables that it names.

pub(crate) mod balls;
pub(crate) mod cases;
pub(crate) mod draft;
pub(crate) mod error;
mod manifest;
pub(crate) mod table;
mod text;
pub(crate) mod toml_file;
pub(crate) mod tracking;

use std::collections::{HashMap, HashSet};
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use error::{Log, did_you_mean, message};
use manifest::{Keys, Manifest, StatedSpin};
use polars::prelude::{DataFrame, PolarsResult, df};
use schemars::Schema;
use table::{Column, OMEGA, Table};
use toml_file::{Source, checked};

use crate::measurement::dataset::{Before, Dataset, Measured, Measurement, Shot};
use crate::measurement::fault::{Condition, FINITE, POSITIVE};
use crate::measurement::observable::Observable;
use crate::measurement::track::{Sample, TrackShot, TrackedBall};
use crate::measurement::valid::is_unit;

pub use error::{DatasetError, Problem};
pub use manifest::Kind;

/// Loads a data set from a folder that holds a dataset.toml, or from the path of such a file.
///
/// # Errors
/// Every problem of the data set, with file, line, column, value and what was expected.
pub fn load(path: &Path) -> Result<Dataset, DatasetError> {
    let file = if path.is_dir() { path.join("dataset.toml") } else { path.to_path_buf() };
    let what = format!("the data set {} cannot be used:", file.display());
    let is_toml = file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    let message = if !file.is_file() {
        "there is no such file; expected a dataset.toml, or a folder that holds one"
    } else if !is_toml {
        "is not a dataset.toml; expected one, which \"caromfit init\" writes for tables"
    } else {
        return checked(&file, None, what, dataset);
    };
    let log = Log::default();
    log.add(&file, None, None, message);
    Err(log.into_error(what))
}

/// Loads a data set from the text of a dataset.toml that would stand in the file `path`.
///
/// # Errors
/// Those of [`load`].
pub(crate) fn load_text(text: &str, path: &Path) -> Result<Dataset, DatasetError> {
    checked(path, Some(text), format!("the data set {} cannot be used:", path.display()), dataset)
}

/// Returns the JSON Schema (draft 2020-12) of dataset.toml, for editors that check it.
pub fn schema() -> Schema {
    toml_file::schema::<Keys>()
}

/// Returns the data set with its shots or tracks; without them if dataset.toml has problems.
fn dataset(keys: Keys, source: &Source) -> Dataset {
    let manifest = keys.check(source);
    if !source.log.is_empty() {
        return manifest.dataset;
    }
    if let Some(settings) = &manifest.tracks {
        let tracks = Some(tracking::load(&manifest, settings, source));
        return Dataset { tracks, ..manifest.dataset };
    }
    let Manifest { mut dataset, kind, files, assume, .. } = manifest;
    for file in &files {
        add_rows(&mut dataset, file, kind, assume, source);
    }
    let names = dataset.shots.iter().map(|shot| (shot.name.as_str(), shot.file.as_path(), shot.line));
    check_unique(names, "", source.log);
    number_shots(&mut dataset.shots);
    for shot in dataset.shots.iter_mut().filter(|_| dataset.side_sd > 0.0) {
        if !shot.add_side_spin(dataset.side_sd, dataset.ball.radius) {
            let message = "is missing; expected a speed in every row, of which [cue_spin] side_sd is a part";
            source.log.add(&shot.file, shot.line, "speed_m_s", message);
        }
    }
    dataset
}

/// Complains about equal names of shots, each with its file and line; `remedy` follows the message.
pub(crate) fn check_unique<'a>(
    names: impl Iterator<Item = (&'a str, &'a Path, usize)>,
    remedy: &str,
    log: &Log,
) {
    let mut seen = HashMap::new();
    for (name, file, line) in names.filter(|(name, ..)| !name.is_empty()) {
        if let Some((other, other_line)) = seen.insert(name, (file, line)) {
            let other = other.file_name().unwrap_or_default().to_string_lossy();
            log.add(file, line, "shot", message!("twin", name, other_line, other, remedy));
        }
    }
}

/// Numbers the shots that have no name.
fn number_shots(shots: &mut [Shot]) {
    let names: HashSet<String> = shots.iter().map(|shot| shot.name.clone()).collect();
    for (i, shot) in shots.iter_mut().enumerate().filter(|(_, shot)| shot.name.is_empty()) {
        shot.name = (i + 1).to_string();
        // another file may number its shots
        if names.contains(&shot.name) {
            let file = shot.file.file_name().unwrap_or_default().display();
            shot.name = format!("{} ({file}:{})", i + 1, shot.line);
        }
    }
}

/// Returns the positions of all filmed shots of a data set as one table, calibrated and repaired,
/// with a row for each point in each frame in which it is seen. Tables of velocities or angles have
/// no rows.
///
/// The columns are those of a long table of tracks (`caromfit help formats`): shot, frame (its
/// number at the camera's rate), t in s, ball (cue or object), point (centre, or the name of a
/// marker), x and y in m, x_sd and y_sd in m, or null if they are not stated.
///
/// ```
/// let dataset = caromfit::io::load("data/pucks-qualisys".as_ref())?;
/// let positions = caromfit::io::positions(&dataset)?;
/// assert_eq!(positions.column("x")?.f64()?.null_count(), 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// There are more rows than a table can hold.
pub fn positions(dataset: &Dataset) -> PolarsResult<DataFrame> {
    positions_of(dataset.tracks.iter().flat_map(|tracks| &tracks.shots))
}

pub(crate) fn positions_of<'a>(shots: impl Iterator<Item = &'a TrackShot>) -> PolarsResult<DataFrame> {
    let mut rows: Vec<(&TrackShot, [&str; 2], &Sample)> = Vec::new();
    for shot in shots {
        let centres = [(["cue", "centre"], &shot.cue), (["object", "centre"], &shot.object)];
        let markers = shot.markers.iter().map(|marker| {
            let ball = if marker.ball == TrackedBall::Cue { "cue" } else { "object" };
            ([ball, marker.name.as_str()], &marker.samples)
        });
        for (names, samples) in centres.into_iter().chain(markers) {
            rows.extend(samples.iter().map(|sample| (shot, names, sample)));
        }
    }
    let numbers = |number: fn(&Sample) -> Option<f64>| -> Vec<Option<f64>> {
        rows.iter().map(|(.., sample)| number(sample)).collect()
    };
    df!(
        "shot" => rows.iter().map(|(shot, ..)| shot.name.as_str()).collect::<Vec<_>>(),
        "frame" => rows.iter().map(|(shot, _, sample)| (sample.t * shot.fps).round() as i64).collect::<Vec<_>>(),
        "t" => numbers(|sample| Some(sample.t)),
        "ball" => rows.iter().map(|(_, [ball, _], _)| *ball).collect::<Vec<_>>(),
        "point" => rows.iter().map(|(_, [_, point], _)| *point).collect::<Vec<_>>(),
        "x" => numbers(|sample| Some(sample.x)),
        "y" => numbers(|sample| Some(sample.y)),
        "x_sd" => numbers(|sample| Some(sample.sd?[0])),
        "y_sd" => numbers(|sample| Some(sample.sd?[1])),
    )
}

const CUT: Condition = (|x| x.abs() < FRAC_PI_2, "degrees, more than -90 and less than 90");

/// The columns of a kind of table.
struct Columns {
    before: &'static [Column],
    /// Columns that must exist and have no empty cells.
    required: &'static str,
    spin: [&'static str; 3],
    observables: &'static [Observable],
}

const ANGLES: Columns = Columns {
    before: &[("cut_deg", 1.0_f64.to_radians(), CUT), ("speed_m_s", 1.0, POSITIVE)],
    required: "cut_deg",
    spin: OMEGA,
    observables: &Observable::ANGLES,
};
const IMPACTS: Columns = Columns {
    before: &[("nx", 1.0, FINITE), ("ny", 1.0, FINITE), ("cue_vx", 1.0, FINITE), ("cue_vy", 1.0, FINITE)],
    required: "shot nx ny cue_vx cue_vy cue_vx_after cue_vy_after obj_vx_after obj_vy_after",
    spin: ["cue_wx", "cue_wy", "cue_wz"],
    observables: &Observable::IMPACTS,
};

/// Adds the shots of a table, with the label that `[fit] by` names; leaves out faulty rows.
///
/// (n_x, n_y) is a unit vector, which can err only across itself: an error σ of its direction (rad)
/// gives its components the standard deviations `nx_sd` = σ|n_y| and `ny_sd` = σ|n_x|, whose
/// squares add up to σ² again.
fn add_rows(dataset: &mut Dataset, file: &Path, kind: Kind, assume: StatedSpin, source: &Source) {
    let columns = if kind == Kind::Impacts { IMPACTS } else { ANGLES };
    let Columns { before, required, spin: omega, observables } = columns;
    let observed = observables.iter().map(|one| (one.column(), one.unit_si(), FINITE));
    let spins = omega.map(|name| (name, 1.0, FINITE));
    let columns: Vec<Column> = before.iter().copied().chain(observed).chain(spins).collect();
    let Some(table) = Table::read(file, source.log) else { return };
    let by = dataset.by.as_deref();
    if let Some(by) = by {
        check_label(by, &table, source);
    }
    let table = table.with("shot cue_spin", &columns, required, by.unwrap_or_default());
    check_observed(&table, observables);
    for (row, stated) in table.spins(omega, assume).into_iter().enumerate() {
        let at = |column: &str| table.at(column, row);
        let before = if kind == Kind::Impacts {
            let line = at("nx").zip(at("ny")).zip(at("cue_vx").zip(at("cue_vy")));
            line.map(|((nx, ny), (vx, vy))| impact(&table, row, [nx, ny], [vx, vy]))
        } else {
            at("cut_deg").map(|cut| Before::Angle { cut, speed: at("speed_m_s") })
        };
        if let Some(stated @ (StatedSpin::Measured | StatedSpin::Unstated)) = stated {
            let column = ["cue_spin", omega[0]].into_iter().find(|name| table.has(name));
            table.wrong(row, column, stated.complaint(&omega.join(", ")));
        }
        let (Some(before), Some(StatedSpin::Is(spin))) = (before, stated) else { continue };
        let after = observables.iter().filter_map(|observable| {
            Some(Measurement { observable: *observable, measured: at(observable.column())? })
        });
        let mut labels = table.labels_at(row);
        labels.extend(by.map(|by| (by.to_owned(), table.text(by, row).unwrap_or_default().to_owned())));
        let name = table.text("shot", row).unwrap_or_default();
        let (file, line) = (table.path.clone(), table.line(row));
        dataset.shots.push(Shot { file, line, labels, ..Shot::new(name, before, spin, after.collect()) });
    }
    dataset.taken.extend(table.note(by));
}

/// Complains if a table lacks the column that `[fit] by` names, or a label in it.
fn check_label(by: &str, table: &Table, source: &Source) {
    if !table.has(by) {
        let near = did_you_mean(by, table.names());
        let message = format!("by is \"{by}\", but {} has no such column{near}", table.path.display());
        return source.wrong("fit.by", message);
    }
    for row in table.rows().filter(|row| table.text(by, *row).is_none()) {
        table.wrong(row, by, "is empty; expected a label, since [fit] by names this column");
    }
}

/// Complains about tables and rows without an observed value, and about gaps in deviations.
fn check_observed(table: &Table, observables: &[Observable]) {
    let all: Vec<&str> = observables.iter().map(|observable| observable.column()).collect();
    let columns: Vec<&str> = all.iter().copied().filter(|name| table.has(name)).collect();
    if columns.is_empty() {
        let expected = all.join(", ");
        let message = format!("no column of anything observed; expected at least one of {expected}");
        return table.wrong(None, None, message);
    }
    for name in &columns {
        let sd_name = format!("{name}_sd");
        let has_sd = |row: &usize| !table.is_gap(&sd_name, *row);
        let mut full = table.rows().filter(|row| table.at(name, *row).is_some());
        if let (Some(with), Some(without)) = (full.clone().find(has_sd), full.find(|row| !has_sd(row))) {
            let line = table.line(with);
            let message = format!("is empty, but line {line} has one; give one for every {name} or for none");
            table.wrong(without, sd_name.as_str(), message);
        }
    }
    for row in table.rows().filter(|row| columns.iter().all(|name| table.is_gap(name, *row))) {
        let expected = columns.join(" or ");
        table.wrong(row, None, format!("no observed value in this row; expected a value in {expected}"));
    }
}

fn impact(table: &Table, row: usize, [nx, ny]: [Measured; 2], velocity: [Measured; 2]) -> Before {
    let length = nx.value.hypot(ny.value);
    let written = |columns: [&str; 2]| {
        let [x, y] = columns.map(|column| table.text(column, row).unwrap_or_default());
        format!("({x}, {y})")
    };
    let line = written(["nx", "ny"]);
    if !is_unit(nx.value, ny.value) {
        let message = format!("the line of centres {line} has the length {length:?}; expected a unit vector");
        table.wrong(row, "nx", message);
    } else if nx.value * velocity[0].value + ny.value * velocity[1].value <= 0.0 {
        let velocity = written(["cue_vx", "cue_vy"]);
        table.wrong(row, "cue_vx", message!("no_approach", velocity, line));
    }
    let normal = [nx, ny].map(|n| Measured { value: n.value / length, sd: n.sd });
    Before::Impact { normal, velocity }
}
