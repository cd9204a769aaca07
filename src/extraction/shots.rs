//! Extracted impacts → the shots of a data set.

use nalgebra::{DMatrix, DVector};

use super::{Impact, Quantity, Rotation};
use crate::likelihood::frames::CLOTH;
use crate::measurement::dataset::{Before, Joint, Measured, Measurement, Shared, Shot};
use crate::measurement::observable::{Axis, Observable};
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::physics::ball::Vec3;

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

/// The cloth's sliding friction μ_k that all shots together determine for a given μ_r: the mean weighted by 1/variance.
#[must_use]
pub fn sliding<'a>(impacts: impl IntoIterator<Item = &'a Impact>, rolling: Measured) -> Option<Measured> {
    let at = Quantity::Sliding as usize;
    let (mut weights, mut sum) = (0.0, 0.0);
    for impact in impacts {
        let variance = impact.covariance[(at, at)];
        // at a bound the track did not tell it
        if variance > 0.0 && (0.0..1.0).contains(&impact.values[at]) && impact.values[at] > 0.0 {
            weights += 1.0 / variance;
            let further = impact.rolling.by[at] * (rolling.value - impact.rolling.assumed);
            sum += (impact.values[at] + further) / variance;
        }
    }
    // another μ_r may carry what the tracks hardly determine beyond 0
    (weights > 0.0).then(|| Measured { value: (sum / weights).max(0.0), sd: Some(weights.recip().sqrt()) })
}

/// The cloth's rolling resistance μ_r that all shots together and what is known of it beforehand determine.
#[must_use]
pub fn rolling<'a>(impacts: impl IntoIterator<Item = &'a Impact>) -> Measured {
    let (mean, sd) = CLOTH[1];
    let (mut weights, mut sum) = (sd.powi(-2), mean * sd.powi(-2));
    for impact in impacts {
        weights += impact.rolling.information;
        sum += impact.rolling.information * impact.rolling.best;
    }
    Measured { value: (sum / weights).max(0.0), sd: Some(weights.recip().sqrt()) }
}

/// A shot as it is for given μ_k and μ_r: values and errors conditional on them.
#[must_use]
pub fn shot(track: &TrackShot, impact: &Impact, sliding: Option<Measured>, rolling: Measured) -> Shot {
    let Together { mut values, mut covariance, with_sliding, with_lift, mut by_rolling, observed } =
        Together::of(impact);
    let (mu_k, lift) = (Quantity::Sliding as usize, Quantity::Lift as usize);
    let mut by_sliding = DVector::zeros(values.len());
    let further = rolling.value - impact.rolling.assumed;
    values += &by_rolling * further;
    let mu_k_here = impact.values[mu_k] + impact.rolling.by[mu_k] * further;
    // a prior's mean m with standard deviation s moves the minimum by ∂y/∂m = cov(y, lift)/s²
    let by_mean = impact.lift_held.map_or(0.0, |(mean, sd)| mean / (sd * sd));
    let mut by_lift = with_lift * by_mean;
    let variance = impact.covariance[(mu_k, mu_k)];
    if let (Some(sliding), true) = (sliding, variance > 0.0) {
        // y | μ_k = y + b(μ_k − μ_k of the track), b = cov(y, μ_k)/var μ_k
        by_sliding = with_sliding / variance;
        values += &by_sliding * (sliding.value - mu_k_here);
        by_rolling -= &by_sliding * impact.rolling.by[mu_k];
        covariance -= &by_sliding * by_sliding.transpose() * variance;
        by_lift -= &by_sliding * (impact.covariance[(mu_k, lift)] * by_mean);
    }
    let sd = |i: usize| covariance[(i, i)].max(0.0).sqrt();
    let measured = |i: usize| Measured { value: values[i], sd: Some(sd(i)) };
    let (sin, cos) = values[0].sin_cos();
    let normal =
        [(cos, sin), (sin, cos)].map(|(value, across)| Measured { value, sd: Some(sd(0) * across.abs()) });
    let spin = match (impact.spin, impact.rotations.as_ref().and_then(|rotations| rotations.cue_before)) {
        (Spin::Measured { .. }, Some(_)) | (Spin::Unknown, _) => Spin::Measured {
            spin: Vec3::new(values[3], values[4], values[5]),
            sd: [3, 4, 5].map(|i| Some(sd(i))),
        },
        (spin, _) => spin,
    };
    let observed = observed.into_iter().enumerate();
    let by_shared = |shared| match shared {
        Shared::Sliding => by_sliding.clone(),
        Shared::Lift => by_lift.clone(),
        Shared::Rolling => by_rolling.clone(),
        Shared::Camera(_) => DVector::zeros(by_rolling.len()),
    };
    Shot {
        name: track.name.clone(),
        file: track.file.clone(),
        line: track.line,
        labels: track.labels.clone(),
        before: Before::Impact { normal, velocity: [measured(1), measured(2)] },
        spin,
        after: observed
            .map(|(i, observable)| Measurement { observable, measured: measured(Joint::BEFORE + i) })
            .collect(),
        joint: Some(Box::new(Joint { covariance, by_shared: Shared::ALL.map(by_shared).to_vec() })),
        side_sd: 0.0,
    }
}

