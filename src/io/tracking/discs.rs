//! Assignment of tracked points to discs by the distances that they keep, if it is not stated.

use super::calibration::Calibration;
use super::input::{Log, Subject, quoted};
use super::names;
use super::raw::{RawShot, RawTrack, Row, sorted, span};
use super::repair::Wrong;
use super::settings::Names;
use super::shots_table::Facts;
use crate::numerics::median;

/// Largest relative change of the distance of two points on one body. Points of one puck change
/// theirs by up to 0.035 (calibration, and tape that is seen from another side; 0.16 while a hand
/// holds the puck), points of two by 0.8 and more (30 films of two pucks, Chalmers 2023).
const MAX_CHANGE: f64 = 0.25;
/// Number of frames of a median distance, so that a frame with two mistaken markers does not count.
const MEDIAN_FRAMES: usize = 5;
/// Largest relative difference of the centre's distances to markers, which are placed by hand.
const MAX_INEQUALITY: f64 = 0.1;

/// The place of a point in each frame, NaN in a gap.
type Path = Vec<[f64; 2]>;

/// Determines the names of both discs, the first to move first, unless tracks are named cue or
/// object or name their points: each is one track, or three or more that keep their distances. The
/// result replaces the names of the facts.
///
/// # Errors
/// There are not two discs.
pub(super) fn find(
    raw: &RawShot,
    calibration: &Calibration,
    facts: &mut Facts,
    log: Log,
) -> Result<(), Wrong> {
    let is_named = |name: &str| !matches!(names::find(&raw.tracks, name), Ok(None));
    if ["cue", "object"].into_iter().any(is_named)
        || raw.tracks.len() < 2
        || !raw.tracks.iter().all(RawTrack::is_centre)
    {
        return Ok(());
    }
    let points = places(raw, |row| calibration.metres(row.place));
    let groups = if points.len() == 2 { vec![vec![0], vec![1]] } else { groups(&points) };
    let names_of =
        |group: &Vec<usize>| -> Vec<String> { group.iter().map(|i| raw.tracks[*i].name.clone()).collect() };
    let mut groups: [Vec<usize>; 2] = groups.try_into().map_err(|groups: Vec<Vec<usize>>| {
        let found: Vec<String> = groups.iter().map(|group| quoted(names_of(group))).collect();
        let found = if found.is_empty() { "none".to_string() } else { found.join(" and ") };
        let message = format!(
            "its {} tracks are not two discs: groups of three or more points that keep their distances are {found}. Expected \
             two such groups, or [tracks] cue and object (for this shot alone, in the table that [tracks] shots names), or the \
             shot skipped",
            points.len()
        );
        Wrong::damaged(raw.line, message)
    })?;
    let begin = |group: &Vec<usize>| span(group.iter().filter_map(|i| raw.beginning(&raw.tracks[*i])))[0];
    if begin(&groups[1]) < begin(&groups[0]) {
        groups.swap(0, 1);
    }
    // the centre, or points on a circle about it, and further points
    let [one, other] = groups.map(|group| {
        let own: Vec<&Path> = group.iter().map(|i| &points[*i]).collect();
        let mut names = names_of(&group);
        match central(&own) {
            Some(centre) => [vec![names.remove(centre)], names],
            None => [names, Vec::new()],
        }
    });
    let message = format!(
        "[tracks] cue and object are not given: the disc that moves first, taken as cue, is {}; the other is {}",
        quoted(one.iter().flatten()),
        quoted(other.iter().flatten())
    );
    log.add(Subject::Names, raw.line, message);
    let ([cue, cue_markers], [object, object_markers]) = (one, other);
    facts.names = [cue, object, cue_markers, object_markers].map(Names);
    facts.names_balls = true;
    Ok(())
}

/// Returns whether the tracks are two groups of points that keep their distances.
pub(super) fn are_two(shot: &RawShot) -> bool {
    groups(&places(shot, |row| row.place)).len() == 2
}

fn places(shot: &RawShot, place: impl Fn(&Row) -> [f64; 2]) -> Vec<Path> {
    shot.tracks.iter().map(|track| track.rows.iter().map(&place).collect()).collect()
}

/// Returns the groups of three or more points of which every two keep their distance, the most
/// rigid joined first.
fn groups(points: &[Path]) -> Vec<Vec<usize>> {
    let count = points.len();
    let pairs = (0..count).flat_map(|i| (0..i).map(move |j| (i, j)));
    let mut rigid: Vec<(f64, usize, usize)> =
        pairs.map(|(i, j)| (change(&points[i], &points[j]), i, j)).collect();
    rigid.retain(|(change, ..)| *change <= MAX_CHANGE);
    rigid.sort_by(|a, b| a.0.total_cmp(&b.0));
    let is_rigid = |i: usize, j: usize| rigid.iter().any(|(_, a, b)| (*a, *b) == (i.max(j), i.min(j)));
    let mut groups: Vec<Vec<usize>> = (0..count).map(|i| vec![i]).collect();
    for (_, i, j) in &rigid {
        let at = |point: &usize| groups.iter().position(|group| group.contains(point));
        let (Some(a), Some(b)) = (at(i), at(j)) else { continue };
        if a != b && groups[a].iter().all(|p| groups[b].iter().all(|q| is_rigid(*p, *q))) {
            let mut joined = groups.remove(a.max(b));
            groups[a.min(b)].append(&mut joined);
            groups[a.min(b)].sort_unstable();
        }
    }
    groups.retain(|group| group.len() > 2);
    groups
}

fn distances(one: &Path, other: &Path) -> Vec<f64> {
    let all = one.iter().zip(other).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]));
    all.filter(|distance| !distance.is_nan()).collect()
}

fn change(one: &Path, other: &Path) -> f64 {
    let distances = distances(one, other);
    let smooth = sorted(distances.windows(MEDIAN_FRAMES).map(|window| median(window.to_vec())));
    let ([least, ..], [.., most]) = (&smooth[..], &smooth[..]) else { return f64::INFINITY };
    (most - least) / smooth[smooth.len() / 2].max(f64::MIN_POSITIVE)
}

/// Returns the centre of the points on a disc, whose distances to three others or more are equal;
/// `None` if all are on a circle about it.
fn central(points: &[&Path]) -> Option<usize> {
    let distance = |one: &Path, other: &Path| Some(median(distances(one, other))).filter(|d| !d.is_nan());
    let is_like_centre = |i: &usize| {
        let others = (0..points.len()).filter(|j| j != i);
        let [least, most] = span(others.map(|j| distance(points[*i], points[j]).unwrap_or(f64::INFINITY)));
        most.max(0.0) <= (1.0 + MAX_INEQUALITY) * least
    };
    // no circle about a point of the rim meets the rim in three points
    (0..points.len()).filter(|_| points.len() > 3).find(is_like_centre)
}
