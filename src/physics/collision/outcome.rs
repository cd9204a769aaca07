//! What comes out of a collision: both balls' velocities and spins, and their derivatives, written
//! down from the impulses.

use nalgebra::{SMatrix, SVector};

use super::Regime;
use crate::physics::ball::{BallState, Vec3};

/// Both balls just after the impact, in the frame of the method that gave it: the collision frame, or the table's.
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
    pub(super) fn new(regime: Regime, impulse: f64, components: &[f64; 12]) -> Self {
        let vector =
            |first: usize| Vec3::new(components[first], components[first + 1], components[first + 2]);
        let ball = |first: usize| BallState { velocity: vector(first), spin: vector(first + 3) };
        Self { regime, impulse, cue: ball(0), object: ball(6) }
    }

    /// The twelve components in the order of the rows of [`Jacobian`].
    #[must_use]
    pub fn components(&self) -> SVector<f64, 12> {
        let mut all = SVector::<f64, 12>::zeros();
        for (i, v) in
            [self.cue.velocity, self.cue.spin, self.object.velocity, self.object.spin].iter().enumerate()
        {
            all.fixed_rows_mut::<3>(3 * i).copy_from(v);
        }
        all
    }

    /// The outcome with `added` to its twelve components.
    pub(crate) fn plus(&self, added: &SVector<f64, 12>) -> Self {
        let ball = |state: &BallState, first: usize| BallState {
            velocity: state.velocity + added.fixed_rows::<3>(first),
            spin: state.spin + added.fixed_rows::<3>(first + 3),
        };
        Self { cue: ball(&self.cue, 0), object: ball(&self.object, 6), ..*self }
    }
}

/// The derivative of an outcome, in SI units and radians. Its rows are the velocity and the spin of the cue ball, then those of
/// the object ball, x, y and z of each; its columns are the [`Input`]s.
pub type Jacobian = SMatrix<f64, 12, 8>;

/// The number of inputs besides the coefficients and the cue ball's motion: b and c of a friction that falls with the slip, κ,
/// m_cue/m_object, R_cue/R_object and e₁.
pub const OTHERS: usize = 6;

/// The derivatives of an outcome's components, in the order of the rows of [`Jacobian`], by those inputs.
pub type ByOthers = SMatrix<f64, 12, OTHERS>;

/// The inputs that an outcome depends on. The first eight are the columns of [`Jacobian`], the others those of
/// [`ByOthers`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// Friction between the balls μ, dimensionless.
    Mu,
    /// Friction of the cloth on the object ball μ_s, dimensionless.
    MuS,
    /// Coefficient of restitution e, dimensionless; e₀ where it falls with the closing speed.
    E,
    /// The cue ball's velocity before the impact along the line of centres, U cos φ, m/s.
    VelocityX,
    /// The cue ball's velocity before the impact across the line of centres, U sin φ, m/s.
    VelocityY,
    /// The cue ball's angular velocity before the impact about the line of centres, ω_x, rad/s.
    SpinX,
    /// The cue ball's angular velocity before the impact about the horizontal axis across the line of centres, ω_y,
    /// rad/s: positive for topspin, negative for draw.
    SpinY,
    /// The cue ball's angular velocity before the impact about the vertical, ω_z, rad/s: its side spin, positive
    /// counterclockwise as seen from above.
    SpinZ,
    /// b of a friction that falls with the slip, μ(v) = μ + b exp(−c v), dimensionless.
    B,
    /// c of that friction, s/m.
    C,
    /// The tangential compliance κ, dimensionless.
    Kappa,
    /// m_cue/m_object, the mass of the cue ball as it is.
    MassRatio,
    /// R_cue/R_object, the radius of the cue ball as it is.
    RadiusRatio,
    /// e₁ of a restitution e(v) = e₀ − e₁v that falls with the closing speed v, s/m.
    ESlope,
}

impl Input {
    /// The number of inputs that [`Jacobian`] has columns for, and of all.
    pub(super) const FIRST: usize = 8;
    pub(super) const COUNT: usize = Self::FIRST + OTHERS;

    /// All inputs in their order.
    pub(crate) const ALL: [Self; Self::COUNT] = [
        Self::Mu,
        Self::MuS,
        Self::E,
        Self::VelocityX,
        Self::VelocityY,
        Self::SpinX,
        Self::SpinY,
        Self::SpinZ,
        Self::B,
        Self::C,
        Self::Kappa,
        Self::MassRatio,
        Self::RadiusRatio,
        Self::ESlope,
    ];
}
