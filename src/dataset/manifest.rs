//! `dataset.toml`.

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::DeserializeOwned;
use toml::Spanned;

use super::error::{DatasetError, Problems, did_you_mean};
use super::tracks::settings::{self, RawScale, RawTracks, RawVideo, TrackSettings};
use crate::ball::{Ball, UNIFORM_SPHERE};
use crate::parameters::{Parameter, Prior, Setting, Settings};

/// A checked dataset.toml.
pub(super) struct Manifest {
    pub name: String,
    pub kind: Kind,
    pub files: Vec<PathBuf>,
    pub cloth: Option<String>,
    pub source: Option<String>,
    pub ball: Ball,
    pub assume: Option<Assume>,
    pub settings: Settings,
    /// For kind `tracks`.
    pub tracks: Option<TrackSettings>,
    /// `[fit] by`, with its line.
    pub by: Option<(String, usize)>,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(super) enum Kind {
    Tracks,
    Impacts,
    Angles,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Assume {
    Stun,
    NaturalRoll,
    Measured,
    Unknown,
}

impl Assume {
    pub(super) const WORDS: [(&'static str, Self); 4] = [
        ("stun", Self::Stun),
        ("natural-roll", Self::NaturalRoll),
        ("measured", Self::Measured),
        ("unknown", Self::Unknown),
    ];
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawManifest {
    name: Spanned<String>,
    kind: Spanned<Kind>,
    files: Spanned<Vec<Spanned<String>>>,
    cloth: Option<String>,
    source: Option<String>,
    #[serde(default)]
    ball: RawBall,
    cue_spin: Option<RawSpin>,
    video: Option<Spanned<RawVideo>>,
    scale: Option<Spanned<RawScale>>,
    tracks: Option<Spanned<RawTracks>>,
    #[serde(default)]
    fit: RawFit,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBall {
    radius_m: Option<Spanned<f64>>,
    mass_kg: Option<Spanned<f64>>,
    inertia: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSpin {
    assume: Assume,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawFit {
    mu: Option<RawSetting>,
    mu_s: Option<RawSetting>,
    e: Option<RawSetting>,
    by: Option<Spanned<String>>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSetting {
    initial: Option<Spanned<f64>>,
    lower: Option<Spanned<f64>>,
    upper: Option<Spanned<f64>>,
    fixed: Option<Spanned<f64>>,
    prior_mean: Option<Spanned<f64>>,
    prior_sd: Option<Spanned<f64>>,
}

/// Places in the text of a dataset.toml.
pub(super) struct Source<'a> {
    pub path: &'a Path,
    pub text: &'a str,
}

impl Source<'_> {
    /// Line and position in it, from 1.
    fn place(&self, span: &Range<usize>) -> (usize, String) {
        let before = &self.text[..span.start.min(self.text.len())];
        let line = before.matches('\n').count() + 1;
        let position = before.rsplit('\n').next().map_or(0, |rest| rest.chars().count()) + 1;
        (line, position.to_string())
    }

    pub(super) fn add(&self, problems: &mut Problems, span: &Range<usize>, message: String) {
        let (line, position) = self.place(span);
        problems.add(self.path, Some(line), Some(&position), message);
    }
}

impl Manifest {
    /// Reads and checks it, all but the tables.
    pub(super) fn read(path: &Path) -> Result<Self, DatasetError> {
        let mut problems = Problems::of_dataset(path);
        let Some(text) = read_text(path, &mut problems) else { return Err(problems.into_error()) };
        let source = Source { path, text: &text };
        let Some(raw) = parse::<RawManifest>(&source, &mut problems) else {
            return Err(problems.into_error());
        };
        let manifest = raw.check(&source, &mut problems);
        problems.into_result(manifest)
    }
}

/// Reads a TOML file of another shape, with the same care for what is wrong with it.
pub(crate) fn read_toml<T: DeserializeOwned>(path: &Path) -> Result<T, DatasetError> {
    let mut problems = Problems::new(format!("{} cannot be used:", path.display()));
    let Some(text) = read_text(path, &mut problems) else { return Err(problems.into_error()) };
    parse(&Source { path, text: &text }, &mut problems).ok_or_else(|| problems.into_error())
}

fn read_text(path: &Path, problems: &mut Problems) -> Option<String> {
    match std::fs::read(path).map(String::from_utf8) {
        Ok(Ok(text)) => return Some(text),
        Ok(Err(_)) => problems.add(path, None, None, "is not UTF-8 text"),
        Err(error) => problems.add(path, None, None, format!("cannot be read: {error}")),
    }
    None
}

fn parse<T: DeserializeOwned>(source: &Source, problems: &mut Problems) -> Option<T> {
    let error = match toml::from_str(source.text) {
        Ok(parsed) => return Some(parsed),
        Err(error) => error,
    };
    let message = with_suggestion(error.message());
    match error.span() {
        Some(span) => {
            let shown = source.text.get(span.clone()).filter(|s| !s.contains('\n') && !s.is_empty());
            let shown = shown.map_or(String::new(), |s| format!("{s}: "));
            source.add(problems, &span, format!("{shown}{message}"));
        }
        None => problems.add(source.path, None, None, message),
    }
    None
}

/// serde's message, with the nearest of the names that it lists.
fn with_suggestion(message: &str) -> String {
    let message = message.trim().replace('\n', " ");
    let mut quoted = message.split('`').skip(1).step_by(2);
    match quoted.next() {
        Some(word) if message.starts_with("unknown") => {
            let near = did_you_mean(word, quoted);
            format!("{message}{near}")
        }
        _ => message,
    }
}

impl RawManifest {
    fn check(self, source: &Source, problems: &mut Problems) -> Manifest {
        let name = self.name.as_ref();
        if name.is_empty() || name == "." || name == ".." || name.contains(['/', '\\', '\0']) {
            let message = format!("name is \"{name}\"; expected one that can name a folder, without slashes");
            source.add(problems, &self.name.span(), message);
        }
        let kind = *self.kind.as_ref();
        if kind != Kind::Tracks {
            let sections = [
                ("video", self.video.as_ref().map(Spanned::span)),
                ("scale", self.scale.as_ref().map(Spanned::span)),
                ("tracks", self.tracks.as_ref().map(Spanned::span)),
            ];
            for (key, span) in sections {
                if let Some(span) = span {
                    let message = format!("[{key}] goes with kind = \"tracks\" only");
                    source.add(problems, &span, message);
                }
            }
        }
        let files = self.files(source, problems);
        let ball = self.ball.check(source, problems);
        let tracks = (kind == Kind::Tracks).then(|| {
            let video = self.video.as_ref().map(Spanned::as_ref);
            let (scale, tracks) =
                (self.scale.as_ref().map(Spanned::as_ref), self.tracks.as_ref().map(Spanned::as_ref));
            settings::check(video, scale, tracks, source, problems)
        });
        let mut settings = Settings::default();
        for (parameter, raw) in Parameter::ALL.into_iter().zip([&self.fit.mu, &self.fit.mu_s, &self.fit.e]) {
            if let Some(raw) = raw {
                settings[parameter] = raw.check(parameter, source, problems);
            }
        }
        Manifest {
            name: name.clone(),
            kind,
            files,
            cloth: self.cloth,
            source: self.source,
            ball,
            assume: self.cue_spin.map(|spin| spin.assume),
            settings,
            tracks,
            by: self.fit.by.map(|by| (by.as_ref().clone(), source.place(&by.span()).0)),
        }
    }

    /// The globs, relative to the file's own folder.
    fn files(&self, source: &Source, problems: &mut Problems) -> Vec<PathBuf> {
        let folder = source.path.parent().unwrap_or(Path::new(""));
        let folder = glob::Pattern::escape(&folder.to_string_lossy());
        let mut files = Vec::new();
        if self.files.as_ref().is_empty() {
            source.add(problems, &self.files.span(), "files names no file".to_string());
        }
        for pattern in self.files.as_ref() {
            let (span, text) = (pattern.span(), pattern.as_ref());
            let whole = if Path::new(text).is_absolute() || folder.is_empty() {
                text.clone()
            } else {
                format!("{folder}/{text}")
            };
            match glob::glob(&whole) {
                Ok(paths) => {
                    let before = files.len();
                    files.extend(paths.filter_map(Result::ok).filter(|path| path.is_file()));
                    if files.len() == before {
                        source.add(
                            problems,
                            &span,
                            format!("\"{text}\": no such file; expected at least one"),
                        );
                    }
                }
                Err(error) => source.add(problems, &span, format!("\"{text}\" is no pattern: {error}")),
            }
        }
        files
    }
}

impl RawBall {
    fn check(&self, source: &Source, problems: &mut Problems) -> Ball {
        let mut positive = |key: &str, value: &Option<Spanned<f64>>, default: f64| {
            let Some(value) = value else { return default };
            let number = *value.as_ref();
            if !(number > 0.0 && number.is_finite()) {
                source.add(problems, &value.span(), format!("{key} is {number}; expected more than 0"));
            }
            number
        };
        let radius = positive("radius_m", &self.radius_m, Ball::POOL.radius);
        let mass = positive("mass_kg", &self.mass_kg, Ball::POOL.mass);
        let inertia = positive("inertia", &self.inertia, UNIFORM_SPHERE);
        if let Some(value) = self.inertia.as_ref().filter(|value| *value.as_ref() > 2.0 / 3.0) {
            let message = format!("inertia is {inertia}; expected at most 2/3, that of a hollow sphere");
            source.add(problems, &value.span(), message);
        }
        Ball { radius, mass, inertia }
    }
}

impl RawSetting {
    fn check(&self, parameter: Parameter, source: &Source, problems: &mut Problems) -> Setting {
        let name = parameter.name();
        let mut setting = parameter.default_setting();
        let widest = match parameter {
            Parameter::E => 1.0,
            Parameter::Mu | Parameter::MuS => f64::INFINITY,
        };
        let allowed = if widest == 1.0 { "0 to 1" } else { "0 or more" };
        let mut value = |key: &str, value: &Option<Spanned<f64>>, range: bool| -> Option<f64> {
            let spanned = value.as_ref()?;
            let number = *spanned.as_ref();
            let good = number.is_finite() && (!range || (0.0..=widest).contains(&number));
            if !good {
                let expected = if range { allowed } else { "a finite number" };
                source.add(
                    problems,
                    &spanned.span(),
                    format!("{name}.{key} is {number}; expected {expected}"),
                );
            }
            good.then_some(number)
        };
        let (lower, upper) = (value("lower", &self.lower, true), value("upper", &self.upper, true));
        let (initial, fixed) = (value("initial", &self.initial, true), value("fixed", &self.fixed, true));
        let (mean, sd) =
            (value("prior_mean", &self.prior_mean, false), value("prior_sd", &self.prior_sd, false));
        setting.lower = lower.unwrap_or(setting.lower);
        setting.upper = upper.unwrap_or(setting.upper.max(setting.lower));
        let span = |value: &Option<Spanned<f64>>| value.as_ref().map(Spanned::span);
        let mut wrong = |at: Option<Range<usize>>, message: String| {
            source.add(problems, &at.unwrap_or(0..0), message);
        };
        let Setting { lower, upper, .. } = setting;
        if lower > upper {
            let at = span(&self.lower).or(span(&self.upper));
            wrong(
                at,
                format!("{name}.lower is {lower}, above {name}.upper, {upper}; expected lower ≤ upper"),
            );
            return setting;
        }
        setting.initial = setting.initial.clamp(lower, upper);
        if let Some(initial) = initial {
            setting.initial = initial;
            if !(lower..=upper).contains(&initial) {
                let message = format!("{name}.initial is {initial}; expected {lower} to {upper}, its bounds");
                wrong(span(&self.initial), message);
            }
        }
        if let Some(fixed) = fixed {
            setting.initial = fixed;
            setting.fixed = true;
            if !(lower..=upper).contains(&fixed) {
                let message = format!("{name}.fixed is {fixed}; expected {lower} to {upper}, its bounds");
                wrong(span(&self.fixed), message);
            }
        }
        match (&self.prior_mean, &self.prior_sd) {
            (Some(given), None) | (None, Some(given)) => {
                wrong(Some(given.span()), format!("{name}: a prior needs both prior_mean and prior_sd"));
            }
            (Some(_), Some(spanned)) => {
                if sd.is_some_and(|sd| sd <= 0.0) {
                    let message = format!("{name}.prior_sd is {}; expected more than 0", spanned.as_ref());
                    wrong(Some(spanned.span()), message);
                } else if let (Some(mean), Some(sd)) = (mean, sd) {
                    setting.prior = Some(Prior { mean, sd });
                }
            }
            (None, None) => {}
        }
        setting
    }
}
