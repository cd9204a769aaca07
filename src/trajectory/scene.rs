//! What is assumed of balls and cloth before a shot is looked at.

use crate::measurement::track::Viewpoint;
use crate::physics::ball::Ball;
use crate::physics::cloth_motion::Cloth;
use crate::physics::collision::{Coefficients, Model};

/// Assumptions of the extraction about the balls and the cloth.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// The cue ball.
    pub ball: Ball,
    /// The object ball.
    pub object: Ball,
    /// The cloth. Its μ_k is the mean of a prior: it is estimated from the curvature of the paths.
    pub cloth: Cloth<f64>,
    /// The standard deviation of that prior of μ_k.
    pub sliding_sd: f64,
    /// What is known of the vertical friction that lifts one of the balls.
    pub lift: LiftPrior,
    /// The standard deviation of a side spin that was not seen, as Rω_z/U, in shots stated as stun or natural roll.
    pub side_sd: f64,
    /// By which part of 2R the centres may seem to be off it where the balls touch, while nothing is known of the camera; 0 where lengths
    /// are true.
    pub gap_sd: f64,
    /// Where the camera sees balls that hop.
    pub viewpoint: Viewpoint,
}

/// How fast the friction between the balls lifts one of them. A single track hardly shows for how long a
/// ball flew, and has several answers.
#[derive(Clone, Copy, Debug)]
pub enum LiftPrior {
    /// The mean and the standard deviation of μ(1 + e)/2, the speed at which a ball is lifted as a fraction of the
    /// vertical part of the closing speed.
    Published(f64, f64),
    /// The lift that the collision model has with coefficients that these shots gave, and its relative standard
    /// deviation.
    Model(Model, Coefficients, f64),
}

impl Scene {
    /// Published values to start from, with priors so wide that the tracks decide.
    #[must_use]
    pub fn new(ball: Ball) -> Self {
        Self {
            ball,
            object: ball,
            cloth: Cloth::default(),
            sliding_sd: 1.0,
            lift: LiftPrior::Published(0.05, 0.05),
            side_sd: 0.0,
            gap_sd: 0.0,
            viewpoint: Viewpoint::default(),
        }
    }

    /// Published values as in [`Scene::new`], with the balls of a model.
    #[must_use]
    pub fn of(model: &Model) -> Self {
        Self { object: model.object_ball(), ..Self::new(model.ball) }
    }

    /// How far apart the centres of the balls are on the table where they touch: 2√(R_c R_o).
    pub(crate) fn contact_distance(&self) -> f64 {
        self.ball.contact_distance(&self.object)
    }
}
