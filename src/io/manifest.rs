//! `dataset.toml`.

use std::path::{Path, PathBuf};

use indexmap::IndexSet;
use minijinja::value::Serde;
use minijinja::{UndefinedBehavior, Value as Values, context};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::balls::{self, BallSection, CueSection, Shape};
use super::error::message;
use super::toml_file::Source;
use super::tracking::camera::Camera;
use super::tracking::settings::{ScaleSection, TrackSettings, TracksSection, VideoSection};
use crate::measurement::dataset::{Dataset, Tracks, UNWEIGHED};
use crate::measurement::fault::{Condition, Fault, INERTIA};
use crate::measurement::loss::Loss;
use crate::measurement::parameter::{Compliance, Parameter, Prior, Setting, Settings};
use crate::measurement::spin::Spin;
use crate::name::worded;
use crate::physics::ball::Ball;
use crate::physics::collision::{Model, kappa};
use crate::physics::disc::{Discs, UNIFORM_DISC};
use crate::words::environment;

/// Maximum length of a data set's name, bytes: with suffixes below the 255 of file systems.
const MAX_NAME_BYTES: usize = 200;
/// The moment of inertia of a disc over MR².
const DISC_INERTIA: Condition = (|x| x > 0.0 && x <= 1.0, "more than 0, at most 1 (a ring)");

/// A checked dataset.toml.
pub(crate) struct Manifest {
    pub(crate) dataset: Dataset,
    pub(crate) kind: Kind,
    pub(crate) files: Vec<PathBuf>,
    pub(crate) assume: StatedSpin,
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

/// Statement of dataset.toml, or of a row of a table, about the cue ball's spin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum StatedSpin {
    Is(Spin),
    /// The spin is said to be measured, without numbers.
    Measured,
    #[default]
    Unstated,
}

impl StatedSpin {
    pub(crate) const WORDS: [&str; 4] = ["stun", "natural-roll", "measured", "unknown"];

    pub(crate) fn named(word: &str) -> Option<Self> {
        if word == "measured" { Some(Self::Measured) } else { word.parse().ok().map(Self::Is) }
    }

    /// Returns what is wrong with a shot whose spin `columns` do not measure.
    pub(crate) fn complaint(self, columns: &str) -> String {
        message!("no_spin", is_measured => self == Self::Measured, columns)
    }
}

/// The keys of a dataset.toml.
#[derive(Deserialize, JsonSchema)]
pub(crate) struct Keys {
    name: String,
    kind: Kind,
    files: Vec<String>,
    cloth: Option<String>,
    balls: Option<String>,
    source: Option<String>,
    #[serde(default)]
    ball: CueSection,
    object: Option<BallSection>,
    #[serde(default)]
    cue_spin: SpinSection,
    #[serde(default)]
    video: VideoSection,
    camera: Option<Camera>,
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
struct SpinSection {
    /// `None` in a fresh draft; that it is missing is reported with the other problems.
    #[schemars(extend("enum" = StatedSpin::WORDS))]
    assume: Option<String>,
    /// Standard deviation of the side spin, as Rω_z/U, if it was not seen.
    #[schemars(range(min = 0, max = 1))]
    side_sd: Option<f64>,
    /// Standard deviation of the topspin that all shots stated as stun or natural roll share, as
    /// Rω/U.
    #[schemars(extend("exclusiveMinimum" = 0))]
    topspin_sd: Option<f64>,
}

#[derive(Default, Deserialize, JsonSchema)]
struct TableSection {
    /// Standard deviation of the slope of the table, m/m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    tilt_sd: Option<f64>,
}

impl Keys {
    pub(crate) fn check(self, source: &Source) -> Manifest {
        self.check_name(source);
        let mut taken = Vec::new();
        for (keys, message) in rules(source).lines().filter_map(|line| line.split_once('\t')) {
            if keys == ">" {
                taken.push(message.to_owned());
            } else {
                source.wrong(keys, message.replace("{}", source.written(keys)));
            }
        }
        let (cue, is_disc, files) = (self.ball.own, self.ball.shape == Shape::Disc, self.files(source));
        let inertia = if is_disc { DISC_INERTIA } else { INERTIA };
        let ball = cue.cue(self.object.as_ref());
        let object = self.object.filter(|_| !is_disc).map(|object| object.object(&cue, ball));
        source.add(&balls::faults(ball, object.map_or(ball, |object| object.ball), inertia));
        let film = Tracks {
            discs: is_disc.then(|| self.discs()),
            tilt_sd: self.table.tilt_sd,
            topspin_sd: self.cue_spin.topspin_sd,
            ..Tracks::default()
        };
        // points on discs show their rotation
        let unstated = if is_disc { StatedSpin::Is(Spin::Unknown) } else { StatedSpin::Unstated };
        let camera = self.camera.map(Camera::section).unwrap_or_default();
        let dataset = Dataset {
            path: source.path.to_path_buf(),
            cloth: self.cloth,
            balls: self.balls,
            camera: camera.label.clone(),
            source: self.source,
            object,
            settings: self.fit.settings(self.ball.poisson.map_or(Model::KAPPA, kappa), source),
            loss: self.fit.loss,
            by: self.fit.by,
            side_sd: self.cue_spin.side_sd.unwrap_or(0.0),
            taken,
            ..Dataset::new(self.name, ball, Vec::new())
        };
        let tracks = TrackSettings {
            video: self.video,
            camera,
            scale: self.scale,
            tracks: self.tracks,
            film,
            ..TrackSettings::default()
        };
        Manifest {
            dataset,
            kind: self.kind,
            files,
            assume: self.cue_spin.assume.as_deref().and_then(StatedSpin::named).unwrap_or(unstated),
            tracks: (self.kind == Kind::Tracks).then(|| tracks.checked(source)),
        }
    }

