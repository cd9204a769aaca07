//! The collision itself: from the cue ball's state before the impact to both balls' after it, in
//! the collision frame ([`crate::contact`]), for equal balls with the object ball at rest.
//!
//! H.-C. Kim, "Collision of two spinning billiard balls and the role of table", arXiv:2402.13258
//! (2024), with its errors corrected. Everything is per unit mass: q is the normal impulse p/M in
//! m/s and takes the place of time. Each [`Fidelity`] is one file that finds three numbers, the
//! normal impulse q and the friction impulses J_y = μ∫cos θ dq, J_z = μ∫sin θ dq; from these
//! [`Model::collide`] writes down all velocities and spins.
//!
//! | symbol | here | meaning |
//! | --- | --- | --- |
//! | k | `Contact::k` | closing speed U cos φ = −v_x0, m/s |
//! | v_y0, v_z0 | `Contact::v_y`, `v_z` | contact slip at first contact, m/s |
//! | m_s | `Contact::m_s` | μ_s with topspin (v_z0 > 0), else 0: the cloth then carries no load |
//! | β_y, β_z, γ | functions of `Contact` | inertia of the slip, and the exponent that turns it |

pub mod batch;
mod corrected;
mod dynamics;
mod effects;
mod elastic;
mod full;
mod hertz;
mod inelastic;
mod integrate;
mod integrated;
mod law;
mod linear;
mod ode;
mod outcome;
mod phase;
mod steps;

use nalgebra::SVector;

use crate::ball::{Ball, BallState, Vec3};
use crate::cloth::Cloth;
use crate::contact;
use crate::friction::{Friction, Law};

pub use corrected::{Corrected, Correction};
pub use effects::Effects;
pub use law::ByLaw;
pub use outcome::{Input, Jacobian, Outcome};

/// How closely the collision is modelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fidelity {
    /// No friction, no loss.
    Elastic,
    /// Restitution, no friction.
    Inelastic,
    /// First order in μ; no stick.
    Linear,
    /// The exact solution of the equations of motion, stick included.
    Full,
    /// The equations of motion integrated numerically, to [`Model::tolerance`]. It can do more than
    /// [`Fidelity::Full`], see [`Fidelity::effects`].
    Ode,
    /// The contact resolved in time, to [`Model::tolerance`], with everything that acts on the balls.
    Contact,
}

impl Fidelity {
    /// From the cheapest to the most exact.
    pub const ALL: [Self; 6] =
        [Self::Elastic, Self::Inelastic, Self::Linear, Self::Full, Self::Ode, Self::Contact];

    /// The name on the command line and in fit.json.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Elastic => "elastic",
            Self::Inelastic => "inelastic",
            Self::Linear => "linear",
            Self::Full => "full",
            Self::Ode => "ode",
            Self::Contact => "contact",
        }
    }

    /// Everything that it can do. [`Model::new`] switches all of it on, but for `ode` the cloth's
    /// friction on the cue ball and along the true slip, so that it solves the equations of `full`.
    #[must_use]
    pub fn effects(self) -> Effects {
        let inelastic = Effects { inelasticity: true, ..Effects::NONE };
        let linear = Effects { friction: true, cloth: true, ..inelastic };
        match self {
            Self::Elastic => Effects::NONE,
            Self::Inelastic => inelastic,
            Self::Linear => linear,
            Self::Full => Effects { stick: true, turning: true, ..linear },
            Self::Ode => Effects { gravity: false, ..Effects::ALL },
            Self::Contact => Effects::ALL,
        }
    }
}

/// Friction and restitution of one collision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// μ, sliding friction between the balls; the a of a [`Law`] by which it falls with the slip.
    pub mu: f64,
    /// μ_s, friction of the cloth on the object ball.
    pub mu_s: f64,
    /// e, energetic coefficient of restitution (Stronge).
    pub e: f64,
}

