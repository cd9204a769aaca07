//! Separation of clips in a table without a column of shots, by jumps of time or of both balls.

use std::collections::HashSet;
use std::sync::Arc;

use super::lost;
use super::raw::{Clock, NAMES, Notes, RawShot, RawTrack, Row, middle, sorted};

/// Pause between clips: more than this, s, and more than so many median steps of time.
const MIN_PAUSE_S: f64 = 1.0;
pub(super) const STEPS: f64 = 20.0;
/// Frame rate if it is not known, frames/s.
const DEFAULT_FPS: f64 = 240.0;
/// Jump of both balls between clips, in units of the 90th percentile of their steps.
const MIN_CLIP_JUMP: f64 = 8.0;
/// Least number of frames of both balls in a clip.
const MIN_FRAMES: usize = 6;

/// Returns the shots of a file: positions of lost balls are left out, and one shot that is several
/// clips is separated. `alone`: the names of clips are their numbers, without the file's name.
pub(super) fn of_file(mut shots: Vec<RawShot>, fps: Option<f64>, alone: bool, notes: &Notes) -> Vec<RawShot> {
    for RawShot { tracks, file, .. } in &mut shots {
        lost::leave_out(tracks, notes.of(file));
    }
    // names of shots in the table are believed
    let [shot] = shots.as_slice() else { return shots };
    let cuts = cuts(shot, fps);
    if cuts.is_empty() {
        return shots;
    }
    let clips: Vec<RawShot> = (0..=cuts.len()).map(|number| clip(shot, &cuts, number, alone)).collect();
    let is_seen = |track: &&RawTrack| track.seen().count() >= MIN_FRAMES;
    if clips.iter().any(|clip| clip.tracks.iter().filter(is_seen).count() < 2) {
        return shots;
    }
    let names: Vec<&str> = clips.iter().map(|clip| clip.name.as_str()).collect();
    let message = format!(
        "holds {} clips, separated by jumps of the time or of both balls: taken as the shots {}; expected a column shot if that is wrong",
        clips.len(),
        names.join(", ")
    );
    notes.of(&shot.file).add(NAMES, None, message);
    clips
}

/// Returns the times at which further clips begin.
fn cuts(shot: &RawShot, fps: Option<f64>) -> Vec<f64> {
    let second = match shot.clock {
        Clock::In(unit) => unit.seconds().unwrap_or(fps.unwrap_or(DEFAULT_FPS).recip()),
        Clock::Rounded(_) => 1.0,
        Clock::FramesAt(fps) => fps.recip(),
        // ms and frames cannot be distinguished
        Clock::Unsaid => return Vec::new(),
    };
    let times = shot.times();
    let Some(step) = middle(times.windows(2).map(|two| two[1] - two[0])) else { return Vec::new() };
    let pause = (MIN_PAUSE_S / second).max(STEPS * step);
    let jumps = jumps(shot, step);
    let begins = |two: &[f64]| two[1] - two[0] > pause || jumps.contains(&two[1].to_bits());
    times.windows(2).filter(|two| begins(two)).map(|two| two[1]).collect()
}

/// Returns the bits of the times to which both balls jump, except exchanges of their names.
fn jumps(shot: &RawShot, step: f64) -> HashSet<u64> {
    let Some([one, other]) = shot.centres() else { return HashSet::new() };
    let follows = |two: &&[Row]| {
        let length = two[1].time - two[0].time;
        length > 0.0 && length < 1.5 * step && !two[0].is_gap() && !two[1].is_gap()
    };
    let moved = |two: &[Row]| two[0].distance(two[1]);
    let steps = [one, other].into_iter().flat_map(|track| track.rows.windows(2)).filter(follows);
    let all = sorted(steps.map(moved));
    let Some(long) = all.get(all.len() * 9 / 10).filter(|long| **long > 0.0) else { return HashSet::new() };
    let is_jump = |two: &&[Row]| follows(two) && moved(two) > MIN_CLIP_JUMP * long;
    let mut found = HashSet::new();
    let mut behind = other.rows.windows(2).peekable();
    for two in one.rows.windows(2).filter(is_jump) {
        while behind.next_if(|others| others[1].time < two[1].time).is_some() {}
        let others = behind.peek().filter(|others| others[1].time == two[1].time && is_jump(others));
        if others.is_some_and(|others| two[0].distance(others[1]) > MIN_CLIP_JUMP * long) {
            found.insert(two[1].time.to_bits());
        }
    }
    found
}

fn clip(shot: &RawShot, cuts: &[f64], number: usize, alone: bool) -> RawShot {
    let part = |track: &RawTrack| {
        let is_part = |row: &&Row| cuts.partition_point(|cut| *cut <= row.time) == number;
        RawTrack {
            is_angle: track.is_angle,
            rows: track.rows.iter().filter(is_part).copied().collect(),
            ..RawTrack::new(&track.name, track.point.clone())
        }
    };
    let tracks: Vec<RawTrack> = shot.tracks.iter().map(part).filter(|track| !track.rows.is_empty()).collect();
    let name = if alone { format!("{}", number + 1) } else { format!("{}-{}", shot.name, number + 1) };
    let line = tracks.iter().map(RawTrack::line).min().unwrap_or(shot.line);
    RawShot { name, file: Arc::clone(&shot.file), line, clock: shot.clock, tracks }
}