    fn check_name(&self, source: &Source) {
        let name = self.name.as_str();
        let is_forbidden = |c: char| c == '/' || c == '\\' || c.is_control();
        let is_good = !["", ".", ".."].contains(&name) && name.trim() == name && !name.contains(is_forbidden);
        if !is_good || name.len() > MAX_NAME_BYTES {
            let limit = "without slashes, control characters and blanks around it";
            let expected = format!("one that can name a folder: at most {MAX_NAME_BYTES} bytes, {limit}");
            source.add(&[Fault::new("name", source.written("name"), expected)]);
        }
    }

    fn discs(&self) -> Discs {
        let (first, second) = (self.ball.own, self.object.unwrap_or_default());
        let pair = |first: Option<f64>, second: Option<f64>| first.map(|one| [one, second.unwrap_or(one)]);
        Discs {
            radii: pair(first.radius_m, second.radius_m),
            masses: pair(first.mass_kg, second.mass_kg),
            inertia: first.inertia.unwrap_or(UNIFORM_DISC),
            in_seconds: !self.video.has_unknown_rate(),
        }
    }

    /// Returns the files of the patterns, relative to the dataset.toml, each once.
    fn files(&self, source: &Source) -> Vec<PathBuf> {
        let folder = source.path.parent().unwrap_or(Path::new(""));
        let shown = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let escaped = PathBuf::from(glob::Pattern::escape(&folder.to_string_lossy()));
        let mut files = IndexSet::new();
        for (place, text) in self.files.iter().enumerate() {
            let wrong = |message: String| source.wrong(&format!("files.{place}"), message);
            // a name with brackets is itself, if there is such a file
            let is_name = folder.join(text).is_file();
            let pattern = if is_name { glob::Pattern::escape(text) } else { text.clone() };
            match glob::glob(&escaped.join(pattern).to_string_lossy()) {
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

/// Returns the lines of rules.jinja for what is stated.
fn rules(source: &Source) -> String {
    let stated = Values::from(Serde(source.stated()));
    let values = context! { unweighed => UNWEIGHED, radius => Ball::POOL.radius, ..stated };
    let rules = environment(UndefinedBehavior::Chainable)
        .and_then(|environment| environment.render_str(include_str!("rules.jinja"), values));
    // it is a part of the program, as its tests show
    rules.unwrap_or_else(|error| format!("name\t{error}"))
}

#[derive(Default, Deserialize, JsonSchema)]
#[serde(default)]
pub(crate) struct FitSection {
    mu: Option<SettingSection>,
    mu_s: Option<SettingSection>,
    e: Option<SettingSection>,
    mu_b: Option<SettingSection>,
    mu_c: Option<SettingSection>,
    kappa: Option<SettingSection>,
    e_slope: Option<SettingSection>,
    /// How the friction between the balls depends on their slip: exponential is μ + b exp(−c v).
    #[schemars(extend("enum" = ["constant", "exponential"]))]
    friction: Option<String>,
    pub(crate) by: Option<String>,
    pub(crate) loss: Loss,
}

#[derive(Default, Deserialize, JsonSchema)]
#[schemars(extend("dependentRequired" = { "prior_mean": ["prior_sd"], "prior_sd": ["prior_mean"] }))]
struct SettingSection {
    initial: Option<f64>,
    lower: Option<f64>,
    upper: Option<f64>,
    fixed: Option<f64>,
    prior_mean: Option<f64>,
    prior_sd: Option<f64>,
}

impl FitSection {
    /// Returns the setting of each parameter; `material_kappa` follows from Poisson's ratio.
    pub(crate) fn settings(&self, material_kappa: f64, source: &Source) -> Settings {
        let falls = self.friction.as_deref() == Some("exponential");
        let mut settings = Settings { falls, e_falls: self.e_slope.is_some(), ..Settings::default() };
        settings[Parameter::Kappa].initial = material_kappa;
        let Self { mu, mu_s, e, mu_b, mu_c, kappa, e_slope, .. } = self;
        // the ratios of masses and of radii follow from [ball] and [object]
        let given = [mu, mu_s, e, mu_b, mu_c, kappa, e_slope];
        for (parameter, given) in Parameter::ALL.into_iter().zip(given) {
            if let Some(given) = given {
                settings[parameter] = given.check(parameter, source);
            }
        }
        settings.compliance = match kappa {
            None => Compliance::Auto,
            Some(kappa) if kappa.fixed == Some(0.0) => Compliance::Rigid,
            Some(_) => Compliance::Stated,
        };
        settings
    }
}

impl SettingSection {
    fn check(&self, parameter: Parameter, source: &Source) -> Setting {
        let default = parameter.default_setting();
        let lower = self.lower.unwrap_or(default.lower);
        let upper = self.upper.unwrap_or(default.upper.max(lower));
        let prior = self.prior_mean.zip(self.prior_sd).map(|(mean, sd)| Prior { mean, sd });
        let setting = Setting {
            initial: self.fixed.or(self.initial).unwrap_or(default.initial.max(lower).min(upper)),
            lower,
            upper,
            fixed: self.fixed.is_some(),
            prior: prior.filter(|_| self.fixed.is_none()),
        };
        for fault in setting.faults(parameter) {
            let key = format!("fit.{}", fault.key);
            let written = Some(source.written(&key)).filter(|text| !text.is_empty());
            let value = written.unwrap_or(&fault.value).to_owned();
            // a default may contradict the stated value
            let upper = format!("fit.{}.upper", parameter.name());
            source.wrong(&format!("{key} {upper}"), Fault { value, ..fault }.to_string());
        }
        setting
    }
}
