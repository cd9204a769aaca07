//! Topspin: the object ball is pressed into the cloth (case B; where it sticks, case C).
//!
//! In the scaled quantities of [`super`], at u = 1 − d,
//! v = −K + 2Q − Σd and w = ∫ v dQ = Q² − KQ − ΣP, P = ∫ (1 − s) g ds.
//! Compression ends at u_c, where v = 0; restitution at u_f, where w = (1 − e²) w_c.

use super::path::{Descent, Path, Slip, third_order};
use super::whole::whole;
use super::{CLOSE, End, MAX_STEPS, MOST, ROUNDING, STUCK, Slips};
use crate::physics::collision::Contact;
use crate::physics::collision::steps;

/// In restitution w sets out as a square: the same for this part of the way gone.
const CLOSE_TO_SQUARE: f64 = 1e-4;

/// Below this K the way is too short for the slip to turn, to rounding.
const FIRST_ORDER: f64 = 1e-20;

/// With less than this left of the slip, differences of integrals over all of it lose the digits of what is left.
const LITTLE: f64 = 1e-3;

pub(super) fn solve(contact: &Contact, path: &Path, rho: f64) -> End {
    let &Contact { k, e, mu, m_s, v_z, .. } = contact;
    let beta_z = contact.beta_z();
    // K = 2μβ_z k/ρ, Σ = m_s μ v_z0/ρ, q = Q ρ/2μβ_z
    let unit = rho / (2.0 * mu * beta_z);
    let kk = 2.0 * mu * beta_z * (k / rho);
    let sigma = m_s * mu * (v_z / rho);
    if kk < FIRST_ORDER {
        // v = −K + (2 − Σ)d, w = d(v − K)/2
        let d_c = kk / (2.0 - sigma);
        let slip = Slip::short((1.0 + e) * d_c, path.p);
        let [compressed, restored] = [d_c, e * d_c].map(|d| Slip::short(d, path.p));
        let slips = Slips { end: slip, compressed, restored };
        return End::Slide { q: (1.0 + e) * k / (2.0 - sigma), slips };
    }
    // Q_f ≤ (1 + e)(K + Σ)/2 + Σ
    let mut stuck = None;
    if 0.5 * (1.0 + e) * (kk + sigma) + sigma >= path.whole_at_least() {
        let (q_s, uq_s) = whole(path);
        let v_s = -kk + 2.0 * q_s - sigma;
        if v_s <= 0.0 {
            return stuck_in_compression(contact, kk, sigma, uq_s);
        }
        stuck = Some((q_s, uq_s, v_s));
    }
    let Some(c) = compression(path, kk, sigma) else {
        // the end of compression and stick coincide to rounding
        return stuck_in_compression(contact, kk, sigma, whole(path).1);
    };
    // −w_c = Q_c² − Σ∫(s − u_c) g ds, since K = 2Q_c − Σd_c
    let lost = c.q * c.q - sigma * (c.slip.gone * c.q - c.r);
    if let Some((q_s, uq_s, v_s)) = stuck {
        // w_s − w_c = (Q_s − Q_c)² − Σ∫(u_c − s) g ds from 0 to u_c
        let (dq, r) = if c.slip.left < LITTLE {
            let left = c.slip.left;
            let (q, uq) = whole(&path.from(&c.slip, c.g));
            let dq = left * c.g * q;
            (dq, left * (dq - left * c.g * uq))
        } else {
            let dq = q_s - c.q;
            (dq, c.slip.left * dq - (uq_s - (c.q - c.r)))
        };
        let rest = e * e * lost - (dq * dq - sigma * r);
        if rest >= 0.0 {
            // once stuck, v = v_s + 2y: v_s y + y² = rest
            let y = 2.0 * rest / (v_s + (v_s * v_s + 4.0 * rest).sqrt());
            return End::Stick { q: (q_s + y) * unit, compressed: Some(c.slip) };
        }
    }
    if e == 0.0 {
        let slips = Slips { end: c.slip, compressed: c.slip, restored: Slip::START };
        return End::Slide { q: c.q * unit, slips };
    }
    // from u_c on, in units of u_c and g_c: w/(u_c g_c)² = Q² − Σ'R = T²
    let rest = c.slip.left * c.g;
    let target = e * lost.sqrt() / rest;
    match restitution(&path.from(&c.slip, c.g), sigma / c.g, target) {
        Some(f) => End::Slide {
            q: (c.q + rest * f.q) * unit,
            slips: Slips { end: c.slip.then(&f.slip), compressed: c.slip, restored: f.slip },
        },
        // the end of restitution and stick coincide to rounding
        None => {
            let q_s = stuck.map_or_else(|| whole(path).0, |(q_s, ..)| q_s);
            End::Stick { q: q_s * unit, compressed: Some(c.slip) }
        }
    }
}

/// Stuck before the end of compression. From there on w = Q² − (K + Σ)Q + B, B = Σ∫₀¹ s g ds, so that
/// Q_c = (K + Σ)/2 and Q_f = Q_c + e√(Q_c² − B): in units of K, which may be huge.
fn stuck_in_compression(contact: &Contact, kk: f64, sigma: f64, uq_s: f64) -> End {
    let a = sigma / kk;
    let q_c = 0.5 * (1.0 + a);
    let b = a * (uq_s / kk);
    let q = q_c + contact.e * (q_c * q_c - b).max(0.0).sqrt();
    End::Stick { q: contact.k * q, compressed: None }
}

