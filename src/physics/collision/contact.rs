//! A contact that is compliant along the surface, resolved in time (Mindlin 1949; Maw, Barber & Fawcett 1976), with all that acts on
//! both balls while it lasts.
//!
//! The normal force is Hertz's in compression, F = x^(3/2) at an approach x, and in restitution F = x_m^(3/2) u^(3/2) with
//! u = (x − (1 − e²)x_m)/(e²x_m): continuous, with exactly the energetic e. The unit of velocity is the closing speed k, that of
//! stiffness Hertz's. With R = F^(1/3), time dt = 2Rε ds (ε = 1 in compression, e in restitution) and φ = f/F, the friction on the
//! object ball over the normal force:
//!
//! ```text
//! dR/ds = −v_x/ε        dq/ds = 2εR⁴        dJ/ds = 2εR⁴φ
//! stuck     dφ/ds = −(3ε/κR) v − (c/R)(dR/ds) φ          c = 3 in compression, 2 in restitution; until |φ| = μ
//! sliding   φ = μw, dw/ds = −(3ε/κRμ)(v − (v·w)w)        until −v·w ≤ (κ/3ε)(cμ dR/ds + R dμ/ds)
//! ```
//!
//! κ = (2 − σ)/2(1 − σ) with Poisson's ratio σ (Walton & Braun 1986; Thornton, Cummins & Cleary 2013). Friction turns to the slip
//! at the rate ρ = 3ε|v|/(κμR). Where that is faster than all else, it lags behind the slip's direction α by α'/ρ − (α'/ρ)'/ρ.
//!
//! The state is what has acted so far: impulses q, J of the balls, C and O of the cloth's friction on the cue ball and the object
//! ball, vertical velocities U_z and V_z and heights, all per unit of the object ball's mass. A ball leaves the cloth where the cloth
//! would have to pull, and lands with a friction impulse of at most μ times its speed.

use super::impact::{Impulses, Values, components};
use super::integrator::{EVENTS, Step, System, TooManySteps, follow, integrate};
use super::{Input, Model, Outcome, Regime};
use crate::physics::cloth_motion::GRAVITY;

/// Places in the state; those of pairs are of the cue ball and the object ball, or of y and z.
const R: usize = 0;
const Q: usize = 1;
const J: usize = 2;
const CLOTH: [usize; 2] = [4, 6];
const UP: [usize; 2] = [8, 9];
const HEIGHT: [usize; 2] = [10, 11];
const PHI: usize = 12;
const N: usize = 14;
type State = [f64; N];

/// Duration of an elastic contact of equal balls in units of time: 4√π Γ(2/5)/(5 Γ(9/10)) · (5/8)^(2/5) (Hertz 1882).
const ELASTIC: f64 = 2.438_837_564_705_526_7;

/// A ball that falls more slowly than this part of k does not fall: friction may carry just its weight.
const AT_REST: f64 = 1e-14;

/// The cloth's friction is in proportion to slips below this part of the speeds of the impact, and of what weight can change in it.
const SMOOTH: f64 = 1e-4;

/// The longest step: R is of order 1 after some five.
const LONGEST: f64 = 0.2;

/// Steps that turn the friction by more are unstable.
const STABLE: f64 = 3.0;

/// Friction can follow a slip of more than this times κμ…
const FOLLOWS: f64 = 10.0;

/// …where that errs by no more than this part of the tolerance.
const OF_TOLERANCE: f64 = 0.1;

/// Roundings of an event's function at most.
const HIDDEN: f64 = 1e-10;

/// Friction whose cosine to the slip is above this may follow it.
const ALIGNED: f64 = 0.999_9;

/// Below this κ the contact shakes so often that an integration that fails is put down to it.
pub(super) const STIFF: f64 = 1e-3;

/// Friction has a direction only if it is more than nothing.
const LEAST_MU: f64 = 1e-15;

