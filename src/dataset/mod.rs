//! Measured collisions: `dataset.toml` and the tables it names.

mod angles;
pub(crate) mod error;
mod extraction;
mod fit_section;
mod impacts;
pub(crate) mod joint;
mod manifest;
mod rows;
pub(crate) mod table;
pub(crate) mod toml_file;
pub mod tracks;
mod valid;

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use error::{Problems, did_you_mean};
use manifest::{Kind, Manifest};
use table::Table;

use nalgebra::{DMatrix, DVector};

use crate::ball::{Ball, Vec3};
use crate::loss::Loss;
use crate::observable::Observable;
use crate::parameters::Settings;
use crate::relation::Relation;

pub use error::{DatasetError, Problem};
pub use tracks::{Survey, Tracks, survey};

/// A data set. One that was read from files is checked; of one that a program made a fit refuses what
/// [`Dataset::faults`] finds.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// Also the name of its folder below `fits/`.
    pub name: String,
    /// The file it was read from.
    pub path: PathBuf,
    pub cloth: Option<String>,
    pub source: Option<String>,
    pub ball: Ball,
    pub settings: Settings,
    /// Constraints between parameters (`[fit] constraints`).
    pub relations: Vec<Relation>,
    /// How outlying shots count (`[fit] loss`).
    pub loss: Loss,
    /// The label column whose values are fitted apart (`[fit] by`).
    pub by: Option<String>,
    pub shots: Vec<Shot>,
    /// Shots that are left out from the start, with the reason.
    pub left_out: Vec<(String, String)>,
    /// The cloth's sliding friction μ_k, where the shots were extracted from tracks with it.
    pub sliding: Option<Measured>,
    /// Its rolling resistance μ_r likewise.
    pub rolling: Option<Measured>,
    /// Relative standard error that all shots share of how high friction lifts a ball, where they were extracted with it.
    pub lift_sd: Option<f64>,
    /// Kind `tracks`: what was filmed, from which shots are yet to be extracted.
    pub tracks: Option<Tracks>,
}

impl Dataset {
    /// Whether it is of tracks from which no impacts have been extracted yet.
    #[must_use]
    pub fn awaits_extraction(&self) -> bool {
        self.shots.is_empty() && self.tracks.as_ref().is_some_and(|tracks| !tracks.shots.is_empty())
    }

    /// The standard errors that all shots share.
    #[must_use]
    pub fn shared_errors(&self) -> Vec<(Shared, f64)> {
        let sd = |shared| match shared {
            Shared::Sliding => self.sliding.and_then(|sliding| sliding.sd),
            Shared::Lift => self.lift_sd,
            Shared::Rolling => self.rolling.and_then(|rolling| rolling.sd),
        };
        Shared::ALL.into_iter().filter_map(|shared| Some((shared, sd(shared)?))).collect()
    }
}

/// One shot, or the mean of several.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The `shot` column, or where there is none the number, from 1, among all the data set's shots.
    pub name: String,
    pub file: PathBuf,
    /// Line of the file, from 1, comments and header counted.
    pub line: usize,
    /// Columns that are neither input nor observable, kept as text.
    pub labels: BTreeMap<String, String>,
    pub before: Before,
    pub spin: Spin,
    /// At least one.
    pub after: Vec<Measurement>,
    /// Where state before and observations were extracted together, their joint errors.
    pub joint: Option<Box<Joint>>,
}

/// Errors of what was extracted from one track, table frame: direction of the line of centres (rad), the
/// cue ball's v_x, v_y (m/s), ω_x, ω_y, ω_z (rad/s) before the impact, then the shot's observations in
/// their order.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Without the errors that all shots share.
    pub covariance: DMatrix<f64>,
    /// How they move with each of these, in the order of [`Shared::ALL`].
    pub by_shared: [DVector<f64>; 3],
}

/// What all shots of footage were extracted with, so that they share its error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shared {
    /// The cloth's sliding friction μ_k.
    Sliding,
    /// How high friction lifts a ball, as a factor.
    Lift,
    /// The cloth's rolling resistance μ_r.
    Rolling,
}

impl Shared {
    pub const ALL: [Self; 3] = [Self::Sliding, Self::Lift, Self::Rolling];
}

impl Joint {
    /// How many quantities before the impact stand in front of the observations.
    pub const BEFORE: usize = 6;
}

/// A value with its standard deviation, where the data give one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    pub value: f64,
    pub sd: Option<f64>,
}

/// An observable's measured value, in SI units and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    pub observable: Observable,
    pub measured: Measured,
}

/// The cue ball's motion before the impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Before {
    /// Kind `impacts`: line of centres (unit vector, cue to object) and velocity, table frame.
    Impact { normal: [Measured; 2], velocity: [Measured; 2] },
    /// Kind `angles`: cut angle in radians, and the speed (m/s) where it is known.
    Angle { cut: Measured, speed: Option<Measured> },
}