/// Where 2Q − Σd = K. `None` if nothing is left of the slip there.
#[inline]
pub(super) fn compression(path: &Path, kk: f64, sigma: f64) -> Option<Descent> {
    let mut tau = path.invert(kk / (2.0 - sigma), sigma);
    for step in 0..MAX_STEPS {
        steps::record(step);
        let at = path.descend(tau);
        let Slip { gone, left, .. } = at.slip;
        if left < STUCK {
            return None;
        }
        let [x, length] = step_to_compression(path, &at, kk, sigma);
        if x.abs() <= CLOSE * left {
            return Some(compressed(path, &at, length, kk, sigma));
        }
        if x.abs() * at.g <= ROUNDING * gone {
            return Some(at);
        }
        // f is concave: from the second step on Newton's method comes from below
        tau -= (-x.clamp(-MOST * gone, MOST * left) / left).ln_1p();
    }
    None
}

/// Steps of first and of third order to the end of compression.
#[inline(always)]
fn step_to_compression(path: &Path, at: &Descent, kk: f64, sigma: f64) -> [f64; 2] {
    // f = 2Q − Σd: f' = 2g − Σ, f'' = −2tg, f''' = −2tg[(1 − p)/u + t]
    let slope = 1.0 / (2.0 * at.g - sigma);
    let x = (kk - 2.0 * at.q + sigma * at.slip.gone) * slope;
    let t = path.turn(at);
    let a = -t * at.g * slope;
    let b = a * ((1.0 - path.p) / at.slip.left + t) * (1.0 / 3.0);
    [x, third_order(x, a, b)]
}

/// The end of compression a small step from here.
#[inline(always)]
fn compressed(path: &Path, at: &Descent, step: f64, kk: f64, sigma: f64) -> Descent {
    let end = path.finish(at, step);
    Descent { q: 0.5 * (kk + sigma * end.slip.gone), ..end }
}

/// Steps of first and of third order to the end of restitution.
#[inline(always)]
fn step_to_restitution(path: &Path, at: &Descent, sigma: f64, target: f64) -> [f64; 2] {
    let w = at.q * at.q - sigma * at.r;
    // f = w: f' = vg, f'' = (2g − Σ)g − vtg, f''' = −2tg² − 2(2g − Σ)tg − vtg[(1 − p)/u + t]
    let per_v = 1.0 / (2.0 * at.q - sigma * at.slip.gone);
    let x = (target * target - w) * per_v / at.g;
    let t = path.turn(at);
    let slope = 2.0 * at.g - sigma;
    let a = 0.5 * (slope * per_v - t);
    let b = -t * (2.0 * (at.g + slope) * per_v + (1.0 - path.p) / at.slip.left + t) * (1.0 / 6.0);
    [x, third_order(x, a, b)]
}

/// Where Q² − ΣR = T², behind the end of compression. `None` if nothing is left of the slip there.
fn restitution(path: &Path, sigma: f64, target: f64) -> Option<Descent> {
    if target < FIRST_ORDER {
        // w = d²(1 − Σ/2)
        let d = target / (1.0 - 0.5 * sigma).sqrt();
        return Some(Descent { slip: Slip::short(d, path.p), g: 1.0, q: d, r: 0.0 });
    }
    // R ≈ Q²/2
    let mut tau = path.invert(target / (1.0 - 0.5 * sigma).sqrt(), 0.0);
    for step in 0..MAX_STEPS {
        steps::record(step);
        let at = path.descend(tau);
        let Slip { gone, left, .. } = at.slip;
        if left < STUCK {
            return None;
        }
        let [x, length] = step_to_restitution(path, &at, sigma, target);
        if x.abs() <= CLOSE_TO_SQUARE * gone.min(left) {
            return Some(path.finish(&at, length));
        }
        if x.abs() * at.g <= ROUNDING * gone {
            return Some(at);
        }
        // √w grows almost linearly
        let root = (at.q * at.q - sigma * at.r).max(0.0).sqrt();
        let v = 2.0 * at.q - sigma * gone;
        let x = 2.0 * root * (target - root) / (v * at.g);
        tau -= (-x.clamp(-MOST * gone, MOST * left) / left).ln_1p();
    }
    None
}

#[cfg(test)]
mod tests {
    use crate::physics::ball::{Ball, BallState, Vec3};
    use crate::physics::collision::{Coefficients, Fidelity, Model};

    /// Compression ends where all but this part of the slip is gone: what restitution takes is many times what is left, but the
    /// contact has not stuck before.
    #[test]
    fn contacts_that_stick_just_after_compression() {
        /// Of ode at 1e-12, per m/s.
        const INTEGRATED: f64 = 1e-9;
        let (mu, mu_s) = (0.2, 1.0);
        let radius = Ball::POOL.radius;
        for (left, e) in [(1e-3, 0.94), (1e-9, 0.94), (1e-6, 1e-3), (1.5e-12, 3e-9), (1e-10, 1e-7)] {
            for across in [0.0, 1e-6, 1.0] {
                // K = 2μβ_z k/ρ = (2 − Σ)(1 − left) with β_z = 1.75 and Σ = 0.2 where v_y = 0
                let v_z = 2.0 * mu * 1.75 / (1.8 * (1.0 - left));
                let spin = Vec3::new(0.0, v_z / radius, -across * v_z / radius);
                let cue = BallState { velocity: Vec3::new(1.0, 0.0, 0.0), spin };
                let coefficients = Coefficients { mu, mu_s, e };
                let [full, ode] = [Fidelity::Full, Fidelity::Ode].map(|fidelity| {
                    let model = Model { tolerance: 1e-12, ..Model::new(fidelity, Ball::POOL) };
                    let model = Model { effects: Fidelity::Full.effects(), ..model };
                    model.collide(&cue, &coefficients).unwrap()
                });
                let apart = full.object.velocity - ode.object.velocity;
                assert!(apart.amax() < INTEGRATED, "{left} {e} {across}: {apart:?}");
            }
        }
    }
}
