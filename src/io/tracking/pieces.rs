//! Which rows are one ball in one clip: clips in a table without a column of shots are separated,
//! rows that do not name the ball are followed, and pieces of tracks with new ids are joined.

use super::names::find;
use super::raw::{Job, RawShot, RawTrack, Row, Subject, jump_speed};
use super::repair::remove_lost;
use super::settings::TrackSettings;
use crate::numerics::median;

/// Least pause between clips, s, and in median steps of time.
const MIN_PAUSE_S: f64 = 1.0;
const STEPS: f64 = 20.0;
/// Frame rate if it is not known, frames/s.
const DEFAULT_FPS: f64 = 240.0;
/// Least number of frames of both balls in a clip.
const MIN_FRAMES: usize = 6;
/// Largest ratio of a ball's speed to the fastest before, which allows for noise of short steps.
const MAX_SPEED_RATIO: f64 = 2.0;
/// Largest ratio of the distances to the nearest end and the other at which a piece continues it.
const MAX_DISTANCE_RATIO: f64 = 0.5;

/// Returns the shots of a file: positions of lost balls are left out, one shot that is several
/// clips is separated, and pieces of tracks are joined. `alone`: the names of clips are their
/// numbers, without the file's name.
pub(super) fn clips(mut shots: Vec<RawShot>, alone: bool, job: Job) -> Vec<RawShot> {
    for shot in &mut shots {
        remove_lost(shot, job);
    }
    // names of shots in the table are believed
    if let [shot] = shots.as_slice() {
        let clips: Vec<RawShot> = clips_of(shot, job.settings.fps(), alone);
        let is_seen = |track: &&RawTrack| track.seen().count() >= MIN_FRAMES;
        let are_clips = clips.iter().all(|clip| clip.tracks.iter().filter(is_seen).count() > 1);
        if clips.len() > 1 && are_clips {
            let names: Vec<&str> = clips.iter().map(|clip| clip.name.as_str()).collect();
            let message = format!(
                "holds {} clips, separated by jumps of the time or of both balls: taken as the shots {}; expected a column shot if that is wrong",
                clips.len(),
                names.join(", ")
            );
            job.note(Subject::Names, None, message);
            shots = clips;
        }
    }
    for shot in &mut shots {
        name_followed(shot, job.settings);
        join(shot, job);
    }
    shots
}

/// Returns the clips of a shot: each begins after a long pause, or where both balls jump.
fn clips_of(shot: &RawShot, fps: Option<f64>, alone: bool) -> Vec<RawShot> {
    // without a unit, ms and frames cannot be distinguished
    let Some(unit) = shot.stated.time else { return Vec::new() };
    let fps = shot.stated.fps.or(fps).unwrap_or(DEFAULT_FPS);
    let times = shot.times();
    let step = median(times.windows(2).map(|two| two[1] - two[0]).collect());
    let pause = (MIN_PAUSE_S / unit.seconds().unwrap_or(fps.recip())).max(STEPS * step);
    let is_short = |time: f64| time > 0.0 && time < 1.5 * step;
    let centres = shot.centres();
    let steps = centres.iter().flatten().flat_map(|track| track.steps());
    let jump = step * jump_speed(steps.filter(|[_, time]| is_short(*time)));
    let jumps = |two: &[f64]| {
        let Some([one, other]) = centres else { return false };
        let is_far = |from: &RawTrack, to: &RawTrack| {
            from.at(two[0]).zip(to.at(two[1])).is_some_and(|(from, to)| from.distance(to) > jump)
        };
        is_far(one, one) && is_far(other, other) && is_far(one, other)
    };
    let begins = |two: &&[f64]| {
        let length = two[1] - two[0];
        length > pause || is_short(length) && jumps(two)
    };
    let begins: Vec<f64> = times.windows(2).filter(begins).map(|two| two[1]).collect();
    let clip = |i: usize| {
        let name = if alone { format!("{}", i + 1) } else { format!("{}-{}", shot.name, i + 1) };
        let mut clip = RawShot { name, ..shot.clone() };
        for track in &mut clip.tracks {
            track.rows.retain(|row| begins.partition_point(|begin| *begin <= row.time) == i);
        }
        clip.tracks.retain(|track| !track.rows.is_empty());
        clip.line = clip.tracks.iter().map(RawTrack::line).min().unwrap_or(shot.line);
        clip
    };
    if begins.is_empty() { Vec::new() } else { (0..=begins.len()).map(clip).collect() }
}

/// Splits the rows of every shot into the tracks of two balls, named when clips are separated.
pub(super) fn follow(shots: &mut [RawShot], job: Job) {
    for shot in shots {
        let rows: Vec<Row> = shot.tracks.iter().flat_map(RawTrack::seen).copied().collect();
        let (mut tracks, mut others) = (vec![RawTrack::default(); 2], Vec::new());
        for frame in rows.chunk_by(|a, b| a.time == b.time) {
            let found = nearest([0, 1].map(|ball: usize| tracks[ball].rows.last()), frame);
            others.extend((0..frame.len()).filter(|i| !found.contains(&Some(*i))).map(|i| frame[i].line));
            for (track, row) in tracks.iter_mut().zip(found) {
                track.rows.extend(row.map(|row| frame[row]));
            }
        }
        if let Some(first) = others.first() {
            let are = if others.len() == 1 { "row" } else { "rows" };
            let message = format!("{} {are} of other objects than the two balls: left out", others.len());
            job.note(Subject::Gaps, *first, message);
        }
        shot.tracks = tracks;
    }
    let message = "rows do not name the ball: both balls are followed from frame to frame, and the one that moves first is the cue ball";
    job.note(Subject::Names, None, message);
}

