//! How an outcome changes with what is usually known or has no part: b and c of a friction that falls with the slip,
//! μ(v) = a + b exp(−c v), κ of a contact that gives way, the masses and the radii of balls that are not equal, and e₁ of an e that
//! falls with the closing speed.

use nalgebra::SMatrix;

use super::Input;
use super::integrated;
use super::recent;
use super::unequal::slope;
use super::{All, ByLaw, Coefficients, Column, Jacobian, Model, NotACollision, Outcome};
use crate::physics::ball::BallState;
use crate::physics::contact_frame;
use crate::physics::friction_law::Law;

/// How many numbers an outcome depends on besides the coefficients and the cue ball's state: b and c of a friction that falls with
/// the slip, κ, m_cue/m_object, R_cue/R_object and e₁.
pub const OTHERS: usize = 6;

/// The derivatives of an outcome's components, in the order of the rows of [`Jacobian`], by those numbers in this order.
pub type ByOthers = SMatrix<f64, 12, OTHERS>;

impl Model {
    /// The outcome with its derivatives as in [`Model::collide_with_jacobian`], and those by b, c, κ, the ratio of the masses, that of
    /// the radii and e₁. These are `None` where friction and e are constant, the contact is rigid and the balls are equal.
    ///
    /// # Errors
    /// As [`Model::collide`].
    #[inline]
    pub fn collide_with_all(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<(Outcome, Jacobian, Option<ByOthers>), NotACollision> {
        if self.has_others() {
            return self.with_others(cue, coefficients);
        }
        let (outcome, jacobian) = self.collide_with_jacobian(cue, coefficients)?;
        Ok((outcome, jacobian, None))
    }

    /// Whether there is more than the coefficients that outcomes depend on.
    #[inline]
    pub(crate) fn has_others(&self) -> bool {
        self.law != Law::Constant || !self.is_usual() || self.is_compliant()
    }

    #[cold]
    fn with_others(&self, cue: &BallState, coefficients: &Coefficients) -> Result<All, NotACollision> {
        let compute = || self.compute_with_others(cue, coefficients);
        if self.fidelity.is_integrated() {
            recent::remembered(self, cue, coefficients, compute)
        } else {
            compute()
        }
    }

    pub(super) fn compute_with_others(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<All, NotACollision> {
        if let Some((model, coefficients, slopes)) = self.at_closing_speed(cue, coefficients) {
            let (outcome, mut jacobian, by) = model.compute_with_others(cue, &coefficients)?;
            let mut by = by.unwrap_or_else(ByOthers::zeros);
            by.set_column(OTHERS - 1, &slopes.carry(&mut jacobian));
            return Ok((outcome, jacobian, Some(by)));
        }
        let (outcome, jacobian, exact) = if self.is_compliant() {
            integrated::collide_with_jacobian(self, cue, coefficients, &self.contact(cue, coefficients)?)?
        } else {
            let (outcome, jacobian) = self.collide_with_jacobian(cue, coefficients)?;
            (outcome, jacobian, None)
        };
        let mut by = ByOthers::zeros();
        let (by_kappa, by_law) = match exact {
            Some((by_kappa, by_law)) => (by_kappa, by_law),
            None => (self.by_kappa(cue, coefficients)?, None),
        };
        let by_law = by_law.unwrap_or_else(|| self.by_law(cue, coefficients, &outcome, &jacobian));
        by.fixed_columns_mut::<2>(0).copy_from(&by_law);
        by.set_column(2, &by_kappa);
        if self.object.is_some() {
            by.set_column(3, &self.by_mass_ratio(cue, coefficients)?);
            by.set_column(4, &self.by_radius_ratio(cue, coefficients)?);
        }
        Ok((outcome, jacobian, Some(by)))
    }

    /// `outcome` and `jacobian` are those of [`Model::collide_with_jacobian`]. 0 for a constant friction; for `ode` and
    /// `contact` differences, with an error of about the tolerance to the power 2/3.
    #[must_use]
    fn by_law(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
        outcome: &Outcome,
        jacobian: &Jacobian,
    ) -> ByLaw {
        let Law::Exponential { b, c } = self.law else { return ByLaw::zeros() };
        if self.fidelity.is_integrated() {
            return self.law_differences([b, c], cue, coefficients, outcome);
        }
        let slip = contact_frame::slip(cue, &BallState::default(), self.ball.radius);
        let v = slip.y.hypot(slip.z);
        let by_mu = jacobian.column(Input::Mu as usize);
        // μ = a + b exp(−c v) at the first slip: ∂μ/∂b = exp(−c v), ∂μ/∂c = −b v exp(−c v)
        let by_b = (-c * v).exp();
        let mut by_law = ByLaw::zeros();
        by_law.set_column(0, &(by_mu * by_b));
        by_law.set_column(1, &(by_mu * (-b * v * by_b)));
        by_law
    }

    /// The components of an outcome by κ: differences, with an error of about the tolerance to the power 2/3; 0 where the contact is
    /// rigid along the surface.
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub(crate) fn by_kappa(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<Column, NotACollision> {
        if !self.is_compliant() {
            return Ok(Column::zeros());
        }
        let step = self.tolerance.cbrt() * self.kappa.min(1.0);
        slope(|by| Self { kappa: self.kappa + by, ..*self }, step, cue, coefficients)
    }

    fn law_differences(
        &self,
        [b, c]: [f64; 2],
        cue: &BallState,
        coefficients: &Coefficients,
        outcome: &Outcome,
    ) -> ByLaw {
        let h = self.tolerance.cbrt();
        let mut by_law = ByLaw::zeros();
        for (column, step) in [h, h * c.max(1.0)].into_iter().enumerate() {
            let moved = |by: f64| -> Result<_, NotACollision> {
                let law = match column {
                    0 => Law::Exponential { b: b + by, c },
                    _ => Law::Exponential { b, c: c + by },
                };
                Ok(Self { law, ..*self }.collide(cue, coefficients)?.components())
            };
            let here = outcome.components();
            // at the end of its range from within
            let slope = match (moved(-step), moved(step)) {
                (Ok(below), Ok(above)) => (above - below) / (2.0 * step),
                (Err(_), Ok(above)) => (above - here) / step,
                (Ok(below), Err(_)) => (here - below) / step,
                (Err(_), Err(_)) => continue,
            };
            by_law.set_column(column, &slope);
        }
        by_law
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::ball::{Ball, Vec3};
    use crate::physics::collision::{Effects, Fidelity};

    /// Central differences of a smooth function with this step err by its square, of numbers of order 1; those of
    /// integrated outcomes by the tolerance over it.
    const STEP: f64 = 1e-4;
    const ERROR: f64 = 1e-5;

    #[test]
    fn agrees_with_differences_at_every_fidelity() {
        let cue = BallState { velocity: Vec3::new(1.5, 0.8, 0.0), spin: Vec3::new(0.0, 12.0, 5.0) };
        let coefficients = Coefficients { mu: 0.02, mu_s: 0.25, e: 0.94 };
        let (b, c) = (0.08, 1.3);
        for fidelity in [Fidelity::Linear, Fidelity::Full, Fidelity::Ode, Fidelity::Contact] {
            let at = |b: f64, c: f64| {
                let law = Law::Exponential { b, c };
                Model { law, ..Model::new(fidelity, Ball::POOL) }
            };
            let components = |b: f64, c: f64| at(b, c).collide(&cue, &coefficients).unwrap().components();
            let model = at(b, c);
            let (outcome, jacobian) = model.collide_with_jacobian(&cue, &coefficients).unwrap();
            let by_law = model.by_law(&cue, &coefficients, &outcome, &jacobian);
            let by_b = (components(b + STEP, c) - components(b - STEP, c)) / (2.0 * STEP);
            let by_c = (components(b, c + STEP) - components(b, c - STEP)) / (2.0 * STEP);
            for (column, expected) in [by_b, by_c].iter().enumerate() {
                let error = (by_law.column(column) - expected).amax() / expected.amax();
                assert!(expected.amax() > 0.01 && error < ERROR, "{fidelity:?} {column}: {error}");
            }
        }
    }

    #[test]
    fn nothing_depends_on_the_law_without_friction() {
        let cue = BallState { velocity: Vec3::new(1.5, 0.8, 0.0), spin: Vec3::zeros() };
        let coefficients = Coefficients { mu: 0.02, mu_s: 0.25, e: 0.94 };
        let effects = Effects { friction: false, ..Effects::ALL };
        let law = Law::Exponential { b: 0.1, c: 1.0 };
        let model = Model { effects, law, ..Model::new(Fidelity::Full, Ball::POOL) };
        let (outcome, jacobian) = model.collide_with_jacobian(&cue, &coefficients).unwrap();
        assert_eq!(model.by_law(&cue, &coefficients, &outcome, &jacobian).amax(), 0.0);
        let constant = Model::new(Fidelity::Full, Ball::POOL);
        let (outcome, jacobian) = constant.collide_with_jacobian(&cue, &coefficients).unwrap();
        assert_eq!(constant.by_law(&cue, &coefficients, &outcome, &jacobian), ByLaw::zeros());
    }
}
