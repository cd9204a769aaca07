//! The impulses to first order in μ: friction keeps its first direction θ₀ and never sticks (Kim 2024, Eqs. 50–54, sign of the
//! cloth's torque corrected). Without friction (μ = 0) it is the inelastic impact, with e = 1 the elastic one.

use super::impact::{Impact, Impulses};
use super::{Number, Regime};

/// With J = μ(1 + e)k/N: q = (1 + e)k/N · (1 − μm_s sin θ₀/N), J_y = J cos θ₀, J_z = J sin θ₀.
/// The velocities of Eqs. 50–53 follow from these to first order in μ.
#[inline]
pub(super) fn impulses<D: Number>(impact: &Impact<D>) -> (Impulses<D>, Regime) {
    let &Impact { k, n, e, m_s, .. } = impact;
    let full = (e + 1.0) * k / n;
    let Some((mu, [cos, sin])) = impact.first_friction() else {
        let none = D::from(0.0);
        return (Impulses { q: full, y: none, z: none }, Regime::Stick);
    };
    let j = mu * full;
    let q = full * (-mu * m_s * sin / n + 1.0);
    (Impulses { q, y: j * cos, z: j * sin }, Regime::Slide)
}
