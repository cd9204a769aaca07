//! The points that are followed on discs: their centres, and marks that go round them.

use super::lines::Line;
use crate::extraction::{Bodies, Unusable};
use crate::film::rigid_body::circle_centres;
use crate::measurement::track::{Sample, TrackShot, TrackedBall};
use crate::numerics::median;

/// The discs, in the order of all that is said of both.
pub(super) const DISCS: [TrackedBall; 2] = [TrackedBall::Cue, TrackedBall::Object];

/// Positions that differ by less are the same, m.
const SAME: f64 = 1e-9;

/// Part by which distances between points of one disc change at most: a camera that leans by 25° shortens
/// them by as much in one direction.
const NOT_RIGID: f64 = 0.1;

/// Frames on either side of the impact that are looked at.
const NEAR: f64 = 60.0;

/// Part of the distances at either end that is not counted, for frames in which a point was mistaken.
const TAIL: f64 = 0.1;

/// Frames with both points that are needed.
const LEAST: usize = 8;

/// Returns the positions of a disc's centre.
pub(super) fn centre(shot: &TrackShot, disc: TrackedBall) -> &[Sample] {
    match disc {
        TrackedBall::Cue => &shot.cue,
        TrackedBall::Object => &shot.object,
    }
}

/// Returns the positions of the points on a disc.
pub(super) fn points(shot: &TrackShot, disc: TrackedBall) -> Vec<&[Sample]> {
    let own = shot.markers.iter().filter(|marker| marker.ball == disc);
    own.map(|marker| marker.samples.as_slice()).collect()
}

/// Returns whether the centre of a disc was computed from the points on it, as films are loaded if three
/// or more points are on a circle about it.
pub(super) fn is_of_points(shot: &TrackShot, disc: TrackedBall) -> bool {
    let centre = centre(shot, disc);
    let Ok(circle) = circle_centres(&points(shot, disc)) else { return false };
    circle.len() == centre.len()
        && circle.iter().zip(centre).all(|(a, b)| (a.x - b.x).hypot(a.y - b.y) < SAME && a.t == b.t)
}

/// Checks that the points of either disc move as one rigid body near the impact, or else in all frames.
///
/// # Errors
/// They do not.
pub(super) fn check_rigidity(shot: &TrackShot, impact: Option<f64>) -> Result<(), Unusable> {
    let reach = NEAR / shot.fps;
    let [from, to] = impact.map_or([f64::NEG_INFINITY, f64::INFINITY], |time| [time - reach, time + reach]);
    for (ball, disc) in DISCS.into_iter().zip(Bodies::Discs.names()) {
        let own: Vec<_> = shot.markers.iter().filter(|marker| marker.ball == ball).collect();
        let pairs = own.iter().enumerate().flat_map(|(i, a)| own[i + 1..].iter().map(move |b| (a, b)));
        let changes = pairs.filter_map(|(a, b)| {
            let [least, most] = extent(&a.samples, &b.samples, [from, to])?;
            Some((2.0 * (most - least) / (most + least), [least, most], a, b))
        });
        let worst = changes.max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, [least, most], a, b)) = worst.filter(|(change, ..)| *change > NOT_RIGID) {
            return Err(Unusable::NotRigid {
                disc,
                first: a.name.clone(),
                second: b.name.clone(),
                least_mm: 1e3 * least,
                most_mm: 1e3 * most,
            });
        }
    }
    Ok(())
}

/// Returns the least and the largest distance of two points in the frames that have both, without the
/// tails.
fn extent(a: &[Sample], b: &[Sample], [from, to]: [f64; 2]) -> Option<[f64; 2]> {
    let mut distances = Vec::new();
    for sample in a.iter().filter(|sample| (from..=to).contains(&sample.t)) {
        let i = b.partition_point(|other| other.t < sample.t);
        if let Some(other) = b.get(i).filter(|other| other.t == sample.t) {
            distances.push((other.x - sample.x).hypot(other.y - sample.y));
        }
    }
    if distances.len() < LEAST {
        return None;
    }
    distances.sort_by(f64::total_cmp);
    let tail = (TAIL * distances.len() as f64) as usize;
    Some([distances[tail], distances[distances.len() - 1 - tail]])
}

/// How a marker goes round its disc.
pub(super) struct Turning {
    /// Angular velocities before and after the impact, rad/s.
    pub rates: [f64; 2],
    /// Direction from the centre at the impact, rad.
    pub direction: f64,
    /// Distance from the centre, m.
    pub radius: f64,
}

impl Turning {
    /// Returns how a marker turns about the centre of its disc, less than half a turn a frame; `None` if
    /// it was seen in too few frames.
    pub fn of(marker: &[Sample], centre: &[Sample], time: f64, fps: f64) -> Option<Self> {
        let mut arms: Vec<Sample> = Vec::new();
        for seen in marker {
            let i = centre.partition_point(|centre| centre.t < seen.t);
            let Some(middle) = centre.get(i).filter(|centre| centre.t == seen.t) else { continue };
            let [x, y] = [seen.x - middle.x, seen.y - middle.y];
            let last = arms.last().map_or(0.0, |last| last.x);
            let turn = (y.atan2(x) - last).rem_euclid(std::f64::consts::TAU);
            let turn = if turn > std::f64::consts::PI { turn - std::f64::consts::TAU } else { turn };
            arms.push(Sample::new(seen.t, [last + turn, x.hypot(y)]));
        }
        let [before, after] = Line::beside(&arms, time, fps.recip());
        let (before, after) = (before.ok()?, after.ok()?);
        Some(Self {
            rates: [before.velocity[0], after.velocity[0]],
            direction: before.position[0],
            radius: median(arms.iter().map(|arm| arm.y).collect()),
        })
    }
}
