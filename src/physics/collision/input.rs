//! What the input of a collision must satisfy.

use super::impact::Values;
use super::{ClothTorque, Coefficients, Fidelity, Input, MAX_KAPPA, MAX_TOLERANCE, MIN_TOLERANCE, Model};
use crate::physics::ball::{Ball, BallState, Vec3};
use crate::physics::friction_law::Law;

/// Why an input describes no collision.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NotACollision {
    /// A number of the input is NaN or infinite.
    #[error("{name} is {value}; expected a finite number")]
    NotFinite {
        /// The name of that number.
        name: &'static str,
        /// The number itself.
        value: f64,
    },
    /// The line of centres, given as (x, y) in the frame of the table, has no length or is not finite.
    #[error("the line of centres ({0}, {1}) has no direction; expected a finite vector other than 0")]
    NoDirection(f64, f64),
    /// The cue ball does not move towards the object ball; with its velocity along the line of centres, m/s.
    #[error(
        "the cue ball does not approach: its velocity along the line of centres is {} m/s; expected more than 0", .0 + 0.0
    )]
    NotApproaching(f64),
    /// The cue ball has a vertical velocity, given here in m/s.
    #[error("the cue ball leaves the cloth with {0} m/s; expected a horizontal velocity")]
    NotHorizontal(f64),
    /// The larger component of the cue ball's velocity, or the speed of its surface, given here in m/s, is not within [`MIN_SPEED`] to
    /// [`MAX_SPEED`].
    #[error("the cue ball's speed is {0} m/s; expected {MIN_SPEED:e} to {MAX_SPEED:e}, also of its surface")]
    Speed(f64),
    /// The friction between the balls μ, given here, is negative.
    #[error("mu is {0}; expected 0 or more")]
    NegativeMu(f64),
    /// The friction of the cloth on the object ball μ_s, the first number, is negative or not below the second, 2 +
    /// ν of equal balls: from there on the cloth would drive the slip that it brakes.
    #[error("mu_s is {0}; expected 0 or more, below {1}")]
    MuSOutOfRange(f64, f64),
    /// With topspin: the product μ·μ_s, the first number, is not below the second, 1 + m_object/m_cue (2 of equal balls): the impact
    /// would never end, as dv_x/dq = 1 + m_object/m_cue + μ_s μ sin θ, sin θ from −1.
    #[error(
        "mu·mu_s is {0}; expected less than {1} with topspin (1 + object ball's mass over cue ball's), or the balls jam"
    )]
    Jams(f64, f64),
    /// The coefficient of restitution e, given here, is not within 0 to 1.
    #[error("e is {0}; expected 0 to 1")]
    EOutOfRange(f64),
    /// The radius of a ball, given here in m, is not positive and finite.
    #[error("the radius is {0} m; expected more than 0")]
    Radius(f64),
    /// The moment of inertia of a ball over MR², ν, given here, is not positive or more than 2/3.
    #[error("the moment of inertia over MR² is {0}; expected more than 0, at most 2/3 (a hollow sphere)")]
    Inertia(f64),
    /// The friction of the cloth on the cue ball μ_k, given here, is negative, or μ·μ_k is 1 + m_cue/m_object or more:
    /// with draw, the cloth on the cue ball drives the balls against each other.
    #[error("mu_k is {0}; expected 0 or more, and mu·mu_k less than 1 + cue ball's mass over object ball's")]
    MuKOutOfRange(f64),
    /// The law μ(v) = μ + b·exp(−c v) by which the friction between the balls falls with the slip v is not finite, is
    /// negative without slip, or has a negative c.
    #[error(
        "mu is {mu} and falls as b·exp(−c·v) with b = {b}, c = {c}; expected numbers, c and mu + b of 0 or more"
    )]
    Law {
        /// The friction μ that is left at a large slip, dimensionless.
        mu: f64,
        /// By how much the friction is larger without slip, dimensionless.
        b: f64,
        /// How fast the friction falls with the slip, s/m.
        c: f64,
    },
    /// The cue ball's mass over the object ball's, given here, is not within 0.001 to 1000.
    #[error("the cue ball's mass over the object ball's is {0}; expected 0.001 to 1000")]
    MassRatio(f64),
    /// The tangential compliance κ, given here, is not within 0 to [`MAX_KAPPA`].
    #[error("kappa is {0}; expected 0 (rigid along the surface) to {MAX_KAPPA}")]
    KappaOutOfRange(f64),
    /// [`ClothTorque::AsPrinted`] was asked for with balls that differ: the paper's equations are for equal balls.
    #[error("the paper's equations as printed are for equal balls; expected no other object ball")]
    UnequalAsPrinted,
    /// The tolerance, given here, is not within [`MIN_TOLERANCE`] to [`MAX_TOLERANCE`].
    #[error("the tolerance is {0}; expected {MIN_TOLERANCE:e} to {MAX_TOLERANCE:e}")]
    Tolerance(f64),
    /// The contact time, given here in s, is not positive and finite.
    #[error("the contact time is {0} s; expected more than 0")]
    ContactTime(f64),
    /// `contact` was asked for with a contact that is rigid along its surface (κ = 0).
    #[error(
        "contact resolves a compliant contact, but kappa is 0 (rigid along the surface); expected more than 0, or the fidelity full"
    )]
    RigidContact,
    /// The integration of `ode` or `contact` took too many steps at the tolerance given here.
    #[error(
        "the integration did not reach the end of the impact at a tolerance of {0:e}; expected a larger one"
    )]
    NotIntegrated(f64),
    /// A contact that hardly gives way along its surface shakes so often, as 1/√κ, that its integration did not reach the end of the
    /// impact; with κ. Towards κ = 0 the outcome nears that of a rigid contact as √κ.
    #[error(
        "the contact is so stiff at a kappa of {0:e} that the integration did not reach the end of the impact; expected a larger one, or the fidelity full (rigid along the surface)"
    )]
    TooStiff(f64),
}

