//! What is assumed of balls and cloth before a shot is looked at.

use crate::physics::ball::Ball;
use crate::physics::cloth_motion::Cloth;
use crate::physics::collision::{Coefficients, Model};

/// What the extraction assumes of balls and cloth.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    pub ball: Ball,
    /// μ_k is the mean of a prior; it is estimated from the curvature of the paths.
    pub cloth: Cloth<f64>,
    /// Standard deviation of that prior.
    pub sliding_sd: f64,
    /// What is known of the vertical friction that lifts one of the balls.
    pub lift: LiftPrior,
    /// Standard deviation of side spin that nobody saw, of shots stated as stun or natural roll: of Rω_z/U.
    pub side_sd: f64,
}

/// How fast the friction between the balls lifts one of them. A single track hardly tells for how long a
/// ball flew, and has several answers.
#[derive(Clone, Copy, Debug)]
pub enum LiftPrior {
    /// μ(1 + e)/2 of the vertical part of the closing speed: mean and standard deviation.
    Published(f64, f64),
    /// As the collision model says with coefficients that these shots gave, and a relative standard
    /// deviation.
    Model(Model, Coefficients, f64),
}

impl Scene {
    /// Published values to start from, with priors so wide that the tracks decide.
    #[must_use]
    pub fn new(ball: Ball) -> Self {
        Self {
            ball,
            cloth: Cloth::default(),
            sliding_sd: 1.0,
            lift: LiftPrior::Published(0.05, 0.05),
            side_sd: 0.0,
        }
    }
}
