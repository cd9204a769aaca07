//! The specification of a synthetic data set.

use std::path::Path;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Kind;
use super::scene::{Camera, MAX_SHOTS, Played, faults_of_shots};
use crate::io::DatasetError;
use crate::io::balls::{self, BallSection};
use crate::io::toml_file::{self, Source};
use crate::measurement::dataset::ObjectBall;
use crate::measurement::fault::{Fault, INERTIA};
use crate::measurement::parameter::Parameter;
use crate::physics::ball::Ball;
use crate::physics::cloth_motion::Cloth;
use crate::physics::collision::{Coefficients, Effects, Fidelity, Model};
use crate::physics::friction_law::Law;

/// A synthetic data set: the content of a SPEC.toml.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
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
    pub(crate) ball: BallSection,
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
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[schemars(extend("dependentRequired" = { "mu_b": ["mu_c"], "mu_c": ["mu_b"] }))]
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
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
pub(crate) struct Shots {
    /// The number of shots.
    #[schemars(range(min = 1, max = MAX_SHOTS))]
    pub(crate) count: usize,
    /// The cue ball's speed before the impact, m/s.
    pub(crate) speed_m_s: [f64; 2],
    /// The cut angle, degrees; negative if the cue ball moves towards −y of the collision frame.
    pub(crate) cut_deg: [f64; 2],
    /// The spins that the shots have, one after the other.
    pub(crate) cue_spin: Vec<Played>,
}

/// The standard deviations of the errors of measurement; 0 leaves a quantity exact.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(default)]
pub(crate) struct Noise {
    /// Every velocity component and speed, m/s.
    #[schemars(range(min = 0))]
    pub(crate) velocity_m_s: f64,
    /// Direction of the line of centres, degrees (impacts).
    #[schemars(range(min = 0))]
    pub(crate) line_of_centres_deg: f64,
    /// Every spin component, rad/s.
    #[schemars(range(min = 0))]
    pub(crate) spin_rad_s: f64,
    /// Every angle, degrees (angles).
    #[schemars(range(min = 0))]
    pub(crate) angle_deg: f64,
}

/// The text of a SPEC.toml.
impl FromStr for Spec {
    type Err = DatasetError;

    fn from_str(text: &str) -> Result<Self, DatasetError> {
        let what = "the specification cannot be used:";
        toml_file::checked(Path::new("SPEC.toml"), Some(text), what, Self::checked)
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
        let cue = self.ball.like(Ball::POOL);
        let sds = [self.ball.mass_kg_sd, self.ball.radius_m_sd].map(Option::unwrap_or_default);
        (cue, self.object.map(|object| object.beside(cue, sds)))
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

    /// Adds what is wrong beyond its schema to the problems of its file.
    pub(super) fn checked(self, source: &Source) -> Self {
        source.add(&self.faults());
        self
    }

    /// Returns what is wrong beyond its schema.
    pub(super) fn faults(&self) -> Vec<Fault> {
        let Self { name, shots, .. } = self;
        let object = self.object.unwrap_or_default();
        let (cue, other) = self.balls();
        let other = other.map_or(cue, |other| other.ball);
        let mut faults = faults_of_shots("shots", shots.speed_m_s, shots.cut_deg);
        faults.extend(self.camera.faults(0));
        faults.extend(balls::faults(cue, other, INERTIA));
        let mut expect = |is_good: bool, key: &str, value: String, expected: &str| {
            faults.extend((!is_good).then(|| Fault::new(key, value, expected)));
        };
        let is_name = !name.is_empty() && !name.contains(['/', '\\']) && !name.starts_with('.');
        expect(is_name, "name", format!("\"{name}\""), "a name that can name a folder");
        let spins = format!("at least one of {}", Played::ALL.map(Played::name).join(", "));
        expect(!shots.cue_spin.is_empty(), "shots.cue_spin", "[]".to_owned(), &spins);
        // what is stated remains above 0
        for (key, sd, value) in [
            ("ball.radius_m_sd", self.ball.radius_m_sd, cue.radius),
            ("ball.mass_kg_sd", self.ball.mass_kg_sd, cue.mass),
            ("object.radius_m_sd", object.radius_m_sd, other.radius),
            ("object.mass_kg_sd", object.mass_kg_sd, other.mass),
        ] {
            let sd = sd.unwrap_or(0.0);
            let is_small = sd < 0.1 * value || !(value > 0.0);
            expect(is_small, key, sd.to_string(), "less than a tenth of what it is the error of");
        }
        faults
    }
}
