//! Faults between the camera and the file: lost balls, duplicate rows, rows out of order, repeated
//! frames, exchanged names of balls. They are repaired if the repair is certain.

use super::input::{Log, Subject};
use super::raw::{RawTrack, Row, sorted};

/// Ratio of a jump away from the path to the fastest steps of the balls in the same time.
const MIN_LOST_JUMP: f64 = 5.0;
/// Fraction of the steps, from the slowest on, that give the balls' speed: others may be wrong.
const SPEED_QUANTILE: f64 = 0.9;
/// Least ratio of the step after a frame in which both balls stand still to the step before it at
/// which the frame is a repeated one: the lost frame's motion is then in the step.
const MIN_CATCH_UP: f64 = 1.5;
/// Ratio to the step of coarse coordinates below which a ball may move without being seen to.
const MAX_COARSE: f64 = 4.0;
/// Ratios of the squared jumps with the names exchanged to those without. One ball's wrong position
/// can make it 1/2, not less.
const CERTAIN_SWAP: f64 = 0.1;
const POSSIBLE_SWAP: f64 = 0.3;
/// Longest step, frames, in which a jump can show that names were exchanged.
const MAX_SWAP_FRAMES: f64 = 3.5;
/// Largest distances of a position and of a time from nearly all others, in their ranges.
const MAX_RANGES: f64 = 8.0;
const MAX_DELAY_RANGES: f64 = 100.0;

/// A fault of a shot, and its line.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Wrong {
    pub(crate) line: usize,
    pub(crate) message: String,
    /// Whether the camera or the tracker damaged only this shot, which can be left out; otherwise
    /// the file or dataset.toml is wrong.
    pub(crate) is_damage: bool,
}

impl Wrong {
    pub(super) fn input(line: usize, message: impl Into<String>) -> Self {
        Self { line, message: message.into(), is_damage: false }
    }

    pub(super) fn damaged(line: usize, message: impl Into<String>) -> Self {
        Self { is_damage: true, ..Self::input(line, message) }
    }
}

fn value_at(sorted: &[f64], part: f64) -> Option<f64> {
    sorted.get((part * sorted.len() as f64) as usize).copied()
}

/// Turns places that programs write for a lost ball into gaps, unless the ball's path leads there.
pub(super) fn remove_lost(tracks: &mut [RawTrack], log: Log) {
    let tracks: Vec<&mut RawTrack> = tracks.iter_mut().filter(|track| !track.is_angle).collect();
    if !tracks.iter().any(|track| track.seen().any(Row::is_placeholder)) {
        return;
    }
    let mut speeds = Vec::new();
    for track in &tracks {
        let seen: Vec<&Row> = track.seen().collect();
        let good = seen.windows(2).filter(|two| two[1].time > two[0].time);
        let good = good.filter(|two| !two.iter().any(|row| row.is_placeholder()));
        speeds.extend(good.map(|two| two[0].distance(*two[1]) / (two[1].time - two[0].time)));
    }
    let fast = value_at(&sorted(speeds.into_iter()), SPEED_QUANTILE).filter(|fast| *fast > 0.0);
    let Some(fast) = fast else { return };
    for RawTrack { name, rows, .. } in tracks {
        let seen: Vec<Row> = rows.iter().filter(|row| !row.is_gap()).copied().collect();
        let jumps =
            |two: &[Row]| two[0].distance(two[1]) > MIN_LOST_JUMP * fast * (two[1].time - two[0].time);
        let mut until = 0;
        let mut lost = Vec::new();
        for stay in seen.chunk_by(|a, b| a.place() == b.place()) {
            let from = until;
            until += stay.len();
            let before = from.checked_sub(1).map(|i| jumps(&seen[i..=from]));
            let after = seen.get(until - 1..=until).map(jumps);
            let mut ends = [before, after].into_iter().flatten();
            if stay[0].is_placeholder() && before.or(after).is_some() && ends.all(|jumps| jumps) {
                lost.extend_from_slice(stay);
            }
        }
        let mut lost = lost.into_iter().peekable();
        for row in rows.iter_mut() {
            if lost.next_if(|other| other.line == row.line).is_some() {
                let message =
                    format!("\"{name}\" is at ({}, {}), far from its path: taken as a gap", row.x, row.y);
                log.add(Subject::Gaps, row.line, message);
                row.lose();
            }
        }
    }
}

