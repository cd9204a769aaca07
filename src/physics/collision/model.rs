//! The methods of a model.

use nalgebra::{SMatrix, SVector};

use super::impact::{Dual, Impact, Impulses, Values, components, derivatives};
use super::{
    ByOthers, ClothTorque, Coefficients, Effects, Fidelity, Input, Jacobian, Model, NotACollision, Outcome,
    POISSON, Regime, contact, kappa, ode, simple, sliding,
};
use crate::physics::ball::{Ball, BallState};
use crate::physics::cloth_motion::Cloth;
use crate::physics::contact_frame::CollisionFrame;
use crate::physics::friction_law::Law;

/// Step of derivatives that follow an integration, in parts of k or of 1: its error is of that order, and roundings over it are less.
const STEP: f64 = 1e-7;

/// The least e at which an integration is followed, and the shortest restitution.
const LEAST_E: f64 = 1e-6;

impl Model {
    /// The default of [`Model::contact_time`], in seconds: balls of phenolic resin touch for 250 to 300 µs (Kim 2024, below Eq. 37).
    pub const CONTACT_TIME: f64 = 280e-6;

    /// The default of [`Model::tolerance`]: far below any error of measurement, and about six digits above rounding errors.
    pub const TOLERANCE: f64 = 1e-10;

    /// The tolerance that fits use: still far below any error of measurement, at a third of the time.
    pub const TOLERANCE_OF_FITS: f64 = 1e-6;

    /// The tangential compliance κ of phenolic resin, whose Poisson's ratio is 0.34 ([`kappa`]).
    pub const KAPPA: f64 = kappa(POISSON);

    /// A model of equal balls with constant friction and restitution and all effects that the fidelity contains, rigid along the
    /// surface but for `contact`, where κ is that of phenolic resin.
    #[must_use]
    pub fn new(fidelity: Fidelity, ball: Ball) -> Self {
        Self {
            fidelity,
            ball,
            object: None,
            cloth_torque: ClothTorque::Corrected,
            effects: Effects::ALL,
            law: Law::Constant,
            e_slope: None,
            kappa: if fidelity == Fidelity::Contact { Self::KAPPA } else { 0.0 },
            tolerance: Self::TOLERANCE,
            mu_k: Cloth::default().sliding,
            contact_time: Self::CONTACT_TIME,
        }
    }

    /// The cue ball's mass over the object ball's, m_cue/m_object.
    #[must_use]
    #[inline]
    pub fn mass_ratio(&self) -> f64 {
        self.object.map_or(1.0, |object| self.ball.mass / object.mass)
    }

    /// The object ball, which is like the cue ball unless stated otherwise.
    #[must_use]
    #[inline]
    pub fn object_ball(&self) -> Ball {
        self.object.unwrap_or(self.ball)
    }

    /// The same model with another mass of the object ball, so that m_cue/m_object is `ratio`.
    #[must_use]
    pub fn with_mass_ratio(self, ratio: f64) -> Self {
        let object = Ball { mass: self.ball.mass / ratio, ..self.object_ball() };
        Self { object: Some(object), ..self }
    }

    /// The cue ball's radius over the object ball's, R_cue/R_object.
    #[must_use]
    pub fn radius_ratio(&self) -> f64 {
        self.object.map_or(1.0, |object| self.ball.radius / object.radius)
    }

    /// The same model with another radius of the object ball, so that R_cue/R_object is `ratio`.
    #[must_use]
    pub fn with_radius_ratio(self, ratio: f64) -> Self {
        let object = Ball { radius: self.ball.radius / ratio, ..self.object_ball() };
        Self { object: Some(object), ..self }
    }

    /// Whether the contact is compliant along the surface.
    #[must_use]
    pub fn is_compliant(&self) -> bool {
        self.effects.and(self.fidelity.effects()).compliance && self.kappa != 0.0
    }

    /// The model with a compliant contact, integrated as closely as fits need it, and with the other effects that a closed form has.
    #[must_use]
    pub fn giving_way(self, kappa: f64) -> Self {
        let effects = Effects { compliance: true, ..Fidelity::Full.effects() };
        Self { fidelity: Fidelity::Ode, effects, kappa, tolerance: Self::TOLERANCE_OF_FITS, ..self }
    }

    /// The model in closed form, [`Fidelity::Full`], with those of the effects that it can simulate; `None` for a fidelity that is
    /// not integrated.
    #[must_use]
    pub fn closed(&self) -> Option<Self> {
        let effects = self.effects.and(Fidelity::Full.effects());
        self.fidelity.is_integrated().then_some(Self { fidelity: Fidelity::Full, effects, ..*self })
    }

    /// The model with the κ of phenolic resin if it resolves the contact in time and κ is 0, which `contact` does not simulate.
    pub(crate) fn with_some_compliance(self) -> Self {
        let is_rigid = self.fidelity == Fidelity::Contact && self.kappa == 0.0;
        Self { kappa: if is_rigid { Self::KAPPA } else { self.kappa }, ..self }
    }

