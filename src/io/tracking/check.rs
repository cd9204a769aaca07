//! What goes wrong between the camera and the file: rows twice, rows out of order, frames that repeat,
//! balls that change names. Mended where the right repair is certain.

use std::ops::Range;

use super::raw::{GAPS, Log, ORDER, REPEATED, RawTrack, Row, SWAPPED, sorted};

/// A frame in which both balls stand still while they move before and after is a repeated one if the
/// step after it is at least this many times the step before: the lost frame's motion is then in it.
const CATCHES_UP: f64 = 1.5;
/// Steps shorter than this many of the smallest ones are those of coarse coordinates.
const COARSE: f64 = 4.0;
/// Squared jumps with the names exchanged, over those with the names as they are. One ball's stray
/// position can make it 1/2, never less.
const SURELY_SWAPPED: f64 = 0.1;
const PERHAPS_SWAPPED: f64 = 0.3;

/// What is wrong with a shot, and the line where there is one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Wrong {
    pub line: Option<usize>,
    pub message: String,
    /// Camera or tracker damaged this shot only: others can do without it. Else the file or dataset.toml is wrong.
    pub is_damage: bool,
}

impl Wrong {
    pub(super) fn input(line: impl Into<Option<usize>>, message: impl Into<String>) -> Self {
        Self { line: line.into(), message: message.into(), is_damage: false }
    }

    pub(super) fn damaged(line: impl Into<Option<usize>>, message: impl Into<String>) -> Self {
        Self { is_damage: true, ..Self::input(line, message) }
    }
}

/// Puts the rows of a track in the order of time, each time once.
pub(super) fn order(track: &mut RawTrack, log: Log) -> Result<(), Wrong> {
    let backwards = track.rows.windows(2).filter(|two| two[1].time < two[0].time).count();
    if backwards > 0 {
        let at = track.rows.windows(2).position(|two| two[1].time < two[0].time).unwrap_or(0);
        let (before, next) = (track.rows[at], track.rows[at + 1]);
        let sorted = in_order(track);
        // a clock that begins anew: another clip, or times that were counted only so far
        let (first, second) = track.rows.split_at(at + 1);
        let begins_anew = backwards == 1
            && track.rows.len() > 2
            && second.last().is_some_and(|last| last.time < first[0].time);
        let places = |two: &[Row]| two[0].time == two[1].time && [two[0].x, two[0].y] != [two[1].x, two[1].y];
        if begins_anew
            || sorted.rows.windows(2).any(|two| places(two) && !two[0].is_gap() && !two[1].is_gap())
        {
            let message = format!(
                "time of \"{}\" runs backwards, from {:.6} s (line {}) to {:.6} s; expected the rows of one clip, in any \
                 order, and each clip as a shot of its own",
                track.name, before.time, before.line, next.time
            );
            return Err(Wrong::input(next.line, message));
        }
        let how =
            if backwards + 1 == track.rows.len() { "run backwards" } else { "are not in the order of time" };
        *track = sorted;
        let message = format!("the rows of \"{}\" {how}; put in the order of time", track.name);
        log.add(ORDER, next.line, message);
    }
    let rows = &mut track.rows;
    if rows.windows(2).all(|two| two[0].time < two[1].time) {
        return Ok(());
    }
    let mut keep = vec![true; rows.len()];
    let mut last = 0;
    for i in 1..rows.len() {
        let (a, b) = (rows[last], rows[i]);
        if a.time < b.time {
            last = i;
            continue;
        }
        let same = a.x == b.x && a.y == b.y;
        if !(same || a.is_gap() || b.is_gap()) {
            let message = format!(
                "\"{}\" is at two places at {:.6} s: ({}, {}) here and ({}, {}) in line {}; expected one row per \
                 ball and frame",
                track.name, b.time, b.x, b.y, a.x, a.y, a.line
            );
            return Err(Wrong::input(b.line, message));
        }
        let message =
            format!("\"{}\" has its time twice (line {}); one row is passed over", track.name, a.line);
        log.add(REPEATED, b.line, message);
        if a.is_gap() {
            keep[last] = false;
            last = i;
        } else {
            keep[i] = false;
        }
    }
    retain(track, &keep);
    Ok(())
}

/// The same track with its rows in the order of time; those with the same time stay in the order of the file.
fn in_order(track: &RawTrack) -> RawTrack {
    let mut order: Vec<usize> = (0..track.rows.len()).collect();
    order.sort_by(|a, b| track.rows[*a].time.total_cmp(&track.rows[*b].time));
    let rows = order.iter().map(|i| track.rows[*i]).collect();
    let sds = if track.sds.is_empty() { Vec::new() } else { order.iter().map(|i| track.sds[*i]).collect() };
    RawTrack { name: track.name.clone(), point: track.point.clone(), is_angle: track.is_angle, rows, sds }
}

/// A ball is not this many times as far away from one row to the next as nearly all positions are from each other.
const FAR: f64 = 8.0;
/// Nor is a frame this many times as late as the film is long.
const LATE: f64 = 100.0;

