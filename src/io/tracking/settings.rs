//! The sections of dataset.toml for kind = "tracks".

use std::path::PathBuf;

use indexmap::IndexMap;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;

use super::camera::{Calibration, CameraSection, NumberOr, OneOrSeveral, Point, homography};
use super::words::Unit;
use crate::io::toml_file::Source;
use crate::measurement::dataset::Tracks;
use crate::name::worded;

#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
pub(crate) struct VideoSection {
    capture_fps: Option<NumberOr<UnknownRate>>,
    /// Standard deviation of capture_fps, frames/s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(super) capture_fps_sd: Option<f64>,
    /// The rate that the file's times follow, if it is not the camera's.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(super) playback_fps: Option<f64>,
    #[schemars(extend("exclusiveMinimum" = 0))]
    row_readout_s: Option<f64>,
    #[schemars(extend("exclusiveMinimum" = 0))]
    rows: Option<f64>,
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(rename_all = "lowercase")]
enum UnknownRate {
    Unknown,
}

impl VideoSection {
    pub(crate) fn has_unknown_rate(&self) -> bool {
        matches!(self.capture_fps, Some(NumberOr::Word(_)))
    }
}

#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
pub(crate) struct ScaleSection {
    #[schemars(extend("enum" = Unit::M.names_alike()))]
    pub(super) length_unit: Option<Unit>,
    #[schemars(extend("exclusiveMinimum" = 0))]
    m_per_px: Option<f64>,
    /// Source of the scale if no number states it.
    #[schemars(extend("enum" = ["balls"]))]
    from: Option<String>,
    /// Relative standard deviation of the scale.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(super) sd: Option<f64>,
    #[schemars(extend("enum" = ["up", "down"]))]
    y_axis: Option<String>,
    #[serde(default)]
    point: Vec<Point>,
}

#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
pub(crate) struct TracksSection {
    #[serde(default)]
    pub(super) format: Format,
    /// The names of the tracks of one ball: its centre, or several markers on it.
    pub(super) cue: Option<OneOrSeveral<String>>,
    /// Likewise of the other ball.
    pub(super) object: Option<OneOrSeveral<String>>,
    /// The names of further tracks of points on each ball.
    cue_markers: Option<OneOrSeveral<String>>,
    object_markers: Option<OneOrSeveral<String>>,
    shots: Option<String>,
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(super) position_sd_m: Option<f64>,
    #[schemars(extend("enum" = Unit::S.names_alike()))]
    pub(super) time_unit: Option<Unit>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(schema_with = "schema_of_columns")]
    pub(super) columns: Option<Columns>,
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

/// Keys of `[tracks]`, and columns of the table of shots, that name tracks.
pub(super) const NAMED: [&str; 4] = ["cue", "object", "cue_markers", "object_markers"];

/// The sections of dataset.toml for tracks, and what follows from them.
#[derive(Clone, Debug, Default)]
pub(crate) struct TrackSettings {
    pub(crate) video: VideoSection,
    pub(crate) camera: CameraSection,
    pub(crate) scale: ScaleSection,
    pub(crate) tracks: TracksSection,
    /// The films, still without shots.
    pub(crate) film: Tracks,
    /// Names of the tracks under each key of [`NAMED`]: of a ball's centre, or of points on it.
    pub(crate) names: [Vec<String>; 4],
    pub(crate) calibration: Calibration,
    pub(crate) shots: Option<PathBuf>,
}

impl TrackSettings {
    /// Returns the frame rate of the camera; one frame a second if it is stated as unknown (discs).
    pub(super) fn fps(&self) -> Option<f64> {
        self.video.capture_fps.map(|rate| rate.number().unwrap_or(1.0))
    }

    /// Returns the frame rate of the camera unless it is stated as unknown.
    pub(super) fn known_fps(&self) -> Option<f64> {
        self.video.capture_fps.and_then(NumberOr::number)
    }

    /// Returns the calibration of a file that states this unit of lengths.
    pub(super) fn calibration(&self, unit: Option<Unit>) -> Calibration {
        let stated = unit.filter(|_| self.scale.length_unit.is_none()).and_then(Unit::size);
        Calibration { scale: stated.unwrap_or(self.calibration.scale), ..self.calibration.clone() }
    }

    pub(super) fn single_names(&self) -> Option<[&str; 2]> {
        self.names[..2].iter().all(|names| names.len() == 1).then(|| self.first_names())
    }

