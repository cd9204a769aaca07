//! `dataset.toml`.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

use super::balls_section::{RawBall, RawObject, Shape};
use super::error::{DatasetError, Problems};
use super::fit_section::RawFit;
use super::impacts_section::{Extraction, RawImpacts};
use super::table::read_utf8;
use super::toml_file::{Source, bare, checked};
use super::tracking::camera::RawCamera;
use super::tracking::settings::{RawScale, RawTracks, RawVideo, Sections, TrackSettings};
use crate::measurement::dataset::ObjectBall;
use crate::measurement::loss::Loss;
use crate::measurement::parameter::Settings;
use crate::measurement::spin::Spin;
use crate::physics::ball::Ball;
use crate::physics::collision::kappa;
use crate::physics::disc::{Discs, UNIFORM_DISC};
use crate::physics::name::worded;

/// In bytes: a folder's name may be this long everywhere, and something still be added to it.
const LONGEST_NAME: usize = 200;

/// A checked dataset.toml.
pub(crate) struct Manifest {
    pub name: String,
    pub kind: Kind,
    pub files: Vec<PathBuf>,
    pub cloth: Option<String>,
    pub balls: Option<String>,
    pub source: Option<String>,
    pub ball: Ball,
    /// Of balls: the object ball, where it is not like the cue ball.
    pub object: Option<ObjectBall>,
    /// What was taken for granted where it is not stated, in sentences.
    pub taken: Vec<String>,
    /// Where the data are of discs, for kind `tracks`.
    pub discs: Option<Discs>,
    pub assume: Option<Assume>,
    /// Standard deviation of side spin that nobody saw, as Rω_z/U; 0: there is none.
    pub side_sd: f64,
    pub settings: Settings,
    pub loss: Loss,
    /// For kind `tracks`.
    pub tracks: Option<TrackSettings>,
    /// For kind `impacts`, where they were extracted from tracks.
    pub extraction: Extraction,
    /// `[fit] by`, with its line and the position in it.
    pub by: Option<(String, usize, String)>,
}

worded! {
    #[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
    #[serde(rename_all = "lowercase")]
    pub(crate) enum Kind {
        Tracks = "tracks",
        Impacts = "impacts",
        Angles = "angles",
    }
    fn name;
}

worded! {
    #[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
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
    /// The spin that it says, where it does not say that it is measured.
    pub(crate) fn spin(self) -> Option<Spin> {
        match self {
            Self::Stun => Some(Spin::Stun),
            Self::NaturalRoll => Some(Spin::NaturalRoll),
            Self::Unknown => Some(Spin::Unknown),
            Self::Measured => None,
        }
    }

    /// The one that a cell of a table names, in small or capital letters.
    pub(crate) fn of(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|one| one.name().eq_ignore_ascii_case(word))
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "the keys of a data set")]
struct RawManifest {
    name: Spanned<String>,
    kind: Spanned<Kind>,
    files: Spanned<Vec<Spanned<String>>>,
    cloth: Option<String>,
    balls: Option<String>,
    source: Option<String>,
    #[serde(default)]
    ball: RawBall,
    object: Option<Spanned<RawObject>>,
    cue_spin: Option<Spanned<RawSpin>>,
    video: Option<Spanned<RawVideo>>,
    camera: Option<Spanned<RawCamera>>,
    scale: Option<Spanned<RawScale>>,
    tracks: Option<Spanned<RawTracks>>,
    impacts: Option<Spanned<RawImpacts>>,
    #[serde(default)]
    fit: RawFit,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [cue_spin] assume = \"stun\"")]
struct RawSpin {
    /// Where it is left out, as in a fresh draft, what is missing is said with all else that is.
    assume: Option<Assume>,
    /// Standard deviation of side spin that nobody saw, as Rω_z/U.
    side_sd: Option<Spanned<f64>>,
}

/// What stands in a section; nothing where it is left out.
fn inner<T: Default>(section: Option<Spanned<T>>) -> T {
    section.map(Spanned::into_inner).unwrap_or_default()
}

/// The data sets that a folder without a dataset.toml holds, as a hint: `: data/a, data/b and 3 more`.
fn below(folder: &Path) -> String {
    /// So many are named.
    const NAMED: usize = 3;
    let Ok(entries) = std::fs::read_dir(folder) else { return String::new() };
    let mut found: Vec<PathBuf> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.join("dataset.toml").is_file())
        .collect();
    found.sort();
    let named: Vec<String> = found.iter().take(NAMED).map(|path| path.display().to_string()).collect();
    match found.len() {
        0 => String::new(),
        count if count > NAMED => format!(", as {} and {} more do", named.join(", "), count - NAMED),
        1 => format!(", as {} does", named.join(", ")),
        _ => format!(", as {} do", named.join(", ")),
    }
}

