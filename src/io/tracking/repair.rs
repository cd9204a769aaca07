//! Faults between the camera and the file: lost balls, duplicate rows, rows out of order, repeated
//! frames, exchanged names of balls. They are repaired if the repair is certain.

use super::input::{Log, Subject};
use super::raw::{RawShot, RawTrack, Row, sorted};

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

/// Makes gaps of the positions that programs write for a lost ball, unless the ball's path leads
/// there, and of impossible places and times: a lost decimal point, a misprint.
pub(super) fn remove_lost(shot: &mut RawShot, log: Log) {
    let times = &shot.times;
    let paths = shot.tracks.iter().map(|track| track.seen().filter(|_| !track.is_angle).collect());
    let paths: Vec<Vec<(usize, &Row)>> = paths.collect();
    // the ranges of the middle nine tenths of x, y and time
    let values = |(frame, row): &(usize, &Row)| [row.place[0], row.place[1], times[*frame]];
    let ranges = [0, 1, 2].map(|k| {
        let good = paths.iter().flatten().filter(|(_, row)| !row.is_placeholder());
        let all = sorted(good.map(|row| values(row)[k]));
        [0.05, 0.95].map(|part| value_at(&all, part).unwrap_or(f64::NAN))
    });
    let [x, y, t] = ranges.map(|[low, high]| high - low);
    let reach = [MAX_RANGES * x.max(y), MAX_RANGES * x.max(y), MAX_DELAY_RANGES * t];
    let is_off = |row: &(usize, &Row), k: usize| {
        let ([low, high], value) = (ranges[k], values(row)[k]);
        value < low - reach[k] || value > high + reach[k]
    };
    let is_doubtful = |row: &(usize, &Row)| row.1.is_placeholder() || (0..3).any(|k| is_off(row, k));
    if !paths.iter().flatten().any(is_doubtful) {
        return;
    }
    let speed = |two: &[(usize, &Row)]| two[0].1.distance(two[1].1) / (times[two[1].0] - times[two[0].0]);
    let good = paths.iter().flat_map(|path| path.windows(2)).filter(|two| !two.iter().any(is_doubtful));
    let speeds = sorted(good.map(speed).filter(|speed| speed.is_finite()));
    let fast = value_at(&speeds, SPEED_QUANTILE).filter(|fast| *fast > 0.0).unwrap_or(f64::INFINITY);
    let jumps = |two: &[(usize, &Row)]| speed(two) > MIN_LOST_JUMP * fast;
    let mut lost: Vec<(usize, usize, &str)> = Vec::new();
    for (i, path) in paths.iter().enumerate() {
        let mut until = 0;
        for stay in path.chunk_by(|a, b| a.1.place == b.1.place) {
            let from = until;
            until += stay.len();
            let before = from.checked_sub(1).map(|before| jumps(&path[before..=from]));
            let after = path.get(until - 1..=until).map(jumps);
            let mut ends = [before, after].into_iter().flatten();
            let is_away = before.or(after).is_some() && ends.all(|jumps| jumps);
            let is_placeholder = stay[0].1.is_placeholder();
            for row in stay {
                if is_off(row, 2) {
                    lost.push((i, row.0, "at a time far from all others"));
                } else if if is_placeholder { is_away } else { is_off(row, 0) || is_off(row, 1) } {
                    lost.push((i, row.0, "far from its path"));
                }
            }
        }
    }
    for (i, frame, why) in lost {
        let RawTrack { name, rows, .. } = &mut shot.tracks[i];
        let Row { place: [x, y], line, .. } = rows[frame];
        log.add(Subject::Gaps, line, format!("\"{name}\" is at ({x}, {y}), {why}: taken as a gap"));
        rows[frame].lose();
    }
}

impl Row {
    /// Returns whether programs write this place for a lost ball: 0, 0, or −1, −1, or 9999.
    fn is_placeholder(&self) -> bool {
        let [x, y] = self.place;
        let digits = || format!("{:.0}", x.abs());
        let are_nines = || digits().len() > 2 && digits().bytes().all(|digit| digit == b'9');
        x == y && (x == 0.0 || x == -1.0 || x.fract() == 0.0 && are_nines())
    }
}

