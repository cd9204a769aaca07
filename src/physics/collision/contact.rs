//! The equations of a contact, as they are integrated: compliant along the surface and resolved in
//! time (Mindlin 1949; Maw, Barber & Fawcett 1976), with all that acts on both balls while it
//! lasts; or rigid, as [`super::sliding`] solves it.
//!
//! The normal force is Hertz's in compression, F = x^(3/2) at an approach x, and in restitution F =
//! x_m^(3/2) u^(3/2) with u = (x − (1 − e²)x_m)/(e²x_m): continuous, with exactly the energetic e.
//! The unit of velocity is the closing speed k, that of stiffness Hertz's. With R = F^(1/3), time
//! dt = 2Rε ds (ε = 1 in compression, e in restitution) and φ = f/F, the friction on the object
//! ball over the normal force:
//!
//! ```text
//! dR/ds = −v_x/ε        dq/ds = 2εR⁴        dJ/ds = 2εR⁴φ
//! stuck     dφ/ds = −(3ε/κR) v − (c/R)(dR/ds) φ      until |φ| = μ; c = 3, in restitution 2
//! sliding   φ = μw, dw/ds = −(3ε/κRμ)(v − (v·w)w)    until −v·w ≤ (κ/3ε)(cμ dR/ds + R dμ/ds)
//! ```
//!
//! κ = (2 − σ)/2(1 − σ) with Poisson's ratio σ (Walton & Braun 1986; Thornton, Cummins & Cleary
//! 2013). Friction turns to the slip at the rate ρ = 3ε|v|/(κμR). If that is faster than all else,
//! it lags behind the slip's direction α by α'/ρ − (α'/ρ)'/ρ.
//!
//! The state is the impulse until now, per unit of the object ball's mass: impulses q, J of the
//! balls and C, O of the cloth on each ball, vertical velocities and heights. A ball leaves a cloth
//! that would have to pull, and lands with a friction impulse of at most μ times its speed.
//!
//! A rigid contact needs no time: dq = ε|v|μ₀/μ(|v|) ds, μ₀ the friction at first contact, dJ/ds =
//! −εμ₀v. R is replaced by the energy of the normal force over ε², dE/ds = −v_x/ε² dq/ds. It
//! sticks once the slip that is left makes no difference; from there on dq = ε ds.

mod modes;

use nalgebra::Vector2;

use super::impact::{Impact, Impulses, Values};
use super::{Effects, Fidelity, Input, Model};
use crate::physics::cloth_motion::GRAVITY;

/// Places in the state; those of pairs are of the cue ball and the object ball, or of y and z.
const R: usize = 0;
const Q: usize = 1;
const J: usize = 2;
const CLOTH: [usize; 2] = [4, 6];
const UP: [usize; 2] = [8, 9];
const HEIGHT: [usize; 2] = [10, 11];
const PHI: usize = 12;
pub(super) const N: usize = 14;
pub(super) type State = [f64; N];

/// A vector along the surface of the contact, y and z, or along the cloth, x and y.
type Pair = Vector2<f64>;

/// The number of events.
pub(super) const EVENTS: usize = 4;

/// Duration of an elastic contact of equal balls in units of time: 4√π Γ(2/5)/(5 Γ(9/10)) ·
/// (5/8)^(2/5) (Hertz 1882).
const ELASTIC: f64 = 2.438_837_564_705_526_7;

/// Part of the tolerance that an approximation may take; a rigid contact sticks below it.
const NEGLIGIBLE: f64 = 0.1;

/// The numbers of one shot, in units of the closing speed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shot {
    /// k, m/s.
    k: f64,
    is_rigid: bool,
    /// μ₀ of a rigid contact, and the slip at which it sticks.
    first: f64,
    sticks: f64,
    /// v_y0, v_z0.
    slip: Pair,
    /// s_x0, s_y0 of the cue ball on the cloth.
    cue_slip: Pair,
    mu: f64,
    /// b and c, in units of k, of a friction that decreases.
    fall: [f64; 2],
    /// Friction of the cloth on the cue ball and on the object ball, μ_k and μ_s.
    mu_cloth: [f64; 2],
    /// Whether the cloth's friction on the object ball is along its slip, and not along −x.
    cloth_turning: bool,
    e: f64,
    kappa: f64,
    /// 1/r.
    per_r: f64,
    /// 1/ν of the cue ball and of the object ball.
    per_nu: [f64; 2],
    /// sin δ.
    tilt: f64,
    gravity: f64,
    sigma: f64,
    /// The slip below which the cloth's friction is in proportion to it, a part of the speeds.
    smooth: f64,
    /// The R below which friction turns as it does there, in compression and in restitution. The
    /// impulses err by its tenth power (its sixth under weight) and its fifth.
    least_root: [f64; 2],
    tolerance: f64,
}

