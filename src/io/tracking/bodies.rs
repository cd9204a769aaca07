//! Assignment of tracked points to discs by the distances that they keep, if it is not stated.

use std::collections::HashMap;
use std::path::PathBuf;

use rayon::prelude::*;

use super::calibration::Calibration;
use super::finish::{Facts, find, number_twins};
use super::input::quoted;
use super::isolated;
use super::marker_groups::{Centre, central, rigid_groups};
use super::raw::{NAMES, Notes, RawShot, RawTrack, Row};
use super::settings::{Names, TrackSettings};
use crate::measurement::track::Sample;

/// Assigns tracks to discs, and determines which are centres, in the shots that do not state it;
/// the result replaces the names of the table of shots.
pub(super) fn group(
    work: &mut [(RawShot, Facts)],
    settings: &TrackSettings,
    calibrations: &HashMap<PathBuf, Calibration>,
    notes: &Notes,
) {
    let found = |(raw, facts): &mut (RawShot, Facts)| {
        number_twins(&mut raw.tracks);
        let (tracks, calibration) = (&raw.tracks, calibrations.get(raw.file.as_path())?);
        let named = |name: &str| !matches!(find(tracks, name), Ok(None));
        let is_unsaid = settings.discs
            && !facts.own.settings(settings).states_balls
            && !named("cue")
            && !named("object")
            && tracks.len() > 1
            && tracks.iter().all(|track| track.point.is_none());
        is_unsaid.then(|| isolated(|| discs(tracks, calibration)).and_then(|discs| discs))
    };
    let found: Vec<_> = work.par_iter_mut().map(found).collect();
    for ((raw, facts), found) in work.iter_mut().zip(found) {
        match found {
            Some(Ok([one, other])) => {
                let message = format!(
                    "[tracks] cue and object are not given: the disc that moves first, taken as cue, is {}; the other is {}",
                    one.shown(),
                    other.shown()
                );
                notes.of(&raw.file).add(NAMES, raw.line, message);
                let names = [one.centre, other.centre, one.markers, other.markers];
                facts.own.names = names.map(|names| Some(Names(names)));
            }
            Some(Err(message)) => facts.refused = Some(message),
            None => {}
        }
    }
}

struct Disc {
    /// The centre, or points on a circle about it.
    centre: Vec<String>,
    /// Further points on the disc.
    markers: Vec<String>,
}

impl Disc {
    /// Returns the names of its tracks for messages.
    fn shown(&self) -> String {
        let centre = quoted(&self.centre);
        match (self.centre.len(), self.markers.len()) {
            (1, 0) => centre,
            (1, _) => format!("{centre} (its centre) with {}", quoted(&self.markers)),
            _ => format!("{centre} (on a circle about its centre)"),
        }
    }
}

/// Returns the two discs of a shot, the first to move first: each is one track, or three or more
/// that keep their distances. Other tracks are left out.
///
/// # Errors
/// There are not two discs, or the centre is ambiguous.
fn discs(tracks: &[RawTrack], calibration: &Calibration) -> Result<[Disc; 2], String> {
    let place = |row: &Row| calibration.metres(row.x, row.y);
    let points: Vec<Vec<Sample>> = tracks.iter().map(|track| samples(track, place)).collect();
    let groups = if tracks.len() == 2 { vec![vec![0], vec![1]] } else { groups(&points) };
    let mut groups: [Vec<usize>; 2] = groups.try_into().map_err(|groups: Vec<Vec<usize>>| {
        let found: Vec<String> = groups.iter().map(|group| quoted(names(tracks, group))).collect();
        let found = if found.is_empty() { "none".to_string() } else { found.join(" and ") };
        format!(
            "its {} tracks are not two discs: groups of three or more points that keep their distances are {found}. Expected \
             two such groups, or [tracks] cue and object (for this shot alone, in the table that [tracks] shots names), or the \
             shot skipped",
            tracks.len()
        )
    })?;
    let begin = |group: &Vec<usize>| {
        let all = group.iter().filter_map(|i| beginning(&tracks[*i], tracks));
        all.fold(f64::INFINITY, f64::min)
    };
    if begin(&groups[1]) < begin(&groups[0]) {
        groups.swap(0, 1);
    }
    let disc = |group: &[usize]| {
        let own: Vec<&[Sample]> = group.iter().map(|i| points[*i].as_slice()).collect();
        disc(tracks, group, central(&own))
    };
    Ok([disc(&groups[0])?, disc(&groups[1])?])
}

/// Returns the tracks of a disc.
///
/// # Errors
/// It is ambiguous which point is the centre.
fn disc(tracks: &[RawTrack], group: &[usize], centre: Centre) -> Result<Disc, String> {
    let centre = centre.map_err(|like_centre| {
        let like_centre: Vec<usize> = like_centre.iter().map(|i| group[*i]).collect();
        format!(
            "the points {} are on one disc, but {} may be its centre or on its rim, since the disc turns too little to decide; \
             expected [tracks] cue and object, and cue_markers and \
             object_markers for points beside the centre",
            quoted(names(tracks, group)),
            quoted(names(tracks, &like_centre)).replace(", ", " or ")
        )
    })?;
    let mut markers = names(tracks, group);
    let Some(centre) = centre else { return Ok(Disc { centre: markers, markers: Vec::new() }) };
    Ok(Disc { centre: vec![markers.remove(centre)], markers })
}

/// Returns the groups of three or more points that keep their distances.
fn groups(points: &[Vec<Sample>]) -> Vec<Vec<usize>> {
    let slices: Vec<&[Sample]> = points.iter().map(Vec::as_slice).collect();
    rigid_groups(&slices).into_iter().filter(|group| group.len() > 2).collect()
}

pub(super) fn are_two(tracks: &[RawTrack]) -> bool {
    let points: Vec<Vec<Sample>> = tracks.iter().map(|track| samples(track, |row| [row.x, row.y])).collect();
    groups(&points).len() == 2
}

fn names(tracks: &[RawTrack], group: &[usize]) -> Vec<String> {
    group.iter().map(|i| tracks[*i].name.clone()).collect()
}

fn samples(track: &RawTrack, place: impl Fn(&Row) -> [f64; 2]) -> Vec<Sample> {
    let mut samples: Vec<Sample> = track.seen().map(|row| Sample::new(row.time, place(row))).collect();
    samples.sort_by(|a, b| a.t.total_cmp(&b.t));
    samples
}

/// Returns the time at which a track is a tenth of its way from its start, as a part of the time of
/// all tracks; 1 if it stays there.
pub(super) fn beginning(track: &RawTrack, all: &[RawTrack]) -> Option<f64> {
    const MOVED: f64 = 0.1;
    let times = || all.iter().flat_map(|track| &track.rows).map(|row| row.time);
    let (first, last) = (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
    let origin = track.seen().next()?;
    let way = |row: &Row| origin.distance(*row);
    let most = track.seen().map(way).fold(0.0, f64::max);
    let moving = track.seen().find(|row| way(row) > MOVED * most);
    Some(moving.map_or(1.0, |row| (row.time - first) / (last - first).max(f64::MIN_POSITIVE)))
}
