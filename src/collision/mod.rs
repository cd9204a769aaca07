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

mod elastic;
mod full;
mod inelastic;
mod linear;
mod outcome;

use nalgebra::SVector;

use crate::ball::{Ball, BallState};
use crate::contact;

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
}

impl Fidelity {
    /// From the cheapest to the most exact.
    pub const ALL: [Self; 4] = [Self::Elastic, Self::Inelastic, Self::Linear, Self::Full];

    /// The name on the command line and in fit.json.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Elastic => "elastic",
            Self::Inelastic => "inelastic",
            Self::Linear => "linear",
            Self::Full => "full",
        }
    }
}

/// Friction and restitution of one collision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// μ, sliding friction between the balls.
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
}

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
}

impl Model {
    /// The corrected model.
    #[must_use]
    pub fn new(fidelity: Fidelity, ball: Ball) -> Self {
        Self { fidelity, ball, cloth_torque: ClothTorque::Corrected }
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
        };
        Ok(self.outcome(cue, &contact, &impulse, regime))
    }

    /// The outcome and its analytic derivative. Where the outcome has a kink (stick setting in,
    /// topspin turning to draw) it is the derivative of the side that the outcome is on.
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub fn collide_with_jacobian(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<(Outcome, Jacobian), NotACollision> {
        let contact = self.contact(cue, coefficients)?;
        let ((impulse, regime), gradient) = match self.fidelity {
            Fidelity::Elastic => (elastic::impulse(&contact), elastic::gradient()),
            Fidelity::Inelastic => (inelastic::impulse(&contact), inelastic::gradient(&contact)),
            Fidelity::Linear => (linear::impulse(&contact), linear::gradient(&contact)),
            Fidelity::Full => full::impulse_and_gradient(&contact),
        };
        let outcome = self.outcome(cue, &contact, &impulse, regime);
        Ok((outcome, self.jacobian(&contact, &impulse, &gradient)))
    }

    fn contact(&self, cue: &BallState, coefficients: &Coefficients) -> Result<Contact, NotACollision> {
        let Ball { radius, inertia, .. } = self.ball;
        let Coefficients { mu, mu_s, e } = *coefficients;
        let finite = |name, value: f64| {
            if value.is_finite() { Ok(value) } else { Err(NotACollision::NotFinite { name, value }) }
        };
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
        if mu * mu_s >= 2.0 {
            return Err(NotACollision::Jams(mu * mu_s));
        }
        if !(0.0..=1.0).contains(&finite("e", e)?) {
            return Err(NotACollision::EOutOfRange(e));
        }
        for (name, value) in [
            ("velocity x", cue.velocity.x),
            ("velocity y", cue.velocity.y),
            ("velocity z", cue.velocity.z),
            ("omega_x", cue.spin.x),
            ("omega_y", cue.spin.y),
            ("omega_z", cue.spin.z),
        ] {
            finite(name, value)?;
        }
        if cue.velocity.z != 0.0 {
            return Err(NotACollision::NotHorizontal(cue.velocity.z));
        }
        let v = contact::slip(cue, &BallState::default(), radius);
        let k = -v.x;
        if k <= 0.0 {
            return Err(NotACollision::NotApproaching(k));
        }
        let m_s = if v.z > 0.0 { mu_s } else { 0.0 };
        Ok(Contact { k, v_y: v.y, v_z: v.z, mu, m_s, e, nu: inertia, sigma: self.cloth_torque.sign() })
    }
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
    fn beta_y(&self) -> f64 {
        (1.0 + self.nu) / self.nu
    }

    /// β_z = (2 + ν − σm_s)/2ν.
    fn beta_z(&self) -> f64 {
        (2.0 + self.nu - self.sigma * self.m_s) / (2.0 * self.nu)
    }

    /// γ = β_y/β_z − 1 = (ν + σm_s)/(2 + ν − σm_s).
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
