//! A first guess of the impact of two bodies: straight lines through the frames on both sides of
//! their nearest approach, and the instant at which their relative paths cross.

use nalgebra::Vector2;

use super::frame_noise::{COORDINATES, constant_axis, noise};
use super::unusable::{Bodies, Unusable};
use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::{SIGNIFICANT, median, median_error};

/// Least number of frames of each body on either side of the impact; a ball at rest is seen in one.
pub(crate) const LEAST: usize = 3;

/// Largest number of frames next to the impact that give a line.
pub(crate) const NEAR: usize = 12;

/// Largest median distance of frames from a line, in units of the noise: longer paths bend.
const MAX_RESIDUAL: f64 = 3.0;

/// Distance of the centres over the least one up to which an approach is a contact: the first one
/// counts.
const CONTACT: f64 = 1.2;

/// Largest gap between frames of a body, frames: programs follow bodies in turn, or in every second
/// frame.
const MAX_GAP: f64 = 4.5;

/// Frames, besides a gap in the tracks, by which the instant differs from that of the frame in
/// which the bodies are nearest.
const FARTHEST: f64 = 2.0;

/// Least speed of a moving object ball as a part of the cue ball's.
const MIN_MOVING_PART: f64 = 0.003;

type Point = Vector2<f64>;

/// A straight path: place and velocity at the instant that it was asked for.
pub(crate) type Line = [Point; 2];

/// Returns the line through samples by the median slope of their pairs (Theil and Sen): a few wrong
/// frames do not count.
pub(crate) fn line(samples: &[Sample], at: f64) -> Line {
    let [x, y] = COORDINATES.map(|pick| {
        let points: Vec<(f64, f64)> = samples.iter().map(|s| (s.t - at, pick(s))).collect();
        let slope = if points.len() > 1 { median_slope(&points) } else { 0.0 };
        [median(points.iter().map(|(t, x)| x - slope * t).collect()), slope]
    });
    [Point::new(x[0], y[0]), Point::new(x[1], y[1])]
}

/// Returns the median slope of pairs of numbers.
pub(crate) fn median_slope(points: &[(f64, f64)]) -> f64 {
    let pairs = points.iter().enumerate().flat_map(|(i, a)| points[i + 1..].iter().map(move |b| (a, b)));
    median(pairs.map(|(a, b)| (b.1 - a.1) / (b.0 - a.0)).collect())
}

/// Returns the distances of samples from a line at an instant.
pub(crate) fn residuals([place, velocity]: Line, at: f64, samples: &[Sample]) -> impl Iterator<Item = f64> {
    samples.iter().map(move |s| (Point::new(s.x, s.y) - place - velocity * (s.t - at)).norm())
}

/// Returns the samples before an instant and those after it, each half a frame away or more.
fn sides(samples: &[Sample], at: f64, frame: f64) -> [&[Sample]; 2] {
    let before = samples.partition_point(|s| s.t < at - 0.5 * frame);
    let after = samples.partition_point(|s| s.t < at + 0.5 * frame);
    [&samples[..before], &samples[after..]]
}

/// Returns the lines through the frames of a body next to an instant, before and after it, which
/// are straight but for the noise; or the side with fewer frames than the least number, and theirs.
pub(crate) fn lines_beside(
    samples: &[Sample],
    at: f64,
    (frame, noise): (f64, f64),
    least: [usize; 2],
) -> Result<[Line; 2], (usize, usize)> {
    let sides = sides(samples, at, frame);
    if let Some(side) = (0..2).find(|side| sides[*side].len() < least[*side]) {
        return Err((side, sides[side].len()));
    }
    Ok([0, 1].map(|after| {
        let side = sides[after];
        let near = |count: usize| if after == 1 { &side[..count] } else { &side[side.len() - count..] };
        let is_straight = |count: &usize| {
            let off = residuals(line(near(*count), at), at, near(*count)).collect();
            median(off) <= MAX_RESIDUAL * noise
        };
        let count = (LEAST..=NEAR.min(side.len())).rev().find(is_straight);
        line(near(count.unwrap_or(LEAST.min(side.len()))), at)
    }))
}

