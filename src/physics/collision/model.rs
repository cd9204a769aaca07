//! The methods of a model.

use super::impact::{DIFFERENTIATED, Impact, Values, complete, components};
use super::{
    Coefficients, Effects, Fidelity, Input, Jacobian, MASS_RATIOS, MAX_KAPPA, Model, NotACollision, Outcome,
    SPEEDS, TOLERANCES, integrator, kappa, simple,
    sliding::{self, Ways},
};
use crate::physics::ball::{Ball, BallState, HOLLOW_SPHERE};
use crate::physics::cloth_motion::Cloth;
use crate::physics::contact_frame::CollisionFrame;
use crate::physics::friction_law::Law;

impl Model {
    /// The default of [`Model::contact_time`], s: within 250 to 300 µs (Kim 2024, below Eq. 37).
    pub const CONTACT_TIME: f64 = 280e-6;

    /// The default of [`Model::tolerance`], about six digits above rounding errors.
    pub const TOLERANCE: f64 = 1e-10;

    /// The tolerance that fits use, far below any error of measurement.
    pub const TOLERANCE_OF_FITS: f64 = 1e-6;

    /// The tangential compliance κ of phenolic resin, whose Poisson's ratio is 0.34 ([`kappa`]).
    pub const KAPPA: f64 = kappa(0.34);

    /// Returns a model of equal balls with constant friction and restitution and all effects of the
    /// fidelity, rigid along the surface but for `contact`, whose κ is that of phenolic resin.
    pub fn new(fidelity: Fidelity, ball: Ball) -> Self {
        Self {
            fidelity,
            ball,
            object: None,
            as_printed: false,
            effects: Effects::ALL,
            law: Law::Constant,
            e_slope: None,
            kappa: if fidelity == Fidelity::Contact { Self::KAPPA } else { 0.0 },
            tolerance: Self::TOLERANCE,
            mu_k: Cloth::default().sliding,
            contact_time: Self::CONTACT_TIME,
        }
    }

    /// Returns m_cue/m_object.
    #[inline]
    pub fn mass_ratio(&self) -> f64 {
        self.ball.mass / self.object_ball().mass
    }

    /// Returns the object ball, which is like the cue ball unless stated otherwise.
    #[inline]
    pub fn object_ball(&self) -> Ball {
        self.object.unwrap_or(self.ball)
    }

    /// Returns the model with the mass of the object ball at which m_cue/m_object is `ratio`.
    #[must_use]
    pub fn with_mass_ratio(self, ratio: f64) -> Self {
        let object = Ball { mass: self.ball.mass / ratio, ..self.object_ball() };
        Self { object: Some(object), ..self }
    }

    /// Returns R_cue/R_object.
    pub fn radius_ratio(&self) -> f64 {
        self.ball.radius / self.object_ball().radius
    }

    /// Returns whether the contact is compliant along the surface.
    pub fn is_compliant(&self) -> bool {
        self.effects.and(self.fidelity.effects()).compliance && self.kappa != 0.0
    }

    /// Returns the model with a compliant contact, integrated as closely as fits need it, and with
    /// the other effects of the closed form.
    #[must_use]
    pub fn giving_way(self, kappa: f64) -> Self {
        let effects = Effects { compliance: true, ..Fidelity::Full.effects() };
        Self { fidelity: Fidelity::Ode, effects, kappa, tolerance: Self::TOLERANCE_OF_FITS, ..self }
    }

    /// Returns the model in closed form, [`Fidelity::Full`]; `None` if it is not integrated.
    pub fn closed(&self) -> Option<Self> {
        let effects = self.effects.and(Fidelity::Full.effects());
        self.fidelity.is_integrated().then_some(Self { fidelity: Fidelity::Full, effects, ..*self })
    }

    /// Returns the model with the κ of phenolic resin if it is `contact` and κ is 0.
    pub(crate) fn with_some_compliance(self) -> Self {
        let is_rigid = self.fidelity == Fidelity::Contact && self.kappa == 0.0;
        Self { kappa: if is_rigid { Self::KAPPA } else { self.kappa }, ..self }
    }

    /// Returns 1/ν of the cue ball and of the object ball.
    #[inline(always)]
    pub(super) fn per_inertia(&self) -> [f64; 2] {
        [1.0 / self.ball.inertia, 1.0 / self.object_ball().inertia]
    }

