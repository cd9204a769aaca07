//! A first guess of the impact of a shot, or the reason for its absence; and the part of each path
//! that belongs to the shot: balls that come off a cushion, or off another ball, shortly before or
//! after the impact have a corner in their path.

use nalgebra::{Matrix3, Matrix3x2, Vector2, Vector3};

use super::unusable::{Bodies, Unusable};
use crate::film::frame_noise::noise;
use crate::film::rigid_body::distances;
use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::{SIGNIFICANT, median, median_error};

/// Distance from its place of rest at which the object ball has moved, in standard deviations.
const MIN_MOVED_ERRORS: f64 = 6.0;

/// Minimum number of frames of each ball on either side, for a line and for a parabola.
const MIN_FRAMES: usize = 3;
const MIN_PARABOLA_FRAMES: usize = 5;

/// Number of frames next to the impact that give the first guess of a velocity.
const NEAR_FRAMES: usize = 12;

/// Largest root mean square residual of a path of the right shape, in units of the noise.
pub(super) const MAX_RESIDUAL: f64 = 3.0;

/// Least speed of a moving object ball as a part of the cue ball's.
const MIN_MOVING_PART: f64 = 0.003;

/// Steepest deceleration by a cloth, m/s²: a sliding friction of 0.4.
pub(super) const MAX_DECELERATION: f64 = 4.0;

type Point = Vector2<f64>;

/// First guess of an impact, in the unit of the film.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FirstGuess {
    /// Instant of the impact, s.
    pub(crate) time: f64,
    /// Place of the object ball before the impact.
    pub(crate) object: [f64; 2],
    /// Direction of the line of centres, rad.
    pub(crate) direction: f64,
    /// Velocity of the cue ball at the impact, along and across the line of centres.
    pub(crate) before: [f64; 2],
    /// Distance of the centres at the impact.
    pub(crate) distance: f64,
}

/// A straight line or a parabola through samples by least squares: place, velocity and acceleration
/// at a time.
pub(super) struct Path {
    at: f64,
    position: Point,
    pub(crate) velocity: Point,
    acceleration: Point,
    /// Standard error of the velocity for unit noise.
    error: f64,
}

fn place(sample: &Sample) -> Point {
    Point::new(sample.x, sample.y)
}

impl Path {
    /// Returns the path with (1) or without (0) an acceleration; `None` if the samples do not
    /// determine it.
    fn fit(samples: &[Sample], at: f64, bend: f64) -> Option<Self> {
        let powers = |s: &Sample| Vector3::new(1.0, s.t - at, 0.5 * bend * (s.t - at).powi(2));
        let mut normal = samples.iter().map(|s| powers(s) * powers(s).transpose()).sum::<Matrix3<f64>>();
        normal[(2, 2)] += 1.0 - bend;
        let moments = samples.iter().map(|s| powers(s) * place(s).transpose()).sum::<Matrix3x2<f64>>();
        let inverse = normal.try_inverse()?;
        let coefficients = inverse * moments;
        let [position, velocity, acceleration] = [0, 1, 2].map(|i| coefficients.row(i).transpose());
        let path = Self { at, position, velocity, acceleration, error: inverse[(1, 1)].sqrt() };
        (coefficients.iter().all(|c| c.is_finite()) && path.error.is_finite()).then_some(path)
    }

    /// Returns the line through samples, or a place at rest if all are of one instant.
    pub fn line(samples: &[Sample], at: f64) -> Self {
        let still = || {
            let position = samples.iter().map(place).sum::<Point>() / samples.len() as f64;
            let (velocity, acceleration) = (Point::zeros(), Point::zeros());
            Self { at, position, velocity, acceleration, error: f64::INFINITY }
        };
        Self::fit(samples, at, 0.0).unwrap_or_else(still)
    }

    /// Returns the path through samples, the nearest to the impact first, about a time: a straight
    /// line, or a parabola if the line's residuals exceed the noise.
    fn near(samples: &[Sample], at: f64, noise: f64) -> Self {
        let fits = |path: &Self, samples: &[Sample]| {
            let square = samples.iter().map(|sample| path.off(sample).powi(2)).sum::<f64>();
            (square / (2 * samples.len()) as f64).sqrt() <= MAX_RESIDUAL * noise
        };
        let straight = Self::line(samples, at);
        if fits(&straight, samples) {
            return straight;
        }
        // a ball that begins to roll, or lands, does not follow one parabola
        let parabola = |count: usize| {
            let bent = Self::fit(&samples[..count], at, 1.0);
            bent.filter(|bent| count == MIN_PARABOLA_FRAMES || fits(bent, &samples[..count]))
        };
        (MIN_PARABOLA_FRAMES..=samples.len()).rev().find_map(parabola).unwrap_or(straight)
    }

