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
    let first = |tracks: &[RawTrack], i: usize| tracks[i].rows[0].time;
    let mut loose: Vec<usize> = (0..shot.tracks.len()).collect();
    loose.sort_by(|a, b| first(&shot.tracks, *a).total_cmp(&first(&shot.tracks, *b)));
    let Some(heads) = heads(&shot.tracks, &loose, settings) else { return };
    if !heads.iter().all(|head| is_in_order(&shot.tracks[*head])) {
        return;
    }
    for piece in loose.into_iter().filter(|i| !heads.contains(i)) {
        let Some(head) = continued(&shot.tracks, heads, &shot.tracks[piece]) else { continue };
        let piece = std::mem::replace(&mut shot.tracks[piece], RawTrack::new("", None));
        let track = &mut shot.tracks[head];
        let message = format!(
            "\"{}\" begins where \"{}\" ends, in line {}: taken as the same ball",
            piece.name,
            track.name,
            track.rows.last().map_or(1, |row| row.line)
        );
        notes.of(&shot.file).add(NAMES, piece.rows[0].line, message);
        track.rows.extend(piece.rows);
    }
    shot.tracks.retain(|track| !track.rows.is_empty());
}

/// Returns the indices of the tracks that pieces may be joined to, of tracks in this order of their
/// beginnings.
fn heads(tracks: &[RawTrack], order: &[usize], settings: &TrackSettings) -> Option<[usize; 2]> {
    let find = |name: &str| find(tracks, name).ok().flatten();
    if let Some([Some(cue), Some(object)]) = settings.single_names().map(|names| names.map(find)) {
        return Some([cue, object]);
    }
    let times = sorted(tracks.iter().flat_map(|track| track.rows.iter().map(|row| row.time)));
    let are_two = times.chunk_by(|a, b| a == b).all(|rows| rows.len() <= 2);
    are_two.then(|| [order[0].min(order[1]), order[0].max(order[1])])
}

/// Returns whether a track is at one place at a time.
fn is_in_order(track: &RawTrack) -> bool {
    track.rows.windows(2).all(|two| two[0].time < two[1].time)
}

/// Returns whether two names are ids of one tracker, which differ in their numbers only: `track_1`
/// and `track_6`.
fn are_ids(one: &str, other: &str) -> bool {
    let words = |name: &str| name.replace(|c: char| c.is_ascii_digit(), "");
    words(one) == words(other) && one.ends_with(|c: char| c.is_ascii_digit())
}

/// Returns the track that a piece continues: one that has ended, near its beginning.
fn continued(tracks: &[RawTrack], heads: [usize; 2], piece: &RawTrack) -> Option<usize> {
    let first = piece.seen().next().filter(|_| is_in_order(piece))?;
    let end = |head: usize| tracks[head].seen().last().filter(|end| end.time < first.time);
    let mut ends: Vec<(usize, &Row)> =
        heads.into_iter().filter_map(|head| Some((head, end(head)?))).collect();
    ends.sort_by(|a, b| a.1.distance(*first).total_cmp(&b.1.distance(*first)));
    let (head, end) = *ends.first()?;
    let is_nearer = ends.get(1).is_none_or(|(_, far)| end.distance(*first) < NEARER * far.distance(*first));
    let speed = |two: &[Row]| two[0].distance(two[1]) / (two[1].time - two[0].time);
    let fastest = heads.iter().flat_map(|head| tracks[*head].rows.windows(2)).map(speed);
    // gaps are not numbers, which no maximum is
    let reach = FASTER * fastest.fold(0.0, f64::max) * (first.time - end.time);
    let is_id = are_ids(&tracks[head].name, &piece.name);
    (is_id && is_nearer && end.distance(*first) <= reach).then_some(head)
}
