//! Faults between the camera and the file: lost balls, duplicate rows, rows out of order, repeated
//! frames, exchanged names of balls. They are repaired if the repair is certain.

use super::input::{Log, Subject};
use super::raw::{RawTrack, Row, middle, sorted};

/// Ratio of a jump away from the path to the fastest steps of the balls in the same time.
const MIN_LOST_JUMP: f64 = 5.0;
/// Fraction of the steps, from the slowest on, that give the balls' speed: others may be wrong.
const SPEED_QUANTILE: f64 = 0.9;
/// Least number of rows exactly at one place at which it may be that of a lost ball even if no
/// program is known to write it.
const MIN_REPEATS: usize = 3;
/// Least ratio of the step after a frame in which both balls stand still to the step before it at
/// which the frame is a repeated one: the lost frame's motion is then in the step.
const MIN_CATCH_UP: f64 = 1.5;
/// Ratio to the smallest step below which steps may come from coarse coordinates.
const MAX_COARSE: f64 = 4.0;
/// Ratios of the squared jumps with the names exchanged to those without. One ball's wrong position
/// can make it 1/2, not less.
const CERTAIN_SWAP: f64 = 0.1;
const POSSIBLE_SWAP: f64 = 0.3;
/// Longest step, frames, in which a jump can show that names were exchanged.
const MAX_SWAP_FRAMES: f64 = 3.5;
/// Largest step between rows, in ranges of nearly all positions.
const MAX_STEP_RANGES: f64 = 8.0;
/// Latest time of a frame, in ranges of nearly all times.
const MAX_DELAY: f64 = 100.0;

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

/// The rows of a track without gaps, in the order of time, and possible places of a lost ball:
/// repeated exactly, or such as programs are known to write.
struct Path {
    rows: Vec<usize>,
    places: Vec<[f64; 2]>,
}

