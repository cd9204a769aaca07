//! First order in μ: the friction keeps its first direction θ₀ and never sticks
//! (Kim 2024, Eqs. 50–54, sign of the cloth's torque corrected).

use super::{Contact, Gradient, Impulse, ImpulseGradient, Regime, length, variable};

/// With J = μ(1 + e)k/2: q = (1 + e)k/2 · (1 − μm_s sin θ₀/2), J_y = J cos θ₀, J_z = J sin θ₀.
/// The velocities of Eqs. 50–53 follow from these to first order in μ.
#[inline]
pub(super) fn impulse(contact: &Contact) -> (Impulse, Regime) {
    let Some([cos, sin]) = direction(contact) else {
        let normal = 0.5 * (1.0 + contact.e) * contact.k;
        return (Impulse { normal, y: 0.0, z: 0.0 }, Regime::Stick);
    };
    let full = 0.5 * (1.0 + contact.e) * contact.k;
    let j = contact.mu * full;
    let normal = full * (1.0 - 0.5 * contact.mu * contact.m_s * sin);
    (Impulse { normal, y: j * cos, z: j * sin }, Regime::Slide)
}

#[inline]
pub(super) fn gradient(contact: &Contact) -> ImpulseGradient {
    let Contact { k, v_y, v_z, mu, m_s, e, .. } = *contact;
    let Some([cos, sin]) = direction(contact) else {
        return super::inelastic::gradient(contact);
    };
    // full = (1 + e)k/2
    let full = 0.5 * (1.0 + e) * k;
    let mut d_full = Gradient::zeros();
    d_full[variable::K] = 0.5 * (1.0 + e);
    d_full[variable::E] = 0.5 * k;
    // cos θ₀ = −v_y/v, sin θ₀ = −v_z/v turn by dθ: d cos = −sin dθ, d sin = cos dθ,
    // dθ = (v_y dv_z − v_z dv_y)/v²
    let j = mu * full;
    let turn = j / length(v_y, v_z);
    let mut j_d_theta = Gradient::zeros();
    j_d_theta[variable::V_Y] = sin * turn;
    j_d_theta[variable::V_Z] = -cos * turn;
    let (j_d_cos, j_d_sin) = (-sin * j_d_theta, cos * j_d_theta);
    // J = μ full
    let mut d_j = mu * d_full;
    d_j[variable::MU] = full;
    // q = full (1 − μ m_s sin θ₀/2)
    let mut d_normal = (1.0 - 0.5 * mu * m_s * sin) * d_full - 0.5 * m_s * j_d_sin;
    d_normal[variable::MU] -= 0.5 * full * m_s * sin;
    d_normal[variable::M_S] -= 0.5 * full * mu * sin;
    ImpulseGradient { normal: d_normal, y: cos * d_j + j_d_cos, z: sin * d_j + j_d_sin }
}

/// (cos θ₀, sin θ₀), or `None` without slip at first contact.
#[inline]
fn direction(contact: &Contact) -> Option<[f64; 2]> {
    let v = length(contact.v_y, contact.v_z);
    (v > 0.0).then(|| [-contact.v_y / v, -contact.v_z / v])
}