impl Row {
    /// Returns whether programs write this place for a lost ball: 0, 0, or −1, −1, or 9999.
    fn is_placeholder(&self) -> bool {
        let digits = || format!("{:.0}", self.x.abs());
        let are_nines = || digits().len() > 2 && digits().bytes().all(|digit| digit == b'9');
        self.x == self.y && (self.x == 0.0 || self.x == -1.0 || self.x.fract() == 0.0 && are_nines())
    }
}

/// Puts tracks on one grid of frames: in the order of time, a row for each time of any track, a gap
/// if a track is not seen then.
pub(super) fn put_on_grid(tracks: &mut [RawTrack], log: Log) -> Result<(), Wrong> {
    let mut times = sorted(tracks.iter().flat_map(|track| &track.rows).map(|row| row.time));
    times.dedup();
    for RawTrack { name, rows, .. } in tracks {
        let mut backwards = rows.windows(2).filter(|two| two[1].time < two[0].time);
        let first = backwards.next().map(|two| [two[0], two[1]]);
        let clip = first.map(|[before, next]| {
            let message = format!(
                "time of \"{name}\" runs backwards, from {:.6} s to {:.6} s; expected each clip as a shot of its own",
                before.time, next.time
            );
            Wrong::input(next.line, message)
        });
        // a clock that starts again: another clip, or times that wrap around
        let is_second = rows.len() > 2 && rows[rows.len() - 1].time < rows[0].time;
        if let Some(clip) = clip.clone().filter(|_| backwards.next().is_none() && is_second) {
            return Err(clip);
        }
        let mut grid: Vec<Row> = times.iter().map(|time| Row::new(*time, [f64::NAN; 2], 0)).collect();
        for row in rows.drain(..) {
            let known = &mut grid[times.partition_point(|time| *time < row.time)];
            if known.line > 0 && !known.is_gap() && !row.is_gap() && known.place() != row.place() {
                let message = format!(
                    "\"{name}\" is at two places at {:.6} s: ({}, {}) here and ({}, {}) in line {}; expected one",
                    row.time, row.x, row.y, known.x, known.y, known.line
                );
                return Err(clip.unwrap_or(Wrong::input(row.line, message)));
            }
            if known.line > 0 {
                let message =
                    format!("\"{name}\" has its time twice (line {}); one row is passed over", known.line);
                log.add(Subject::Repeated, row.line, message);
            }
            if known.is_gap() {
                *known = row;
            }
        }
        if let Some(Wrong { line, .. }) = clip {
            let message = format!("the rows of \"{name}\" are not in the order of time; put in order");
            log.add(Subject::Order, line, message);
        }
        *rows = grid;
    }
    Ok(())
}

/// Turns rows at impossible places or times into gaps: lost decimal points, misprints.
pub(super) fn remove_outliers(tracks: &mut [RawTrack], log: Log) {
    // the range of the middle nine tenths
    let range = |value: fn(&Row) -> f64| {
        let seen = tracks.iter().filter(|track| !track.is_angle).flat_map(|track| track.seen());
        let values = sorted(seen.map(value));
        [0.05, 0.95].map(|part| value_at(&values, part).unwrap_or(f64::NAN))
    };
    let [xs, ys, times] = [range(|row| row.x), range(|row| row.y), range(|row| row.time)];
    let width = (xs[1] - xs[0]).max(ys[1] - ys[0]);
    let is_off = |value: f64, [low, high]: [f64; 2], most: f64| value < low - most || value > high + most;
    for RawTrack { name, rows, .. } in tracks.iter_mut().filter(|track| !track.is_angle) {
        for row in rows.iter_mut().filter(|row| !row.is_gap()) {
            let is_far = is_off(row.x, xs, MAX_RANGES * width) || is_off(row.y, ys, MAX_RANGES * width);
            if is_far || is_off(row.time, times, MAX_DELAY_RANGES * (times[1] - times[0])) {
                let message = format!(
                    "\"{name}\" is at an impossible place or time ({:.6} s, {:.6e}, {:.6e}): taken as a gap",
                    row.time, row.x, row.y
                );
                log.add(Subject::Gaps, row.line, message);
                row.lose();
            }
        }
    }
}