    fn off(&self, sample: &Sample) -> f64 {
        let t = sample.t - self.at;
        (place(sample) - self.position - self.velocity * t - self.acceleration * (0.5 * t * t)).norm()
    }

    /// Returns the largest distance of a sample from the path.
    pub(crate) fn largest_residual(&self, samples: &[Sample]) -> f64 {
        samples.iter().map(|sample| self.off(sample)).fold(0.0, f64::max)
    }

    /// Returns the time at which the path is nearest to a place.
    fn passes(&self, place: Point) -> Option<f64> {
        /// Newton steps after which the correction of a parabola is far below the noise.
        const STEPS: usize = 8;
        let mut t = 0.0;
        for _ in 0..STEPS {
            let velocity = self.velocity + self.acceleration * t;
            let position = self.position + (self.velocity + self.acceleration * (0.5 * t)) * t;
            t -= (position - place).dot(&velocity) / velocity.norm_squared();
        }
        t.is_finite().then_some(self.at + t)
    }
}

/// Returns the samples without those that stand alone: others fit the two before or after them, as
/// a good one at the impact does.
fn steady(samples: &[Sample], noise: f64) -> Vec<Sample> {
    let fits = |s: &Sample, near: &Sample, far: &Sample| {
        let part = (s.t - near.t) / (near.t - far.t);
        let off = (place(s) - place(near) - (place(near) - place(far)) * part).amax();
        // s − near − (near − far) part, of three independent numbers
        let error = noise * (1.0 + (1.0 + part).powi(2) + part * part).sqrt();
        off <= SIGNIFICANT * error + MAX_DECELERATION * (s.t - far.t).powi(2)
    };
    let before = |i: usize| i >= 2 && fits(&samples[i], &samples[i - 1], &samples[i - 2]);
    let after = |i: usize| i + 2 < samples.len() && fits(&samples[i], &samples[i + 1], &samples[i + 2]);
    (0..samples.len()).filter(|i| before(*i) || after(*i)).map(|i| samples[i]).collect()
}

/// Returns the medians of x and of y.
fn middle(samples: &[Sample]) -> Point {
    Point::new(median(samples.iter().map(|s| s.x).collect()), median(samples.iter().map(|s| s.y).collect()))
}

/// Returns the speed between the medians of both halves of some samples, which resist a few wrong
/// frames, its standard error for unit noise, and the time between the halves.
fn robust_speed(samples: &[Sample]) -> [f64; 3] {
    let (early, late) = samples.split_at(samples.len() / 2);
    let time = |half: &[Sample]| median(half.iter().map(|s| s.t).collect());
    let seconds = time(late) - time(early);
    let counts = (early.len() as f64).recip() + (late.len() as f64).recip();
    [(middle(late) - middle(early)).norm() / seconds, median_error() * counts.sqrt() / seconds, seconds]
}

/// Returns the time at which the balls are nearest, s: the time of contact for any scale.
fn nearest(cue: &[Sample], object: &[Sample]) -> Option<f64> {
    distances(cue, object).into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).map(|(time, _)| time)
}

/// Returns the reason for too few frames before the impact: the object ball moves before the balls
/// touch, as far as frames show both, or a ball is not seen.
fn without_start(cue: &[Sample], object: &[Sample], until: f64, noise: f64) -> Unusable {
    let touch = nearest(cue, object).unwrap_or(f64::NEG_INFINITY);
    let free = &object[..object.partition_point(|s| s.t < touch)];
    if free.len() >= MIN_FRAMES {
        let line = Path::line(free, object[0].t);
        let speed = line.velocity.norm();
        let arriving = Path::line(&cue[..cue.len().min(NEAR_FRAMES)], object[0].t).velocity.norm();
        if speed > SIGNIFICANT * noise * line.error && speed > MIN_MOVING_PART * arriving {
            return Unusable::ObjectMoving { speed };
        }
    }
    // its track may begin only at the impact
    match cue.iter().filter(|s| s.t < until).count() {
        few if few < MIN_FRAMES => Unusable::too_few(Bodies::Balls, [0, 0], few, MIN_FRAMES),
        _ => Unusable::too_few(Bodies::Balls, [1, 0], 0, 1),
    }
}

/// Returns the time before which all frames show the balls before the impact (s), and the speed of
/// the cue ball at the impact (m/s). If the noise hides whether the object ball was at rest, the
/// time is somewhat earlier than that of least distance, and the speed 0.
pub(super) fn approach(shot: &TrackShot) -> Option<[f64; 2]> {
    if let Ok(FirstGuess { time, before, .. }) = from_paths(shot, noise(shot)) {
        return Some([time, before[0].hypot(before[1])]);
    }
    Some([nearest(&shot.cue, &shot.object)? - LAG_FRAMES / shot.fps, 0.0])
}

