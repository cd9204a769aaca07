//! Motion on the cloth before and after an impact: flight, bounce, sliding, rolling.
//!
//! A ball's slip on the cloth is s = (V_x − RΩ_y, V_y + RΩ_x). While it slides, its velocity
//! changes by −μ_k g ŝ and its slip by (1 + ν)/ν times that, so that ŝ keeps its direction and the
//! path is a parabola; once s = 0 it rolls and slows down by μ_r g. A ball that leaves the cloth
//! flies straight for 2V_z/g, and at each landing takes a friction impulse of at most μ_k(1 +
//! e_t)|V_z| per unit mass against its slip. Bounces too low to be seen act as their average, so
//! that the path does not leap when one more of them counts as a flight.
//!
//! Written for any number type with derivatives, so that the same lines give a path and its
//! sensitivities.
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

use num_dual::DualNum;

use super::ball::Ball;

/// Acceleration of gravity, m/s².
pub const GRAVITY: f64 = 9.81;

/// Slowest rebound with a flight of its own, m/s (a height of 0.2 µm). Where one becomes a flight,
/// the path moves by μ_k(1 + e_t)V_z²/g, some 0.2 µm.
const LEAST_REBOUND: f64 = 0.002;

/// Largest number of flights of a ball; later bounces act as their average, as low ones do. At e_t
/// = 0.9 it holds all rebounds of a ball that rises with 1.7 m/s; at e_t = 1 there is no last one.
const MOST_FLIGHTS: usize = 64;

/// A plain number, or one that carries derivatives.
pub trait Number: DualNum<Primitive = f64> + Copy {}

impl<T: DualNum<Primitive = f64> + Copy> Number for T {}

/// The cloth: its friction with a moving ball, and its bounce.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cloth<T> {
    /// μ_k, the friction of the cloth on a ball that slides, dimensionless.
    pub sliding: T,
    /// μ_r, the rolling resistance: a rolling ball slows down by μ_r g.
    pub rolling: T,
    /// e_t, the restitution of a ball that falls on the bed of the table.
    pub bounce: T,
}

impl Default for Cloth<f64> {
    /// Published values: μ_k ≈ 0.2, μ_r ≈ 0.01, e_t ≈ 0.5.
    fn default() -> Self {
        Self { sliding: 0.2, rolling: 0.01, bounce: 0.5 }
    }
}

/// A ball at the start of a path, table frame.
#[derive(Clone, Copy, Debug)]
pub struct Launch<T> {
    /// The instant at which the path starts, s.
    pub time: T,
    /// Position of the centre, x and y in m.
    pub position: [T; 2],
    /// Velocity of the centre, x and y in m/s.
    pub velocity: [T; 2],
    /// Slip of the ball on the cloth, s = (V_x − RΩ_y, V_y + RΩ_x), m/s.
    pub slip: [T; 2],
    /// Upward velocity in m/s, 0 for a ball on the cloth.
    pub up: T,
    /// ν, the moment of inertia over MR².
    pub inertia: f64,
}

/// The kind of a ball's motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Moves {
    Flies,
    Slides,
    /// Without slip on the cloth, or at rest.
    Rolls,
}

/// A stretch of constant acceleration.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch<T> {
    start: T,
    position: [T; 2],
    velocity: [T; 2],
    acceleration: [T; 2],
    moves: Moves,
}

impl<T: Number> Stretch<T> {
    fn at(&self, time: T) -> ([T; 2], [T; 2]) {
        let t = time - self.start;
        let [p, v, a] = [self.position, self.velocity, self.acceleration];
        let position = [0, 1].map(|i| p[i] + v[i] * t + a[i] * t * t * 0.5);
        let velocity = [0, 1].map(|i| v[i] + a[i] * t);
        (position, velocity)
    }
}

/// The path of a ball before or after an impact, as stretches of constant acceleration.
#[derive(Clone, Debug)]
pub struct Path<T>(Vec<Stretch<T>>);

