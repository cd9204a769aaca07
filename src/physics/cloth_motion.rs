//! Motion on the cloth before and after an impact: flight, bounce, sliding, rolling.
//!
//! A ball's slip on the cloth is s = (V_x − RΩ_y, V_y + RΩ_x). While it slides, its velocity
//! changes by −μ_k g ŝ and its slip by (1 + ν)/ν times that, so that the path is a parabola; once s
//! = 0 it rolls and slows down by μ_r g. A ball that leaves the cloth flies straight for 2V_z/g,
//! and at each landing takes a friction impulse of at most μ_k(1 + e_t)|V_z| per unit mass against
//! its slip. Bounces too low to be seen act as sliding that begins later.
//!
//! ```
//! use caromfit::physics::ball::{Ball, BallState};
//! use caromfit::physics::cloth_motion::{Cloth, Path};
//!
//! // a ball without spin slips on the cloth with its own speed v, slides, and rolls with 5v/7
//! let cloth = Cloth { rolling: 0.0, ..Cloth::default() };
//! let state = BallState::stun([1.4, 0.0, 0.0].into());
//! let path = Path::through([&state; 2], &Ball::POOL, [0.0; 2], 0.0, &cloth);
//! let rolls = path.changes().last().unwrap_or(0.0);
//! assert!((rolls - 2.0 * 1.4 / (7.0 * 0.2 * 9.81)).abs() < 1e-12);
//! assert!((path.velocity(rolls)[0] - 1.0).abs() < 1e-12);
//! ```

use nalgebra::{Vector2, Vector3};

use super::Number;
use super::ball::{Ball, BallState};
use super::contact_frame::cloth_slip;

/// Acceleration of gravity, m/s².
pub const GRAVITY: f64 = 9.81;

/// Slowest rebound with a flight of its own, m/s, of an idealised motion: a height of 0.2 µm.
const MIN_REBOUND: f64 = 0.002;

/// Number of stretches that paths have room for at first: few have more.
const TYPICAL_STRETCHES: usize = 16;

/// Largest number of flights of a ball; later bounces act as low ones do. At e_t
/// = 0.9 it holds all rebounds of a ball that rises with 1.7 m/s.
const MAX_FLIGHTS: usize = 64;

/// The cloth: its friction with a moving ball, and its bounce.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "fit", derive(serde::Deserialize, serde::Serialize, schemars::JsonSchema))]
#[cfg_attr(feature = "fit", serde(default))]
pub struct Cloth {
    /// μ_k, the friction of the cloth on a ball that slides, dimensionless.
    #[cfg_attr(feature = "fit", serde(rename = "mu_k"), schemars(range(min = 0)))]
    pub sliding: f64,
    /// μ_r, the rolling resistance: a rolling ball slows down by μ_r g.
    #[cfg_attr(feature = "fit", serde(rename = "mu_r"), schemars(range(min = 0)))]
    pub rolling: f64,
    /// e_t, the restitution of a ball that falls on the bed of the table.
    #[cfg_attr(feature = "fit", schemars(range(min = 0, max = 1)))]
    pub bounce: f64,
}

impl Default for Cloth {
    /// Published values: μ_k ≈ 0.2, μ_r ≈ 0.01, e_t ≈ 0.5.
    fn default() -> Self {
        Self { sliding: 0.2, rolling: 0.01, bounce: 0.5 }
    }
}

/// Widths of the transitions that are jumps of an idealised motion; all are 0 for the latter.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Smoothing {
    /// Duration of a contact that changes a ball's velocity by 1 m/s, s.
    pub(crate) contact: f64,
    /// Half of the time that a landing lasts, s.
    pub(crate) landing: f64,
    /// Speed below which directions are smoothed, m/s.
    pub(crate) speed: f64,
}

/// A ball at an instant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment<T> {
    /// s
    pub(crate) time: T,
    /// Place on the table and height above that of rest, m.
    pub(crate) place: Vector3<T>,
    /// m/s
    pub(crate) velocity: Vector3<T>,
    /// Velocity of the ball's lowest point, m/s.
    pub(crate) slip: Vector2<T>,
}

/// A stretch of constant acceleration.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch<T> {
    /// Time from which the ball is on it, s.
    pub(crate) start: f64,
    pub(crate) from: Moment<T>,
    /// m/s²
    pub(crate) acceleration: Vector3<T>,
    /// Δs/Δv by friction: (1 + ν)/ν while the ball slips, 0 while it rolls or flies.
    lever: f64,
}

impl<T: Number> Stretch<T> {
    fn new(from: Moment<T>, acceleration: Vector3<T>, lever: f64) -> Self {
        Self { start: from.time.re(), from, acceleration, lever }
    }

    /// Returns a stretch without acceleration.
    pub(crate) fn free(from: Moment<T>) -> Self {
        Self::new(from, Vector3::zeros(), 0.0)
    }

