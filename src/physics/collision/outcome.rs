//! Both balls after the impact, and the inputs by which their motion has derivatives.

use nalgebra::{SMatrix, SVector};

use super::impact::{Impulses, Values, components};
use super::{Model, Regime};
use crate::name::worded;
use crate::physics::ball::{BallState, Vec3};

/// Both balls just after the impact, in the frame of the method that returned it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Whether the contact slid to the end of the impact or stuck on the way.
    pub regime: Regime,
    /// The normal impulse over the object ball's mass, q = P/M, m/s.
    pub impulse: f64,
    /// The cue ball after the impact.
    pub cue: BallState,
    /// The object ball after the impact.
    pub object: BallState,
}

impl Outcome {
    #[inline(always)]
    pub(super) fn new(regime: Regime, values: &Values<f64>, model: &Model, impulses: &Impulses<f64>) -> Self {
        let components = components(values, model, impulses);
        let vector = |i: usize| Vec3::new(components[i], components[i + 1], components[i + 2]);
        let ball = |i: usize| BallState { velocity: vector(i), spin: vector(i + 3) };
        Self { regime, impulse: impulses.q, cue: ball(0), object: ball(6) }
    }

    /// Returns the twelve components in the order of the rows of [`Jacobian`].
    pub fn components(&self) -> SVector<f64, 12> {
        let vectors = [self.cue.velocity, self.cue.spin, self.object.velocity, self.object.spin];
        SVector::from_fn(|i, _| vectors[i / 3][i % 3])
    }
}

/// The derivatives of an outcome, in SI units and radians, by the [`Input`]s. The rows are the
/// velocity and the spin of the cue ball, then those of the object ball, x, y and z of each.
pub type Jacobian = SMatrix<f64, 12, { Input::COUNT }>;

worded! {
    /// The inputs of an outcome, before the impact: the columns of [`Jacobian`].
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Input {
        /// Friction between the balls μ, dimensionless.
        Mu = "mu",
        /// Friction of the cloth on the object ball μ_s, dimensionless.
        MuS = "mu_s",
        /// Coefficient of restitution e, dimensionless; e₀ if it decreases with the closing speed.
        E = "e",
        /// The cue ball's velocity along the line of centres, U cos φ, m/s.
        VelocityX = "velocity_x",
        /// The cue ball's velocity across the line of centres, U sin φ, m/s.
        VelocityY = "velocity_y",
        /// The cue ball's angular velocity about the line of centres, ω_x, rad/s.
        SpinX = "omega_x",
        /// ω_y, rad/s, about the horizontal axis across it: positive for topspin, negative for
        /// draw.
        SpinY = "omega_y",
        /// ω_z, rad/s, about the vertical: side spin, positive counterclockwise from above.
        SpinZ = "omega_z",
        /// b of a friction that decreases with the slip, μ(v) = μ + b exp(−c v), dimensionless.
        B = "mu_b",
        /// c of μ(v) = μ + b exp(−c v), s/m.
        C = "mu_c",
        /// The tangential compliance κ, dimensionless.
        Kappa = "kappa",
        /// m_cue/m_object, the mass of the cue ball as it is.
        MassRatio = "mass_ratio",
        /// R_cue/R_object, the radius of the cue ball as it is.
        RadiusRatio = "radius_ratio",
        /// e₁ of a restitution e(v) = e₀ − e₁v that decreases with the closing speed v, s/m.
        ESlope = "e_slope",
    }
    /// The name of the input.
    pub fn name;
}

impl Input {
    /// The number of inputs.
    pub const COUNT: usize = Self::ALL.len();
}