/// Unites frames of one time. Notes rows that are not in the order of time.
///
/// # Errors
/// A track at two places at one time, or a clock that starts again: another clip, or times that wrap
/// around.
pub(super) fn unite_frames(shot: &mut RawShot, log: Log) -> Result<(), Wrong> {
    let times = &shot.times;
    let mut firsts: Vec<usize> = (0..times.len()).collect();
    for frame in (1..times.len()).filter(|frame| times[*frame] == times[frame - 1]) {
        firsts[frame] = firsts[frame - 1];
    }
    for RawTrack { name, rows, .. } in &mut shot.tracks {
        let mut written: Vec<usize> = (0..rows.len()).filter(|frame| rows[*frame].line > 0).collect();
        written.sort_by_key(|frame| rows[*frame].line);
        let backwards: Vec<&[usize]> =
            written.windows(2).filter(|two| times[two[1]] < times[two[0]]).collect();
        let clip = backwards.first().map(|two| {
            let message = format!(
                "time of \"{name}\" runs backwards, from {:.6} s to {:.6} s; expected each clip as a shot of its own",
                times[two[0]], times[two[1]]
            );
            Wrong::input(rows[two[1]].line, message)
        });
        let is_second = written.len() > 2 && times[written[written.len() - 1]] < times[written[0]];
        if let Some(clip) = clip.clone().filter(|_| backwards.len() == 1 && is_second) {
            return Err(clip);
        }
        for frame in 0..rows.len() {
            let first = firsts[frame];
            let (known, row) = (rows[first], rows[frame]);
            if first == frame || row.line == 0 {
                continue;
            }
            if !known.is_gap() && !row.is_gap() && known.place != row.place {
                let message = format!(
                    "\"{name}\" is at two places at {:.6} s: ({}, {}) here and ({}, {}) in line {}; expected one",
                    times[frame], row.place[0], row.place[1], known.place[0], known.place[1], known.line
                );
                return Err(clip.unwrap_or(Wrong::input(row.line, message)));
            }
            let message =
                format!("\"{name}\" has its time twice (line {}); one row is passed over", known.line);
            log.add(Subject::Repeated, row.line, message);
            if known.is_gap() {
                rows[first] = row;
            }
        }
        if let Some(Wrong { line, .. }) = clip {
            let message = format!("the rows of \"{name}\" are not in the order of time; put in order");
            log.add(Subject::Order, line, message);
        }
        let mut frames = 0..;
        rows.retain(|_| frames.next().is_some_and(|frame| firsts[frame] == frame));
    }
    shot.times.dedup();
    Ok(())
}

/// Returns the frames in which both balls are seen.
fn frames_of_both(cue: &RawTrack, object: &RawTrack) -> Vec<usize> {
    let both = cue.rows.iter().zip(&object.rows).enumerate();
    both.filter(|(_, (cue, object))| !cue.is_gap() && !object.is_gap()).map(|(frame, _)| frame).collect()
}

/// Turns frames into gaps that repeat the frame before while both balls move; `times` are those of
/// the frames in units of one. `resolution`: the step of the coordinates, within which balls may
/// move without being seen to.
pub(super) fn remove_repeated_frames(
    [cue, object]: &mut [RawTrack; 2],
    times: &[f64],
    resolution: f64,
    log: Log,
) -> Result<(), Wrong> {
    let frames = frames_of_both(cue, object);
    let step = |two: &[usize]| {
        let step = |track: &RawTrack| track.rows[two[0]].distance(&track.rows[two[1]]);
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
        let duration = |k: usize| (times[frames[k + 1]] - times[frames[k]]).max(1.0);
        let [known, line] = [first, first + 1].map(|k| cue.rows[frames[k]].line);
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

/// Undoes identity swaps of a tracker; returns the line of the first one. `times` are those of the
/// frames in units of one.
pub(super) fn undo_swaps(
    [cue, object]: &mut [RawTrack; 2],
    times: &[f64],
    log: Log,
) -> Result<Option<usize>, Wrong> {
    let mut swaps: Vec<usize> = Vec::new();
    for two in frames_of_both(cue, object).windows(2) {
        let [[c, o], [c_next, o_next]] = [0, 1].map(|k| [&cue.rows[two[k]], &object.rows[two[k]]]);
        let kept = c.distance(c_next).powi(2) + o.distance(o_next).powi(2);
        let swapped = c.distance(o_next).powi(2) + o.distance(c_next).powi(2);
        if times[two[1]] - times[two[0]] > MAX_SWAP_FRAMES {
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