/// The grip of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Grip {
    Stuck,
    Slides,
    /// Slides, with a direction of friction that follows from the slip.
    Follows,
    /// Slides, rigid.
    Rigid,
    /// Is stuck, rigid.
    Stopped,
}

/// Which equations hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Mode {
    grip: Grip,
    restitution: bool,
    /// Whether each ball is off the cloth.
    up: [bool; 2],
}

impl Mode {
    /// Whether the contact is stuck.
    pub fn is_stuck(&self) -> bool {
        matches!(self.grip, Grip::Stuck | Grip::Stopped)
    }
}

impl Shot {
    pub fn new(values: &Values<f64>, model: &Model) -> Self {
        let Impact { k, slip, e, mu, fall, per_r, .. } = Impact::new(values, model);
        let Effects { gravity, cloth_on_cue, cloth_turning, .. } =
            model.effects.and(model.fidelity.effects());
        let (radius, ratio) = (model.ball.radius, values[Input::RadiusRatio]);
        let on = |on: bool, value: f64| if on { value } else { 0.0 };
        let time_unit = model.contact_time * k.powf(-0.2) / ELASTIC;
        let gravity = on(gravity, GRAVITY * time_unit / k);
        let [u_y, w_x, w_y] = [Input::VelocityY, Input::SpinX, Input::SpinY].map(|input| values[input]);
        let kappa = values[Input::Kappa];
        let is_rigid = model.fidelity == Fidelity::Ode && !model.is_compliant();
        let mut shot = Self {
            k,
            is_rigid,
            first: 1.0,
            sticks: NEGLIGIBLE * model.tolerance,
            slip: Pair::from(slip) / k,
            cue_slip: Pair::new(1.0 - radius * w_y / k, (u_y + radius * w_x) / k),
            mu,
            fall: fall.map_or([0.0; 2], |[b, c]| [b, c * k]),
            mu_cloth: [on(cloth_on_cue, model.mu_k), values[Input::MuS]],
            cloth_turning,
            e,
            kappa,
            per_r,
            per_nu: model.per_inertia(),
            // of a rigid contact it is in the impulses afterwards
            tilt: on(!is_rigid, (1.0 - ratio) / (1.0 + ratio)),
            gravity,
            smooth: 1e-4 * (1.0 + 0.1 * (u_y / k).abs() + ELASTIC * gravity),
            sigma: model.torque_sign(),
            least_root: [if gravity > 0.0 { 1.0 / 6.0 } else { 0.1 }, 0.2]
                .map(|power| model.tolerance.powf(power)),
            tolerance: model.tolerance,
        };
        shot.first = shot.friction(shot.slip.norm());
        shot
    }

    /// μ at a slip, more than 0 so that it has a direction.
    fn friction(&self, speed: f64) -> f64 {
        let [b, c] = self.fall;
        let falling = if b == 0.0 { 0.0 } else { b * (-c * speed).exp() };
        (self.mu + falling).max(1e-15)
    }

    /// Whether the balls are frictionless at any slip.
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
    fn slip_by(&self, y: &State) -> Pair {
        let &Self { per_r, per_nu: [per_c, per_o], sigma, .. } = self;
        let ([c, o], j) = (CLOTH.map(|at| pair(y, at)), pair(y, J));
        let lever = per_r * per_c + per_o;
        let rise = y[UP[1]] - y[UP[0]] + lever * j.y - per_r * c.x * per_c - sigma * o.x * per_o;
        Pair::new((1.0 + per_r + lever) * j.x + o.y - per_r * c.y, rise)
    }

    #[inline(always)]
    fn slip(&self, y: &State) -> Pair {
        self.slip + self.slip_by(y)
    }

    /// The slips of both balls on the cloth.
    #[inline(always)]
    fn cloth_slips(&self, y: &State) -> [Pair; 2] {
        let &Self { per_r, per_nu: [per_c, per_o], sigma, .. } = self;
        let ([c, o], j) = (CLOTH.map(|at| pair(y, at)), pair(y, J));
        let cue = Pair::new(c.x - y[Q] - (j.y - c.x) * per_c, c.y * (1.0 + per_c) - j.x);
        let object = Pair::new(y[Q] + o.x - (j.y - sigma * o.x) * per_o, j.x + o.y * (1.0 + sigma * per_o));
        [self.cue_slip + per_r * cue, object]
    }

    /// The forces with which the cloth carries the balls, by the vertical force on the object ball.
    #[inline(always)]
    fn pressed(&self, rising: f64) -> [f64; 2] {
        [self.gravity / self.per_r + rising, self.gravity - rising]
    }

    /// Friction of the cloth on both balls, also of a cloth that would have to pull.
    #[inline(always)]
    fn cloth(&self, mode: &Mode, y: &State, rising: f64) -> [Pair; 2] {
        let pressed = self.pressed(rising);
        let most = |b: usize| if mode.up[b] { 0.0 } else { self.mu_cloth[b] * pressed[b] };
        if !self.cloth_turning {
            return [Pair::zeros(), Pair::new(-most(1), 0.0)];
        }
        let (slips, smooth) = (self.cloth_slips(y), self.smooth * self.smooth);
        let along = |b: usize| slips[b] * (-most(b) / (slips[b].norm_squared() + smooth).sqrt());
        [along(0), along(1)]
    }

