//! Object balls that do not lie still before the impacts.

use rayon::prelude::*;

use crate::extraction::object_speed;
use crate::measurement::track::TrackShot;

/// Part of the shots from which on moving object balls are no accident of one.
const MANY: f64 = 0.5;

/// Number of shots below which each is judged alone.
const LEAST_SHOTS: usize = 6;

/// Parts of the cue ball's speed: less hardly matters, and a ball that is faster is the cue ball.
const LEAST: f64 = 0.003;
const MOST: f64 = 0.2;

/// Leaves out the shots whose object ball surely moves before the impact if most do; adds their
/// names and reasons to `left_out`.
pub(super) fn leave_out_moving(
    shots: &mut Vec<TrackShot>,
    from_balls: bool,
    left_out: &mut Vec<(String, String)>,
) {
    let count = shots.len();
    if count < LEAST_SHOTS {
        return;
    }
    let found: Vec<Option<(f64, f64)>> = shots.par_iter().map(|shot| object_speed(shot, MOST)).collect();
    let matter = found.iter().flatten().filter(|(_, part)| *part > LEAST).count();
    if matter as f64 <= MANY * count as f64 {
        return;
    }
    let moving = found.iter().flatten().count();
    let mut found = found.into_iter();
    shots.retain(|shot| {
        let Some((speed, _)) = found.next().flatten() else { return true };
        let with = if from_balls { String::new() } else { format!(", with {speed:.3} m/s") };
        let reason = format!(
            "the object ball was moving before the impact{with}, as in {moving} of {count} shots: let it \
             come to rest first, on a table that is level"
        );
        left_out.push((shot.name.clone(), reason));
        false
    });
}
