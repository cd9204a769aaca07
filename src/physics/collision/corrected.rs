//! A collision in closed form with what an integrated fidelity adds to it.
//!
//! What `ode` and `contact` know beyond `full` is small, and linear in the coefficients for all that a fit moves them:
//! their difference and its slope, taken once, serve a fit near that shot at the cost of `full`.

use nalgebra::{SMatrix, SVector, Vector6};

use super::law::{ByOthers, OTHERS};
use super::{Coefficients, Effects, Fidelity, Jacobian, Model, NotACollision, Outcome};
use crate::physics::ball::BallState;
use crate::physics::friction_law::Law;

/// What is added to the components of an outcome, in the order of [`Outcome::components`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction {
    /// At the coefficients `at`, whose e is that of the shot's closing speed.
    pub value: SVector<f64, 12>,
    /// By μ, μ_s, e, b and c of a friction that falls, and κ of a contact that gives way.
    pub slope: SMatrix<f64, 12, 6>,
    /// The coefficients that the correction was computed at.
    pub at: Coefficients,
    /// The law of friction that it was computed at.
    pub law: Law,
    /// The tangential compliance κ that it was computed at, 0 for a rigid contact.
    pub kappa: f64,
}

/// A model, and what is added to its outcomes.
#[derive(Clone, Copy, Debug)]
pub struct Corrected<'a> {
    /// The model in closed form.
    pub model: Model,
    /// What an integrated fidelity adds to its outcomes, if anything.
    pub correction: Option<&'a Correction>,
}

impl Correction {
    /// By which the coefficients and b are moved for the slope; and c, s/m, and κ.
    const STEP: f64 = 5e-3;
    const STEP_OF_C: f64 = 5e-2;
    const STEP_OF_KAPPA: f64 = 5e-2;
    /// So many steps away it serves as well: it errs by a small part of itself.
    const NEAR: f64 = 2.0;

    /// What a model that is integrated says of one shot beyond another.
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub fn of(
        model: &Model,
        base: &Model,
        cue: &BallState,
        at: &Coefficients,
    ) -> Result<Self, NotACollision> {
        let (model, at) = match model.at_closing_speed(cue, at) {
            Some((model, at, _)) => (model, at),
            None => (*model, *at),
        };
        let (base, at) = (Model { e_slope: None, ..*base }, &at);
        let fine = Model { tolerance: model.tolerance.max(Model::TOLERANCE_OF_FITS), ..model };
        let beyond = |at: &Coefficients, law: Law, kappa: f64| {
            let (fine, base) = (Model { law, kappa, ..fine }, Model { law, kappa, ..base });
            let difference = fine.collide(cue, at)?.components() - base.collide(cue, at)?.components();
            Ok::<_, NotACollision>(difference)
        };
        let (law, kappa) = (model.law, if model.is_compliant() { model.kappa } else { 0.0 });
        let value = beyond(at, law, kappa)?;
        let Coefficients { mu, mu_s, e } = *at;
        let mut moved = vec![
            (0, Coefficients { mu: mu + Self::STEP, ..*at }, law, kappa, Self::STEP),
            (1, Coefficients { mu_s: mu_s + Self::STEP, ..*at }, law, kappa, Self::STEP),
            // e may be 1
            (2, Coefficients { e: e - Self::STEP, ..*at }, law, kappa, -Self::STEP),
        ];
        if let Law::Exponential { b, c } = law {
            moved.push((3, *at, Law::Exponential { b: b + Self::STEP, c }, kappa, Self::STEP));
            moved.push((4, *at, Law::Exponential { b, c: c + Self::STEP_OF_C }, kappa, Self::STEP_OF_C));
        }
        if model.is_compliant() {
            moved.push((5, *at, law, kappa + Self::STEP_OF_KAPPA, Self::STEP_OF_KAPPA));
        }
        let mut slope = SMatrix::<f64, 12, 6>::zeros();
        for (column, moved, law, kappa, step) in moved {
            // at the end of its range a coefficient has no slope
            if let Ok(there) = beyond(&moved, law, kappa) {
                slope.set_column(column, &((there - value) / step));
            }
        }
        Ok(Self { value, slope, at: *at, law, kappa })
    }

    /// By how much others differ from those that it was computed at, in the order of its slope.
    fn moved(&self, coefficients: &Coefficients, law: Law, kappa: f64) -> Vector6<f64> {
        let Coefficients { mu, mu_s, e } = *coefficients;
        let (b, c) = match (law, self.law) {
            (Law::Exponential { b, c }, Law::Exponential { b: own_b, c: own_c }) => (b - own_b, c - own_c),
            (Law::Constant, Law::Exponential { b, .. }) => (-b, 0.0),
            (_, Law::Constant) => (0.0, 0.0),
        };
        let at = &self.at;
        Vector6::new(mu - at.mu, mu_s - at.mu_s, e - at.e, b, c, kappa - self.kappa)
    }

