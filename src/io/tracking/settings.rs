//! The sections of dataset.toml for kind = "tracks".

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Deserialize;

use super::calibration::{Calibration, ReadOut};
use super::camera::{CameraSection, WantedCamera};
use super::column_names::{self, Columns, schema_of_columns};
use super::units::{TimeUnit, Unit};
use crate::io::toml_file::Source;
use crate::measurement::fault::POSITIVE;
use crate::physics::name::worded;

#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct VideoSection {
    capture_fps: Option<Rate>,
    /// Standard deviation of capture_fps, frames/s.
    capture_fps_sd: Option<f64>,
    playback_fps: Option<f64>,
    row_readout_s: Option<f64>,
    rows: Option<f64>,
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(untagged, expecting = "expected a number, without quotation marks, or for discs \"unknown\"")]
enum Rate {
    Fps(f64),
    Word(UnknownRate),
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(rename_all = "lowercase")]
enum UnknownRate {
    Unknown,
}

#[derive(Default, Deserialize, JsonSchema)]
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

/// Source of the scale if no number states it.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
enum Ruler {
    Balls,
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
enum YAxis {
    Up,
    Down,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Point {
    px: [f64; 2],
    m: [f64; 2],
}

#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct TracksSection {
    #[serde(default)]
    format: Format,
    cue: Option<OneOrSeveral>,
    object: Option<OneOrSeveral>,
    cue_markers: Option<OneOrSeveral>,
    object_markers: Option<OneOrSeveral>,
    shots: Option<String>,
    position_sd_m: Option<f64>,
    time_unit: Option<TimeUnit>,
    #[serde(default)]
    #[schemars(schema_with = "schema_of_columns")]
    columns: Option<Columns>,
}

worded! {
    #[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
    #[serde(rename_all = "lowercase")]
    pub(super) enum Format {
        #[default]
        Auto = "auto" | "",
        Long = "long" | "a long table",
        Tracker = "tracker" | "Tracker",
        Kinovea = "kinovea" | "Kinovea",
        Qualisys = "qualisys" | "Qualisys",
        Json = "json" | "JSON",
        Columns = "columns" | "a table by [tracks.columns]",
    }
    pub(super) fn name;
    pub(super) fn shown;
}

#[derive(Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected the name of a track, or a list of the names of markers on one ball")]
enum OneOrSeveral {
    One(String),
    Several(Vec<String>),
}

/// The names of the tracks of one ball: its centre, or several markers on it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Names(pub Vec<String>);

/// Keys of `[tracks]`, and columns of the table of shots, that name tracks.
pub(super) const NAMED: [&str; 4] = ["cue", "object", "cue_markers", "object_markers"];

impl Names {
    pub(super) fn of<'a>(names: impl Iterator<Item = &'a str>) -> Self {
        Self(names.map(|name| name.trim().to_string()).collect())
    }

    pub(super) fn are_good(&self) -> bool {
        let Self(names) = self;
        let is_bad = |(i, name): (usize, &String)| name.is_empty() || names[..i].contains(name);
        !names.is_empty() && !names.iter().enumerate().any(is_bad)
    }

    pub(super) fn shown(&self) -> String {
        match self.0.as_slice() {
            [one] => format!("{one:?}"),
            many => format!("{many:?}"),
        }
    }
}

#[derive(Clone, Debug)]
#[allow(clippy::struct_excessive_bools)]
pub(crate) struct TrackSettings {
    pub(super) capture_fps: Option<f64>,
    /// Relative standard deviation of the frame rate.
    pub(super) rate_sd: Option<f64>,
    /// Standard deviation of the slope of the table.
    pub(in crate::io) tilt_sd: Option<f64>,
    /// Standard deviation of the topspin that shots share.
    pub(in crate::io) topspin_sd: Option<f64>,
    /// Whether `capture_fps` is stated as unknown and means one frame a second (discs).
    pub(crate) unknown_rate: bool,
    /// Whether the tracks are of discs, whose centres may follow from points on them.
    pub(super) discs: bool,
    /// The rate that the file's times follow, if it is not the camera's.
    pub(super) playback_fps: Option<f64>,
    pub(super) calibration: Calibration,
    pub(super) unit: Option<Unit>,
    /// Relative standard deviation of the scale, if it is stated.
    pub(super) scale_sd: Option<f64>,
    pub(super) format: Format,
    /// Tracks of both balls, and of points on them, in the order of [`NAMED`].
    pub(super) names: [Names; 4],
    /// Whether `cue` or `object` is stated; if not, both have their default names.
    pub(super) states_balls: bool,
    pub(super) shots: Option<PathBuf>,
    pub(super) position_sd: Option<f64>,
    pub(super) time_unit: Option<TimeUnit>,
    pub(super) columns: Option<Columns>,
    pub(super) camera: WantedCamera,
    /// Whether the scale is estimated from the size of the balls.
    pub(super) from_balls: bool,
    /// Notes on assumptions, for the reader.
    pub(crate) notes: Vec<String>,
}