/// The sign of the torque by which the cloth acts on the object ball.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum ClothTorque {
    /// 1 − μ_s in dΩ_y/dq, for which the energy balance closes.
    #[default]
    Corrected,
    /// 1 + μ_s as printed in Kim's Eq. (10) and what follows from it. For comparison with the
    /// paper only.
    AsPrinted,
}

impl ClothTorque {
    /// σ: dΩ_y/dq = (μ/νR)(1 − σm_s) sin θ.
    #[inline]
    fn sign(self) -> f64 {
        match self {
            Self::Corrected => 1.0,
            Self::AsPrinted => -1.0,
        }
    }
}

/// Why an input is no collision. A wrong use, not a numerical outcome.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NotACollision {
    #[error("{name} is {value}; expected a finite number")]
    NotFinite { name: &'static str, value: f64 },
    #[error(
        "the cue ball does not approach: its velocity along the line of centres is {0} m/s; expected more than 0"
    )]
    NotApproaching(f64),
    #[error("the cue ball leaves the cloth with {0} m/s; expected a horizontal velocity")]
    NotHorizontal(f64),
    #[error("mu is {0}; expected 0 or more")]
    NegativeMu(f64),
    #[error("mu_s is {0}; expected 0 or more, below {1}")]
    MuSOutOfRange(f64, f64),
    #[error("mu·mu_s is {0}; expected less than 2, or the balls jam")]
    Jams(f64),
    #[error("e is {0}; expected 0 to 1")]
    EOutOfRange(f64),
    #[error("the radius is {0} m; expected more than 0")]
    Radius(f64),
    #[error("the moment of inertia over MR² is {0}; expected more than 0, at most 2/3 (a hollow sphere)")]
    Inertia(f64),
    #[error("mu_k is {0}; expected 0 or more, and mu·mu_k less than 2")]
    MuKOutOfRange(f64),
    #[error(
        "mu is {mu} and falls as b·exp(−c·v) with b = {b}, c = {c}; expected numbers, c and mu + b of 0 or more"
    )]
    Law { mu: f64, b: f64, c: f64 },
    #[error("the tolerance is {0}; expected {MIN_TOLERANCE:e} to {MAX_TOLERANCE:e}")]
    Tolerance(f64),
    #[error("the contact time is {0} s; expected more than 0")]
    ContactTime(f64),
    /// `ode` and `contact` bound their steps and changes of grip. Under gravity some slow shots run out of
    /// them (1 in 100 at 1e-10, below some 0.2 m/s): a slip on the cloth that passes close by 0, or settles
    /// there, turns faster than steps can follow. So do some with an e near 0, whose restitution lasts 1/e times
    /// their compression, under gravity all the while. (At 0 there is none: the impact ends with compression.)
    #[error(
        "the integration did not reach the end of the impact at a tolerance of {0:e}; expected a larger one"
    )]
    NotIntegrated(f64),
}

/// The range of [`Model::tolerance`]: below, roundings prevail; above, the error has no order.
pub const MIN_TOLERANCE: f64 = 1e-12;
pub const MAX_TOLERANCE: f64 = 1e-2;

/// Whether the contact slides to the end or sticks on the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Regime {
    Slide,
    Stick,
}

impl Regime {
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Slide => "slide",
            Self::Stick => "stick",
        }
    }
}

/// A collision model: what is needed besides the coefficients and the state of the cue ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Model {
    pub fidelity: Fidelity,
    pub ball: Ball,
    pub cloth_torque: ClothTorque,
    /// What is simulated, as far as the fidelity can. Stick and turning have no switch of their own.
    pub effects: Effects,
    /// How the friction between the balls falls with the slip. What has a closed form takes the friction
    /// at the first slip, an approximation; `ode` and `contact` follow the slip.
    pub law: Law,
    /// `ode` and `contact`: error of each step relative to the closing speed k. The outcome's error is
    /// of that order.
    pub tolerance: f64,
    /// `ode` and `contact`: μ_k, friction of the cloth on the cue ball.
    pub mu_k: f64,
    /// `contact`: how long an elastic head-on impact at 1 m/s lasts, in seconds. At k it lasts
    /// k^(−1/5) times as long (Hertz).
    pub contact_time: f64,
}