impl<T: Number> Path<T> {
    /// Returns the path after an impact: flight with its bounces, sliding, rolling to the end.
    #[must_use]
    pub fn after(launch: &Launch<T>, cloth: &Cloth<T>) -> Self {
        let zero = T::from(0.0);
        let mut path = Vec::with_capacity(12);
        let Launch { mut time, mut position, mut velocity, mut slip, mut up, inertia } = *launch;
        // the slip that an impulse on the ball removes: Δs = (1 + ν)/ν Δv
        let lever = (1.0 + inertia) / inertia;
        while up.re() > LEAST_REBOUND && path.len() < MOST_FLIGHTS {
            let flight =
                Stretch { start: time, position, velocity, acceleration: [zero; 2], moves: Moves::Flies };
            path.push(flight);
            // 2V_z/g in the air
            time += up * (2.0 / GRAVITY);
            (position, velocity) = flight.at(time);
            // μ_k(1 + e_t)V_z at the landing, or what stops the slip
            let speed = norm(slip);
            if speed.re() > 0.0 {
                let most = cloth.sliding * (cloth.bounce + 1.0) * up;
                let stops = speed / lever;
                let impulse = if most.re() < stops.re() { most } else { stops };
                for i in 0..2 {
                    let direction = slip[i] / speed;
                    velocity[i] -= impulse * direction;
                    slip[i] -= impulse * direction * lever;
                }
            }
            up *= cloth.bounce;
        }
        // each bounce that is left takes at most μ_k(1 + e_t)V_z in 2V_z/g, all of them Σ 2V_z
        // e_tⁿ/g, without end at e_t = 1…
        let lost = -cloth.bounce + 1.0;
        let bouncing = if lost.re() > 0.0 {
            up * (2.0 / GRAVITY) / lost
        } else {
            T::from(if up.re() > 0.0 { f64::INFINITY } else { 0.0 })
        };
        let low = cloth.sliding * (cloth.bounce + 1.0) * (0.5 * GRAVITY);
        // …and then it slides
        let stages = [(low, bouncing), (cloth.sliding * GRAVITY, T::from(f64::INFINITY))];
        for (friction, lasts) in stages {
            let speed = norm(slip);
            if speed.re() <= 0.0 || friction.re() <= 0.0 || lasts.re() <= 0.0 {
                continue;
            }
            let acceleration = slip.map(|s| -s / speed * friction);
            let sliding = Stretch { start: time, position, velocity, acceleration, moves: Moves::Slides };
            path.push(sliding);
            // s falls by (1 + ν)/ν times the friction
            let until_rolling = speed / (friction * lever);
            let rolls = until_rolling.re() <= lasts.re();
            let seconds = if rolls { until_rolling } else { lasts };
            time += seconds;
            (position, velocity) = sliding.at(time);
            slip = if rolls { [zero; 2] } else { slip.map(|s| s - s * (seconds / until_rolling)) };
        }
        let rolls = rolling(time, position, velocity, cloth.rolling);
        path.push(rolls);
        let speed = norm(velocity);
        if speed.re() > 0.0 && cloth.rolling.re() > 0.0 {
            // until it lies still
            time += speed / (cloth.rolling * GRAVITY);
            path.push(rolling(time, rolls.at(time).0, [zero; 2], zero));
        }
        Self(path)
    }

    /// Returns the path before an impact, backwards from it: sliding if the ball slips at the
    /// impact, else rolling.
    #[must_use]
    pub fn before(launch: &Launch<T>, cloth: &Cloth<T>) -> Self {
        let Launch { time, position, velocity, slip, .. } = *launch;
        let speed = norm(slip);
        let stretch = if speed.re() > SLIPS * norm(velocity).re() {
            let acceleration = slip.map(|s| -s / speed * cloth.sliding * GRAVITY);
            Stretch { start: time, position, velocity, acceleration, moves: Moves::Slides }
        } else {
            rolling(time, position, velocity, cloth.rolling)
        };
        Self(vec![stretch])
    }

    /// Returns the path of a ball at rest.
    #[must_use]
    pub fn at_rest(launch: &Launch<T>) -> Self {
        Self(vec![rolling(launch.time, launch.position, [T::from(0.0); 2], T::from(0.0))])
    }