    /// dt/ds and F; of a rigid contact dq/ds and 1.
    #[inline(always)]
    fn pace(&self, mode: &Mode, y: &State) -> [f64; 2] {
        let ([stretch, _], root) = (self.phase(mode), y[R]);
        match mode.grip {
            Grip::Stopped => [stretch, 1.0],
            Grip::Rigid => {
                let speed = self.slip(y).norm();
                [stretch * speed * self.first / self.friction(speed), 1.0]
            }
            _ => [2.0 * stretch * root, root * root * root],
        }
    }

    /// The rates of impulses and vertical velocities for a friction φ.
    #[inline(always)]
    fn forces(&self, mode: &Mode, y: &State, phi: Pair) -> State {
        let [pace, force] = self.pace(mode, y);
        let rising = force * (phi.y + self.tilt);
        let cloth = self.cloth(mode, y, rising);
        let lift = [-self.per_r * rising, rising];
        let mut rates = [0.0; N];
        rates[Q] = pace * force;
        rates[J..J + 2].copy_from_slice((pace * force * phi).as_slice());
        for b in 0..2 {
            rates[CLOTH[b]..CLOTH[b] + 2].copy_from_slice((pace * cloth[b]).as_slice());
            if mode.up[b] {
                rates[UP[b]] = pace * (lift[b] - self.gravity);
                // heights matter only to a ball that falls
                rates[HEIGHT[b]] = if self.gravity > 0.0 { pace * y[UP[b]] } else { 0.0 };
            }
        }
        rates
    }

    /// The impulses of a state, m/s.
    pub fn impulses(&self, values: &Values<f64>, model: &Model, y: &State) -> Impulses<f64> {
        let y = y.map(|part| self.k * part);
        if self.is_rigid {
            return Impact::new(values, model).impulses(values, [y[Q], y[J], y[J + 1]]);
        }
        let cloth = CLOTH.map(|at| [y[at], y[at + 1]]);
        Impulses { q: y[Q], friction: [y[J], y[J + 1]], cloth, up: UP.map(|at| y[at]) }
    }

    /// The state's rates.
    #[inline(always)]
    pub fn rates(&self, mode: &Mode, y: &State) -> State {
        let v = self.slip(y);
        let phi = self.phi(mode, y, v);
        let mut rates = self.forces(mode, y, phi);
        let [stretch, c] = self.phase(mode);
        let dr = -self.v_x(y) / stretch;
        if self.is_rigid {
            rates[R] = dr * rates[Q] / stretch;
            return rates;
        }
        rates[R] = dr;
        let per_root = 1.0 / self.root(mode, y);
        let gives = -3.0 * stretch * per_root / self.kappa;
        let turns = match mode.grip {
            Grip::Stuck => gives * v - c * dr * per_root * phi,
            Grip::Slides => {
                let mu = self.friction(v.norm());
                pair(y, PHI).norm() / mu * gives * (v - v.dot(&phi) / (mu * mu) * phi)
            }
            _ => Pair::zeros(),
        };
        rates[PHI..].copy_from_slice(turns.as_slice());
        rates
    }

    /// Functions that are positive until their event: the end of a phase, a change of grip, and of
    /// each ball lift-off or landing.
    pub fn events(&self, mode: &Mode, y: &State) -> [f64; EVENTS] {
        let v = self.slip(y);
        let end = if mode.restitution { y[R] } else { -self.v_x(y) };
        if self.is_rigid {
            let slides = mode.grip == Grip::Rigid && !self.is_frictionless();
            return [end, if slides { v.norm() / self.sticks - 1.0 } else { 1.0 }, 1.0, 1.0];
        }
        let phi = self.phi(mode, y, v);
        let grip = match mode.grip {
            Grip::Stuck => self.friction(v.norm()).powi(2) - phi.norm_squared(),
            Grip::Slides => self.slides_on(mode, y, v, phi),
            _ => 1.0,
        };
        // if the balls just touch or part, the direction of the force decides
        let rising = phi.y + self.tilt;
        let weight = self.gravity > 0.0;
        let pressed = if weight { self.pressed(y[R].powi(3) * rising) } else { self.pressed(rising) };
        let ball = |b: usize| match mode.up[b] {
            false => pressed[b],
            // without weight a ball comes down once it no longer rises
            true if !weight => y[UP[b]],
            // friction may just carry its weight
            true if y[UP[b]] > -1e-14 => 1.0,
            true => y[HEIGHT[b]],
        };
        [end, grip, ball(0), ball(1)]
    }
}

#[inline(always)]
fn pair(y: &State, at: usize) -> Pair {
    Pair::new(y[at], y[at + 1])
}