impl Model {
    /// Balls of phenolic resin touch for 250 to 300 µs (Kim 2024, below Eq. 37).
    pub const CONTACT_TIME: f64 = 280e-6;

    /// Far below what is measured, and half a dozen digits above roundings.
    pub const TOLERANCE: f64 = 1e-10;

    /// The corrected model with what the fidelity contains by default.
    #[must_use]
    pub fn new(fidelity: Fidelity, ball: Ball) -> Self {
        let effects = match fidelity {
            Fidelity::Ode => Effects { cloth_turning: false, cloth_on_cue: false, ..Effects::ALL },
            _ => Effects::ALL,
        };
        Self {
            fidelity,
            ball,
            cloth_torque: ClothTorque::Corrected,
            effects,
            law: Law::Constant,
            tolerance: Self::TOLERANCE,
            mu_k: Cloth::default().sliding,
            contact_time: Self::CONTACT_TIME,
        }
    }

    /// The outcome of a collision (Kim 2024, Eqs. 42–49 with q, J_y, J_z in place of his functions
    /// of θ).
    ///
    /// # Errors
    /// What is no collision: balls that do not approach, coefficients out of range, a vertical
    /// velocity, anything not finite.
    pub fn collide(&self, cue: &BallState, coefficients: &Coefficients) -> Result<Outcome, NotACollision> {
        let contact = self.contact(cue, coefficients)?;
        let (impulse, regime) = match self.fidelity {
            Fidelity::Elastic => elastic::impulse(&contact),
            Fidelity::Inelastic => inelastic::impulse(&contact),
            Fidelity::Linear => linear::impulse(&contact),
            Fidelity::Full => full::impulse(&contact),
            Fidelity::Ode | Fidelity::Contact => {
                return integrated::collide(self, cue, coefficients, &contact);
            }
        };
        Ok(self.outcome(cue, &contact, &impulse, regime))
    }

