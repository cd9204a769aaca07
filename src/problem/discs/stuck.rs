//! Discs that stick together after their impact, so that the distance of their centres stays.

use super::own::DISTANCE_SD;
use crate::film::frame_noise::noise;
use crate::film::meeting::{LEAST, NEAR, median_slope, smooth_distances};
use crate::measurement::dataset::Measured;
use crate::measurement::track::TrackShot;
use crate::numerics::{SIGNIFICANT, median, median_error};

/// How two discs stick together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stuck {
    /// Distance of the centres while they stick together, m.
    pub(crate) distance: f64,
    /// Number of frames after the impact in which they stay so.
    pub(crate) frames: usize,
    /// Whether these frames reach to the end of the tracks.
    pub(crate) to_the_end: bool,
    /// Growth rate of the distance over the closing speed, used instead of e.
    pub(crate) restitution: Measured,
    /// Instants at which they touch and from which on they are one rigid body, s.
    pub(crate) settling: [f64; 2],
}

/// Part of the closing speed with which discs that stick may part, three standard errors included.
/// Real discs that part do so at a third of this speed or more; glue and velcro yield by 0.02.
const PARTING: f64 = 0.02;

/// Frames that discs stay together at least, and the number after which more do not help; frames
/// just after the contact, in which the middle one of three may be one before it; and frames in a
/// row at one distance after which the pair has settled.
const LEAST_FRAMES: usize = 24;
const MOST_FRAMES: usize = 120;
const SKIPPED: usize = 2;
const SETTLED: usize = 6;

impl Stuck {
    /// Returns how the discs stick together, as a clause.
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
        let distances = smooth_distances(shot);
        let nearest = (0..distances.len()).min_by(|i, j| distances[*i].1.total_cmp(&distances[*j].1))?;
        let middle = |pairs: &[(f64, f64)]| median(pairs.iter().map(|pair| pair.1).collect());
        let distance = middle(&distances[nearest..distances.len().min(nearest + MOST_FRAMES)]);
        let noise = noise(shot);
        let most = distance + (DISTANCE_SD * distance).max(SIGNIFICANT * noise);
        let first = distances.iter().position(|(_, d)| *d <= most)?;
        let frames = distances[first..].iter().take_while(|(_, d)| *d <= most).count();
        if first < LEAST || frames < LEAST_FRAMES + SKIPPED {
            return None;
        }
        let used = &distances[first + SKIPPED..first + frames.min(MOST_FRAMES + SKIPPED)];
        let closing = -median_slope(&distances[first.saturating_sub(NEAR)..first]);
        let third = used.len() / 3;
        let growth = middle(&used[2 * third..]) - middle(&used[..third]);
        let way = (used[2 * third].0 - used[0].0) * closing;
        // a median of distances, each with the noise of two coordinates
        let error = median_error() * noise * (2.0 * 2.0 / third as f64).sqrt() / way;
        if !(closing > 0.0 && growth.abs() / way + 3.0 * error < PARTING) {
            return None;
        }
        let touch = distances.iter().position(|(_, d)| *d <= distance + SIGNIFICANT * noise)?;
        let is_near = |(_, d): &(f64, f64)| (d - distance).abs() <= SIGNIFICANT * noise;
        let settled = distances[touch..].windows(SETTLED).position(|run| run.iter().all(is_near))?;
        Some(Self {
            distance,
            frames,
            to_the_end: first + frames == distances.len(),
            restitution: Measured { value: growth / way, sd: Some(error) },
            settling: [distances[touch].0, distances[touch + settled].0],
        })
    }
}