    /// Returns the ball at a time, s.
    fn at(&self, time: T) -> Moment<T> {
        let t = time - self.from.time;
        let change = self.acceleration * t;
        Moment {
            time,
            place: self.from.place + self.from.velocity * t + change * (t * 0.5),
            velocity: self.from.velocity + change,
            slip: self.from.slip + change.xy() * T::from(self.lever),
        }
    }

    /// Returns the stretch on which the velocity of a ball on this one becomes that of `after`,
    /// evenly from `half` before its instant to `half` after.
    fn turning(&self, after: &Moment<T>, half: T) -> Self {
        let velocity = self.from.velocity + self.acceleration * (after.time - self.from.time);
        let acceleration = self.acceleration + (after.velocity - velocity) / (half * 2.0);
        Self::new(self.at(after.time - half), acceleration, 0.0)
    }
}

/// The action of a cloth on a ball.
pub(crate) struct Forces<T> {
    pub(crate) sliding: T,
    pub(crate) rolling: T,
    pub(crate) bounce: T,
    /// Acceleration of gravity, m/s².
    pub(crate) gravity: T,
    /// Acceleration of a sliding ball down a tilted table, m/s².
    pub(crate) tilt: Vector2<T>,
    /// ν of the ball.
    pub(crate) inertia: f64,
    pub(crate) smoothing: Smoothing,
}

impl<T: Number> Forces<T> {
    /// Returns Δs/Δv of an impulse on the ball, (1 + ν)/ν.
    fn lever(&self) -> f64 {
        (1.0 + self.inertia) / self.inertia
    }

    fn norm(&self, v: &Vector2<T>) -> T {
        norm(v, self.smoothing.speed)
    }

    /// Returns the unit vector, or 0 of no vector.
    fn direction(&self, v: Vector2<T>) -> Vector2<T> {
        let length = self.norm(&v);
        if length.re() > 0.0 { v / length } else { Vector2::zeros() }
    }

    /// Returns the motion of a ball that slides.
    pub(crate) fn slide(&self, from: Moment<T>) -> Stretch<T> {
        let friction = self.direction(from.slip) * (self.sliding * self.gravity);
        Stretch::new(from, flat(self.tilt - friction), self.lever())
    }

    /// Returns the motion of a ball that rolls.
    pub(crate) fn roll(&self, from: Moment<T>) -> Stretch<T> {
        let friction = self.direction(from.velocity.xy()) * (self.rolling * self.gravity);
        Stretch::new(from, flat(self.tilt / T::from(1.0 + self.inertia) - friction), 0.0)
    }

    /// Returns the path of a ball through an impact after which it is `after`, until a time, s.
    pub(crate) fn through(&self, before: Stretch<T>, after: Moment<T>, until: f64) -> Vec<Stretch<T>> {
        let change = self.norm(&(after.velocity - before.at(after.time).velocity).xy());
        let half = if self.smoothing.contact > 0.0 {
            contact_time(self.smoothing.contact, change) * 0.5
        } else {
            T::zero()
        };
        let mut path = Vec::with_capacity(TYPICAL_STRETCHES);
        path.push(Stretch { start: f64::NEG_INFINITY, ..before });
        path.extend((half.re() > 0.0).then(|| before.turning(&after, half)));
        let first = path.len();
        self.follow(after, until, &mut path);
        for stretch in &mut path[first..] {
            // those that are over before the contact ends are never followed
            stretch.start = stretch.start.max((after.time + half).re());
        }
        path
    }

