//! What comes out of a collision: both balls' velocities and spins, and their derivatives, written
//! down from the impulses.

use nalgebra::{SMatrix, SVector};

use super::{Contact, Gradient, Impulse, ImpulseGradient, Model, Regime, variable};
use crate::ball::{BallState, Vec3};

/// Both balls after the impact, collision frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    pub regime: Regime,
    /// Normal impulse per unit mass q, m/s.
    pub impulse: f64,
    pub cue: BallState,
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

    /// With something added to the twelve components.
    #[must_use]
    pub fn plus(&self, added: &SVector<f64, 12>) -> Self {
        let ball = |state: &BallState, first: usize| BallState {
            velocity: state.velocity + added.fixed_rows::<3>(first),
            spin: state.spin + added.fixed_rows::<3>(first + 3),
        };
        Self { cue: ball(&self.cue, 0), object: ball(&self.object, 6), ..*self }
    }
}

/// Derivative of the outcome. Rows: velocity and spin of the cue ball, then of the object ball,
/// x, y, z each. Columns: [`Input`].
pub type Jacobian = SMatrix<f64, 12, 8>;

/// The columns of [`Jacobian`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    Mu,
    MuS,
    E,
    /// Cue ball's velocity before the impact along the line of centres, U cos φ.
    VelocityX,
    /// And across it, U sin φ.
    VelocityY,
    SpinX,
    SpinY,
    SpinZ,
}

impl Model {
    pub(super) fn outcome(
        &self,
        cue: &BallState,
        contact: &Contact,
        impulse: &Impulse,
        regime: Regime,
    ) -> Outcome {
        let &Contact { m_s, v_z, nu, sigma, .. } = contact;
        let &Impulse { normal: q, y: j_y, z: j_z } = impulse;
        let (topspin, draw) = (f64::from(v_z > 0.0), f64::from(v_z < 0.0));
        let nu_r = nu * self.ball.radius;
        // U_f = U_i − (q, J_y, J_z [θ<0]),  ω_f = ω_i + (0, J_z, −J_y)/νR
        let cue = BallState {
            velocity: cue.velocity - Vec3::new(q, j_y, j_z * topspin),
            spin: cue.spin + Vec3::new(0.0, j_z, -j_y) / nu_r,
        };
        // V_f = (q + m_s J_z, J_y, J_z [θ>0]),  Ω_f = (0, (1 − σm_s) J_z, −J_y)/νR
        let object = BallState {
            velocity: Vec3::new(q + m_s * j_z, j_y, j_z * draw),
            spin: Vec3::new(0.0, (1.0 - sigma * m_s) * j_z, -j_y) / nu_r,
        };
        Outcome { regime, impulse: q, cue, object }
    }

    pub(super) fn jacobian(
        &self,
        contact: &Contact,
        impulse: &Impulse,
        gradient: &ImpulseGradient,
    ) -> Jacobian {
        let &Contact { m_s, v_z, nu, sigma, .. } = contact;
        let (topspin, draw) = (f64::from(v_z > 0.0), f64::from(v_z < 0.0));
        let radius = self.ball.radius;
        let nu_r = nu * radius;
        // from derivatives with respect to (k, v_y, v_z, μ, m_s, e) to columns:
        // k = U_x, v_y = −U_y − Rω_z, v_z = Rω_y, m_s = μ_s or 0
        let columns = |g: &Gradient| {
            SMatrix::<f64, 1, 8>::from([
                [g[variable::MU]],
                [g[variable::M_S] * topspin],
                [g[variable::E]],
                [g[variable::K]],
                [-g[variable::V_Y]],
                [0.0],
                [radius * g[variable::V_Z]],
                [-radius * g[variable::V_Y]],
            ])
        };
        let (q, j_y, j_z) = (columns(&gradient.normal), columns(&gradient.y), columns(&gradient.z));
        let mut d_m_s = SMatrix::<f64, 1, 8>::zeros();
        d_m_s[Input::MuS as usize] = topspin;

        let mut jacobian = Jacobian::zeros();
        for (row, input) in [
            (0, Input::VelocityX),
            (1, Input::VelocityY),
            (3, Input::SpinX),
            (4, Input::SpinY),
            (5, Input::SpinZ),
        ] {
            jacobian[(row, input as usize)] = 1.0;
        }
        let mut add = |row: usize, term: SMatrix<f64, 1, 8>| {
            let sum = jacobian.row(row) + term;
            jacobian.set_row(row, &sum);
        };
        add(0, -q);
        add(1, -j_y);
        add(2, -j_z * topspin);
        add(4, j_z / nu_r);
        add(5, -j_y / nu_r);
        add(6, q + m_s * j_z + impulse.z * d_m_s);
        add(7, j_y);
        add(8, j_z * draw);
        add(10, ((1.0 - sigma * m_s) * j_z - sigma * impulse.z * d_m_s) / nu_r);
        add(11, -j_y / nu_r);
        jacobian
    }
}
