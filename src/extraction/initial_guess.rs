//! A first guess of how the balls of a shot meet, and the shots that have none.

use nalgebra::{Matrix3, Vector3};

use super::unusable::{Bodies, Unusable};
use super::wrong_frames::steady;
use crate::film::frame_noise::noise;
use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::median;
use crate::physics::ball::Ball;

/// The object ball has moved when it is this many standard deviations away from where it lay.
const MOVED: f64 = 6.0;

/// Of each ball before and after the impact, to fit a line with something to spare.
const LEAST_FRAMES: usize = 3;

/// So many frames next to the impact give the first guess of a velocity.
const NEAR: usize = 12;

/// The object ball counts as moving before the impact when its speed is this many standard errors
/// and this part of the cue ball's.
const MOVING_ERRORS: f64 = 5.0;
const MOVING_PART: f64 = 0.01;

/// How the balls of a shot meet, in the unit of the film.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FirstGuess {
    /// Instant of the impact, s.
    pub time: f64,
    /// Place where the object ball lies before it.
    pub object: [f64; 2],
    /// Direction of the line of centres, rad.
    pub direction: f64,
    /// Velocity of the cue ball at the impact, along and across the line of centres.
    pub before: [f64; 2],
    /// Distance of the centres at the impact.
    pub distance: f64,
}

/// A straight line through samples by least squares.
pub(super) struct Line {
    /// At the instant that it was asked for.
    position: [f64; 2],
    pub velocity: [f64; 2],
    /// Standard error of the velocity for unit noise.
    error: f64,
    at: f64,
}

impl Line {
    pub fn through(samples: &[Sample], at: f64) -> Self {
        let n = samples.len() as f64;
        let mean_t = samples.iter().map(|s| s.t).sum::<f64>() / n;
        let spread: f64 = samples.iter().map(|s| (s.t - mean_t).powi(2)).sum();
        let fit = |pick: fn(&Sample) -> f64| {
            let mean = samples.iter().map(pick).sum::<f64>() / n;
            let moment: f64 = samples.iter().map(|s| (s.t - mean_t) * (pick(s) - mean)).sum();
            let velocity = if spread > 0.0 { moment / spread } else { 0.0 };
            (mean + velocity * (at - mean_t), velocity)
        };
        let ((x, vx), (y, vy)) = (fit(|s| s.x), fit(|s| s.y));
        let error = if spread > 0.0 { 1.0 / spread.sqrt() } else { f64::INFINITY };
        Self { position: [x, y], velocity: [vx, vy], error, at }
    }

    pub fn speed(&self) -> f64 {
        self.velocity[0].hypot(self.velocity[1])
    }

    /// Returns the largest distance of a sample from the line.
    pub fn largest_residual(&self, samples: &[Sample]) -> f64 {
        let distance = |s: &Sample| {
            let [x, y] = [0, 1].map(|k| self.position[k] + self.velocity[k] * (s.t - self.at));
            (s.x - x).hypot(s.y - y)
        };
        samples.iter().map(distance).fold(0.0, f64::max)
    }
}

/// Residuals of a line that are larger than this many times the noise are a bend.
const BENT: f64 = 3.0;

/// Of a parabola, to fit it with something to spare.
const LEAST_OF_PARABOLA: usize = 5;

/// Where a ball is next to the impact: a straight line through some frames, or where these are so far apart in time that the path bends
/// by more than their noise, a parabola.
struct Near {
    from: f64,
    position: [f64; 2],
    velocity: [f64; 2],
    acceleration: [f64; 2],
}

impl Near {
    /// Through samples, the nearest to the impact first, as it is at a time.
    fn new(samples: &[Sample], at: f64, noise: f64) -> Self {
        let Line { position, velocity, .. } = Line::through(samples, at);
        let straight = Self { from: at, position, velocity, acceleration: [0.0; 2] };
        if straight.rms(samples) <= BENT * noise || samples.len() < LEAST_OF_PARABOLA {
            return straight;
        }
        // a ball that begins to roll, or lands, is on no one parabola
        let mut count = samples.len();
        loop {
            let Some(bent) = Self::parabola(&samples[..count], at) else { return straight };
            if bent.rms(&samples[..count]) <= BENT * noise || count == LEAST_OF_PARABOLA {
                return bent;
            }
            count -= 1;
        }
    }

