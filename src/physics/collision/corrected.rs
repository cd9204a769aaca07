//! A collision in closed form with what an integrated fidelity adds to it.
//!
//! What `ode` and `contact` know beyond `full` is small, and linear in the coefficients for all that a fit moves them:
//! their difference and its slope, taken once, serve a fit near that shot at the cost of `full`.

use nalgebra::{SMatrix, SVector, Vector6};

use super::{ByOthers, Coefficients, Jacobian, Model, NotACollision, Outcome};
use crate::physics::ball::BallState;
use crate::physics::friction_law::Law;

/// The difference of a finer model's outcome from that in closed form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction {
    /// Difference of the components, in the order of [`Outcome::components`], at the coefficients `at`.
    value: SVector<f64, 12>,
    /// Its slope by μ, μ_s, e, b, c and κ.
    slope: SMatrix<f64, 12, 6>,
    /// μ, μ_s, e, b, c and κ that it was computed at.
    at: Vector6<f64>,
}

/// A model, and what is added to its outcomes.
#[derive(Clone, Copy, Debug)]
pub struct Corrected<'a> {
    /// The model in closed form.
    pub model: Model,
    /// The correction of its outcomes, if there is one.
    pub correction: Option<&'a Correction>,
}

fn numbers(model: &Model, coefficients: &Coefficients) -> Vector6<f64> {
    let &Coefficients { mu, mu_s, e } = coefficients;
    let (b, c) = match model.law {
        Law::Constant => (0.0, 0.0),
        Law::Exponential { b, c } => (b, c),
    };
    Vector6::new(mu, mu_s, e, b, c, model.kappa)
}

impl Correction {
    /// Largest changes of μ, μ_s, e, b, c and κ for which a correction serves: within them it errs by a small part of itself.
    const NEAR: [f64; 6] = [0.01, 0.01, 0.01, 0.01, 0.1, 0.1];

    /// The difference of `model` from `base` for one shot.
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub fn of(
        model: &Model,
        base: &Model,
        cue: &BallState,
        at: &Coefficients,
    ) -> Result<Self, NotACollision> {
        let fine = Model { tolerance: model.tolerance.max(Model::TOLERANCE_OF_FITS), ..*model };
        let all = |model: &Model| {
            let (outcome, jacobian, others) = model.compute_all(cue, at)?;
            let mut by = SMatrix::<f64, 12, 6>::zeros();
            by.fixed_columns_mut::<3>(0).copy_from(&jacobian.fixed_columns::<3>(0));
            by.fixed_columns_mut::<3>(3).copy_from(&others.fixed_columns::<3>(0));
            Ok::<_, NotACollision>((outcome.components(), by))
        };
        let ((fine_value, fine_by), (value, by)) = (all(&fine)?, all(base)?);
        Ok(Self { value: fine_value - value, slope: fine_by - by, at: numbers(model, at) })
    }

    /// How far a model is from where the correction was computed.
    fn moved(&self, model: &Model, coefficients: &Coefficients) -> Vector6<f64> {
        let mut moved = numbers(model, coefficients) - self.at;
        // constant friction has no c, a rigid contact no κ
        if model.law == Law::Constant {
            moved[4] = 0.0;
        }
        if model.kappa == 0.0 {
            moved[5] = 0.0;
        }
        moved
    }

    /// Whether a model moves no coefficient further than the correction serves.
    pub(crate) fn serves(&self, model: &Model, coefficients: &Coefficients) -> bool {
        let moved = self.moved(model, coefficients);
        moved.iter().zip(Self::NEAR).all(|(moved, near)| moved.abs() <= near)
    }
}

impl Corrected<'_> {
    /// As [`Model::collide_with_jacobian`].
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub fn collide_with_jacobian(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<(Outcome, Jacobian), NotACollision> {
        let (outcome, jacobian) = self.model.collide_with_jacobian(cue, coefficients)?;
        Ok(self.added(outcome, jacobian, coefficients))
    }

    /// As [`Model::collide_with_all`].
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub fn collide_with_all(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<(Outcome, Jacobian, Option<ByOthers>), NotACollision> {
        if !self.has_others() {
            let (outcome, jacobian) = self.collide_with_jacobian(cue, coefficients)?;
            return Ok((outcome, jacobian, None));
        }
        let (outcome, jacobian, mut others) = self.model.compute_all(cue, coefficients)?;
        let (outcome, jacobian) = self.added(outcome, jacobian, coefficients);
        if let Some(correction) = self.correction {
            let mut of_contact = others.fixed_columns_mut::<3>(0);
            of_contact += correction.slope.fixed_columns::<3>(3);
        }
        Ok((outcome, jacobian, Some(others)))
    }

    fn added(
        &self,
        outcome: Outcome,
        mut jacobian: Jacobian,
        coefficients: &Coefficients,
    ) -> (Outcome, Jacobian) {
        let Some(correction) = self.correction else { return (outcome, jacobian) };
        let moved = correction.moved(&self.model, coefficients);
        let mut by_coefficients = jacobian.fixed_columns_mut::<3>(0);
        by_coefficients += correction.slope.fixed_columns::<3>(0);
        (outcome.plus(&(correction.value + correction.slope * moved)), jacobian)
    }

    /// Whether there is more than the coefficients that it depends on.
    #[must_use]
    #[inline]
    pub fn has_others(&self) -> bool {
        self.model.has_others() || self.correction.is_some() && self.model.kappa > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::ball::{Ball, Vec3};
    use crate::physics::collision::Fidelity;

    /// A few standard errors away a correction changes by a small part of itself.
    #[test]
    fn serves_its_neighbours() {
        const CHANGED: f64 = 0.05;
        let cue = BallState::natural_roll(Vec3::new(3.0_f64.sqrt(), 1.0, 0.0), Ball::POOL.radius);
        let coefficients = Coefficients { mu: 0.06, mu_s: 0.25, e: 0.94 };
        let model = Model::new(Fidelity::Contact, Ball::POOL);
        let closed = model.closed().unwrap();
        let correction = Correction::of(&model, &closed, &cue, &coefficients).unwrap();
        let corrected = Corrected { model: closed, correction: Some(&correction) };
        let size = correction.value.amax();
        assert!(size > 1e-3, "{size}");
        let further = Coefficients { mu: 0.0695, mu_s: 0.2405, e: 0.9305 };
        let faster = BallState { velocity: 1.02 * cue.velocity, spin: 1.02 * cue.spin };
        for (cue, coefficients) in [(cue, coefficients), (faster, coefficients), (cue, further)] {
            assert!(correction.serves(&closed, &coefficients));
            let (outcome, _) = corrected.collide_with_jacobian(&cue, &coefficients).unwrap();
            let fine = model.collide(&cue, &coefficients).unwrap();
            let off = (outcome.components() - fine.components()).amax();
            assert!(off < CHANGED * size, "{off} of {size}");
        }
        assert!(!correction.serves(&closed, &Coefficients { mu: 0.1, ..coefficients }));
    }
}
