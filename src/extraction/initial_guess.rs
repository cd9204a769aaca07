//! A first guess of how the balls of a shot meet, and the shots that have none.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::unusable::{Bodies, Unusable};
use crate::film::frame_noise::noise;
use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::median;
use crate::physics::ball::Ball;

/// The object ball has moved when it is this many standard deviations away from where it lay.
const MOVED: f64 = 6.0;

/// Frames of each ball before and after the impact, to fit a line with something to spare, and a parabola.
const LEAST_FRAMES: usize = 3;
const LEAST_OF_PARABOLA: usize = 5;

/// Frames next to the impact that give the first guess of a velocity.
const NEAR: usize = 12;

/// Residuals of a line that are larger than this many times the noise are a bend.
const BENT: f64 = 3.0;

/// The object ball counts as moving before the impact when its speed is this many standard errors
/// and this part of the cue ball's.
const MOVING_ERRORS: f64 = 5.0;
const MOVING_PART: f64 = 0.01;

/// Number of standard deviations beyond which a frame stands alone, besides what a ball accelerates by.
const ALONE: f64 = 10.0;

/// Largest acceleration of a ball on a cloth, m/s².
const ACCELERATION: f64 = 5.0;

type Point = Vector2<f64>;

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

/// A straight line or a parabola through samples by least squares.
pub(super) struct Path {
    /// The instant that it was asked for, and place, velocity and acceleration then.
    at: f64,
    position: Point,
    pub velocity: Point,
    acceleration: Point,
    /// Standard error of the velocity of a line for unit noise.
    error: f64,
}

fn place(sample: &Sample) -> Point {
    Point::new(sample.x, sample.y)
}

impl Path {
    pub fn line(samples: &[Sample], at: f64) -> Self {
        let n = samples.len() as f64;
        let mean_t = samples.iter().map(|s| s.t).sum::<f64>() / n;
        let mean = samples.iter().map(place).sum::<Point>() / n;
        let spread: f64 = samples.iter().map(|s| (s.t - mean_t).powi(2)).sum();
        let moment: Point = samples.iter().map(|s| (place(s) - mean) * (s.t - mean_t)).sum();
        let velocity = if spread > 0.0 { moment / spread } else { Point::zeros() };
        let position = mean + velocity * (at - mean_t);
        Self { at, position, velocity, acceleration: Point::zeros(), error: spread.sqrt().recip() }
    }

    fn parabola(samples: &[Sample], at: f64) -> Option<Self> {
        let powers = |s: &Sample| Vector3::new(1.0, s.t - at, 0.5 * (s.t - at).powi(2));
        let normal = samples.iter().map(|s| powers(s) * powers(s).transpose()).sum::<Matrix3<f64>>().lu();
        let solve = |axis: usize| {
            let moments = samples.iter().map(|s| powers(s) * place(s)[axis]).sum::<Vector3<f64>>();
            normal.solve(&moments).filter(|found| found.iter().all(|c| c.is_finite()))
        };
        let (x, y) = (solve(0)?, solve(1)?);
        let [position, velocity, acceleration] = [0, 1, 2].map(|i| Point::new(x[i], y[i]));
        Some(Self { at, position, velocity, acceleration, error: f64::NAN })
    }