    /// Returns σ in dΩ_y/dq = (μ/νR)(1 − σm_s) sin θ.
    #[inline]
    pub(super) fn torque_sign(&self) -> f64 {
        if self.as_printed { -1.0 } else { 1.0 }
    }

    /// Returns the outcome of a collision in the frame of the collision (Kim 2024, Eqs. 42–49).
    ///
    /// # Errors
    /// Input that describes no collision: balls that do not approach, coefficients out of range, a
    /// vertical velocity, anything not finite; and an integration that takes too many steps.
    pub fn collide(&self, cue: &BallState, coefficients: &Coefficients) -> Result<Outcome, NotACollision> {
        let values = Values::new(self, cue, coefficients);
        self.validate(cue, coefficients, &values)?;
        if self.fidelity.is_integrated() {
            return integrator::solve(&values, self).map(|(outcome, _)| outcome);
        }
        Ok(self.solve(&values).0)
    }

    /// Returns the outcome in closed form, and the way to it.
    #[inline(always)]
    fn solve(&self, values: &Values<f64>) -> (Outcome, Ways) {
        let impact = Impact::new(values, self);
        let (impulses, regime, ways) =
            if self.fidelity.effects().stick { sliding::solve(&impact) } else { simple::impulses(&impact) };
        (Outcome::new(regime, values, self, &impact.impulses(values, impulses)), ways)
    }

    /// Returns the outcome as [`Model::collide`], with the cue ball and the outcome in the frame of
    /// the table, z up. The line of centres leads from the cue ball to the object ball, which is at
    /// rest; it has any length, as the difference of the positions.
    ///
    /// # Errors
    /// Those of [`Model::collide`]; also a line of centres without a direction.
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

