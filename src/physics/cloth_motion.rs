//! Motion on the cloth before and after an impact: flight, bounce, sliding, rolling.
//!
//! A ball's slip on the cloth is s = (V_x − RΩ_y, V_y + RΩ_x). While it slides, its velocity
//! changes by −μ_k g ŝ and its slip by (1 + ν)/ν times that, so that ŝ keeps its direction and the
//! path is a parabola; once s = 0 it rolls and slows down by μ_r g. A ball that leaves the cloth
//! flies straight for 2V_z/g, and at each landing takes a friction impulse of at most μ_k(1 +
//! e_t)|V_z| per unit mass against its slip. Bounces too low to be seen act as their average, so
//! that the path does not leap when one more of them counts as a flight.
//!
//! ```
//! use caromfit::physics::cloth_motion::{Cloth, Launch, Path};
//!
//! // a ball without spin slips on the cloth with its own speed, slides, and rolls with 5/7 of it
//! let [velocity, slip] = [[1.4, 0.0]; 2];
//! let launch = Launch { velocity, slip, time: 0.0, position: [0.0; 2], up: 0.0, inertia: 0.4 };
//! let path = Path::after(&launch, &Cloth { rolling: 0.0, ..Cloth::default() });
//! let rolls = path.changes().last().unwrap_or(0.0);
//! assert!((rolls - 2.0 * 1.4 / (7.0 * 0.2 * 9.81)).abs() < 1e-12);
//! assert!((path.velocity(rolls)[0] - 1.0).abs() < 1e-12);
//! ```

use nalgebra::Vector2;

use super::ball::Ball;

/// Acceleration of gravity, m/s².
pub const GRAVITY: f64 = 9.81;

/// Slowest rebound with a flight of its own, m/s (a height of 0.2 µm). Where one becomes a flight,
/// the path moves by μ_k(1 + e_t)V_z²/g, some 0.2 µm.
pub(crate) const MIN_REBOUND: f64 = 0.002;

/// Largest number of flights of a ball; later bounces act as their average, as low ones do. At e_t
/// = 0.9 it holds all rebounds of a ball that rises with 1.7 m/s; at e_t = 1 there is no last one.
pub(crate) const MAX_FLIGHTS: usize = 64;

/// Slip over speed that is the rounding of a natural roll.
const MIN_SLIP: f64 = 1e-6;

/// The cloth: its friction with a moving ball, and its bounce.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "fit", derive(serde::Deserialize, serde::Serialize))]
#[cfg_attr(feature = "fit", serde(deny_unknown_fields, default))]
pub struct Cloth {
    /// μ_k, the friction of the cloth on a ball that slides, dimensionless.
    #[cfg_attr(feature = "fit", serde(rename = "mu_k"))]
    pub sliding: f64,
    /// μ_r, the rolling resistance: a rolling ball slows down by μ_r g.
    #[cfg_attr(feature = "fit", serde(rename = "mu_r"))]
    pub rolling: f64,
    /// e_t, the restitution of a ball that falls on the bed of the table.
    pub bounce: f64,
}

impl Default for Cloth {
    /// Published values: μ_k ≈ 0.2, μ_r ≈ 0.01, e_t ≈ 0.5.
    fn default() -> Self {
        Self { sliding: 0.2, rolling: 0.01, bounce: 0.5 }
    }
}

/// A ball at the start of a path, table frame.
#[derive(Clone, Copy, Debug)]
pub struct Launch {
    /// The instant at which the path starts, s.
    pub time: f64,
    /// Position of the centre, x and y in m.
    pub position: [f64; 2],
    /// Velocity of the centre, x and y in m/s.
    pub velocity: [f64; 2],
    /// Slip of the ball on the cloth, s = (V_x − RΩ_y, V_y + RΩ_x), m/s.
    pub slip: [f64; 2],
    /// Upward velocity in m/s, 0 for a ball on the cloth.
    pub up: f64,
    /// ν, the moment of inertia over MR².
    pub inertia: f64,
}

/// A stretch of constant acceleration.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    start: f64,
    position: Vector2<f64>,
    velocity: Vector2<f64>,
    acceleration: Vector2<f64>,
    /// Whether the ball moves without slip on the cloth, or lies still.
    rolls: bool,
}

impl Stretch {
    /// Returns a stretch of rolling or rest; `friction` is μ_r.
    fn rolling(start: f64, position: Vector2<f64>, velocity: Vector2<f64>, friction: f64) -> Self {
        let acceleration = direction(velocity) * -friction * GRAVITY;
        Self { start, position, velocity, acceleration, rolls: true }
    }

    /// Returns position and velocity at a time.
    fn at(&self, time: f64) -> [Vector2<f64>; 2] {
        let (t, a) = (time - self.start, self.acceleration);
        [self.position + self.velocity * t + a * t * t * 0.5, self.velocity + a * t]
    }
}

/// The path of a ball before or after an impact, as stretches of constant acceleration.
#[derive(Clone, Debug)]
pub struct Path(Vec<Stretch>);

