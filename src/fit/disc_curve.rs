//! J_t/J_n of two discs against their slip, as a fit has it.

use super::{Fit, Status};
use crate::measurement::parameter::Parameter;
use crate::measurement::values::Values;
use crate::physics::ball::{BallState, Vec3};
use crate::physics::collision::Model;

/// Slips of a curve: its kinks are then within a hundredth of its length.
const POINTS: usize = 120;

/// The curve goes on beyond the largest slip by this part.
const BEYOND: f64 = 1.08;

/// A contact whose J_t/J_n is μ but for this part slides throughout.
const SLIDES: f64 = 1e-4;

/// How J_t/J_n of two discs depends on the slip over the closing speed.
#[derive(Clone, Debug, PartialEq)]
pub struct FrictionCurve {
    /// Points of the curve: the slip over the closing speed, from 0 on, and J_t/J_n against the slip.
    pub points: Vec<[f64; 2]>,
    /// The slip over the closing speed below which the contact sticks from the first touch; 0 for a rigid contact.
    pub sticks_below: f64,
    /// The slip over the closing speed from which on the contact slides throughout; `None` where it is beyond the
    /// points.
    pub slides_from: Option<f64>,
}

impl FrictionCurve {
    /// Of a fit, where the shots determine the friction.
    pub(super) fn of_fit(fit: &Fit, model: &Model, at: &Values) -> Option<Self> {
        fit.get(Parameter::Mu).filter(|mu| mu.status != Status::NotIdentified)?;
        let slips = fit.disc_shots.iter().filter_map(|shot| shot.slip_ratio);
        let largest = slips.map(|slip| slip.value.abs()).fold(0.0, f64::max);
        let speeds = fit.disc_shots.iter().filter_map(|shot| Some(shot.closing_speed?.value));
        let speeds: Vec<f64> = speeds.collect();
        let closing = speeds.iter().sum::<f64>() / speeds.len().max(1) as f64;
        (largest > 0.0).then(|| Self::of(model, at, largest, closing)).flatten()
    }

    /// Up to the largest slip over the closing speed, at a usual closing speed (m/s); `None` where the model has no outcome.
    fn of(model: &Model, at: &Values, largest: f64, closing: f64) -> Option<Self> {
        let model = at.model(model);
        let against = |slip: f64| {
            // slip −Rω_z
            let spin = Vec3::new(0.0, 0.0, -slip * closing / model.ball.radius);
            let cue = BallState { velocity: Vec3::new(closing, 0.0, 0.0), spin };
            let after = model.collide(&cue, &at.coefficients()).ok()?.object.velocity;
            Some([slip, -after.y / after.x])
        };
        let end = BEYOND * largest;
        let points = (0..=POINTS).map(|i| against(end * i as f64 / POINTS as f64));
        let points = points.collect::<Option<Vec<_>>>()?;
        let mu = model.law.largest(at[Parameter::Mu]);
        let slides = |[_, ratio]: &&[f64; 2]| *ratio >= mu * (1.0 - SLIDES);
        let slides_from = points.iter().find(slides).map(|[slip, _]| *slip);
        Some(Self { points, sticks_below: mu * model.kappa, slides_from })
    }
}