/// The range of nearly all values: of the middle nine tenths.
fn range(values: impl Iterator<Item = f64>) -> f64 {
    let values = sorted(values);
    let at = |part: f64| values.get((part * values.len() as f64) as usize).copied().unwrap_or(f64::NAN);
    at(0.95) - at(0.05)
}

/// Turns rows into gaps that are by themselves at an impossible place or time: a lost decimal point, a slip of the pen.
pub(super) fn stray(tracks: &mut [RawTrack], log: Log) {
    let seen = || tracks.iter().filter(|track| !track.is_angle).flat_map(|track| track.seen());
    let width = range(seen().map(|row| row.x)).max(range(seen().map(|row| row.y)));
    let length = range(seen().map(|row| row.time));
    let steps = tracks.iter().flat_map(|track| track.rows.windows(2));
    let steps = sorted(steps.map(|two| two[1].time - two[0].time));
    let step = steps.get(steps.len() / 2).copied().unwrap_or(f64::NAN);
    for track in tracks.iter_mut().filter(|track| !track.is_angle) {
        let at: Vec<usize> = (0..track.rows.len()).filter(|i| !track.rows[*i].is_gap()).collect();
        if at.len() < 5 {
            continue;
        }
        let rows: Vec<Row> = at.iter().map(|i| track.rows[*i]).collect();
        for (k, row) in rows.iter().enumerate() {
            // of a row at the end the two next to it, one of which may be the stray one
            let beside = match k {
                0 => [1, 2],
                _ if k + 1 == rows.len() => [k - 1, k - 2],
                _ => [k - 1, k + 1],
            };
            let beside = beside.map(|i| rows[i]);
            let far = beside.iter().all(|other| other.distance(*row) > FAR * width);
            let least =
                beside.iter().map(|other| (other.time - row.time).abs()).fold(f64::INFINITY, f64::min);
            // frame -18 where all others count from 0
            let before = k == 0 && row.time < 0.0 && rows[1].time >= 0.0 && least > 3.0 * step;
            if far || before || least > LATE * length {
                let wrong = if far { "place" } else { "time" };
                let message = format!(
                    "\"{}\" is by itself at an impossible {wrong} ({:.6} s, {:.6e}, {:.6e} in the file's unit): taken as a gap",
                    track.name, row.time, row.x, row.y
                );
                log.add(GAPS, row.line, message);
                track.rows[at[k]].lose();
            }
        }
    }
}

/// Drops rows.
fn retain(track: &mut RawTrack, keep: &[bool]) {
    let mut kept = keep.iter();
    track.rows.retain(|_| *kept.next().unwrap_or(&true));
    let mut kept = keep.iter();
    track.sds.retain(|_| *kept.next().unwrap_or(&true));
}

/// Rows of both tracks at the same times, neither a gap: their indices.
fn pairs(cue: &[Row], object: &[Row]) -> Vec<(usize, usize)> {
    let mut pairs = Vec::with_capacity(cue.len().min(object.len()));
    let (mut i, mut j) = (0, 0);
    while let (Some(a), Some(b)) = (cue.get(i), object.get(j)) {
        if a.time < b.time || a.is_gap() && a.time == b.time {
            i += 1;
            j += usize::from(a.time == b.time);
        } else if b.time < a.time || b.is_gap() {
            j += 1;
            i += usize::from(a.time == b.time);
        } else {
            pairs.push((i, j));
            (i, j) = (i + 1, j + 1);
        }
    }
    pairs
}

/// Turns repeated frames into gaps.
pub(super) fn thaw(cue: &mut RawTrack, object: &mut RawTrack, fps: f64, log: Log) -> Result<(), Wrong> {
    let pairs = pairs(&cue.rows, &object.rows);
    let step = |k: usize| {
        let ((i, j), (p, q)) = (pairs[k], pairs[k + 1]);
        cue.rows[i].distance(cue.rows[p]).max(object.rows[j].distance(object.rows[q]))
    };
    let steps: Vec<f64> = (0..pairs.len().saturating_sub(1)).map(step).collect();
    let smallest = steps.iter().copied().filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min);
    let frames = |k: usize| (cue.rows[pairs[k + 1].0].time - cue.rows[pairs[k].0].time) * fps;
    let mut frozen = Vec::new();
    let mut k = 1;
    while k + 1 < steps.len() {
        if steps[k] != 0.0 {
            k += 1;
            continue;
        }
        let first = k;
        while k < steps.len() && steps[k] == 0.0 {
            k += 1;
        }
        // still to the end, or too coarse to tell
        let (Some(after), before) = (steps.get(k), steps[first - 1]) else { break };
        let coarse = smallest.is_finite() && before.min(*after) < COARSE * smallest;
        let only_coarse = steps.iter().filter(|step| **step == 0.0).count() * 5 > steps.len();
        if before == 0.0 || coarse && smallest > 1e-6 * before.max(*after) && is_coarse(&steps) || only_coarse
        {
            continue;
        }
        let length = |k: usize| frames(k).max(1.0);
        let line = cue.rows[pairs[first + 1].0].line;
        if after / length(k) < CATCHES_UP * before / length(first - 1) {
            let message = format!(
                "both balls are exactly where they were in line {} while they move before and after, and do not \
                 catch up: a frame was put in here, and all later times may be late. Expected the clip without it, \
                 with the frames after it renumbered; or skip the shot",
                cue.rows[pairs[first].0].line
            );
            return Err(Wrong::damaged(line, message));
        }
        frozen.extend(first + 1..=k);
        let message = format!(
            "both balls are exactly where they were in line {} while they move before and after: a repeated frame, \
             taken as a gap",
            cue.rows[pairs[first].0].line
        );
        log.add(REPEATED, line, message);
    }
    for (i, j) in frozen.into_iter().map(|k| pairs[k]) {
        (cue.rows[i].x, object.rows[j].x) = (f64::NAN, f64::NAN);
    }
    Ok(())
}

