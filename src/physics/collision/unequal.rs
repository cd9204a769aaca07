//! Balls that are not equal: their velocities and spins from the impulses, and how these change with the masses.
//!
//! With r = m_cue/m_object, impulses are per unit of the object ball's mass, and equal balls' equations hold for a times
//! them, a = (1 + 1/r)/2 ([`Levers`]). Radii R_c and R_o that differ tilt the line of centres by
//! sin δ = (R_o − R_c)/(R_o + R_c): to first order the normal impulse P has a vertical part P sin δ. A larger cue ball presses
//! the object ball into the cloth and rises itself, a smaller one lifts the object ball. The cloth's friction on a ball so pressed
//! also takes part in the impact: dv_x/dq = 1 + 1/r + μ_s sin δ, and q with it. (The slip along the surface that the
//! tilt makes of the closing speed, k sin δ, is left out: it turns the friction by k sin δ/v_∥0.)

use nalgebra::{SVector, Vector3};

use super::input::Levers;
use super::kim;
use super::{Coefficients, NotACollision};
use super::{
    Contact, Fidelity, Gradient, Impulse, ImpulseGradient, Jacobian, Model, Outcome, Regime, variable,
};
use crate::physics::ball::{BallState, Vec3};

/// The derivatives of an outcome's components by one number, in the order of the rows of [`Jacobian`].
pub type Column = SVector<f64, 12>;

/// How an outcome hangs on its impulses in [`Impulse`]'s units: linearly, as long as the same ball is carried by the cloth.
struct Map<'a> {
    model: &'a Model,
    contact: &'a Contact,
    /// Whether the object ball is pressed into the cloth.
    pressed: bool,
    tilt: f64,
}

impl<'a> Map<'a> {
    fn new(model: &'a Model, contact: &'a Contact, impulse: &Impulse) -> Self {
        let tilt = model.tilt();
        Self { model, contact, pressed: impulse.z + tilt * impulse.normal < 0.0, tilt }
    }

    /// What impulses q, J_y, J_z change, with this 1/a, 1/r and μ_s.
    fn of(&self, impulse: [f64; 3], scale: f64, per_r: f64, mu_s: f64) -> Column {
        let [q, j_y, j_z] = impulse.map(|impulse| scale * impulse);
        let up = j_z + self.tilt * q;
        // 1/(1 + 1/r + μ_s sin δ), to first order
        let held = if self.pressed { 0.5 * self.contact.levers.scale * self.tilt * mu_s } else { 0.0 };
        self.of_parts(q * (1.0 - held), up, [j_y, j_z], per_r, mu_s)
    }

    /// The same from the impulses along x, upwards on the object ball, and of the friction.
    fn of_parts(&self, q: f64, up: f64, [j_y, j_z]: [f64; 2], per_r: f64, mu_s: f64) -> Column {
        let (cue, object) = (self.model.ball, self.model.object_ball());
        let (rises, carried) = if self.pressed { (0.0, up) } else { (up, 0.0) };
        // of the cloth, along x
        let braked = mu_s * carried;
        // U_f = U_i − (q, J_y, J_z [θ<0])/r,  ω_f = ω_i + (0, J_z, −J_y)/(rν_c R_c)
        let on_cue = per_r / (cue.inertia * cue.radius);
        // V_f = (q + m_s J_z, J_y, J_z [θ>0]),  Ω_f = (0, J_z − m_s J_z, −J_y)/νR_o
        let on_object = 1.0 / (object.inertia * object.radius);
        let sigma = self.contact.sigma;
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
    fn shares(&self, contact: &Contact) -> [f64; 3] {
        [contact.levers.scale, 1.0 / self.mass_ratio(), contact.mu_s]
    }

    #[cold]
    pub(super) fn outcome_of_unequal(
        &self,
        cue: &BallState,
        contact: &Contact,
        impulse: &Impulse,
        regime: Regime,
    ) -> Outcome {
        let [scale, per_r, mu_s] = self.shares(contact);
        let change = Map::new(self, contact, impulse).of(impulse.components(), scale, per_r, mu_s);
        let before = Outcome {
            regime,
            impulse: -change[0] / per_r,
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
        let [scale, per_r, mu_s] = self.shares(contact);
        let map = Map::new(self, contact, impulse);
        let of = |variable: usize| map.of(gradient.components(variable), scale, per_r, mu_s);
        let radius = self.ball.radius;
        let by_v_y = of(variable::V_Y);
        // the friction of the cloth itself, and that within the impact
        let mut by_mu_s = map.of(impulse.components(), scale, per_r, f64::from(self.effects.cloth))
            - map.of(impulse.components(), scale, per_r, 0.0);
        if contact.v_z > 0.0 {
            by_mu_s += of(variable::M_S) * scale;
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
        let at = |ratio: f64| {
            Ok::<_, NotACollision>(self.with_radius_ratio(ratio).collide(cue, coefficients)?.components())
        };
        Ok((at(ratio + STEP)? - at(ratio - STEP)?) / (2.0 * STEP))
    }

    /// The derivative of an outcome by m_cue/m_object: analytic, but by central differences for `ode` and `contact`
    /// (as in [`Model::collide_with_jacobian`]).
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub fn by_mass_ratio(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<Column, NotACollision> {
        if let Some((model, coefficients, _)) = self.at_closing_speed(cue, coefficients) {
            return model.by_mass_ratio(cue, &coefficients);
        }
        let ratio = self.mass_ratio();
        if self.fidelity.is_integrated() {
            let h = self.tolerance.cbrt() * ratio;
            let at = |ratio: f64| {
                Ok::<_, NotACollision>(self.with_mass_ratio(ratio).collide(cue, coefficients)?.components())
            };
            return Ok((at(ratio + h)? - at(ratio - h)?) / (2.0 * h));
        }
        let model = self.with_mass_ratio(ratio);
        let contact = model.contact(cue, coefficients)?;
        let inertias = [model.ball.inertia, model.object_ball().inertia];
        let topspin = contact.v_z > 0.0;
        let [y, z, scale] = Levers::by_mass_ratio(ratio, inertias, topspin);
        let d_m_s = if topspin { contact.mu_s * scale } else { 0.0 };
        let (impulse, by) = match model.fidelity {
            Fidelity::Full => kim::impulse_along(&contact, [y, z], d_m_s),
            // m_s is all that these know of the masses
            _ => {
                let (outcome, gradient) = model.impulse_and_gradient(&contact);
                (
                    outcome.0,
                    [gradient.normal, gradient.y, gradient.z].map(|of: Gradient| of[variable::M_S] * d_m_s),
                )
            }
        };
        let (all, per_r) = (impulse.components(), 1.0 / ratio);
        let map = Map::new(&model, &contact, &impulse);
        let s = contact.levers.scale;
        // linear in 1/r
        let by_per_r = map.of(all, s, 1.0, contact.mu_s) - map.of(all, s, 0.0, contact.mu_s);
        // and quadratic in 1/a where the cloth holds a ball that is pressed down
        let held =
            if map.pressed { -0.5 * scale * map.tilt * contact.mu_s * s * impulse.normal } else { 0.0 };
        Ok(map.of(by, s, per_r, contact.mu_s)
            + map.of(all, scale, per_r, contact.mu_s)
            + map.of_parts(held, 0.0, [0.0; 2], per_r, contact.mu_s)
            - by_per_r * (per_r * per_r))
    }
}
