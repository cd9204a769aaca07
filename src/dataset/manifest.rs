//! `dataset.toml`.

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::DeserializeOwned;
use toml::Spanned;

use super::error::{DatasetError, Problems, did_you_mean};
use super::extraction::{Extraction, RawImpacts};
use super::table::read_utf8;
use super::tracks::settings::{self, RawScale, RawTracks, RawVideo, TrackSettings};
use crate::ball::{Ball, UNIFORM_SPHERE};
use crate::disc::{Discs, UNIFORM_DISC};
use crate::loss::Loss;
use crate::parameters::{Parameter, Prior, Setting, Settings};
use crate::relation::Relation;

/// In bytes: a folder's name may be this long everywhere, and something still be added to it.
const LONGEST_NAME: usize = 200;

/// A checked dataset.toml.
pub(super) struct Manifest {
    pub name: String,
    pub kind: Kind,
    pub files: Vec<PathBuf>,
    pub cloth: Option<String>,
    pub source: Option<String>,
    pub ball: Ball,
    /// Where the data are of discs, for kind `tracks`.
    pub discs: Option<Discs>,
    pub assume: Option<Assume>,
    pub settings: Settings,
    pub relations: Vec<Relation>,
    pub loss: Loss,
    /// For kind `tracks`.
    pub tracks: Option<TrackSettings>,
    /// For kind `impacts`, where they were extracted from tracks.
    pub extraction: Extraction,
    /// `[fit] by`, with its line and the position in it.
    pub by: Option<(String, usize, String)>,
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

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Tracks => "tracks",
            Self::Impacts => "impacts",
            Self::Angles => "angles",
        }
    }
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
#[serde(deny_unknown_fields, expecting = "the keys of a data set")]
struct RawManifest {
    name: Spanned<String>,
    kind: Spanned<Kind>,
    files: Spanned<Vec<Spanned<String>>>,
    cloth: Option<String>,
    source: Option<String>,
    #[serde(default)]
    ball: RawBall,
    object: Option<Spanned<RawObject>>,
    cue_spin: Option<Spanned<RawSpin>>,
    video: Option<Spanned<RawVideo>>,
    scale: Option<Spanned<RawScale>>,
    tracks: Option<Spanned<RawTracks>>,
    impacts: Option<Spanned<RawImpacts>>,
    #[serde(default)]
    fit: RawFit,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [ball] radius_m = 0.028575")]
struct RawBall {
    shape: Option<Spanned<Shape>>,
    radius_m: Option<Spanned<f64>>,
    mass_kg: Option<Spanned<f64>>,
    inertia: Option<Spanned<f64>>,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
enum Shape {
    #[default]
    Sphere,
    /// Slides without rolling.
    Disc,
}

/// What of the second disc is not as of the first.
#[derive(Clone, Copy, Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [object] radius_m = 0.025")]
struct RawObject {
    radius_m: Option<f64>,
    mass_kg: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [cue_spin] assume = \"stun\"")]
struct RawSpin {
    assume: Assume,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [fit] mu_s = { fixed = 0.3 }")]
struct RawFit {
    mu: Option<RawSetting>,
    mu_s: Option<RawSetting>,
    e: Option<RawSetting>,
    mu_b: Option<Spanned<RawSetting>>,
    mu_c: Option<Spanned<RawSetting>>,
    friction: Option<Friction>,
    by: Option<Spanned<String>>,
    loss: Option<Spanned<String>>,
    #[serde(default)]
    constraints: Vec<Spanned<String>>,
}

/// How the friction between the balls depends on their slip.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
enum Friction {
    #[default]
    Constant,
    /// μ + b exp(−c v).
    Exponential,
}

#[derive(Default, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a table, as in { initial = 0.05, upper = 0.5 } or { fixed = 0.05 }"
)]
struct RawSetting {
    initial: Option<Spanned<f64>>,
    lower: Option<Spanned<f64>>,
    upper: Option<Spanned<f64>>,
    fixed: Option<Spanned<f64>>,
    prior_mean: Option<Spanned<f64>>,
    prior_sd: Option<Spanned<f64>>,
}

/// Places in the text of a TOML file.
pub(crate) struct Source<'a> {
    pub path: &'a Path,
    pub text: &'a str,
}

