//! What a file of tracks holds, seen without a dataset.toml: for writing one.

use std::path::Path;

use super::bodies;
use super::raw::{Clock, Notes, RawShot};
use super::read;
use super::settings;
use super::settings::{Format, TimeUnit, Unit};
use super::time;
use crate::io::error::Problems;
use crate::io::toml_file::Source;

/// What was seen in a file of tracks.
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    /// `long`, `tracker`, `kinovea`, `qualisys` or `json`.
    pub format: &'static str,
    pub shots: usize,
    /// Names of tracks in the order of first appearance, with the part of the file's time at which each one
    /// begins to move.
    pub tracks: Vec<(String, f64)>,
    /// Whether some tracks are of points on balls.
    pub points: bool,
    /// Times are numbers of frames.
    pub in_frames: bool,
    /// Frames per second that the file itself states, as the camera's.
    pub stated_fps: Option<f64>,
    /// Frames per second that the times follow, where they are in seconds.
    pub times_fps: Option<f64>,
    /// Unit of lengths that the file itself states, as dataset.toml names it.
    pub unit: Option<&'static str>,
    /// The longer side of the box about all positions, in the unit of the file.
    pub extent: f64,
}

/// Looks at a file; `None` if it is in no known format or cannot be read.
#[must_use]
pub fn survey(file: &Path) -> Option<Survey> {
    let source = Source { path: file, text: "" };
    let mut problems = Problems::new("");
    let settings = settings::check((None, None), None, None, false, &source, &mut problems);
    let read::Tracked { mut shots, format, unit } =
        read::file(file, &settings, &mut problems, &mut Notes::default())?;
    let clock = shots.first()?.clock;
    let mut tracks: Vec<(String, Vec<f64>)> = Vec::new();
    for shot in &shots {
        for track in &shot.tracks {
            let Some(begin) = bodies::beginning(track, &shot.tracks) else { continue };
            let name = track.name.clone();
            match tracks.iter_mut().find(|(known, _)| *known == name) {
                Some((_, all)) => all.push(begin),
                None => tracks.push((name, vec![begin])),
            }
        }
    }
    let median = |mut all: Vec<f64>| {
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    };
    let (in_frames, stated_fps) = match clock {
        Clock::In(TimeUnit::Frames) => (true, None),
        Clock::FramesAt(fps) => (true, Some(fps)),
        _ => (false, None),
    };
    Some(Survey {
        format: match format {
            Format::Tracker => "tracker",
            Format::Kinovea => "kinovea",
            Format::Qualisys => "qualisys",
            Format::Json => "json",
            Format::Long | Format::Auto | Format::Columns => "long",
        },
        shots: shots.len(),
        points: shots.iter().flat_map(|shot| &shot.tracks).any(|track| track.point.is_some()),
        times_fps: (!in_frames).then(|| shots.iter_mut().find_map(time::followed)).flatten(),
        extent: extent(&shots),
        tracks: tracks.into_iter().map(|(name, all)| (name, median(all))).collect(),
        in_frames,
        stated_fps,
        unit: unit.map(Unit::name),
    })
}

fn extent(shots: &[RawShot]) -> f64 {
    let rows = shots.iter().flat_map(|shot| &shot.tracks).flat_map(|track| &track.rows);
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for row in rows.filter(|row| !row.is_gap()) {
        for (i, value) in [row.x, row.y].into_iter().enumerate() {
            low[i] = low[i].min(value);
            high[i] = high[i].max(value);
        }
    }
    (high[0] - low[0]).max(high[1] - low[1]).max(0.0)
}
