//! Balls that are not equal: their velocities and spins from the impulses, and how these change with the masses.
//!
//! With r = m_cue/m_object, impulses are per unit of the object ball's mass, and equal balls' equations hold for a times
//! them, a = (1 + 1/r)/2 ([`super::input::Levers`]). Radii R_c and R_o that differ tilt the line of centres by
//! sin δ = (R_o − R_c)/(R_o + R_c): to first order the normal impulse P has a vertical part P sin δ. A larger cue ball presses
//! the object ball into the cloth and rises itself, a smaller one lifts the object ball. The cloth's friction on a ball so pressed
//! also takes part in the impact: dv_x/dq = 1 + 1/r + μ_s sin δ, and q with it. (The slip along the surface that the
//! tilt makes of the closing speed, k sin δ, is left out: it turns the friction by k sin δ/v_∥0.)

use nalgebra::{SVector, Vector3};

use super::{
    Coefficients, Contact, Impulse, ImpulseGradient, Jacobian, Model, NotACollision, Outcome, Regime,
    variable,
};
use crate::physics::ball::{BallState, Vec3};

/// The derivatives of an outcome's components by one number, in the order of the rows of [`Jacobian`].
pub type Column = SVector<f64, 12>;

/// How an outcome hangs on its impulses in [`Impulse`]'s units: linearly, as long as the same ball is carried by the cloth.
struct Map<'a> {
    model: &'a Model,
    contact: &'a Contact,
    /// 1/r.
    per_r: f64,
    /// Whether the object ball is pressed into the cloth.
    pressed: bool,
    tilt: f64,
}

impl<'a> Map<'a> {
    fn new(model: &'a Model, contact: &'a Contact, impulse: &Impulse) -> Self {
        let (per_r, tilt) = (1.0 / model.mass_ratio(), model.tilt());
        Self { model, contact, per_r, pressed: impulse.z + tilt * impulse.normal < 0.0, tilt }
    }

    /// What impulses q, J_y, J_z change, with this μ_s.
    fn of(&self, impulse: [f64; 3], mu_s: f64) -> Column {
        let Self { per_r, tilt, .. } = *self;
        let Contact { sigma, levers, .. } = *self.contact;
        let (cue, object) = (self.model.ball, self.model.object_ball());
        let [q, j_y, j_z] = impulse.map(|impulse| levers.scale * impulse);
        let up = j_z + tilt * q;
        // 1/(1 + 1/r + μ_s sin δ), to first order
        let held = if self.pressed { 0.5 * levers.scale * tilt * mu_s } else { 0.0 };
        let q = q * (1.0 - held);
        let (rises, carried) = if self.pressed { (0.0, up) } else { (up, 0.0) };
        // of the cloth, along x
        let braked = mu_s * carried;
        // U_f = U_i − (q, J_y, J_z [θ<0])/r,  ω_f = ω_i + (0, J_z, −J_y)/(rν_c R_c)
        let on_cue = per_r / (cue.inertia * cue.radius);
        // V_f = (q + m_s J_z, J_y, J_z [θ>0]),  Ω_f = (0, J_z − m_s J_z, −J_y)/νR_o
        let on_object = 1.0 / (object.inertia * object.radius);
        Column::from([
            -per_r * q,
            -per_r * j_y,
            -per_r * carried,
            0.0,
            on_cue * j_z,
            -on_cue * j_y,
            q + braked,
            j_y,
            rises,
            0.0,
            on_object * (j_z - sigma * braked),
            -on_object * j_y,
        ])
    }
}

impl Impulse {
    fn components(&self) -> [f64; 3] {
        [self.normal, self.y, self.z]
    }
}

impl ImpulseGradient {
    fn components(&self, of: usize) -> [f64; 3] {
        [self.normal[of], self.y[of], self.z[of]]
    }
}

impl Model {
    #[cold]
    pub(super) fn outcome_of_unequal(
        &self,
        cue: &BallState,
        contact: &Contact,
        impulse: &Impulse,
        regime: Regime,
    ) -> Outcome {
        let map = Map::new(self, contact, impulse);
        let change = map.of(impulse.components(), contact.mu_s);
        let before = Outcome {
            regime,
            impulse: -change[0] / map.per_r,
            cue: *cue,
            object: BallState { velocity: Vector3::zeros(), spin: Vec3::zeros() },
        };
        before.plus(&change)
    }

    #[cold]
    pub(super) fn jacobian_of_unequal(
        &self,
        contact: &Contact,
        impulse: &Impulse,
        gradient: &ImpulseGradient,
    ) -> Jacobian {
        let map = Map::new(self, contact, impulse);
        let of = |variable: usize| map.of(gradient.components(variable), contact.mu_s);
        let radius = self.ball.radius;
        let by_v_y = of(variable::V_Y);
        // the friction of the cloth itself, and that within the impact
        let mut by_mu_s =
            map.of(impulse.components(), f64::from(self.effects.cloth)) - map.of(impulse.components(), 0.0);
        if contact.v_z > 0.0 {
            by_mu_s += of(variable::M_S) * contact.levers.scale;
        }
        let mut jacobian = Jacobian::from_columns(&[
            of(variable::MU),
            by_mu_s,
            of(variable::E),
            of(variable::K),
            -by_v_y,
            Column::zeros(),
            radius * of(variable::V_Z),
            -radius * by_v_y,
        ]);
        for (column, row) in [0, 1, 3, 4, 5].into_iter().enumerate() {
            jacobian[(row, 3 + column)] += 1.0;
        }
        jacobian
    }

    /// The derivative of an outcome by R_cue/R_object at the cue ball's radius, by central differences.
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub(crate) fn by_radius_ratio(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<Column, NotACollision> {
        /// Spins in rad/s and the errors of integration leave half of the digits.
        const STEP: f64 = 1e-4;
        let ratio = self.radius_ratio();
        slope(|by| self.with_radius_ratio(ratio + by), STEP, cue, coefficients)
    }

    /// The derivative of an outcome by m_cue/m_object, by central differences: with an error of about 1e-11 of it, for `ode` and
    /// `contact` as in [`Model::collide_with_jacobian`].
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub fn by_mass_ratio(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<Column, NotACollision> {
        /// Of the ratio: its square, and roundings over it, are alike.
        const STEP: f64 = 1e-5;
        let ratio = self.mass_ratio();
        let step = if self.fidelity.is_integrated() { self.tolerance.cbrt() } else { STEP };
        slope(|by| self.with_mass_ratio(ratio + by), step * ratio, cue, coefficients)
    }
}

/// The derivative of an outcome by a number of its model, by central differences: `at` is the model with that number changed by so much.
pub(super) fn slope(
    at: impl Fn(f64) -> Model,
    step: f64,
    cue: &BallState,
    coefficients: &Coefficients,
) -> Result<Column, NotACollision> {
    let there = |by: f64| Ok::<_, NotACollision>(at(by).collide(cue, coefficients)?.components());
    Ok((there(step)? - there(-step)?) / (2.0 * step))
}