impl TrackSettings {
    pub(super) fn single_names(&self) -> Option<[&str; 2]> {
        match [&self.names[0], &self.names[1]].map(|names| names.0.as_slice()) {
            [[cue], [object]] => Some([cue, object]),
            _ => None,
        }
    }

    pub(super) fn first_names(&self) -> [&str; 2] {
        [0, 1].map(|ball| self.names[ball].0.first().map_or("", String::as_str))
    }
}

/// The sections of dataset.toml as written.
#[derive(Default)]
pub(crate) struct Sections {
    pub(crate) video: VideoSection,
    pub(crate) camera: CameraSection,
    pub(crate) scale: ScaleSection,
    pub(crate) tracks: TracksSection,
}

/// Keys of the time that a picture takes from its first row to its last.
const READOUT: &[&str] = &["video.row_readout_s", "video.rows", "camera.shutter", "video"];

impl Sections {
    /// Checks the sections; adds to the problems of the source.
    pub(crate) fn check(self, discs: bool, source: &Source) -> TrackSettings {
        let Self { video, camera, scale, tracks } = self;
        let positive = |key: &str, given| source.number(key, given, POSITIVE);
        let unknown_rate = matches!(video.capture_fps, Some(Rate::Word(_)));
        let capture_fps = match video.capture_fps {
            Some(Rate::Fps(fps)) => positive("video.capture_fps", Some(fps)),
            other => other.map(|_| 1.0),
        };
        let playback_fps = positive("video.playback_fps", video.playback_fps);
        let capture_fps_sd = positive("video.capture_fps_sd", video.capture_fps_sd);
        let readout = positive("video.row_readout_s", video.row_readout_s);
        let readout = readout.or(positive("camera.shutter", camera.readout()));
        let rows = positive("video.rows", video.rows);
        positive("scale.m_per_px", scale.m_per_px);
        let scale_sd = positive("scale.sd", scale.sd);
        let position_sd = positive("tracks.position_sd_m", tracks.position_sd_m);
        let is_px = scale.length_unit == Some(Unit::Px);
        let has_points = !scale.point.is_empty();
        let is_measured = scale.m_per_px.is_some() || has_points;
        // the balls are the ruler by a statement, or for pixels without another scale
        let from_balls = !discs && !is_measured && (scale.from.is_some() || is_px);
        let y_axis = scale.y_axis.filter(|_| is_px);
        let read_out = readout.zip(rows);
        let (columns, format) = (tracks.columns, tracks.format);
        for (key, stated) in [("playback_fps", playback_fps), ("capture_fps_sd", capture_fps_sd)] {
            let is_alone = stated.is_some() && (capture_fps.is_none() || unknown_rate);
            let message = format!("{key} needs capture_fps beside it, as a number: the rate of the camera");
            source.wrong_if(is_alone, &format!("video.{key}"), &message);
        }
        let message =
            "\"unknown\" goes with discs only: gravity and the cloth act in seconds; expected a number";
        source.wrong_if(unknown_rate && !discs, "video.capture_fps", message);
        let wrong_of_first = |is_wrong: bool, keys: &[&str], message: &str| {
            if is_wrong {
                source.wrong_of_first(keys, message);
            }
        };
        let message = "row_readout_s (or [camera] shutter in seconds) and rows, of the picture, go together";
        wrong_of_first(readout.is_some() != rows.is_some(), READOUT, message);
        let message = "row_readout_s needs [scale] length_unit = \"px\" and y_axis, to know a ball's row";
        wrong_of_first(read_out.is_some() && y_axis.is_none(), READOUT, message);
        let message = "m_per_px and [[scale.point]] go with length_unit = \"px\" only";
        wrong_of_first(!is_px && is_measured, &["scale.m_per_px", "scale.point.0"], message);
        let message = "from = \"balls\" goes with balls, without another scale; expected one of them";
        source.wrong_if(scale.from.is_some() && (is_measured || discs), "scale.from", message);
        let message = "length_unit is \"px\"; expected m_per_px, or four or more [[scale.point]]";
        source.wrong_if(is_px && !is_measured && !from_balls, "scale.length_unit", message);
        let message = "both m_per_px and [[scale.point]] are given; expected one of them";
        source.wrong_if(is_px && scale.m_per_px.is_some() && has_points, "scale.m_per_px", message);
        let message = "format = \"columns\" and a section [tracks.columns] go together";
        let is_by_columns = format == Format::Columns;
        let are_apart = columns.is_some() != is_by_columns && (is_by_columns || format != Format::Auto);
        source.wrong_if(are_apart, "tracks.columns", message);
        if let Some(columns) = &columns {
            column_names::check(columns, discs, source);
        }
        let up = |axis| axis == YAxis::Up;
        let readout = read_out.zip(y_axis);
        let readout = readout.map(|((seconds, rows), axis)| ReadOut { seconds, rows, up: up(axis) });
        let (factor, divisor) =
            scale.length_unit.unwrap_or(Unit::M).metres().unwrap_or((scale.m_per_px.unwrap_or(1.0), 1.0));
        let axis_up = scale.y_axis.map(up);
        let mut calibration = Calibration::linear(factor, divisor, axis_up.unwrap_or(true), readout);
        let mut notes = Vec::new();
        if is_px && has_points && scale.m_per_px.is_none() {
            let pairs: Vec<_> = scale.point.iter().map(|point| (point.px, point.m)).collect();
            match Calibration::homography(&pairs, axis_up, readout) {
                Ok((homography, note)) => {
                    notes.push(format!("{}: {note}", source.path.display()));
                    calibration = homography;
                }
                Err(message) => source.wrong("scale.point.0", message),
            }
        }
        let folder = source.path.parent().map(PathBuf::from).unwrap_or_default();
        TrackSettings {
            capture_fps,
            rate_sd: capture_fps_sd.zip(capture_fps).map(|(sd, fps)| sd / fps),
            tilt_sd: None,
            topspin_sd: None,
            unknown_rate,
            discs,
            playback_fps,
            calibration,
            unit: scale.length_unit,
            scale_sd,
            format,
            states_balls: tracks.cue.is_some() || tracks.object.is_some(),
            names: names([tracks.cue, tracks.object, tracks.cue_markers, tracks.object_markers], source),
            shots: tracks.shots.map(|shots| folder.join(shots)),
            position_sd,
            time_unit: tracks.time_unit,
            columns,
            camera: camera.check(source),
            from_balls,
            notes,
        }
    }
}

fn names(given: [Option<OneOrSeveral>; 4], source: &Source) -> [Names; 4] {
    let mut used: Vec<(String, &str)> = Vec::new();
    let mut keys = NAMED.into_iter();
    given.map(|given| {
        let key = keys.next().unwrap_or_default();
        let names = match given {
            None if key.ends_with("markers") => return Names(Vec::new()),
            None => return Names(vec![key.to_string()]),
            Some(OneOrSeveral::One(name)) => vec![name],
            Some(OneOrSeveral::Several(names)) => names,
        };
        let wrong = |message: String| source.wrong(&format!("tracks.{key}"), message);
        let names = Names::of(names.iter().map(String::as_str));
        if !names.are_good() {
            wrong(format!("{key} is {}; expected names of tracks, each once", names.shown()));
        }
        if let Some((both, other)) = used.iter().find(|(name, _)| names.0.contains(name)) {
            wrong(format!("\"{both}\" is both {other} and {key}; expected different tracks"));
        }
        used.extend(names.0.iter().map(|name| (name.clone(), key)));
        names
    })
}
