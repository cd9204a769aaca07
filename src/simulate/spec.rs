//! The specification of a synthetic data set.

use std::path::Path;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::Kind;
use super::scene::{Camera, Played, checked, faults_of, faults_of_shots};
use crate::io::DatasetError;
use crate::io::balls::{BallSection, Shape};
use crate::io::error::Problems;
use crate::io::toml_file;
use crate::measurement::dataset::ObjectBall;
use crate::measurement::fault::{Fault, Faults, INERTIA, NOT_NEGATIVE, POSITIVE};
use crate::measurement::parameter::Parameter;
use crate::physics::ball::Ball;
use crate::physics::cloth_motion::Cloth;
use crate::physics::collision::{Coefficients, Effects, Fidelity, MASS_RATIOS, Model};
use crate::physics::friction_law::Law;

/// A synthetic data set: the content of a SPEC.toml.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Spec {
    /// The name of the data set.
    pub(crate) name: String,
    /// The kind of measurement of each shot.
    pub(crate) kind: Kind,
    /// The seed of the random numbers: the same seed gives the same files.
    pub(crate) seed: u64,
    /// The true parameters.
    pub(crate) truth: Truth,
    /// Which shots are played.
    pub(crate) shots: Shots,
    /// The errors of measurement.
    #[serde(default)]
    pub(crate) noise: Noise,
    /// The cue ball, and the object ball unless it is stated.
    #[serde(default)]
    pub(crate) ball: BallSpec,
    /// The properties of the object ball that differ from the cue ball's.
    #[serde(default)]
    pub(crate) object: Option<BallSection>,
    /// The camera, for kind `tracks`.
    #[serde(default)]
    pub(crate) camera: Camera,
    /// The cloth, for kind `tracks`.
    #[serde(default)]
    pub(crate) cloth: Cloth,
}

/// The true parameters, which a fit should find again.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Truth {
    /// Friction between the balls μ, dimensionless.
    pub(crate) mu: f64,
    /// Friction of the cloth on the object ball μ_s, dimensionless.
    pub(crate) mu_s: f64,
    /// Coefficient of restitution e, dimensionless.
    pub(crate) e: f64,
    /// The tangential compliance κ of the contact, dimensionless; `None` or 0: rigid.
    pub(crate) kappa: Option<f64>,
    /// b of a friction that decreases with the slip v, μ + b·exp(−c·v), dimensionless.
    pub(crate) mu_b: Option<f64>,
    /// c of the same law, s/m.
    pub(crate) mu_c: Option<f64>,
    /// e₁ of a restitution that decreases with the closing speed v, e − e₁·v, s/m.
    pub(crate) e_slope: Option<f64>,
}

/// Which shots are played: uniformly random between the ends of each range.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Shots {
    /// The number of shots.
    pub(crate) count: usize,
    /// The cue ball's speed before the impact, m/s.
    pub(crate) speed_m_s: [f64; 2],
    /// The cut angle, degrees; negative if the cue ball moves towards −y of the collision frame.
    pub(crate) cut_deg: [f64; 2],
    /// The spins that the shots have, one after the other.
    pub(crate) cue_spin: Vec<Played>,
}

/// The standard deviations of the errors of measurement; 0 leaves a quantity exact.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Noise {
    /// Every velocity component and speed, m/s.
    pub(crate) velocity_m_s: f64,
    /// Direction of the line of centres, degrees (impacts).
    pub(crate) line_of_centres_deg: f64,
    /// Every spin component, rad/s.
    pub(crate) spin_rad_s: f64,
    /// Every angle, degrees (angles).
    pub(crate) angle_deg: f64,
}

/// The cue ball of a synthetic data set: its true properties, and the errors of its `[ball]`.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct BallSpec {
    /// The radius, m.
    pub(crate) radius_m: f64,
    /// The mass, kg.
    pub(crate) mass_kg: f64,
    /// The moment of inertia over MR², ν.
    pub(crate) inertia: f64,
    /// The standard deviation of what is stated as the radius, m; 0: exact.
    pub(crate) radius_m_sd: f64,
    /// The standard deviation of what is stated as the mass, kg; 0: exact.
    pub(crate) mass_kg_sd: f64,
}

impl Default for BallSpec {
    fn default() -> Self {
        let Ball { radius, mass, inertia } = Ball::POOL;
        Self { radius_m: radius, mass_kg: mass, inertia, radius_m_sd: 0.0, mass_kg_sd: 0.0 }
    }
}

/// The text of a SPEC.toml.
impl FromStr for Spec {
    type Err = DatasetError;

    fn from_str(text: &str) -> Result<Self, DatasetError> {
        let problems = Problems::new("the specification cannot be used:");
        toml_file::checked(Path::new("SPEC.toml"), Some(text), problems, checked::<Self>)
    }
}

impl Spec {
    /// Returns the one spin that every shot plays, if the data need no spin columns.
    pub(super) fn assumed(&self) -> Option<Played> {
        let first = *self.shots.cue_spin.first()?;
        let is_known = self.camera.markers == 0 && matches!(first, Played::Stun | Played::NaturalRoll);
        (is_known && self.shots.cue_spin.iter().all(|played| *played == first)).then_some(first)
    }

    /// Returns the cue ball, and the object ball if it differs, as they truly are.
    pub(super) fn balls(&self) -> (Ball, Option<ObjectBall>) {
        let BallSpec { radius_m: radius, mass_kg: mass, inertia, radius_m_sd, mass_kg_sd } = self.ball;
        let cue = Ball { radius, mass, inertia };
        (cue, self.object.map(|object| object.beside(cue, [mass_kg_sd, radius_m_sd])))
    }

    pub(super) fn coefficients(&self) -> Coefficients {
        let Truth { mu, mu_s, e, .. } = self.truth;
        Coefficients { mu, mu_s, e }
    }

