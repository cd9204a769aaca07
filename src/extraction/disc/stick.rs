//! Discs that stick together: after the impact their centres stay as far apart as they then were, and the pair moves on as one
//! rigid body, its centre of mass straight on, turning evenly about it.

use nalgebra::SVector;
use num_dual::DualNum;

use super::Dual;
use super::lines::{LEAST, Line, distances};
use super::unknowns::{COUNT, DIRECTION, DISTANCE, INPUTS, PLACE, TIME, Unknowns, velocity};
use crate::film::frame_noise::noise_of;
use crate::measurement::dataset::Measured;
use crate::measurement::track::TrackShot;
use crate::numerics::median;
use crate::physics::cloth_motion::Number;

/// Discs stick if they part with less than this part of their closing speed, three standard errors included. Real discs that part
/// do so with a third of it and more; two hundredths are within what glue and velcro give way.
const PARTING: f64 = 0.02;
/// They touch while the distance is larger than usual by no more than this part, or this many standard deviations of the noise,
/// whichever is more. A soft rim may be pressed in at first, so that it may be less.
const TOUCHING: f64 = 0.01;
const NOISES: f64 = 5.0;
/// So many frames at least must they stay together; more than these tell no more.
const FRAMES: usize = 24;
const MOST: usize = 120;
/// Frames just after the contact, in which the middle one of three may still be one before it.
const SKIPPED: usize = 2;
/// The pair has settled once so many frames in a row show the distance at which it stays.
const SETTLED: usize = 6;
/// So many frames before the contact give the closing speed.
const NEAR: usize = 12;

/// Standard error of a median over that of a mean, of normal errors.
const MEDIAN_ERROR: f64 = 1.2533;

/// After the impact, in the place of the second disc's velocity: the pair's angular velocity, rad/s…
const TURNING: usize = velocity(1, 1);
/// …and the part of the distance of the centres at which, from the first, the centre of mass is: m₂/(m₁ + m₂).
pub(super) const OF_SECOND: usize = TURNING + 1;
/// Mean and standard deviation of what is known of it beforehand: it is between 0 and 1.
pub(super) const PART: [f64; 2] = [0.5, 0.5];

/// How long and how firmly two discs stick together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stuck {
    /// The distance of the centres while they stick together, m.
    pub distance: f64,
    /// How many frames after the impact they stay so.
    pub frames: usize,
    /// Whether these frames reach to the end of the tracks.
    pub to_the_end: bool,
    /// The growth of that distance over the closing speed, which takes the place of e.
    pub restitution: Measured,
}

impl Stuck {
    /// How the discs stick together, as a sentence without a capital letter and a full stop.
    #[must_use]
    pub fn sentence(&self) -> String {
        format!(
            "the discs stick together: after the impact their centres stay {:.2} mm apart for {} frames{}, so that e = 0 ({:.4} ± \
             {:.4}, the growth of that distance over the closing speed)",
            1e3 * self.distance,
            self.frames,
            if self.to_the_end { ", to the end of the tracks" } else { "" },
            self.restitution.value,
            self.restitution.sd.unwrap_or(f64::NAN)
        )
    }
}

/// A first guess of the unknowns of a shot whose discs stick together, and from when to when they settle: meanwhile they are neither
/// free nor one rigid body.
pub(super) struct Found {
    pub stuck: Stuck,
    pub guess: Unknowns,
    pub settling: [f64; 2],
}