    fn parabola(samples: &[Sample], at: f64) -> Option<Self> {
        let rows = |s: &Sample| Vector3::new(1.0, s.t - at, 0.5 * (s.t - at).powi(2));
        let normal = samples.iter().map(|s| rows(s) * rows(s).transpose()).sum::<Matrix3<f64>>();
        let solve = |pick: fn(&Sample) -> f64| {
            let moments = samples.iter().map(|s| rows(s) * pick(s)).sum::<Vector3<f64>>();
            normal.lu().solve(&moments).filter(|found| found.iter().all(|c| c.is_finite()))
        };
        let (x, y) = (solve(|s| s.x)?, solve(|s| s.y)?);
        Some(Self { from: at, position: [x[0], y[0]], velocity: [x[1], y[1]], acceleration: [x[2], y[2]] })
    }

    fn position(&self, time: f64) -> [f64; 2] {
        let t = time - self.from;
        [0, 1].map(|i| self.position[i] + t * (self.velocity[i] + 0.5 * t * self.acceleration[i]))
    }

    fn velocity(&self, time: f64) -> [f64; 2] {
        let t = time - self.from;
        [0, 1].map(|i| self.velocity[i] + t * self.acceleration[i])
    }

    fn rms(&self, samples: &[Sample]) -> f64 {
        let off = |s: &Sample| {
            let [x, y] = self.position(s.t);
            (x - s.x).powi(2) + (y - s.y).powi(2)
        };
        (samples.iter().map(off).sum::<f64>() / (2 * samples.len()) as f64).sqrt()
    }

    /// When it passes a place: where it is nearest to it.
    fn passes(&self, place: [f64; 2]) -> Option<f64> {
        /// The next correction of a parabola is far below the noise.
        const STEPS: usize = 8;
        let mut time = self.from;
        for _ in 0..STEPS {
            let ([x, y], [vx, vy]) = (self.position(time), self.velocity(time));
            let square = vx * vx + vy * vy;
            if !(square > 0.0) {
                return None;
            }
            time -= ((x - place[0]) * vx + (y - place[1]) * vy) / square;
        }
        time.is_finite().then_some(time)
    }
}

/// Speed from the medians of both halves of some samples, which a few wrong frames do not move, its standard error for unit
/// noise, and the time between the halves.
fn robust_speed(samples: &[Sample]) -> (f64, f64, f64) {
    // the median of many numbers errs by this times as much as their mean
    let of_median = std::f64::consts::FRAC_PI_2.sqrt();
    let halves = samples.split_at(samples.len() / 2);
    let of = |half: &[Sample]| {
        [|s: &Sample| s.t, |s: &Sample| s.x, |s: &Sample| s.y]
            .map(|pick| median(half.iter().map(pick).collect()))
    };
    let ([t, x, y], [later, then_x, then_y]) = (of(halves.0), of(halves.1));
    let counts = [halves.0.len(), halves.1.len()].map(|count| (count as f64).recip());
    let seconds = later - t;
    let error = of_median * (counts[0] + counts[1]).sqrt() / seconds;
    ((then_x - x).hypot(then_y - y) / seconds, error, seconds)
}

/// How far the cue ball is from the object ball in this frame.
fn apart(cue: &[Sample], object: &Sample) -> Option<f64> {
    let other = cue.iter().find(|c| (c.t - object.t).abs() < 1e-6)?;
    Some((object.x - other.x).hypot(object.y - other.y))
}

/// When the balls are nearest to each other, s: when they touch, whatever the scale.
fn nearest(cue: &[Sample], object: &[Sample]) -> Option<f64> {
    let distances = object.iter().filter_map(|s| Some((s.t, apart(cue, s)?)));
    distances.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(time, _)| time)
}

