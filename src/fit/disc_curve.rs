//! J_t/J_n of two discs against their slip, as a fit has it.

use super::{Fit, Status};
use crate::measurement::parameter::Parameter;
use crate::problem::Quantity;

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
    /// Returns that of a fit up to the largest slip over the closing speed, at a usual closing speed, where
    /// the shots determine the friction.
    pub(super) fn of_fit(fit: &Fit) -> Option<Self> {
        fit.get(Parameter::Mu).filter(|mu| mu.status != Status::NotIdentified)?;
        let all = |quantity| fit.disc_shots.iter().filter_map(move |shot| shot.get(quantity));
        let largest = all(Quantity::SlipRatio).map(|slip| slip.value.abs()).fold(0.0, f64::max);
        let speeds: Vec<f64> = all(Quantity::ClosingSpeed).map(|speed| speed.value).collect();
        let closing = speeds.iter().sum::<f64>() / speeds.len().max(1) as f64;
        let against = |slip: f64| Some([slip, -fit.solution.impulse_ratio([closing, slip * closing])?]);
        let end = BEYOND * largest;
        let points = (0..=POINTS).map(|i| against(end * i as f64 / POINTS as f64));
        let points = points.collect::<Option<Vec<_>>>().filter(|_| largest > 0.0)?;
        let value = |parameter| fit.get(parameter).map_or(0.0, |estimate| estimate.value);
        let mu = value(Parameter::Mu) + value(Parameter::B);
        let slides = |[_, ratio]: &&[f64; 2]| *ratio >= mu * (1.0 - SLIDES);
        let slides_from = points.iter().find(slides).map(|[slip, _]| *slip);
        Some(Self { points, sticks_below: mu * value(Parameter::Kappa), slides_from })
    }
}
