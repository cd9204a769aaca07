//! `dataset.toml`.

use std::path::{Path, PathBuf};

use indexmap::IndexSet;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::balls::{BallSection, Shape};
use super::fit_section::FitSection;
use super::toml_file::{Rule, Source};
use super::tracking::camera::{CameraSection, label_or_section, schema_of_camera};
use super::tracking::settings::{ScaleSection, TrackSettings, TracksSection, VideoSection};
use crate::measurement::dataset::{Dataset, UNWEIGHED};
use crate::measurement::fault::{Condition, POSITIVE};
use crate::measurement::spin::Spin;
use crate::physics::ball::Ball;
use crate::physics::collision::{POISSON, kappa};
use crate::physics::disc::{Discs, UNIFORM_DISC};
use crate::physics::name::worded;

/// Maximum length of a data set's name, bytes: with suffixes below the 255 of file systems.
const MAX_NAME_BYTES: usize = 200;

const SIDE_SPIN: Condition = (
    |x| (0.0..=1.0).contains(&x),
    "the standard deviation of the side spin times the radius over the speed, from 0 to 1",
);

const RULES: [Rule; 2] = [(SIDE_SPIN, "cue_spin.side_sd"), (POSITIVE, "cue_spin.topspin_sd table.tilt_sd")];

/// A checked dataset.toml.
pub(crate) struct Manifest {
    /// The data set, without its shots.
    pub(crate) dataset: Dataset,
    pub(crate) kind: Kind,
    pub(crate) files: Vec<PathBuf>,
    /// The discs, if the data are of discs (kind `tracks`).
    pub(crate) discs: Option<Discs>,
    pub(crate) assume: Option<Assume>,
    /// Settings of kind `tracks`.
    pub(crate) tracks: Option<TrackSettings>,
}

worded! {
    /// The kind of a data set: the measured quantities.
    #[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
    #[non_exhaustive]
    #[serde(rename_all = "lowercase")]
    pub enum Kind {
        /// The positions of both balls in every frame.
        Tracks = "tracks",
        /// Velocities and spins just before and after the impact.
        Impacts = "impacts",
        /// Cut angles, and angles and speeds after the impact.
        Angles = "angles",
    }
    /// The name in dataset.toml and in a specification.
    pub fn name;
}

worded! {
    #[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
    #[serde(rename_all = "kebab-case")]
    pub(crate) enum Assume {
        Stun = "stun",
        NaturalRoll = "natural-roll",
        Measured = "measured",
        Unknown = "unknown",
    }
    pub(crate) fn name;
}

impl Assume {
    /// Returns the spin, unless it is measured.
    pub(crate) fn spin(self) -> Option<Spin> {
        self.name().parse().ok()
    }
}

/// The keys of a dataset.toml.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "the keys of a data set")]
pub(crate) struct Keys {
    name: String,
    kind: Kind,
    files: Vec<String>,
    cloth: Option<String>,
    balls: Option<String>,
    source: Option<String>,
    #[serde(default)]
    ball: BallSection,
    object: Option<BallSection>,
    #[serde(default)]
    cue_spin: SpinSection,
    #[serde(default)]
    video: VideoSection,
    #[serde(default, deserialize_with = "label_or_section")]
    #[schemars(schema_with = "schema_of_camera")]
    camera: CameraSection,
    #[serde(default)]
    table: TableSection,
    #[serde(default)]
    scale: ScaleSection,
    #[serde(default)]
    tracks: TracksSection,
    #[serde(default)]
    fit: FitSection,
}

#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table, as in [cue_spin] assume = \"stun\"")]
struct SpinSection {
    /// `None` in a fresh draft; that it is missing is reported with the other problems.
    assume: Option<Assume>,
    /// Standard deviation of the side spin, as Rω_z/U, if it was not seen.
    side_sd: Option<f64>,
    /// Standard deviation of the topspin that all shots stated as stun or natural roll share, as
    /// Rω/U.
    topspin_sd: Option<f64>,
}

#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table, as in [table] tilt_sd = 0.001")]
struct TableSection {
    /// Standard deviation of the slope of the table, m/m.
    tilt_sd: Option<f64>,
}

