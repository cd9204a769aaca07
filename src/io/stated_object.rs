//! The object ball of `[object]` in a dataset.toml or a SPEC.toml.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::measurement::dataset::ObjectBall;
use crate::physics::ball::Ball;

/// Properties of the object ball that differ from the cue ball's: section `[object]`.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default, expecting = "a table, as in [object] mass_kg = 0.165")]
pub struct StatedObject {
    /// Its radius, m; `None`: that of the cue ball.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_m: Option<f64>,
    /// The standard deviation of its radius, m; 0: exact.
    pub radius_m_sd: f64,
    /// Its mass, kg; `None`: that of the cue ball.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass_kg: Option<f64>,
    /// The standard deviation of its mass, kg. `None`: exact in a SPEC.toml, that of a kitchen
    /// scale in a dataset.toml.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass_kg_sd: Option<f64>,
    /// Its moment of inertia over MR², ν; `None`: that of the cue ball.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inertia: Option<f64>,
}

impl StatedObject {
    /// Returns the object ball beside a cue ball whose mass and radius have these standard
    /// deviations. A radius that is not stated is the cue ball's, with its error, which then
    /// cancels; a mass without value and error is unknown.
    #[must_use]
    pub fn beside(&self, cue: Ball, [mass_sd, radius_sd]: [f64; 2]) -> ObjectBall {
        let own_sd = self.mass_kg_sd.unwrap_or(0.0);
        let is_stated = self.mass_kg.is_some() || own_sd > 0.0;
        ObjectBall {
            ball: Ball {
                radius: self.radius_m.unwrap_or(cue.radius),
                mass: self.mass_kg.unwrap_or(cue.mass),
                inertia: self.inertia.unwrap_or(cue.inertia),
            },
            mass_sd: is_stated.then(|| [self.mass_kg.map_or(0.0, |_| mass_sd), own_sd]),
            radius_sd: [self.radius_m.map_or(0.0, |_| radius_sd), self.radius_m_sd],
        }
    }
}