/// Names the tracks that were followed: the first to move is the cue ball.
fn name_followed(shot: &mut RawShot, settings: &TrackSettings) {
    if shot.tracks.len() != 2 || shot.tracks.iter().any(|track| !track.name.is_empty()) {
        return;
    }
    let [one, other] = [0, 1].map(|i| shot.beginning(&shot.tracks[i]));
    if other.zip(one).is_some_and(|(other, one)| other < one) {
        shot.tracks.reverse();
    }
    for (track, name) in shot.tracks.iter_mut().zip(settings.first_names()) {
        track.name = name.to_string();
    }
}

/// Returns the rows of a frame nearest to two balls: the sum of both steps is least.
fn nearest(last: [Option<&Row>; 2], frame: &[Row]) -> [Option<usize>; 2] {
    let [Some(one), Some(other)] = last else {
        return if frame.len() == 2 { [Some(0), Some(1)] } else { [None; 2] };
    };
    if let [row] = frame {
        return if one.distance(row) < other.distance(row) { [Some(0), None] } else { [None, Some(0)] };
    }
    let way = |(i, j): &(usize, usize)| one.distance(&frame[*i]) + other.distance(&frame[*j]);
    let pairs = (0..frame.len()).flat_map(|i| (0..frame.len()).map(move |j| (i, j)));
    let least = pairs.filter(|(i, j)| i != j).min_by(|a, b| way(a).total_cmp(&way(b)));
    least.map_or([None; 2], |(i, j)| [Some(i), Some(j)])
}

/// Joins pieces to both balls' tracks, as named or, if two at most are seen at a time, the first.
fn join(shot: &mut RawShot, job: Job) {
    let is_plain = |track: &RawTrack| track.is_centre() && !track.rows.is_empty();
    if shot.tracks.len() < 3 || !shot.tracks.iter().all(is_plain) {
        return;
    }
    let begin = |i: &usize| shot.tracks[*i].rows.first().map_or(0.0, |row| row.time);
    let mut order: Vec<usize> = (0..shot.tracks.len()).collect();
    order.sort_by(|a, b| begin(a).total_cmp(&begin(b)));
    let Some(heads) = heads(shot, &order, job.settings) else { return };
    if !heads.iter().all(|head| is_in_order(&shot.tracks[*head])) {
        return;
    }
    for piece in order.into_iter().filter(|i| !heads.contains(i)) {
        let Some(head) = continued(&shot.tracks, heads, &shot.tracks[piece]) else { continue };
        let piece = std::mem::take(&mut shot.tracks[piece]);
        let track = &mut shot.tracks[head];
        let last = track.rows.last().map_or(1, |row| row.line);
        let message = format!(
            "\"{}\" begins where \"{}\" ends, in line {last}: taken as the same ball",
            piece.name, track.name
        );
        job.note(Subject::Names, piece.line(), message);
        track.rows.extend(piece.rows);
        track.sort();
    }
    shot.tracks.retain(|track| !track.rows.is_empty());
}

/// Returns the tracks to which pieces are joined; `order` is that of their starts.
fn heads(shot: &RawShot, order: &[usize], settings: &TrackSettings) -> Option<[usize; 2]> {
    let find = |name: &str| find(&shot.tracks, name).ok().flatten();
    if let Some([Some(cue), Some(object)]) = settings.single_names().map(|names| names.map(find)) {
        return Some([cue, object]);
    }
    let count = |time: f64| shot.tracks.iter().filter(|track| track.at(time).is_some()).count();
    let are_two = shot.times().into_iter().all(|time| count(time) <= 2);
    are_two.then(|| [order[0].min(order[1]), order[0].max(order[1])])
}

fn is_in_order(track: &RawTrack) -> bool {
    track.rows.windows(2).all(|two| two[0].time < two[1].time && two[0].line <= two[1].line)
}

/// Returns whether two names are ids that differ in numbers only: `track_1` and `track_6`.
fn are_ids(one: &str, other: &str) -> bool {
    let words = |name: &str| name.replace(|c: char| c.is_ascii_digit(), "");
    words(one) == words(other) && one.ends_with(|c: char| c.is_ascii_digit())
}

/// Returns the track that a piece continues: one that has ended, near its beginning.
fn continued(tracks: &[RawTrack], heads: [usize; 2], piece: &RawTrack) -> Option<usize> {
    let first = piece.seen().next().filter(|_| is_in_order(piece))?;
    let end = |head: usize| {
        let last = tracks[head].seen().last().filter(|last| last.time < first.time)?;
        Some((head, last.step(first)))
    };
    let mut ends: Vec<(usize, [f64; 2])> = heads.into_iter().filter_map(end).collect();
    ends.sort_by(|a, b| a.1[0].total_cmp(&b.1[0]));
    let (head, [distance, time]) = *ends.first()?;
    let is_nearer = ends.get(1).is_none_or(|(_, [far, _])| distance < MAX_DISTANCE_RATIO * far);
    let steps = heads.iter().flat_map(|head| tracks[*head].steps());
    let fastest = steps.map(|[length, time]| length / time).fold(0.0, f64::max);
    let is_id = are_ids(&tracks[head].name, &piece.name);
    (is_id && is_nearer && distance <= MAX_SPEED_RATIO * fastest * time).then_some(head)
}
