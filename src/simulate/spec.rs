//! What a synthetic data set is to be, as it stands in a specification.

use serde::{Deserialize, Serialize};

use super::{Camera, ClothSpec};
use crate::physics::ball::Ball;

/// What data to make: the content of a SPEC.toml.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Spec {
    /// The name of the data set.
    pub name: String,
    /// What is measured of each shot.
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
    /// Both balls.
    #[serde(default)]
    pub ball: BallSpec,
    /// The camera, for kind `tracks`.
    #[serde(default)]
    pub camera: Camera,
    /// The cloth, for kind `tracks`.
    #[serde(default)]
    pub cloth: ClothSpec,
}

/// What is measured of each shot: the kind of the data set.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Velocities and spins just before and after the impact.
    Impacts,
    /// Cut angles and what follows from them: angles and speeds after the impact.
    Angles,
    /// The positions of both balls in every frame.
    Tracks,
}

/// The true parameters, which a fit should find again.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// Friction between the balls μ, dimensionless.
    pub mu: f64,
    /// Friction of the cloth on the object ball μ_s, dimensionless.
    pub mu_s: f64,
    /// Coefficient of restitution e, dimensionless.
    pub e: f64,
}

/// Which shots are played: uniformly random between the ends of each range.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Shots {
    /// The number of shots.
    pub count: usize,
    /// The cue ball's speed before the impact, m/s.
    pub speed_m_s: [f64; 2],
    /// The cut angle, degrees; negative where the cue ball moves towards −y of the collision frame.
    pub cut_deg: [f64; 2],
    /// The spins that the shots have, one after the other.
    pub cue_spin: Vec<Played>,
}

/// How the cue ball is spinning before the impact.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Played {
    /// It slides without any spin.
    Stun,
    /// It rolls on the cloth without slip.
    NaturalRoll,
    /// Topspin of 90 % of the natural roll's: a ball that still slides a little.
    AlmostRoll,
    /// Backspin of 30 to 100 % of the natural roll's.
    Draw,
    /// Side spin of up to the natural roll's, either way, on a sliding ball.
    Side,
    /// Natural roll with side spin of up to a tenth of its spin, either way: what a player does not see.
    SlightSide,
    /// Topspin or backspin of up to the natural roll's.
    Any,
}

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

/// Both balls of a synthetic data set.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct BallSpec {
    /// The radius, m.
    pub radius_m: f64,
    /// The mass, kg.
    pub mass_kg: f64,
    /// The moment of inertia over MR², ν.
    pub inertia: f64,
}

impl Default for BallSpec {
    fn default() -> Self {
        let Ball { radius, mass, inertia } = Ball::POOL;
        Self { radius_m: radius, mass_kg: mass, inertia }
    }
}
