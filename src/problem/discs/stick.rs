//! Discs that stick together: after the impact their centres stay as far apart as they then were.

pub use super::lines::Stuck;
use super::lines::{LEAST, distances, median_slope};
use crate::film::frame_noise::noise_of;
use crate::measurement::dataset::Measured;
use crate::measurement::track::TrackShot;
use crate::numerics::median;

/// Part of the closing speed with which discs that stick may part, three standard errors included.
/// Real discs that part do so with a third of it and more; glue and velcro give way by two hundredths.
const PARTING: f64 = 0.02;

/// Discs touch while their distance is larger than the typical one by this part at most, or by this
/// number of standard deviations of the noise.
const TOUCHING: f64 = 0.01;
const NOISES: f64 = 5.0;

/// Frames that discs stay together at least, the number after which more show nothing new, frames just after
/// the contact, in which the middle one of three may still be one before it, frames in a row at one distance
/// after which the pair has settled, and frames before the contact that give the closing speed.
const LEAST_FRAMES: usize = 24;
const MOST_FRAMES: usize = 120;
const SKIPPED: usize = 2;
const SETTLED: usize = 6;
const NEAR: usize = 12;

/// Standard error of a median over that of a mean, of normal errors.
const MEDIAN_ERROR: f64 = 1.2533;

impl Stuck {
    /// Returns how the discs stick together, as a clause.
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

    /// Returns how the discs of a shot stick together; `None` if they part.
    pub(super) fn find(shot: &TrackShot) -> Option<Self> {
        let distances = distances(shot);
        let middle = |run: &[(f64, f64)]| median(run.iter().map(|(_, d)| *d).collect());
        let nearest = (0..distances.len()).min_by(|i, j| distances[*i].1.total_cmp(&distances[*j].1))?;
        let distance = middle(&distances[nearest..distances.len().min(nearest + MOST_FRAMES)]);
        let noise = noise_of(&[&shot.cue, &shot.object], shot);
        let most = distance + (TOUCHING * distance).max(NOISES * noise);
        let first = distances.iter().position(|(_, d)| *d <= most)?;
        let frames = distances[first..].iter().take_while(|(_, d)| *d <= most).count();
        if first < LEAST || frames < LEAST_FRAMES + SKIPPED {
            return None;
        }
        let used = &distances[first + SKIPPED..first + frames.min(MOST_FRAMES + SKIPPED)];
        let closing = -median_slope(&distances[first.saturating_sub(NEAR)..first]);
        let third = used.len() / 3;
        let [early, between, late] = [0, 1, 2].map(|i| &used[i * third..(i + 1) * third]);
        let way = (late[0].0 - early[0].0) * closing;
        let growth = |early: &[(f64, f64)]| (middle(late) - middle(early)) / way;
        // a median of distances, each with the noise of two coordinates
        let error = MEDIAN_ERROR * noise * (2.0 * 2.0 / third as f64).sqrt() / way;
        // discs that met within the window and part again are as far apart in its first third as in its last
        let parting = growth(early).abs().max(growth(between).abs());
        if !(closing > 0.0 && parting + 3.0 * error < PARTING) {
            return None;
        }
        let touch = distances.iter().position(|(_, d)| *d <= distance + NOISES * noise)?;
        let is_near = |(_, d): &(f64, f64)| (d - distance).abs() <= NOISES * noise;
        let settled = distances[touch..].windows(SETTLED).position(|run| run.iter().all(is_near))?;
        Some(Self {
            distance,
            frames,
            to_the_end: first + frames == distances.len(),
            restitution: Measured { value: growth(early), sd: Some(error) },
            settling: [distances[touch].0, distances[touch + settled].0],
        })
    }
}