    /// Returns the path through samples, the nearest to the impact first, as it is at a time: a straight
    /// line, or where the samples are so far apart in time that it bends by more than their noise, a
    /// parabola.
    fn near(samples: &[Sample], at: f64, noise: f64) -> Self {
        let straight = Self::line(samples, at);
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

    fn off(&self, sample: &Sample) -> f64 {
        let t = sample.t - self.at;
        (place(sample) - self.position - self.velocity * t - self.acceleration * (0.5 * t * t)).norm()
    }

    /// Returns the largest distance of a sample from the path.
    pub fn largest_residual(&self, samples: &[Sample]) -> f64 {
        samples.iter().map(|sample| self.off(sample)).fold(0.0, f64::max)
    }

    fn rms(&self, samples: &[Sample]) -> f64 {
        let square = samples.iter().map(|sample| self.off(sample).powi(2)).sum::<f64>();
        (square / (2 * samples.len()) as f64).sqrt()
    }

    /// Returns when it passes a place: where it is nearest to it.
    fn passes(&self, place: Point) -> Option<f64> {
        /// The next correction of a parabola is far below the noise.
        const STEPS: usize = 8;
        let mut t = 0.0;
        for _ in 0..STEPS {
            let velocity = self.velocity + self.acceleration * t;
            let position = self.position + (self.velocity + self.acceleration * (0.5 * t)) * t;
            if !(velocity.norm_squared() > 0.0) {
                return None;
            }
            t -= (position - place).dot(&velocity) / velocity.norm_squared();
        }
        t.is_finite().then_some(self.at + t)
    }
}

/// Returns the samples without those that stand alone.
fn steady(samples: &[Sample], noise: f64) -> Vec<Sample> {
    (0..samples.len()).filter(|i| is_steady(samples, *i, noise)).map(|i| samples[i]).collect()
}

/// Returns whether a sample fits the two before it or the two after it: at the impact itself a good one
/// fits one side.
fn is_steady(samples: &[Sample], i: usize, noise: f64) -> bool {
    let fits = |s: &Sample, near: &Sample, far: &Sample| {
        let part = (s.t - near.t) / (near.t - far.t);
        let off = |s: f64, near: f64, far: f64| (s - near - (near - far) * part).abs();
        let most = ALONE * noise * (1.0 + part.abs()) + ACCELERATION * (s.t - far.t).powi(2);
        off(s.x, near.x, far.x) <= most && off(s.y, near.y, far.y) <= most
    };
    let before = i >= 2 && fits(&samples[i], &samples[i - 1], &samples[i - 2]);
    before || i + 2 < samples.len() && fits(&samples[i], &samples[i + 1], &samples[i + 2])
}

/// Returns the medians of x and of y.
fn middle(samples: &[Sample]) -> Point {
    Point::new(median(samples.iter().map(|s| s.x).collect()), median(samples.iter().map(|s| s.y).collect()))
}

/// Returns the speed from the medians of both halves of some samples, which a few wrong frames do not move,
/// its standard error for unit noise, and the time between the halves.
fn robust_speed(samples: &[Sample]) -> [f64; 3] {
    // the median of many numbers errs by this times as much as their mean
    let of_median = std::f64::consts::FRAC_PI_2.sqrt();
    let (early, late) = samples.split_at(samples.len() / 2);
    let time = |half: &[Sample]| median(half.iter().map(|s| s.t).collect());
    let seconds = time(late) - time(early);
    let counts = (early.len() as f64).recip() + (late.len() as f64).recip();
    [(middle(late) - middle(early)).norm() / seconds, of_median * counts.sqrt() / seconds, seconds]
}

/// Returns how far the cue ball is from the object ball in this frame.
fn apart(cue: &[Sample], object: &Sample) -> Option<f64> {
    let other = cue.iter().find(|c| (c.t - object.t).abs() < 1e-6)?;
    Some((place(object) - place(other)).norm())
}

/// Returns when the balls are nearest to each other, s: when they touch, whatever the scale.
fn nearest(cue: &[Sample], object: &[Sample]) -> Option<f64> {
    let distances = object.iter().filter_map(|s| Some((s.t, apart(cue, s)?)));
    distances.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(time, _)| time)
}

/// Returns why frames of both balls before the impact are too few: the object ball moves before the balls
/// touch, as far as frames show both, or one of them is not seen.
fn without_start(cue: &[Sample], object: &[Sample], until: f64, ball: &Ball, noise: f64) -> Unusable {
    let is_clear = |s: &Sample| apart(cue, s).is_none_or(|apart| apart > 2.0 * ball.radius + MOVED * noise);
    let touch = nearest(cue, object).unwrap_or(f64::NEG_INFINITY);
    let free = object.iter().take_while(|s| s.t < touch && is_clear(s)).count();
    if free >= LEAST_FRAMES {
        let line = Path::line(&object[..free], object[0].t);
        let speed = line.velocity.norm();
        if speed > MOVING_ERRORS * noise * line.error {
            return Unusable::ObjectMoving { speed };
        }
    }
    // its track may as well begin at the impact
    match cue.iter().filter(|s| s.t < until).count() {
        few if few < LEAST_FRAMES => Unusable::too_few(Bodies::Balls, [0, 0], few, LEAST_FRAMES),
        _ => Unusable::too_few(Bodies::Balls, [1, 0], 0, 1),
    }
}

/// Returns an instant before which all frames show the balls before the impact, s. Where the noise hides
/// whether the object ball lay at rest, so that the impact is not found, it is somewhat earlier than when the
/// balls are nearest to each other.
pub(crate) fn surely_before(shot: &TrackShot, ball: &Ball) -> Option<f64> {
    /// Part of the time from the first frame until the balls are nearest to each other.
    const FREE: f64 = 0.9;
    let until = || {
        let first = shot.cue.first()?.t;
        Some(first + FREE * (nearest(&shot.cue, &shot.object)? - first))
    };
    from_paths(shot, ball, noise(shot)).ok().map(|guess| guess.time).or_else(until)
}

/// Returns the speed of the object ball before the balls are nearest to each other, m/s, and as a part of the
/// cue ball's, where it surely moves and that part is below the most.
pub(crate) fn object_speed(shot: &TrackShot, most: f64) -> Option<(f64, f64)> {
    /// Part of the frames until then: in the last ones it may have been hit.
    const FREE: f64 = 0.75;
    let noise = noise(shot);
    let (cue, object) = (steady(&shot.cue, noise), steady(&shot.object, noise));
    let touch = nearest(&cue, &object)?;
    let until = |samples: &[Sample]| (FREE * samples.partition_point(|s| s.t < touch) as f64) as usize;
    let (cue, object) = (&cue[..until(&cue)], &object[..until(&object)]);
    let speed = surely_moves(shot, object, noise)?;
    let [of_cue, ..] = (cue.len() >= LEAST_FRAMES).then(|| robust_speed(cue))?;
    (speed < most * of_cue).then_some((speed, speed / of_cue))
}

