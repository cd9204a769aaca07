//! Which of the points that were followed are on the same disc, where nobody says it: those that keep their distances.

use super::input::quoted;
use super::raw::{RawTrack, Row};
use crate::measurement::disc_centres::{Centre, Seen};
use crate::measurement::marker_groups::rigid_groups;
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

/// Two discs in a shot whose centres are yet to be told: each is one track, or three and more that keep their distances. Tracks that
/// belong to neither are left over.
pub(super) struct Found {
    /// The tracks on the disc that moves first, and on the other.
    pub groups: [Vec<usize>; 2],
    pub seen: Seen,
}

impl Found {
    /// # Errors
    /// Why there are not two discs.
    pub(super) fn of(tracks: &[RawTrack]) -> Result<Self, String> {
        let points: Vec<Vec<Sample>> = tracks.iter().map(samples).collect();
        let groups = if tracks.len() == 2 { vec![vec![0], vec![1]] } else { groups(&points) };
        let mut groups: [Vec<usize>; 2] = groups.try_into().map_err(|groups: Vec<Vec<usize>>| {
            let found: Vec<String> = groups.iter().map(|group| names(tracks, group)).collect();
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
        let of_discs = groups.each_ref().map(|group| group.iter().map(|i| points[*i].as_slice()).collect());
        let seen = Seen::of(of_discs.each_ref().map(|points: &Vec<&[Sample]>| points.as_slice()));
        Ok(Self { groups, seen })
    }
}

/// Two discs with their centres.
///
/// # Errors
/// That it is not told which point is the centre.
pub(super) fn discs(
    tracks: &[RawTrack],
    groups: &[Vec<usize>; 2],
    centres: [Centre; 2],
) -> Result<Discs, String> {
    let disc = |k: usize| -> Result<Disc, String> {
        let group = &groups[k];
        let centre = centres[k].map_err(|like_centre| {
            format!(
                "the points {} are on one disc, but whether \"{}\" is its centre or on its rim does not show, since the disc \
                 hardly turns and the other shots do not tell it; expected [tracks] cue and object, and cue_markers and \
                 object_markers for points beside the centre",
                names(tracks, group),
                tracks[group[like_centre]].name
            )
        })?;
        let Some(centre) = centre else {
            return Ok(Disc { centre: group.clone(), markers: Vec::new() });
        };
        let markers = group.iter().copied().filter(|i| *i != group[centre]).collect();
        Ok(Disc { centre: vec![group[centre]], markers })
    };
    Ok([disc(0)?, disc(1)?])
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
