//! No friction, no loss: the balls exchange their velocities along the line of centres.

use super::{Contact, Impulse, ImpulseGradient, Regime, variable};

/// q = k.
#[inline]
pub(super) fn impulse(contact: &Contact) -> (Impulse, Regime) {
    (Impulse { normal: contact.k, y: 0.0, z: 0.0 }, Regime::Slide)
}

#[inline]
pub(super) fn gradient() -> ImpulseGradient {
    let mut gradient = ImpulseGradient::zero();
    gradient.normal[variable::K] = 1.0;
    gradient
}