/// The cue ball's spin before the impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spin {
    Stun,
    NaturalRoll,
    /// rad/s, in the table frame for `impacts` and in the collision frame for `angles`.
    Measured {
        spin: Vec3,
        sd: [Option<f64>; 3],
    },
    Unknown,
}

/// Loads a data set from a folder that holds a dataset.toml, or from the path of such a file.
///
/// # Errors
/// Everything that is wrong with it, each with file, line, column, value and what was expected.
pub fn load(path: &Path) -> Result<Dataset, DatasetError> {
    let file = if path.is_dir() { path.join("dataset.toml") } else { path.to_path_buf() };
    let manifest = Manifest::read(&file)?;
    let mut problems = Problems::of_dataset(&file);
    let mut tracks = None;
    if let Some(settings) = &manifest.tracks {
        tracks = Some(tracks::load(&manifest, settings, &file, &mut problems));
    }
    let tables = if tracks.is_some() { &[] } else { manifest.files.as_slice() };
    let mut shots: Vec<Shot> = Vec::new();
    for table in tables {
        let Some(table) = Table::read(table, &mut problems) else { continue };
        if let Some((by, line, position)) = &manifest.by
            && !table.has(by)
        {
            let near = did_you_mean(by, table.names());
            let message = format!("by is \"{by}\", but {} has no such column{near}", table.path.display());
            problems.add(&file, Some(*line), Some(position), message);
        }
        let read = match manifest.kind {
            Kind::Impacts => impacts::shots,
            Kind::Angles | Kind::Tracks => angles::shots,
        };
        let mut own = read(&table, manifest.assume, &mut problems);
        if let Some((by, ..)) = manifest.by.as_ref().filter(|(by, ..)| table.has(by)) {
            for row in (0..table.rows()).filter(|row| table.text(by, *row).is_none()) {
                let message = "is empty; expected a label, since [fit] by names this column";
                problems.add(&table.path, Some(table.line(row)), Some(by), message);
            }
            for shot in &mut own {
                let label = table.row(shot.line).and_then(|row| table.text(by, row)).unwrap_or_default();
                shot.labels.entry(by.clone()).or_insert_with(|| label.to_string());
            }
        }
        shots.append(&mut own);
    }
    name_shots(&mut shots, &mut problems);
    if let Some(path) = &manifest.extraction.covariance {
        joint::read(path, &mut shots, &manifest.extraction.shared(), &mut problems);
    }
    let Manifest { name, cloth, source, ball, settings, relations, loss, by, extraction, .. } = manifest;
    let by = by.map(|(by, ..)| by);
    problems.into_result(Dataset {
        name,
        path: file,
        cloth,
        source,
        ball,
        settings,
        relations,
        loss,
        by,
        shots,
        left_out: Vec::new(),
        sliding: extraction.sliding,
        rolling: extraction.rolling,
        lift_sd: extraction.lift_sd,
        tracks,
    })
}

/// The names of the columns in the first line of a table that is neither blank nor a comment.
///
/// # Errors
/// A file that cannot be read.
pub fn header(file: &Path) -> std::io::Result<Vec<String>> {
    let bytes = std::fs::read(file)?;
    let text = String::from_utf8_lossy(&bytes);
    let text = text.trim_start_matches('\u{feff}');
    let first = text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#'));
    let Some(first) = first.or(text.lines().find(|line| !line.trim().is_empty())) else {
        return Ok(Vec::new());
    };
    let separator = [';', '\t', ','].into_iter().max_by_key(|c| first.matches(*c).count()).unwrap_or(',');
    Ok(first.split(separator).map(|name| name.trim().trim_matches('"').to_string()).collect())
}

/// Numbers the shots that have no name, and complains about names given twice.
fn name_shots(shots: &mut [Shot], problems: &mut Problems) {
    let mut seen: HashMap<String, (PathBuf, usize)> = HashMap::new();
    for shot in shots.iter().filter(|shot| !shot.name.is_empty()) {
        if let Some((file, line)) = seen.get(&shot.name) {
            let file = file.file_name().unwrap_or_default().display();
            let message = format!(
                "\"{}\" also names the shot in line {line} of {file}; expected a name of its own",
                shot.name
            );
            problems.add(&shot.file, Some(shot.line), Some("shot"), message);
        } else {
            seen.insert(shot.name.clone(), (shot.file.clone(), shot.line));
        }
    }
    for (i, shot) in shots.iter_mut().enumerate().filter(|(_, shot)| shot.name.is_empty()) {
        shot.name = (i + 1).to_string();
        // another file may number its shots
        if seen.contains_key(&shot.name) {
            let file = shot.file.file_name().unwrap_or_default().display();
            shot.name = format!("{} ({file}:{})", i + 1, shot.line);
        }
    }
}