/// Returns the frames of a grid in which both balls are seen.
fn frames_of_both(cue: &RawTrack, object: &RawTrack) -> Vec<usize> {
    let is_seen = |frame: &usize| !cue.rows[*frame].is_gap() && !object.rows[*frame].is_gap();
    (0..cue.rows.len().min(object.rows.len())).filter(is_seen).collect()
}

/// Turns frames into gaps that repeat the frame before while both balls move. `resolution`: the
/// step of the coordinates, within which balls may move without being seen to.
pub(super) fn remove_repeated_frames(
    [cue, object]: &mut [RawTrack; 2],
    fps: f64,
    resolution: f64,
    log: Log,
) -> Result<(), Wrong> {
    let frames = frames_of_both(cue, object);
    let step = |two: &[usize]| {
        let step = |track: &RawTrack| track.rows[two[0]].distance(track.rows[two[1]]);
        step(cue).max(step(object))
    };
    let steps: Vec<f64> = frames.windows(2).map(step).collect();
    if steps.iter().filter(|step| **step == 0.0).count() * 5 > steps.len() {
        return Ok(());
    }
    let mut end = 0;
    for still in steps.chunk_by(|a, b| (*a == 0.0) == (*b == 0.0)) {
        let first = end;
        end += still.len();
        if still[0] != 0.0 || first == 0 {
            continue;
        }
        let (Some(after), before) = (steps.get(end), steps[first - 1]) else { break };
        if before.min(*after) < MAX_COARSE * resolution {
            continue;
        }
        let row = |k: usize| cue.rows[frames[k]];
        let duration = |k: usize| ((row(k + 1).time - row(k).time) * fps).max(1.0);
        let (line, known) = (row(first + 1).line, row(first).line);
        let both = format!(
            "both balls are exactly where they were in line {known} while they move before and after"
        );
        if after / duration(end) < MIN_CATCH_UP * before / duration(first - 1) {
            let message = format!(
                "{both}, and do not catch up: a frame was put in here, and all later times may be late. Expected the clip without it, \
                 with the frames after it renumbered; or skip the shot"
            );
            return Err(Wrong::damaged(line, message));
        }
        log.add(Subject::Repeated, line, format!("{both}: a repeated frame, taken as a gap"));
        for k in &frames[first + 1..=end] {
            cue.rows[*k].lose();
            object.rows[*k].lose();
        }
    }
    Ok(())
}

/// Undoes identity swaps of a tracker; returns the line of the first one.
pub(super) fn undo_swaps(
    [cue, object]: &mut [RawTrack; 2],
    fps: f64,
    log: Log,
) -> Result<Option<usize>, Wrong> {
    let mut swaps: Vec<usize> = Vec::new();
    for two in frames_of_both(cue, object).windows(2) {
        let [[c, o], [c_next, o_next]] = [0, 1].map(|k| [cue.rows[two[k]], object.rows[two[k]]]);
        let kept = c.distance(c_next).powi(2) + o.distance(o_next).powi(2);
        let swapped = c.distance(o_next).powi(2) + o.distance(c_next).powi(2);
        if (c_next.time - c.time) * fps > MAX_SWAP_FRAMES {
            continue;
        }
        if swapped < CERTAIN_SWAP * kept {
            swaps.push(two[1]);
        } else if swapped < POSSIBLE_SWAP * kept {
            let message = "cue and object ball may have exchanged their names from here on; expected them set right, or the shot skipped";
            return Err(Wrong::damaged(c_next.line, message));
        }
    }
    let lines: Vec<usize> = swaps.iter().map(|frame| cue.rows[*frame].line).collect();
    for (pair, lines) in swaps.chunks(2).zip(lines.chunks(2)) {
        let last = lines.get(1).map_or(String::new(), |until| format!(" to line {until}"));
        let message = format!(
            "\"{}\" and \"{}\" have exchanged their names from here{last}; exchanged back",
            cue.name, object.name
        );
        log.add(Subject::Swapped, lines[0], message);
        let until = pair.get(1).copied().unwrap_or(cue.rows.len());
        cue.rows[pair[0]..until].swap_with_slice(&mut object.rows[pair[0]..until]);
    }
    Ok(lines.first().copied())
}