/// Returns the place of a body at an instant, between two of its frames if none is of that instant.
fn place_at(samples: &[Sample], t: f64, longest: f64) -> Option<Point> {
    let next = samples.partition_point(|s| s.t < t);
    let late = samples.get(next)?;
    let early = if late.t > t { samples.get(next.checked_sub(1)?)? } else { late };
    let place = Point::new(early.x, early.y);
    let part = if late.t > early.t { (t - early.t) / (late.t - early.t) } else { 0.0 };
    (late.t - early.t < longest).then(|| place.lerp(&Point::new(late.x, late.y), part))
}

/// Returns samples with each coordinate replaced by the middle one of three neighbours, which leaves
/// a straight path as it is.
fn without_leaps(samples: &[Sample]) -> Vec<Sample> {
    let mut smooth = samples.to_vec();
    for (sample, near) in smooth.iter_mut().skip(1).zip(samples.windows(3)) {
        [sample.x, sample.y] = COORDINATES.map(|pick| median(near.iter().map(pick).collect()));
    }
    smooth
}

/// Returns times and distances of both bodies, each the middle one of three neighbours, so that a
/// frame in which one was mistaken for the other does not count.
pub(crate) fn smooth_distances(shot: &TrackShot) -> Vec<(f64, f64)> {
    let [cue, object] = [&shot.cue, &shot.object].map(|samples| without_leaps(samples));
    let distance = |cue: &Sample| {
        let object = place_at(&object, cue.t, MAX_GAP / shot.fps)?;
        Some((cue.t, (object - Point::new(cue.x, cue.y)).norm()))
    };
    let distances: Vec<(f64, f64)> = cue.iter().filter_map(distance).collect();
    let middle = |three: &[(f64, f64)]| (three[1].0, median(three.iter().map(|pair| pair.1).collect()));
    distances.windows(3).map(middle).collect()
}

/// Returns the time at which the bodies are nearest, at the first of several contacts, s.
fn nearest(shot: &TrackShot) -> Option<f64> {
    let distances = smooth_distances(shot);
    let least = distances.iter().map(|(_, distance)| *distance).reduce(f64::min)?;
    let is_contact = |(_, distance): &&(f64, f64)| *distance <= CONTACT * least;
    let first = distances.iter().skip_while(|pair| !is_contact(pair)).take_while(is_contact);
    first.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(time, _)| *time)
}

/// Returns the frames of the cue ball before the bodies are nearest, without those that may be
/// later than the impact.
pub(super) fn arriving(shot: &TrackShot) -> &[Sample] {
    let until = nearest(shot).map_or(f64::NEG_INFINITY, |nearest| nearest - FARTHEST / shot.fps);
    &shot.cue[..shot.cue.partition_point(|sample| sample.t < until)]
}

/// Returns the speed between the medians of both halves of some samples, which resist a few wrong
/// frames, if it is significant. `step` is that of the coordinates' grid.
fn moving(samples: &[Sample], noise: f64, step: f64) -> Option<f64> {
    let halves = samples.split_at(samples.len() / 2);
    let [early, late] = [halves.0, halves.1].map(|half| {
        let middle = |pick: fn(&Sample) -> f64| median(half.iter().map(pick).collect());
        (middle(|s| s.t), Point::new(middle(|s| s.x), middle(|s| s.y)))
    });
    let counts = (halves.0.len() as f64).recip() + (halves.1.len() as f64).recip();
    let way = (late.1 - early.1).norm();
    // medians of rounded numbers differ by a whole step if the ball lies between two
    let rounded = step * std::f64::consts::SQRT_2;
    let is_moving = way - rounded > SIGNIFICANT * noise * median_error() * counts.sqrt();
    (samples.len() >= LEAST && is_moving).then(|| way / (late.0 - early.0))
}

/// A first guess of an impact, in the unit of the film: the lines of each body before and after it.
pub(crate) struct Meeting {
    /// Instant, s.
    pub(crate) time: f64,
    lines: [[Line; 2]; 2],
}

impl Meeting {
    /// Returns the lines of both bodies beside an instant.
    ///
    /// # Errors
    /// The frames are too few.
    pub(crate) fn beside(shot: &TrackShot, bodies: Bodies, time: f64) -> Result<Self, Unusable> {
        let how = (shot.fps.recip(), noise(shot));
        let [first, second] = [(0, &shot.cue), (1, &shot.object)].map(|(body, samples)| {
            let rests = bodies == Bodies::Balls && body == 1;
            let least = [if rests { 1 } else { LEAST }, LEAST];
            let too_few = |(side, frames): (usize, usize)| {
                let (body, when) = (bodies.names()[body], ["before", "after"][side]);
                Unusable::TooFew { body, when, frames, least: least[side] }
            };
            lines_beside(samples, time, how, least).map_err(too_few)
        });
        Ok(Self { time, lines: [first?, second?] })
    }

