//! What a shot is computed with: in the place of the fidelity and the effects of the model.

use super::start::Start;
use super::{Plan, Unpredictable};
use crate::likelihood::corrected::{Corrected, Correction};
use crate::measurement::dataset::Measurement;
use crate::measurement::observable::{Axis, Observable};
use crate::physics::collision::effects;
use crate::physics::collision::effects::Compared;
use crate::physics::collision::{Coefficients, Effects, Fidelity, Model};

/// A contact that gives way by more, in parts of the speed, is no correction of one that is rigid.
const DIRECT: f64 = 2e-3;

/// Of a shot's smallest standard error, what may be left out: squared it adds a hundredth.
const PART: f64 = 0.1;

/// Of the speed, where the data state no errors.
const OTHERWISE: f64 = 1e-4;

impl Plan {
    /// How the shot's collision is computed: as was chosen for it, or by the model.
    pub(crate) fn collision(&self, model: &Model) -> Corrected<'_> {
        let Some((fidelity, effects)) = self.choice else {
            return Corrected { model: *model, correction: None };
        };
        let base = self.base(&Model { fidelity, effects, ..*model });
        Corrected { model: base, correction: self.correction.as_deref() }
    }

    /// What is computed each time of a model that was chosen; the rest is a correction.
    fn base(&self, chosen: &Model) -> Model {
        if !self.is_direct {
            return chosen.closed().unwrap_or(*chosen);
        }
        Model {
            fidelity: Fidelity::Ode,
            effects: of_contact(chosen.effects),
            tolerance: chosen.tolerance.max(Model::TOLERANCE_OF_FITS),
            ..*chosen
        }
    }

    /// From now on computed at the cheapest fidelity, and with the effects, that keep within a part of the smallest standard error of the
    /// observations.
    pub(crate) fn choose(&mut self, model: &Model, coefficients: &Coefficients) -> Result<(), Unpredictable> {
        (self.choice, self.correction, self.is_direct) = (None, None, false);
        let speed = self.predict(model, coefficients)?.speed;
        let start = Start::new(&self.state, speed, model.ball.radius);
        // an error of an angle is one of a velocity over the speed; the object ball is the slower the thinner
        let cos = start.cut.cos();
        let relative = |row: &Measurement| {
            let sd = row.measured.sd?;
            Some(match row.observable {
                Observable::CueSpin(_) | Observable::ObjectSpin(_) => sd * model.ball.radius / speed,
                Observable::ObjectSpeedRatio | Observable::Restitution | Observable::ImpulseRatio => sd,
                observable if observable.is_angle() => sd * cos,
                _ => sd / speed,
            })
        };
        let least = self.rows.iter().filter_map(relative).fold(f64::INFINITY, f64::min);
        let tolerance = if least.is_finite() { PART * least } else { OTHERWISE };
        let vertical = |row: &Measurement| {
            matches!(
                row.observable,
                Observable::CueSpin(_)
                    | Observable::ObjectSpin(_)
                    | Observable::CueVelocity(Axis::Z)
                    | Observable::ObjectVelocity(Axis::Z)
                    | Observable::CueTurnRolling
                    | Observable::ObjectAngleRolling
                    | Observable::CueSpeedRolling
                    | Observable::ObjectSpeedRolling
            )
        };
        let everything = self.rows.iter().any(vertical);
        let compared = if everything { Compared::Everything } else { Compared::Velocities };
        let choice = effects::choose(model, &start.cue, coefficients, tolerance, compared)?;
        self.choice = Some((choice.fidelity, choice.effects));
        self.is_direct = choice
            .estimates
            .iter()
            .any(|effect| effect.name == "compliance" && effect.on && effect.size > DIRECT);
        Ok(())
    }

    /// Takes anew what the integrated fidelity that was chosen adds to `full`, at these coefficients. Until then
    /// the shot is computed as with `full`.
    pub(crate) fn correct(
        &mut self,
        model: &Model,
        coefficients: &Coefficients,
    ) -> Result<(), Unpredictable> {
        let Some((fidelity, effects)) = self.choice else { return Ok(()) };
        if self.is_corrected() {
            let model = Model { fidelity, effects, ..*model }.with_some_compliance();
            let cue = self.cue(&model, coefficients)?;
            let correction = Correction::of(&model, &self.base(&model), &cue, coefficients)?;
            self.correction = Some(Box::new(correction));
        }
        Ok(())
    }

    /// Whether its correction, if it has one, was taken so near that another would hardly differ.
    pub(crate) fn serves(&self, model: &Model, coefficients: &Coefficients) -> bool {
        self.correction.as_deref().is_none_or(|correction| correction.serves(model, coefficients))
    }

    /// What was chosen for it.
    pub(crate) fn choice(&self) -> Option<(Fidelity, Effects)> {
        self.choice
    }

    /// In the place of an integrated fidelity that fails, `full`.
    pub(crate) fn settle_for_closed(&mut self, model: &Model) {
        (self.correction, self.is_direct) = (None, false);
        self.choice = self.choice.map(|(fidelity, effects)| {
            let chosen = Model { fidelity, effects, ..*model };
            chosen.closed().map_or((fidelity, effects), |closed| (closed.fidelity, closed.effects))
        });
    }

    /// In the place of a fidelity with the balls' weight, `full`, or `ode` where the contact gives way.
    pub(crate) fn leave_out_weight(&mut self, model: &Model) {
        if !self.gives_way() {
            return self.settle_for_closed(model);
        }
        self.correction = None;
        self.choice = self.choice.map(|(_, effects)| (Fidelity::Ode, of_contact(effects)));
    }

    /// Whether it was chosen with more than [`Plan::leave_out_weight`] leaves.
    pub(crate) fn has_weight(&self) -> bool {
        self.choice.is_some_and(|(fidelity, _)| {
            fidelity == Fidelity::Contact || fidelity.is_integrated() && !self.gives_way()
        })
    }

    /// Whether it was chosen with a contact that gives way.
    pub(crate) fn gives_way(&self) -> bool {
        self.choice.is_some_and(|(fidelity, effects)| effects.and(fidelity.effects()).compliance)
    }

    /// Whether it is integrated whenever it is computed.
    pub(crate) fn is_direct(&self) -> bool {
        self.is_direct
    }

    /// A contact that gives way as a correction of a rigid one, however much it changes.
    pub(crate) fn correct_rigid(&mut self) {
        (self.is_direct, self.correction) = (false, None);
    }

    /// From now on computed as the model says, whatever model it is later computed with.
    pub(crate) fn fix(&mut self, model: &Model) {
        (self.choice, self.correction) = (Some((model.fidelity, model.effects)), None);
        self.is_direct = model.is_compliant();
    }

    /// As the model says, with nothing chosen.
    pub(crate) fn plain(&self) -> Self {
        Self { choice: None, correction: None, is_direct: false, ..self.clone() }
    }

    /// Whether it is computed at an integrated fidelity by a correction.
    pub(crate) fn is_corrected(&self) -> bool {
        self.choice.is_some_and(|(fidelity, effects)| {
            let is_base = self.is_direct && fidelity == Fidelity::Ode && effects == of_contact(effects);
            fidelity.is_integrated() && !is_base
        })
    }
}

/// What of the effects belongs to the contact between the balls that gives way.
fn of_contact(effects: Effects) -> Effects {
    let falling_friction = effects.falling_friction;
    Effects { compliance: true, falling_friction, ..effects.and(Fidelity::Full.effects()) }
}