/// What drives the balls of one shot.
#[derive(Clone, Copy, Debug)]
struct Shot {
    /// v_y0, v_z0.
    slip: [f64; 2],
    /// s_x0, s_y0 of the cue ball on the cloth.
    cue_slip: [f64; 2],
    mu: f64,
    /// b and c, in units of k, of a friction that falls.
    fall: [f64; 2],
    /// Friction of the cloth on the cue ball and on the object ball, μ_k and μ_s.
    mu_cloth: [f64; 2],
    /// Whether the cloth's friction on the object ball is along its slip, and not along −x.
    cloth_turning: bool,
    e: f64,
    kappa: f64,
    per_kappa: f64,
    /// 1/r.
    per_r: f64,
    /// 1/ν of the cue ball and of the object ball.
    per_nu: [f64; 2],
    /// sin δ.
    tilt: f64,
    gravity: f64,
    sigma: f64,
    /// The slip below which the cloth's friction is in proportion to it.
    smooth: f64,
    /// Below this R friction turns as it does there, in compression and in restitution: what is wrong enters the impulses as its tenth
    /// power at first and its fifth at last.
    least_root: [f64; 2],
    /// The error of a friction that follows the slip.
    follows: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Grip {
    Stuck,
    Slides,
    /// Slides, with a direction of friction that follows from the slip.
    Follows,
}

/// The friction along the slip, the angle by which it lags behind to first order, and the next order's part of it.
struct Lag {
    along: [f64; 2],
    first: f64,
    second: f64,
}

/// Which equations hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Mode {
    grip: Grip,
    restitution: bool,
    /// Whether each ball is off the cloth.
    up: [bool; 2],
}

impl Shot {
    fn new(values: &Values<f64>, model: &Model) -> Self {
        let effects = model.effects.and(model.fidelity.effects());
        let k = values[Input::VelocityX];
        let (radius, ratio) = (model.ball.radius, values[Input::RadiusRatio]);
        let on = |on: bool, value: f64| if on { value } else { 0.0 };
        let time_unit = model.contact_time * k.powf(-0.2) / ELASTIC;
        let gravity = on(effects.gravity, GRAVITY * time_unit / k);
        let [u_y, w_x, w_y, w_z] =
            [Input::VelocityY, Input::SpinX, Input::SpinY, Input::SpinZ].map(|input| values[input]);
        Self {
            slip: [(-u_y - radius * w_z) / k, radius * w_y / k],
            cue_slip: [1.0 - radius * w_y / k, (u_y + radius * w_x) / k],
            mu: values[Input::Mu],
            fall: [values[Input::B], values[Input::C] * k],
            mu_cloth: [on(effects.cloth_on_cue, model.mu_k), values[Input::MuS]],
            cloth_turning: effects.cloth_turning,
            e: (values[Input::E] - values[Input::ESlope] * k).max(0.0),
            kappa: values[Input::Kappa],
            per_r: 1.0 / values[Input::MassRatio],
            per_nu: [1.0 / model.ball.inertia, 1.0 / model.object_ball().inertia],
            per_kappa: 1.0 / values[Input::Kappa],
            tilt: (1.0 - ratio) / (1.0 + ratio),
            gravity,
            smooth: SMOOTH * (1.0 + 0.1 * (u_y / k).abs() + ELASTIC * gravity),
            sigma: model.cloth_torque.sign(),
            least_root: [model.tolerance.powf(0.1), model.tolerance.powf(0.2)],
            follows: OF_TOLERANCE * model.tolerance,
        }
    }

    fn friction(&self, speed: f64) -> f64 {
        let [b, c] = self.fall;
        let falling = if b == 0.0 { 0.0 } else { b * (-c * speed).exp() };
        (self.mu + falling).max(LEAST_MU)
    }

    /// Whether there is no friction between the balls at any slip.
    fn is_frictionless(&self) -> bool {
        self.mu == 0.0 && self.fall[0] == 0.0
    }

    /// ε and c of a phase.
    #[inline(always)]
    fn phase(&self, mode: &Mode) -> [f64; 2] {
        if mode.restitution { [self.e, 2.0] } else { [1.0, 3.0] }
    }

    #[inline(always)]
    fn v_x(&self, y: &State) -> f64 {
        (1.0 + self.per_r) * y[Q] + y[CLOTH[1]] - self.per_r * y[CLOTH[0]] - 1.0
    }

