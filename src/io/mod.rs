//! Files of measured collisions: `dataset.toml`, the tables that it names, and results that are
//! read back.

pub(crate) mod balls;
pub(crate) mod cases;
pub(crate) mod draft;
pub(crate) mod error;
mod manifest;
mod rows;
pub(crate) mod table;
mod text;
pub(crate) mod toml_file;
pub(crate) mod tracking;

use std::collections::{HashMap, HashSet};
use std::path::Path;

use error::Problems;
use manifest::{Keys, Manifest};
use polars::prelude::{DataFrame, PolarsResult, df};
use schemars::Schema;
use text::read_utf8;
use toml_file::{Source, checked};

use crate::measurement::dataset::{Dataset, Shot};
use crate::measurement::track::{Sample, TrackShot, TrackedBall};

pub use error::{DatasetError, Problem};
pub use manifest::Kind;

/// Loads a data set from a folder that holds a dataset.toml, or from the path of such a file.
///
/// # Errors
/// Every problem of the data set, with file, line, column, value and what was expected.
pub fn load(path: &Path) -> Result<Dataset, DatasetError> {
    let file = if path.is_dir() { path.join("dataset.toml") } else { path.to_path_buf() };
    let problems = Problems::new(format!("the data set {} cannot be used:", file.display()));
    if !file.is_file() {
        let message = "there is no such file; expected a dataset.toml, or a folder that holds one";
        problems.add(&file, None, None, message);
        return Err(problems.into_error());
    }
    let text = read_utf8(&file, &problems);
    checked(&file, text.as_deref(), problems, dataset)
}

/// Loads a data set from the text of a dataset.toml that would stand in the file `path`.
///
/// # Errors
/// Those of [`load`].
pub(crate) fn load_text(text: &str, path: &Path) -> Result<Dataset, DatasetError> {
    let problems = Problems::new(format!("the data set {} cannot be used:", path.display()));
    checked(path, Some(text), problems, dataset)
}

/// Returns the JSON Schema (draft 2020-12) of dataset.toml, for editors that check it.
#[must_use]
pub fn schema() -> Schema {
    toml_file::schema::<Keys>()
}

/// Returns the data set with its shots or tracks; without them if dataset.toml has problems.
fn dataset(keys: Keys, source: &Source) -> Dataset {
    let manifest = keys.check(source);
    if !source.problems.is_empty() {
        return manifest.dataset;
    }
    if let Some(settings) = &manifest.tracks {
        let tracks = Some(tracking::load(&manifest, settings, source));
        return Dataset { tracks, ..manifest.dataset };
    }
    let Manifest { mut dataset, kind, files, assume, .. } = manifest;
    for file in &files {
        rows::add(&mut dataset, file, kind, assume, source);
    }
    let names = dataset.shots.iter().map(|shot| (shot.name.as_str(), shot.file.as_path(), shot.line));
    check_unique(names, "", source.problems);
    number_shots(&mut dataset.shots);
    for shot in dataset.shots.iter_mut().filter(|_| dataset.side_sd > 0.0) {
        if !shot.add_side_spin(dataset.side_sd, dataset.ball.radius) {
            let message =
                "is missing; expected a speed in every row, since [cue_spin] side_sd is a part of it";
            source.problems.add(&shot.file, shot.line, "speed_m_s", message);
        }
    }
    dataset
}

/// Complains about equal names of shots, each with its file and line; `remedy` follows the message.
pub(crate) fn check_unique<'a>(
    names: impl Iterator<Item = (&'a str, &'a Path, usize)>,
    remedy: &str,
    problems: &Problems,
) {
    let mut seen = HashMap::new();
    for (name, file, line) in names.filter(|(name, ..)| !name.is_empty()) {
        if let Some((other, other_line)) = seen.insert(name, (file, line)) {
            let other = other.file_name().unwrap_or_default().display();
            let message = format!(
                "\"{name}\" also names the shot in line {other_line} of {other}; expected a name of its own{remedy}"
            );
            problems.add(file, line, "shot", message);
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
    let mut names: [Vec<&str>; 3] = Default::default();
    let mut frames: Vec<i64> = Vec::new();
    let mut numbers: [Vec<Option<f64>>; 5] = Default::default();
    for shot in shots {
        let centres = [("cue", "centre", &shot.cue), ("object", "centre", &shot.object)];
        let markers = shot.markers.iter().map(|marker| {
            let ball = if marker.ball == TrackedBall::Cue { "cue" } else { "object" };
            (ball, marker.name.as_str(), &marker.samples)
        });
        for (ball, point, samples) in centres.into_iter().chain(markers) {
            for Sample { t, x, y, sd } in samples {
                let own = [shot.name.as_str(), ball, point];
                names.iter_mut().zip(own).for_each(|(column, name)| column.push(name));
                frames.push((t * shot.fps).round() as i64);
                let [x_sd, y_sd] = sd.map_or([None; 2], |sd| sd.map(Some));
                let own = [Some(*t), Some(*x), Some(*y), x_sd, y_sd];
                numbers.iter_mut().zip(own).for_each(|(column, number)| column.push(number));
            }
        }
    }
    let ([shot, ball, point], [t, x, y, x_sd, y_sd]) = (names, numbers);
    df!(
        "shot" => shot, "frame" => frames, "t" => t, "ball" => ball, "point" => point,
        "x" => x, "y" => y, "x_sd" => x_sd, "y_sd" => y_sd,
    )
}
