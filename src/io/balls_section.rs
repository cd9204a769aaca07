//! The sections [ball] and [object] of a dataset.toml.

use std::fmt::Write as _;

use serde::Deserialize;
use toml::Spanned;

use super::toml_file::{Condition, POSITIVE, Source, bare};
use crate::measurement::dataset::{ObjectBall, StatedObject};
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
        let stated = StatedObject {
            radius_m: positive(&self.radius_m, "object.radius_m"),
            radius_m_sd: positive(&self.radius_m_sd, "object.radius_m_sd").unwrap_or(0.0),
            mass_kg: positive(&self.mass_kg, "object.mass_kg"),
            mass_kg_sd: positive(&self.mass_kg_sd, "object.mass_kg_sd").unwrap_or(0.0),
            inertia: positive(&self.inertia, "object.inertia"),
        };
        // what is wrong with the cue ball's own errors has been said with it
        let own = [&own.mass_kg_sd, &own.radius_m_sd].map(|sd| bare(sd).unwrap_or(0.0));
        let object = stated.beside(*cue, own);
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
        let both = [
            ("mass", format!("{:.3} kg", cue.mass), "mass_kg", &self.mass_kg, &own.mass_kg),
            ("radius", format!("{} m", cue.radius), "radius_m", &self.radius_m, &own.radius_m),
        ];
        let differ = both.into_iter().filter(|(.., other, own)| other.is_some() && own.is_none());
        let said = differ.map(|(what, value, key, ..)| {
            format!(
                "The cue ball's {what} was not stated; {value} was taken, against the object ball's of [object] {key}. If it differs, \
                 give [ball] {key}."
            )
        });
        said.collect()
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
        let (cue, _) = self.ball.check(source);
        if let Some(object) = &self.object {
            object.as_ref().ball(&self.ball, &cue, source);
        }
    }
}

/// Both balls, as [ball] and [object] of a dataset.toml that states them; with Poisson's ratio where that is stated.
pub(crate) fn text(cue: &Ball, object: Option<&ObjectBall>, poisson: Option<f64>) -> String {
    let of = |name: &str, ball: &Ball, mass_sd: f64, radius_sd: f64| {
        let Ball { radius, mass, inertia } = ball;
        let mut text = format!("[{name}]\nradius_m = {radius:?}\n");
        let mut add = |key: &str, value: f64| _ = writeln!(text, "{key} = {value:?}");
        if radius_sd > 0.0 {
            add("radius_m_sd", radius_sd);
        }
        add("mass_kg", *mass);
        if mass_sd > 0.0 {
            add("mass_kg_sd", mass_sd);
        }
        add("inertia", *inertia);
        text
    };
    let both = object.map_or([[0.0; 2]; 2], |object| [object.mass_sd, object.radius_sd]);
    let [mass_sd, radius_sd] = both;
    let mut text = of("ball", cue, mass_sd[0], radius_sd[0]);
    if let Some(poisson) = poisson {
        _ = writeln!(text, "poisson = {poisson:?}");
    }
    if let Some(object) = object {
        text += "\n";
        text += &of("object", &object.ball, mass_sd[1], radius_sd[1]);
    }
    text
}

/// What Poisson's ratio can be.
const ELASTIC: Condition = (|x| (0.0..=0.5).contains(&x), "Poisson's ratio, 0 to 0.5");

impl RawBall {
    /// The ball, and Poisson's ratio of what it is made of.
    pub(crate) fn check(&self, source: &Source) -> (Ball, f64) {
        let positive = |given: &Option<Spanned<f64>>, key: &str, default: f64| {
            source.number(given.as_ref(), key, default, POSITIVE)
        };
        let radius = positive(&self.radius_m, "radius_m", Ball::POOL.radius);
        let mass = positive(&self.mass_kg, "mass_kg", Ball::POOL.mass);
        let inertia = positive(&self.inertia, "inertia", UNIFORM_SPHERE);
        for (sd, key) in [(&self.radius_m_sd, "radius_m_sd"), (&self.mass_kg_sd, "mass_kg_sd")] {
            positive(sd, key, 0.0);
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
