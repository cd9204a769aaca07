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

/// A fault of a shot, and its line if there is one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Wrong {
    pub(crate) line: Option<usize>,
    pub(crate) message: String,
    /// Whether the camera or the tracker damaged only this shot, which can be left out; otherwise
    /// the file or dataset.toml is wrong.
    pub(crate) is_damage: bool,
}

impl Wrong {
    pub(super) fn input(line: impl Into<Option<usize>>, message: impl Into<String>) -> Self {
        Self { line: line.into(), message: message.into(), is_damage: false }
    }

    pub(super) fn damaged(line: impl Into<Option<usize>>, message: impl Into<String>) -> Self {
        Self { is_damage: true, ..Self::input(line, message) }
    }
}

/// Turns places that programs write for a lost ball into gaps, unless the ball's path leads there.
pub(super) fn remove_lost(tracks: &mut [RawTrack], log: Log) {
    let is_lost = |row: &Row| is_known(row.place());
    let are_positions = |track: &&mut RawTrack| !track.is_angle;
    let tracks: Vec<&mut RawTrack> = tracks.iter_mut().filter(are_positions).collect();
    if !tracks.iter().any(|track| track.seen().any(is_lost)) {
        return;
    }
    let mut speeds = Vec::new();
    for track in &tracks {
        let seen: Vec<&Row> = track.seen().collect();
        let steps = seen.windows(2).map(|two| [*two[0], *two[1]]);
        let good = steps.filter(|[a, b]| b.time > a.time && !is_lost(a) && !is_lost(b));
        speeds.extend(good.map(|[a, b]| a.distance(b) / (b.time - a.time)));
    }
    let speeds = sorted(speeds.into_iter());
    let Some(fast) = speeds.get((SPEED_QUANTILE * speeds.len() as f64) as usize) else { return };
    for RawTrack { name, rows, .. } in tracks.into_iter().filter(|_| *fast > 0.0) {
        let jumps = |a: &Row, b: &Row| a.distance(*b) > MIN_LOST_JUMP * fast * (b.time - a.time);
        let mut seen: Vec<&mut Row> = rows.iter_mut().filter(|row| !row.is_gap()).collect();
        let mut from = 0;
        while from < seen.len() {
            let place = seen[from].place();
            let stay = seen[from..].iter().take_while(|row| row.place() == place).count();
            let until = from + stay;
            let before = from.checked_sub(1).map(|i| jumps(seen[i], seen[from]));
            let after = seen.get(until).map(|next| jumps(seen[until - 1], next));
            let is_far = before.or(after).is_some() && before != Some(false) && after != Some(false);
            for row in seen[from..until].iter_mut().filter(|_| is_far && is_known(place)) {
                let [x, y] = place;
                let message = format!("\"{name}\" is at ({x}, {y}), far from its path: taken as a gap");
                log.add(Subject::Gaps, row.line, message);
                row.lose();
            }
            from = until;
        }
    }
}

/// Returns whether programs write this place for a lost ball: 0, 0, or −1, −1, or 9999.
fn is_known([x, y]: [f64; 2]) -> bool {
    let are_nines = |value: f64| {
        let digits = format!("{:.0}", value.abs());
        value.fract() == 0.0 && digits.len() > 2 && digits.bytes().all(|digit| digit == b'9')
    };
    x == y && (x == 0.0 || x == -1.0 || are_nines(x))
}

