//! Object balls that do not lie still before the impacts: the model takes them to rest, and a camera is not to blame for it.

use rayon::prelude::*;

use crate::extraction::object_speed;
use crate::measurement::dataset::{Dataset, Tracks};

/// Of all shots: where as many show it, it is no accident of one.
const MANY: f64 = 0.5;

/// Fewer shots are told one by one.
const LEAST_SHOTS: usize = 6;

/// Parts of the cue ball's speed: less hardly matters, and a ball that is faster is the cue ball.
const LEAST: f64 = 0.003;
const MOST: f64 = 0.2;

/// Where the object ball surely moves before the impact in most shots, leaves these out.
pub(super) fn leave_out_moving(dataset: &mut Dataset, tracks: &mut Tracks) {
    let count = tracks.shots.len();
    if count < LEAST_SHOTS {
        return;
    }
    let found: Vec<Option<(f64, f64)>> =
        tracks.shots.par_iter().map(|shot| object_speed(shot, MOST)).collect();
    let matter = found.iter().flatten().filter(|(_, part)| *part > LEAST).count();
    if matter as f64 <= MANY * count as f64 {
        return;
    }
    let moving = found.iter().flatten().count();
    let mut found = found.into_iter();
    tracks.shots.retain(|shot| {
        let Some((speed, _)) = found.next().flatten() else { return true };
        let with = if tracks.from_balls { String::new() } else { format!(", with {speed:.3} m/s") };
        let reason = format!(
            "the object ball was moving before the impact{with}, as in {moving} of {count} shots: let it come to rest first, on a table \
             that is level"
        );
        dataset.left_out.push((shot.name.clone(), reason));
        false
    });
}
