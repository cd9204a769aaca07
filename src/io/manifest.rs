//! `dataset.toml`.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::balls::{BallSection, Shape, StatedObject};
use super::error::{DatasetError, Problems};
use super::fit_section::FitSection;
use super::table::read_utf8;
use super::toml_file::{Source, checked};
use super::tracking::camera::{CameraSection, label_or_section, schema_of_camera};
use super::tracking::settings::{ScaleSection, Sections, TrackSettings, TracksSection, VideoSection};
use crate::measurement::dataset::Dataset;
use crate::measurement::fault::{Condition, POSITIVE};
use crate::measurement::spin::Spin;
use crate::physics::collision::kappa;
use crate::physics::disc::{Discs, UNIFORM_DISC};
use crate::physics::name::worded;

/// Maximum length of a data set's name, bytes: with suffixes below the 255 of file systems.
const MAX_NAME_BYTES: usize = 200;

const SIDE_SPIN: Condition = (
    |x| (0.0..=1.0).contains(&x),
    "the standard deviation of the side spin times the radius over the speed, from 0 to 1",
);

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
    /// Line and position of `[fit] by`.
    pub(crate) place_of_by: (usize, String),
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
        match self {
            Self::Stun => Some(Spin::Stun),
            Self::NaturalRoll => Some(Spin::NaturalRoll),
            Self::Unknown => Some(Spin::Unknown),
            Self::Measured => None,
        }
    }
}

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
    object: Option<StatedObject>,
    #[serde(default)]
    cue_spin: SpinSection,
    video: Option<VideoSection>,
    #[serde(default, deserialize_with = "label_or_section")]
    #[schemars(schema_with = "schema_of_camera")]
    camera: Option<CameraSection>,
    table: Option<TableSection>,
    scale: Option<ScaleSection>,
    tracks: Option<TracksSection>,
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

impl Manifest {
    /// Reads and checks a dataset.toml without its tables.
    pub(crate) fn read(path: &Path) -> Result<Self, DatasetError> {
        let problems = Problems::of_dataset(path);
        if !path.is_file() {
            let message = "there is no such file; expected a dataset.toml, or a folder that holds one";
            problems.add(path, None, None, message);
            return Err(problems.into_error());
        }
        let text = read_utf8(path, &problems);
        checked(path, text.as_deref(), problems, Keys::check)
    }

    /// Checks the text of a dataset.toml at this path.
    pub(crate) fn of_text(path: &Path, text: &str) -> Result<Self, DatasetError> {
        checked(path, Some(text), Problems::of_dataset(path), Keys::check)
    }
}

impl Keys {
    fn check(self, source: &Source) -> Manifest {
        self.check_name(source);
        self.check_together(source);
        let side_sd = source.number("cue_spin.side_sd", self.cue_spin.side_sd, SIDE_SPIN).unwrap_or(0.0);
        source.number("cue_spin.topspin_sd", self.cue_spin.topspin_sd, POSITIVE);
        let kind = self.kind;
        let files = self.files(source);
        let (ball, poisson) = self.ball.check(self.object.as_ref(), source);
        let discs = self.discs(source);
        let object = self.object.as_ref().filter(|_| discs.is_none());
        let dataset = Dataset {
            path: source.path.to_path_buf(),
            taken: object.map(|object| object.taken(&self.ball, &ball)).unwrap_or_default(),
            object: object.map(|object| object.check(&self.ball, &ball, source)),
            side_sd,
            settings: self.fit.settings(kappa(poisson), source),
            loss: self.fit.loss,
            by: self.fit.by,
            cloth: self.cloth,
            balls: self.balls,
            camera: self.camera.as_ref().and_then(|camera| camera.label.clone()),
            source: self.source,
            ..Dataset::new(self.name, ball, Vec::new())
        };
        let mut tracks = (kind == Kind::Tracks).then(|| {
            let sections = Sections {
                video: self.video.unwrap_or_default(),
                camera: self.camera.unwrap_or_default(),
                scale: self.scale.unwrap_or_default(),
                tracks: self.tracks.unwrap_or_default(),
                tilt_sd: self.table.and_then(|table| table.tilt_sd),
                topspin_sd: self.cue_spin.topspin_sd,
            };
            source.number("table.tilt_sd", sections.tilt_sd, POSITIVE);
            sections.check(discs.is_some(), source)
        });
        if let (Some(discs), Some(tracks)) = (discs, tracks.as_mut())
            && let Some([first, _]) = discs.masses
            && self.object.is_none_or(|object| object.mass_kg.is_none())
        {
            tracks.notes.push(format!(
                "Both discs are taken to weigh {first} kg: [ball] mass_kg states the first one's, but the second one's is not stated. \
                 If it differs, give [object] mass_kg."
            ));
        }
        let discs = discs
            .zip(tracks.as_ref())
            .map(|(discs, tracks)| Discs { in_seconds: !tracks.has_unknown_rate(), ..discs });
        Manifest {
            dataset,
            kind,
            files,
            // points on discs show their rotation
            assume: self.cue_spin.assume.or(discs.map(|_| Assume::Unknown)),
            discs,
            tracks,
            place_of_by: source.place_of("fit.by"),
        }
    }

