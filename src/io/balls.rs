//! The sections `[ball]` and `[object]` of a dataset.toml or a SPEC.toml.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::measurement::dataset::{ObjectBall, WEIGHED_KG};
use crate::measurement::fault::{Condition, Fault};
use crate::measurement::number::plain;
use crate::physics::ball::Ball;
use crate::physics::collision::MASS_RATIOS;

/// `[object]`: what differs from the cue ball; or `[ball]` of a specification.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema)]
pub(crate) struct BallSection {
    #[schemars(range(max = 0.2), extend("exclusiveMinimum" = 0))]
    pub(crate) radius_m: Option<f64>,
    /// Standard deviation of the radius, m; `None`: exact.
    #[schemars(range(min = 0))]
    pub(crate) radius_m_sd: Option<f64>,
    #[schemars(range(max = 10), extend("exclusiveMinimum" = 0))]
    pub(crate) mass_kg: Option<f64>,
    /// Standard deviation of the mass, kg. `None`: exact in a SPEC.toml, else of a kitchen scale.
    #[schemars(range(min = 0))]
    pub(crate) mass_kg_sd: Option<f64>,
    /// Moment of inertia over MR², ν.
    pub(crate) inertia: Option<f64>,
}

/// `[ball]` of a dataset.toml: the cue ball, and properties of both.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema)]
pub(crate) struct CueSection {
    /// Shape of both.
    #[serde(default, skip_serializing)]
    pub(crate) shape: Shape,
    #[serde(flatten)]
    pub(crate) own: BallSection,
    /// Poisson's ratio of the material of both.
    #[schemars(range(min = 0, max = 0.5))]
    pub(crate) poisson: Option<f64>,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Shape {
    #[default]
    Sphere,
    /// Disc, which slides without rolling.
    Disc,
}

impl BallSection {
    /// Returns the ball, like another in all that is not stated.
    pub(crate) fn like(&self, other: Ball) -> Ball {
        Ball {
            radius: self.radius_m.unwrap_or(other.radius),
            mass: self.mass_kg.unwrap_or(other.mass),
            inertia: self.inertia.unwrap_or(other.inertia),
        }
    }

    /// Returns the cue ball. If only the mass of `object` is stated, it has this mass.
    pub(crate) fn cue(&self, object: Option<&Self>) -> Ball {
        let mass = object.and_then(|object| object.mass_kg).unwrap_or(Ball::POOL.mass);
        self.like(Ball { mass, ..Ball::POOL })
    }

    /// Returns the object ball beside a cue ball whose mass and radius have these standard
    /// deviations. A radius that is not stated is the cue ball's, with its error, which then
    /// cancels; a mass without value and error is unknown.
    pub(crate) fn beside(&self, cue: Ball, [mass_sd, radius_sd]: [f64; 2]) -> ObjectBall {
        let own_sd = self.mass_kg_sd.unwrap_or(0.0);
        let is_stated = self.mass_kg.is_some() || own_sd > 0.0;
        ObjectBall {
            ball: self.like(cue),
            mass_sd: is_stated.then(|| [self.mass_kg.map_or(0.0, |_| mass_sd), own_sd]),
            radius_sd: [self.radius_m.map_or(0.0, |_| radius_sd), self.radius_m_sd.unwrap_or(0.0)],
        }
    }

    /// Returns the object ball beside the cue ball of `[ball]`; a mass without an error is from a
    /// kitchen scale, and one mass alone does not determine the ratio of the masses.
    pub(crate) fn object(mut self, ball: &Self, cue: Ball) -> ObjectBall {
        self.mass_kg_sd = self.mass_kg_sd.or(self.mass_kg.map(|_| WEIGHED_KG));
        if ball.mass_kg.is_none() {
            (self.mass_kg, self.mass_kg_sd) = (None, None);
        }
        self.beside(cue, [ball.mass_kg_sd.unwrap_or(WEIGHED_KG), ball.radius_m_sd.unwrap_or(0.0)])
    }
}

/// Returns what is wrong beyond the schema with two balls or discs: a moment of inertia that does
/// not meet a condition, or masses of a ratio that no model computes.
pub(crate) fn faults(cue: Ball, object: Ball, inertia: Condition) -> Vec<Fault> {
    let inertias = [("ball.inertia", cue.inertia), ("object.inertia", object.inertia)];
    let inertia = inertias.into_iter().find_map(|(key, value)| Fault::of_number(key, value, inertia));
    let ratio = cue.mass / object.mass;
    let value = format!("{}, which makes the cue ball {} times as heavy", object.mass, plain(ratio, 2));
    let expected = format!("{} to {} times", MASS_RATIOS.start(), MASS_RATIOS.end());
    // a mass that is not positive is named by the schema
    let is_possible = !(ratio > 0.0 && ratio.is_finite()) || MASS_RATIOS.contains(&ratio);
    let ratio = (!is_possible).then(|| Fault::new("object.mass_kg", value, expected));
    inertia.into_iter().chain(ratio).collect()
}

/// Returns the sections `[ball]` and `[object]`, with Poisson's ratio if it is stated.
pub(crate) fn text(cue: &Ball, object: Option<&ObjectBall>, poisson: Option<f64>) -> String {
    #[derive(Serialize)]
    struct Balls {
        ball: CueSection,
        object: Option<BallSection>,
    }
    let mass_sd = object.and_then(|object| object.mass_sd);
    let radius_sd = object.map_or([0.0; 2], |object| object.radius_sd);
    let section = |ball: &Ball, which: usize| BallSection {
        radius_m: Some(ball.radius),
        radius_m_sd: Some(radius_sd[which]).filter(|sd| *sd > 0.0),
        // one mass alone does not determine the ratio of the masses
        mass_kg: Some(ball.mass).filter(|_| which == 0 || mass_sd.is_some()),
        mass_kg_sd: mass_sd.map(|sd| sd[which]),
        inertia: Some(ball.inertia),
    };
    let ball = CueSection { shape: Shape::Sphere, own: section(cue, 0), poisson };
    let balls = Balls { ball, object: object.map(|object| section(&object.ball, 1)) };
    toml::to_string(&balls).unwrap_or_default()
}