    /// The part of the slip between the balls that impulses and vertical velocities make.
    #[inline(always)]
    fn slip_by(&self, y: &State) -> [f64; 2] {
        let &Self { per_r: r, per_nu: [per_c, per_o], sigma, .. } = self;
        let [c, o] = CLOTH;
        let lever = r * per_c + per_o;
        [
            (1.0 + r + lever) * y[J] + y[o + 1] - r * y[c + 1],
            y[UP[1]] - y[UP[0]] + lever * y[J + 1] - r * y[c] * per_c - sigma * y[o] * per_o,
        ]
    }

    #[inline(always)]
    fn slip(&self, y: &State) -> [f64; 2] {
        let by = self.slip_by(y);
        [self.slip[0] + by[0], self.slip[1] + by[1]]
    }

    /// The slips of both balls on the cloth.
    #[inline(always)]
    fn cloth_slips(&self, y: &State) -> [[f64; 2]; 2] {
        let &Self { per_r: r, per_nu: [per_c, per_o], sigma, cue_slip: [x, z], .. } = self;
        let [c, o] = CLOTH;
        [
            [x + r * (y[c] - y[Q] - (y[J + 1] - y[c]) * per_c), z + r * (y[c + 1] * (1.0 + per_c) - y[J])],
            [y[Q] + y[o] - (y[J + 1] - sigma * y[o]) * per_o, y[J] + y[o + 1] * (1.0 + sigma * per_o)],
        ]
    }

    /// With what force the cloth carries each ball, from the vertical force on the object ball.
    #[inline(always)]
    fn pressed(&self, rising: f64) -> [f64; 2] {
        [self.gravity / self.per_r + rising, self.gravity - rising]
    }

    /// Friction of the cloth on both balls; where it would pull, as smooth as before.
    #[inline(always)]
    fn cloth(&self, mode: &Mode, y: &State, rising: f64) -> [[f64; 2]; 2] {
        let pressed = self.pressed(rising);
        let most = [0, 1].map(|b| if mode.up[b] { 0.0 } else { self.mu_cloth[b] * pressed[b] });
        if !self.cloth_turning {
            return [[0.0; 2], [-most[1], 0.0]];
        }
        let slips = self.cloth_slips(y);
        [0, 1].map(|b| {
            let [x, z] = slips[b];
            let by = -most[b] / (x * x + z * z + self.smooth * self.smooth).sqrt();
            [by * x, by * z]
        })
    }

    /// The rates of impulses and vertical velocities for a friction φ.
    #[inline(always)]
    fn forces(&self, mode: &Mode, y: &State, phi: [f64; 2]) -> State {
        let [stretch, _] = self.phase(mode);
        let root = y[R];
        let (pace, force) = (2.0 * stretch * root, root * root * root);
        let rising = force * (phi[1] + self.tilt);
        let [c, o] = self.cloth(mode, y, rising);
        let up = |b: usize, force: f64| if mode.up[b] { pace * (force - self.gravity) } else { 0.0 };
        let mut rates = [0.0; N];
        rates[Q] = pace * force;
        for i in 0..2 {
            rates[J + i] = pace * force * phi[i];
            rates[CLOTH[0] + i] = pace * c[i];
            rates[CLOTH[1] + i] = pace * o[i];
            rates[HEIGHT[i]] = if mode.up[i] { pace * y[UP[i]] } else { 0.0 };
        }
        rates[UP[0]] = up(0, -self.per_r * rising);
        rates[UP[1]] = up(1, rising);
        rates
    }

    /// φ.
    #[inline(always)]
    fn phi(&self, mode: &Mode, y: &State, v: [f64; 2]) -> [f64; 2] {
        if self.is_frictionless() {
            return [0.0; 2];
        }
        let phi = [y[PHI], y[PHI + 1]];
        match mode.grip {
            Grip::Stuck => phi,
            Grip::Slides => {
                let by = self.friction(norm(v)) / norm(phi);
                phi.map(|p| by * p)
            }
            Grip::Follows => {
                let Lag { along, first, second } = self.lag(mode, y, v);
                let lag = first * (1.0 - second);
                [along[0] + lag * along[1], along[1] - lag * along[0]]
            }
        }
    }

