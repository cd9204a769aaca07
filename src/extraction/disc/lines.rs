//! Straight lines through the frames of a disc, and its distance from the other one.

use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::median;

/// Of each disc on either side of the impact.
pub(super) const LEAST: usize = 4;

/// Times and distances of the centres, in the frames that have both, each the middle one of three neighbours.
pub(super) fn distances(shot: &TrackShot) -> Vec<(f64, f64)> {
    let mut distances = Vec::new();
    for a in &shot.cue {
        // a rolling shutter reads one disc a little earlier than the other
        let i = shot.object.partition_point(|b| b.t < a.t);
        let around = i.checked_sub(1).into_iter().chain([i]).filter_map(|i| shot.object.get(i));
        let nearest = around.min_by(|b, c| (b.t - a.t).abs().total_cmp(&(c.t - a.t).abs()));
        if let Some(b) = nearest.filter(|b| (b.t - a.t).abs() * shot.fps < 0.25) {
            distances.push((a.t, (b.x - a.x).hypot(b.y - a.y)));
        }
    }
    let middle = |three: &[(f64, f64)]| (three[1].0, median(three.iter().map(|one| one.1).collect()));
    distances.windows(3).map(middle).collect()
}

#[derive(Clone, Copy, Default)]
pub(super) struct Line {
    pub position: [f64; 2],
    pub velocity: [f64; 2],
}

impl Line {
    /// By medians (Theil and Sen): wrong frames do not count.
    pub(super) fn through(samples: &[Sample], at: f64) -> Self {
        let mut line = Self::default();
        for (k, pick) in [(0, (|s: &Sample| s.x) as fn(&Sample) -> f64), (1, |s| s.y)] {
            let pairs =
                samples.iter().enumerate().flat_map(|(i, a)| samples[i + 1..].iter().map(move |b| (a, b)));
            let slope = median(pairs.map(|(a, b)| (pick(b) - pick(a)) / (b.t - a.t)).collect());
            line.velocity[k] = slope;
            line.position[k] = median(samples.iter().map(|s| pick(s) - slope * (s.t - at)).collect());
        }
        line
    }
}