    pub(super) fn first_names(&self) -> [&str; 2] {
        [0, 1].map(|ball| self.names[ball].first().map_or("", String::as_str))
    }

    /// Checks the sections, whose problems are added to those of the source, and derives the rest.
    pub(crate) fn checked(mut self, source: &Source) -> Self {
        let (is_px, points) = (self.scale.length_unit == Some(Unit::Px), &self.scale.point);
        let is_up = self.scale.y_axis.as_ref().map(|axis| axis == "up");
        let seconds = self.video.row_readout_s.or(self.camera.shutter.and_then(NumberOr::number));
        // the balls are the ruler by a statement, or for pixels without another scale
        let is_measured = self.scale.m_per_px.is_some() || !points.is_empty();
        let has_ruler = is_measured || self.film.discs.is_some() || !is_px && self.scale.from.is_none();
        self.film.from_balls = !has_ruler;
        self.film.scale_sd = has_ruler.then(|| self.scale.sd.unwrap_or(Tracks::SCALE_SD));
        self.film.rate_sd = self.video.capture_fps_sd.zip(self.fps()).map(|(sd, fps)| sd / fps);
        let map = (is_px && points.len() > 3).then(|| homography(points, is_up)).transpose();
        let map = map.map_err(|message| source.wrong("scale.point.0", message)).ok().flatten();
        self.film.notes.extend(map.iter().map(|(_, note)| format!("{}: {note}", source.path.display())));
        let per_pixel = (self.scale.m_per_px.unwrap_or(1.0), 1.0);
        self.calibration = Calibration {
            scale: self.scale.length_unit.unwrap_or(Unit::M).size().unwrap_or(per_pixel),
            is_up: is_up.unwrap_or(true),
            homography: map.map(|(map, _)| map),
            readout: seconds.zip(self.video.rows).map(|(seconds, rows)| [seconds, rows]),
        };
        let folder = source.path.parent().map(PathBuf::from).unwrap_or_default();
        self.shots = self.tracks.shots.as_ref().map(|shots| folder.join(shots));
        let TracksSection { cue, object, cue_markers, object_markers, .. } = &self.tracks;
        self.names = [cue, object, cue_markers, object_markers].map(|stated| {
            let names = stated.iter().flat_map(OneOrSeveral::each);
            names.map(|name| name.trim().to_owned()).collect()
        });
        for (names, default) in self.names.iter_mut().zip(["cue", "object"]) {
            names.extend(names.is_empty().then(|| default.to_owned()));
        }
        self
    }
}

/// `[tracks.columns]`: the column of each key of [`KEYS`] or [`EACH`], by its name or, in files
/// without names, by its number from 1; and the unit of angles.
pub(super) type Columns = IndexMap<String, toml::Value>;

const KEYS: &str = "shot frame t angle_unit ball point x_sd y_sd marker_x marker_y";
/// Keys of each ball, which follow `cue_` and `object_` in a table with a row per frame. A box has
/// its other corner in x2 and y2, or its size in width and height.
const EACH: &str = "x y x2 y2 width height likelihood angle";
const PAIRS: [[&str; 2]; 4] = [["x_sd", "y_sd"], ["marker_x", "marker_y"], ["x2", "y2"], ["width", "height"]];

pub(super) fn schema_of_columns(_: &mut SchemaGenerator) -> Schema {
    let column = json_schema!({
        "description": "The name of a column or, in files without names, its number from 1",
        "anyOf": [{ "type": "string" }, { "type": "integer", "minimum": 1 }]
    });
    let each = ["", "cue_", "object_"];
    let of_each = each.into_iter().flat_map(|begin| EACH.split(' ').map(move |key| format!("{begin}{key}")));
    let keys = KEYS.split(' ').map(str::to_owned).chain(of_each);
    let mut properties: IndexMap<String, Schema> = keys.map(|key| (key, column.clone())).collect();
    let units = json_schema!({ "type": "string", "enum": Unit::Rad.names_alike() });
    properties.insert("angle_unit".to_owned(), units);
    let pairs = each.into_iter().flat_map(|begin| PAIRS.map(|pair| pair.map(|key| format!("{begin}{key}"))));
    let both = pairs.flat_map(|[one, other]| [(one.clone(), [other.clone()]), (other, [one])]);
    let both: IndexMap<String, [String; 1]> = both.collect();
    json_schema!({ "type": "object", "properties": properties, "dependentRequired": both })
}
