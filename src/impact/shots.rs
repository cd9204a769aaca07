//! Extracted impacts → the shots of a data set.

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::{Impact, Quantity};
use crate::dataset::{Before, Joint, Measured, Measurement, Shot, Spin};
use crate::observable::{Axis, Observable};
use crate::track::TrackShot;

/// The quantities of the path that a shot keeps, in the order of [`Joint`], which has the spin behind the
/// third.
const KEPT: [Quantity; 7] = [
    Quantity::Direction,
    Quantity::CueVxBefore,
    Quantity::CueVyBefore,
    Quantity::CueVxAfter,
    Quantity::CueVyAfter,
    Quantity::ObjVxAfter,
    Quantity::ObjVyAfter,
];

/// As many as a [`Joint`] has without measured spins after the impact.
const PLACES: usize = Joint::BEFORE + 4;

/// Where a quantity of [`KEPT`] stands in a [`Joint`].
fn place(kept: usize) -> usize {
    if kept < 3 { kept } else { kept + 3 }
}

/// The cloth's sliding friction μ_k, as all shots together tell it: the mean weighted by 1/variance.
#[must_use]
pub fn sliding<'a>(impacts: impl IntoIterator<Item = &'a Impact>) -> Option<Measured> {
    let at = Quantity::Sliding as usize;
    let (mut weights, mut sum) = (0.0, 0.0);
    for impact in impacts {
        let variance = impact.covariance[(at, at)];
        // at a bound the track did not tell it
        if variance > 0.0 && (0.0..1.0).contains(&impact.values[at]) && impact.values[at] > 0.0 {
            weights += 1.0 / variance;
            sum += impact.values[at] / variance;
        }
    }
    (weights > 0.0).then(|| Measured { value: sum / weights, sd: Some(weights.recip().sqrt()) })
}

/// A shot as it is for a given μ_k: values and errors conditional on it.
#[must_use]
pub fn shot(track: &TrackShot, impact: &Impact, sliding: Option<Measured>) -> Shot {
    let mu_k = Quantity::Sliding as usize;
    let kept = KEPT.map(|quantity| quantity as usize);
    let mut values = SVector::<f64, 7>::from_fn(|i, _| impact.values[kept[i]]);
    let mut covariance = SMatrix::<f64, 7, 7>::from_fn(|i, j| impact.covariance[(kept[i], kept[j])]);
    let mut by_sliding = SVector::zeros();
    let variance = impact.covariance[(mu_k, mu_k)];
    if let (Some(sliding), true) = (sliding, variance > 0.0) {
        // y | μ_k = y + b(μ_k − μ_k of the track), b = cov(y, μ_k)/var μ_k
        by_sliding = SVector::<f64, 7>::from_fn(|i, _| impact.covariance[(kept[i], mu_k)] / variance);
        values += by_sliding * (sliding.value - impact.values[mu_k]);
        covariance -= by_sliding * by_sliding.transpose() * variance;
    }
    let measured = |i: usize| Measured { value: values[i], sd: Some(covariance[(i, i)].max(0.0).sqrt()) };
    let (sin, cos) = values[0].sin_cos();
    let direction_sd = covariance[(0, 0)].max(0.0).sqrt();
    let normal = [(cos, sin), (sin, cos)]
        .map(|(value, across)| Measured { value, sd: Some(direction_sd * across.abs()) });
    let after = [
        Observable::CueVelocity(Axis::X),
        Observable::CueVelocity(Axis::Y),
        Observable::ObjectVelocity(Axis::X),
        Observable::ObjectVelocity(Axis::Y),
    ];
    let mut joint = Joint { covariance: DMatrix::zeros(PLACES, PLACES), by_sliding: DVector::zeros(PLACES) };
    for i in 0..7 {
        joint.by_sliding[place(i)] = by_sliding[i];
        for j in 0..7 {
            joint.covariance[(place(i), place(j))] = covariance[(i, j)];
        }
    }
    if let Spin::Measured { sd, .. } = track.spin {
        for (axis, sd) in sd.into_iter().enumerate() {
            joint.covariance[(3 + axis, 3 + axis)] = sd.map_or(0.0, |sd| sd * sd);
        }
    }
    let observed = after.into_iter().enumerate();
    Shot {
        name: track.name.clone(),
        file: track.file.clone(),
        line: track.line,
        labels: track.labels.clone(),
        before: Before::Impact { normal, velocity: [measured(1), measured(2)] },
        spin: track.spin,
        after: observed
            .map(|(i, observable)| Measurement { observable, measured: measured(3 + i) })
            .collect(),
        joint: Some(Box::new(joint)),
    }
}
