//! The sections of dataset.toml that go with kind = "tracks".

use std::path::PathBuf;

use serde::{Deserialize, Deserializer};

use super::calibration::{Calibration, ReadOut};
use super::camera::{CameraSection, WantedCamera};
use super::column_names::ColumnNames;
pub(in crate::io) use super::units::TimeUnit;
pub(super) use super::units::Unit;
use crate::io::toml_file::Source;
use crate::measurement::valid::POSITIVE;

/// `[video]`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct VideoSection {
    capture_fps: Option<Rate>,
    playback_fps: Option<f64>,
    row_readout_s: Option<f64>,
    rows: Option<f64>,
}

/// A frame rate, or `"unknown"`.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(untagged, expecting = "expected a number, without quotation marks, or for discs \"unknown\"")]
enum Rate {
    Fps(f64),
    Word(UnknownRate),
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
enum UnknownRate {
    Unknown,
}

/// `[scale]`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ScaleSection {
    length_unit: Option<Unit>,
    m_per_px: Option<f64>,
    from: Option<Ruler>,
    sd: Option<f64>,
    y_axis: Option<YAxis>,
    #[serde(default)]
    point: Vec<Point>,
}

/// What tells the scale where no number does.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
enum Ruler {
    Balls,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Point {
    px: [f64; 2],
    m: [f64; 2],
}

/// `[tracks]`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TracksSection {
    #[serde(default)]
    format: Format,
    cue: Option<Names>,
    object: Option<Names>,
    cue_markers: Option<Names>,
    object_markers: Option<Names>,
    shots: Option<String>,
    position_sd_m: Option<f64>,
    time_unit: Option<TimeUnit>,
    columns: Option<ColumnNames>,
}

impl TracksSection {
    /// Returns the section that states these columns, if any, and this unit of times.
    pub(super) fn of_columns(columns: Option<ColumnNames>, time_unit: Option<TimeUnit>) -> Self {
        Self { time_unit, columns, ..Self::default() }
    }
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
        #[derive(Deserialize)]
        #[serde(
            untagged,
            expecting = "expected the name of a track, or a list of the names of markers on one ball"
        )]
        enum Either {
            One(String),
            Several(Vec<String>),
        }
        Ok(match Either::deserialize(deserializer)? {
            Either::One(name) => Self(vec![name]),
            Either::Several(names) => Self(names),
        })
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
    pub video: VideoSection,
    pub camera: CameraSection,
    pub scale: ScaleSection,
    pub tracks: TracksSection,
}

impl Sections {
    /// Checks them; what is wrong is added to the problems of the source.
    pub(crate) fn check(self, discs: bool, source: &Source) -> TrackSettings {
        let Self { video, camera, scale, tracks } = self;
        let positive = |key: &str, given| source.number(key, given, POSITIVE);
        let unknown_rate = matches!(video.capture_fps, Some(Rate::Word(_)));
        let capture_fps = video.capture_fps.and_then(|rate| match rate {
            Rate::Fps(fps) => positive("video.capture_fps", Some(fps)),
            Rate::Word(_) => Some(1.0),
        });
        let playback_fps = positive("video.playback_fps", video.playback_fps);
        let readout = positive("video.row_readout_s", video.row_readout_s);
        let rows = positive("video.rows", video.rows);
        let m_per_px = positive("scale.m_per_px", scale.m_per_px);
        let scale_sd = positive("scale.sd", scale.sd);
        let position_sd = positive("tracks.position_sd_m", tracks.position_sd_m);
        if unknown_rate && !discs {
            let message = "capture_fps is \"unknown\"; expected a number: gravity and the cloth act in seconds (only discs \
                           can do without)";
            source.wrong("video.capture_fps", message);
        }
        if playback_fps.is_some() && capture_fps.is_none() {
            let message = "playback_fps needs capture_fps beside it: what the camera recorded at";
            source.wrong("video.playback_fps", message);
        }
        let readout = read_out(readout, rows, &scale, source);
        let mut notes = Vec::new();
        let from_balls = is_from_balls(&scale, discs, source);
        let calibration = calibration(&scale, (m_per_px, from_balls), readout, &mut notes, source);
        let camera = camera.check(source);
        let [cue, object, cue_markers, object_markers] = names(&tracks, source);
        if let Some(columns) = &tracks.columns {
            let wrong = |message: &str| source.wrong("tracks.columns", message);
            if !matches!(tracks.format, Format::Auto | Format::Columns) {
                wrong("[tracks.columns] goes with format = \"columns\" only");
            }
            if let Err(message) = columns.check() {
                wrong(&message);
            }
            if columns.has_angles() && !discs {
                let message = "[tracks.columns] has a column of angles, but an angle does not say how a ball turns; expected it with \
                               [ball] shape = \"disc\" only";
                wrong(message);
            }
        } else if tracks.format == Format::Columns {
            let message =
                "format = \"columns\" needs a section [tracks.columns] that says which column is what";
            source.wrong("tracks.columns", message);
        }
        let folder = source.path.parent().map(PathBuf::from).unwrap_or_default();
        TrackSettings {
            capture_fps,
            unknown_rate,
            discs,
            playback_fps,
            calibration,
            unit: scale.length_unit,
            scale_sd,
            format: tracks.format,
            cue,
            object,
            balls: if tracks.cue.is_some() || tracks.object.is_some() { Balls::Stated } else { Balls::Usual },
            cue_markers,
            object_markers,
            shots: tracks.shots.map(|shots| folder.join(shots)),
            position_sd,
            time_unit: tracks.time_unit,
            columns: tracks.columns,
            camera,
            from_balls,
            notes,
        }
    }
}