    /// The outcome and its derivative: analytic, but by central differences for `ode` and `contact`,
    /// with an error of about the tolerance to the power 2/3. Where the outcome has a kink (stick
    /// setting in, topspin turning to draw) it is the derivative of the side that the outcome is on; in
    /// between topspin and draw, differences give the mean of both sides.
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub fn collide_with_jacobian(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<(Outcome, Jacobian), NotACollision> {
        self.with_jacobian(cue, coefficients, &self.contact(cue, coefficients)?)
    }

    #[inline]
    fn with_jacobian(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
        contact: &Contact,
    ) -> Result<(Outcome, Jacobian), NotACollision> {
        let ((impulse, regime), gradient) = match self.fidelity {
            Fidelity::Elastic => (elastic::impulse(contact), elastic::gradient()),
            Fidelity::Inelastic => (inelastic::impulse(contact), inelastic::gradient(contact)),
            Fidelity::Linear => (linear::impulse(contact), linear::gradient(contact)),
            Fidelity::Full => full::impulse_and_gradient(contact),
            Fidelity::Ode | Fidelity::Contact => {
                return integrated::collide_with_jacobian(self, cue, coefficients, contact);
            }
        };
        let outcome = self.outcome(cue, contact, &impulse, regime);
        let mut jacobian = self.jacobian(contact, &impulse, &gradient);
        self.follow_law(&mut jacobian, contact, coefficients);
        self.silence(&mut jacobian);
        Ok((outcome, jacobian))
    }

    /// The friction follows the first slip: dμ/dv of it adds to what the state before the impact does.
    #[inline]
    fn follow_law(&self, jacobian: &mut Jacobian, contact: &Contact, coefficients: &Coefficients) {
        let friction = self.law.friction(coefficients.mu);
        if !friction.falls() {
            return;
        }
        let v = length(contact.v_y, contact.v_z);
        let slope = friction.slope(v);
        if slope == 0.0 || v == 0.0 {
            return;
        }
        let radius = self.ball.radius;
        let by_mu = jacobian.column(Input::Mu as usize) * slope;
        // v_y = −U_y − Rω_z, v_z = Rω_y
        for (input, dv) in [
            (Input::VelocityY, -contact.v_y / v),
            (Input::SpinY, radius * contact.v_z / v),
            (Input::SpinZ, -radius * contact.v_y / v),
        ] {
            let mut column = jacobian.column_mut(input as usize);
            column += by_mu * dv;
        }
    }

    /// Nothing depends on the coefficient of an effect that is off.
    #[inline]
    fn silence(&self, jacobian: &mut Jacobian) {
        let effects = self.effects;
        for (input, on) in
            [(Input::Mu, effects.friction), (Input::MuS, effects.cloth), (Input::E, effects.inelasticity)]
        {
            if !on {
                jacobian.column_mut(input as usize).fill(0.0);
            }
        }
    }

    #[inline]
    fn contact(&self, cue: &BallState, coefficients: &Coefficients) -> Result<Contact, NotACollision> {
        self.contact_of(cue, &self.checked(coefficients)?)
    }

    /// What all shots with these coefficients share.
    #[inline]
    fn checked(&self, coefficients: &Coefficients) -> Result<Shared, NotACollision> {
        let Ball { radius, inertia, .. } = self.ball;
        let Coefficients { mu, mu_s, e } = *coefficients;
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(NotACollision::Radius(radius));
        }
        if !(inertia > 0.0 && inertia <= HOLLOW_SPHERE) {
            return Err(NotACollision::Inertia(inertia));
        }
        if finite("mu", mu)? < 0.0 {
            return Err(NotACollision::NegativeMu(mu));
        }
        // β_z must stay positive, or the cloth would drive the slip it brakes
        if !(0.0..2.0 + inertia).contains(&finite("mu_s", mu_s)?) {
            return Err(NotACollision::MuSOutOfRange(mu_s, 2.0 + inertia));
        }
        let friction = self.law.friction(mu);
        if let Law::Exponential { b, c } = self.law {
            let valid = b.is_finite() && c.is_finite() && c >= 0.0 && mu + b >= 0.0;
            if !valid {
                return Err(NotACollision::Law { mu, b, c });
            }
        }
        if friction.largest() * mu_s >= 2.0 {
            return Err(NotACollision::Jams(friction.largest() * mu_s));
        }
        if !(0.0..=1.0).contains(&finite("e", e)?) {
            return Err(NotACollision::EOutOfRange(e));
        }
        let effects = self.effects;
        Ok(Shared {
            friction: if effects.friction { friction } else { Friction::Constant(0.0) },
            mu_s: if effects.cloth { mu_s } else { 0.0 },
            e: if effects.inelasticity { e } else { 1.0 },
        })
    }

    #[inline]
    fn contact_of(&self, cue: &BallState, shared: &Shared) -> Result<Contact, NotACollision> {
        if !(is_finite(&cue.velocity) && is_finite(&cue.spin)) {
            return Err(not_finite(cue));
        }
        if cue.velocity.z != 0.0 {
            return Err(NotACollision::NotHorizontal(cue.velocity.z));
        }
        let v = contact::slip(cue, &BallState::default(), self.ball.radius);
        let k = -v.x;
        if k <= 0.0 {
            return Err(NotACollision::NotApproaching(k));
        }
        let m_s = if v.z > 0.0 { shared.mu_s } else { 0.0 };
        let mu = match shared.friction {
            Friction::Constant(mu) => mu,
            falling @ Friction::Exponential { .. } => falling.mu(length(v.y, v.z)),
        };
        let (nu, sigma) = (self.ball.inertia, self.cloth_torque.sign());
        Ok(Contact { k, v_y: v.y, v_z: v.z, mu, m_s, e: shared.e, nu, sigma })
    }
}

#[inline]
fn finite(name: &'static str, value: f64) -> Result<f64, NotACollision> {
    if value.is_finite() { Ok(value) } else { Err(NotACollision::NotFinite { name, value }) }
}

