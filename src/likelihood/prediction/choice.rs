//! What a shot is computed with: in the place of the fidelity and the effects of the model.

use super::start::Start;
use super::{Plan, Unpredictable};
use crate::measurement::dataset::Measurement;
use crate::measurement::observable::{Axis, Observable};
use crate::physics::collision::{Coefficients, Correction, Effects, Fidelity, Model};
use crate::physics::effect_sizes;
use crate::physics::effect_sizes::{Choice, Compared};

impl Plan {
    /// From now on computed at the cheapest fidelity, and with the effects, that keep within `part` of
    /// the smallest standard error of the observations, or of `otherwise` (in parts of the speed) where
    /// the data state none.
    ///
    /// # Errors
    /// As [`Plan::predict`].
    pub fn choose(
        &mut self,
        model: &Model,
        coefficients: &Coefficients,
        part: f64,
        otherwise: f64,
    ) -> Result<Choice, Unpredictable> {
        (self.choice, self.correction) = (None, None);
        let speed = self.predict(model, coefficients)?.speed;
        let start = Start::new(&self.state, speed, model.ball.radius);
        // an error of an angle is one of a velocity over the speed; the object ball is the slower the thinner
        let cos = start.cut.cos();
        let relative = |row: &Measurement| {
            let sd = row.measured.sd?;
            Some(match row.observable {
                Observable::CueSpin(_) | Observable::ObjectSpin(_) => sd * model.ball.radius / speed,
                Observable::ObjectSpeedRatio => sd,
                observable if observable.is_angle() => sd * cos,
                _ => sd / speed,
            })
        };
        let least = self.rows.iter().filter_map(relative).fold(f64::INFINITY, f64::min);
        let tolerance = if least.is_finite() { part * least } else { otherwise };
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
        let choice = effect_sizes::choose(model, &start.cue, coefficients, tolerance, compared)?;
        self.choice = Some((choice.fidelity, choice.effects));
        Ok(choice)
    }

    /// Takes anew what the integrated fidelity that was chosen adds to `full`, at these coefficients. Until then
    /// the shot is computed as with `full`.
    ///
    /// # Errors
    /// As [`Plan::predict`].
    pub fn correct(&mut self, model: &Model, coefficients: &Coefficients) -> Result<(), Unpredictable> {
        let Some((fidelity, effects)) = self.choice else { return Ok(()) };
        let model = Model { fidelity, effects, ..*model };
        if model.closed().is_some() {
            let cue = self.cue(&model, coefficients)?;
            self.correction = Correction::of(&model, &cue, coefficients)?.map(Box::new);
        }
        Ok(())
    }

    /// What was chosen for it.
    #[must_use]
    pub fn choice(&self) -> Option<(Fidelity, Effects)> {
        self.choice
    }

    /// In the place of an integrated fidelity that fails, `full`.
    pub fn settle_for_closed(&mut self, model: &Model) {
        self.correction = None;
        self.choice = self.choice.map(|(fidelity, effects)| {
            let chosen = Model { fidelity, effects, ..*model };
            chosen.closed().map_or((fidelity, effects), |closed| (closed.fidelity, closed.effects))
        });
    }

    /// From now on computed as the model says, whatever model it is later computed with.
    pub fn fix(&mut self, model: &Model) {
        (self.choice, self.correction) = (Some((model.fidelity, model.effects)), None);
    }

    /// As the model says, with nothing chosen.
    #[must_use]
    pub fn plain(&self) -> Self {
        Self { choice: None, correction: None, ..self.clone() }
    }

    /// Whether it is computed at an integrated fidelity by a correction.
    #[must_use]
    pub fn is_corrected(&self) -> bool {
        matches!(self.choice, Some((Fidelity::Ode | Fidelity::Contact, _)))
    }
}