    /// Appends the path of a ball after an impact: flights, landings, sliding, rolling to the end.
    fn follow(&self, mut now: Moment<T>, until: f64, path: &mut Vec<Stretch<T>>) {
        let lever = self.lever();
        // a flight lasts 2V_z/g, and is seen if that is longer than a landing
        let half = self.smoothing.landing;
        let least_rebound = MIN_REBOUND.max(half * self.gravity.re());
        // a landing begins before its instant
        let is_over = |now: &Moment<T>| now.time.re() > until + half;
        let (mut flights, mut late) = (0, 0.0);
        while now.velocity.z.re() > least_rebound && flights < MAX_FLIGHTS {
            if is_over(&now) {
                return;
            }
            flights += 1;
            let mut flight = Stretch::new(now, Vector3::z() * -self.gravity, 0.0);
            flight.start += late;
            path.push(flight);
            // 2V_z/g in the air
            let rise = now.velocity.z;
            let lasts = rise * 2.0 / self.gravity;
            now = flight.at(now.time + lasts);
            // μ_k(1 + e_t)V_z at the landing, or what stops the slip
            let grip = self.sliding * (self.bounce + 1.0) * rise;
            let stop = self.norm(&now.slip) / lever;
            let impulse = self.direction(now.slip) * if grip.re() < stop.re() { grip } else { stop };
            now.velocity -= flat(impulse);
            now.velocity.z = self.bounce * rise;
            now.slip -= impulse * T::from(lever);
            late = if now.velocity.z.re() > least_rebound { half } else { 0.0 };
            if late > 0.0 {
                path.push(flight.turning(&now, T::from(half)));
            }
        }
        let rise = std::mem::replace(&mut now.velocity.z, T::zero());
        now.place.z = T::zero();
        if rise.re() > 0.0 {
            // bounces that are left take Σ μ_k(1 + e_t)V_z e_tⁿ in Σ 2V_z e_tⁿ/g, as much as a ball
            // that slides from V_z/g on
            let flight = Stretch::free(now);
            path.push(flight);
            now = flight.at(now.time + rise / self.gravity);
        }
        if is_over(&now) {
            return;
        }
        let ends = |lasts: T| lasts.re() > 0.0 && lasts.re().is_finite();
        // its slip decreases by (1 + ν)/ν times the friction
        let lasts = self.norm(&now.slip) / (self.sliding * self.gravity * lever);
        if ends(lasts) {
            let sliding = self.slide(now);
            path.push(sliding);
            now = Moment { slip: Vector2::zeros(), ..sliding.at(now.time + lasts) };
        }
        if is_over(&now) {
            return;
        }
        let rolling = self.roll(now);
        path.push(rolling);
        let lasts = self.norm(&now.velocity.xy()) / (self.rolling * self.gravity);
        if ends(lasts) {
            let rest = rolling.at(now.time + lasts);
            path.push(Stretch::free(Moment { velocity: Vector3::zeros(), ..rest }));
        }
    }
}

/// Returns the duration of a contact of balls that close in at the speed v, m/s, from its duration T₁
/// at 1 m/s, s: T₁ v^(−1/5) (Hertz 1881).
pub(crate) fn contact_time<T: Number>(at_unit_speed: f64, closing: T) -> T {
    closing.powf(-0.2) * at_unit_speed
}

/// Returns the length of a vector, which is smooth at 0 if `smooth` is not 0.
pub(crate) fn norm<T: Number>(v: &Vector2<T>, smooth: f64) -> T {
    (v.x * v.x + v.y * v.y + smooth * smooth).sqrt()
}

/// Returns a horizontal vector.
pub(crate) fn flat<T: Number>(v: Vector2<T>) -> Vector3<T> {
    Vector3::new(v.x, v.y, T::zero())
}

/// The path of a ball through an impact, as stretches of constant acceleration.
#[derive(Clone, Debug)]
pub struct Path(Vec<Stretch<f64>>);

impl Path {
    /// Returns the path of a ball through an impact at a position, m, and a time, s, from its
    /// states just before and after, table frame: before, sliding if it slips there, else rolling;
    /// after, flight with its bounces, sliding, rolling to the end.
    pub fn through(states: [&BallState; 2], ball: &Ball, [x, y]: [f64; 2], time: f64, cloth: &Cloth) -> Self {
        let Cloth { sliding, rolling, bounce } = *cloth;
        let (tilt, smoothing) = (Vector2::zeros(), Smoothing::default());
        let forces =
            Forces { sliding, rolling, bounce, gravity: GRAVITY, tilt, inertia: ball.inertia, smoothing };
        let [before, after] = states.map(|state| Moment {
            time,
            place: Vector3::new(x, y, 0.0),
            velocity: state.velocity,
            slip: cloth_slip(state, ball.radius).xy(),
        });
        // less is the rounding of a natural roll
        let rolls = before.slip.norm() <= 1e-6 * before.velocity.norm();
        let before = if rolls { forces.roll(before) } else { forces.slide(before) };
        Self(forces.through(before, after, f64::INFINITY))
    }

    /// Returns the instants of take-off, landings, sliding, rolling and rest, s.
    pub fn changes(&self) -> impl Iterator<Item = f64> {
        self.0.iter().skip(1).map(|stretch| stretch.start)
    }

    /// Returns the position at a time, m.
    pub fn position(&self, time: f64) -> [f64; 2] {
        self.at(time).place.xy().into()
    }

    /// Returns the horizontal velocity at a time, m/s.
    pub fn velocity(&self, time: f64) -> [f64; 2] {
        self.at(time).velocity.xy().into()
    }

    /// Returns the horizontal spin at a time, ẑ × (V − s)/R, rad/s, of a ball of this radius, m.
    pub fn spin(&self, time: f64, radius: f64) -> [f64; 2] {
        let Moment { velocity, slip, .. } = self.at(time);
        let surface = (velocity.xy() - slip) / radius;
        [-surface.y, surface.x]
    }

    fn at(&self, time: f64) -> Moment<f64> {
        let index = self.0.partition_point(|stretch| stretch.start <= time).saturating_sub(1);
        self.0[index].at(time)
    }
}
