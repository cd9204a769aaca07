//! The sections `[ball]` and `[object]` of a dataset.toml or a SPEC.toml.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::toml_file::Source;
use crate::measurement::dataset::{ObjectBall, UNWEIGHED, WEIGHED_KG};
use crate::measurement::fault::{Condition, INERTIA, NOT_NEGATIVE, POSITIVE};
use crate::measurement::number::plain;
use crate::physics::ball::{Ball, UNIFORM_SPHERE};
use crate::physics::collision::{MASS_RATIOS, POISSON};

/// The moment of inertia of a disc over MR².
const DISC_INERTIA: Condition = (|x| x > 0.0 && x <= 1.0, "more than 0, at most 1 (a ring)");

const ELASTIC: Condition = (|x| (0.0..=0.5).contains(&x), "Poisson's ratio, 0 to 0.5");

/// The cue ball, and the object ball unless it differs: section `[ball]`.
#[derive(Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table, as in [ball] radius_m = 0.028575")]
pub(crate) struct BallSection {
    #[serde(skip_serializing)]
    pub(crate) shape: Shape,
    pub(crate) radius_m: Option<f64>,
    pub(crate) radius_m_sd: Option<f64>,
    pub(crate) mass_kg: Option<f64>,
    pub(crate) mass_kg_sd: Option<f64>,
    pub(crate) inertia: Option<f64>,
    /// Poisson's ratio of the balls' material.
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

/// Properties of the object ball that differ from the cue ball's: section `[object]`.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default, expecting = "a table, as in [object] mass_kg = 0.165")]
pub(crate) struct StatedObject {
    /// Its radius, m; `None`: that of the cue ball.
    pub(crate) radius_m: Option<f64>,
    /// The standard deviation of its radius, m; 0: exact.
    pub(crate) radius_m_sd: f64,
    /// Its mass, kg; `None`: that of the cue ball.
    pub(crate) mass_kg: Option<f64>,
    /// The standard deviation of its mass, kg. `None`: exact in a SPEC.toml, that of a kitchen
    /// scale in a dataset.toml.
    pub(crate) mass_kg_sd: Option<f64>,
    /// Its moment of inertia over MR², ν; `None`: that of the cue ball.
    pub(crate) inertia: Option<f64>,
}

impl BallSection {
    /// Returns the ball, and Poisson's ratio of its material. If only the mass of `object` is
    /// stated, both balls have this mass.
    pub(crate) fn check(&self, object: Option<&StatedObject>, source: &Source) -> (Ball, f64) {
        let number = |key, given, condition| source.number(key, given, condition);
        number("ball.radius_m_sd", self.radius_m_sd, NOT_NEGATIVE);
        number("ball.mass_kg_sd", self.mass_kg_sd, NOT_NEGATIVE);
        let possible = if self.shape == Shape::Disc { DISC_INERTIA } else { INERTIA };
        let other_mass = object.and_then(|object| object.mass_kg).filter(|mass| *mass > 0.0);
        let mass = number("ball.mass_kg", self.mass_kg, POSITIVE).or(other_mass);
        let ball = Ball {
            radius: number("ball.radius_m", self.radius_m, POSITIVE).unwrap_or(Ball::POOL.radius),
            mass: mass.unwrap_or(Ball::POOL.mass),
            inertia: number("ball.inertia", self.inertia, possible).unwrap_or(UNIFORM_SPHERE),
        };
        (ball, number("ball.poisson", self.poisson, ELASTIC).unwrap_or(POISSON))
    }
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

    /// Returns the checked object ball beside the cue ball of `[ball]`; a mass without an error is
    /// from a kitchen scale.
    pub(crate) fn check(&self, own: &BallSection, cue: &Ball, source: &Source) -> ObjectBall {
        source.number("object.radius_m", self.radius_m, POSITIVE);
        source.number("object.radius_m_sd", Some(self.radius_m_sd), NOT_NEGATIVE);
        source.number("object.mass_kg", self.mass_kg, POSITIVE);
        source.number("object.mass_kg_sd", self.mass_kg_sd, NOT_NEGATIVE);
        source.number("object.inertia", self.inertia, INERTIA);
        // one mass alone does not determine the ratio of the masses
        let mass_kg = self.mass_kg.filter(|_| own.mass_kg.is_some());
        let mass_kg_sd = self.mass_kg_sd.or(self.mass_kg.map(|_| WEIGHED_KG));
        let mass_kg_sd = mass_kg_sd.filter(|_| own.mass_kg.is_some());
        let sds = [own.mass_kg_sd.unwrap_or(WEIGHED_KG), own.radius_m_sd.unwrap_or(0.0)];
        let object = Self { mass_kg, mass_kg_sd, ..*self }.beside(*cue, sds);
        let ratio = cue.mass / object.ball.mass;
        if mass_kg.is_some() && ratio > 0.0 && ratio.is_finite() && !MASS_RATIOS.contains(&ratio) {
            let message = format!(
                "object.mass_kg is {}, which makes the cue ball ({} kg) {} times as heavy as the object ball; expected {} to {} times",
                source.written("object.mass_kg").unwrap_or_default(),
                cue.mass,
                plain(ratio, 2),
                MASS_RATIOS.start(),
                MASS_RATIOS.end()
            );
            source.wrong("object.mass_kg", message);
        }
        object
    }

    /// Returns notes on the cue ball's properties that were assumed for want of a statement.
    pub(crate) fn taken(&self, own: &BallSection, cue: &Ball) -> Vec<String> {
        let mut said = Vec::new();
        if self.mass_kg.is_some() && own.mass_kg.is_none() {
            said.push(format!(
                "The cue ball's mass was not stated, so that [object] mass_kg does not determine the ratio of the masses: 1 ± {UNWEIGHED} was \
                 taken. Weigh the cue ball, too, and give [ball] mass_kg."
            ));
        }
        if self.radius_m.is_some() && own.radius_m.is_none() {
            said.push(format!(
                "The cue ball's radius was not stated; {} m was taken, against the object ball's of [object] radius_m. If it differs, \
                 give [ball] radius_m.",
                cue.radius
            ));
        }
        said
    }
}

/// Returns the sections `[ball]` and `[object]`, with Poisson's ratio if it is stated.
pub(crate) fn text(cue: &Ball, object: Option<&ObjectBall>, poisson: Option<f64>) -> String {
    #[derive(Serialize)]
    struct Balls {
        ball: BallSection,
        object: Option<BallSection>,
    }
    let mass_sd = object.and_then(|object| object.mass_sd);
    let radius_sd = object.map_or([0.0; 2], |object| object.radius_sd);
    let section = |ball: &Ball, which: usize| BallSection {
        shape: Shape::Sphere,
        radius_m: Some(ball.radius),
        radius_m_sd: Some(radius_sd[which]).filter(|sd| *sd > 0.0),
        // one mass alone does not determine the ratio of the masses
        mass_kg: Some(ball.mass).filter(|_| which == 0 || mass_sd.is_some()),
        mass_kg_sd: mass_sd.map(|sd| sd[which]),
        inertia: Some(ball.inertia),
        poisson: poisson.filter(|_| which == 0),
    };
    let balls = Balls { ball: section(cue, 0), object: object.map(|object| section(&object.ball, 1)) };
    toml::to_string(&balls).unwrap_or_default()
}