    /// Returns the outcome and its derivatives: exact in closed form and for a rigid contact, of a
    /// compliant one to about 1e-6. At a transition (stick setting in, topspin turning to draw)
    /// they are those of the side that the outcome is on; those by inputs without effect are 0.
    ///
    /// # Errors
    /// Those of [`Model::collide`].
    pub fn collide_with_jacobian(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<(Outcome, Jacobian), NotACollision> {
        let values = Values::new(self, cue, coefficients);
        self.validate(cue, coefficients, &values)?;
        if self.fidelity == Fidelity::Contact || self.is_compliant() {
            return integrator::differentiate(&values, self);
        }
        let (closed, ways) = self.solve(&values);
        let by = match self.law {
            Law::Exponential { .. } => self.differentiate::<10>(&values, ways),
            Law::Constant if self.object.is_some() => self.differentiate::<8>(&values, ways),
            Law::Constant => self.differentiate::<6>(&values, ways),
        };
        // the outcome of ode has its tolerance, its derivatives are those of the same equations
        let outcome = match self.fidelity {
            Fidelity::Ode => integrator::solve(&values, self)?.0,
            _ => closed,
        };
        Ok((outcome, by))
    }

    /// Returns the derivatives in closed form, from the way to the outcome.
    fn differentiate<const N: usize>(&self, values: &Values<f64>, ways: Ways) -> Jacobian {
        let dual = values.with_derivatives::<N>(self);
        let impact = Impact::new(&dual, self);
        let impulses = if self.fidelity.effects().stick {
            sliding::differentiate(&impact, ways)
        } else {
            simple::impulses(&impact).0
        };
        let components = components(&dual, self, &impact.impulses(&dual, impulses));
        let mut by = Jacobian::zeros();
        for (row, component) in components.iter().enumerate() {
            for (input, slope) in DIFFERENTIATED.into_iter().zip(component.eps.0.iter().flatten()) {
                by[(row, input as usize)] = *slope;
            }
        }
        complete(&mut by, values, self, true);
        by
    }

    /// Checks a shot and its values: the only validation of input.
    #[inline(always)]
    pub(super) fn validate(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
        values: &Values<f64>,
    ) -> Result<(), NotACollision> {
        let &Coefficients { mu, mu_s, e } = coefficients;
        let ratio = self.mass_ratio();
        let mut most_mu_s = 2.0 + self.ball.inertia;
        for Ball { radius, mass, inertia } in [Some(self.ball), self.object].into_iter().flatten() {
            within(radius > 0.0 && radius.is_finite(), "radius_m", radius, "more than 0")?;
            within(mass > 0.0 && mass.is_finite(), "mass_kg", mass, "more than 0")?;
            let range = "more than 0, at most 2/3 of MR² (a hollow sphere)";
            within(inertia > 0.0 && inertia <= HOLLOW_SPHERE, "inertia", inertia, range)?;
        }
        if let Some(object) = &self.object {
            within(MASS_RATIOS.contains(&ratio), "mass_ratio", ratio, "0.001 to 1000")?;
            within(!self.as_printed, "mass_ratio", ratio, "equal balls for the equations as printed")?;
            // 2β_z = (1 + 1/ν_c)/r + (1 − μ_s)/ν must stay positive, or the cloth would drive the
            // slip that it brakes
            most_mu_s = 1.0 + object.inertia * (1.0 + 1.0 / self.ball.inertia) / ratio;
        }
        within((0.0..f64::INFINITY).contains(&mu), "mu", mu, "a finite number of 0 or more")?;
        if !(0.0..most_mu_s).contains(&mu_s) {
            return Err(NotACollision::MuSOutOfRange(mu_s, most_mu_s));
        }
        within((0.0..=1.0).contains(&e), "e", e, "0 to 1")?;
        if let Law::Exponential { b, c } = self.law {
            within(b.is_finite() && mu + b >= 0.0, "mu_b", b, "a finite number of -mu or more")?;
            within((0.0..f64::INFINITY).contains(&c), "mu_c", c, "a finite number of 0 or more")?;
        }
        check_motion(cue, self.ball.radius)?;
        let largest = values[Input::Mu] + values[Input::B].max(0.0);
        // dv_x/dq = 1 + 1/r + μ_s μ sin θ must stay positive at every θ
        let (product, most) = (largest * values[Input::MuS], 1.0 + 1.0 / ratio);
        // the friction of a compliant contact may turn and press the object ball down
        if product >= most && (cue.spin.y > 0.0 || self.kappa > 0.0) {
            return Err(NotACollision::Jams(product, most));
        }
        if self.fidelity.is_integrated() {
            self.check_integrated(largest)?;
        }
        Ok(())
    }

    /// Checks what only integrated fidelities use.
    fn check_integrated(&self, largest_mu: f64) -> Result<(), NotACollision> {
        let &Self { tolerance, mu_k, kappa, contact_time, .. } = self;
        within(TOLERANCES.contains(&tolerance), "tolerance", tolerance, "1e-12 to 1e-2")?;
        let holds = mu_k >= 0.0 && largest_mu * mu_k < 1.0 + self.mass_ratio();
        // with draw, the cloth on the cue ball drives the balls against each other
        within(
            holds,
            "mu_k",
            mu_k,
            "0 or more, and mu·mu_k less than 1 + cue ball's mass over object ball's",
        )?;
        within((0.0..=MAX_KAPPA).contains(&kappa), "kappa", kappa, "0 (rigid along the surface) to 100")?;
        let finite = contact_time > 0.0 && contact_time.is_finite();
        within(finite, "contact_time_s", contact_time, "more than 0")?;
        let is_rigid = self.fidelity == Fidelity::Contact && kappa == 0.0;
        within(!is_rigid, "kappa", kappa, "more than 0 with contact; full is rigid along the surface")
    }
}

#[inline(always)]
fn within(valid: bool, name: &'static str, value: f64, expected: &'static str) -> Result<(), NotACollision> {
    if valid { Ok(()) } else { Err(NotACollision::OutOfRange { name, value, expected }) }
}

/// Checks that the cue ball moves along the cloth towards the object ball.
#[inline(always)]
fn check_motion(cue: &BallState, radius: f64) -> Result<(), NotACollision> {
    let BallState { velocity: v, spin } = cue;
    let names = ["velocity_x", "velocity_y", "velocity_z", "omega_x", "omega_y", "omega_z"];
    for (name, value) in names.into_iter().zip([v.x, v.y, v.z, spin.x, spin.y, spin.z]) {
        within(value.is_finite(), name, value, "a finite number")?;
    }
    within(v.z == 0.0, "velocity_z", v.z, "0: a ball that stays on the cloth")?;
    if v.x <= 0.0 {
        return Err(NotACollision::NotApproaching(v.x));
    }
    let fastest = v.x.max(v.y.abs());
    let surface = radius * spin.y.abs().max(spin.z.abs());
    let speed = if fastest < *SPEEDS.start() { fastest } else { fastest.max(surface) };
    let range = "1e-9 to 1e9 m/s, also of the surface";
    within(SPEEDS.contains(&speed), "speed_m_s", speed, range)
}
