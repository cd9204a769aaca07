//! The input of a collision, checked: what it must satisfy, and the numbers that the impulses follow from.

use super::{ClothTorque, Coefficients, MAX_KAPPA, MAX_TOLERANCE, MIN_TOLERANCE, Model, length};
use crate::physics::ball::{Ball, BallState, UNIFORM_SPHERE, Vec3};
use crate::physics::contact_frame;
use crate::physics::friction_law::{Friction, Law};

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
    /// The integration of `ode` or `contact` took too many steps or changes of grip at the tolerance given here. Under gravity some slow shots run out of
    /// them (of the hardest that the tests try 7 in 1000 at 1e-10, below some 0.2 m/s): a slip on the cloth that passes close by 0, or settles
    /// there, turns faster than steps can follow. So do some with an e near 0, whose restitution lasts 1/e times
    /// their compression, under gravity all the while. (At 0 there is none: the impact ends with compression.)
    #[error(
        "the integration did not reach the end of the impact at a tolerance of {0:e}; expected a larger one"
    )]
    NotIntegrated(f64),
    /// A contact that hardly gives way along its surface shakes so often, as 1/√κ, that its integration did not reach the end of the
    /// impact; with κ. Towards κ = 0 the outcome nears that of a rigid contact as √κ.
    #[error(
        "the contact is so stiff at a kappa of {0:e} that the integration did not reach the end of the impact; expected 0 (rigid along the surface) or a larger one"
    )]
    TooStiff(f64),
}

/// What the impulses depend on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    pub k: f64,
    pub v_y: f64,
    pub v_z: f64,
    pub mu: f64,
    pub m_s: f64,
    pub e: f64,
    pub nu: f64,
    pub sigma: f64,
    pub levers: Levers,
    /// μ_s, whether or not the friction between the balls brings it to bear.
    pub mu_s: f64,
}

/// What the inertia of both balls makes of an impulse, with the object ball's ν as the unit of both β.
///
/// Balls that are not equal obey the same equations as equal ones, in impulses times a = (1 + 1/r)/2, r = m_cue/m_object, with
/// m_s over a and these sums, so that dv_x/dq = 2 + m_s μ sin θ as ever.
#[derive(Clone, Copy, Debug)]
pub(super) struct Levers {
    /// νβ_y: 1 + ν of equal balls, else ν[(1 + 1/ν_c)/r + 1 + 1/ν]/2a.
    pub y: f64,
    /// 2νβ_z without the cloth: 2 + ν of equal balls, else ν[(1 + 1/ν_c)/r + 1/ν]/a with topspin, ν[1/(rν_c) + 1 + 1/ν]/a
    /// with draw.
    pub z: f64,
    /// 2y − z: ν of equal balls.
    pub difference: f64,
    /// 1/a.
    pub scale: f64,
}

impl Levers {
    /// Of equal balls.
    #[inline(always)]
    pub fn equal(nu: f64) -> Self {
        Self { y: 1.0 + nu, z: 2.0 + nu, difference: nu, scale: 1.0 }
    }

    /// Of a cue ball `mass_ratio` times as heavy as the object ball.
    fn unequal(mass_ratio: f64, [nu_c, nu]: [f64; 2], topspin: bool) -> Self {
        let per_r = 1.0 / mass_ratio;
        let scale = 2.0 / (1.0 + per_r);
        let y = 0.5 * scale * nu * ((1.0 + 1.0 / nu_c) * per_r + 1.0 + 1.0 / nu);
        let carried = if topspin { per_r } else { 1.0 };
        let z = scale * nu * (per_r / nu_c + carried + 1.0 / nu);
        Self { y, z, difference: 2.0 * y - z, scale }
    }

    /// Whether γ is 1/6 without friction of the cloth, as of equal uniform spheres.
    #[inline(always)]
    pub fn are_of_spheres(&self) -> bool {
        self.difference == UNIFORM_SPHERE && self.z == 2.0 + UNIFORM_SPHERE
    }
}

impl Contact {
    /// β_y = (1 + ν)/ν.
    #[inline]
    pub fn beta_y(&self) -> f64 {
        self.levers.y / self.nu
    }

    /// β_z = (2 + ν − σm_s)/2ν.
    #[inline]
    pub fn beta_z(&self) -> f64 {
        (self.levers.z - self.sigma * self.m_s) / (2.0 * self.nu)
    }

    /// γ = β_y/β_z − 1 = (ν + σm_s)/(2 + ν − σm_s).
    #[inline]
    pub fn gamma(&self) -> f64 {
        (self.levers.difference + self.sigma * self.m_s) / (self.levers.z - self.sigma * self.m_s)
    }
}