impl Keys {
    /// Checks all keys, whose problems are added to those of the source.
    pub(crate) fn check(self, source: &Source) -> Manifest {
        source.check(&RULES);
        self.check_name(source);
        source.check_together("all");
        let note = |[.., note]: [String; 3]| {
            let note = note.replace("{unweighed}", &UNWEIGHED.to_string());
            note.replace("{radius}", &Ball::POOL.radius.to_string())
        };
        let mut dataset = Dataset {
            path: source.path.to_path_buf(),
            taken: source.rules("notes").into_iter().map(note).collect(),
            side_sd: self.cue_spin.side_sd.unwrap_or(0.0),
            settings: self.fit.settings(kappa(self.ball.poisson.unwrap_or(POISSON)), source),
            ..Dataset::new(&self.name, self.ball.cue(self.object.as_ref(), source), Vec::new())
        };
        let (is_disc, files) = (self.ball.shape == Shape::Disc, self.files(source));
        let object = self.object.filter(|_| !is_disc);
        dataset.object = object.map(|object| object.object(&self.ball, dataset.ball, source));
        let discs = is_disc.then(|| self.discs());
        (dataset.cloth, dataset.balls, dataset.source) = (self.cloth, self.balls, self.source);
        (dataset.loss, dataset.by) = (self.fit.loss, self.fit.by);
        dataset.camera.clone_from(&self.camera.label);
        let tracks = TrackSettings {
            video: self.video,
            camera: self.camera,
            scale: self.scale,
            tracks: self.tracks,
            tilt_sd: self.table.tilt_sd,
            topspin_sd: self.cue_spin.topspin_sd,
            discs: is_disc,
            ..TrackSettings::default()
        };
        let tracks = (self.kind == Kind::Tracks).then(|| tracks.checked(source));
        Manifest {
            dataset,
            kind: self.kind,
            files,
            // points on discs show their rotation
            assume: self.cue_spin.assume.or(discs.map(|_| Assume::Unknown)),
            discs,
            tracks,
        }
    }

    fn check_name(&self, source: &Source) {
        let name = self.name.as_str();
        let is_forbidden = |c: char| c == '/' || c == '\\' || c.is_control();
        let is_good = !["", ".", ".."].contains(&name) && name.trim() == name && !name.contains(is_forbidden);
        let message = format!(
            "name is {}; expected one that can name a folder, without slashes, control characters and blanks around it",
            source.written("name")
        );
        source.wrong_if(!is_good, "name", &message);
        let message = format!("name has {} bytes; expected at most {MAX_NAME_BYTES}", name.len());
        source.wrong_if(is_good && name.len() > MAX_NAME_BYTES, "name", &message);
    }

    /// Returns the discs that `[ball]` and `[object]` state.
    fn discs(&self) -> Discs {
        let (first, second) = (self.ball, self.object.unwrap_or_default());
        let pair = |first: Option<f64>, second: Option<f64>| first.map(|one| [one, second.unwrap_or(one)]);
        Discs {
            radii: pair(first.radius_m, second.radius_m),
            masses: pair(first.mass_kg, second.mass_kg),
            inertia: first.inertia.unwrap_or(UNIFORM_DISC),
            in_seconds: !self.video.has_unknown_rate(),
        }
    }

    /// Returns the files of the patterns, which are relative to the dataset.toml's folder, each once.
    fn files(&self, source: &Source) -> Vec<PathBuf> {
        let folder = source.path.parent().unwrap_or(Path::new(""));
        let shown = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let escaped = PathBuf::from(glob::Pattern::escape(&folder.to_string_lossy()));
        let mut files = IndexSet::new();
        let message = "files is empty; expected at least one, as in [\"shots.csv\"]";
        source.wrong_if(self.files.is_empty(), "files", message);
        for (place, text) in self.files.iter().enumerate() {
            let wrong = |message: String| source.wrong(&format!("files.{place}"), message);
            match glob::glob(&escaped.join(text).to_string_lossy()) {
                Ok(paths) => {
                    let mut paths = paths.flatten().filter(|path| path.is_file()).peekable();
                    if paths.peek().is_none() {
                        let folder = shown.display();
                        wrong(format!("\"{text}\" names no file in {folder}; expected at least one"));
                    }
                    files.extend(paths);
                }
                Err(error) => wrong(format!("\"{text}\" is not a pattern: {}", error.msg)),
            }
        }
        files.into_iter().collect()
    }
}
