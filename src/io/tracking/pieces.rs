//! Which rows are one ball in one clip: clips in a table without a column of shots are separated,
//! rows that do not name the ball are followed, and pieces of tracks with new ids are joined.

use std::collections::{HashMap, HashSet};

use super::discs::beginning;
use super::input::{Input, Log, Subject};
use super::names::find;
use super::raw::{RawShot, RawTrack, Row, middle, sorted};
use super::repair::remove_lost;
use super::settings::TrackSettings;

/// Least pause between clips, s, and in median steps of time.
const MIN_PAUSE_S: f64 = 1.0;
const STEPS: f64 = 20.0;
/// Frame rate if it is not known, frames/s.
const DEFAULT_FPS: f64 = 240.0;
/// Jump of both balls between clips, in units of the 90th percentile of their steps.
const MIN_CLIP_JUMP: f64 = 8.0;
/// Least number of frames of both balls in a clip.
const MIN_FRAMES: usize = 6;
/// Largest ratio of a ball's speed to the fastest one before: after the impact no ball is faster,
/// and the rest allows for the noise of a short step.
const MAX_SPEED_RATIO: f64 = 2.0;
/// Largest ratio of the distances to the ends of the nearest and of the other track at which a
/// piece continues the nearest.
const MAX_DISTANCE_RATIO: f64 = 0.5;

/// Returns the shots of a file: positions of lost balls are left out, and one shot that is several
/// clips is separated. `alone`: the names of clips are their numbers, without the file's name.
pub(super) fn clips(
    mut shots: Vec<RawShot>,
    settings: &TrackSettings,
    alone: bool,
    log: Log,
) -> Vec<RawShot> {
    for shot in &mut shots {
        remove_lost(&mut shot.tracks, log);
    }
    // names of shots in the table are believed
    if let [shot] = shots.as_slice()
        && let cuts = cuts(shot, settings.fps())
        && !cuts.is_empty()
    {
        let clips: Vec<RawShot> = (0..=cuts.len()).map(|number| clip(shot, &cuts, number, alone)).collect();
        let is_seen = |track: &&RawTrack| track.seen().count() >= MIN_FRAMES;
        if clips.iter().all(|clip| clip.tracks.iter().filter(is_seen).count() > 1) {
            let names: Vec<&str> = clips.iter().map(|clip| clip.name.as_str()).collect();
            let message = format!(
                "holds {} clips, separated by jumps of the time or of both balls: taken as the shots {}; expected a column shot if that is wrong",
                clips.len(),
                names.join(", ")
            );
            log.add(Subject::Names, None, message);
            shots = clips;
        }
    }
    for shot in &mut shots {
        name_followed(shot, settings);
    }
    shots
}

/// Returns the times at which further clips begin.
fn cuts(shot: &RawShot, fps: Option<f64>) -> Vec<f64> {
    // without a unit, ms and frames cannot be distinguished
    let Some(unit) = shot.clock.unit else { return Vec::new() };
    let fps = shot.clock.fps.or(fps).unwrap_or(DEFAULT_FPS);
    let second = unit.seconds().unwrap_or(fps.recip());
    let times = shot.times();
    let Some(step) = middle(times.windows(2).map(|two| two[1] - two[0])) else { return Vec::new() };
    let pause = (MIN_PAUSE_S / second).max(STEPS * step);
    let jumps = jumps(shot, step);
    let begins = |two: &[f64]| two[1] - two[0] > pause || jumps.contains(&two[1].to_bits());
    times.windows(2).filter(|two| begins(two)).map(|two| two[1]).collect()
}

/// Returns the bits of the times to which both balls jump, except exchanges of their names.
fn jumps(shot: &RawShot, step: f64) -> HashSet<u64> {
    let Some(centres) = shot.centres() else { return HashSet::new() };
    let follows = |[before, now]: &[Row; 2]| {
        let length = now.time - before.time;
        length > 0.0 && length < 1.5 * step && !before.is_gap() && !now.is_gap()
    };
    let [one, other] = centres.map(|track| {
        let steps = track.rows.windows(2).map(|two| [two[0], two[1]]).filter(follows);
        steps.map(|step| (step[1].time.to_bits(), step)).collect::<HashMap<u64, [Row; 2]>>()
    });
    let all = sorted(one.values().chain(other.values()).map(|[before, now]| before.distance(*now)));
    let Some(long) = all.get(all.len() * 9 / 10).filter(|long| **long > 0.0) else { return HashSet::new() };
    let is_far = |a: Row, b: Row| a.distance(b) > MIN_CLIP_JUMP * long;
    let is_jump = |time: &&u64| {
        let ([from, to], Some([other_from, other_to])) = (one[*time], other.get(*time)) else { return false };
        is_far(from, to) && is_far(*other_from, *other_to) && is_far(from, *other_to)
    };
    one.keys().filter(is_jump).copied().collect()
}