    /// Whether a model moves no coefficient much further than its slope was taken over.
    pub(crate) fn serves(&self, model: &Model, coefficients: &Coefficients) -> bool {
        let moved = self.moved(coefficients, model.law, if self.kappa > 0.0 { model.kappa } else { 0.0 });
        let steps = [Self::STEP, Self::STEP, Self::STEP, Self::STEP, Self::STEP_OF_C, Self::STEP_OF_KAPPA];
        moved.iter().zip(steps).all(|(moved, step)| moved.abs() <= Self::NEAR * step)
    }

    fn at(&self, coefficients: &Coefficients, law: Law, kappa: f64) -> SVector<f64, 12> {
        self.value + self.slope * self.moved(coefficients, law, kappa)
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
        if self.correction.is_none() {
            return self.model.collide_with_jacobian(cue, coefficients);
        }
        let (outcome, jacobian, _) = self.collide_with_all(cue, coefficients)?;
        Ok((outcome, jacobian))
    }

    /// Also by what else it depends on ([`Model::collide_with_all`]).
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub fn collide_with_all(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<(Outcome, Jacobian, Option<ByOthers>), NotACollision> {
        let Some(correction) = self.correction else {
            return self.model.collide_with_all(cue, coefficients);
        };
        if let Some((model, coefficients, slopes)) = self.model.at_closing_speed(cue, coefficients) {
            let (outcome, mut jacobian, by) = Self { model, ..*self }.collide_with_all(cue, &coefficients)?;
            let mut by = by.unwrap_or_else(ByOthers::zeros);
            by.set_column(OTHERS - 1, &slopes.carry(&mut jacobian));
            return Ok((outcome, jacobian, Some(by)));
        }
        let (outcome, mut jacobian, mut by_others) = self.model.collide_with_all(cue, coefficients)?;
        let mut by_coefficients = jacobian.fixed_columns_mut::<3>(0);
        by_coefficients += correction.slope.fixed_columns::<3>(0);
        if self.has_others() {
            let by = by_others.get_or_insert_with(ByOthers::zeros);
            let mut of_contact = by.fixed_columns_mut::<3>(0);
            of_contact += correction.slope.fixed_columns::<3>(3);
        }
        let change = correction.at(coefficients, self.model.law, self.model.kappa);
        Ok((outcome.plus(&change), jacobian, by_others))
    }

    /// Whether there is more than the coefficients that it depends on.
    #[must_use]
    #[inline]
    pub fn has_others(&self) -> bool {
        self.model.has_others() || self.correction.is_some_and(|correction| correction.kappa > 0.0)
    }
}

impl Model {
    /// The model with a contact that gives way along its surface, and with a friction that follows the slip: integrated as closely as
    /// fits need it, with the other effects that a closed form has.
    #[must_use]
    pub fn giving_way(self, kappa: f64) -> Self {
        let effects = Effects { compliance: true, falling_friction: true, ..Fidelity::Full.effects() };
        Self { fidelity: Fidelity::Ode, effects, kappa, tolerance: Self::TOLERANCE_OF_FITS, ..self }
    }

    /// The model in closed form, [`Fidelity::Full`], with those of the effects that it can simulate; `None` for a fidelity that is
    /// not integrated.
    #[must_use]
    pub fn closed(&self) -> Option<Self> {
        let effects = || self.effects.and(Fidelity::Full.effects());
        self.fidelity.is_integrated().then(|| Self { fidelity: Fidelity::Full, effects: effects(), ..*self })
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
        let correction = Correction::of(&model, &model.closed().unwrap(), &cue, &coefficients).unwrap();
        let corrected = Corrected { model: model.closed().unwrap(), correction: Some(&correction) };
        let (outcome, _) = corrected.collide_with_jacobian(&cue, &coefficients).unwrap();
        let fine = model.collide(&cue, &coefficients).unwrap();
        // both are integrated, one to TOLERANCE
        let difference = (outcome.components() - fine.components()).amax();
        assert!(difference < 1e3 * Model::TOLERANCE_OF_FITS, "{difference}");
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
        let correction = Correction::of(&model, &model.closed().unwrap(), &cue, &coefficients).unwrap();
        let corrected = Corrected { model: model.closed().unwrap(), correction: Some(&correction) };
        let Coefficients { mu, mu_s, e } = coefficients;
        let other_cue = BallState { velocity: cue.velocity * (1.0 + APART), spin: cue.spin * (1.0 + APART) };
        // nearly as far as it serves
        let further = 0.99 * Correction::NEAR * Correction::STEP;
        for (cue, coefficients) in [
            (other_cue, Coefficients { mu: mu * (1.0 + APART), ..coefficients }),
            (cue, Coefficients { mu: mu + further, mu_s: mu_s - further, e: e - further }),
        ] {
            assert!(correction.serves(&model, &coefficients));
            let (outcome, _) = corrected.collide_with_jacobian(&cue, &coefficients).unwrap();
            let fine = model.collide(&cue, &coefficients).unwrap();
            let difference = (outcome.components() - fine.components()).amax();
            let value = correction.value.amax();
            assert!(difference < CHANGED * value, "{difference} of {value}");
        }
    }

    #[test]
    fn a_closed_form_has_none_that_is_simpler() {
        assert_eq!(Model::new(Fidelity::Linear, Ball::POOL).closed(), None);
    }
}