impl Model {
    // a contact that comes back through memory costs as much as `linear` does
    #[inline(always)]
    pub(super) fn contact(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<Contact, NotACollision> {
        self.contact_of(cue, &self.checked(coefficients)?)
    }

    /// What all shots with these coefficients share.
    #[inline(always)]
    pub(super) fn checked(&self, coefficients: &Coefficients) -> Result<Shared, NotACollision> {
        let Ball { radius, inertia, .. } = self.ball;
        let Coefficients { mu, mu_s, e } = *coefficients;
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(NotACollision::Radius(radius));
        }
        if !(inertia > 0.0 && inertia <= HOLLOW_SPHERE) {
            return Err(NotACollision::Inertia(inertia));
        }
        if let Some(object) = &self.object {
            self.check_object(object)?;
        }
        if finite("mu", mu)? < 0.0 {
            return Err(NotACollision::NegativeMu(mu));
        }
        // β_z must stay positive, or the cloth would drive the slip it brakes
        let most = self.object.as_ref().map_or(2.0 + inertia, |object| self.most_mu_s(object));
        if !(0.0..most).contains(&finite("mu_s", mu_s)?) {
            return Err(NotACollision::MuSOutOfRange(mu_s, most));
        }
        let friction = self.law.friction(mu);
        if let Law::Exponential { b, c } = self.law {
            let valid = b.is_finite() && c.is_finite() && c >= 0.0 && mu + b >= 0.0;
            if !valid {
                return Err(NotACollision::Law { mu, b, c });
            }
        }
        if !(0.0..=1.0).contains(&finite("e", e)?) {
            return Err(NotACollision::EOutOfRange(e));
        }
        let effects = self.effects;
        let friction = if effects.friction { friction } else { Friction::Constant(0.0) };
        let mu_s = if effects.cloth { mu_s } else { 0.0 };
        Ok(Shared {
            friction,
            mu_s,
            e: if effects.inelasticity { e } else { 1.0 },
            jams: friction.largest() * mu_s >= self.most_mu_mu_s(),
        })
    }

    /// Below it dv_x/dq = 1 + 1/r + μ_s μ sin θ is positive, whatever θ is.
    #[inline]
    fn most_mu_mu_s(&self) -> f64 {
        self.object.as_ref().map_or(2.0, |_| 1.0 + 1.0 / self.mass_ratio())
    }

    /// Below it the cloth brakes the slip with topspin: 2β_z = (1 + 1/ν_c)/r + (1 − μ_s)/ν is positive.
    #[cold]
    fn most_mu_s(&self, object: &Ball) -> f64 {
        1.0 + object.inertia * (1.0 + 1.0 / self.ball.inertia) / self.mass_ratio()
    }

    #[cold]
    fn check_object(&self, object: &Ball) -> Result<(), NotACollision> {
        if !(object.radius > 0.0 && object.radius.is_finite()) {
            return Err(NotACollision::Radius(object.radius));
        }
        if !(object.inertia > 0.0 && object.inertia <= HOLLOW_SPHERE) {
            return Err(NotACollision::Inertia(object.inertia));
        }
        let ratio = self.mass_ratio();
        if !MASS_RATIOS.contains(&ratio) {
            return Err(NotACollision::MassRatio(ratio));
        }
        if self.cloth_torque == ClothTorque::AsPrinted {
            return Err(NotACollision::UnequalAsPrinted);
        }
        Ok(())
    }

    #[inline(always)]
    pub(super) fn contact_of(&self, cue: &BallState, shared: &Shared) -> Result<Contact, NotACollision> {
        if !(is_finite(&cue.velocity) && is_finite(&cue.spin)) {
            return Err(not_finite(cue));
        }
        if cue.velocity.z != 0.0 {
            return Err(NotACollision::NotHorizontal(cue.velocity.z));
        }
        let v = contact_frame::slip(cue, &BallState::default(), self.ball.radius);
        let k = -v.x;
        if k <= 0.0 {
            return Err(NotACollision::NotApproaching(k));
        }
        let topspin = v.z > 0.0;
        // of a contact that gives way the friction may turn, and press the object ball down all the same
        if shared.jams && (topspin || self.kappa > 0.0) {
            let product = shared.friction.largest() * shared.mu_s;
            return Err(NotACollision::Jams(product, self.most_mu_mu_s()));
        }
        let m_s = if topspin { shared.mu_s } else { 0.0 };
        let mu = match shared.friction {
            Friction::Constant(mu) => mu,
            falling @ Friction::Exponential { .. } => falling.mu(length(v.y, v.z)),
        };
        let sigma = self.cloth_torque.sign();
        let (nu, levers) = match &self.object {
            None => (self.ball.inertia, Levers::equal(self.ball.inertia)),
            Some(object) => {
                let inertias = [self.ball.inertia, object.inertia];
                (object.inertia, Levers::unequal(self.mass_ratio(), inertias, topspin))
            }
        };
        let m_s = m_s * levers.scale;
        Ok(Contact { k, v_y: v.y, v_z: v.z, mu, m_s, e: shared.e, nu, sigma, levers, mu_s: shared.mu_s })
    }
}

/// What [`Contact`] takes from the coefficients, the effects that are off left out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shared {
    friction: Friction,
    mu_s: f64,
    e: f64,
    /// Whether shots with topspin jam.
    jams: bool,
}

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
