//! The collision itself: from the cue ball's state before the impact to both balls' after it, in
//! the collision frame ([`contact_frame`](super::contact_frame)), with the object ball at rest.
//!
//! H.-C. Kim, "Collision of two spinning billiard balls and the role of table", arXiv:2402.13258
//! (2024), with its errors corrected. Everything is per unit mass: q is the normal impulse p/M in
//! m/s and takes the place of time. Each [`Fidelity`] is one file that finds three numbers, the
//! normal impulse q and the friction impulses J_y = μ∫cos θ dq, J_z = μ∫sin θ dq; from these
//! [`Model::collide`] writes down all velocities and spins.
//!
//! ```
//! use caromfit::physics::ball::{Ball, BallState, Vec3};
//! use caromfit::physics::collision::{Coefficients, Fidelity, Input, Model};
//!
//! let cue = BallState::natural_roll(Vec3::new(1.7, 1.0, 0.0), Ball::POOL.radius);
//! let model = Model::new(Fidelity::Full, Ball::POOL);
//! let (after, by) = model.collide_with_jacobian(&cue, &Coefficients { mu: 0.05, mu_s: 0.3, e: 0.94 })?;
//! // more friction throws the object ball further to the side, m/s per unit of μ
//! assert!(after.object.velocity.y > 0.0 && by[(7, Input::Mu as usize)] > 0.0);
//! # Ok::<(), caromfit::physics::collision::NotACollision>(())
//! ```
//!
//! | file | what it holds |
//! | --- | --- |
//! | `input` | what a shot must satisfy |
//! | `impact` | k, the slip v_y0, v_z0, m_s, 2β_y, 2β_z and N of a shot; both balls from q, J_y, J_z |
//! | `simple` | elastic, inelastic and linear |
//! | `sliding` | full: the exact solution, with friction that falls with the slip |
//! | `ode`, `contact` | the same equations, and those of a compliant contact, integrated by `integrator` |

mod contact;
mod corrected;
mod effects;
mod fidelity;
mod impact;
mod input;
mod integrator;
mod model;
mod ode;
mod outcome;
mod simple;
mod sliding;

use super::ball::Ball;
use super::cloth_motion::Number;
use super::friction_law::Law;
use super::name::worded;

pub(crate) use corrected::{Corrected, Correction};
pub use effects::Effects;
pub use fidelity::{Fidelity, FidelityChoice};
pub(crate) use input::MASS_RATIOS;
pub use input::{MAX_SPEED, MIN_SPEED, NotACollision};
pub use outcome::{ByOthers, Input, Jacobian, OTHERS, Outcome};

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
    pub(super) fn sign(self) -> f64 {
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
    /// How the friction between the balls falls with the slip. `linear` takes the friction at the first slip, which is an
    /// approximation; `full`, `ode` and `contact` follow the slip during the impact.
    pub law: Law,
    /// The e₁ of a restitution that falls with the closing speed v, e(v) = e₀ − e₁v but not below 0, in s/m; `None`
    /// where e is constant.
    pub e_slope: Option<f64>,
    /// Used by `ode` and `contact`: the tangential compliance κ, the ratio of normal to tangential stiffness of the
    /// contact, dimensionless. 0 is a contact that is rigid along its surface, as in Kim (2024), which `contact` does not simulate.
    pub kappa: f64,
    /// Used by `ode` and `contact`: the error of each step relative to the closing speed k. The outcome's error is of
    /// that order.
    pub tolerance: f64,
    /// Used by `contact`: the friction of the cloth on the cue ball μ_k, dimensionless.
    pub mu_k: f64,
    /// Used by `contact`: how long an elastic head-on impact at 1 m/s lasts, in seconds. At a closing speed of k m/s
    /// it lasts k^(−1/5) times as long (Hertz).
    pub contact_time: f64,
}
