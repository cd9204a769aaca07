//! A collision in closed form with what an integrated fidelity adds to it.
//!
//! What `ode` and `contact` know beyond `full` is small, and linear in the coefficients for all that a fit moves them:
//! their difference and its slope, taken once, serve a fit near that shot at the cost of `full`.

use nalgebra::{SMatrix, SVector, Vector5};

use super::law::ByLaw;
use super::{Coefficients, Fidelity, Jacobian, Model, NotACollision, Outcome};
use crate::physics::ball::BallState;
use crate::physics::friction_law::Law;

/// What is added to the components of an outcome, in the order of [`Outcome::components`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction {
    /// At the coefficients `at`.
    pub value: SVector<f64, 12>,
    /// By μ, μ_s, e, and b and c of a friction that falls.
    pub slope: SMatrix<f64, 12, 5>,
    pub at: Coefficients,
    pub law: Law,
}

/// A model, and what is added to its outcomes.
#[derive(Clone, Copy, Debug)]
pub struct Corrected<'a> {
    pub model: Model,
    pub correction: Option<&'a Correction>,
}

impl Correction {
    /// Integrated to this, relative to the closing speed: far below what a correction is worth.
    const TOLERANCE: f64 = 1e-7;

    /// By which the coefficients and b are moved for the slope, and c, s/m.
    const STEP: f64 = 5e-3;
    const STEP_OF_C: f64 = 5e-2;

    /// What an integrated model says of one shot beyond its closed form; `None` for a closed form.
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub fn of(model: &Model, cue: &BallState, at: &Coefficients) -> Result<Option<Self>, NotACollision> {
        let Some(closed) = model.closed() else { return Ok(None) };
        let fine = Model { tolerance: model.tolerance.max(Self::TOLERANCE), ..*model };
        let beyond = |at: &Coefficients, law: Law| {
            let (fine, closed) = (Model { law, ..fine }, Model { law, ..closed });
            let difference = fine.collide(cue, at)?.components() - closed.collide(cue, at)?.components();
            Ok::<_, NotACollision>(difference)
        };
        let law = model.law;
        let value = beyond(at, law)?;
        let Coefficients { mu, mu_s, e } = *at;
        let mut moved = vec![
            (Coefficients { mu: mu + Self::STEP, ..*at }, law, Self::STEP),
            (Coefficients { mu_s: mu_s + Self::STEP, ..*at }, law, Self::STEP),
            // e may be 1
            (Coefficients { e: e - Self::STEP, ..*at }, law, -Self::STEP),
        ];
        if let Law::Exponential { b, c } = law {
            moved.push((*at, Law::Exponential { b: b + Self::STEP, c }, Self::STEP));
            moved.push((*at, Law::Exponential { b, c: c + Self::STEP_OF_C }, Self::STEP_OF_C));
        }
        let mut slope = SMatrix::<f64, 12, 5>::zeros();
        for (column, (moved, law, step)) in moved.into_iter().enumerate() {
            // at the end of its range a coefficient has no slope
            if let Ok(there) = beyond(&moved, law) {
                slope.set_column(column, &((there - value) / step));
            }
        }
        Ok(Some(Self { value, slope, at: *at, law }))
    }

    fn at(&self, coefficients: &Coefficients, law: Law) -> SVector<f64, 12> {
        let Coefficients { mu, mu_s, e } = *coefficients;
        let (b, c) = match (law, self.law) {
            (Law::Exponential { b, c }, Law::Exponential { b: own_b, c: own_c }) => (b - own_b, c - own_c),
            (Law::Constant, Law::Exponential { b, .. }) => (-b, 0.0),
            (_, Law::Constant) => (0.0, 0.0),
        };
        self.value + self.slope * Vector5::new(mu - self.at.mu, mu_s - self.at.mu_s, e - self.at.e, b, c)
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
        let (outcome, jacobian, _) = self.collide_with_all(cue, coefficients)?;
        Ok((outcome, jacobian))
    }

    /// Also by b and c of a friction that falls with the slip ([`Model::by_law`]).
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub fn collide_with_all(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<(Outcome, Jacobian, ByLaw), NotACollision> {
        let (outcome, mut jacobian) = self.model.collide_with_jacobian(cue, coefficients)?;
        let mut by_law = self.model.by_law(cue, coefficients, &outcome, &jacobian);
        let Some(correction) = self.correction else { return Ok((outcome, jacobian, by_law)) };
        let mut by_coefficients = jacobian.fixed_columns_mut::<3>(0);
        by_coefficients += correction.slope.fixed_columns::<3>(0);
        by_law += correction.slope.fixed_columns::<2>(3);
        Ok((outcome.plus(&correction.at(coefficients, self.model.law)), jacobian, by_law))
    }
}

impl Model {
    /// `full` with what of the effects it can do, for a model that is integrated.
    #[must_use]
    pub fn closed(&self) -> Option<Self> {
        let is_integrated = matches!(self.fidelity, Fidelity::Ode | Fidelity::Contact);
        let effects = || self.effects.and(Fidelity::Full.effects());
        is_integrated.then(|| Self { fidelity: Fidelity::Full, effects: effects(), ..*self })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::ball::{Ball, Vec3};

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
        let correction = Correction::of(&model, &cue, &coefficients).unwrap().unwrap();
        let corrected = Corrected { model: model.closed().unwrap(), correction: Some(&correction) };
        let (outcome, _) = corrected.collide_with_jacobian(&cue, &coefficients).unwrap();
        let fine = model.collide(&cue, &coefficients).unwrap();
        // both are integrated, one to TOLERANCE
        let difference = (outcome.components() - fine.components()).amax();
        assert!(difference < 1e3 * Correction::TOLERANCE, "{difference}");
        assert!(correction.value.amax() > 1e-3, "{}", correction.value.amax());
    }

    #[test]
    fn serves_its_neighbours() {
        /// Parts by which the shot and the coefficients differ, a few standard errors, and of the correction what
        /// that may change.
        const APART: f64 = 0.02;
        const CHANGED: f64 = 0.05;
        let (cue, coefficients) = shot();
        let model = Model::new(Fidelity::Contact, Ball::POOL);
        let correction = Correction::of(&model, &cue, &coefficients).unwrap().unwrap();
        let corrected = Corrected { model: model.closed().unwrap(), correction: Some(&correction) };
        let cue = BallState { velocity: cue.velocity * (1.0 + APART), spin: cue.spin * (1.0 + APART) };
        let coefficients = Coefficients { mu: coefficients.mu * (1.0 + APART), ..coefficients };
        let (outcome, _) = corrected.collide_with_jacobian(&cue, &coefficients).unwrap();
        let fine = model.collide(&cue, &coefficients).unwrap();
        let difference = (outcome.components() - fine.components()).amax();
        assert!(
            difference < CHANGED * correction.value.amax(),
            "{difference} of {}",
            correction.value.amax()
        );
    }

    #[test]
    fn leaves_a_closed_form_alone() {
        let (cue, coefficients) = shot();
        let model = Model::new(Fidelity::Linear, Ball::POOL);
        assert_eq!(Correction::of(&model, &cue, &coefficients).unwrap(), None);
    }
}