impl Manifest {
    /// Reads and checks it, all but the tables.
    pub(crate) fn read(path: &Path) -> Result<Self, DatasetError> {
        let problems = Problems::of_dataset(path);
        if !path.is_file() {
            let below = path.parent().map(below).unwrap_or_default();
            let message = "there is no such file; expected a dataset.toml, or a folder that holds one";
            problems.add(path, None, None, format!("{message}{below}"));
            return Err(problems.into_error());
        }
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv")) {
            problems.add(path, None, None, "is a table; expected the dataset.toml that names it under files");
            return Err(problems.into_error());
        }
        let text = read_utf8(path, &problems);
        checked(path, text.as_deref(), problems, RawManifest::check)
    }

    /// Checks a text that stands for a dataset.toml at this path.
    pub(crate) fn of_text(path: &Path, text: &str) -> Result<Self, DatasetError> {
        checked(path, Some(text), Problems::of_dataset(path), RawManifest::check)
    }
}

impl RawManifest {
    fn check(mut self, source: &Source) -> Manifest {
        let name = self.name.as_ref();
        let odd = |c: char| c == '/' || c == '\\' || c.is_control();
        if name.trim() != name || name.is_empty() || name == "." || name == ".." || name.contains(odd) {
            let message = format!(
                "name is {}; expected one that can name a folder, without slashes, control characters and \
                 blanks around it",
                source.written(&self.name.span())
            );
            source.wrong(&self.name, message);
        } else if name.len() > LONGEST_NAME {
            source
                .wrong(&self.name, format!("name has {} bytes; expected at most {LONGEST_NAME}", name.len()));
        }
        let kind = *self.kind.as_ref();
        let sections = [
            ("video", self.video.as_ref().map(Spanned::span), Kind::Tracks),
            ("camera", self.camera.as_ref().map(Spanned::span), Kind::Tracks),
            ("scale", self.scale.as_ref().map(Spanned::span), Kind::Tracks),
            ("tracks", self.tracks.as_ref().map(Spanned::span), Kind::Tracks),
            ("impacts", self.impacts.as_ref().map(Spanned::span), Kind::Impacts),
        ];
        for (key, span, only) in sections {
            if let Some(span) = span.filter(|_| kind != only) {
                let [kind, only] = [kind, only].map(Kind::name);
                let message =
                    format!("[{key}] stands in a data set of kind \"{kind}\"; it goes with \"{only}\" only");
                source.wrong_at(&span, message);
            }
        }
        let extraction =
            self.impacts.as_ref().map(|impacts| impacts.as_ref().check(source)).unwrap_or_default();
        let files = self.files(source);
        let (ball, poisson) = self.ball.check(self.object.as_ref().map(Spanned::as_ref), source);
        let discs = self.discs(source);
        let object = self.object.as_ref().filter(|_| discs.is_none());
        let taken = object.map(|object| object.as_ref().taken(&self.ball, &ball)).unwrap_or_default();
        let object = object.map(|object| object.as_ref().ball(&self.ball, &ball, source));
        let mut tracks = (kind == Kind::Tracks).then(|| {
            let sections = Sections {
                video: inner(self.video.take()),
                camera: inner(self.camera.take()),
                scale: inner(self.scale.take()),
                tracks: inner(self.tracks.take()),
            };
            sections.check(discs.is_some(), source)
        });
        if let (Some(discs), Some(tracks)) = (discs, tracks.as_mut())
            && let Some([first, _]) = discs.masses
            && self.object.as_ref().is_none_or(|object| object.as_ref().mass_kg.is_none())
        {
            tracks.notes.push(format!(
                "Both discs are taken to weigh {first} kg: [ball] mass_kg states the first one's, and nothing states the second one's. \
                 If it differs, give [object] mass_kg."
            ));
        }
        let discs = discs
            .zip(tracks.as_ref())
            .map(|(discs, tracks)| Discs { in_seconds: !tracks.unknown_rate, ..discs });
        let settings = self.fit.settings(kappa(poisson), source);
        let side_sd = self.side_sd(source);
        let loss = self.fit.loss(source);
        Manifest {
            name: name.clone(),
            kind,
            files,
            cloth: self.cloth,
            balls: self.balls,
            source: self.source,
            ball,
            object,
            taken,
            // of discs, points on them show how they turn
            side_sd,
            assume: inner(self.cue_spin).assume.or(discs.map(|_| Assume::Unknown)),
            discs,
            settings,
            loss,
            tracks,
            extraction,
            by: self.fit.by.map(|by| {
                let (line, position) = source.place(&by.span());
                (by.into_inner(), line, position)
            }),
        }
    }