    /// How friction that follows the slip lags behind it.
    #[inline(always)]
    fn lag(&self, mode: &Mode, y: &State, v: [f64; 2]) -> Lag {
        let [stretch, _] = self.phase(mode);
        let square = v[0] * v[0] + v[1] * v[1];
        let speed = square.sqrt();
        let mu = self.friction(speed);
        let per_speed = 1.0 / speed;
        let along = v.map(|v| -mu * v * per_speed);
        let rate = self.slip_by(&self.forces(mode, y, along));
        let (turned, faster) = (v[0] * rate[1] - v[1] * rate[0], v[0] * rate[0] + v[1] * rate[1]);
        let (turned, faster) = (turned * per_speed * per_speed, faster * per_speed * per_speed);
        // 1/ρ over R; α'/ρ grows as R⁵/|v|²
        let slow = mu * self.kappa * per_speed / (3.0 * stretch);
        let second = slow * (-5.0 * self.v_x(y) / stretch - 2.0 * y[R] * faster);
        Lag { along, first: turned * slow * y[R], second }
    }

    /// Whether the lag's third order is within a part of what is allowed.
    fn can_follow(&self, mode: &Mode, y: &State, v: [f64; 2], part: f64) -> bool {
        let speed = norm(v);
        let [stretch, _] = self.phase(mode);
        if stretch * speed * part <= FOLLOWS * self.friction(speed) * self.kappa {
            return false;
        }
        let Lag { first, second, .. } = self.lag(mode, y, v);
        // the impulse to there is of the order of R⁵
        (first * second * second).abs() * self.friction(speed) * y[R].powi(5) < part * self.follows
    }

    /// R, but not less than it matters.
    fn root(&self, mode: &Mode, y: &State) -> f64 {
        y[R].max(self.least_root[usize::from(mode.restitution)])
    }

    /// ρ.
    fn turning(&self, mode: &Mode, y: &State, speed: f64) -> f64 {
        let [stretch, _] = self.phase(mode);
        3.0 * stretch * speed / (self.kappa * self.friction(speed) * self.root(mode, y))
    }

    /// Positive while a contact slides on.
    fn slides_on(&self, mode: &Mode, y: &State, v: [f64; 2], phi: [f64; 2]) -> f64 {
        let [stretch, c] = self.phase(mode);
        let speed = norm(v);
        let mu = self.friction(speed);
        let mut limit = -c * mu * self.v_x(y) / stretch;
        if self.fall[0] != 0.0 && speed > 0.0 {
            let rate = self.slip_by(&self.forces(mode, y, phi));
            let slope = -self.fall[1] * (mu - self.mu);
            limit += y[R] * slope * (v[0] * rate[0] + v[1] * rate[1]) / speed;
        }
        -(v[0] * phi[0] + v[1] * phi[1]) - self.kappa * mu / (3.0 * stretch) * limit
    }

    /// The mode at first contact: it slides if |v| > μκ.
    fn first_mode(&self) -> Mode {
        let speed = norm(self.slip);
        let grip = if speed > self.friction(speed) * self.kappa { Grip::Slides } else { Grip::Stuck };
        let [_, z] = self.first_phi(grip);
        let rising = z + self.tilt;
        let up = if self.gravity > 0.0 { [false; 2] } else { [rising < 0.0, rising >= 0.0] };
        Mode { grip, restitution: false, up }
    }

    fn first_phi(&self, grip: Grip) -> [f64; 2] {
        let speed = norm(self.slip);
        match grip {
            Grip::Stuck => self.slip.map(|v| -v / self.kappa),
            _ => self.slip.map(|v| -self.friction(speed) * v / speed),
        }
    }

    fn first_state(&self, grip: Grip) -> State {
        let mut y = [0.0; N];
        [y[PHI], y[PHI + 1]] = self.first_phi(grip);
        y
    }

