//! The specification of a synthetic data set.

use std::path::Path;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Kind;
use crate::io::DatasetError;
use crate::io::error::Problems;
use crate::io::stated_object::StatedObject;
use crate::io::toml_file;
use crate::measurement::dataset::ObjectBall;
use crate::measurement::parameter::Parameter;
use crate::measurement::values::Values;
use crate::physics::ball::Ball;
use crate::physics::cloth_motion::Cloth;
use crate::physics::collision::{Coefficients, Effects, Fidelity, Model};
use crate::physics::friction_law::Law;
use crate::physics::name::{by_name, worded};

/// A synthetic data set: the content of a SPEC.toml.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Spec {
    /// The name of the data set.
    pub name: String,
    /// The kind of measurement of each shot.
    pub kind: Kind,
    /// The seed of the random numbers: the same seed gives the same files.
    pub seed: u64,
    /// The true parameters.
    pub truth: Truth,
    /// Which shots are played.
    pub shots: Shots,
    /// The errors of measurement.
    #[serde(default)]
    pub noise: Noise,
    /// The cue ball, and the object ball unless it is stated.
    #[serde(default)]
    pub ball: BallSpec,
    /// The properties of the object ball that differ from the cue ball's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<StatedObject>,
    /// The camera, for kind `tracks`.
    #[serde(default)]
    pub camera: Camera,
    /// The cloth, for kind `tracks`.
    #[serde(default)]
    pub cloth: ClothSpec,
}

/// The text of a SPEC.toml.
impl FromStr for Spec {
    type Err = DatasetError;

    fn from_str(text: &str) -> Result<Self, DatasetError> {
        let problems = Problems::new("the specification cannot be used:");
        toml_file::checked(Path::new("SPEC.toml"), Some(text), problems, Self::checked)
    }
}

/// The true parameters, which a fit should find again.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// Friction between the balls μ, dimensionless.
    pub mu: f64,
    /// Friction of the cloth on the object ball μ_s, dimensionless.
    pub mu_s: f64,
    /// Coefficient of restitution e, dimensionless.
    pub e: f64,
    /// The compliance κ of a contact that gives way along its surface, dimensionless; `None` or 0:
    /// rigid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kappa: Option<f64>,
    /// b of a friction that falls with the slip v, μ + b·exp(−c·v), dimensionless.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mu_b: Option<f64>,
    /// c of the same law, s/m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mu_c: Option<f64>,
    /// e₁ of a restitution that falls with the closing speed v, e − e₁·v, s/m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub e_slope: Option<f64>,
}

/// Which shots are played: uniformly random between the ends of each range.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Shots {
    /// The number of shots.
    pub count: usize,
    /// The cue ball's speed before the impact, m/s.
    pub speed_m_s: [f64; 2],
    /// The cut angle, degrees; negative if the cue ball moves towards −y of the collision frame.
    pub cut_deg: [f64; 2],
    /// The spins that the shots have, one after the other.
    pub cue_spin: Vec<Played>,
}

worded! {
    /// How the cue ball is spinning before the impact.
    #[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq)]
    #[non_exhaustive]
    #[serde(rename_all = "kebab-case")]
    pub enum Played {
        /// It slides without any spin.
        Stun = "stun",
        /// It rolls on the cloth without slip.
        NaturalRoll = "natural-roll",
        /// Topspin of 90 % of the natural roll's: a ball that still slides a little.
        AlmostRoll = "almost-roll",
        /// Backspin of 30 to 100 % of the natural roll's.
        Draw = "draw",
        /// Side spin of up to the natural roll's, either way, on a sliding ball.
        Side = "side",
        /// Natural roll with side spin of up to a tenth of its spin, either way: what a player does
        /// not see.
        SlightSide = "slight-side",
        /// Topspin or backspin of up to the natural roll's.
        Any = "any",
    }
    /// The name in a specification.
    pub fn name;
}

by_name!(Played, "spin", ALL, name);

/// The standard deviations of the errors of measurement; 0 leaves a quantity exact.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Noise {
    /// Every velocity component and speed, m/s.
    pub velocity_m_s: f64,
    /// Direction of the line of centres, degrees (impacts).
    pub line_of_centres_deg: f64,
    /// Every spin component, rad/s.
    pub spin_rad_s: f64,
    /// Every angle, degrees (angles).
    pub angle_deg: f64,
}