    /// The outcome of a collision (Kim 2024, Eqs. 42–49 with q, J_y, J_z in place of his functions
    /// of θ), in the frame of the collision.
    ///
    /// # Errors
    /// Input that describes no collision: balls that do not approach, coefficients out of range, a vertical
    /// velocity, anything not finite; and an integration that takes too many steps.
    pub fn collide(&self, cue: &BallState, coefficients: &Coefficients) -> Result<Outcome, NotACollision> {
        let values = self.validated(cue, coefficients)?;
        if self.is_resolved() {
            return Ok(self.resolved(&values)?.outcome);
        }
        let impact = Impact::new(&values, self);
        let (impulses, regime) = match self.fidelity {
            Fidelity::Full => {
                let (impulses, end) = sliding::solve(&impact);
                (impulses, end.regime())
            }
            Fidelity::Ode => self.integrated(&impact)?,
            _ => simple::impulses(&impact),
        };
        Ok(Outcome::new(regime, impulses.q, &components(&values, self, &impulses)))
    }

    /// As [`Model::collide`], with the cue ball and the outcome in the frame of the table, z up. The line of centres leads from the
    /// cue ball to the object ball, which is at rest, and has any length, so that the difference of the two places serves.
    ///
    /// # Errors
    /// As [`Model::collide`]; also a line of centres without a direction.
    pub fn collide_on_table(
        &self,
        line_of_centres: [f64; 2],
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<Outcome, NotACollision> {
        let [nx, ny] = line_of_centres;
        let frame = CollisionFrame::from_normal(nx, ny).ok_or(NotACollision::NoDirection(nx, ny))?;
        let turned = |state: &BallState, turn: fn(CollisionFrame, _) -> _| BallState {
            velocity: turn(frame, state.velocity),
            spin: turn(frame, state.spin),
        };
        let outcome = self.collide(&turned(cue, CollisionFrame::to_collision), coefficients)?;
        Ok(Outcome {
            cue: turned(&outcome.cue, CollisionFrame::to_table),
            object: turned(&outcome.object, CollisionFrame::to_table),
            ..outcome
        })
    }

    /// The outcome and its derivatives by the coefficients and the cue ball's motion: exact in closed form and for a rigid contact;
    /// of a compliant one to about 1e-6. Where the outcome has a kink (stick setting in, topspin turning to draw) it is the
    /// derivative of the side that the outcome is on.
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub fn collide_with_jacobian(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<(Outcome, Jacobian), NotACollision> {
        self.differentiated::<{ Input::FIRST }>(cue, coefficients)
    }

    /// The outcome with its derivatives as in [`Model::collide_with_jacobian`], and those by b, c, κ, the ratio of the masses, that of
    /// the radii and e₁. These are `None` where friction and e are constant, the contact is rigid and the balls are equal.
    ///
    /// # Errors
    /// As [`Model::collide`].
    pub fn collide_with_all(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<(Outcome, Jacobian, Option<ByOthers>), NotACollision> {
        if self.has_others() {
            let (outcome, jacobian, others) = self.compute_all(cue, coefficients)?;
            return Ok((outcome, jacobian, Some(others)));
        }
        let (outcome, jacobian) = self.collide_with_jacobian(cue, coefficients)?;
        Ok((outcome, jacobian, None))
    }

    /// The outcome with all derivatives.
    pub(super) fn compute_all(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<(Outcome, Jacobian, ByOthers), NotACollision> {
        let (outcome, by) = self.differentiated::<{ Input::COUNT }>(cue, coefficients)?;
        let [first, others] = [0, Input::FIRST];
        Ok((outcome, by.fixed_columns(first).into_owned(), by.fixed_columns(others).into_owned()))
    }

    /// Whether there is more than the coefficients that outcomes depend on.
    #[inline]
    pub(crate) fn has_others(&self) -> bool {
        self.law != Law::Constant || self.object.is_some() || self.e_slope.is_some() || self.is_compliant()
    }

    /// Whether the contact is resolved in time.
    fn is_resolved(&self) -> bool {
        self.fidelity == Fidelity::Contact || self.fidelity == Fidelity::Ode && self.is_compliant()
    }

    /// The derivatives by the first N inputs.
    fn differentiated<const N: usize>(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<(Outcome, SMatrix<f64, 12, N>), NotACollision> {
        let values = self.validated(cue, coefficients)?;
        if self.is_resolved() {
            return self.followed(&values);
        }
        let dual: Values<Dual<N>> = values.with_derivatives(self);
        let dual_impact = Impact::new(&dual, self);
        let impact = Impact::new(&values, self);
        let (real, regime, impulses) = match self.fidelity {
            Fidelity::Full | Fidelity::Ode => {
                let (impulses, end) = sliding::solve(&impact);
                let with_derivatives = sliding::differentiate(&dual_impact, &end);
                // the same equations, with values to the tolerance
                let integrated = self.fidelity == Fidelity::Ode;
                let (real, regime) =
                    if integrated { self.integrated(&impact)? } else { (impulses, end.regime()) };
                (real, regime, with_derivatives)
            }
            _ => {
                let (real, regime) = simple::impulses(&impact);
                (real, regime, simple::impulses(&dual_impact).0)
            }
        };
        let by = derivatives(&components(&dual, self, &impulses));
        Ok((Outcome::new(regime, real.q, &components(&values, self, &real)), by))
    }

    #[cold]
    #[inline(never)]
    fn integrated(&self, impact: &Impact<f64>) -> Result<(Impulses<f64>, Regime), NotACollision> {
        ode::impulses(impact, self.tolerance).map_err(|_| NotACollision::NotIntegrated(self.tolerance))
    }

    #[cold]
    #[inline(never)]
    fn resolved(&self, values: &Values<f64>) -> Result<contact::Solved, NotACollision> {
        contact::solve(values, self).map_err(|_| match self.kappa {
            kappa if kappa < contact::STIFF => NotACollision::TooStiff(kappa),
            _ => NotACollision::NotIntegrated(self.tolerance),
        })
    }

    /// Differences of the recorded integration, followed with each input changed a little.
    fn followed<const N: usize>(
        &self,
        values: &Values<f64>,
    ) -> Result<(Outcome, SMatrix<f64, 12, N>), NotACollision> {
        let mut solved = self.resolved(values)?;
        let (outcome, mut values) = (solved.outcome, *values);
        let (k, radius) = (values[Input::VelocityX], self.ball.radius);
        let least = LEAST_E - (values[Input::E] - values[Input::ESlope] * k);
        if least > 0.0 && self.effects.inelasticity {
            values = values.moved(Input::E, least);
            solved = self.resolved(&values)?;
        }
        let here = SVector::from(solved.beside(&values, self));
        let column = |input: Input| {
            let step = match input {
                Input::VelocityX | Input::VelocityY => STEP * k,
                Input::SpinX | Input::SpinY | Input::SpinZ => STEP * k / radius,
                Input::Kappa => STEP * self.kappa,
                _ => STEP,
            };
            (SVector::from(solved.beside(&values.moved(input, step), self)) - here) / step
        };
        let kept = |row: usize| SVector::<f64, 12>::from_fn(|i, _| f64::from(i == row));
        // without the cloth on the cue ball, only U_y + Rω_z counts and no spin about the line of centres
        let plain = self.fidelity == Fidelity::Ode;
        let mut by = SMatrix::<f64, 12, N>::zeros();
        for (i, input) in Input::ALL.into_iter().enumerate().take(N) {
            if Values::is_off(input, self) {
                continue;
            }
            let found = match input {
                Input::SpinX if plain => kept(3),
                Input::SpinZ if plain => radius * (by.column(Input::VelocityY as usize) - kept(1)) + kept(5),
                // e = e₀ − e₁k
                Input::ESlope => -k * by.column(Input::E as usize),
                Input::B | Input::C if self.law == Law::Constant => continue,
                Input::MassRatio | Input::RadiusRatio if self.object.is_none() => continue,
                _ => column(input),
            };
            by.set_column(i, &found);
        }
        Ok((outcome, by))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::ball::Vec3;

    /// Two rotations of components of some 50.
    const ROUNDING: f64 = 1e-13;

    const COEFFICIENTS: Coefficients = Coefficients { mu: 0.05, mu_s: 0.3, e: 0.94 };

    #[test]
    fn a_table_that_is_turned_turns_what_comes_out() {
        let model = Model::new(Fidelity::Full, Ball::POOL);
        let cue = BallState { velocity: Vec3::new(1.7, 1.0, 0.0), spin: Vec3::new(-20.0, 50.0, 8.0) };
        let straight = model.collide(&cue, &COEFFICIENTS).unwrap();
        for direction in [0.3_f64, 2.0, -1.2] {
            let frame = CollisionFrame::from_direction(direction);
            let cue = BallState { velocity: frame.to_table(cue.velocity), spin: frame.to_table(cue.spin) };
            // of any length
            let line = [3.0 * direction.cos(), 3.0 * direction.sin()];
            let turned = model.collide_on_table(line, &cue, &COEFFICIENTS).unwrap();
            for (on_table, own) in [(turned.cue, straight.cue), (turned.object, straight.object)] {
                assert!((frame.to_collision(on_table.velocity) - own.velocity).amax() < ROUNDING);
                assert!((frame.to_collision(on_table.spin) - own.spin).amax() < 50.0 * ROUNDING);
            }
            assert_eq!(turned.regime, straight.regime);
        }
    }

    #[test]
    fn a_line_without_direction_is_no_collision() {
        let model = Model::new(Fidelity::Full, Ball::POOL);
        let cue = BallState::stun(Vec3::new(1.0, 0.0, 0.0));
        for line in [[0.0, 0.0], [f64::NAN, 1.0], [f64::INFINITY, 0.0]] {
            let error = model.collide_on_table(line, &cue, &COEFFICIENTS).unwrap_err();
            assert!(error.to_string().contains("has no direction"), "{error}");
        }
        let away = model.collide_on_table([-1.0, 0.0], &cue, &COEFFICIENTS);
        assert_eq!(away, Err(NotACollision::NotApproaching(-1.0)));
    }
}