impl Source<'_> {
    /// Line and position in it, from 1.
    fn place(&self, span: &Range<usize>) -> (usize, String) {
        let before = &self.text.as_bytes()[..span.start.min(self.text.len())];
        let line = before.split(|byte| *byte == b'\n').count();
        let rest = before.rsplit(|byte| *byte == b'\n').next().unwrap_or_default();
        let position = String::from_utf8_lossy(rest).chars().count() + 1;
        (line, position.to_string())
    }

    /// What is written there.
    pub(super) fn written(&self, span: &Range<usize>) -> &str {
        self.text.get(span.clone()).unwrap_or_default()
    }

    pub(crate) fn add(&self, problems: &mut Problems, span: &Range<usize>, message: String) {
        let (line, position) = self.place(span);
        problems.add(self.path, Some(line), Some(&position), message);
    }
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
    pub(super) fn read(path: &Path) -> Result<Self, DatasetError> {
        let mut problems = Problems::of_dataset(path);
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
        let Some(text) = read_utf8(path, &mut problems) else { return Err(problems.into_error()) };
        // a byte order mark is no part of the first line
        let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
        let source = Source { path, text };
        let Some(raw) = parse::<RawManifest>(&source, &mut problems) else {
            return Err(problems.into_error());
        };
        let manifest = raw.check(&source, &mut problems);
        problems.into_result(manifest)
    }
}

/// Reads a TOML file of another shape, with the same care for what is wrong with it.
pub(crate) fn read_toml<T: DeserializeOwned>(path: &Path) -> Result<T, DatasetError> {
    read_checked(path, |parsed, _, _| parsed)
}

/// Reads a TOML file of another shape; `check` says where what was parsed makes no sense.
pub(crate) fn read_checked<T: DeserializeOwned, U>(
    path: &Path,
    check: impl FnOnce(T, &Source, &mut Problems) -> U,
) -> Result<U, DatasetError> {
    let mut problems = Problems::new(format!("{} cannot be used:", path.display()));
    let Some(text) = read_utf8(path, &mut problems) else { return Err(problems.into_error()) };
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let source = Source { path, text };
    let Some(parsed) = parse(&source, &mut problems) else { return Err(problems.into_error()) };
    let checked = check(parsed, &source, &mut problems);
    problems.into_result(checked)
}

/// So many unknown keys are looked for.
const UNKNOWN_KEYS: usize = 20;

/// Says all that is unknown, where each is a line of its own: with that line made a comment, the next one is
/// found. Of any other errors the first.
fn parse<T: DeserializeOwned>(source: &Source, problems: &mut Problems) -> Option<T> {
    let mut text = source.text.to_string();
    for found in 0..UNKNOWN_KEYS {
        let error = match toml::from_str(&text) {
            Ok(parsed) => return (found == 0).then_some(parsed),
            Err(error) => error,
        };
        let unknown = error.message().starts_with("unknown field");
        // what follows from a value of several lines is none of its own
        if found > 0 && !unknown {
            return None;
        }
        complain(&error, source, problems);
        let own_line = error.span().filter(|span| {
            let before = text[..span.start].rsplit('\n').next().unwrap_or_default();
            unknown && before.trim().is_empty() && text.is_char_boundary(span.start + 1)
        });
        text.replace_range(own_line.map(|span| span.start..span.start + 1)?, "#");
    }
    None
}

/// What toml or serde found, for people who write neither.
fn complain(error: &toml::de::Error, source: &Source, problems: &mut Problems) {
    let text = source.text;
    // that of a key missing at the top says nothing
    let whole = |span: &Range<usize>| {
        error.message().starts_with("missing") && !source.written(span).starts_with('[')
    };
    let span = error.span().filter(|span| !whole(span));
    let written = span.as_ref().map_or("", |span| source.written(span));
    let message = in_plain_words(error.message(), written);
    match span {
        Some(span) if is_decimal_comma(text, span.start) => {
            let message = format!("{message}; write decimals with a point, not a comma");
            source.add(problems, &span, message);
        }
        Some(span) => source.add(problems, &span, message),
        None => problems.add(source.path, None, None, message),
    }
}