    fn check_name(&self, source: &Source) {
        let name = self.name.as_str();
        let is_forbidden = |c: char| c == '/' || c == '\\' || c.is_control();
        let is_good = !["", ".", ".."].contains(&name) && name.trim() == name && !name.contains(is_forbidden);
        if !is_good {
            let message = format!(
                "name is {}; expected one that can name a folder, without slashes, control characters and \
                 blanks around it",
                source.written("name").unwrap_or_default()
            );
            source.wrong("name", message);
        } else if name.len() > MAX_NAME_BYTES {
            source.wrong("name", format!("name has {} bytes; expected at most {MAX_NAME_BYTES}", name.len()));
        }
    }

    /// Complains about sections and keys that do not go with the kind of the data, or with discs.
    fn check_together(&self, source: &Source) {
        let (is_film, is_of_discs) = (self.kind == Kind::Tracks, self.ball.shape == Shape::Disc);
        let SpinSection { assume, side_sd, topspin_sd } = &self.cue_spin;
        for (section, is_stated) in [
            ("video", self.video.is_some()),
            ("camera", self.camera.is_some()),
            ("table", self.table.is_some()),
            ("scale", self.scale.is_some()),
            ("tracks", self.tracks.is_some()),
        ] {
            let kind = self.kind.name();
            let message =
                format!("[{section}] stands in a data set of kind \"{kind}\"; it goes with \"tracks\" only");
            source.wrong_if(is_stated && !is_film, section, &message);
        }
        let message = "shape is \"disc\", which goes with kind \"tracks\" only";
        source.wrong_if(is_of_discs && !is_film, "ball.shape", message);
        let message = "[cue_spin] assume is \"natural-roll\", but discs do not roll; expected \"stun\" (no disc turns before \
                       the impact) or \"unknown\": points on the discs show how they turn";
        source.wrong_if(is_of_discs && *assume == Some(Assume::NaturalRoll), "cue_spin.assume", message);
        let message = "cue_spin.side_sd goes with balls: points on discs show how they turn";
        source.wrong_if(is_of_discs && side_sd.is_some(), "cue_spin.side_sd", message);
        let message = "cue_spin.topspin_sd goes with films of balls only";
        let is_of_balls = is_film && !is_of_discs;
        source.wrong_if(!is_of_balls && topspin_sd.is_some(), "cue_spin.topspin_sd", message);
        let message = "object.inertia goes with balls; both discs have the inertia that stands in [ball]";
        let inertia = self.object.and_then(|object| object.inertia);
        source.wrong_if(is_of_discs && inertia.is_some(), "object.inertia", message);
    }

    /// Returns the discs if [ball] states them.
    fn discs(&self, source: &Source) -> Option<Discs> {
        if self.ball.shape != Shape::Disc {
            return None;
        }
        let other = self.object.unwrap_or_default();
        let pair = |name: &str, first: Option<f64>, second: Option<f64>| {
            let key = format!("object.{name}");
            let is_alone = source.number(&key, second, POSITIVE).is_some() && first.is_none();
            let message = format!("{name} stands in [object], but not in [ball]; expected it in both");
            source.wrong_if(is_alone, &key, &message);
            first.map(|first| [first, second.unwrap_or(first)])
        };
        Some(Discs {
            radii: pair("radius_m", self.ball.radius_m, other.radius_m),
            masses: pair("mass_kg", self.ball.mass_kg, other.mass_kg),
            inertia: self.ball.inertia.unwrap_or(UNIFORM_DISC),
            in_seconds: true,
        })
    }

    /// Returns the files of the globs, which are relative to the dataset.toml's folder.
    fn files(&self, source: &Source) -> Vec<PathBuf> {
        let folder = source.path.parent().unwrap_or(Path::new(""));
        let shown = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let folder = glob::Pattern::escape(&folder.to_string_lossy());
        let mut files = Vec::new();
        if self.files.is_empty() {
            source.wrong("files", "files is empty; expected at least one, as in [\"shots.csv\"]");
        }
        for (place, text) in self.files.iter().enumerate() {
            let wrong = |message: String| source.wrong(&format!("files.{place}"), message);
            let whole = if Path::new(text).is_absolute() || folder.is_empty() {
                text.clone()
            } else {
                format!("{folder}/{text}")
            };
            let found = glob::glob(&whole).map(|paths| {
                let paths = paths.filter_map(Result::ok).filter(|path| path.is_file());
                paths.collect::<Vec<PathBuf>>()
            });
            match found {
                Ok(paths) if paths.is_empty() => {
                    wrong(format!("\"{text}\" names no file in {}; expected at least one", shown.display()));
                }
                // two patterns may name the same file
                Ok(paths) => {
                    for path in paths {
                        if !files.contains(&path) {
                            files.push(path);
                        }
                    }
                }
                Err(error) => wrong(format!("\"{text}\" is not a pattern: {}", error.msg)),
            }
        }
        files
    }
}