/// Turns positions of lost balls into gaps: possible places far from the path.
pub(super) fn remove_lost(tracks: &mut [RawTrack], log: Log) {
    let paths: Vec<Path> = tracks.iter().map(Path::of).collect();
    if paths.iter().all(|path| path.places.is_empty()) {
        return;
    }
    let mut speeds = Vec::new();
    for (track, path) in tracks.iter().zip(&paths) {
        let steps = path.rows.windows(2).map(|two| [track.rows[two[0]], track.rows[two[1]]]);
        let is_lost = |row: &Row| path.places.contains(&row.place());
        let good = steps.filter(|two| two[1].time > two[0].time && !two.iter().any(is_lost));
        speeds.extend(good.map(|[a, b]| a.distance(b) / (b.time - a.time)));
    }
    let speeds = sorted(speeds.into_iter());
    let fast = speeds.get((SPEED_QUANTILE * speeds.len() as f64) as usize).filter(|speed| **speed > 0.0);
    let Some(fast) = fast.map(|speed| MIN_LOST_JUMP * speed) else { return };
    for (RawTrack { name, rows, .. }, path) in tracks.iter_mut().zip(&paths) {
        let (far, near): (Vec<_>, Vec<_>) =
            path.stays(rows, fast).into_iter().partition(|(_, is_far)| *is_far);
        let place = |stay: &[usize]| rows[stay[0]].place();
        let is_always_far = |at| near.iter().all(|(stay, _)| place(stay) != at);
        let is_lost = |(stay, _): &(&[usize], bool)| is_known(place(stay)) || is_always_far(place(stay));
        let lost: Vec<usize> = far.into_iter().filter(is_lost).flat_map(|(stay, _)| stay).copied().collect();
        for row in lost {
            let [x, y] = rows[row].place();
            let message = format!("\"{name}\" is at ({x}, {y}), far from its path: taken as a gap");
            log.add(Subject::Gaps, rows[row].line, message);
            rows[row].lose();
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

impl Path {
    fn of(track: &RawTrack) -> Self {
        let is_seen = |i: &usize| !track.is_angle && !track.rows[*i].is_gap();
        let mut rows: Vec<usize> = (0..track.rows.len()).filter(is_seen).collect();
        rows.sort_by(|a, b| track.rows[*a].time.total_cmp(&track.rows[*b].time));
        let mut places: Vec<[f64; 2]> = rows.iter().map(|i| track.rows[*i].place()).collect();
        places.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        let equal = places.chunk_by(|a, b| a == b);
        let equal = equal.filter(|equal| equal.len() >= MIN_REPEATS || is_known(equal[0]));
        Self { places: equal.map(|equal| equal[0]).collect(), rows }
    }

    /// Returns consecutive rows at each place of a lost ball, and whether the track jumps there and
    /// back faster than `fast`.
    fn stays(&self, rows: &[Row], fast: f64) -> Vec<(&[usize], bool)> {
        let jumps = |a: usize, b: usize| rows[a].distance(rows[b]) > fast * (rows[b].time - rows[a].time);
        let mut stays = Vec::new();
        let mut from: usize = 0;
        for stay in self.rows.chunk_by(|a, b| rows[*a].place() == rows[*b].place()) {
            let before = from.checked_sub(1).map(|i| jumps(self.rows[i], stay[0]));
            from += stay.len();
            let behind = self.rows.get(from).map(|next| jumps(stay[stay.len() - 1], *next));
            let is_far = before.or(behind).is_some() && before != Some(false) && behind != Some(false);
            if self.places.contains(&rows[stay[0]].place()) {
                stays.push((stay, is_far));
            }
        }
        stays
    }
}

fn are_torn(one: &Row, other: &Row) -> bool {
    one.time == other.time && !one.is_gap() && !other.is_gap() && one.place() != other.place()
}

/// Sorts the rows of a track by time, and merges those of equal times.
pub(super) fn order(track: &mut RawTrack, log: Log) -> Result<(), Wrong> {
    let RawTrack { name, rows, .. } = track;
    if rows.windows(2).all(|two| two[0].time < two[1].time) {
        return Ok(());
    }
    let backwards: Vec<usize> = (1..rows.len()).filter(|i| rows[*i].time < rows[*i - 1].time).collect();
    if let Some(at) = backwards.first() {
        let (before, next) = (rows[at - 1], rows[*at]);
        // a clock that starts again: another clip, or times that wrap around
        let is_second = backwards.len() == 1 && rows.len() > 2 && rows[rows.len() - 1].time < rows[0].time;
        rows.sort_by(|a, b| a.time.total_cmp(&b.time));
        if is_second || rows.windows(2).any(|two| are_torn(&two[0], &two[1])) {
            let message = format!(
                "time of \"{name}\" runs backwards, from {:.6} s to {:.6} s; expected each clip as a shot of its own",
                before.time, next.time
            );
            return Err(Wrong::input(next.line, message));
        }
        let message = format!("the rows of \"{name}\" are not in the order of time; put in order");
        log.add(Subject::Order, next.line, message);
    }
    let mut kept: Vec<Row> = Vec::with_capacity(rows.len());
    for row in rows.drain(..) {
        let Some(last) = kept.last_mut().filter(|last| last.time >= row.time) else {
            kept.push(row);
            continue;
        };
        if are_torn(last, &row) {
            let message = format!(
                "\"{name}\" is at two places at {:.6} s: ({}, {}) here and ({}, {}) in line {}; expected one",
                row.time, row.x, row.y, last.x, last.y, last.line
            );
            return Err(Wrong::input(row.line, message));
        }
        let message = format!("\"{name}\" has its time twice (line {}); one row is passed over", last.line);
        log.add(Subject::Repeated, row.line, message);
        if last.is_gap() {
            *last = row;
        }
    }
    *rows = kept;
    Ok(())
}

/// Returns the range of the middle nine tenths of values.
fn range(values: impl Iterator<Item = f64>) -> f64 {
    let values = sorted(values);
    let at = |part: f64| values.get((part * values.len() as f64) as usize).copied().unwrap_or(f64::NAN);
    at(0.95) - at(0.05)
}

/// Turns single rows at impossible places or times into gaps: lost decimal points, misprints.
pub(super) fn remove_outliers(tracks: &mut [RawTrack], log: Log) {
    let seen = || tracks.iter().filter(|track| !track.is_angle).flat_map(|track| track.seen());
    let width = range(seen().map(|row| row.x)).max(range(seen().map(|row| row.y)));
    let length = range(seen().map(|row| row.time));
    let steps = tracks.iter().flat_map(|track| track.rows.windows(2));
    let step = middle(steps.map(|two| two[1].time - two[0].time)).unwrap_or(f64::NAN);
    for RawTrack { name, rows, .. } in tracks.iter_mut().filter(|track| !track.is_angle) {
        let at: Vec<usize> = (0..rows.len()).filter(|i| !rows[*i].is_gap()).collect();
        if at.len() < 5 {
            continue;
        }
        let seen: Vec<Row> = at.iter().map(|i| rows[*i]).collect();
        for (k, row) in seen.iter().enumerate() {
            // beside a row at the end its two neighbours, one of which may be the wrong one
            let beside = match k {
                0 => [1, 2],
                _ if k + 1 == seen.len() => [k - 1, k - 2],
                _ => [k - 1, k + 1],
            };
            let beside = beside.map(|i| seen[i]);
            let is_far = beside.iter().all(|other| other.distance(*row) > MAX_STEP_RANGES * width);
            let [one, other] = beside.map(|other| (other.time - row.time).abs());
            // frame -18 if all others count from 0
            let is_before = k == 0 && row.time < 0.0 && seen[1].time >= 0.0 && one.min(other) > 3.0 * step;
            if is_far || is_before || one.min(other) > MAX_DELAY * length {
                let message = format!(
                    "\"{name}\" is by itself at an impossible place or time ({:.6} s, {:.6e}, {:.6e}): taken as a gap",
                    row.time, row.x, row.y
                );
                log.add(Subject::Gaps, row.line, message);
                rows[at[k]].lose();
            }
        }
    }
}

fn pairs(cue: &RawTrack, object: &RawTrack) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    let mut j = 0;
    for (i, row) in cue.rows.iter().enumerate().filter(|(_, row)| !row.is_gap()) {
        while object.rows.get(j).is_some_and(|other| other.time < row.time) {
            j += 1;
        }
        if object.rows.get(j).is_some_and(|other| other.time == row.time && !other.is_gap()) {
            pairs.push((i, j));
        }
    }
    pairs
}

pub(super) fn remove_repeated_frames(
    cue: &mut RawTrack,
    object: &mut RawTrack,
    fps: f64,
    log: Log,
) -> Result<(), Wrong> {
    let pairs = pairs(cue, object);
    let step = |two: &[(usize, usize)]| {
        let [(i, j), (p, q)] = [two[0], two[1]];
        cue.rows[i].distance(cue.rows[p]).max(object.rows[j].distance(object.rows[q]))
    };
    let steps: Vec<f64> = pairs.windows(2).map(step).collect();
    let smallest = steps.iter().copied().filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min);
    if steps.iter().filter(|step| **step == 0.0).count() * 5 > steps.len() {
        return Ok(());
    }
    let mut frozen = Vec::new();
    let mut end = 0;
    for still in steps.chunk_by(|a, b| (*a == 0.0) == (*b == 0.0)) {
        let first = end;
        end += still.len();
        if still[0] != 0.0 || first == 0 {
            continue;
        }
        // still until the end, or too coarse to decide
        let (Some(after), before) = (steps.get(end), steps[first - 1]) else { break };
        let is_small = smallest.is_finite() && before.min(*after) < MAX_COARSE * smallest;
        if is_small && smallest > 1e-6 * before.max(*after) && is_coarse(&steps) {
            continue;
        }
        let frames = |k: usize| {
            let time = |k: usize| cue.rows[pairs[k].0].time;
            ((time(k + 1) - time(k)) * fps).max(1.0)
        };
        let [line, known] = [first + 1, first].map(|k| cue.rows[pairs[k].0].line);
        let both = format!(
            "both balls are exactly where they were in line {known} while they move before and after"
        );
        if after / frames(end) < MIN_CATCH_UP * before / frames(first - 1) {
            let message = format!(
                "{both}, and do not catch up: a frame was put in here, and all later times may be late. Expected the clip without it, \
                 with the frames after it renumbered; or skip the shot"
            );
            return Err(Wrong::damaged(line, message));
        }
        frozen.extend(first + 1..=end);
        log.add(Subject::Repeated, line, format!("{both}: a repeated frame, taken as a gap"));
    }
    for (i, j) in frozen.into_iter().map(|k| pairs[k]) {
        cue.rows[i].lose();
        object.rows[j].lose();
    }
    Ok(())
}

fn is_coarse(steps: &[f64]) -> bool {
    let mut sizes = sorted(steps.iter().copied());
    sizes.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * b.abs());
    sizes.len() * 2 < steps.len()
}