fn read_out(
    seconds: Option<f64>,
    rows: Option<f64>,
    scale: &ScaleSection,
    source: &Source,
) -> Option<ReadOut> {
    let keys = ["video.row_readout_s", "video.rows"];
    if seconds.is_some() != rows.is_some() {
        let message = "row_readout_s and rows (the height of the picture in pixels) go together";
        source.wrong_of_first(&keys, message);
    }
    let (seconds, rows) = seconds.zip(rows)?;
    let Some(y_axis) = scale.y_axis.filter(|_| scale.length_unit == Some(Unit::Px)) else {
        let message = "row_readout_s needs [scale] length_unit = \"px\" and y_axis: without them nothing says \
                       which row of the picture a ball is in";
        source.wrong_of_first(&keys, message);
        return None;
    };
    Some(ReadOut { seconds, rows, up: y_axis == YAxis::Up })
}

/// Whether the size of the balls is the ruler: pixels of which nothing else says what they measure, or what is asked for.
fn is_from_balls(scale: &ScaleSection, discs: bool, source: &Source) -> bool {
    let is_px = scale.length_unit == Some(Unit::Px);
    let is_measured = scale.m_per_px.is_some() || !scale.point.is_empty();
    if scale.from.is_some() {
        if is_measured {
            let message = "from = \"balls\" stands beside m_per_px or [[scale.point]]; expected one of them";
            source.wrong("scale.from", message);
        } else if discs {
            let message = "from is \"balls\"; discs need a scale: m_per_px, or four or more [[scale.point]]";
            source.wrong("scale.from", message);
        }
    }
    !discs && !is_measured && (scale.from.is_some() || is_px)
}

fn calibration(
    scale: &ScaleSection,
    (m_per_px, from_balls): (Option<f64>, bool),
    readout: Option<ReadOut>,
    notes: &mut Vec<String>,
    source: &Source,
) -> Calibration {
    let axis_up = scale.y_axis.map(|axis| axis == YAxis::Up);
    let unit = scale.length_unit.unwrap_or(Unit::M);
    let (factor, divisor) = unit.metres().unwrap_or((m_per_px.unwrap_or(1.0), 1.0));
    let linear = Calibration::linear(factor, divisor, axis_up.unwrap_or(true), readout);
    let (has_factor, has_points) = (m_per_px.is_some(), !scale.point.is_empty());
    if unit != Unit::Px {
        if has_factor || has_points {
            let message = "m_per_px and [[scale.point]] go with length_unit = \"px\" only";
            source.wrong_of_first(&["scale.m_per_px", "scale.point.0"], message);
        }
        return linear;
    }
    match (has_factor, has_points) {
        (false, false) if !from_balls => {
            let message = "length_unit is \"px\"; expected m_per_px beside it, or four or more [[scale.point]] \
                           with px = [u, v] and m = [x, y]";
            source.wrong("scale.length_unit", message);
        }
        (true, true) => {
            let message = "both m_per_px and [[scale.point]] are given; expected one of them";
            source.wrong("scale.m_per_px", message);
        }
        (false, true) => {
            let pairs: Vec<_> = scale.point.iter().map(|point| (point.px, point.m)).collect();
            match Calibration::homography(&pairs, axis_up, readout) {
                Ok((calibration, note)) => {
                    notes.push(format!("{}: {note}", source.path.display()));
                    return calibration;
                }
                Err(message) => source.wrong("scale.point.0", message),
            }
        }
        _ => {}
    }
    linear
}

/// Names of the tracks of cue and object, and of the markers on either.
fn names(tracks: &TracksSection, source: &Source) -> [Names; 4] {
    let given = [&tracks.cue, &tracks.object, &tracks.cue_markers, &tracks.object_markers];
    let mut used: Vec<(String, &str)> = Vec::new();
    let mut given = given.into_iter();
    NAMED.map(|key| {
        let Some(given) = given.next().and_then(Option::as_ref) else {
            let default = if key.ends_with("markers") { vec![] } else { vec![key.to_string()] };
            return Names(default);
        };
        let wrong = |message: String| source.wrong(&format!("tracks.{key}"), message);
        let names = Names::of(given.0.iter().map(String::as_str));
        if !names.are_good() {
            wrong(format!("{key} is {}; expected names of tracks, each once", given.shown()));
        }
        if let Some((both, other)) = used.iter().find(|(name, _)| names.0.contains(name)) {
            wrong(format!("\"{both}\" is both {other} and {key}; expected different tracks"));
        }
        used.extend(names.0.iter().map(|name| (name.clone(), key)));
        names
    })
}