    /// Returns the meeting of the bodies of a shot, which part again.
    ///
    /// # Errors
    /// They do not, the frames are too few, or an object ball moves before.
    pub(crate) fn find(shot: &TrackShot, bodies: Bodies) -> Result<Self, Unusable> {
        let (tracks, frame) = ([&shot.cue, &shot.object], shot.fps.recip());
        if tracks.iter().any(|samples| samples.len() < 2 * LEAST) {
            return Err(Unusable::TooShort { bodies, frames: tracks.map(Vec::len), least: 2 * LEAST });
        }
        let nearest = nearest(shot).ok_or(Unusable::NoCollision(bodies))?;
        // correlated noise has a larger error
        let lasting_noise = noise(shot) * shot.frames_alike().sqrt();
        let object_speeds = |time: f64| {
            sides(&shot.object, time, frame).map(|side| moving(side, lasting_noise, shot.resolution[1]))
        };
        let is_struck = |time: f64| bodies == Bodies::Discs || object_speeds(time)[1].is_some();
        if !is_struck(nearest) {
            return Err(Unusable::NoCollision(bodies));
        }
        let steps = tracks.into_iter().flat_map(|samples| samples.windows(2)).map(|two| two[1].t - two[0].t);
        let farthest = steps.fold(FARTHEST * frame, f64::max);
        let mut meeting = Self::beside(shot, bodies, nearest)?.moved(farthest);
        if (meeting.time - nearest).abs() > FARTHEST * frame {
            // a body was not seen for long: frames of the other may have been on the wrong side
            meeting = Self::beside(shot, bodies, meeting.time)?.moved(farthest);
        }
        let is_moving = |speed: &f64| *speed > MIN_MOVING_PART * meeting.before(0)[1].norm();
        let speed = object_speeds(meeting.time)[0].filter(is_moving);
        if let Some(speed) = speed.filter(|_| bodies == Bodies::Balls) {
            return Err(Unusable::ObjectMoving { speed });
        }
        let [[apart, g], [apart_after, h]] = [0, 1].map(|side| meeting.relative(side));
        let is_met = match constant_axis(shot) {
            // marks on the edges that touch are at no distance
            Some(_) => g.dot(&h) < 0.0,
            None => apart.dot(&g) < 0.0 && apart_after.dot(&h) > 0.0,
        };
        if is_met && is_struck(meeting.time) { Ok(meeting) } else { Err(Unusable::NoCollision(bodies)) }
    }

    /// Returns place and velocity of a body before the impact.
    pub(crate) fn before(&self, body: usize) -> Line {
        self.lines[body][0]
    }

    /// Returns the way from the first centre to the second before (0) or after (1) the impact, and
    /// the velocity of the second body against the first.
    pub(crate) fn relative(&self, side: usize) -> Line {
        let [first, second] = self.lines.map(|sides| sides[side]);
        [second[0] - first[0], second[1] - first[1]]
    }

    /// Returns m₁/m₂ of which momentum is conserved along the line of centres.
    pub(crate) fn mass_ratio(&self) -> f64 {
        let across = self.relative(0)[0];
        let [first, second] = self.lines.map(|[before, after]| (after[1] - before[1]).dot(&across));
        -second / first
    }

    /// Returns the meeting at the instant, at most `farthest` (s) away, at which the relative paths
    /// before the impact and after it are nearest to each other: τ = −Δp·Δg/|Δg|² later.
    fn moved(mut self, farthest: f64) -> Self {
        let [before, after] = [0, 1].map(|side| self.relative(side));
        let [jump, turn] = [after[0] - before[0], after[1] - before[1]];
        let square = turn.norm_squared();
        let late = if square > 0.0 { -jump.dot(&turn) / square } else { 0.0 };
        let late = late.clamp(-farthest, farthest);
        self.time += late;
        for [place, velocity] in self.lines.iter_mut().flatten() {
            *place += *velocity * late;
        }
        self
    }
}