/// What was extracted from one track, in the order of [`Joint`].
struct Together {
    values: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Covariance with the μ_k of the track.
    with_sliding: DVector<f64>,
    /// And with its lift.
    with_lift: DVector<f64>,
    /// How the values move with μ_r.
    by_rolling: DVector<f64>,
    observed: Vec<Observable>,
}

/// Where a quantity comes from.
#[derive(Clone, Copy)]
enum Source {
    Path(Quantity),
    /// A component of the spins that markers show, of nine.
    Markers(usize),
    /// The spin before the impact as it was played, with its standard deviation.
    Played(f64),
}

impl Together {
    fn of(impact: &Impact) -> Self {
        let rotations = impact.rotations.as_deref();
        let mut sources: Vec<Source> = KEPT[..3].iter().map(|quantity| Source::Path(*quantity)).collect();
        let played = match impact.spin {
            Spin::Measured { sd, .. } => sd.map(|sd| sd.unwrap_or(0.0)),
            _ => [0.0; 3],
        };
        let seen = rotations.is_some_and(|rotations| rotations.cue_before.is_some());
        if impact.spin == Spin::Unknown {
            sources.extend([Quantity::CueSpinX, Quantity::CueSpinY].map(Source::Path));
            sources.push(Source::Played(played[2]));
        } else {
            sources.extend((0..3).map(|i| if seen { Source::Markers(i) } else { Source::Played(played[i]) }));
        }
        sources.extend(KEPT[3..].iter().map(|quantity| Source::Path(*quantity)));
        let mut observed = vec![
            Observable::CueVelocity(Axis::X),
            Observable::CueVelocity(Axis::Y),
            Observable::ObjectVelocity(Axis::X),
            Observable::ObjectVelocity(Axis::Y),
        ];
        if rotations.is_some_and(|rotations| rotations.cue_after.is_some()) {
            sources.extend([3, 4, 5].map(Source::Markers));
            observed.extend(Axis::ALL.map(Observable::CueSpin));
        }
        if rotations.is_some_and(|rotations| rotations.object_after.is_some()) {
            sources.extend([6, 7, 8].map(Source::Markers));
            observed.extend(Axis::ALL.map(Observable::ObjectSpin));
        }
        let spins = rotations.map_or([0.0; 9], |r| {
            let spin =
                |rotation: Option<Rotation>| rotation.map_or([0.0; 3], |rotation| rotation.spin.into());
            let [a, b, c] = [spin(r.cue_before), spin(r.cue_after), spin(r.object_after)];
            [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]]
        });
        let covariance = |a: Source, b: Source, same: bool| match (a, b) {
            (Source::Path(a), Source::Path(b)) => impact.covariance[(a as usize, b as usize)],
            (Source::Markers(a), Source::Markers(b)) => rotations.map_or(0.0, |r| r.covariance[(a, b)]),
            (Source::Markers(a), Source::Path(b)) | (Source::Path(b), Source::Markers(a)) => {
                rotations.map_or(0.0, |r| r.with_path[(a, b as usize)])
            }
            (Source::Played(sd), Source::Played(_)) if same => sd * sd,
            _ => 0.0,
        };
        let n = sources.len();
        let with = |other| DVector::from_fn(n, |i, _| covariance(sources[i], Source::Path(other), false));
        Self {
            values: DVector::from_fn(n, |i, _| match sources[i] {
                Source::Path(quantity) => impact.values[quantity as usize],
                Source::Markers(component) => spins[component],
                Source::Played(_) => 0.0,
            }),
            covariance: DMatrix::from_fn(n, n, |i, j| covariance(sources[i], sources[j], i == j)),
            with_sliding: with(Quantity::Sliding),
            with_lift: with(Quantity::Lift),
            by_rolling: DVector::from_fn(n, |i, _| match sources[i] {
                Source::Path(quantity) => impact.rolling.by[quantity as usize],
                Source::Markers(component) => rotations.map_or(0.0, |r| r.by_rolling[component]),
                Source::Played(_) => 0.0,
            }),
            observed,
        }
    }
}
