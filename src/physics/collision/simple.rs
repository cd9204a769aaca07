//! The impulses to first order in μ: friction keeps its first direction θ₀ and never sticks (Kim
//! 2024, Eqs. 50–54, sign of the cloth's torque corrected). Without friction (μ = 0) it is the
//! inelastic impact, with e = 1 the elastic one.

use super::impact::Impact;
use super::sliding::Ways;
use super::{Number, Regime};

/// Returns q, J_y and J_z. With J = μ(1 + e)k/N: q = (1 + e)k/N · (1 − μm_s sin θ₀/N), J_y = J cos
/// θ₀, J_z = J sin θ₀. The velocities of Eqs. 50–53 follow from these to first order in μ.
#[inline]
pub(super) fn impulses<D: Number>(impact: &Impact<D>) -> ([D; 3], Regime, Ways) {
    let &Impact { k, n, e, m_s, slip, fall, mut mu, .. } = impact;
    let full = (e + 1.0) * k / n;
    let most = slip[0].re().abs().max(slip[1].re().abs());
    if most == 0.0 {
        return ([full, D::from(0.0), D::from(0.0)], Regime::Stick, Ways::default());
    }
    // a square may be out of range
    let [y, z] = [slip[0] / most, slip[1] / most];
    let speed = (y * y + z * z).sqrt();
    if let Some([b, c]) = fall {
        mu += b * (-c * speed * most).exp();
    }
    let j = mu * full;
    let [cos, sin] = [-y / speed, -z / speed];
    ([full * (-mu * m_s * sin / n + 1.0), j * cos, j * sin], Regime::Slide, Ways::default())
}
