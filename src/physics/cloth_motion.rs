//! Motion on the cloth before and after an impact: flight, bounce, sliding, rolling.
//!
//! A ball's slip on the cloth is s = (V_x − RΩ_y, V_y + RΩ_x). While it slides, its velocity
//! changes by −μ_k g ŝ and its slip by (1 + ν)/ν times that, so that the path is a parabola; once s
//! = 0 it rolls and slows down by μ_r g. A ball that leaves the cloth flies straight for 2V_z/g,
//! and at each landing takes a friction impulse of at most μ_k(1 + e_t)|V_z| per unit mass against
//! its slip. Bounces too low to be seen act as their average.
//!
//! ```
//! use caromfit::physics::ball::{Ball, BallState};
//! use caromfit::physics::cloth_motion::{Cloth, Path};
//!
//! // a ball without spin slips on the cloth with its own speed v, slides, and rolls with 5v/7
//! let cloth = Cloth { rolling: 0.0, ..Cloth::default() };
//! let state = BallState::stun([1.4, 0.0, 0.0].into());
//! let path = Path::after(&state, &Ball::POOL, [0.0; 2], 0.0, &cloth);
//! let rolls = path.changes().last().unwrap_or(0.0);
//! assert!((rolls - 2.0 * 1.4 / (7.0 * 0.2 * 9.81)).abs() < 1e-12);
//! assert!((path.velocity(rolls)[0] - 1.0).abs() < 1e-12);
//! ```

use nalgebra::Vector2;

use super::ball::{Ball, BallState};
use super::contact_frame::cloth_slip;

/// Acceleration of gravity, m/s².
pub const GRAVITY: f64 = 9.81;

/// Slowest rebound with a flight of its own, m/s: a height of 0.2 µm.
pub(crate) const MIN_REBOUND: f64 = 0.002;

/// Largest number of flights of a ball; later bounces act as their average, as low ones do. At e_t
/// = 0.9 it holds all rebounds of a ball that rises with 1.7 m/s.
pub(crate) const MAX_FLIGHTS: usize = 64;

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

/// A stretch of constant acceleration.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    start: f64,
    position: Vector2<f64>,
    velocity: Vector2<f64>,
    acceleration: Vector2<f64>,
    slip: Vector2<f64>,
    /// Δs/Δv by friction: (1 + ν)/ν while the ball slips, 0 while it rolls.
    lever: f64,
}

impl Stretch {
    /// Returns a stretch without friction: flight, rest.
    fn free(start: f64, [position, velocity, slip]: [Vector2<f64>; 3]) -> Self {
        Self { start, position, velocity, acceleration: Vector2::zeros(), slip, lever: 0.0 }
    }

    /// Returns position, velocity and slip at a time.
    fn at(&self, time: f64) -> [Vector2<f64>; 3] {
        let (t, a) = (time - self.start, self.acceleration);
        let by = a * t;
        [self.position + self.velocity * t + by * t * 0.5, self.velocity + by, self.slip + by * self.lever]
    }
}

/// The path of a ball before or after an impact, as stretches of constant acceleration.
#[derive(Clone, Debug)]
pub struct Path(Vec<Stretch>);