/// Whether steps come in few sizes only, as those of whole pixels do.
fn is_coarse(steps: &[f64]) -> bool {
    let mut sizes = sorted(steps.iter().copied());
    sizes.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * b.abs());
    sizes.len() * 2 < steps.len()
}

/// Gives both balls their names back where a tracker exchanged them, and the line of the first time.
pub(super) fn unswap(
    cue: &mut RawTrack,
    object: &mut RawTrack,
    fps: f64,
    log: Log,
) -> Result<Option<usize>, Wrong> {
    let pairs = pairs(&cue.rows, &object.rows);
    let mut swaps = Vec::new();
    for k in 1..pairs.len() {
        let ((i, j), (p, q)) = (pairs[k - 1], pairs[k]);
        let (c, o, c_next, o_next) = (cue.rows[i], object.rows[j], cue.rows[p], object.rows[q]);
        if (c_next.time - c.time) * fps > 3.5 {
            continue;
        }
        let cost = |a: f64, b: f64| a * a + b * b;
        let kept = cost(c.distance(c_next), o.distance(o_next));
        let swapped = cost(c.distance(o_next), o.distance(c_next));
        let line = c_next.line;
        if swapped < SURELY_SWAPPED * kept {
            swaps.push(k);
        } else if swapped < PERHAPS_SWAPPED * kept {
            let message = format!(
                "cue and object ball may have exchanged their names from here on (\"{}\" jumps by {:.4}, \"{}\" by \
                 {:.4}, in the file's unit); expected them set right, or the shot skipped",
                cue.name,
                c.distance(c_next),
                object.name,
                o.distance(o_next)
            );
            return Err(Wrong::damaged(line, message));
        }
    }
    let first = swaps.first().map(|k| cue.rows[pairs[*k].0].line);
    for pair in swaps.chunks(2) {
        let from = pairs[pair[0]];
        let until = pair.get(1).map(|k| pairs[*k]);
        let time = cue.rows[from.0].time;
        let end = until.map_or(f64::INFINITY, |(i, _)| cue.rows[i].time);
        let line = cue.rows[from.0].line;
        let last = until.map_or(String::new(), |(i, _)| format!(" to line {}", cue.rows[i].line));
        exchange(cue, object, time, end);
        let message = format!(
            "\"{}\" and \"{}\" have exchanged their names from here{last}; exchanged back",
            cue.name, object.name
        );
        log.add(SWAPPED, line, message);
    }
    Ok(first)
}

/// Exchanges the rows of two tracks from a time until before another.
fn exchange(one: &mut RawTrack, other: &mut RawTrack, from: f64, until: f64) {
    let range = |track: &RawTrack| {
        let at = |time: f64| track.rows.partition_point(|row| row.time < time);
        at(from)..at(until)
    };
    let (a, b) = (range(one), range(other));
    if !(one.sds.is_empty() && other.sds.is_empty()) {
        // Only one of them may have deviations, where the other is the mean of several points.
        for track in [&mut *one, &mut *other] {
            track.sds.resize(track.rows.len(), [f64::NAN; 2]);
        }
        exchange_parts(&mut one.sds, a.clone(), &mut other.sds, b.clone());
    }
    exchange_parts(&mut one.rows, a, &mut other.rows, b);
}

fn exchange_parts<T: Copy>(one: &mut Vec<T>, a: Range<usize>, other: &mut Vec<T>, b: Range<usize>) {
    let moved = one[a.clone()].to_vec();
    let replaced: Vec<T> = other.splice(b, moved).collect();
    one.splice(a, replaced);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The other ball is the mean of several points: nothing is stated of it.
    #[test]
    fn deviations_that_one_ball_alone_has_move_with_its_rows() {
        let mut one = RawTrack::new("a", None);
        let mut other = RawTrack::new("b", None);
        for k in 0..4 {
            let row = Row { time: f64::from(k), x: 0.0, y: 0.0, line: 1 };
            one.rows.push(row);
            one.sds.push([f64::from(k); 2]);
            other.rows.push(Row { x: 1.0, ..row });
        }
        exchange(&mut one, &mut other, 2.0, 3.0);
        for track in [&one, &other] {
            for (k, row) in track.rows.iter().enumerate() {
                let stated = track.sds[k][0];
                assert!(if row.x == 0.0 { stated == row.time } else { stated.is_nan() });
            }
        }
        assert_eq!(one.rows[2].x, 1.0);
    }
}
