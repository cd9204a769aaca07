//! The collision itself: from the cue ball's state before the impact to both balls' after it, in
//! the collision frame ([`contact_frame`](super::contact_frame)), with the object ball at rest.
//!
//! H.-C. Kim, "Collision of two spinning billiard balls and the role of table", arXiv:2402.13258
//! (2024), with its errors corrected. Everything is per unit mass: q is the normal impulse p/M in
//! m/s and takes the place of time. Each [`Fidelity`] finds three numbers, the normal impulse q and
//! the friction impulses J_y = μ∫cos θ dq, J_z = μ∫sin θ dq; from these [`Model::collide`]
//! determines all velocities and spins.

mod contact;
pub mod effects;
mod impact;
mod integrator;
mod model;
mod outcome;
mod simple;
mod sliding;

use std::ops::RangeInclusive;

use super::Number;
use super::ball::Ball;
use super::friction_law::Law;
use crate::name::{by_name, worded};

pub use effects::Effects;
pub use outcome::{Input, Jacobian, Outcome};

worded! {
    /// How closely the collision is modelled, from the cheapest to the most exact.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
    #[non_exhaustive]
    pub enum Fidelity {
        /// No friction and no loss of energy.
        Elastic = "elastic" | "no friction, no loss",
        /// Restitution without friction.
        Inelastic = "inelastic" | "restitution, no friction",
        /// The first order in μ (Kim 2024, Eqs. 50–54), in which the contact never sticks.
        Linear = "linear" | "first order in μ, no stick",
        /// The exact solution of the equations of motion, stick included.
        Full = "full" | "the exact solution, stick included",
        /// The equations of `full`, or with κ of a compliant contact, integrated to a tolerance.
        Ode = "ode" | "the same equations integrated, to a tolerance",
        /// The contact resolved in time, with gravity and the cloth's friction on both balls.
        Contact = "contact" | "the contact resolved in time, with gravity and the cloth, to a tolerance",
    }
    /// The name on the command line and in fit.json.
    pub fn name;
    /// The model in a line.
    pub fn meaning;
}

by_name!(Fidelity, "fidelity", ALL, name);

impl Fidelity {
    /// Returns whether the equations of motion are integrated step by step.
    pub fn is_integrated(self) -> bool {
        matches!(self, Self::Ode | Self::Contact)
    }

    /// Returns all effects that this fidelity can simulate.
    #[inline]
    pub fn effects(self) -> Effects {
        let inelastic = Effects { inelasticity: true, ..Effects::NONE };
        let linear = Effects { friction: true, cloth: true, ..inelastic };
        match self {
            Self::Elastic => Effects::NONE,
            Self::Inelastic => inelastic,
            Self::Linear => linear,
            Self::Full => Effects { stick: true, turning: true, falling_friction: true, ..linear },
            Self::Ode => Effects { compliance: true, ..Self::Full.effects() },
            Self::Contact => Effects::ALL,
        }
    }
}

/// Friction and restitution of one collision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// μ, sliding friction between the balls; the a of a [`Law`] if it decreases with the slip.
    pub mu: f64,
    /// μ_s, friction of the cloth on the object ball.
    pub mu_s: f64,
    /// e, energetic coefficient of restitution (Stronge); e₀ if it decreases with the speed.
    pub e: f64,
}

/// Speeds of a cue ball, m/s: products of squares do not overflow or vanish.
pub const SPEEDS: RangeInclusive<f64> = 1e-9..=1e9;

/// The range of [`Model::tolerance`]: below it, rounding errors prevail; above it, the error is
/// larger than the tolerance.
pub const TOLERANCES: RangeInclusive<f64> = 1e-12..=1e-2;

/// The range of m_cue/m_object; beyond, roundings of one ball's velocity show in the other's.
pub(crate) const MASS_RATIOS: RangeInclusive<f64> = 1e-3..=1e3;

/// The largest [`Model::kappa`]: softer contacts transmit next to no friction.
pub const MAX_KAPPA: f64 = 100.0;