impl Path {
    /// Returns the path of a ball that is in a state at a position, m, and a time, s, just after an
    /// impact, table frame: flight with its bounces, sliding, rolling to the end.
    #[must_use]
    pub fn after(state: &BallState, ball: &Ball, position: [f64; 2], mut time: f64, cloth: &Cloth) -> Self {
        let mut path = Vec::with_capacity(12);
        let mut up = state.velocity.z;
        let mut at = [position.into(), state.velocity.xy(), cloth_slip(state, ball.radius).xy()];
        // the slip that an impulse on the ball removes: Δs = (1 + ν)/ν Δv
        let lever = (1.0 + ball.inertia) / ball.inertia;
        while up > MIN_REBOUND && path.len() < MAX_FLIGHTS {
            let flight = Stretch::free(time, at);
            path.push(flight);
            // 2V_z/g in the air
            time += up * (2.0 / GRAVITY);
            at = flight.at(time);
            // μ_k(1 + e_t)V_z at the landing, or what stops the slip
            let [_, velocity, slip] = &mut at;
            let most = cloth.sliding * (cloth.bounce + 1.0) * up;
            let impulse = direction(*slip) * most.min(slip.norm() / lever);
            *velocity -= impulse;
            *slip -= impulse * lever;
            up *= cloth.bounce;
        }
        // bounces that are left: each takes at most μ_k(1 + e_t)V_z in 2V_z/g, all Σ 2V_z e_tⁿ/g…
        let lost = 1.0 - cloth.bounce;
        let bouncing = if up > 0.0 { up * (2.0 / GRAVITY) / lost.max(0.0) } else { 0.0 };
        let low = cloth.sliding * (cloth.bounce + 1.0) * (0.5 * GRAVITY);
        // …and then it slides
        for (friction, lasts) in [(low, bouncing), (cloth.sliding * GRAVITY, f64::INFINITY)] {
            let slip = at[2];
            if slip.norm() <= 0.0 || friction <= 0.0 || lasts <= 0.0 {
                continue;
            }
            let acceleration = direction(slip) * -friction;
            let sliding = Stretch { acceleration, lever, ..Stretch::free(time, at) };
            path.push(sliding);
            // s decreases by (1 + ν)/ν times the friction
            let until_rolling = slip.norm() / (friction * lever);
            time += until_rolling.min(lasts);
            at = sliding.at(time);
            if until_rolling <= lasts {
                at[2] = Vector2::zeros();
            }
        }
        let friction = cloth.rolling * GRAVITY;
        let speed = at[1].norm();
        let rolls = Stretch { acceleration: direction(at[1]) * -friction, ..Stretch::free(time, at) };
        path.push(rolls);
        if speed > 0.0 && friction > 0.0 {
            // until it lies still
            time += speed / friction;
            let [position, _, slip] = rolls.at(time);
            path.push(Stretch::free(time, [position, Vector2::zeros(), slip]));
        }
        Self(path)
    }

    /// Returns the path up to such a state just before an impact: sliding if the ball slips there,
    /// else rolling.
    #[must_use]
    pub fn before(state: &BallState, ball: &Ball, position: [f64; 2], time: f64, cloth: &Cloth) -> Self {
        let (velocity, slip) = (state.velocity.xy(), cloth_slip(state, ball.radius).xy());
        // less is the rounding of a natural roll
        let slips = slip.norm() > 1e-6 * velocity.norm();
        let lever = if slips { (1.0 + ball.inertia) / ball.inertia } else { 0.0 };
        let (along, friction) = if slips { (slip, cloth.sliding) } else { (velocity, cloth.rolling) };
        let acceleration = direction(along) * -friction * GRAVITY;
        let free = Stretch::free(time, [position.into(), velocity, slip]);
        Self(vec![Stretch { acceleration, lever, ..free }])
    }

    /// Returns the instants of take-off, landings, sliding, rolling and rest, s.
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

    /// Returns the horizontal spin at a time, ẑ × (V − s)/R, rad/s, of a ball of this radius, m.
    #[must_use]
    pub fn spin(&self, time: f64, radius: f64) -> [f64; 2] {
        let [_, velocity, slip] = self.at(time);
        let surface = (velocity - slip) / radius;
        [-surface.y, surface.x]
    }

    fn at(&self, time: f64) -> [Vector2<f64>; 3] {
        let index = self.0.iter().rposition(|stretch| stretch.start <= time).unwrap_or(0);
        self.0[index].at(time)
    }
}

/// Returns the unit vector, or 0 of no vector.
fn direction(v: Vector2<f64>) -> Vector2<f64> {
    v.try_normalize(0.0).unwrap_or_default()
}