    /// The cloth stops a ball that lands with an impulse, and friction in proportion to it, at most what stops the slip.
    fn land(&self, ball: usize, y: &mut State) {
        let fallen = -y[UP[ball]];
        (y[UP[ball]], y[HEIGHT[ball]]) = (0.0, 0.0);
        let slip = self.cloth_slips(y)[ball];
        let speed = norm(slip);
        if fallen > 0.0 && speed > 0.0 && self.cloth_turning {
            // per unit of the object ball's mass
            let mass = if ball == 0 { 1.0 / self.per_r } else { 1.0 };
            let stops = mass * speed / (1.0 + self.per_nu[ball]);
            let impulse = (self.mu_cloth[ball] * mass * fallen).min(stops);
            for i in 0..2 {
                y[CLOTH[ball] + i] -= impulse * slip[i] / speed;
            }
        }
    }
}

impl System<N> for Shot {
    type Mode = Mode;

    #[inline(always)]
    fn rates(&self, mode: &Mode, y: &State) -> State {
        let v = self.slip(y);
        let phi = self.phi(mode, y, v);
        let mut rates = self.forces(mode, y, phi);
        let [stretch, c] = self.phase(mode);
        let dr = -self.v_x(y) / stretch;
        rates[R] = dr;
        let root = self.root(mode, y);
        let per_root = 1.0 / root;
        let gives = -3.0 * stretch * self.per_kappa * per_root;
        [rates[PHI], rates[PHI + 1]] = match mode.grip {
            Grip::Stuck => [0, 1].map(|i| gives * v[i] - c * dr * per_root * phi[i]),
            Grip::Slides => {
                let mu = self.friction(norm(v));
                let along = (v[0] * phi[0] + v[1] * phi[1]) / (mu * mu);
                let length = norm([y[PHI], y[PHI + 1]]) / mu;
                [0, 1].map(|i| length * gives * (v[i] - along * phi[i]))
            }
            Grip::Follows => [0.0; 2],
        };
        rates
    }

    /// The end of a phase, a change of grip, and of each ball lift-off or landing.
    fn events(&self, mode: &Mode, y: &State) -> [f64; EVENTS] {
        let v = self.slip(y);
        let phi = self.phi(mode, y, v);
        let grip = match mode.grip {
            Grip::Stuck => self.friction(norm(v)).powi(2) - phi[0] * phi[0] - phi[1] * phi[1],
            Grip::Slides => self.slides_on(mode, y, v, phi),
            Grip::Follows => 1.0,
        };
        // where the balls just touch or part, what matters is the direction of the force
        let rising = phi[1] + self.tilt;
        let weight = self.gravity > 0.0;
        let pressed = if weight { self.pressed(y[R].powi(3) * rising) } else { self.pressed(rising) };
        let ball = |b: usize| match mode.up[b] {
            false => pressed[b],
            // without weight a ball comes down where it no longer rises
            true if !weight => y[UP[b]],
            true if y[UP[b]] > -AT_REST => 1.0,
            true => y[HEIGHT[b]],
        };
        [if mode.restitution { y[R] } else { -self.v_x(y) }, grip, ball(0), ball(1)]
    }

    fn prepare(&self, mode: &Mode, y: &State) -> (Mode, f64) {
        if self.is_frictionless() {
            return (Mode { grip: Grip::Follows, ..*mode }, LONGEST);
        }
        let v = self.slip(y);
        let (speed, phi) = (norm(v), [y[PHI], y[PHI + 1]]);
        let turning = self.turning(mode, y, speed);
        let is_aligned = || -(v[0] * phi[0] + v[1] * phi[1]) > ALIGNED * speed * norm(phi);
        // events that roundings at the beginning of a step have hidden
        let beyond = || norm(phi) / self.friction(speed) - 1.0;
        let slides_on = || self.slides_on(mode, y, v, self.phi(mode, y, v));
        let grip = match mode.grip {
            Grip::Slides if slides_on() < -HIDDEN => Grip::Stuck,
            Grip::Stuck if beyond() > HIDDEN && slides_on() > 0.0 => Grip::Slides,
            Grip::Slides if is_aligned() && self.can_follow(mode, y, v, 0.5) => Grip::Follows,
            Grip::Follows if !self.can_follow(mode, y, v, 1.0) => Grip::Slides,
            grip => grip,
        };
        let longest = match grip {
            Grip::Stuck => self.root(mode, y),
            Grip::Slides => STABLE / turning,
            Grip::Follows => LONGEST,
        };
        (Mode { grip, ..*mode }, longest.min(LONGEST))
    }

