//! The sections [ball] and [object] of a dataset.toml.

use serde::Deserialize;
use toml::Spanned;

use super::error::Problems;
use super::toml_file::{Check, Condition, POSITIVE, Source};
use crate::measurement::dataset::ObjectBall;
use crate::physics::ball::{Ball, UNIFORM_SPHERE};
use crate::physics::collision::POISSON;

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
    /// The object ball, where [object] says that it is not like the cue ball. An error counts for the ball beside which it stands;
    /// what is the same of both balls cancels, with its error.
    pub(crate) fn ball(
        &self,
        own: &RawBall,
        cue: &Ball,
        source: &Source,
        problems: &mut Problems,
    ) -> ObjectBall {
        let mut check = Check { source, problems };
        let mut positive = |given: &Option<Spanned<f64>>, key: &str, default: f64| {
            check.number(given.as_ref(), key, default, POSITIVE)
        };
        let ball = Ball {
            radius: positive(&self.radius_m, "object.radius_m", cue.radius),
            mass: positive(&self.mass_kg, "object.mass_kg", cue.mass),
            inertia: positive(&self.inertia, "object.inertia", cue.inertia),
        };
        let mut sd_of_ratio = |key: &str,
                               [first, second]: [f64; 2],
                               own: &Option<Spanned<f64>>,
                               other: &Option<Spanned<f64>>| {
            let own = positive(own, key, 0.0) / first;
            let other = positive(other, &format!("object.{key}"), 0.0) / second;
            let sd = first / second * own.hypot(other);
            (sd > 0.0).then_some(sd)
        };
        let masses = [cue.mass, ball.mass];
        let mass_ratio_sd = match self.mass_kg {
            Some(_) => sd_of_ratio("mass_kg_sd", masses, &own.mass_kg_sd, &self.mass_kg_sd),
            None => sd_of_ratio("mass_kg_sd", masses, &None, &self.mass_kg_sd),
        };
        let radii = [cue.radius, ball.radius];
        let radius_ratio_sd = match self.radius_m {
            Some(_) => sd_of_ratio("radius_m_sd", radii, &own.radius_m_sd, &self.radius_m_sd),
            None => sd_of_ratio("radius_m_sd", radii, &None, &self.radius_m_sd),
        };
        inertia_is_possible(self.inertia.as_ref(), "object.inertia", false, source, problems);
        ObjectBall { ball, mass_ratio_sd, radius_ratio_sd }
    }
}

/// What Poisson's ratio can be.
const ELASTIC: Condition = (|x| (0.0..=0.5).contains(&x), "Poisson's ratio, 0 to 0.5");

impl RawBall {
    /// The ball, and Poisson's ratio of what it is made of.
    pub(crate) fn check(&self, source: &Source, problems: &mut Problems) -> (Ball, f64) {
        let mut check = Check { source, problems };
        let mut positive = |given: &Option<Spanned<f64>>, key: &str, default: f64| {
            check.number(given.as_ref(), key, default, POSITIVE)
        };
        let radius = positive(&self.radius_m, "radius_m", Ball::POOL.radius);
        let mass = positive(&self.mass_kg, "mass_kg", Ball::POOL.mass);
        let inertia = positive(&self.inertia, "inertia", UNIFORM_SPHERE);
        for (sd, key) in [(&self.radius_m_sd, "radius_m_sd"), (&self.mass_kg_sd, "mass_kg_sd")] {
            positive(sd, key, 0.0);
        }
        let poisson = check.number(self.poisson.as_ref(), "poisson", POISSON, ELASTIC);
        let disc = self.shape.as_ref().is_some_and(|shape| *shape.as_ref() == Shape::Disc);
        inertia_is_possible(self.inertia.as_ref(), "inertia", disc, source, problems);
        (Ball { radius, mass, inertia }, poisson)
    }
}

/// Refuses what no body of this shape has.
fn inertia_is_possible(
    given: Option<&Spanned<f64>>,
    key: &str,
    disc: bool,
    source: &Source,
    problems: &mut Problems,
) {
    let (most, said) =
        if disc { (1.0, "1, that of a ring") } else { (2.0 / 3.0, "2/3, that of a hollow sphere") };
    let hollow = |value: &&Spanned<f64>| value.as_ref().is_finite() && *value.as_ref() > most;
    if let Some(value) = given.filter(hollow) {
        let text = source.written(&value.span());
        let message = format!("{key} is {text}; expected at most {said}");
        source.add(problems, &value.span(), message);
    }
}
