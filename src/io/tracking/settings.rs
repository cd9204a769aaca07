//! The sections of dataset.toml that go with kind = "tracks".

use std::fmt;
use std::path::PathBuf;

use serde::de::{SeqAccess, Unexpected, Visitor};
use serde::{Deserialize, Deserializer};
use toml::Spanned;

use super::calibration::{Calibration, ReadOut};
use super::camera::{RawCamera, WantedCamera};
use super::column_names::ColumnNames;
pub(super) use super::units::{TimeUnit, Unit};
use crate::io::toml_file::{Source, bare};

/// `[video]`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawVideo {
    capture_fps: Option<Spanned<Rate>>,
    playback_fps: Option<Spanned<f64>>,
    row_readout_s: Option<Spanned<f64>>,
    rows: Option<Spanned<f64>>,
}

/// A frame rate, or `"unknown"`.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Rate {
    Fps(f64),
    Unknown,
}

impl<'de> Deserialize<'de> for Rate {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl Visitor<'_> for Either {
            type Value = Rate;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number, without quotation marks, or for discs \"unknown\"")
            }

            fn visit_f64<E>(self, fps: f64) -> Result<Rate, E> {
                Ok(Rate::Fps(fps))
            }

            fn visit_i64<E>(self, fps: i64) -> Result<Rate, E> {
                Ok(Rate::Fps(fps as f64))
            }

            fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Rate, E> {
                if word == "unknown" {
                    Ok(Rate::Unknown)
                } else {
                    Err(E::invalid_type(Unexpected::Str(word), &self))
                }
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// `[scale]`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawScale {
    length_unit: Option<Spanned<Unit>>,
    m_per_px: Option<Spanned<f64>>,
    from: Option<Spanned<Ruler>>,
    sd: Option<Spanned<f64>>,
    y_axis: Option<Spanned<YAxis>>,
    #[serde(default)]
    point: Vec<Spanned<RawPoint>>,
}

/// What tells the scale where no number does.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
enum Ruler {
    Balls,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPoint {
    px: [f64; 2],
    m: [f64; 2],
}

/// `[tracks]`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawTracks {
    #[serde(default)]
    format: Format,
    cue: Option<Spanned<Names>>,
    object: Option<Spanned<Names>>,
    cue_markers: Option<Spanned<Names>>,
    object_markers: Option<Spanned<Names>>,
    shots: Option<Spanned<String>>,
    position_sd_m: Option<Spanned<f64>>,
    time_unit: Option<TimeUnit>,
    columns: Option<Spanned<ColumnNames>>,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(super) enum YAxis {
    Up,
    Down,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(super) enum Format {
    #[default]
    Auto,
    Long,
    Tracker,
    Kinovea,
    Qualisys,
    Json,
    Columns,
}

/// The tracks of one ball: its centre, or several markers on it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Names(pub Vec<String>);

/// Keys of `[tracks]`, and columns of the table of shots, that name tracks.
pub(super) const NAMED: [&str; 4] = ["cue", "object", "cue_markers", "object_markers"];

impl Names {
    /// These, without the blanks around them.
    pub(super) fn of<'a>(names: impl Iterator<Item = &'a str>) -> Self {
        Self(names.map(|name| name.trim().to_string()).collect())
    }

    /// Whether there is one or more, each but once and none without letters.
    pub(super) fn are_good(&self) -> bool {
        let Self(names) = self;
        let twice = |(i, name): (usize, &String)| names[..i].contains(name);
        !names.is_empty() && !names.iter().any(String::is_empty) && !names.iter().enumerate().any(twice)
    }

    /// `"A"`, or `["a1", "a2"]`, as it stands in dataset.toml.
    pub(super) fn shown(&self) -> String {
        match self.0.as_slice() {
            [one] => format!("{one:?}"),
            many => format!("{many:?}"),
        }
    }
}

impl<'de> Deserialize<'de> for Names {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Names;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("the name of a track, or a list of the names of markers on one ball")
            }

