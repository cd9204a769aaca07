//! A collision in closed form with what an integrated fidelity adds to it.
//!
//! What `ode` and `contact` know beyond `full` is small and hardly changes from one shot to its neighbour: their
//! difference, taken once, serves a fit near that shot, at the cost of `full` and with its derivatives.

use nalgebra::SVector;

use super::{Coefficients, Fidelity, Jacobian, Model, NotACollision, Outcome};
use crate::ball::BallState;

/// A model, and what is added to the components of its outcomes.
#[derive(Clone, Copy, Debug)]
pub struct Corrected {
    pub model: Model,
    /// In the order of [`Outcome::components`].
    pub added: SVector<f64, 12>,
}

impl Corrected {
    /// Integrated to this, relative to the closing speed: far below what a correction is worth.
    const TOLERANCE: f64 = 1e-8;

    /// A model as it is.
    #[must_use]
    pub fn none(model: Model) -> Self {
        Self { model, added: SVector::zeros() }
    }

    /// `full`, brought to what an integrated model says of one shot. Any other model is left as it is.
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub fn near(
        model: Model,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<Self, NotACollision> {
        let Some(closed) = model.closed() else { return Ok(Self::none(model)) };
        let fine = Model { tolerance: model.tolerance.max(Self::TOLERANCE), ..model };
        let fine = fine.collide(cue, coefficients)?.components();
        Ok(Self { model: closed, added: fine - closed.collide(cue, coefficients)?.components() })
    }

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
        Ok((outcome.plus(&self.added), jacobian))
    }
}

impl Model {
    /// `full` with what of the effects it can do, for a model that is integrated.
    #[must_use]
    pub fn closed(&self) -> Option<Self> {
        let is_integrated = matches!(self.fidelity, Fidelity::Ode | Fidelity::Contact);
        let effects = self.effects.and(Fidelity::Full.effects());
        is_integrated.then_some(Self { fidelity: Fidelity::Full, effects, ..*self })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ball::{Ball, Vec3};

    /// A natural-roll shot, 30° full at 2 m/s.
    fn shot() -> (BallState, Coefficients) {
        let velocity = Vec3::new(3.0_f64.sqrt(), 1.0, 0.0);
        let cue = BallState::natural_roll(velocity, Ball::POOL.radius);
        (cue, Coefficients { mu: 0.06, mu_s: 0.25, e: 0.94 })
    }

    #[test]
    fn is_the_finer_model_where_it_was_made() {
        let (cue, coefficients) = shot();
        let model = Model::new(Fidelity::Contact, Ball::POOL);
        let corrected = Corrected::near(model, &cue, &coefficients).unwrap();
        let (outcome, _) = corrected.collide_with_jacobian(&cue, &coefficients).unwrap();
        let fine = model.collide(&cue, &coefficients).unwrap();
        // both are integrated, one to TOLERANCE
        let difference = (outcome.components() - fine.components()).amax();
        assert!(difference < 1e3 * Corrected::TOLERANCE, "{difference}");
        assert!(corrected.added.amax() > 1e-3, "{}", corrected.added.amax());
    }

    #[test]
    fn serves_its_neighbours() {
        /// Parts by which the shot and the coefficients differ, a few standard errors, and of the correction what
        /// that may change.
        const APART: f64 = 0.02;
        const CHANGED: f64 = 0.1;
        let (cue, coefficients) = shot();
        let model = Model::new(Fidelity::Contact, Ball::POOL);
        let corrected = Corrected::near(model, &cue, &coefficients).unwrap();
        let cue = BallState { velocity: cue.velocity * (1.0 + APART), spin: cue.spin * (1.0 + APART) };
        let coefficients = Coefficients { mu: coefficients.mu * (1.0 + APART), ..coefficients };
        let (outcome, _) = corrected.collide_with_jacobian(&cue, &coefficients).unwrap();
        let fine = model.collide(&cue, &coefficients).unwrap();
        let difference = (outcome.components() - fine.components()).amax();
        assert!(difference < CHANGED * corrected.added.amax(), "{difference} of {}", corrected.added.amax());
    }

    #[test]
    fn leaves_a_closed_form_alone() {
        let (cue, coefficients) = shot();
        let model = Model::new(Fidelity::Linear, Ball::POOL);
        let corrected = Corrected::near(model, &cue, &coefficients).unwrap();
        assert_eq!((corrected.model, corrected.added.amax()), (model, 0.0));
    }
}
