//! An object ball that is not like the cue ball, and how well that is known.

use serde::{Deserialize, Serialize};

use super::parameter::{Parameter, Prior, Settings};
use crate::physics::ball::Ball;
use crate::physics::collision::{Fidelity, Model};

/// An object ball that is not like the cue ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectBall {
    /// Its radius, mass and moment of inertia.
    pub ball: Ball,
    /// The standard deviations of the cue ball's and of its own mass, kg; 0 for a mass that is exact, or whose error both balls share.
    pub mass_sd: [f64; 2],
    /// The standard deviations of the cue ball's and of its own radius, m; 0 as of the masses.
    pub radius_sd: [f64; 2],
}

/// What of the object ball is stated apart from the cue ball: `[object]` of a dataset.toml and of a SPEC.toml.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct StatedObject {
    /// Its radius, m; `None`: that of the cue ball.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_m: Option<f64>,
    /// The standard deviation of its radius, m; 0: exact.
    pub radius_m_sd: f64,
    /// Its mass, kg; `None`: that of the cue ball.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass_kg: Option<f64>,
    /// The standard deviation of its mass, kg; 0: exact.
    pub mass_kg_sd: f64,
    /// Its moment of inertia over MR², ν; `None`: that of the cue ball.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inertia: Option<f64>,
}

impl StatedObject {
    /// The object ball beside a cue ball whose mass and radius have these standard deviations. An error counts for the ball beside
    /// which it stands; what is the same of both balls cancels, with its error.
    #[must_use]
    pub fn beside(&self, cue: Ball, [mass_sd, radius_sd]: [f64; 2]) -> ObjectBall {
        let counts = |sd: f64, stated: Option<f64>| if stated.is_some() { sd } else { 0.0 };
        ObjectBall {
            ball: Ball {
                radius: self.radius_m.unwrap_or(cue.radius),
                mass: self.mass_kg.unwrap_or(cue.mass),
                inertia: self.inertia.unwrap_or(cue.inertia),
            },
            mass_sd: [counts(mass_sd, self.mass_kg), self.mass_kg_sd],
            radius_sd: [counts(radius_sd, self.radius_m), self.radius_m_sd],
        }
    }
}

impl ObjectBall {
    /// An object ball whose properties are exact.
    #[must_use]
    pub fn exact(ball: Ball) -> Self {
        Self { ball, mass_sd: [0.0; 2], radius_sd: [0.0; 2] }
    }

    /// The standard deviation of m_cue/m_object; `None` where the ratio counts as exact.
    #[must_use]
    pub fn mass_ratio_sd(&self, cue: Ball) -> Option<f64> {
        sd_of_ratio([cue.mass, self.ball.mass], self.mass_sd)
    }

    /// The standard deviation of R_cue/R_object; `None` where the ratio counts as exact.
    #[must_use]
    pub fn radius_ratio_sd(&self, cue: Ball) -> Option<f64> {
        sd_of_ratio([cue.radius, self.ball.radius], self.radius_sd)
    }

    /// The settings of a fit with the ratios of masses and radii of the balls: fixed where they are exact, else with a prior.
    #[must_use]
    pub fn settings(&self, cue: Ball, mut settings: Settings) -> Settings {
        let model = Model { object: Some(self.ball), ..Model::new(Fidelity::Full, cue) };
        for (parameter, mean, sd) in [
            (Parameter::MassRatio, model.mass_ratio(), self.mass_ratio_sd(cue)),
            (Parameter::RadiusRatio, model.radius_ratio(), self.radius_ratio_sd(cue)),
        ] {
            let setting = &mut settings[parameter];
            (setting.initial, setting.fixed) = (mean, sd.is_none());
            setting.prior = sd.map(|sd| Prior { mean, sd });
        }
        settings
    }
}

/// The standard deviation of the ratio of two values with these errors; `None` where both are exact.
fn sd_of_ratio([first, second]: [f64; 2], sd: [f64; 2]) -> Option<f64> {
    let sd = first / second * (sd[0] / first).hypot(sd[1] / second);
    (sd != 0.0).then_some(sd)
}