/// Returns the speed of a ball in these frames, m/s, if it is no chance.
fn surely_moves(shot: &TrackShot, samples: &[Sample], noise: f64) -> Option<f64> {
    if samples.len() < LEAST_FRAMES {
        return None;
    }
    let [speed, error, seconds] = robust_speed(samples);
    // medians of rounded numbers differ by a whole step where the ball lies between two
    let rounded = shot.resolution[1] * std::f64::consts::SQRT_2 / seconds;
    // noise that lasts from frame to frame tells less
    let lasts = shot.frames_alike().sqrt();
    (speed - rounded > MOVING_ERRORS * noise * lasts * error).then_some(speed)
}

/// Returns how the balls meet by lines and parabolas through the frames next to the impact.
///
/// # Errors
/// They do not, the frames are too few, or the object ball moves before.
pub(crate) fn from_paths(shot: &TrackShot, ball: &Ball, noise: f64) -> Result<FirstGuess, Unusable> {
    let bodies = Bodies::Balls;
    let (cue, object) = (steady(&shot.cue, noise), steady(&shot.object, noise));
    if cue.len() < 2 * LEAST_FRAMES || object.len() < 2 * LEAST_FRAMES {
        let frames = [shot.cue.len(), shot.object.len()];
        return Err(Unusable::TooShort { bodies, frames, least: 2 * LEAST_FRAMES });
    }
    let lay = middle(&object[..LEAST_FRAMES + 2.min(object.len() - LEAST_FRAMES)]);
    let away = |s: &Sample| (place(s) - lay).norm();
    // for good: the next two frames are still further away, or as far on a coarse grid
    let moved = |w: &[Sample]| {
        away(&w[0]) > MOVED * noise && away(&w[1]) >= away(&w[0]) && away(&w[2]) >= away(&w[1])
    };
    let index = object.windows(3).position(moved).ok_or(Unusable::NoCollision(bodies))?;
    let after = &object[index..object.len().min(index + NEAR)];
    if after.len() < LEAST_FRAMES {
        return Err(Unusable::too_few(bodies, [1, 1], after.len(), LEAST_FRAMES));
    }
    let start = Path::line(&object[..LEAST_FRAMES], object[0].t);
    // noise that lasts from frame to frame tells less
    let lasts = shot.frames_alike().sqrt();
    if index < NEAR && start.velocity.norm() > MOVED * noise * lasts * start.error {
        return Err(without_start(&cue, &object, object[0].t, ball, noise));
    }
    let time = Path::near(after, after[0].t, noise).passes(lay).ok_or(Unusable::NoCollision(bodies))?;

    let half = 0.5 / shot.fps;
    let before = &object[..object.partition_point(|s| s.t < time - half)];
    let cue_before = &cue[..cue.partition_point(|s| s.t < time - half)];
    let after = cue.iter().filter(|s| s.t > time + half).take(NEAR).count();
    if before.is_empty() || cue_before.len() < LEAST_FRAMES {
        return Err(without_start(&cue, &object, time - half, ball, noise));
    }
    if after < LEAST_FRAMES {
        return Err(Unusable::too_few(bodies, [0, 1], after, LEAST_FRAMES));
    }
    let arriving: Vec<Sample> = cue_before.iter().rev().take(NEAR).copied().collect();
    let arriving = Path::near(&arriving, time, noise);
    let speed = arriving.velocity.norm();
    if let Some(drift) = surely_moves(shot, before, noise).filter(|drift| *drift > MOVING_PART * speed) {
        return Err(Unusable::ObjectMoving { speed: drift });
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A wrong frame does not move a ball that lies, 20 frames at 500 frames/s of which the last is 5 mm off.
    #[test]
    fn a_wrong_frame_does_not_move_a_ball_that_lies() {
        const NOISE: f64 = 3e-4;
        let filmed = |speed: f64| -> Vec<Sample> {
            let wrong = |n: usize| if n == 19 { 0.005 } else { 0.0 };
            let frame = |n: usize| (n as f64 / 500.0, 0.4 + speed * n as f64 / 500.0 + wrong(n));
            (0..20).map(frame).map(|(t, x)| Sample::new(t, [x, 0.2])).collect()
        };
        for (speed, moves) in [(0.0, false), (0.1, true)] {
            let [found, error, _] = robust_speed(&filmed(speed));
            assert_eq!(found > MOVING_ERRORS * NOISE * error, moves, "{speed}");
        }
        let straight = Path::line(&filmed(0.0), 0.0);
        assert!(straight.velocity[0] > MOVING_ERRORS * NOISE * straight.error);
    }
}