/// Puts tracks on one grid of frames: in the order of time, a row for each time of any track, a gap
/// if a track is not seen then.
pub(super) fn put_on_grid(tracks: &mut [RawTrack], log: Log) -> Result<(), Wrong> {
    let mut times = sorted(tracks.iter().flat_map(|track| &track.rows).map(|row| row.time));
    times.dedup();
    for RawTrack { name, rows, .. } in tracks {
        let backwards = rows.windows(2).filter(|two| two[1].time < two[0].time);
        let backwards: Vec<[Row; 2]> = backwards.map(|two| [two[0], two[1]]).collect();
        let clip = backwards.first().map(|[before, next]| {
            let message = format!(
                "time of \"{name}\" runs backwards, from {:.6} s to {:.6} s; expected each clip as a shot of its own",
                before.time, next.time
            );
            Wrong::input(next.line, message)
        });
        // a clock that starts again: another clip, or times that wrap around
        let is_second = backwards.len() == 1 && rows.len() > 2 && rows[rows.len() - 1].time < rows[0].time;
        if let Some(clip) = clip.clone().filter(|_| is_second) {
            return Err(clip);
        }
        let mut grid: Vec<Row> = times.iter().map(|time| Row::new(*time, [f64::NAN; 2], 0)).collect();
        for row in rows.drain(..) {
            let known = &mut grid[times.partition_point(|time| *time < row.time)];
            if known.line == 0 {
                *known = row;
                continue;
            }
            if !known.is_gap() && !row.is_gap() && known.place() != row.place() {
                let message = format!(
                    "\"{name}\" is at two places at {:.6} s: ({}, {}) here and ({}, {}) in line {}; expected one",
                    row.time, row.x, row.y, known.x, known.y, known.line
                );
                return Err(clip.unwrap_or(Wrong::input(row.line, message)));
            }
            let message =
                format!("\"{name}\" has its time twice (line {}); one row is passed over", known.line);
            log.add(Subject::Repeated, row.line, message);
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

/// Returns the range of the middle nine tenths of values.
fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let values = sorted(values);
    [0.05, 0.95].map(|part| values.get((part * values.len() as f64) as usize).copied().unwrap_or(f64::NAN))
}

/// Turns rows at impossible places or times into gaps: lost decimal points, misprints.
pub(super) fn remove_outliers(tracks: &mut [RawTrack], log: Log) {
    let seen = || tracks.iter().filter(|track| !track.is_angle).flat_map(|track| track.seen());
    let [xs, ys, times] =
        [range(seen().map(|row| row.x)), range(seen().map(|row| row.y)), range(seen().map(|row| row.time))];
    let width = (xs[1] - xs[0]).max(ys[1] - ys[0]);
    let is_off = |value: f64, [low, high]: [f64; 2], most: f64| value < low - most || value > high + most;
    for RawTrack { name, rows, .. } in tracks.iter_mut().filter(|track| !track.is_angle) {
        for row in rows.iter_mut() {
            let is_far = is_off(row.x, xs, MAX_RANGES * width) || is_off(row.y, ys, MAX_RANGES * width);
            if is_far || is_off(row.time, times, MAX_DELAY_RANGES * (times[1] - times[0])) && !row.is_gap() {
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
    let both = cue.rows.iter().zip(&object.rows);
    let seen = both.enumerate().filter(|(_, (cue, object))| !cue.is_gap() && !object.is_gap());
    seen.map(|(frame, _)| frame).collect()
}

/// Turns frames into gaps that repeat the frame before while both balls move. `resolution`: the step
/// of the coordinates, within which balls may move without being seen to.
pub(super) fn remove_repeated_frames(
    cue: &mut RawTrack,
    object: &mut RawTrack,
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
        let duration = |k: usize| {
            let time = |k: usize| cue.rows[frames[k]].time;
            ((time(k + 1) - time(k)) * fps).max(1.0)
        };
        let [line, known] = [first + 1, first].map(|k| cue.rows[frames[k]].line);
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
    cue: &mut RawTrack,
    object: &mut RawTrack,
    fps: f64,
    log: Log,
) -> Result<Option<usize>, Wrong> {
    let frames = frames_of_both(cue, object);
    let mut swaps: Vec<usize> = Vec::new();
    for two in frames.windows(2) {
        let [[c, o], [c_next, o_next]] = [0, 1].map(|k| [cue.rows[two[k]], object.rows[two[k]]]);
        if (c_next.time - c.time) * fps > MAX_SWAP_FRAMES {
            continue;
        }
        let kept = c.distance(c_next).powi(2) + o.distance(o_next).powi(2);
        let swapped = c.distance(o_next).powi(2) + o.distance(c_next).powi(2);
        if swapped < CERTAIN_SWAP * kept {
            swaps.push(two[1]);
        } else if swapped < POSSIBLE_SWAP * kept {
            let message = "cue and object ball may have exchanged their names from here on; expected them set right, or the shot skipped";
            return Err(Wrong::damaged(c_next.line, message));
        }
    }
    let line = |frame: usize| cue.rows[frame].line;
    let first = swaps.first().map(|first| line(*first));
    for pair in swaps.chunks(2) {
        let last = pair.get(1).map_or(String::new(), |until| format!(" to line {}", line(*until)));
        let message = format!(
            "\"{}\" and \"{}\" have exchanged their names from here{last}; exchanged back",
            cue.name, object.name
        );
        log.add(Subject::Swapped, line(pair[0]), message);
    }
    for pair in swaps.chunks(2) {
        let until = pair.get(1).copied().unwrap_or(cue.rows.len());
        cue.rows[pair[0]..until].swap_with_slice(&mut object.rows[pair[0]..until]);
    }
    Ok(first)
}
