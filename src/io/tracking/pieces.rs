//! Joining of tracks whose ids change when a tracker loses a ball, as at the impact.

use super::finish::find;
use super::raw::{NAMES, Notes, RawShot, RawTrack, Row, sorted};
use super::settings::TrackSettings;

/// Largest ratio of a ball's speed to the fastest one before: after the impact no ball is faster,
/// and the rest allows for the noise of a short step.
const MAX_SPEED_RATIO: f64 = 2.0;

/// Largest ratio of the distances to the ends of the nearest and of the other track at which a
/// piece continues the nearest.
const MAX_DISTANCE_RATIO: f64 = 0.5;

/// Joins pieces to both balls' tracks: those that dataset.toml names or, if at most two tracks are
/// seen at a time, the first two. Pieces that continue neither track are left.
pub(super) fn join(shot: &mut RawShot, settings: &TrackSettings, notes: &Notes) {
    let RawShot { tracks, file, .. } = shot;
    let is_plain = |track: &RawTrack| track.point.is_none() && !track.is_angle && !track.rows.is_empty();
    if tracks.len() < 3 || !tracks.iter().all(is_plain) {
        return;
    }
    let mut order: Vec<usize> = (0..tracks.len()).collect();
    order.sort_by(|a, b| tracks[*a].rows[0].time.total_cmp(&tracks[*b].rows[0].time));
    let Some(heads) = heads(tracks, &order, settings) else { return };
    if !heads.iter().all(|head| is_in_order(&tracks[*head])) {
        return;
    }
    for piece in order.into_iter().filter(|i| !heads.contains(i)) {
        let Some(head) = continued(tracks, heads, &tracks[piece]) else { continue };
        let piece = std::mem::replace(&mut tracks[piece], RawTrack::new("", None));
        let track = &mut tracks[head];
        let message = format!(
            "\"{}\" begins where \"{}\" ends, in line {}: taken as the same ball",
            piece.name,
            track.name,
            track.rows.last().map_or(1, |row| row.line)
        );
        notes.of(file).add(NAMES, piece.rows[0].line, message);
        track.rows.extend(piece.rows);
    }
    tracks.retain(|track| !track.rows.is_empty());
}

/// Returns the indices of the tracks to which pieces are joined; `order` is that of their starts.
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

/// Returns whether two names are ids that differ in numbers only: `track_1` and `track_6`.
fn are_ids(one: &str, other: &str) -> bool {
    let words = |name: &str| name.replace(|c: char| c.is_ascii_digit(), "");
    words(one) == words(other) && one.ends_with(|c: char| c.is_ascii_digit())
}

/// Returns the track that a piece continues: one that has ended, near its beginning.
fn continued(tracks: &[RawTrack], heads: [usize; 2], piece: &RawTrack) -> Option<usize> {
    let first = *piece.seen().next().filter(|_| is_in_order(piece))?;
    let end = |head: usize| {
        let end = tracks[head].seen().last().filter(|end| end.time < first.time)?;
        Some((head, end, end.distance(first)))
    };
    let mut ends: Vec<(usize, &Row, f64)> = heads.into_iter().filter_map(end).collect();
    ends.sort_by(|a, b| a.2.total_cmp(&b.2));
    let (head, end, distance) = *ends.first()?;
    let is_nearer = ends.get(1).is_none_or(|(.., far)| distance < MAX_DISTANCE_RATIO * far);
    let speed = |two: &[Row]| two[0].distance(two[1]) / (two[1].time - two[0].time);
    let fastest = heads.iter().flat_map(|head| tracks[*head].rows.windows(2)).map(speed);
    // gaps are not numbers, which no maximum is
    let reach = MAX_SPEED_RATIO * fastest.fold(0.0, f64::max) * (first.time - end.time);
    let is_id = are_ids(&tracks[head].name, &piece.name);
    (is_id && is_nearer && distance <= reach).then_some(head)
}