/// Undoes identity swaps of a tracker; returns the line of the first one.
pub(super) fn undo_swaps(
    cue: &mut RawTrack,
    object: &mut RawTrack,
    fps: f64,
    log: Log,
) -> Result<Option<usize>, Wrong> {
    let mut swaps: Vec<Row> = Vec::new();
    for two in pairs(cue, object).windows(2) {
        let [(i, j), (p, q)] = [two[0], two[1]];
        let (c, o, c_next, o_next) = (cue.rows[i], object.rows[j], cue.rows[p], object.rows[q]);
        if (c_next.time - c.time) * fps > MAX_SWAP_FRAMES {
            continue;
        }
        let cost = |a: f64, b: f64| a * a + b * b;
        let kept = cost(c.distance(c_next), o.distance(o_next));
        let swapped = cost(c.distance(o_next), o.distance(c_next));
        if swapped < CERTAIN_SWAP * kept {
            swaps.push(c_next);
        } else if swapped < POSSIBLE_SWAP * kept {
            let message = "cue and object ball may have exchanged their names from here on; expected them set right, or the shot skipped";
            return Err(Wrong::damaged(c_next.line, message));
        }
    }
    for pair in swaps.chunks(2) {
        let until = pair.get(1);
        exchange(cue, object, pair[0].time, until.map_or(f64::INFINITY, |row| row.time));
        let last = until.map_or(String::new(), |row| format!(" to line {}", row.line));
        let names = format!("\"{}\" and \"{}\"", cue.name, object.name);
        let message = format!("{names} have exchanged their names from here{last}; exchanged back");
        log.add(Subject::Swapped, pair[0].line, message);
    }
    Ok(swaps.first().map(|row| row.line))
}

fn exchange(one: &mut RawTrack, other: &mut RawTrack, from: f64, until: f64) {
    let range = |track: &RawTrack| {
        let at = |time: f64| track.rows.partition_point(|row| row.time < time);
        at(from)..at(until)
    };
    let (a, b) = (range(one), range(other));
    let replaced: Vec<Row> = other.rows.splice(b, one.rows[a.clone()].to_vec()).collect();
    one.rows.splice(a, replaced);
}