impl Path {
    /// Returns the path after an impact: flight with its bounces, sliding, rolling to the end.
    #[must_use]
    pub fn after(launch: &Launch, cloth: &Cloth) -> Self {
        let mut path = Vec::with_capacity(12);
        let Launch { mut time, mut up, inertia, .. } = *launch;
        let [mut position, mut velocity, mut slip] =
            [launch.position, launch.velocity, launch.slip].map(Vector2::from);
        // the slip that an impulse on the ball removes: Δs = (1 + ν)/ν Δv
        let lever = (1.0 + inertia) / inertia;
        while up > MIN_REBOUND && path.len() < MAX_FLIGHTS {
            let acceleration = Vector2::zeros();
            let flight = Stretch { start: time, position, velocity, acceleration, rolls: false };
            path.push(flight);
            // 2V_z/g in the air
            time += up * (2.0 / GRAVITY);
            [position, velocity] = flight.at(time);
            // μ_k(1 + e_t)V_z at the landing, or what stops the slip
            let most = cloth.sliding * (cloth.bounce + 1.0) * up;
            let impulse = direction(slip) * most.min(slip.norm() / lever);
            velocity -= impulse;
            slip -= impulse * lever;
            up *= cloth.bounce;
        }
        // each bounce that is left takes at most μ_k(1 + e_t)V_z in 2V_z/g, all of them Σ 2V_z
        // e_tⁿ/g, without end at e_t = 1…
        let lost = 1.0 - cloth.bounce;
        let bouncing = if up > 0.0 { up * (2.0 / GRAVITY) / lost.max(0.0) } else { 0.0 };
        let low = cloth.sliding * (cloth.bounce + 1.0) * (0.5 * GRAVITY);
        // …and then it slides
        for (friction, lasts) in [(low, bouncing), (cloth.sliding * GRAVITY, f64::INFINITY)] {
            let speed = slip.norm();
            if speed <= 0.0 || friction <= 0.0 || lasts <= 0.0 {
                continue;
            }
            let acceleration = direction(slip) * -friction;
            let sliding = Stretch { start: time, position, velocity, acceleration, rolls: false };
            path.push(sliding);
            // s falls by (1 + ν)/ν times the friction
            let until_rolling = speed / (friction * lever);
            let seconds = until_rolling.min(lasts);
            time += seconds;
            [position, velocity] = sliding.at(time);
            slip -= slip * (seconds / until_rolling);
        }
        let rolls = Stretch::rolling(time, position, velocity, cloth.rolling);
        path.push(rolls);
        let speed = velocity.norm();
        if speed > 0.0 && cloth.rolling > 0.0 {
            // until it lies still
            time += speed / (cloth.rolling * GRAVITY);
            path.push(Stretch::rolling(time, rolls.at(time)[0], Vector2::zeros(), 0.0));
        }
        Self(path)
    }

    /// Returns the path before an impact, backwards from it: sliding if the ball slips at the
    /// impact, else rolling.
    #[must_use]
    pub fn before(launch: &Launch, cloth: &Cloth) -> Self {
        let start = launch.time;
        let [position, velocity, slip] = [launch.position, launch.velocity, launch.slip].map(Vector2::from);
        let stretch = if slip.norm() > MIN_SLIP * velocity.norm() {
            let acceleration = direction(slip) * -cloth.sliding * GRAVITY;
            Stretch { start, position, velocity, acceleration, rolls: false }
        } else {
            Stretch::rolling(start, position, velocity, cloth.rolling)
        };
        Self(vec![stretch])
    }

    /// Returns the instants at which the stretches of constant acceleration begin: take-off,
    /// landings, sliding, rolling, rest, s.
    pub fn changes(&self) -> impl Iterator<Item = f64> {
        self.0.iter().map(|stretch| stretch.start)
    }

    /// Returns the position at a time, m.
    #[must_use]
    pub fn position(&self, time: f64) -> [f64; 2] {
        self.at(time)[0].into()
    }

    /// Returns the horizontal velocity at a time, m/s.
    #[must_use]
    pub fn velocity(&self, time: f64) -> [f64; 2] {
        self.at(time)[1].into()
    }

    /// Returns position and velocity at a time.
    fn at(&self, time: f64) -> [Vector2<f64>; 2] {
        let index = self.0.iter().rposition(|stretch| stretch.start <= time).unwrap_or(0);
        self.0[index].at(time)
    }

    /// Returns the change of the horizontal spin from the impact to a time, rad/s: the cloth
    /// changes it by −ẑ × Δv/(νR) while the ball slips and at landings, by ẑ × Δv/R while it rolls.
    #[must_use]
    pub fn spin_change(&self, time: f64, ball: &Ball) -> [f64; 2] {
        let mut change = [0.0; 2];
        let mut add = |by: Vector2<f64>, rolls: bool| {
            let factor = if rolls { 1.0 } else { -1.0 / ball.inertia } / ball.radius;
            // ẑ × Δv = (−Δv_y, Δv_x)
            change[0] -= by.y * factor;
            change[1] += by.x * factor;
        };
        let mut velocity = self.0[0].velocity;
        for (i, stretch) in self.0.iter().enumerate().filter(|(i, s)| *i == 0 || s.start <= time) {
            add(stretch.velocity - velocity, false);
            let next = self.0.get(i + 1).map_or(f64::INFINITY, |next| next.start);
            [_, velocity] = stretch.at(next.min(time));
            add(velocity - stretch.velocity, stretch.rolls);
        }
        change
    }
}

/// Returns the unit vector, or 0 of no vector.
fn direction(v: Vector2<f64>) -> Vector2<f64> {
    v.try_normalize(0.0).unwrap_or_default()
}
