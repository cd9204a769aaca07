//! What comes out of a collision: both balls' velocities and spins, and their derivatives, written
//! down from the impulses.

use nalgebra::{SMatrix, SVector};

use super::{Contact, Impulse, ImpulseGradient, Model, Regime, variable};
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

/// The columns of [`Jacobian`].
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
}

impl Model {
    #[inline]
    pub(super) fn outcome(
        &self,
        cue: &BallState,
        contact: &Contact,
        impulse: &Impulse,
        regime: Regime,
    ) -> Outcome {
        if self.object.is_some() {
            return self.outcome_of_unequal(cue, contact, impulse, regime);
        }
        let &Contact { m_s, v_z, nu, sigma, .. } = contact;
        let &Impulse { normal: q, y: j_y, z: j_z } = impulse;
        let (topspin, draw) = (f64::from(v_z > 0.0), f64::from(v_z < 0.0));
        let per_nu_r = 1.0 / (nu * self.ball.radius);
        // U_f = U_i − (q, J_y, J_z [θ<0]),  ω_f = ω_i + (0, J_z, −J_y)/νR
        let cue = BallState {
            velocity: cue.velocity - Vec3::new(q, j_y, j_z * topspin),
            spin: cue.spin + per_nu_r * Vec3::new(0.0, j_z, -j_y),
        };
        // V_f = (q + m_s J_z, J_y, J_z [θ>0]),  Ω_f = (0, (1 − σm_s) J_z, −J_y)/νR
        let object = BallState {
            velocity: Vec3::new(q + m_s * j_z, j_y, j_z * draw),
            spin: per_nu_r * Vec3::new(0.0, (1.0 - sigma * m_s) * j_z, -j_y),
        };
        Outcome { regime, impulse: q, cue, object }
    }

    #[inline]
    pub(super) fn jacobian(
        &self,
        contact: &Contact,
        impulse: &Impulse,
        gradient: &ImpulseGradient,
    ) -> Jacobian {
        if self.object.is_some() {
            return self.jacobian_of_unequal(contact, impulse, gradient);
        }
        let &Contact { m_s, v_z, nu, sigma, .. } = contact;
        let (topspin, draw) = (f64::from(v_z > 0.0), f64::from(v_z < 0.0));
        let radius = self.ball.radius;
        let per_nu_r = 1.0 / (nu * radius);
        let object_spin = (1.0 - sigma * m_s) * per_nu_r;
        let ImpulseGradient { normal, y, z } = gradient;
        // the components of `outcome` for given (dq, dJ_y, dJ_z)
        let column = |q: f64, j_y: f64, j_z: f64| {
            let spin_z = -per_nu_r * j_y;
            [
                -q,
                -j_y,
                -j_z * topspin,
                0.0,
                per_nu_r * j_z,
                spin_z,
                q + m_s * j_z,
                j_y,
                j_z * draw,
                0.0,
                object_spin * j_z,
                spin_z,
            ]
        };
        let of = |variable: usize, by: f64| column(by * normal[variable], by * y[variable], by * z[variable]);
        // columns: k = U_x, v_y = −U_y − Rω_z, v_z = Rω_y, m_s = μ_s or 0
        let mut columns = [
            of(variable::MU, 1.0),
            of(variable::M_S, topspin),
            of(variable::E, 1.0),
            of(variable::K, 1.0),
            of(variable::V_Y, -1.0),
            [0.0; 12],
            of(variable::V_Z, radius),
            of(variable::V_Y, -radius),
        ];
        // m_s itself
        let direct = if self.effects.cloth { topspin * impulse.z } else { 0.0 };
        columns[Input::MuS as usize][6] += direct;
        columns[Input::MuS as usize][10] -= sigma * direct * per_nu_r;
        // what the cue ball keeps
        for (row, input) in [
            (0, Input::VelocityX),
            (1, Input::VelocityY),
            (3, Input::SpinX),
            (4, Input::SpinY),
            (5, Input::SpinZ),
        ] {
            columns[input as usize][row] += 1.0;
        }
        Jacobian::from(columns)
    }
}