    fn after(&self, mode: &Mode, event: usize) -> Option<Mode> {
        let mut next = *mode;
        match event {
            0 if mode.restitution || self.e == 0.0 => return None,
            0 => next.restitution = true,
            1 => next.grip = if mode.grip == Grip::Stuck { Grip::Slides } else { Grip::Stuck },
            _ => next.up[event - 2] ^= true,
        }
        Some(next)
    }

    fn change(&self, from: &Mode, to: &Mode, y: &mut State) {
        if from.grip != to.grip {
            [y[PHI], y[PHI + 1]] = self.phi(from, y, self.slip(y));
        }
        for b in 0..2 {
            match (from.up[b], to.up[b]) {
                (true, false) => self.land(b, y),
                (false, true) => (y[UP[b]], y[HEIGHT[b]]) = (0.0, 0.0),
                _ => {}
            }
        }
    }
}

fn norm(v: [f64; 2]) -> f64 {
    (v[0] * v[0] + v[1] * v[1]).sqrt()
}

/// Both balls after the impact in the order of [`Outcome::components`], and q.
fn outcome(shot: &Shot, values: &Values<f64>, model: &Model, y: &State) -> ([f64; 12], f64) {
    let k = values[Input::VelocityX];
    let y = y.map(|part| k * part);
    let none = Impulses { q: 0.0, y: 0.0, z: 0.0 };
    let mut all = components(values, model, &none);
    let &Shot { per_r, per_nu: [per_c, per_o], sigma, .. } = shot;
    let [c, o] = CLOTH.map(|at| [y[at], y[at + 1]]);
    let on_cue = per_r * per_c / model.ball.radius;
    let on_object = values[Input::RadiusRatio] * per_o / model.ball.radius;
    let changes = [
        per_r * (c[0] - y[Q]),
        per_r * (c[1] - y[J]),
        y[UP[0]],
        on_cue * c[1],
        on_cue * (y[J + 1] - c[0]),
        -on_cue * y[J],
        y[Q] + o[0],
        y[J] + o[1],
        y[UP[1]],
        on_object * sigma * o[1],
        on_object * (y[J + 1] - sigma * o[0]),
        -on_object * y[J],
    ];
    for (all, change) in all.iter_mut().zip(changes) {
        *all += change;
    }
    (all, y[Q])
}

/// An impact that was integrated, from which its derivatives follow.
pub(super) struct Solved {
    pub outcome: Outcome,
    steps: Vec<Step<Mode>>,
}

pub(super) fn solve(values: &Values<f64>, model: &Model) -> Result<Solved, TooManySteps> {
    let shot = Shot::new(values, model);
    let (mode, mut steps) = (shot.first_mode(), Vec::with_capacity(64));
    let (y, _) = integrate(&shot, mode, shot.first_state(mode.grip), model.tolerance, &mut steps)?;
    let stuck = steps.iter().any(|step| step.mode.grip == Grip::Stuck);
    let regime = if stuck { Regime::Stick } else { Regime::Slide };
    let (components, q) = outcome(&shot, values, model, &y);
    Ok(Solved { outcome: Outcome::new(regime, q, &components), steps })
}

impl Solved {
    /// The components for values that differ a little.
    pub fn beside(&self, values: &Values<f64>, model: &Model) -> [f64; 12] {
        let shot = Shot::new(values, model);
        let grip = self.steps.first().map_or(Grip::Stuck, |first| first.mode.grip);
        let y = follow(&shot, shot.first_state(grip), &self.steps);
        outcome(&shot, values, model, &y).0
    }
}