    /// Returns the path on a table that is not level: `acceleration` (m/s²) is that of a body that
    /// slides without friction. A ball that rolls has 1/(1 + ν) of it, one that lies still stays.
    /// The direction of the slip is taken as on a level table.
    #[must_use]
    pub fn tilted(mut self, acceleration: [f64; 2], inertia: f64) -> Self {
        let zero = T::from(0.0);
        let (mut moved, mut faster) = ([zero; 2], [zero; 2]);
        for i in 0..self.0.len() {
            let lasts = self.0.get(i + 1).map(|next| next.start - self.0[i].start);
            let stretch = &mut self.0[i];
            let lies = norm(stretch.velocity).re() == 0.0 && norm(stretch.acceleration).re() == 0.0;
            let part = match (lies, stretch.moves) {
                (true, _) => 0.0,
                (false, Moves::Rolls) => 1.0 / (1.0 + inertia),
                (false, Moves::Flies | Moves::Slides) => 1.0,
            };
            for axis in 0..2 {
                let own = acceleration[axis] * part;
                stretch.position[axis] += moved[axis];
                stretch.velocity[axis] += faster[axis];
                stretch.acceleration[axis] += T::from(own);
                if let Some(lasts) = lasts {
                    moved[axis] += (faster[axis] + lasts * (0.5 * own)) * lasts;
                    faster[axis] += lasts * own;
                }
            }
        }
        self
    }

    /// Returns the instants at which the stretches of constant acceleration begin: take-off,
    /// landings, sliding, rolling, rest, s.
    pub fn changes(&self) -> impl Iterator<Item = T> {
        self.0.iter().map(|stretch| stretch.start)
    }

    /// Returns the position at a time, m.
    #[must_use]
    pub fn position(&self, time: f64) -> [T; 2] {
        self.at(time).0
    }

    /// Returns the horizontal velocity at a time, m/s.
    #[must_use]
    pub fn velocity(&self, time: f64) -> [T; 2] {
        self.at(time).1
    }

    /// Returns position and velocity at a time.
    fn at(&self, time: f64) -> ([T; 2], [T; 2]) {
        let index = self.0.iter().rposition(|stretch| stretch.start.re() <= time).unwrap_or(0);
        self.0[index].at(T::from(time))
    }

    /// Returns the change of the horizontal spin from the impact to a time, rad/s: the cloth
    /// changes it by −ẑ × Δv/(νR) while the ball slips and at landings, by ẑ × Δv/R while it rolls.
    #[must_use]
    pub fn spin_change(&self, time: f64, ball: &Ball) -> [T; 2] {
        let mut change = [T::from(0.0); 2];
        let mut add = |from: [T; 2], to: [T; 2], rolls: bool| {
            let factor = if rolls { 1.0 } else { -1.0 / ball.inertia } / ball.radius;
            // ẑ × Δv = (−Δv_y, Δv_x)
            change[0] -= (to[1] - from[1]) * factor;
            change[1] += (to[0] - from[0]) * factor;
        };
        // halfway through a flight, where a camera that sees heights shows the velocity as it is
        let own = |i: usize| {
            let stretch = &self.0[i];
            match self.0.get(i + 1) {
                Some(next) if stretch.moves == Moves::Flies => {
                    stretch.at(stretch.start + (next.start - stretch.start) * 0.5).1
                }
                _ => stretch.velocity,
            }
        };
        let mut velocity = own(0);
        for (i, stretch) in self.0.iter().enumerate().filter(|(i, s)| *i == 0 || s.start.re() <= time) {
            add(velocity, own(i), false);
            let next = self.0.get(i + 1).filter(|next| next.start.re() <= time);
            let (_, then) = stretch.at(next.map_or(T::from(time), |next| next.start));
            let then = if stretch.moves == Moves::Flies { own(i) } else { then };
            add(own(i), then, stretch.moves == Moves::Rolls);
            velocity = then;
        }
        change
    }
}

/// Slip over speed that is the rounding of a natural roll.
const SLIPS: f64 = 1e-6;

/// Returns a stretch of rolling or rest; `friction` is μ_r.
fn rolling<T: Number>(start: T, position: [T; 2], velocity: [T; 2], friction: T) -> Stretch<T> {
    let speed = norm(velocity);
    let acceleration =
        velocity.map(|v| if speed.re() > 0.0 { -v / speed * friction * GRAVITY } else { T::from(0.0) });
    Stretch { start, position, velocity, acceleration, moves: Moves::Rolls }
}

pub(super) fn norm<T: Number>(v: [T; 2]) -> T {
    let square = v[0] * v[0] + v[1] * v[1];
    if square.re() > 0.0 { square.sqrt() } else { T::from(0.0) }
}
