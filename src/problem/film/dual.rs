//! Numbers with their derivatives by a shot's own unknowns and by the shared ones that move the
//! balls.

use nalgebra::{Const, SVector, Vector2};
use num_dual::{Derivative, DualSVec64};

use super::own::MOVING;
use crate::physics::cloth_motion;
use crate::problem::unknowns::{Id, PHYSICS, Shared};

/// Number of inputs of a shot's motion: that before the impact, and the shared unknowns.
pub(in crate::problem) const INPUTS: usize = MOVING + PHYSICS;

/// A number with its derivatives by the inputs.
pub(in crate::problem) type Dual = DualSVec64<INPUTS>;

/// A horizontal vector with the derivatives of its components.
pub(in crate::problem) type DualVector = Vector2<Dual>;

/// Derivatives by the inputs.
pub(in crate::problem) type Gradient = SVector<f64, INPUTS>;

/// Returns the derivatives of `value`.
pub(in crate::problem) fn gradient<const N: usize>(value: &DualSVec64<N>) -> SVector<f64, N> {
    value.eps.unwrap_generic(Const, Const)
}

/// Returns a number with this gradient.
pub(in crate::problem) fn with_gradient(value: f64, gradient: &Gradient) -> Dual {
    Dual::new(value, Derivative::some(*gradient))
}

/// Returns a number without derivatives.
pub(in crate::problem) fn constant<const N: usize>(value: f64) -> DualSVec64<N> {
    DualSVec64::from_re(value)
}

/// Speed below which directions are smoothed, m/s: a ball that slips less moves by 3 nm until it
/// rolls, so that no frame sees it.
pub(in crate::problem) const SMOOTH_SPEED: f64 = 1e-4;

/// Returns the length of a velocity, smooth at 0: the direction `v / norm(v)` of a slip that ends
/// has bounded derivatives.
pub(in crate::problem) fn norm(v: &DualVector) -> Dual {
    cloth_motion::norm(v, SMOOTH_SPEED)
}

impl Shared {
    /// Returns an unknown of the balls' motion with its derivative.
    pub(in crate::problem) fn dual(&self, id: Id) -> Dual {
        Dual::from_re(self[id]).derivative(MOVING + id as usize)
    }
}
