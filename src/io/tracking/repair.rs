//! Faults between the camera and the file: lost balls, duplicate rows, rows out of order, repeated
//! frames, places that programs filled in, exchanged names of balls. They are repaired if the repair
//! is certain.

use std::collections::HashMap;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use statrs::function::erf::erfc;

use super::raw::{Job, RawShot, RawTrack, Row, UNLIKE, jump_speed, value_at};
use crate::io::error::{Subject, message};
use crate::numerics::{EXACT, NORMAL_MEDIAN, SIGNIFICANT, median};

/// Ratio to the step of coarse coordinates below which a ball may move without being seen to.
const MAX_COARSE: f64 = 4.0;
/// Ratio of the squared jumps with exchanged names to those without, below which the names were
/// exchanged; a wrong place makes it 1/2.
const MAX_SWAPPED: f64 = 0.3;

/// Makes gaps of places that a ball jumps to and back from, as false detections and misprints are;
/// of placeholders for a lost ball to which it jumps at an end of its track; and of impossible
/// times.
pub(super) fn remove_lost(shot: &mut RawShot, job: Job) {
    let paths = || shot.tracks.iter().filter(|track| !track.is_angle);
    // two steps are wrong at each false detection: a fifth of all if a tenth of the frames is wrong
    let limit = jump_speed(paths().flat_map(RawTrack::steps), 0.75);
    // the range of the middle nine tenths
    let mut times: Vec<f64> = paths().flat_map(RawTrack::seen).map(|row| row.time).collect();
    let [first, last] = [0.05, 0.95].map(|part| value_at(&mut times, part).unwrap_or(f64::NAN));
    let is_late = |row: &Row| (first - row.time).max(row.time - last) > UNLIKE * (last - first);
    let jumps = |one: &[&Row], other: &[&Row]| {
        let [length, time] = one[one.len() - 1].step(other[0]);
        length > limit * time
    };
    for RawTrack { name, rows, point, .. } in shot.tracks.iter_mut().filter(|track| !track.is_angle) {
        let path: Vec<&Row> = rows.iter().filter(|row| !row.is_gap()).collect();
        let stays: Vec<&[&Row]> = path.chunk_by(|a, b| a.place == b.place).collect();
        let is_away = |i: usize| {
            let (stay, is_placeholder) = (stays[i], stays[i][0].is_placeholder());
            match (i.checked_sub(1).map(|before| stays[before]), stays.get(i + 1)) {
                // a point that is often mistaken for another one jumps back to wrong places, too
                (Some(_), Some(_)) if point.is_some() && !is_placeholder => false,
                (Some(before), Some(after)) => {
                    jumps(before, stay) && jumps(stay, after) && !jumps(before, after)
                }
                (Some(before), None) => is_placeholder && jumps(before, stay),
                (None, Some(after)) => is_placeholder && jumps(stay, after),
                (None, None) => false,
            }
        };
        let away: Vec<bool> = (0..stays.len()).flat_map(|i| vec![is_away(i); stays[i].len()]).collect();
        for (row, is_away) in rows.iter_mut().filter(|row| !row.is_gap()).zip(away) {
            let why = if is_late(row) { "at a time far from all others" } else { "far from its path" };
            if is_away || is_late(row) {
                let [x, y] = row.place;
                let message = format!("\"{name}\" is at ({x}, {y}), {why}: taken as a gap");
                job.note(Subject::Gaps, row.line, message);
                row.lose();
            }
        }
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

/// Unites frames of one time. `None`, with a problem: two places at a time, or a second clip.
pub(super) fn unite_frames(shot: &mut RawShot, job: Job) -> Option<()> {
    for track in &mut shot.tracks {
        let restart = track.restarts().first().copied();
        let back = track.written().windows(2).find(|two| two[1].time < two[0].time).map(|two| two[1].line);
        let RawTrack { name, rows, .. } = track;
        if let Some(Row { time, line, .. }) = restart {
            let wrong = format!("time of \"{name}\" runs backwards, to {time:.6} s");
            return job.refuse(line, wrong + "; expected each clip as a shot of its own");
        }
        let mut united: Vec<Row> = Vec::with_capacity(rows.len());
        for row in rows.iter() {
            let Some(known) = united.last_mut().filter(|known| known.time == row.time) else {
                united.push(*row);
                continue;
            };
            if !known.is_gap() && !row.is_gap() && known.place != row.place {
                let ([x, y], [known_x, known_y], time, line) = (row.place, known.place, row.time, known.line);
                let places = format!("({x}, {y}) here and ({known_x}, {known_y}) in line {line}");
                let message = format!("\"{name}\" is at two places at {time:.6} s: {places}; expected one");
                return job.refuse(row.line, message);
            }
            let Row { line, .. } = known;
            let message = format!("\"{name}\" has its time twice (line {line}); one row is passed over");
            job.note(Subject::Repeated, row.line, message);
            if known.is_gap() {
                *known = *row;
            }
        }
        *rows = united;
        if back.is_some() {
            let message = format!("the rows of \"{name}\" are not in the order of time; put in order");
            job.note(Subject::Order, back, message);
        }
    }
    Some(())
}

/// Turns places into gaps that both balls share, unless they do in all frames: a tracker took them
/// for one.
pub(super) fn remove_shared([cue, object]: &mut [RawTrack; 2], job: Job) {
    let frames = cue.frames_with(object);
    let shared = frames.iter().filter(|[one, other]| one.place == other.place);
    let shared: Vec<Row> = shared.map(|[row, _]| *row).collect();
    for Row { time, line, .. } in shared.iter().filter(|_| shared.len() < frames.len()) {
        job.note(Subject::Gaps, *line, "both balls are at one place: taken as a gap");
        let rows = cue.rows.iter_mut().chain(&mut object.rows);
        rows.filter(|row| row.time == *time).for_each(Row::lose);
    }
}

/// Turns places into gaps that a program filled in for a moving ball that it did not see: that of
/// the frame before, or evenly spaced ones on a straight line between others, if a ball whose places
/// scatter, and are multiples of `resolution`, is there too improbably.
pub(super) fn remove_filled(track: &mut RawTrack, (resolution, fps): (f64, f64), job: Job) {
    let seen: Vec<Row> = track.seen().copied().collect();
    let off = |three: &[Row]| {
        let frames = |to: usize| ((three[to].time - three[0].time) * fps).round();
        let part = frames(1) / frames(2);
        [0, 1].map(|k| {
            let [before, here, after] = [0, 1, 2].map(|i| three[i].place[k]);
            (here - before - part * (after - before)).abs()
        })
    };
    let is_held = |i: usize| seen[i].place == seen[i - 1].place;
    let moving = || (1..seen.len().saturating_sub(1)).filter(|i| !(is_held(*i) && is_held(i + 1)));
    let offs = |k: usize| median(moving().map(|i| off(&seen[i - 1..=i + 1])[k]).collect());
    let scatter = [0, 1].map(|k| offs(k) / NORMAL_MEDIAN);
    let least =
        resolution.max(EXACT * seen.iter().flat_map(|row| row.place).fold(0.0, |most, x| x.abs().max(most)));
    // P(|x| ≤ h) = 2h/(√(2π) σ) of a normal number if h is much less than σ
    let chance: f64 = scatter.map(|sd| (2.0 * least / (TAU.sqrt() * sd)).min(1.0)).into_iter().product();
    let improbable = erfc(SIGNIFICANT * FRAC_1_SQRT_2);
    let shortest = (MAX_COARSE * resolution).max(SIGNIFICANT * scatter[0].hypot(scatter[1]));
    let is_even = |i: usize| off(&seen[i - 1..=i + 1]).iter().all(|off| *off <= least);
    let inner: Vec<usize> =
        (1..seen.len().saturating_sub(1)).filter(|i| is_held(*i) || is_even(*i)).collect();
    // lines, and whether the place is that of the frame before
    let mut filled: HashMap<usize, bool> = HashMap::new();
    for run in inner.chunk_by(|one, next| next - one == 1) {
        let ([first, ..], [.., last]) = (run, run) else { continue };
        let moves = |from: usize, to: usize| seen[from].distance(&seen[to]) > shortest;
        let is_filled = if run.iter().any(|i| is_held(*i)) {
            *first > 1 && moves(first - 2, first - 1) && moves(*last, last + 1)
        } else {
            moves(first - 1, last + 1) && chance.powi(run.len() as i32) < improbable
        };
        filled.extend(run.iter().filter(|_| is_filled).map(|i| (seen[*i].line, is_held(*i))));
    }
    if filled.len() * 5 > seen.len() {
        return;
    }
    let RawTrack { name, rows, .. } = track;
    for row in rows {
        let Some(is_held) = filled.get(&row.line) else { continue };
        job.note(Subject::Gaps, row.line, message!("filled", name => &*name, is_held));
        row.lose();
    }
}

/// Undoes identity swaps of a tracker; returns the line of the first one.
pub(super) fn undo_swaps(balls: &mut [RawTrack; 2], job: Job) -> Option<usize> {
    let [cue, object] = balls;
    let mut swaps: Vec<Row> = Vec::new();
    for two in cue.frames_with(object).windows(2) {
        let ([c, o], [c_next, o_next]) = (two[0], two[1]);
        let kept = c.distance(&c_next).powi(2) + o.distance(&o_next).powi(2);
        let swapped = c.distance(&o_next).powi(2) + o.distance(&c_next).powi(2);
        if swapped < MAX_SWAPPED * kept {
            swaps.push(c_next);
        }
    }
    for pair in swaps.chunks(2) {
        let (cue, object, last) = (&cue.name, &object.name, pair.get(1).map(|until| until.line));
        job.note(Subject::Swapped, pair[0].line, message!("swapped", cue, object, last));
    }
    for swap in &swaps {
        let tail = |rows: &mut Vec<Row>| rows.split_off(rows.partition_point(|row| row.time < swap.time));
        let (of_cue, of_object) = (tail(&mut cue.rows), tail(&mut object.rows));
        cue.rows.extend(of_object);
        object.rows.extend(of_cue);
    }
    swaps.first().map(|row| row.line)
}