    /// `[cue_spin] side_sd`, checked.
    fn side_sd(&self, source: &Source) -> f64 {
        let Some(side_sd) = self.cue_spin.as_ref().and_then(|spin| spin.as_ref().side_sd.as_ref()) else {
            return 0.0;
        };
        let value = *side_sd.as_ref();
        let disc = bare(&self.ball.shape) == Some(Shape::Disc);
        if !(0.0..=1.0).contains(&value) {
            let message = format!(
                "cue_spin.side_sd is {value}; expected the standard deviation of the side spin times the radius over the speed, \
                 from 0 to 1"
            );
            source.wrong(side_sd, message);
        } else if disc {
            let message = "cue_spin.side_sd goes with balls: points on discs show how they turn";
            source.wrong(side_sd, message);
        }
        value
    }

    /// The discs, where [ball] says that they are.
    fn discs(&self, source: &Source) -> Option<Discs> {
        let disc = self.ball.shape.as_ref().filter(|shape| *shape.as_ref() == Shape::Disc)?;
        if *self.kind.as_ref() != Kind::Tracks {
            let message = format!(
                "shape is \"disc\" in a data set of kind \"{}\"; expected it with kind \"tracks\" only",
                self.kind.as_ref().name()
            );
            source.wrong(disc, message);
        }
        let rolls = |spin: &&Spanned<RawSpin>| spin.as_ref().assume == Some(Assume::NaturalRoll);
        if let Some(spin) = self.cue_spin.as_ref().filter(rolls) {
            let message = "[cue_spin] assume is \"natural-roll\", but discs do not roll; expected \"stun\" (neither disc turns before \
                           the impact) or \"unknown\": points on the discs show how they turn";
            source.wrong(spin, message);
        }
        let other = inner(self.object.clone());
        if let Some(inertia) = &other.inertia {
            let message = "object.inertia goes with balls; both discs have the inertia that stands in [ball]";
            source.wrong(inertia, message);
        }
        let pair = |key: &str, first: &Option<Spanned<f64>>, second: &Option<Spanned<f64>>| {
            if let Some(second) = second {
                let value = *second.as_ref();
                if !(value > 0.0 && value.is_finite()) {
                    source.wrong(second, format!("object.{key} is {value}; expected more than 0"));
                } else if first.is_none() {
                    let message = format!("{key} stands in [object], but not in [ball]; expected it in both");
                    source.wrong(second, message);
                }
            }
            bare(first).map(|first| [first, bare(second).unwrap_or(first)])
        };
        Some(Discs {
            radii: pair("radius_m", &self.ball.radius_m, &other.radius_m),
            masses: pair("mass_kg", &self.ball.mass_kg, &other.mass_kg),
            inertia: bare(&self.ball.inertia).unwrap_or(UNIFORM_DISC),
            in_seconds: true,
        })
    }

    /// The globs, relative to the file's own folder.
    fn files(&self, source: &Source) -> Vec<PathBuf> {
        let folder = source.path.parent().unwrap_or(Path::new(""));
        let shown = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let folder = glob::Pattern::escape(&folder.to_string_lossy());
        let mut files = Vec::new();
        if self.files.as_ref().is_empty() {
            let message = "files is empty; expected at least one, as in [\"shots.csv\"]";
            source.wrong(&self.files, message);
        }
        for pattern in self.files.as_ref() {
            let text = pattern.as_ref();
            let whole = if Path::new(text).is_absolute() || folder.is_empty() {
                text.clone()
            } else {
                format!("{folder}/{text}")
            };
            let found = |whole: &str| -> Result<Vec<PathBuf>, glob::PatternError> {
                Ok(glob::glob(whole)?.filter_map(Result::ok).filter(|path| path.is_file()).collect())
            };
            // Windows writes backslashes
            let found = match found(&whole) {
                Ok(paths) if paths.is_empty() && text.contains('\\') => found(&whole.replace('\\', "/")),
                found => found,
            };
            match found {
                Ok(paths) if paths.is_empty() => source.wrong(
                    pattern,
                    format!("\"{text}\" names no file in {}; expected at least one", shown.display()),
                ),
                // two patterns may name the same file
                Ok(paths) => {
                    for path in paths {
                        if !files.contains(&path) {
                            files.push(path);
                        }
                    }
                }
                Err(error) => source.wrong(pattern, format!("\"{text}\" is no pattern: {}", error.msg)),
            }
        }
        files
    }
}