/// Returns the first guess from lines and parabolas through the frames next to the impact.
///
/// # Errors
/// The balls do not meet, the frames are too few, or the object ball moves before.
pub(crate) fn from_paths(shot: &TrackShot, noise: f64) -> Result<FirstGuess, Unusable> {
    let bodies = Bodies::Balls;
    let (cue, object) = (steady(&shot.cue, noise), steady(&shot.object, noise));
    if cue.len() < 2 * MIN_FRAMES || object.len() < 2 * MIN_FRAMES {
        let frames = [shot.cue.len(), shot.object.len()];
        return Err(Unusable::TooShort { bodies, frames, least: 2 * MIN_FRAMES });
    }
    let lay = middle(&object[..MIN_FRAMES + 2.min(object.len() - MIN_FRAMES)]);
    let away = |s: &Sample| (place(s) - lay).norm();
    // from here on: the next two frames are still further away, or as far on a coarse grid
    let moved = |w: &[Sample]| {
        away(&w[0]) > MIN_MOVED_ERRORS * noise && away(&w[1]) >= away(&w[0]) && away(&w[2]) >= away(&w[1])
    };
    let index = object.windows(3).position(moved).ok_or(Unusable::NoCollision(bodies))?;
    let after = &object[index..object.len().min(index + NEAR_FRAMES)];
    let start = Path::line(&object[..MIN_FRAMES], object[0].t);
    // correlated noise has a larger error
    let lasts = shot.frames_alike().sqrt();
    if index < NEAR_FRAMES && start.velocity.norm() > MIN_MOVED_ERRORS * noise * lasts * start.error {
        return Err(without_start(&cue, &object, object[0].t, noise));
    }
    let time = Path::near(after, after[0].t, noise).passes(lay).ok_or(Unusable::NoCollision(bodies))?;

    let half = 0.5 / shot.fps;
    let before = &object[..object.partition_point(|s| s.t < time - half)];
    let cue_before = &cue[..cue.partition_point(|s| s.t < time - half)];
    let after = cue.iter().filter(|s| s.t > time + half).take(NEAR_FRAMES).count();
    if before.is_empty() || cue_before.len() < MIN_FRAMES {
        return Err(without_start(&cue, &object, time - half, noise));
    }
    if after < MIN_FRAMES {
        return Err(Unusable::too_few(bodies, [0, 1], after, MIN_FRAMES));
    }
    let arriving: Vec<Sample> = cue_before.iter().rev().take(NEAR_FRAMES).copied().collect();
    let arriving = Path::near(&arriving, time, noise);
    if before.len() >= MIN_FRAMES {
        let [drift, error, seconds] = robust_speed(before);
        // medians of rounded numbers differ by a whole step if the ball lies between two
        let rounded = shot.resolution[1] * std::f64::consts::SQRT_2 / seconds;
        let is_significant = drift - rounded > SIGNIFICANT * noise * lasts * error;
        if is_significant && drift > MIN_MOVING_PART * arriving.velocity.norm() {
            return Err(Unusable::ObjectMoving { speed: drift });
        }
    }
    let lay = middle(before);
    let across = lay - arriving.position;
    let distance = across.norm();
    let normal = across / distance;
    let before = [arriving.velocity.dot(&normal), normal.perp(&arriving.velocity)];
    if !(before[0] > 0.0) {
        return Err(Unusable::NoCollision(bodies));
    }
    Ok(FirstGuess { time, object: lay.into(), direction: normal.y.atan2(normal.x), before, distance })
}

/// Frames on either side of a corner with a line each; longer lines show gentler corners.
const SIDE_FRAMES: usize = 4;
const LONG_SIDE_FRAMES: usize = 12;

/// Least change of velocity at a corner before the impact, as a part of the speed at the impact:
/// the cloth changes the velocity by less than 2 % in as many frames, at 100 frames per second and
/// 1 m/s.
const MIN_TURN: f64 = 0.2;

/// Least change of velocity at a corner, in standard errors of the difference of two slopes.
const MIN_TURN_ERRORS: f64 = 8.0;

/// Largest distance from the lines, as a part of the change of velocity times a frame: a frame that
/// was dropped within a side leaves 0.75 or more.
const MAX_CORNER_RESIDUAL: f64 = 0.5;

/// Frames next to the impact that are not searched for a corner: a tracker may lag as long.
const LAG_FRAMES: f64 = 8.0;

/// Least change of velocity at a corner after the impact, as a part of the incoming speed: a ball
/// that lands loses less than 0.015.
const MIN_TURN_AFTER: f64 = 0.03;