#[inline]
fn is_finite(v: &Vec3) -> bool {
    v.x.is_finite() && v.y.is_finite() && v.z.is_finite()
}

/// The first component that is not finite.
#[cold]
fn not_finite(cue: &BallState) -> NotACollision {
    let BallState { velocity: v, spin } = cue;
    let (name, value) = [
        ("velocity x", v.x),
        ("velocity y", v.y),
        ("velocity z", v.z),
        ("omega_x", spin.x),
        ("omega_y", spin.y),
        ("omega_z", spin.z),
    ]
    .into_iter()
    .find(|(_, value)| !value.is_finite())
    .unwrap_or(("velocity", f64::NAN));
    NotACollision::NotFinite { name, value }
}

/// √(a² + b²), scaled only where a square is out of range.
#[inline]
fn length(a: f64, b: f64) -> f64 {
    let square = a * a + b * b;
    if SQUARES.contains(&square) { square.sqrt() } else { scaled_length(a, b) }
}

/// Squares that neither overflow nor lose digits.
const SQUARES: std::ops::Range<f64> = 1e-280..1e280;

/// √(a² + b²) of numbers whose squares are out of range, with the same rounding as of those in it.
#[cold]
fn scaled_length(a: f64, b: f64) -> f64 {
    let most = a.abs().max(b.abs());
    if most == 0.0 {
        return 0.0;
    }
    // powers of 2 that bring the larger one near 1, in two steps since 1/subnormal overflows
    let scale = if most < 1.0 { 2f64.powi(600) } else { 2f64.powi(-600) };
    let (a, b) = (a * scale, b * scale);
    (a * a + b * b).sqrt() / scale
}

/// What [`Contact`] takes from the coefficients, the effects that are off left out.
#[derive(Clone, Copy, Debug)]
struct Shared {
    friction: Friction,
    mu_s: f64,
    e: f64,
}

/// Moment of inertia of a thin hollow sphere over MR², the largest a ball can have.
const HOLLOW_SPHERE: f64 = 2.0 / 3.0;

/// What the impulses depend on.
#[derive(Clone, Copy, Debug)]
struct Contact {
    k: f64,
    v_y: f64,
    v_z: f64,
    mu: f64,
    m_s: f64,
    e: f64,
    nu: f64,
    sigma: f64,
}

impl Contact {
    /// β_y = (1 + ν)/ν.
    #[inline]
    fn beta_y(&self) -> f64 {
        (1.0 + self.nu) / self.nu
    }

    /// β_z = (2 + ν − σm_s)/2ν.
    #[inline]
    fn beta_z(&self) -> f64 {
        (2.0 + self.nu - self.sigma * self.m_s) / (2.0 * self.nu)
    }

    /// γ = β_y/β_z − 1 = (ν + σm_s)/(2 + ν − σm_s).
    #[inline]
    fn gamma(&self) -> f64 {
        (self.nu + self.sigma * self.m_s) / (2.0 + self.nu - self.sigma * self.m_s)
    }
}

/// The impulses of a collision per unit mass, m/s: q, J_y and J_z.
#[derive(Clone, Copy, Debug)]
struct Impulse {
    normal: f64,
    y: f64,
    z: f64,
}

/// Derivative with respect to the variables of [`Contact`], in the order of [`variable`].
type Gradient = SVector<f64, 6>;

mod variable {
    pub const K: usize = 0;
    pub const V_Y: usize = 1;
    pub const V_Z: usize = 2;
    pub const MU: usize = 3;
    pub const M_S: usize = 4;
    pub const E: usize = 5;
}

/// Derivatives of [`Impulse`].
#[derive(Clone, Copy, Debug)]
struct ImpulseGradient {
    normal: Gradient,
    y: Gradient,
    z: Gradient,
}

impl ImpulseGradient {
    fn zero() -> Self {
        Self { normal: Gradient::zeros(), y: Gradient::zeros(), z: Gradient::zeros() }
    }
}
