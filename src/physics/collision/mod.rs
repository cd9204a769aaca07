//! The collision itself: from the cue ball's state before the impact to both balls' after it, in
//! the collision frame ([`contact_frame`](super::contact_frame)), with the object ball at rest.
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

mod corrected;
mod effects;
mod elastic;
mod fidelity;
mod inelastic;
mod input;
mod integrated;
mod kim;
mod law;
mod linear;
mod outcome;
mod recent;
mod restitution_law;
mod steps;
mod unequal;

use nalgebra::{SMatrix, SVector};

use super::ball::{Ball, BallState};
use super::cloth_motion::Cloth;
use super::friction_law::Law;
use super::name::worded;

pub(crate) use corrected::{Corrected, Correction};
pub use effects::Effects;
pub use fidelity::{Fidelity, FidelityChoice};
use input::Contact;
pub(crate) use input::MASS_RATIOS;
pub use input::NotACollision;
pub use law::{ByOthers, OTHERS};
pub use outcome::{Input, Jacobian, Outcome};
pub use unequal::Column;

/// Friction and restitution of one collision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// μ, sliding friction between the balls; the a of a [`Law`] by which it falls with the slip.
    pub mu: f64,
    /// μ_s, friction of the cloth on the object ball.
    pub mu_s: f64,
    /// e, energetic coefficient of restitution (Stronge); the e₀ of one that falls with the closing speed.
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

/// The smallest [`Model::tolerance`]: below it, rounding errors prevail.
pub const MIN_TOLERANCE: f64 = 1e-12;
/// The largest [`Model::tolerance`]: above it, the error is no longer of the order of the tolerance.
pub const MAX_TOLERANCE: f64 = 1e-2;

/// Poisson's ratio σ of phenolic resin, of which balls are made, dimensionless.
pub const POISSON: f64 = 0.34;

/// The largest [`Model::kappa`]: a contact that is softer along its surface hardly transmits any friction.
pub const MAX_KAPPA: f64 = 100.0;

/// The tangential compliance κ = (2 − σ)/(2(1 − σ)) of elastic bodies with Poisson's ratio σ, dimensionless (Mindlin 1949).
#[must_use]
pub const fn kappa(poisson: f64) -> f64 {
    (2.0 - poisson) / (2.0 * (1.0 - poisson))
}

worded! {
    /// Whether the contact slides to the end or sticks on the way.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Regime {
        /// The contact slides until the balls separate.
        Slide = "slide",
        /// Friction stops the slip before the balls separate, and the contact sticks.
        Stick = "stick",
    }
    /// The name in the output of the program: `slide` or `stick`.
    pub fn name;
}

/// A collision model: what is needed besides the coefficients and the state of the cue ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Model {
    /// How closely the collision is modelled.
    pub fidelity: Fidelity,
    /// The cue ball.
    pub ball: Ball,
    /// The object ball, where it differs from the cue ball; `None` stands for an equal one.
    pub object: Option<Ball>,
    /// The sign of the torque by which the cloth acts on the object ball.
    pub cloth_torque: ClothTorque,
    /// Which effects are simulated, as far as the fidelity can. Of stick and turning the
    /// fidelity alone decides: switching them off changes nothing.
    pub effects: Effects,
    /// How the friction between the balls falls with the slip. The fidelities in closed form take the friction at the
    /// first slip, which is an approximation; `ode` and `contact` follow the slip during the impact.
    pub law: Law,
    /// The e₁ of a restitution that falls with the closing speed v, e(v) = e₀ − e₁v but not below 0, in s/m; `None`
    /// where e is constant.
    pub e_slope: Option<f64>,
    /// Used by `ode` and `contact`: the tangential compliance κ, the ratio of normal to tangential stiffness of the
    /// contact, dimensionless. 0 is a contact that is rigid along its surface, as in Kim (2024).
    pub kappa: f64,
    /// Used by `ode` and `contact`: the error of each step relative to the closing speed k. The outcome's error is of
    /// that order.
    pub tolerance: f64,
    /// Used by `ode` and `contact`: the friction of the cloth on the cue ball μ_k, dimensionless.
    pub mu_k: f64,
    /// Used by `contact`: how long an elastic head-on impact at 1 m/s lasts, in seconds. At a closing speed of k m/s
    /// it lasts k^(−1/5) times as long (Hertz).
    pub contact_time: f64,
}

