//! Several clips in one table that has no column of shots: told apart where the time jumps, or both balls do.

use std::sync::Arc;

use super::lost;
use super::raw::{Clock, NAMES, Notes, RawShot, RawTrack, Row, middle, sorted};

/// Between clips the time jumps by more than this, s, and by more than so many usual steps.
const PAUSE: f64 = 1.0;
pub(super) const STEPS: f64 = 20.0;

/// Frames per second where nothing tells them.
const USUAL_FPS: f64 = 240.0;

/// Or all balls jump, from one frame to the next, by more than so many times what they move in nine of ten steps.
const JUMP: f64 = 8.0;

/// Each clip has both balls in so many frames: a few stray rows are none.
const LEAST: usize = 6;

/// The shots of a file: what stands for a lost ball is left out, and one shot that is several clips is taken apart. `alone`: the clips
/// need no name of the file before their number.
pub(super) fn of_file(shots: Vec<RawShot>, fps: Option<f64>, alone: bool, notes: &Notes) -> Vec<RawShot> {
    let mut shots = shots;
    for RawShot { tracks, file, .. } in &mut shots {
        lost::leave_out(tracks, notes.of(file));
    }
    // a table that names its shots is believed
    let [shot] = shots.as_slice() else { return shots };
    let cuts = cuts(shot, fps);
    if cuts.is_empty() {
        return shots;
    }
    let clips: Vec<RawShot> = (0..=cuts.len()).map(|number| clip(shot, &cuts, number, alone)).collect();
    let whole = |clip: &RawShot| clip.tracks.iter().filter(|track| track.seen().count() >= LEAST).count() > 1;
    if !clips.iter().all(whole) {
        return shots;
    }
    let names: Vec<&str> = clips.iter().map(|clip| clip.name.as_str()).collect();
    let message = format!(
        "holds {} clips, told apart where time or both balls jump: taken as the shots {}; expected a column shot where that is wrong",
        clips.len(),
        names.join(", ")
    );
    notes.of(&shot.file).add(NAMES, None, message);
    clips
}

/// The times at which further clips begin.
fn cuts(shot: &RawShot, fps: Option<f64>) -> Vec<f64> {
    let second = match shot.clock {
        Clock::In(unit) => unit.seconds().unwrap_or(fps.unwrap_or(USUAL_FPS).recip()),
        Clock::Rounded(_) => 1.0,
        Clock::FramesAt(fps) => fps.recip(),
        // ms and frames look alike
        Clock::Unsaid => return Vec::new(),
    };
    let times = shot.times();
    let Some(usual) = middle(times.windows(2).map(|two| two[1] - two[0])) else { return Vec::new() };
    let pause = (PAUSE / second).max(STEPS * usual);
    let jumps = jumps(shot, usual);
    let begins = |two: &[f64]| two[1] - two[0] > pause || jumps.contains(&two[1].to_bits());
    times.windows(2).filter(|two| begins(two)).map(|two| two[1]).collect()
}

/// The times to which all balls jump that are there before and after, and do not just exchange their names.
fn jumps(shot: &RawShot, usual: f64) -> Vec<u64> {
    let Some([one, other]) = shot.centres() else { return Vec::new() };
    let follows = |two: &[Row]| {
        let step = two[1].time - two[0].time;
        step > 0.0 && step < 1.5 * usual && !two[0].is_gap() && !two[1].is_gap()
    };
    let moved = |two: &[Row]| two[0].distance(two[1]);
    let steps = [one, other].into_iter().flat_map(|track| track.rows.windows(2));
    let all = sorted(steps.filter(|two| follows(two)).map(moved));
    let Some(long) = all.get(all.len() * 9 / 10).filter(|long| **long > 0.0) else { return Vec::new() };
    let mut found = Vec::new();
    let mut behind = other.rows.windows(2).peekable();
    for two in one.rows.windows(2).filter(|two| follows(two) && moved(two) > JUMP * long) {
        while behind.next_if(|others| others[1].time < two[1].time).is_some() {}
        let Some(others) = behind.peek().filter(|others| others[1].time == two[1].time) else { continue };
        let crossed = two[0].distance(others[1]);
        if follows(others) && moved(others) > JUMP * long && crossed > JUMP * long {
            found.push(two[1].time.to_bits());
        }
    }
    found
}

/// The clip of this number, from 0 on.
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
