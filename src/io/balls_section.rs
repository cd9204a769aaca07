//! The sections [ball] and [object] of a dataset.toml.

use std::fmt::Write as _;

use serde::Deserialize;
use toml::Spanned;

use super::stated_object::StatedObject;
use super::toml_file::{Condition, NOT_NEGATIVE, POSITIVE, Source, bare};
use crate::measurement::dataset::{ObjectBall, UNWEIGHED, WEIGHED_KG};
use crate::measurement::number::plain;
use crate::physics::ball::{Ball, UNIFORM_SPHERE};
use crate::physics::collision::{MASS_RATIOS, POISSON};

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [ball] radius_m = 0.028575")]
pub(crate) struct RawBall {
    pub shape: Option<Spanned<Shape>>,
    pub radius_m: Option<Spanned<f64>>,
    pub radius_m_sd: Option<Spanned<f64>>,
    pub mass_kg: Option<Spanned<f64>>,
    pub mass_kg_sd: Option<Spanned<f64>>,
    pub inertia: Option<Spanned<f64>>,
    /// Poisson's ratio of the balls' material.
    pub poisson: Option<Spanned<f64>>,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Shape {
    #[default]
    Sphere,
    /// Slides without rolling.
    Disc,
}

/// What of the object ball, or of the second disc, is not as of the first.
#[derive(Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [object] mass_kg = 0.165")]
pub(crate) struct RawObject {
    pub radius_m: Option<Spanned<f64>>,
    pub radius_m_sd: Option<Spanned<f64>>,
    pub mass_kg: Option<Spanned<f64>>,
    pub mass_kg_sd: Option<Spanned<f64>>,
    pub inertia: Option<Spanned<f64>>,
}

impl RawObject {
    /// The object ball, where [object] says that it is not like the cue ball.
    pub(crate) fn ball(&self, own: &RawBall, cue: &Ball, source: &Source) -> ObjectBall {
        let positive = |given: &Option<Spanned<f64>>, key: &str| {
            given.as_ref().map(|given| source.number(Some(given), key, 0.0, POSITIVE))
        };
        let error = |given: &Option<Spanned<f64>>, key: &str, default: f64| {
            source.number(given.as_ref(), key, default, NOT_NEGATIVE)
        };
        let mass_kg = positive(&self.mass_kg, "object.mass_kg");
        let usual_sd = if mass_kg.is_some() { WEIGHED_KG } else { 0.0 };
        let mass_kg_sd = error(&self.mass_kg_sd, "object.mass_kg_sd", usual_sd);
        let stated = StatedObject {
            radius_m: positive(&self.radius_m, "object.radius_m"),
            radius_m_sd: error(&self.radius_m_sd, "object.radius_m_sd", 0.0),
            mass_kg: mass_kg.filter(|_| own.mass_kg.is_some()),
            mass_kg_sd: if own.mass_kg.is_some() { mass_kg_sd } else { 0.0 },
            inertia: positive(&self.inertia, "object.inertia"),
        };
        // what is wrong with the cue ball's own errors has been said with it
        let mass_sd = bare(&own.mass_kg_sd).unwrap_or(WEIGHED_KG);
        let radius_sd = bare(&own.radius_m_sd).unwrap_or(0.0);
        let object = stated.beside(*cue, [mass_sd, radius_sd]);
        inertia_is_possible(self.inertia.as_ref(), "object.inertia", false, source);
        let ratio = cue.mass / object.ball.mass;
        let is_positive = |x: f64| x > 0.0 && x.is_finite();
        if let Some(mass) =
            self.mass_kg.as_ref().filter(|_| is_positive(ratio) && !MASS_RATIOS.contains(&ratio))
        {
            let message = format!(
                "object.mass_kg is {}, which makes the cue ball ({} kg) {} times as heavy as the object ball; expected {} to {} times",
                source.written(&mass.span()),
                cue.mass,
                plain(ratio, 2),
                MASS_RATIOS.start(),
                MASS_RATIOS.end()
            );
            source.wrong(mass, message);
        }
        object
    }

    /// What of the cue ball was taken for granted that the object ball is compared with.
    pub(crate) fn taken(&self, own: &RawBall, cue: &Ball) -> Vec<String> {
        let mut said = Vec::new();
        if self.mass_kg.is_some() && own.mass_kg.is_none() {
            said.push(format!(
                "The cue ball's mass was not stated, so that [object] mass_kg says nothing of the ratio of the masses: 1 ± {UNWEIGHED} was \
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

/// Both sections of a file that has others.
#[derive(Deserialize)]
pub(crate) struct RawBalls {
    #[serde(default)]
    ball: RawBall,
    object: Option<Spanned<RawObject>>,
}

impl RawBalls {
    pub(crate) fn check(&self, source: &Source) {
        let (cue, _) = self.ball.check(self.object.as_ref().map(Spanned::as_ref), source);
        if let Some(object) = &self.object {
            object.as_ref().ball(&self.ball, &cue, source);
        }
    }
}

/// Both balls, as [ball] and [object] of a dataset.toml that states them; with Poisson's ratio where that is stated.
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
        // one mass alone says nothing of their ratio
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

/// What Poisson's ratio can be.
const ELASTIC: Condition = (|x| (0.0..=0.5).contains(&x), "Poisson's ratio, 0 to 0.5");

impl RawBall {
    /// The ball, and Poisson's ratio of its material. Where only the mass of the `object` ball is stated, both have this mass.
    pub(crate) fn check(&self, object: Option<&RawObject>, source: &Source) -> (Ball, f64) {
        let positive = |given: &Option<Spanned<f64>>, key: &str, default: f64| {
            source.number(given.as_ref(), key, default, POSITIVE)
        };
        let radius = positive(&self.radius_m, "radius_m", Ball::POOL.radius);
        let usual = object.and_then(|object| bare(&object.mass_kg)).filter(|mass| *mass > 0.0);
        let mass = positive(&self.mass_kg, "mass_kg", usual.unwrap_or(Ball::POOL.mass));
        let inertia = positive(&self.inertia, "inertia", UNIFORM_SPHERE);
        for (sd, key) in [(&self.radius_m_sd, "radius_m_sd"), (&self.mass_kg_sd, "mass_kg_sd")] {
            source.number(sd.as_ref(), key, 0.0, NOT_NEGATIVE);
        }
        let poisson = source.number(self.poisson.as_ref(), "poisson", POISSON, ELASTIC);
        let disc = bare(&self.shape) == Some(Shape::Disc);
        inertia_is_possible(self.inertia.as_ref(), "inertia", disc, source);
        (Ball { radius, mass, inertia }, poisson)
    }
}

/// Refuses what no body of this shape has.
fn inertia_is_possible(given: Option<&Spanned<f64>>, key: &str, disc: bool, source: &Source) {
    let (most, said) =
        if disc { (1.0, "1, that of a ring") } else { (2.0 / 3.0, "2/3, that of a hollow sphere") };
    let hollow = |value: &&Spanned<f64>| value.as_ref().is_finite() && *value.as_ref() > most;
    if let Some(value) = given.filter(hollow) {
        let text = source.written(&value.span());
        let message = format!("{key} is {text}; expected at most {said}");
        source.wrong(value, message);
    }
}