/// The cue ball of a synthetic data set: its true properties, and the errors by which its `[ball]`
/// states them.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct BallSpec {
    /// The radius, m.
    pub radius_m: f64,
    /// The mass, kg.
    pub mass_kg: f64,
    /// The moment of inertia over MR², ν.
    pub inertia: f64,
    /// The standard deviation of what is stated as the radius, m; 0: exact.
    pub radius_m_sd: f64,
    /// The standard deviation of what is stated as the mass, kg; 0: exact.
    pub mass_kg_sd: f64,
}

impl Default for BallSpec {
    fn default() -> Self {
        let Ball { radius, mass, inertia } = Ball::POOL;
        Self { radius_m: radius, mass_kg: mass, inertia, radius_m_sd: 0.0, mass_kg_sd: 0.0 }
    }
}

/// The camera of a synthetic data set of kind `tracks`.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Camera {
    /// Frames per second.
    pub fps: f64,
    /// Standard deviation of every coordinate, m.
    pub position_sd_m: f64,
    /// How long each shot is filmed before the impact, ms.
    pub before_ms: f64,
    /// How long each shot is filmed after the impact, ms.
    pub after_ms: f64,
    /// The fraction of the positions that are missing, 0 to 1.
    pub gaps: f64,
    /// The fraction of the positions that are wrong, by up to 20 mm.
    pub outliers: f64,
    /// How many points on each ball are marked, at random places; they are seen while on its upper
    /// side.
    pub markers: usize,
}

impl Default for Camera {
    fn default() -> Self {
        let (fps, position_sd_m, time) = (1000.0, 1e-4, 40.0);
        Self { fps, position_sd_m, before_ms: time, after_ms: time, gaps: 0.0, outliers: 0.0, markers: 0 }
    }
}

/// The cloth of a synthetic data set of kind `tracks`.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ClothSpec {
    /// Sliding friction μ_k, dimensionless.
    pub mu_k: f64,
    /// Rolling resistance μ_r, dimensionless.
    pub mu_r: f64,
    /// Restitution e_t of a ball that falls on the bed of the table, dimensionless.
    pub bounce: f64,
}

impl Default for ClothSpec {
    fn default() -> Self {
        let Cloth { sliding, rolling, bounce } = Cloth::default();
        Self { mu_k: sliding, mu_r: rolling, bounce }
    }
}

impl Spec {
    /// Returns the one spin that every shot plays, if the data need no spin columns: markers show
    /// it, others are measured.
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

    /// Returns a model with the balls of this specification, and what is true of their contact
    /// besides the coefficients.
    pub(super) fn with_truth(&self, model: &Model) -> Model {
        let Truth { kappa, mu_b, mu_c, e_slope, .. } = self.truth;
        let (ball, object) = self.balls();
        let law = mu_b.zip(mu_c).map_or(model.law, |(b, c)| Law::Exponential { b, c });
        let effects = Effects { compliance: kappa.is_some() || model.effects.compliance, ..model.effects };
        Model {
            ball,
            effects,
            object: object.map(|object| object.ball).or(model.object),
            law,
            e_slope: e_slope.or(model.e_slope),
            kappa: kappa.unwrap_or(model.kappa),
            ..*model
        }
    }

    /// Returns the model by which its shots are computed by default: `full`, or `ode` for a
    /// compliant contact.
    #[must_use]
    pub fn usual_model(&self) -> Model {
        let full = Model::new(Fidelity::Full, self.balls().0);
        match self.truth.kappa {
            None | Some(0.0) => full,
            Some(kappa) => Model { tolerance: Model::TOLERANCE, ..full.giving_way(kappa) },
        }
    }

    /// Returns everything that is true of the contact: μ, μ_s and e, and what else this
    /// specification states.
    #[must_use]
    pub fn truths(&self) -> Vec<(Parameter, f64)> {
        let Truth { kappa, mu_b, mu_c, e_slope, .. } = self.truth;
        let values = Values::of(&self.with_truth(&self.usual_model()), self.coefficients());
        let (cue, object) = self.balls();
        let differs = |of: fn(Ball) -> f64| object.is_some_and(|object| of(object.ball) != of(cue));
        let stated = |parameter: &Parameter| match parameter {
            Parameter::B => mu_b.is_some(),
            Parameter::C => mu_c.is_some(),
            Parameter::Kappa => kappa.is_some(),
            Parameter::ESlope => e_slope.is_some(),
            Parameter::MassRatio => differs(|ball| ball.mass),
            Parameter::RadiusRatio => differs(|ball| ball.radius),
            Parameter::Mu | Parameter::MuS | Parameter::E => true,
        };
        Parameter::ALL.into_iter().filter(stated).map(|parameter| (parameter, values[parameter])).collect()
    }
}
