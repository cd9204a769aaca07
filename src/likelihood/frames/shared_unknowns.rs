//! The unknowns that all shots of a film share besides the parameters of the collision: one entry in one list for each.
//!
//! How to add one stands in the documentation of `fit`.

use super::{CLOTH, CLOTH_BOUNDS, SHARED, Shared, place_of};
use crate::measurement::correction::Correction;
use crate::measurement::parameter::Parameter;
use crate::measurement::values::Values;
use crate::physics::cloth_motion::Cloth;

/// Which unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// The cloth's sliding friction μ_k.
    Sliding,
    /// Its rolling resistance μ_r.
    Rolling,
    /// Its bounce e_t: the part of its upward velocity that a ball keeps when it lands.
    Bounce,
    /// By how much a correction of the camera is off.
    Camera(Correction),
}

impl Kind {
    /// Its place among what all shots share.
    #[must_use]
    pub fn place(self) -> usize {
        match self {
            Self::Sliding => 3,
            Self::Rolling => 4,
            Self::Bounce => 5,
            Self::Camera(correction) => SHARED + correction as usize,
        }
    }

    /// As in fit.json.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Sliding => "mu_k",
            Self::Rolling => "mu_r",
            Self::Bounce => "bounce",
            Self::Camera(correction) => correction.name(),
        }
    }
}

/// An unknown of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SharedUnknown {
    /// Which unknown it is.
    pub kind: Kind,
    /// Where the search begins.
    pub start: f64,
    /// What is known beforehand: mean and standard deviation.
    pub prior: (f64, f64),
    /// The lower and the upper bound.
    pub bounds: [f64; 2],
}

impl SharedUnknown {
    /// As much as is usually known of it. A correction is counted from where the camera is: `known` is where the prior's mean lies
    /// from there.
    #[must_use]
    pub fn usual(kind: Kind, known: f64) -> Self {
        /// Of the bounce, between none and all: cloths keep about half.
        const BOUNCE: (f64, f64) = (0.5, 0.2);
        let (start, prior, bounds) = match kind {
            Kind::Sliding => (CLOTH[0].0, CLOTH[0], CLOTH_BOUNDS[0]),
            Kind::Rolling => (CLOTH[1].0, CLOTH[1], CLOTH_BOUNDS[1]),
            Kind::Bounce => (BOUNCE.0, BOUNCE, [0.0, 0.95]),
            Kind::Camera(correction) => {
                let usual = correction.usual();
                (0.0, (known, usual), [f64::NEG_INFINITY, f64::INFINITY])
            }
        };
        Self { kind, start, prior, bounds }
    }
}

/// The list of a fit: μ_k and μ_r first, then what else is free.
#[must_use]
pub fn of_fit(others: impl Iterator<Item = SharedUnknown>) -> Vec<SharedUnknown> {
    let cloth = [Kind::Sliding, Kind::Rolling].map(|kind| SharedUnknown::usual(kind, 0.0));
    cloth.into_iter().chain(others).collect()
}

/// What all shots share where the unknowns of the list have these values; the others are as usual.
#[must_use]
pub fn shared(of_parameters: &Values, list: &[SharedUnknown], values: &[f64]) -> Shared {
    let mut shared = [0.0; super::ALL_SHARED];
    for parameter in Parameter::ALL {
        shared[place_of(parameter)] = of_parameters[parameter];
    }
    let Cloth { sliding, rolling, bounce } = Cloth::default();
    shared[3..SHARED].copy_from_slice(&[sliding, rolling, bounce]);
    for (unknown, value) in list.iter().zip(values) {
        shared[unknown.kind.place()] = *value;
    }
    shared
}