/// The message of toml or serde about what is `written`, for people who write neither.
fn in_plain_words(message: &str, written: &str) -> String {
    let message = message.trim().replace('\n', " ");
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let names = |names: &[&str]| names.join(", ");
    match (message.split(' ').take(2).collect::<Vec<_>>().as_slice(), quoted.as_slice()) {
        (["unknown", what], [word, known @ ..]) if !known.is_empty() => {
            let what = if *what == "field" { "unknown key" } else { "unknown word" };
            let near = did_you_mean(word, known.iter().copied());
            format!(
                "{what} \"{word}\"{near}; expected {}{}",
                if known.len() > 1 { "one of " } else { "" },
                names(known)
            )
        }
        (["missing", "field"], [key]) => {
            let place = if written.is_empty() { String::new() } else { format!(" in {written}") };
            let expected = match *key {
                "assume" => "; expected assume = \"stun\", \"natural-roll\", \"measured\" or \"unknown\"",
                "radius_m" => "; expected radius_m = …, the ball's radius in metres (pool 0.028575)",
                "kind" => "; expected kind = \"tracks\", \"impacts\" or \"angles\"",
                "files" => "; expected files = [\"…\"], the tables, relative to this file",
                _ => "",
            };
            format!("the key {key} is missing{place}{expected}")
        }
        (["duplicate", "key"], _) => format!("the key {written} stands twice"),
        (["invalid", "type:"], _) => match message.split_once(", expected ") {
            Some((_, expected)) if !written.contains('\n') => {
                let expected = match expected {
                    "f64" => "a number, without quotation marks",
                    "a string" => "text in quotation marks",
                    "a sequence" => "a list, as in [\"shots.csv\"]",
                    other => other,
                };
                format!("{written} is of the wrong type; expected {expected}")
            }
            _ => message,
        },
        _ => message,
    }
}

/// Whether the comma between two digits stands just before or at a place.
fn is_decimal_comma(text: &str, place: usize) -> bool {
    let text = text.as_bytes();
    let digit = |i: usize| text.get(i).is_some_and(u8::is_ascii_digit);
    (place.saturating_sub(1)..=place)
        .any(|i| text.get(i) == Some(&b',') && i > 0 && digit(i - 1) && digit(i + 1))
}

