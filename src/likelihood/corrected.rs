//! A collision in closed form with what an integrated fidelity adds to it, for fits: the difference of `ode` or `contact` from `full` is
//! small, and linear in the coefficients over the changes that a fit makes. Taken once with its slope, it costs no more than `full`.

use nalgebra::{SMatrix, SVector, Vector6};

use crate::physics::ball::BallState;
use crate::physics::collision::{ByOthers, Coefficients, Jacobian, Model, NotACollision, Outcome};
use crate::physics::friction_law::Law;

/// Largest changes of μ, μ_s, e, b, c and κ for which a correction serves: within them it errs by a small part of itself.
const NEAR: [f64; 6] = [0.01, 0.01, 0.01, 0.01, 0.1, 0.1];

/// The difference of a finer model's outcome from that in closed form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction {
    /// Difference of the components, in the order of [`Outcome::components`], at the coefficients `at`.
    value: SVector<f64, 12>,
    /// Its slope by μ, μ_s, e, b, c and κ.
    slope: SMatrix<f64, 12, 6>,
    /// μ, μ_s, e, b, c and κ at which it was computed.
    at: Vector6<f64>,
}

/// A model, and the correction of its outcomes.
#[derive(Clone, Copy, Debug)]
pub struct Corrected<'a> {
    /// The model in closed form.
    pub model: Model,
    /// The correction of its outcomes, if there is one.
    pub correction: Option<&'a Correction>,
}

fn numbers(model: &Model, coefficients: &Coefficients) -> Vector6<f64> {
    let (&Coefficients { mu, mu_s, e }, [b, c]) = (coefficients, model.law.numbers());
    Vector6::new(mu, mu_s, e, b, c, model.kappa)
}

impl Correction {
    /// Returns the difference of `model` from `base` for one shot.
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
        let (fine, by, others) = fine.compute_all(cue, at)?;
        let (coarse, coarse_by, coarse_others) = base.compute_all(cue, at)?;
        let slope = SMatrix::from_fn(|row, column| match column {
            0..3 => by[(row, column)] - coarse_by[(row, column)],
            _ => others[(row, column - 3)] - coarse_others[(row, column - 3)],
        });
        Ok(Self { value: fine.components() - coarse.components(), slope, at: numbers(model, at) })
    }

    /// Returns the difference of a model's coefficients from those at which the correction was computed.
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
        moved.iter().zip(NEAR).all(|(moved, near)| moved.abs() <= near)
    }
}

impl Corrected<'_> {
    /// Returns the outcome and its derivatives as [`Model::collide_with_all`].
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub fn collide_with_all(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<(Outcome, Jacobian, Option<ByOthers>), NotACollision> {
        let Some(correction) = self.correction else { return self.model.collide_with_all(cue, coefficients) };
        let (outcome, mut jacobian, mut others) = if self.has_others() {
            let (outcome, jacobian, others) = self.model.compute_all(cue, coefficients)?;
            (outcome, jacobian, Some(others))
        } else {
            self.model.collide_with_all(cue, coefficients)?
        };
        let mut by_coefficients = jacobian.fixed_columns_mut::<3>(0);
        by_coefficients += correction.slope.fixed_columns::<3>(0);
        if let Some(others) = &mut others {
            let mut of_contact = others.fixed_columns_mut::<3>(0);
            of_contact += correction.slope.fixed_columns::<3>(3);
        }
        let moved = correction.moved(&self.model, coefficients);
        Ok((outcome.plus(&(correction.value + correction.slope * moved)), jacobian, others))
    }

    /// Whether outcomes depend on more than the coefficients.
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
            let (outcome, ..) = corrected.collide_with_all(&cue, &coefficients).unwrap();
            let fine = model.collide(&cue, &coefficients).unwrap();
            let off = (outcome.components() - fine.components()).amax();
            assert!(off < CHANGED * size, "{off} of {size}");
        }
        assert!(!correction.serves(&closed, &Coefficients { mu: 0.1, ..coefficients }));
    }
}