impl Model {
    /// The values of a shot, checked: the only place where input is refused.
    #[inline(always)]
    pub(super) fn validated(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<Values<f64>, NotACollision> {
        let &Coefficients { mu, mu_s, e } = coefficients;
        Self::check_ball(&self.ball)?;
        let ratio = self.mass_ratio();
        let mut most_mu_s = 2.0 + self.ball.inertia;
        if let Some(object) = &self.object {
            Self::check_ball(object)?;
            if !MASS_RATIOS.contains(&ratio) {
                return Err(NotACollision::MassRatio(ratio));
            }
            if self.cloth_torque == ClothTorque::AsPrinted {
                return Err(NotACollision::UnequalAsPrinted);
            }
            // 2β_z = (1 + 1/ν_c)/r + (1 − μ_s)/ν must stay positive, or the cloth would drive the slip that it brakes
            most_mu_s = 1.0 + object.inertia * (1.0 + 1.0 / self.ball.inertia) / ratio;
        }
        if finite("mu", mu)? < 0.0 {
            return Err(NotACollision::NegativeMu(mu));
        }
        if !(0.0..most_mu_s).contains(&finite("mu_s", mu_s)?) {
            return Err(NotACollision::MuSOutOfRange(mu_s, most_mu_s));
        }
        if !(0.0..=1.0).contains(&finite("e", e)?) {
            return Err(NotACollision::EOutOfRange(e));
        }
        if let Law::Exponential { b, c } = self.law {
            let valid = b.is_finite() && c.is_finite() && c >= 0.0 && mu + b >= 0.0;
            if !valid {
                return Err(NotACollision::Law { mu, b, c });
            }
        }
        check_motion(cue, self.ball.radius)?;
        let values = Values::new(self, cue, coefficients);
        let largest = values[Input::Mu] + values[Input::B].max(0.0);
        // dv_x/dq = 1 + 1/r + μ_s μ sin θ must stay positive, whatever θ is
        let (product, most) = (largest * values[Input::MuS], 1.0 + 1.0 / ratio);
        // the friction of a compliant contact may turn, and press the object ball down all the same
        if product >= most && (cue.spin.y > 0.0 || self.kappa > 0.0) {
            return Err(NotACollision::Jams(product, most));
        }
        if self.fidelity.is_integrated() {
            self.check_integrated(largest)?;
        }
        Ok(values)
    }

    #[inline(always)]
    fn check_ball(ball: &Ball) -> Result<(), NotACollision> {
        if !(ball.radius > 0.0 && ball.radius.is_finite()) {
            return Err(NotACollision::Radius(ball.radius));
        }
        if !(ball.inertia > 0.0 && ball.inertia <= HOLLOW_SPHERE) {
            return Err(NotACollision::Inertia(ball.inertia));
        }
        Ok(())
    }

    /// What only integrated fidelities use.
    fn check_integrated(&self, largest_mu: f64) -> Result<(), NotACollision> {
        let &Self { tolerance, mu_k, kappa, contact_time, .. } = self;
        if !(MIN_TOLERANCE..=MAX_TOLERANCE).contains(&tolerance) {
            return Err(NotACollision::Tolerance(tolerance));
        }
        if !(mu_k >= 0.0 && largest_mu * mu_k < 1.0 + self.mass_ratio()) {
            return Err(NotACollision::MuKOutOfRange(mu_k));
        }
        if !(0.0..=MAX_KAPPA).contains(&kappa) {
            return Err(NotACollision::KappaOutOfRange(kappa));
        }
        if !(contact_time > 0.0 && contact_time.is_finite()) {
            return Err(NotACollision::ContactTime(contact_time));
        }
        if self.fidelity == Fidelity::Contact && kappa == 0.0 {
            return Err(NotACollision::RigidContact);
        }
        Ok(())
    }
}

/// The cue ball moves along the cloth towards the object ball.
#[inline(always)]
fn check_motion(cue: &BallState, radius: f64) -> Result<(), NotACollision> {
    if !(is_finite(&cue.velocity) && is_finite(&cue.spin)) {
        return Err(not_finite(cue));
    }
    if cue.velocity.z != 0.0 {
        return Err(NotACollision::NotHorizontal(cue.velocity.z));
    }
    let k = cue.velocity.x;
    if k <= 0.0 {
        return Err(NotACollision::NotApproaching(k));
    }
    let fastest = k.max(cue.velocity.y.abs());
    let surface = radius * cue.spin.y.abs().max(cue.spin.z.abs());
    if !(fastest >= MIN_SPEED && fastest.max(surface) <= MAX_SPEED) {
        return Err(NotACollision::Speed(if fastest < MIN_SPEED { fastest } else { fastest.max(surface) }));
    }
    Ok(())
}

/// The slowest and the fastest cue ball, m/s: squares and their products neither overflow nor vanish.
pub const MIN_SPEED: f64 = 1e-9;
/// See [`MIN_SPEED`].
pub const MAX_SPEED: f64 = 1e9;

/// m_cue/m_object: beyond, roundings of the lighter ball's velocity show in the heavier one's.
pub(crate) const MASS_RATIOS: std::ops::RangeInclusive<f64> = 1e-3..=1e3;

/// Moment of inertia of a thin hollow sphere over MR², the largest a ball can have.
const HOLLOW_SPHERE: f64 = 2.0 / 3.0;

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