impl RawManifest {
    fn check(self, source: &Source, problems: &mut Problems) -> Manifest {
        let name = self.name.as_ref();
        let odd = |c: char| c == '/' || c == '\\' || c.is_control();
        if name.trim() != name || name.is_empty() || name == "." || name == ".." || name.contains(odd) {
            let message = format!(
                "name is {}; expected one that can name a folder, without slashes, control characters and \
                 blanks around it",
                source.written(&self.name.span())
            );
            source.add(problems, &self.name.span(), message);
        } else if name.len() > LONGEST_NAME {
            let message = format!("name has {} bytes; expected at most {LONGEST_NAME}", name.len());
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
                    let message = format!(
                        "[{key}] stands in a data set of kind \"{}\"; it goes with \"tracks\" only",
                        kind.name()
                    );
                    source.add(problems, &span, message);
                }
            }
        }
        if let Some(span) = self.impacts.as_ref().map(Spanned::span).filter(|_| kind != Kind::Impacts) {
            let message = format!(
                "[impacts] stands in a data set of kind \"{}\"; it goes with \"impacts\" only",
                kind.name()
            );
            source.add(problems, &span, message);
        }
        let extraction =
            self.impacts.as_ref().map(|impacts| impacts.as_ref().check(source, problems)).unwrap_or_default();
        let files = self.files(source, problems);
        let ball = self.ball.check(source, problems);
        let discs = self.discs(source, problems);
        let tracks = (kind == Kind::Tracks).then(|| {
            let video = self.video.as_ref().map(Spanned::as_ref);
            let (scale, tracks) =
                (self.scale.as_ref().map(Spanned::as_ref), self.tracks.as_ref().map(Spanned::as_ref));
            settings::check(video, scale, tracks, discs.is_some(), source, problems)
        });
        let discs = discs
            .zip(tracks.as_ref())
            .map(|(discs, tracks)| Discs { in_seconds: !tracks.unknown_rate, ..discs });
        let falls = self.fit.friction == Some(Friction::Exponential);
        let mut settings = Settings { falls, ..Settings::default() };
        let fit = &self.fit;
        for (parameter, raw) in Parameter::COEFFICIENTS.into_iter().zip([&fit.mu, &fit.mu_s, &fit.e]) {
            if let Some(raw) = raw {
                settings[parameter] = raw.check(parameter, source, problems);
            }
        }
        for (parameter, raw) in [(Parameter::B, &fit.mu_b), (Parameter::C, &fit.mu_c)] {
            let Some(raw) = raw else { continue };
            settings[parameter] = raw.as_ref().check(parameter, source, problems);
            if !settings.falls {
                let message = format!(
                    "{} stands in [fit], but friction is constant; expected friction = \"exponential\" with it",
                    parameter.name()
                );
                source.add(problems, &raw.span(), message);
            }
        }
        let relations = self.fit.relations(settings.falls, source, problems);
        let loss = self.fit.loss(source, problems);
        Manifest {
            name: name.clone(),
            kind,
            files,
            cloth: self.cloth,
            source: self.source,
            ball,
            // a disc does not roll
            assume: discs.map(|_| Assume::Unknown).or(self.cue_spin.map(|spin| spin.as_ref().assume)),
            discs,
            settings,
            relations,
            loss,
            tracks,
            extraction,
            by: self.fit.by.map(|by| {
                let (line, position) = source.place(&by.span());
                (by.into_inner(), line, position)
            }),
        }
    }

    /// The discs, where [ball] says that they are.
    fn discs(&self, source: &Source, problems: &mut Problems) -> Option<Discs> {
        let disc = self.ball.shape.as_ref().filter(|shape| *shape.as_ref() == Shape::Disc);
        let Some(disc) = disc else {
            if let Some(object) = &self.object {
                let message =
                    "[object] goes with [ball] shape = \"disc\" only: two balls are taken to be equal";
                source.add(problems, &object.span(), message.to_string());
            }
            return None;
        };
        if *self.kind.as_ref() != Kind::Tracks {
            let message = format!(
                "shape is \"disc\" in a data set of kind \"{}\"; expected it with kind \"tracks\" only",
                self.kind.as_ref().name()
            );
            source.add(problems, &disc.span(), message);
        }
        if let Some(spin) = &self.cue_spin {
            let message = "[cue_spin] goes with balls: how a disc turns is seen from points on it";
            source.add(problems, &spin.span(), message.to_string());
        }
        let number = |value: &Option<Spanned<f64>>| value.as_ref().map(|value| *value.as_ref());
        let other = self.object.as_ref().map(|object| *object.as_ref()).unwrap_or_default();
        let mut pair = |key: &str, first: Option<f64>, second: Option<f64>| {
            let span = self.object.as_ref().map_or_else(|| disc.span(), Spanned::span);
            if second.is_some_and(|second| !(second > 0.0 && second.is_finite())) {
                source.add(
                    problems,
                    &span,
                    format!("object.{key} is {}; expected more than 0", second.unwrap_or(f64::NAN)),
                );
            } else if first.is_none() && second.is_some() {
                source.add(
                    problems,
                    &span,
                    format!("{key} stands in [object], but not in [ball]; expected it in both"),
                );
            }
            first.map(|first| [first, second.unwrap_or(first)])
        };
        Some(Discs {
            radii: pair("radius_m", number(&self.ball.radius_m), other.radius_m),
            masses: pair("mass_kg", number(&self.ball.mass_kg), other.mass_kg),
            inertia: number(&self.ball.inertia).unwrap_or(UNIFORM_DISC),
            in_seconds: true,
        })
    }

    /// The globs, relative to the file's own folder.
    fn files(&self, source: &Source, problems: &mut Problems) -> Vec<PathBuf> {
        let folder = source.path.parent().unwrap_or(Path::new(""));
        let shown = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let folder = glob::Pattern::escape(&folder.to_string_lossy());
        let mut files = Vec::new();
        if self.files.as_ref().is_empty() {
            let message = "files is empty; expected at least one, as in [\"shots.csv\"]";
            source.add(problems, &self.files.span(), message.to_string());
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
                    let mut seen = 0;
                    for path in paths.filter_map(Result::ok).filter(|path| path.is_file()) {
                        seen += 1;
                        // two patterns may name the same file
                        if !files.contains(&path) {
                            files.push(path);
                        }
                    }
                    if seen == 0 {
                        source.add(
                            problems,
                            &span,
                            format!("\"{text}\" names no file in {}; expected at least one", shown.display()),
                        );
                    }
                }
                Err(error) => source.add(problems, &span, format!("\"{text}\" is no pattern: {}", error.msg)),
            }
        }
        files
    }
}

impl RawFit {
    fn relations(&self, falls: bool, source: &Source, problems: &mut Problems) -> Vec<Relation> {
        let mut relations = Vec::new();
        for text in &self.constraints {
            match Relation::parse(text.as_ref()) {
                Ok(relation) => {
                    let of_law = [Parameter::B, Parameter::C];
                    let involved = of_law.into_iter().find(|p| relation.coefficients[*p as usize] != 0.0);
                    if let Some(parameter) = involved.filter(|_| !falls) {
                        let message = format!(
                            "the constraint \"{}\" has {}, but friction is constant; expected friction = \
                             \"exponential\" with it",
                            text.as_ref(),
                            parameter.name()
                        );
                        source.add(problems, &text.span(), message);
                    }
                    relations.push(relation);
                }
                Err(error) => {
                    let message = format!("the constraint \"{}\": {error}", text.as_ref());
                    source.add(problems, &text.span(), message);
                }
            }
        }
        relations
    }