/// The speed of an object ball that moves before the balls touch, as far as frames show both.
fn drifts(cue: &[Sample], object: &[Sample], ball: &Ball, noise: f64) -> Option<f64> {
    let touch = nearest(cue, object)?;
    let is_clear = |s: &Sample| apart(cue, s).is_none_or(|apart| apart > 2.0 * ball.radius + MOVED * noise);
    let free = |s: &&Sample| s.t < touch && is_clear(s);
    let before: Vec<Sample> = object.iter().take_while(free).copied().collect();
    if before.len() < LEAST_FRAMES {
        return None;
    }
    let line = Line::through(&before, before[0].t);
    let speed = line.speed();
    (speed > MOVING_ERRORS * noise * line.error).then_some(speed)
}

/// An instant before which all frames show the balls before the impact, s. Where the noise hides whether the object ball lay at rest, so
/// that the impact is not found, it is somewhat earlier than when the balls are nearest to each other.
pub(crate) fn surely_before(shot: &TrackShot, ball: &Ball) -> Option<f64> {
    /// Of the time from the first frame until the balls are nearest to each other.
    const FREE: f64 = 0.9;
    let until = || {
        let first = shot.cue.first()?.t;
        Some(first + FREE * (nearest(&shot.cue, &shot.object)? - first))
    };
    from_paths(shot, ball, noise(shot)).ok().map(|guess| guess.time).or_else(until)
}

/// The speed of the object ball before the balls are nearest to each other, m/s, and as a part of the cue ball's, where it surely moves and
/// that part is below the most.
pub(crate) fn object_speed(shot: &TrackShot, most: f64) -> Option<(f64, f64)> {
    /// Of the frames until then: in the last ones it may have been hit.
    const FREE: f64 = 0.75;
    let noise = noise(shot);
    let (cue, object) = (steady(&shot.cue, noise), steady(&shot.object, noise));
    let touch = nearest(&cue, &object)?;
    let until = |samples: &[Sample]| {
        let count = samples.iter().take_while(|s| s.t < touch).count();
        samples[..(FREE * count as f64) as usize].to_vec()
    };
    let (cue, object) = (until(&cue), until(&object));
    let speed = surely_moves(shot, &object, noise)?;
    let (of_cue, ..) = (cue.len() >= LEAST_FRAMES).then(|| robust_speed(&cue))?;
    (speed < most * of_cue).then_some((speed, speed / of_cue))
}

/// The speed of a ball in these frames, m/s, if it is no chance.
fn surely_moves(shot: &TrackShot, samples: &[Sample], noise: f64) -> Option<f64> {
    if samples.len() < LEAST_FRAMES {
        return None;
    }
    let (speed, error, seconds) = robust_speed(samples);
    // medians of rounded numbers differ by a whole step where the ball lies between two
    let rounded = shot.resolution[1] * std::f64::consts::SQRT_2 / seconds;
    // noise that lasts from frame to frame tells less
    let lasts = shot.frames_alike().sqrt();
    (speed - rounded > MOVING_ERRORS * noise * lasts * error).then_some(speed)
}

/// Of the cue ball, or else of the object ball, which is not seen at rest.
fn too_few_before(cue: usize) -> Unusable {
    if cue < LEAST_FRAMES {
        Unusable::too_few(Bodies::Balls, [0, 0], cue, LEAST_FRAMES)
    } else {
        Unusable::too_few(Bodies::Balls, [1, 0], 0, 1)
    }
}

