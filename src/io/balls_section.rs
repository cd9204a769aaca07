//! The sections [ball] and [object] of a dataset.toml.

use std::fmt::Write as _;

use schemars::JsonSchema;
use serde::Deserialize;

use super::stated_object::StatedObject;
use super::toml_file::Source;
use crate::measurement::dataset::{ObjectBall, UNWEIGHED, WEIGHED_KG};
use crate::measurement::number::plain;
use crate::measurement::valid::{Condition, INERTIA, NOT_NEGATIVE, POSITIVE};
use crate::physics::ball::{Ball, UNIFORM_SPHERE};
use crate::physics::collision::{MASS_RATIOS, POISSON};

#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table, as in [ball] radius_m = 0.028575")]
pub(crate) struct BallSection {
    pub shape: Shape,
    pub radius_m: Option<f64>,
    pub radius_m_sd: Option<f64>,
    pub mass_kg: Option<f64>,
    pub mass_kg_sd: Option<f64>,
    pub inertia: Option<f64>,
    /// Poisson's ratio of the balls' material.
    pub poisson: Option<f64>,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Shape {
    #[default]
    Sphere,
    /// Disc, which slides without rolling.
    Disc,
}

impl StatedObject {
    /// Returns the object ball of `[object]`; a mass without an error is from a kitchen scale.
    pub(crate) fn ball(&self, own: &BallSection, cue: &Ball, source: &Source) -> ObjectBall {
        for (key, given, condition) in [
            ("object.radius_m", self.radius_m, POSITIVE),
            ("object.radius_m_sd", Some(self.radius_m_sd), NOT_NEGATIVE),
            ("object.mass_kg", self.mass_kg, POSITIVE),
            ("object.mass_kg_sd", self.mass_kg_sd, NOT_NEGATIVE),
            ("object.inertia", self.inertia, INERTIA),
        ] {
            source.number(key, given, condition);
        }
        let mass_kg_sd = self.mass_kg_sd.or(self.mass_kg.map(|_| WEIGHED_KG));
        // one mass alone does not determine the ratio of the masses
        let [mass_kg, mass_kg_sd] =
            [self.mass_kg, mass_kg_sd].map(|given| given.filter(|_| own.mass_kg.is_some()));
        let mass_sd = own.mass_kg_sd.unwrap_or(WEIGHED_KG);
        let radius_sd = own.radius_m_sd.unwrap_or(0.0);
        let object = Self { mass_kg, mass_kg_sd, ..*self }.beside(*cue, [mass_sd, radius_sd]);
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

/// Returns the sections [ball] and [object], with Poisson's ratio if it is stated.
pub(crate) fn text(cue: &Ball, object: Option<&ObjectBall>, poisson: Option<f64>) -> String {
    let mass_sd = object.and_then(|object| object.mass_sd);
    let radius_sd = object.map_or([0.0; 2], |object| object.radius_sd);
    let of = |name: &str, ball: &Ball, which: usize| {
        let Ball { radius, mass, inertia } = ball;
        let mut text = format!("[{name}]\nradius_m = {radius:?}\n");
        let mut add = |key: &str, value: f64| _ = writeln!(text, "{key} = {value:?}");
        if radius_sd[which] > 0.0 {
            add("radius_m_sd", radius_sd[which]);
        }
        // one mass alone does not determine the ratio of the masses
        if which == 0 || mass_sd.is_some() {
            add("mass_kg", *mass);
        }
        if let Some(sd) = mass_sd {
            add("mass_kg_sd", sd[which]);
        }
        add("inertia", *inertia);
        text
    };
    let mut text = of("ball", cue, 0);
    if let Some(poisson) = poisson {
        _ = writeln!(text, "poisson = {poisson:?}");
    }
    if let Some(object) = object {
        text += "\n";
        text += &of("object", &object.ball, 1);
    }
    text
}

/// The moment of inertia of a disc over MR².
const DISC_INERTIA: Condition = (|x| x > 0.0 && x <= 1.0, "more than 0, at most 1 (a ring)");

const ELASTIC: Condition = (|x| (0.0..=0.5).contains(&x), "Poisson's ratio, 0 to 0.5");

impl BallSection {
    /// Returns the ball, and Poisson's ratio of its material. If only the mass of `object` is
    /// stated, both balls have this mass.
    pub(crate) fn check(&self, object: Option<&StatedObject>, source: &Source) -> (Ball, f64) {
        let number = |key, given, condition| source.number(key, given, condition);
        let radius = number("ball.radius_m", self.radius_m, POSITIVE).unwrap_or(Ball::POOL.radius);
        let usual = object.and_then(|object| object.mass_kg).filter(|mass| *mass > 0.0);
        let mass = number("ball.mass_kg", self.mass_kg, POSITIVE).or(usual).unwrap_or(Ball::POOL.mass);
        let possible = if self.shape == Shape::Disc { DISC_INERTIA } else { INERTIA };
        let inertia = number("ball.inertia", self.inertia, possible).unwrap_or(UNIFORM_SPHERE);
        number("ball.radius_m_sd", self.radius_m_sd, NOT_NEGATIVE);
        number("ball.mass_kg_sd", self.mass_kg_sd, NOT_NEGATIVE);
        let poisson = number("ball.poisson", self.poisson, ELASTIC).unwrap_or(POISSON);
        (Ball { radius, mass, inertia }, poisson)
    }
}
