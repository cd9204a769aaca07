//! The sections `[ball]` and `[object]` of a dataset.toml or a SPEC.toml.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::toml_file::{Rule, Source};
use crate::measurement::dataset::{ObjectBall, WEIGHED_KG};
use crate::measurement::fault::{Condition, INERTIA, NOT_NEGATIVE, POSITIVE};
use crate::measurement::number::plain;
use crate::physics::ball::{Ball, UNIFORM_SPHERE};
use crate::physics::collision::MASS_RATIOS;

/// The moment of inertia of a disc over MR².
const DISC_INERTIA: Condition = (|x| x > 0.0 && x <= 1.0, "more than 0, at most 1 (a ring)");

const ELASTIC: Condition = (|x| (0.0..=0.5).contains(&x), "Poisson's ratio, 0 to 0.5");

const RULES: [Rule; 4] = [
    (POSITIVE, "ball.radius_m ball.mass_kg object.radius_m object.mass_kg"),
    (NOT_NEGATIVE, "ball.radius_m_sd ball.mass_kg_sd object.radius_m_sd object.mass_kg_sd"),
    (ELASTIC, "ball.poisson"),
    (INERTIA, "object.inertia"),
];

/// `[ball]`, the cue ball, or `[object]`, the properties of the object ball that differ from it.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table, as in [ball] radius_m = 0.028575")]
pub(crate) struct BallSection {
    /// Shape of both, in `[ball]` only.
    #[serde(skip_serializing)]
    pub(crate) shape: Shape,
    pub(crate) radius_m: Option<f64>,
    /// Standard deviation of the radius, m; `None`: exact.
    pub(crate) radius_m_sd: Option<f64>,
    pub(crate) mass_kg: Option<f64>,
    /// Standard deviation of the mass, kg. `None`: exact in a SPEC.toml, that of a kitchen scale in
    /// a dataset.toml.
    pub(crate) mass_kg_sd: Option<f64>,
    /// Moment of inertia over MR², ν.
    pub(crate) inertia: Option<f64>,
    /// Poisson's ratio of the material of both, in `[ball]` only.
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
    /// Returns the checked cue ball. If only the mass of `object` is stated, it has this mass.
    pub(crate) fn cue(&self, object: Option<&Self>, source: &Source) -> Ball {
        source.check(&RULES);
        let inertia = if self.shape == Shape::Disc { DISC_INERTIA } else { INERTIA };
        source.check(&[(inertia, "ball.inertia")]);
        source.check_together("object");
        let mass = self.mass_kg.or(object.and_then(|object| object.mass_kg).filter(|mass| *mass > 0.0));
        Ball {
            radius: self.radius_m.unwrap_or(Ball::POOL.radius),
            mass: mass.unwrap_or(Ball::POOL.mass),
            inertia: self.inertia.unwrap_or(UNIFORM_SPHERE),
        }
    }

    /// Returns the object ball beside a cue ball whose mass and radius have these standard
    /// deviations. A radius that is not stated is the cue ball's, with its error, which then
    /// cancels; a mass without value and error is unknown.
    pub(crate) fn beside(&self, cue: Ball, [mass_sd, radius_sd]: [f64; 2]) -> ObjectBall {
        let own_sd = self.mass_kg_sd.unwrap_or(0.0);
        let is_stated = self.mass_kg.is_some() || own_sd > 0.0;
        ObjectBall {
            ball: Ball {
                radius: self.radius_m.unwrap_or(cue.radius),
                mass: self.mass_kg.unwrap_or(cue.mass),
                inertia: self.inertia.unwrap_or(cue.inertia),
            },
            mass_sd: is_stated.then(|| [self.mass_kg.map_or(0.0, |_| mass_sd), own_sd]),
            radius_sd: [self.radius_m.map_or(0.0, |_| radius_sd), self.radius_m_sd.unwrap_or(0.0)],
        }
    }

    /// Returns the checked object ball beside the cue ball of `[ball]`; a mass without an error is
    /// from a kitchen scale, and one mass alone does not determine the ratio of the masses.
    pub(crate) fn object(mut self, ball: &Self, cue: Ball, source: &Source) -> ObjectBall {
        let written = source.written("object.mass_kg");
        self.mass_kg_sd = self.mass_kg_sd.or(self.mass_kg.map(|_| WEIGHED_KG));
        if ball.mass_kg.is_none() {
            (self.mass_kg, self.mass_kg_sd) = (None, None);
        }
        let sds = [ball.mass_kg_sd.unwrap_or(WEIGHED_KG), ball.radius_m_sd.unwrap_or(0.0)];
        let object = self.beside(cue, sds);
        let ratio = cue.mass / object.ball.mass;
        if ratio > 0.0 && ratio.is_finite() && !MASS_RATIOS.contains(&ratio) {
            let message = format!(
                "object.mass_kg is {written}, which makes the cue ball ({} kg) {} times as heavy as the object ball; expected {} to {} times",
                cue.mass,
                plain(ratio, 2),
                MASS_RATIOS.start(),
                MASS_RATIOS.end()
            );
            source.wrong("object.mass_kg", message);
        }
        object
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