            fn visit_str<E>(self, name: &str) -> Result<Names, E> {
                Ok(Names(vec![name.to_string()]))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Names, A::Error> {
                std::iter::from_fn(|| list.next_element().transpose()).collect::<Result<_, _>>().map(Names)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// Whether `cue` or `object` is stated, or the usual names are taken for them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Balls {
    Stated,
    Usual,
}

/// All of it, checked.
#[derive(Clone, Debug)]
pub(crate) struct TrackSettings {
    pub(super) capture_fps: Option<f64>,
    /// `capture_fps` is said to be unknown and stands for one frame a second (discs).
    pub(crate) unknown_rate: bool,
    /// The tracks are of discs, whose centre may have to be found from points on them.
    pub(super) discs: bool,
    /// The rate that the file's times follow, where it is not the camera's.
    pub(super) playback_fps: Option<f64>,
    pub(super) calibration: Calibration,
    /// `None`: not stated.
    pub(super) unit: Option<Unit>,
    /// Relative standard deviation of the scale, where it is stated.
    pub(super) scale_sd: Option<f64>,
    pub(super) format: Format,
    pub(super) cue: Names,
    pub(super) object: Names,
    pub(super) balls: Balls,
    /// Tracks of points on the balls, beside those that are their centres.
    pub(super) cue_markers: Names,
    pub(super) object_markers: Names,
    pub(super) shots: Option<PathBuf>,
    pub(super) position_sd: Option<f64>,
    pub(super) time_unit: Option<TimeUnit>,
    pub(super) columns: Option<ColumnNames>,
    /// What is wanted of the corrections for the camera.
    pub(super) camera: WantedCamera,
    /// Nothing but the size of the balls tells the scale.
    pub(super) from_balls: bool,
    /// What was assumed, for the reader.
    pub(crate) notes: Vec<String>,
}

/// The sections of dataset.toml, as they stand there.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(crate) struct Sections {
    pub video: RawVideo,
    pub camera: RawCamera,
    pub scale: RawScale,
    pub tracks: RawTracks,
}

impl Sections {
    /// Checks them; what is wrong is added to the problems of the source.
    pub(crate) fn check(self, discs: bool, source: &Source) -> TrackSettings {
        let Self { video, camera, scale, tracks } = self;
        let positive = |key: &str, given: &Option<Spanned<f64>>| {
            let given = given.as_ref()?;
            let number = *given.as_ref();
            let good = number > 0.0 && number.is_finite();
            if !good {
                source.wrong(given, format!("{key} is {number}; expected more than 0"));
            }
            good.then_some(number)
        };
        let capture_fps = video.capture_fps.as_ref().and_then(|given| match *given.as_ref() {
            Rate::Fps(fps) => positive("capture_fps", &Some(Spanned::new(given.span(), fps))),
            Rate::Unknown => Some(1.0),
        });
        let unknown_rate = video.capture_fps.as_ref().filter(|given| *given.as_ref() == Rate::Unknown);
        let playback_fps = positive("playback_fps", &video.playback_fps);
        let readout = positive("row_readout_s", &video.row_readout_s);
        let rows = positive("rows", &video.rows);
        let m_per_px = positive("m_per_px", &scale.m_per_px);
        let scale_sd = positive("sd", &scale.sd);
        let position_sd = positive("position_sd_m", &tracks.position_sd_m);

        if let Some(given) = unknown_rate.filter(|_| !discs) {
            let message = "capture_fps is \"unknown\"; expected a number: gravity and the cloth act in seconds (only discs \
                           can do without)";
            source.wrong(given, message);
        }
        if let (Some(playback), None) = (&video.playback_fps, &video.capture_fps) {
            source.wrong(playback, "playback_fps needs capture_fps beside it: what the camera recorded at");
        }
        let readout = read_out(&video, &scale, readout.zip(rows), source);
        let mut notes = Vec::new();
        let from_balls = is_from_balls(&scale, discs, source);
        let calibration = calibration(&scale, (m_per_px, from_balls), readout, &mut notes, source);
        let camera = camera.check(source);
        let [cue, object, cue_markers, object_markers] = names(&tracks, source);
        if let Some(columns) = &tracks.columns {
            if !matches!(tracks.format, Format::Auto | Format::Columns) {
                source.wrong(columns, "[tracks.columns] goes with format = \"columns\" only");
            }
            if let Err(message) = columns.as_ref().check() {
                source.wrong(columns, message);
            }
            if columns.as_ref().has_angles() && !discs {
                let message = "[tracks.columns] has a column of angles, but an angle does not say how a ball turns; expected it with \
                               [ball] shape = \"disc\" only";
                source.wrong(columns, message);
            }
        } else if tracks.format == Format::Columns {
            let message =
                "format = \"columns\" needs a section [tracks.columns] that says which column is what";
            source.wrong_at(&(0..0), message);
        }
        let folder = source.path.parent().map(PathBuf::from).unwrap_or_default();
        TrackSettings {
            capture_fps,
            unknown_rate: unknown_rate.is_some(),
            discs,
            playback_fps,
            calibration,
            unit: bare(&scale.length_unit),
            scale_sd,
            format: tracks.format,
            cue,
            object,
            balls: if tracks.cue.is_some() || tracks.object.is_some() { Balls::Stated } else { Balls::Usual },
            cue_markers,
            object_markers,
            shots: tracks.shots.map(|shots| folder.join(shots.as_ref())),
            position_sd,
            time_unit: tracks.time_unit,
            columns: tracks.columns.map(Spanned::into_inner),
            camera,
            from_balls,
            notes,
        }
    }
}

fn read_out(
    video: &RawVideo,
    scale: &RawScale,
    given: Option<(f64, f64)>,
    source: &Source,
) -> Option<ReadOut> {
    let seconds = match (&video.row_readout_s, &video.rows) {
        (Some(seconds), Some(_)) => seconds,
        (Some(only), None) | (None, Some(only)) => {
            source.wrong(only, "row_readout_s and rows (the height of the picture in pixels) go together");
            return None;
        }
        (None, None) => return None,
    };
    let Some(y_axis) = bare(&scale.y_axis).filter(|_| bare(&scale.length_unit) == Some(Unit::Px)) else {
        let message = "row_readout_s needs [scale] length_unit = \"px\" and y_axis: without them nothing says \
                       which row of the picture a ball is in";
        source.wrong(seconds, message);
        return None;
    };
    let (seconds, rows) = given?;
    Some(ReadOut { seconds, rows, up: y_axis == YAxis::Up })
}

/// Whether the size of the balls is the ruler: pixels of which nothing else says what they measure, or what is asked for.
fn is_from_balls(scale: &RawScale, discs: bool, source: &Source) -> bool {
    let is_px = bare(&scale.length_unit) == Some(Unit::Px);
    let is_measured = scale.m_per_px.is_some() || !scale.point.is_empty();
    if let Some(from) = &scale.from {
        if is_measured {
            let message = "from = \"balls\" stands beside m_per_px or [[scale.point]]; expected one of them";
            source.wrong(from, message);
        } else if discs {
            let message = "from is \"balls\"; discs need a scale: m_per_px, or four or more [[scale.point]]";
            source.wrong(from, message);
        }
    }
    !discs && !is_measured && (scale.from.is_some() || is_px)
}

fn calibration(
    scale: &RawScale,
    (m_per_px, from_balls): (Option<f64>, bool),
    readout: Option<ReadOut>,
    notes: &mut Vec<String>,
    source: &Source,
) -> Calibration {
    let axis_up = bare(&scale.y_axis).map(|axis| axis == YAxis::Up);
    let unit = bare(&scale.length_unit).unwrap_or(Unit::M);
    let (factor, divisor) = unit.metres().unwrap_or((m_per_px.unwrap_or(1.0), 1.0));
    let linear = Calibration::linear(factor, divisor, axis_up.unwrap_or(true), readout);
    match (&scale.length_unit, &scale.m_per_px, scale.point.first()) {
        _ if unit != Unit::Px => {
            let message = "m_per_px and [[scale.point]] go with length_unit = \"px\" only";
            let point = scale.point.first().map(Spanned::span);
            if let Some(span) = scale.m_per_px.as_ref().map(Spanned::span).or(point) {
                source.wrong_at(&span, message);
            }
        }
        (Some(unit), None, None) if !from_balls => {
            let message = "length_unit is \"px\"; expected m_per_px beside it, or four or more [[scale.point]] \
                           with px = [u, v] and m = [x, y]";
            source.wrong(unit, message);
        }
        (_, Some(both), Some(_)) => {
            source.wrong(both, "both m_per_px and [[scale.point]] are given; expected one of them");
        }
        (_, None, Some(first)) => {
            let pairs: Vec<_> =
                scale.point.iter().map(|point| (point.as_ref().px, point.as_ref().m)).collect();
            match Calibration::homography(&pairs, axis_up, readout) {
                Ok((calibration, note)) => {
                    notes.push(format!("{}: {note}", source.path.display()));
                    return calibration;
                }
                Err(message) => source.wrong(first, message),
            }
        }
        _ => {}
    }
    linear
}

/// Names of the tracks of cue and object, and of the markers on either.
fn names(tracks: &RawTracks, source: &Source) -> [Names; 4] {
    let given = [&tracks.cue, &tracks.object, &tracks.cue_markers, &tracks.object_markers];
    let mut used: Vec<(String, &str)> = Vec::new();
    let mut given = given.into_iter();
    NAMED.map(|key| {
        let Some(given) = given.next().and_then(Option::as_ref) else {
            let default = if key.ends_with("markers") { vec![] } else { vec![key.to_string()] };
            return Names(default);
        };
        let names = Names::of(given.as_ref().0.iter().map(String::as_str));
        if !names.are_good() {
            let message = format!("{key} is {}; expected names of tracks, each once", given.as_ref().shown());
            source.wrong(given, message);
        }
        if let Some((both, other)) = used.iter().find(|(name, _)| names.0.contains(name)) {
            source.wrong(given, format!("\"{both}\" is both {other} and {key}; expected different tracks"));
        }
        used.extend(names.0.iter().map(|name| (name.clone(), key)));
        names
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::io::error::Problems;

    /// Checked settings of these sections.
    pub(crate) fn settings(text: &str) -> TrackSettings {
        let sections: Sections = toml::from_str(text).unwrap();
        let problems = Problems::new("");
        let source = Source { path: std::path::Path::new("dataset.toml"), text, problems: &problems };
        let settings = sections.check(false, &source);
        assert!(problems.is_empty(), "{}", problems.into_error());
        settings
    }
}
