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

/// Leaves out all shots if the object balls of most surely move before the impact, as those of the others
/// then do, too; adds their names and reasons to `left_out`.
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
    for (shot, found) in shots.drain(..).zip(found) {
        let was = match found {
            Some((speed, _)) if !from_balls => format!("was moving before the impact, with {speed:.3} m/s"),
            Some(_) => "was moving before the impact".to_owned(),
            None => "may have been moving before the impact".to_owned(),
        };
        let reason = format!(
            "the object ball {was}, as in {moving} of {count} shots: let it come to rest first, on a table \
             that is level"
        );
        left_out.push((shot.name, reason));
    }
}