fn clip(shot: &RawShot, cuts: &[f64], number: usize, alone: bool) -> RawShot {
    let is_part = |row: &Row| cuts.partition_point(|cut| *cut <= row.time) == number;
    let mut clip = shot.clone();
    clip.tracks.iter_mut().for_each(|track| track.rows.retain(is_part));
    clip.tracks.retain(|track| !track.rows.is_empty());
    clip.name = if alone { format!("{}", number + 1) } else { format!("{}-{}", shot.name, number + 1) };
    clip.line = clip.tracks.iter().map(RawTrack::line).min().unwrap_or(shot.line);
    clip
}

/// Splits the rows of every shot, one track without a name, into the tracks of two balls, which
/// have no name until clips are separated.
pub(super) fn follow(shots: &mut [RawShot], input: &Input) {
    for shot in shots {
        let mut rows: Vec<Row> = shot.tracks.iter().flat_map(|track| track.seen().copied()).collect();
        rows.sort_by(|a, b| a.time.total_cmp(&b.time));
        let mut tracks = [RawTrack::default(), RawTrack::default()];
        let mut others = Vec::new();
        for frame in rows.chunk_by(|a, b| a.time == b.time) {
            let found = nearest(tracks.each_ref().map(|track| track.rows.last()), frame);
            others.extend((0..frame.len()).filter(|i| !found.contains(&Some(*i))).map(|i| frame[i].line));
            for (track, row) in tracks.iter_mut().zip(found) {
                track.rows.extend(row.map(|row| frame[row]));
            }
        }
        if let Some(first) = others.first() {
            let are = if others.len() == 1 { "row" } else { "rows" };
            let message = format!("{} {are} of other objects than the two balls: left out", others.len());
            input.log.add(Subject::Gaps, *first, message);
        }
        shot.tracks = tracks.into();
    }
    let message = "rows do not name the ball: both balls are followed from frame to frame, and the one that moves first is the cue ball";
    input.log.add(Subject::Names, None, message);
}

/// Names the tracks that were followed: the first to move is the cue ball.
fn name_followed(shot: &mut RawShot, settings: &TrackSettings) {
    if shot.tracks.len() != 2 || shot.tracks.iter().any(|track| !track.name.is_empty()) {
        return;
    }
    let [one, other] = [0, 1].map(|i| beginning(&shot.tracks[i], &shot.tracks));
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
        return if one.distance(*row) < other.distance(*row) { [Some(0), None] } else { [None, Some(0)] };
    }
    let way = |(i, j): &(usize, usize)| one.distance(frame[*i]) + other.distance(frame[*j]);
    let pairs = (0..frame.len()).flat_map(|i| (0..frame.len()).map(move |j| (i, j)));
    let least = pairs.filter(|(i, j)| i != j).min_by(|a, b| way(a).total_cmp(&way(b)));
    least.map_or([None; 2], |(i, j)| [Some(i), Some(j)])
}

/// Joins pieces to both balls' tracks: those that dataset.toml names or, if at most two tracks are
/// seen at a time, the first two. Other pieces are left.
pub(super) fn join(shot: &mut RawShot, settings: &TrackSettings, log: Log) {
    let tracks = &mut shot.tracks;
    let is_plain = |track: &RawTrack| track.is_centre() && !track.rows.is_empty();
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
        let piece = std::mem::take(&mut tracks[piece]);
        let track = &mut tracks[head];
        let last = track.rows.last().map_or(1, |row| row.line);
        let message = format!(
            "\"{}\" begins where \"{}\" ends, in line {last}: taken as the same ball",
            piece.name, track.name
        );
        log.add(Subject::Names, piece.rows[0].line, message);
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
