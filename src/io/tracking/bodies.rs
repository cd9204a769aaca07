//! Which of the points that were followed are on the same disc, where nobody says it: those that keep their distances.

use super::input::quoted;
use super::raw::{RawTrack, Row};
use crate::measurement::marker_groups::{central, rigid_groups};
use crate::measurement::track::Sample;

/// The tracks of two discs, by their indices: the one that moves first, and the other.
pub(super) type Discs = [Disc; 2];

/// The tracks of a disc.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Disc {
    /// The centre, or points on a circle about it.
    pub centre: Vec<usize>,
    /// Further points on the disc.
    pub markers: Vec<usize>,
}

/// Of two discs: each is one track, or three and more that keep their distances. Tracks that belong to neither are left over.
///
/// # Errors
/// Why there are not two.
pub(super) fn discs(tracks: &[RawTrack]) -> Result<Discs, String> {
    let points: Vec<Vec<Sample>> = tracks.iter().map(samples).collect();
    let mut groups = if tracks.len() == 2 { vec![vec![0], vec![1]] } else { groups(&points) };
    let [_, _] = groups.as_slice() else {
        let found: Vec<String> = groups.iter().map(|group| names(tracks, group)).collect();
        let found = if found.is_empty() { "none".to_string() } else { found.join(" and ") };
        return Err(format!(
            "its {} tracks are not two discs: groups of three or more points that keep their distances are {found}. Expected \
             two such groups, or [tracks] cue and object (for this shot alone, in the table that [tracks] shots names), or the \
             shot skipped",
            tracks.len()
        ));
    };
    let begin = |group: &Vec<usize>| {
        let all = group.iter().filter_map(|i| beginning(&tracks[*i], tracks));
        all.fold(f64::INFINITY, f64::min)
    };
    if begin(&groups[1]) < begin(&groups[0]) {
        groups.swap(0, 1);
    }
    let disc = |group: &Vec<usize>| -> Result<Disc, String> {
        let slices: Vec<&[Sample]> = group.iter().map(|i| points[*i].as_slice()).collect();
        let centre = central(&slices).map_err(|like_centre| {
            let name = &tracks[group[like_centre]].name;
            format!(
                "the points {} are on one disc, but whether \"{name}\" is its centre or on its rim does not show, since the disc \
                 hardly turns; expected [tracks] cue and object, and cue_markers and object_markers for points beside the centre",
                names(tracks, group)
            )
        })?;
        Ok(match centre {
            Some(centre) => Disc {
                centre: vec![group[centre]],
                markers: group.iter().copied().filter(|i| *i != group[centre]).collect(),
            },
            None => Disc { centre: group.clone(), markers: Vec::new() },
        })
    };
    Ok([disc(&groups[0])?, disc(&groups[1])?])
}

/// Groups of three and more points that keep their distances.
fn groups(points: &[Vec<Sample>]) -> Vec<Vec<usize>> {
    let slices: Vec<&[Sample]> = points.iter().map(Vec::as_slice).collect();
    rigid_groups(&slices).into_iter().filter(|group| group.len() > 2).collect()
}

/// Whether the tracks are points on two discs.
pub(super) fn are_two(tracks: &[RawTrack]) -> bool {
    let points: Vec<Vec<Sample>> = tracks.iter().map(samples).collect();
    groups(&points).len() == 2
}

fn names(tracks: &[RawTrack], group: &[usize]) -> String {
    quoted(group.iter().map(|i| &tracks[*i].name))
}

fn samples(track: &RawTrack) -> Vec<Sample> {
    let mut rows: Vec<&Row> = track.seen().collect();
    rows.sort_by(|a, b| a.time.total_cmp(&b.time));
    rows.into_iter().map(|row| Sample { t: row.time, x: row.x, y: row.y, sd: None }).collect()
}

/// The part of the time of all tracks at which one of them is a tenth of its way from where it began; 1 where it stays there.
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