    /// Returns a model with the balls of this specification and their contact.
    pub(super) fn with_truth(&self, model: &Model) -> Model {
        let Truth { kappa, mu_b, mu_c, e_slope, .. } = self.truth;
        let (ball, object) = self.balls();
        Model {
            ball,
            effects: Effects { compliance: kappa.is_some() || model.effects.compliance, ..model.effects },
            object: object.map(|object| object.ball).or(model.object),
            law: mu_b.zip(mu_c).map_or(model.law, |(b, c)| Law::Exponential { b, c }),
            e_slope: e_slope.or(model.e_slope),
            kappa: kappa.unwrap_or(model.kappa),
            ..*model
        }
    }

    /// Returns the default model of its shots: `full`, or `ode` for a compliant contact.
    pub(crate) fn usual_model(&self) -> Model {
        let full = Model::new(Fidelity::Full, self.balls().0);
        match self.truth.kappa {
            None | Some(0.0) => full,
            Some(kappa) => Model { tolerance: Model::TOLERANCE, ..full.giving_way(kappa) },
        }
    }

    /// Returns everything that is true of the contact.
    pub fn truths(&self) -> Vec<(Parameter, f64)> {
        let Truth { mu, mu_s, e, kappa, mu_b, mu_c, e_slope } = self.truth;
        let (cue, object) = self.balls();
        let object = object.map_or(cue, |object| object.ball);
        let ratio = |cue: f64, object: f64| (cue != object).then_some(cue / object);
        let all = [
            (Parameter::Mu, Some(mu)),
            (Parameter::MuS, Some(mu_s)),
            (Parameter::E, Some(e)),
            (Parameter::B, mu_b),
            (Parameter::C, mu_c),
            (Parameter::Kappa, kappa),
            (Parameter::MassRatio, ratio(cue.mass, object.mass)),
            (Parameter::RadiusRatio, ratio(cue.radius, object.radius)),
            (Parameter::ESlope, e_slope),
        ];
        all.into_iter().filter_map(|(parameter, value)| Some((parameter, value?))).collect()
    }
}

impl Faults for Spec {
    fn faults(&self) -> Vec<Fault> {
        let Self { name, truth, shots, noise, ball, .. } = self;
        let stated = self.object.unwrap_or_default();
        let object = self.balls().1.map_or(Ball::POOL, |object| object.ball);
        let mut faults = Vec::new();
        let mut expect = |is_good: bool, key: &str, value: String, expected: &str| {
            faults.extend((!is_good).then(|| Fault::new(key, value, expected)));
        };
        let is_name = !name.is_empty() && !name.contains(['/', '\\']) && !name.starts_with('.');
        expect(is_name, "name", format!("\"{name}\""), "a name that can name a folder");
        let spins = format!("at least one of {}", Played::ALL.map(Played::name).join(", "));
        expect(!shots.cue_spin.is_empty(), "shots.cue_spin", "[]".to_owned(), &spins);
        let both = "both of mu + mu_b·exp(−mu_c·v), or neither";
        let [b, c] = [truth.mu_b.is_some(), truth.mu_c.is_some()];
        expect(b || !c, "truth.mu_b", "missing".to_owned(), both);
        expect(c || !b, "truth.mu_c", "missing".to_owned(), both);
        let is_ball = stated.shape == Shape::Sphere;
        expect(is_ball, "object.shape", "\"disc\"".to_owned(), "balls, which specifications are of");
        let poisson = stated.poisson.map_or(String::new(), |poisson| poisson.to_string());
        expect(poisson.is_empty(), "object.poisson", poisson, "none, as truth.kappa states the compliance");
        // what is stated remains above 0
        for (key, sd, value) in [
            ("ball.radius_m_sd", ball.radius_m_sd, ball.radius_m),
            ("ball.mass_kg_sd", ball.mass_kg_sd, ball.mass_kg),
            ("object.radius_m_sd", stated.radius_m_sd.unwrap_or(0.0), object.radius),
            ("object.mass_kg_sd", stated.mass_kg_sd.unwrap_or(0.0), object.mass),
        ] {
            let is_small = !(value > 0.0) || (0.0..0.1 * value).contains(&sd);
            expect(is_small, key, sd.to_string(), "0 or more, less than a tenth of what it is the error of");
        }
        // a mass that is not positive is named below
        let ratio = self.object.map_or(1.0, |_| ball.mass_kg / object.mass);
        let is_possible = !(ratio > 0.0 && ratio.is_finite()) || MASS_RATIOS.contains(&ratio);
        let masses = "0.001 to 1000 times the cue ball's mass";
        expect(is_possible, "object.mass_kg", object.mass.to_string(), masses);
        faults.extend(faults_of_shots("shots", ("count", shots.count), shots.speed_m_s, shots.cut_deg));
        faults.extend(self.camera.faults(0, NOT_NEGATIVE));
        faults.extend(self.cloth.faults());
        faults.extend(faults_of(&[
            ("noise.velocity_m_s", noise.velocity_m_s, NOT_NEGATIVE),
            ("noise.line_of_centres_deg", noise.line_of_centres_deg, NOT_NEGATIVE),
            ("noise.spin_rad_s", noise.spin_rad_s, NOT_NEGATIVE),
            ("noise.angle_deg", noise.angle_deg, NOT_NEGATIVE),
            ("ball.radius_m", ball.radius_m, POSITIVE),
            ("ball.mass_kg", ball.mass_kg, POSITIVE),
            ("ball.inertia", ball.inertia, INERTIA),
            ("object.radius_m", object.radius, POSITIVE),
            ("object.mass_kg", object.mass, POSITIVE),
            ("object.inertia", object.inertia, INERTIA),
        ]));
        faults
    }
}