impl Model {
    /// The default of [`Model::contact_time`], in seconds: balls of phenolic resin touch for 250 to 300 µs (Kim 2024, below Eq. 37).
    pub const CONTACT_TIME: f64 = 280e-6;

    /// The default of [`Model::tolerance`]: far below any error of measurement, and about six digits above rounding errors.
    pub const TOLERANCE: f64 = 1e-10;

    /// The tolerance that fits use: still far below any error of measurement, at a few microseconds for a collision.
    pub const TOLERANCE_OF_FITS: f64 = 2e-7;

    /// The tangential compliance κ of phenolic resin, whose Poisson's ratio is 0.34 ([`kappa`]).
    pub const KAPPA: f64 = kappa(POISSON);

    /// A model of equal balls, rigid along their surface, with constant friction and restitution and the effects that the fidelity
    /// contains by default.
    #[must_use]
    pub fn new(fidelity: Fidelity, ball: Ball) -> Self {
        let effects = match fidelity {
            Fidelity::Ode => Effects { cloth_turning: false, cloth_on_cue: false, ..Effects::ALL },
            _ => Effects::ALL,
        };
        Self {
            fidelity,
            ball,
            object: None,
            cloth_torque: ClothTorque::Corrected,
            effects,
            law: Law::Constant,
            e_slope: None,
            kappa: 0.0,
            tolerance: Self::TOLERANCE,
            mu_k: Cloth::default().sliding,
            contact_time: Self::CONTACT_TIME,
        }
    }

    /// The cue ball's mass over the object ball's, m_cue/m_object.
    #[must_use]
    #[inline]
    pub fn mass_ratio(&self) -> f64 {
        self.object.map_or(1.0, |object| self.ball.mass / object.mass)
    }

    /// The object ball, which is like the cue ball unless stated otherwise.
    #[must_use]
    #[inline]
    pub fn object_ball(&self) -> Ball {
        self.object.unwrap_or(self.ball)
    }

    /// The same model with another mass of the object ball, so that m_cue/m_object is `ratio`.
    #[must_use]
    pub fn with_mass_ratio(self, ratio: f64) -> Self {
        let object = Ball { mass: self.ball.mass / ratio, ..self.object_ball() };
        Self { object: Some(object), ..self }
    }

    /// The cue ball's radius over the object ball's, R_cue/R_object.
    #[must_use]
    pub fn radius_ratio(&self) -> f64 {
        self.object.map_or(1.0, |object| self.ball.radius / object.radius)
    }

    /// The same model with another radius of the object ball, so that R_cue/R_object is `ratio`.
    #[must_use]
    pub fn with_radius_ratio(self, ratio: f64) -> Self {
        let object = Ball { radius: self.ball.radius / ratio, ..self.object_ball() };
        Self { object: Some(object), ..self }
    }

    /// The sine of the angle δ by which the line of centres rises towards the object ball: sin δ = (R_o − R_c)/(R_o + R_c), positive for
    /// a larger object ball.
    #[must_use]
    #[inline]
    pub fn tilt(&self) -> f64 {
        let (cue, object) = (self.ball.radius, self.object_ball().radius);
        (object - cue) / (object + cue)
    }

    /// Whether the contact gives way along the surface.
    #[must_use]
    pub fn is_compliant(&self) -> bool {
        self.effects.and(self.fidelity.effects()).compliance && self.kappa != 0.0
    }

    /// The outcome of a collision (Kim 2024, Eqs. 42–49 with q, J_y, J_z in place of his functions
    /// of θ).
    ///
    /// # Errors
    /// Input that describes no collision: balls that do not approach, coefficients out of range, a vertical
    /// velocity, anything not finite.
    pub fn collide(&self, cue: &BallState, coefficients: &Coefficients) -> Result<Outcome, NotACollision> {
        if self.is_usual() { self.find(cue, coefficients) } else { self.find_unusual(cue, coefficients) }
    }

    /// Equal balls whose restitution does not depend on the speed.
    #[inline(always)]
    fn is_usual(&self) -> bool {
        self.object.is_none() && self.e_slope.is_none()
    }

    /// Apart, so that equal balls are computed with what is constant for them.
    #[cold]
    #[inline(never)]
    fn find_unusual(&self, cue: &BallState, coefficients: &Coefficients) -> Result<Outcome, NotACollision> {
        match self.at_closing_speed(cue, coefficients) {
            Some((model, coefficients, _)) => model.find(cue, &coefficients),
            None => self.find(cue, coefficients),
        }
    }

