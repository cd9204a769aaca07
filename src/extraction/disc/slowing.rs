//! Discs that slow down evenly, as friction makes them: by so little that one shot hardly shows it, yet all shots together do, and
//! velocities at the impact that straight lines give are wrong by more than their errors.
//!
//! Along its way a disc is at s(t) = s₀ + v t − ½ a t², t from the impact. Every side of every shot tells its a; their mean holds for the
//! film. The paths are then straightened by ½ a t².

use nalgebra::{Matrix3, Vector3};

use super::DiscImpact;
use super::unknowns::{TIME, velocity};
use crate::film::discs::{DISCS, centre};
use crate::measurement::dataset::Measured;
use crate::measurement::track::{Sample, TrackShot, TrackedBall};
use crate::numerics::median;

/// Fewer shots, whose discs go all one way, may as well show a camera that looks askew.
const LEAST_SHOTS: usize = 6;

/// Frames that tell a parabola and its noise, and those next to the impact that may see the discs touch.
const LEAST_FRAMES: usize = 8;
const TOUCHING: f64 = 0.5;

/// A disc that goes less than so many standard deviations of a coordinate shows no direction.
const FAR: f64 = 50.0;

/// And one that goes less than so many lies still: nothing slows it down.
const LIES: f64 = 20.0;

/// A side that is so many standard errors from the median of all is left out.
const ODD: f64 = 6.0;

/// What sides may scatter by, as χ²/dof. Pucks on a table that is not level, or that a hand still pushes, scatter by far more.
const EVEN: f64 = 3.0;

/// It is taken into account where χ² falls by as much with it, as corrections of the camera are.
const CALLED_FOR: f64 = 12.0;

/// What one side of a shot tells of a, m/s².
struct Told {
    value: f64,
    variance: f64,
}

/// By how much all discs slow down, m/s², where these shots call for it.
pub(super) fn slowing<'a>(shots: impl Iterator<Item = (&'a TrackShot, &'a DiscImpact)>) -> Option<Measured> {
    let mut all: Vec<Told> = Vec::new();
    let mut count = 0;
    for (shot, impact) in shots.filter(|(_, impact)| impact.stuck.is_none()) {
        let of_disc = |i: usize| [0, 1].map(|side| told((shot, impact), i, side));
        all.extend([0, 1].map(of_disc).into_iter().flatten().flatten());
        count += 1;
    }
    if count < LEAST_SHOTS || all.is_empty() {
        return None;
    }
    let middle = median(all.iter().map(|told| told.value).collect());
    let off = |told: &Told| (told.value - middle).abs() / told.variance.sqrt();
    let usual = (median(all.iter().map(off).collect()) / 0.6745).max(1.0);
    all.retain(|told| off(told) < ODD * usual);
    let weight: f64 = all.iter().map(|told| told.variance.recip()).sum();
    let value = all.iter().map(|told| told.value / told.variance).sum::<f64>() / weight;
    let square: f64 = all.iter().map(|told| (told.value - value).powi(2) / told.variance).sum();
    // sides that differ by more than their noise make it less sure, and if they differ much, it is not one slowing
    let scatter = (square / all.len().saturating_sub(1).max(1) as f64).max(1.0);
    let variance = scatter / weight;
    (scatter < EVEN && value > 0.0 && value * value > CALLED_FOR * variance)
        .then_some(Measured { value, sd: Some(variance.sqrt()) })
}

/// From the parabola along the way of a disc (0 or 1) before (0) or after (1) the impact.
fn told((shot, impact): (&TrackShot, &DiscImpact), disc: usize, side: usize) -> Option<Told> {
    let time = impact.unknowns[TIME];
    let (along, speed) = way(impact, disc, side)?;
    let near = TOUCHING / shot.fps;
    let [from, to] = [[impact.window[0], time - near], [time + near, impact.window[1]]][side];
    let samples: Vec<&Sample> =
        centre(shot, DISCS[disc]).iter().filter(|s| (from..=to).contains(&s.t)).collect();
    if samples.len() < LEAST_FRAMES {
        return None;
    }
    let place = |s: &Sample| s.x * along[0] + s.y * along[1];
    let origin = place(samples[0]);
    let scale = (to - time).abs().max((from - time).abs());
    let powers = |s: &Sample| {
        let u = (s.t - time) / scale;
        Vector3::new(1.0, u, u * u)
    };
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for s in &samples {
        let u = powers(s);
        normal += u * u.transpose();
        right += u * (place(s) - origin);
    }
    let inverse = normal.cholesky()?.inverse();
    let coefficients = inverse * right;
    let left =
        samples.iter().map(|s| (place(s) - origin - coefficients.dot(&powers(s))).powi(2)).sum::<f64>();
    let noise = left / (samples.len() - 3) as f64;
    let square = scale * scale;
    let is_far = speed * (to - from) > FAR * noise.sqrt();
    let variance = 4.0 * inverse[(2, 2)] * noise / (square * square);
    (is_far && variance > 0.0).then_some(Told { value: -2.0 * coefficients[2] / square, variance })
}

/// The direction in which a disc goes, and its speed, m/s; `None` where it lies still.
fn way(impact: &DiscImpact, disc: usize, side: usize) -> Option<([f64; 2], f64)> {
    let first = velocity(disc, side);
    let v = [impact.unknowns[first], impact.unknowns[first + 1]];
    let speed = v[0].hypot(v[1]);
    let moved = speed * (impact.window[side] - impact.unknowns[TIME]).abs();
    (moved > LIES * impact.position_sd).then(|| (v.map(|v| v / speed), speed))
}

/// By how much a disc that slows down is behind its straight path at a time, m.
pub(super) fn behind(impact: &DiscImpact, slowing: f64, disc: usize, time: f64) -> [f64; 2] {
    let late = time - impact.unknowns[TIME];
    let Some((along, speed)) = way(impact, disc, usize::from(late >= 0.0)) else { return [0.0; 2] };
    // until it lies still
    let slows = late.min(speed / slowing);
    along.map(|along| along * (0.5 * slowing * slows * slows + speed * (late - slows)))
}

/// The tracks of a shot as they would be if nothing slowed the discs down.
pub(super) fn straightened(shot: &TrackShot, impact: &DiscImpact, slowing: f64) -> TrackShot {
    let mut shot = shot.clone();
    let straighten = |samples: &mut Vec<Sample>, disc: usize| {
        for sample in samples {
            let [x, y] = behind(impact, slowing, disc, sample.t);
            sample.x += x;
            sample.y += y;
        }
    };
    straighten(&mut shot.cue, 0);
    straighten(&mut shot.object, 1);
    for marker in &mut shot.markers {
        straighten(&mut marker.samples, usize::from(marker.ball == TrackedBall::Object));
    }
    shot
}