    fn loss(&self, source: &Source, problems: &mut Problems) -> Loss {
        let Some(word) = &self.loss else { return Loss::default() };
        let found = Loss::ALL.into_iter().find(|loss| loss.name() == word.as_ref());
        found.unwrap_or_else(|| {
            let near = did_you_mean(word.as_ref(), Loss::ALL.map(Loss::name));
            let names = Loss::ALL.map(Loss::name).join(", ");
            let message = format!("loss is \"{}\"{near}; expected one of {names}", word.as_ref());
            source.add(problems, &word.span(), message);
            Loss::default()
        })
    }
}

impl RawBall {
    fn check(&self, source: &Source, problems: &mut Problems) -> Ball {
        let mut positive = |key: &str, value: &Option<Spanned<f64>>, default: f64| {
            let Some(value) = value else { return default };
            let number = *value.as_ref();
            if !(number > 0.0 && number.is_finite()) {
                let text = source.written(&value.span());
                source.add(problems, &value.span(), format!("{key} is {text}; expected more than 0"));
            }
            number
        };
        let radius = positive("radius_m", &self.radius_m, Ball::POOL.radius);
        let mass = positive("mass_kg", &self.mass_kg, Ball::POOL.mass);
        let inertia = positive("inertia", &self.inertia, UNIFORM_SPHERE);
        let disc = self.shape.as_ref().is_some_and(|shape| *shape.as_ref() == Shape::Disc);
        let (most, said) =
            if disc { (1.0, "1, that of a ring") } else { (2.0 / 3.0, "2/3, that of a hollow sphere") };
        let hollow = |value: &&Spanned<f64>| value.as_ref().is_finite() && *value.as_ref() > most;
        if let Some(value) = self.inertia.as_ref().filter(hollow) {
            let text = source.written(&value.span());
            let message = format!("inertia is {text}; expected at most {said}");
            source.add(problems, &value.span(), message);
        }
        Ball { radius, mass, inertia }
    }
}

impl RawSetting {
    fn check(&self, parameter: Parameter, source: &Source, problems: &mut Problems) -> Setting {
        let name = parameter.name();
        // c is held only where nothing is said of it
        let mut setting = Setting { fixed: false, ..parameter.default_setting() };
        let widest = match parameter {
            Parameter::E => 1.0,
            _ => f64::INFINITY,
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
                    format!("{name}.{key} is {}; expected {expected}", source.written(&spanned.span())),
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
                format!("{name}.lower is {lower:?}, above {name}.upper, {upper:?}; expected lower ≤ upper"),
            );
            return setting;
        }
        let bounds = format!(
            "{lower:?} to {upper:?}, its bounds{}",
            if self.upper.is_none() && widest > upper {
                format!(" (give {name}.upper to move the upper one)")
            } else {
                String::new()
            }
        );
        setting.initial = setting.initial.clamp(lower, upper);
        if let Some(initial) = initial {
            setting.initial = initial;
            if !(lower..=upper).contains(&initial) {
                let message = format!("{name}.initial is {initial:?}; expected {bounds}");
                wrong(span(&self.initial), message);
            }
        }
        if let Some(fixed) = fixed {
            setting.initial = fixed;
            setting.fixed = true;
            if !(lower..=upper).contains(&fixed) {
                let message = format!("{name}.fixed is {fixed:?}; expected {bounds}");
                wrong(span(&self.fixed), message);
            }
        }
        if let (Some(_), Some(prior)) = (&self.fixed, self.prior_mean.as_ref().or(self.prior_sd.as_ref())) {
            let message =
                format!("{name} is fixed, so that its prior says nothing; expected only one of them");
            wrong(Some(prior.span()), message);
        }
        match (&self.prior_mean, &self.prior_sd) {
            (Some(given), None) | (None, Some(given)) => {
                wrong(
                    Some(given.span()),
                    format!("{name}: only one of prior_mean and prior_sd; expected both or none"),
                );
            }
            (Some(_), Some(spanned)) => {
                if sd.is_some_and(|sd| sd <= 0.0) {
                    let text = source.written(&spanned.span());
                    let message = format!("{name}.prior_sd is {text}; expected more than 0");
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