    #[inline(always)]
    fn find(&self, cue: &BallState, coefficients: &Coefficients) -> Result<Outcome, NotACollision> {
        let contact = self.contact(cue, coefficients)?;
        let (impulse, regime) = match self.fidelity {
            Fidelity::Elastic => elastic::impulse(&contact),
            Fidelity::Inelastic => inelastic::impulse(&contact),
            Fidelity::Linear => linear::impulse(&contact),
            Fidelity::Full => kim::impulse(&contact),
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
        if !self.is_usual() {
            return self.unusual_with_jacobian(cue, coefficients);
        }
        self.with_jacobian(cue, coefficients, &self.contact(cue, coefficients)?)
    }

    #[cold]
    #[inline(never)]
    fn unusual_with_jacobian(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<(Outcome, Jacobian), NotACollision> {
        if let Some((model, coefficients, slopes)) = self.at_closing_speed(cue, coefficients) {
            let contact = model.contact(cue, &coefficients)?;
            let (outcome, mut jacobian) = model.with_jacobian(cue, &coefficients, &contact)?;
            _ = slopes.carry(&mut jacobian);
            return Ok((outcome, jacobian));
        }
        self.with_jacobian(cue, coefficients, &self.contact(cue, coefficients)?)
    }

    #[inline(always)]
    fn with_jacobian(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
        contact: &Contact,
    ) -> Result<(Outcome, Jacobian), NotACollision> {
        if self.fidelity.is_integrated() {
            let found = integrated::collide_with_jacobian(self, cue, coefficients, contact);
            return found.map(|(outcome, jacobian, _)| (outcome, jacobian));
        }
        let ((impulse, regime), mut gradient) = self.impulse_and_gradient(contact);
        self.silence(&mut gradient);
        self.follow_law(&mut gradient, contact, coefficients);
        let outcome = self.outcome(cue, contact, &impulse, regime);
        Ok((outcome, self.jacobian(contact, &impulse, &gradient)))
    }

    /// Of a closed form.
    #[inline(always)]
    fn impulse_and_gradient(&self, contact: &Contact) -> ((Impulse, Regime), ImpulseGradient) {
        match self.fidelity {
            Fidelity::Elastic => (elastic::impulse(contact), elastic::gradient()),
            Fidelity::Inelastic => (inelastic::impulse(contact), inelastic::gradient(contact)),
            Fidelity::Linear => (linear::impulse(contact), linear::gradient(contact)),
            Fidelity::Full | Fidelity::Ode | Fidelity::Contact => kim::impulse_and_gradient(contact),
        }
    }

    /// Nothing depends on the coefficient of an effect that is off.
    #[inline(always)]
    fn silence(&self, gradient: &mut ImpulseGradient) {
        let effects = self.effects;
        for (of, on) in [
            (variable::MU, effects.friction),
            (variable::M_S, effects.cloth),
            (variable::E, effects.inelasticity),
        ] {
            if !on {
                (gradient.normal[of], gradient.y[of], gradient.z[of]) = (0.0, 0.0, 0.0);
            }
        }
    }

    /// The friction follows the first slip: dμ/dv of it adds to what that slip does.
    #[inline(always)]
    fn follow_law(&self, gradient: &mut ImpulseGradient, contact: &Contact, coefficients: &Coefficients) {
        let friction = self.law.friction(coefficients.mu);
        if !friction.falls() {
            return;
        }
        let v = length(contact.v_y, contact.v_z);
        let slope = friction.slope(v);
        if slope == 0.0 || v == 0.0 {
            return;
        }
        for of in [&mut gradient.normal, &mut gradient.y, &mut gradient.z] {
            let by_mu = of[variable::MU] * slope;
            of[variable::V_Y] += by_mu * contact.v_y / v;
            of[variable::V_Z] += by_mu * contact.v_z / v;
        }
    }
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

/// The impulses of a collision per unit mass, m/s: q, J_y and J_z.
#[derive(Clone, Copy, Debug)]
struct Impulse {
    normal: f64,
    y: f64,
    z: f64,
}

/// Derivative with respect to the variables of [`Contact`], in the order of [`variable`].
type Gradient = SVector<f64, 6>;

/// An outcome and its derivatives by the inputs and by what else there is.
type All = (Outcome, Jacobian, Option<ByOthers>);

/// The components of an outcome by b and c.
type ByLaw = SMatrix<f64, 12, 2>;

/// Those by κ, and by b and c where the slip is followed.
type Others = (Column, Option<ByLaw>);

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
