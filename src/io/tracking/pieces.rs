//! Tracks whose ids change where a tracker loses a ball, as at the impact: pieces are joined by their paths.

use super::finish::find;
use super::raw::{NAMES, Notes, RawShot, RawTrack, Row, sorted};
use super::settings::TrackSettings;

/// A ball moves at most this many times as fast as the fastest one did before: after the impact no ball is faster, and the rest is for
/// the noise of a short step.
const FASTER: f64 = 2.0;

/// A piece goes on where the nearest track ends if that is less than this part of the distance to the end of the other one.
const NEARER: f64 = 0.5;

/// Joins the pieces of both balls' tracks: to those that dataset.toml names, or, if at most two tracks are seen at a time, to the first
/// two. Pieces that go on where neither track ends stay as they are.
pub(super) fn join(shot: &mut RawShot, settings: &TrackSettings, notes: &Notes) {
    let is_plain = |track: &RawTrack| track.point.is_none() && !track.is_angle && !track.rows.is_empty();
    if shot.tracks.len() < 3 || !shot.tracks.iter().all(is_plain) {
        return;
    }
    let Some(heads) = heads(&shot.tracks, settings) else { return };
    if !heads.iter().all(|head| is_in_order(&shot.tracks[*head])) {
        return;
    }
    let mut loose: Vec<usize> = (0..shot.tracks.len()).filter(|i| !heads.contains(i)).collect();
    loose.sort_by(|a, b| shot.tracks[*a].rows[0].time.total_cmp(&shot.tracks[*b].rows[0].time));
    for piece in loose {
        let Some(head) = continued(&shot.tracks, &heads, &shot.tracks[piece]) else { continue };
        let RawTrack { name, rows, sds, .. } =
            std::mem::replace(&mut shot.tracks[piece], RawTrack::new("", None));
        let track = &mut shot.tracks[head];
        let message = format!(
            "\"{name}\" begins where \"{}\" ends, in line {}: taken as the same ball",
            track.name,
            track.rows.last().map_or(1, |row| row.line)
        );
        notes.of(&shot.file).add(NAMES, rows[0].line, message);
        track.rows.extend(rows);
        track.sds.extend(sds);
    }
    shot.tracks.retain(|track| !track.rows.is_empty());
}

/// Returns the indices of the tracks that pieces may be joined to.
fn heads(tracks: &[RawTrack], settings: &TrackSettings) -> Option<Vec<usize>> {
    let named = |names: &[String]| match names {
        [one] => find(tracks, one).ok().flatten().map(|(_, i)| i),
        _ => None,
    };
    let heads: Vec<usize> =
        [&settings.cue, &settings.object].into_iter().filter_map(|names| named(&names.0)).collect();
    if heads.len() == 2 {
        return Some(heads);
    }
    let times = sorted(tracks.iter().flat_map(|track| track.rows.iter().map(|row| row.time)));
    let are_two = times.chunk_by(|a, b| a == b).all(|rows| rows.len() <= 2);
    let mut first: Vec<usize> = (0..tracks.len()).collect();
    first.sort_by(|a, b| tracks[*a].rows[0].time.total_cmp(&tracks[*b].rows[0].time));
    first.truncate(2);
    first.sort_unstable();
    are_two.then_some(first)
}

/// Whether a track is at one place at a time.
fn is_in_order(track: &RawTrack) -> bool {
    track.rows.windows(2).all(|two| two[0].time < two[1].time)
}

/// Whether two names are ids of one tracker, which differ in their numbers only: `track_1` and `track_6`.
fn are_ids(one: &str, other: &str) -> bool {
    let words = |name: &str| name.replace(|c: char| c.is_ascii_digit(), "");
    words(one) == words(other) && one.ends_with(|c: char| c.is_ascii_digit())
}

/// Returns the track that a piece continues: one that has ended, near its beginning.
fn continued(tracks: &[RawTrack], heads: &[usize], piece: &RawTrack) -> Option<usize> {
    let first = piece.seen().next().filter(|_| is_in_order(piece))?;
    let ends: Vec<(usize, &Row)> = heads
        .iter()
        .filter_map(|head| Some((*head, tracks[*head].rows.iter().rfind(|row| !row.is_gap())?)))
        .filter(|(_, end)| end.time < first.time)
        .collect();
    let (head, end) = ends.iter().min_by(|a, b| a.1.distance(*first).total_cmp(&b.1.distance(*first)))?;
    let is_nearer =
        ends.iter().all(|(other, far)| other == head || end.distance(*first) < NEARER * far.distance(*first));
    let speed = |two: &[Row]| two[0].distance(two[1]) / (two[1].time - two[0].time);
    let fastest = heads.iter().flat_map(|head| tracks[*head].rows.windows(2)).map(speed);
    // gaps are not numbers, which no maximum is
    let reach = FASTER * fastest.fold(0.0, f64::max) * (first.time - end.time);
    let is_id = are_ids(&tracks[*head].name, &piece.name);
    (is_id && is_nearer && end.distance(*first) <= reach).then_some(*head)
}