/// The smallest κ of fits: the outcome approaches that of 0, another model, as √κ.
pub const MIN_FITTED_KAPPA: f64 = 1e-3;

/// Returns the tangential compliance κ = (2 − σ)/(2(1 − σ)) of elastic bodies with Poisson's ratio
/// σ, dimensionless (Mindlin 1949).
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
    /// The object ball, if it differs from the cue ball; `None` stands for an equal one.
    pub object: Option<Ball>,
    /// Whether the cloth's torque on the object ball has the sign of Kim's Eq. (10) as printed, 1 +
    /// μ_s in dΩ_y/dq, for comparison with the paper only: with 1 − μ_s energy balances.
    pub as_printed: bool,
    /// The effects that are simulated, as far as the fidelity can. Stick and turning depend on the
    /// fidelity alone: switching them off has no effect.
    pub effects: Effects,
    /// The dependence of the friction between the balls on the slip. `linear` takes the friction at
    /// the first slip; `full`, `ode` and `contact` follow the slip during the impact.
    pub law: Law,
    /// The e₁ of a restitution that decreases with the closing speed v, e(v) = e₀ − e₁v but not
    /// below 0, in s/m; `None` if e is constant.
    pub e_slope: Option<f64>,
    /// Used by `ode` and `contact`: the tangential compliance κ, the ratio of normal to tangential
    /// stiffness of the contact, dimensionless. 0, rigid along the surface, is not for `contact`.
    pub kappa: f64,
    /// Used by `ode` and `contact`: the error of each step relative to the closing speed k. The
    /// outcome's error is of the same order.
    pub tolerance: f64,
    /// Used by `contact`: the friction of the cloth on the cue ball μ_k, dimensionless.
    pub mu_k: f64,
    /// Used by `contact`: the duration of an elastic head-on impact at 1 m/s, in seconds. At a
    /// closing speed of k m/s it is k^(−1/5) times as long (Hertz).
    pub contact_time: f64,
}

/// The reason why an input describes no collision.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NotACollision {
    /// A number that is out of its range or not finite.
    #[error("{name} is {value}; expected {expected}")]
    OutOfRange {
        /// The name of the number: `mu`, `radius_m`, `omega_x`, …
        name: &'static str,
        /// The number, in the SI unit of its name.
        value: f64,
        /// The range in words.
        expected: &'static str,
    },
    /// A line of centres (x, y), table frame, without length or not finite.
    #[error("the line of centres ({0}, {1}) has no direction; expected a finite vector other than 0")]
    NoDirection(f64, f64),
    /// A cue ball with such a velocity, m/s, along the line of centres, away from the object ball.
    #[error(
        "the cue ball does not approach: its velocity along the line of centres is {} m/s; expected more than 0", .0 + 0.0
    )]
    NotApproaching(f64),
    /// A μ_s that is negative or not below the second number, 2 + ν of equal balls: from there on
    /// 2β_z ≤ 0, and the cloth would drive the slip that it brakes.
    #[error("mu_s is {0}; expected 0 or more, below {1}")]
    MuSOutOfRange(f64, f64),
    /// A μ·μ_s that is with topspin not below the second number, 1 + m_object/m_cue: the impact
    /// would never end, as dv_x/dq ≥ 1 + m_object/m_cue − μ_s μ.
    #[error(
        "mu·mu_s is {0}; expected less than {1} with topspin (1 + object ball's mass over cue ball's), or the balls jam"
    )]
    Jams(f64, f64),
    /// An integration that takes too many steps: a contact oscillates as often as 1/√κ.
    #[error(
        "the integration did not reach the end of the impact at a tolerance of {tolerance:e} and a kappa of {kappa}; expected a larger tolerance or kappa, or the fidelity full (rigid along the surface)"
    )]
    NotIntegrated {
        /// The tolerance of the model.
        tolerance: f64,
        /// The tangential compliance κ.
        kappa: f64,
    },
}
