//! No friction: the only loss is that of the restitution.

use super::{Contact, Impulse, ImpulseGradient, Regime, variable};

/// q = (1 + e)k/2.
#[inline]
pub(super) fn impulse(contact: &Contact) -> (Impulse, Regime) {
    (Impulse { normal: 0.5 * (1.0 + contact.e) * contact.k, y: 0.0, z: 0.0 }, Regime::Slide)
}

#[inline]
pub(super) fn gradient(contact: &Contact) -> ImpulseGradient {
    let mut gradient = ImpulseGradient::zero();
    gradient.normal[variable::K] = 0.5 * (1.0 + contact.e);
    gradient.normal[variable::E] = 0.5 * contact.k;
    gradient
}