/// Removes the cue ball's frames up to the last corner before the impact, in the last of which it
/// may still touch the cushion or ball that turned it; returns whether a corner exists.
pub(crate) fn leave_out_before_cushion(shot: &mut TrackShot) -> bool {
    let Some([until, speed]) = approach(shot) else { return false };
    let before = &shot.cue[..shot.cue.partition_point(|sample| sample.t < until - 0.5 / shot.fps)];
    let noise = (shot.fps, noise(shot));
    let corner = corner(before, SIDE_FRAMES, noise, (MIN_TURN * speed, 0.0), <[Corner]>::last);
    let Some(until) = corner.map(|corner| before[corner].t) else { return false };
    shot.cue.retain(|sample| sample.t > until);
    true
}

/// Removes a ball's frames from the first corner after the impact on; returns whether one exists.
/// The radius of the balls is in m.
pub(crate) fn leave_out_after_cushion(shot: &mut TrackShot, radius: f64) -> bool {
    // correlated noise bends paths more
    let noise = noise(shot) * shot.frames_alike().sqrt();
    let Ok(guess) = from_paths(shot, noise) else { return false };
    let fps = shot.fps;
    let incoming = guess.before[0].hypot(guess.before[1]);
    let cloth = MAX_DECELERATION * guess.distance / (2.0 * radius);
    let first = |samples: &[Sample], side: usize| {
        let after = &samples[samples.partition_point(|sample| sample.t < guess.time + LAG_FRAMES / fps)..];
        let least = (MIN_TURN_AFTER * incoming).max(cloth * side as f64 / fps);
        let limits = (least, SIGNIFICANT * noise);
        // in the frame before it the ball may touch already
        Some(after[corner(after, side, (fps, noise), limits, <[Corner]>::first)? - 1].t)
    };
    let mut ends = 0;
    for samples in [&mut shot.cue, &mut shot.object] {
        if let Some(end) = first(samples, SIDE_FRAMES).or_else(|| first(samples, LONG_SIDE_FRAMES)) {
            samples.retain(|sample| sample.t < end);
            ends += 1;
        }
    }
    ends > 0
}

/// A corner of a path: the index of the first frame after it, and the change of velocity, m/s.
struct Corner {
    at: usize,
    change: f64,
}

/// Returns the index of the first frame after the corner of a path that is picked among all, between
/// lines through `side` frames on either side, with a change of velocity (m/s) of at least `least`;
/// `white` is the largest residual (m) of the lines in excess of the part that the change explains.
fn corner(
    samples: &[Sample],
    side: usize,
    (fps, noise): (f64, f64),
    (least, white): (f64, f64),
    pick: fn(&[Corner]) -> Option<&Corner>,
) -> Option<usize> {
    // of a least-squares slope, per frame, and of the difference of two
    let n = side as f64;
    let error = MIN_TURN_ERRORS * noise * (24.0 / (n * (n * n - 1.0))).sqrt();
    let turn = |at: usize| {
        let sides = [&samples[at - side..at], &samples[at..at + side]];
        let [early, late] = sides.map(|side| Path::line(side, side[0].t));
        let off = early.largest_residual(sides[0]).max(late.largest_residual(sides[1]));
        let change = (late.velocity - early.velocity).norm();
        let is_corner =
            change > least && change / fps > error && off < MAX_CORNER_RESIDUAL * change / fps + white;
        is_corner.then_some(Corner { at, change })
    };
    let corners: Vec<Corner> = (side..(samples.len() + 1).saturating_sub(side)).filter_map(turn).collect();
    // it is seen at neighbouring places, too: the largest change is the right one
    let place = pick(&corners)?.at;
    let near = corners.iter().filter(|corner| corner.at.abs_diff(place) < side);
    near.max_by(|a, b| a.change.total_cmp(&b.change)).map(|corner| corner.at)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One wrong frame, 17 standard deviations off, does not move a ball at rest: 20 frames at 500
    /// frames/s. Lengths are in standard deviations.
    #[test]
    fn a_wrong_frame_does_not_move_a_ball_that_lies() {
        let filmed = |speed: f64| -> Vec<Sample> {
            let wrong = |n: usize| if n == 19 { 17.0 } else { 0.0 };
            let frame = |n: usize| (n as f64 / 500.0, 1300.0 + speed * n as f64 / 500.0 + wrong(n));
            (0..20).map(frame).map(|(t, x)| Sample::new(t, [x, 700.0])).collect()
        };
        for (speed, moves) in [(0.0, false), (330.0, true)] {
            let [found, error, _] = robust_speed(&filmed(speed));
            assert_eq!(found > SIGNIFICANT * error, moves, "{speed}");
        }
        let straight = Path::line(&filmed(0.0), 0.0);
        assert!(straight.velocity[0] > SIGNIFICANT * straight.error);
    }
}