/// Returns how the balls meet by lines and parabolas through the frames next to the impact.
///
/// # Errors
/// They do not, the frames are too few, or the object ball moves before.
pub(crate) fn from_paths(shot: &TrackShot, ball: &Ball, noise: f64) -> Result<FirstGuess, Unusable> {
    let (cue, object) = (steady(&shot.cue, noise), steady(&shot.object, noise));
    if cue.len() < 2 * LEAST_FRAMES || object.len() < 2 * LEAST_FRAMES {
        return Err(Unusable::TooShort {
            bodies: Bodies::Balls,
            frames: [shot.cue.len(), shot.object.len()],
            least: 2 * LEAST_FRAMES,
        });
    }
    let first = &object[..LEAST_FRAMES + 2.min(object.len() - LEAST_FRAMES)];
    let lay = [median(first.iter().map(|s| s.x).collect()), median(first.iter().map(|s| s.y).collect())];
    let away = |s: &Sample| (s.x - lay[0]).hypot(s.y - lay[1]);
    // for good: the next two frames are still further away, or as far on a coarse grid
    let moved = |w: &[Sample]| {
        away(&w[0]) > MOVED * noise && away(&w[1]) >= away(&w[0]) && away(&w[2]) >= away(&w[1])
    };
    let index = object.windows(3).position(moved).ok_or(Unusable::NoCollision(Bodies::Balls))?;
    let after = &object[index..object.len().min(index + NEAR)];
    if after.len() < LEAST_FRAMES {
        return Err(Unusable::too_few(Bodies::Balls, [1, 1], after.len(), LEAST_FRAMES));
    }
    let moving = Near::new(after, after[0].t, noise);
    let start = Line::through(&object[..LEAST_FRAMES], object[0].t);
    let drift = start.velocity[0].hypot(start.velocity[1]);
    // noise that lasts from frame to frame tells less
    let lasts = shot.frames_alike().sqrt();
    if index < NEAR && drift > MOVED * noise * lasts * start.error {
        // its track may as well begin at the impact
        return Err(match drifts(&cue, &object, ball, noise) {
            Some(speed) => Unusable::ObjectMoving { speed },
            None => too_few_before(cue.iter().filter(|s| s.t < object[0].t).count()),
        });
    }
    let time = moving.passes(lay).ok_or(Unusable::NoCollision(Bodies::Balls))?;

    let frame = 1.0 / shot.fps;
    let before: Vec<Sample> = object.iter().filter(|s| s.t < time - 0.5 * frame).copied().collect();
    let cue_before: Vec<Sample> = cue.iter().filter(|s| s.t < time - 0.5 * frame).copied().collect();
    let after = cue.iter().filter(|s| s.t > time + 0.5 * frame).take(NEAR).count();
    if before.is_empty() || cue_before.len() < LEAST_FRAMES {
        return Err(match drifts(&cue, &object, ball, noise) {
            Some(speed) => Unusable::ObjectMoving { speed },
            None => too_few_before(cue_before.len()),
        });
    }
    if after < LEAST_FRAMES {
        return Err(Unusable::too_few(Bodies::Balls, [0, 1], after, LEAST_FRAMES));
    }
    let arriving: Vec<Sample> = cue_before.iter().rev().take(NEAR).copied().collect();
    let arriving = Near::new(&arriving, time, noise);
    let [ux, uy] = arriving.velocity;
    let speed = ux.hypot(uy);
    if let Some(drift) = surely_moves(shot, &before, noise).filter(|drift| *drift > MOVING_PART * speed) {
        return Err(Unusable::ObjectMoving { speed: drift });
    }
    let lay = [median(before.iter().map(|s| s.x).collect()), median(before.iter().map(|s| s.y).collect())];
    let across = [lay[0] - arriving.position[0], lay[1] - arriving.position[1]];
    let distance = across[0].hypot(across[1]);
    let (nx, ny) = (across[0] / distance, across[1] / distance);
    let before = [ux * nx + uy * ny, uy * nx - ux * ny];
    if !(before[0] > 0.0) {
        return Err(Unusable::NoCollision(Bodies::Balls));
    }
    Ok(FirstGuess { time, object: lay, direction: ny.atan2(nx), before, distance })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 20 frames at 500 frames/s of a ball with this speed, the last of them 5 mm off.
    fn filmed(speed: f64) -> Vec<Sample> {
        let frame = |n: usize| {
            let t = n as f64 / 500.0;
            let wrong = if n == 19 { 0.005 } else { 0.0 };
            Sample { t, x: 0.4 + speed * t + wrong, y: 0.2, sd: None }
        };
        (0..20).map(frame).collect()
    }

    #[test]
    fn a_wrong_frame_does_not_move_a_ball_that_lies() {
        const NOISE: f64 = 3e-4;
        let moves = |speed: f64| {
            let (speed, error, _) = robust_speed(&filmed(speed));
            speed > MOVING_ERRORS * NOISE * error
        };
        assert!(!moves(0.0));
        assert!(moves(0.1));
        let straight = Line::through(&filmed(0.0), 0.0);
        assert!(straight.velocity[0] > MOVING_ERRORS * NOISE * straight.error);
    }
}