/// Whether the discs of a shot stick together.
pub(super) fn find(shot: &TrackShot) -> Option<Found> {
    let distances = distances(shot);
    let middle = |run: &[(f64, f64)]| median(run.iter().map(|(_, d)| *d).collect());
    let nearest = (0..distances.len()).min_by(|i, j| distances[*i].1.total_cmp(&distances[*j].1))?;
    let usual = middle(&distances[nearest..distances.len().min(nearest + MOST)]);
    let noise = noise_of([&shot.cue, &shot.object], shot.resolution, (shot.fps, shot.correlation));
    let most = usual + (TOUCHING * usual).max(NOISES * noise);
    let first = distances.iter().position(|(_, d)| *d <= most)?;
    let together = distances[first..].iter().take_while(|(_, d)| *d <= most).count();
    if first < LEAST || together < FRAMES + SKIPPED {
        return None;
    }
    let used = &distances[first + SKIPPED..first + together.min(MOST + SKIPPED)];
    let slope = |run: &[(f64, f64)]| {
        let pairs = run.iter().enumerate().flat_map(|(i, a)| run[i + 1..].iter().map(move |b| (a, b)));
        median(pairs.map(|(a, b)| (b.1 - a.1) / (b.0 - a.0)).collect())
    };
    let closing = -slope(&distances[first.saturating_sub(NEAR)..first]);
    let third = used.len() / 3;
    let [early, between, late] = [&used[..third], &used[third..2 * third], &used[2 * third..3 * third]];
    let growth = |early: &[(f64, f64)]| (middle(late) - middle(early)) / ((late[0].0 - early[0].0) * closing);
    let value = growth(early);
    // a median of so many distances, each with the noise of two coordinates
    let error =
        MEDIAN_ERROR * noise * (2.0 * 2.0 / third as f64).sqrt() / ((late[0].0 - early[0].0) * closing);
    // discs that met within the window and part again are as far apart in its first third as in its last
    let parting = value.abs().max(growth(between).abs());
    if !(closing > 0.0 && parting + 3.0 * error < PARTING) {
        return None;
    }
    let stuck = Stuck {
        distance: usual,
        frames: together,
        to_the_end: first + together == distances.len(),
        restitution: Measured { value, sd: Some(error) },
    };
    let near = |d: f64| (d - usual).abs() <= NOISES * noise;
    let touch = distances.iter().position(|(_, d)| *d <= usual + NOISES * noise)?;
    let settled = distances[touch..].windows(SETTLED).position(|run| run.iter().all(|(_, d)| near(*d)))?;
    let settling = [distances[touch].0, distances[touch + settled].0];
    Some(Found { stuck, guess: guess(shot, settling, &stuck)?, settling })
}

fn guess(shot: &TrackShot, [time, settled]: [f64; 2], stuck: &Stuck) -> Option<Unknowns> {
    let mut z = Unknowns::zeros();
    let mut after = [Line::default(); 2];
    for (disc, samples) in [&shot.cue, &shot.object].into_iter().enumerate() {
        let split = samples.partition_point(|s| s.t < time);
        let before = &samples[split.saturating_sub(NEAR)..split];
        let from = samples.partition_point(|s| s.t < settled);
        let later = &samples[from..samples.len().min(from + NEAR)];
        if before.len() < LEAST || later.len() < LEAST {
            return None;
        }
        let line = Line::through(before, time);
        after[disc] = Line::through(later, time);
        for k in 0..2 {
            z[velocity(disc, 0) + k] = line.velocity[k];
        }
    }
    let [across, relative] =
        [|line: &Line| line.position, |line: &Line| line.velocity].map(|of: fn(&Line) -> [f64; 2]| {
            let [a, b] = [of(&after[0]), of(&after[1])];
            [b[0] - a[0], b[1] - a[1]]
        });
    let distance = across[0].hypot(across[1]);
    z[TIME] = time;
    z[PLACE] = after[0].position[0];
    z[PLACE + 1] = after[0].position[1];
    z[DIRECTION] = across[1].atan2(across[0]);
    z[DISTANCE] = stuck.distance;
    z[velocity(0, 1)] = after[0].velocity[0];
    z[velocity(0, 1) + 1] = after[0].velocity[1];
    z[TURNING] = (across[0] * relative[1] - across[1] * relative[0]) / (distance * distance);
    z[OF_SECOND] = PART[0];
    Some(z)
}

/// Where a disc is at a time after the impact: with r = d (cos, sin) of the line of centres, which turns by Ωτ, the first disc is
/// at P + (u' + λ Ω × r₀) τ − λ (r − r₀), the second at r from it.
pub(super) fn place<T: Number>(z: &[T; COUNT], disc: usize, time: f64) -> [T; 2] {
    let late = -z[TIME] + time;
    let (sin, cos) = z[DIRECTION].sin_cos();
    let (sin_then, cos_then) = (z[DIRECTION] + z[TURNING] * late).sin_cos();
    let (start, then) = ([cos, sin], [cos_then, sin_then]);
    let turned = [-sin, cos];
    [0, 1].map(|k| {
        let drift = z[velocity(0, 1) + k] + z[OF_SECOND] * z[DISTANCE] * z[TURNING] * turned[k];
        z[PLACE + k] + drift * late - z[OF_SECOND] * z[DISTANCE] * (then[k] - start[k])
            + z[DISTANCE] * then[k] * disc as f64
    })
}

/// A disc's velocity just after the impact.
pub(super) fn velocity_after(z: &SVector<Dual, INPUTS>, disc: usize) -> [Dual; 2] {
    let (sin, cos) = z[DIRECTION].sin_cos();
    let first = velocity(0, 1);
    let relative = z[TURNING] * z[DISTANCE] * disc as f64;
    [z[first] - relative * sin, z[first + 1] + relative * cos]
}
