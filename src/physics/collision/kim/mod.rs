//! The exact solution of the equations of motion in the impulse, free of singularities.
//!
//! With u the fraction of v_z still left (1 → 0), both components of the slip fall as powers of u,
//! v_z = v_z0 u, v_y = v_y0 u^(1+γ), and everything else is an integral over u. Lengths of the slip
//! are scaled by the first one, ρ = |v_∥0|, and impulses by ρ/2μβ_z:
//!
//! | symbol | meaning |
//! | --- | --- |
//! | n, m, p | v_z0²/ρ², v_y0²/ρ², 2γ |
//! | g(u) | √(n + m u^p), so that v_∥ = ρ u g |
//! | d | 1 − u |
//! | Q | ∫ g ds from u to 1; q = (ρ/2μβ_z) Q |
//! | K, Σ | 2μβ_z k/ρ, m_s μ v_z0/ρ, so that v_x ∝ v = −K + 2Q − Σd |
//! | w | ∫ v dQ; restitution ends where w = (1 − e²) w_c (Kim 2024, Eq. 37) |
//! | F | Q at u = 0, where the contact sticks |
//!
//! Each case is one file: without friction of the cloth [`free`], with it [`cloth`], the whole slip
//! [`whole`], all on the [`path`] of the slip; the derivatives are in [`gradient`]. Most impacts need none of their
//! care, and are solved by [`usual`] in a third of the time.
//!
//! The paper's own form with v̄ (Eq. 24) and ₂F₁ (Eqs. 29–30) solves the same equations, but breaks
//! down where v_y0 or v_z0 is 0 and where ₂F₁ has poles.

// an impact takes some 400 cycles: a branch too many tells
#![allow(clippy::needless_bitwise_bool)]

mod cloth;
mod free;
mod gradient;
mod path;
mod side_by_side;
mod usual;
mod whole;

use super::{Contact, Impulse, ImpulseGradient, Regime, SQUARES, length, variable};
use path::{Path, Slip};

/// Newton's method converges from one side; each step at least divides u or squares the error, so
/// that this many are never reached: the tests count them.
const MAX_STEPS: usize = 100;

/// A step of this part of the slip left is finished to third order, with an error below 1e-16.
const CLOSE: f64 = 3e-4;

/// This part of an integral is lost in its roundings, which can be more than what is left of the slip.
const ROUNDING: f64 = 4e-16;

/// With so little of the slip left the contact has stuck, to rounding.
const STUCK: f64 = 1e-20;

/// A step of Newton's method takes at most this part of the slip left, or of what is gone back.
const MOST: f64 = 0.9;

/// Stands in for μ = 0 in derivatives with respect to μ, where q and Q vanish together.
const TINY_MU: f64 = 1e-60;

/// Stands in for e = 0 in derivatives with respect to e, where restitution has no length.
const TINY_E: f64 = 1e-18;

#[inline]
pub(super) fn impulse(contact: &Contact) -> (Impulse, Regime) {
    let (path, rho) = start(contact);
    let usual = usual::solve(contact, &path, rho);
    if usual.holds {
        return (usual.impulse(contact, &path), Regime::Slide);
    }
    let end = solve(contact, &path, rho);
    (end.impulse(contact), end.regime())
}

#[inline]
pub(super) fn impulse_and_gradient(contact: &Contact) -> ((Impulse, Regime), ImpulseGradient) {
    let (path, rho) = start(contact);
    let usual = usual::solve(contact, &path, rho);
    let regular = contact.mu >= TINY_MU && contact.e >= TINY_E && SPEEDS.contains(&contact.k);
    if usual.holds {
        let solution = (usual.impulse(contact, &path), Regime::Slide);
        let gradient = if regular {
            gradient::of_slide(contact, &path, rho, &usual.slips(&path))
        } else {
            regular_gradient(contact)
        };
        return (solution, gradient);
    }
    let end = solve(contact, &path, rho);
    let gradient = if regular { gradient::gradient(contact, &end) } else { regular_gradient(contact) };
    ((end.impulse(contact), end.regime()), gradient)
}

/// At μ = 0 or e = 0 the derivative from above; speeds in units of k, of which everything is a multiple.
#[cold]
fn regular_gradient(contact: &Contact) -> ImpulseGradient {
    let &Contact { k, v_y, v_z, mu, e, .. } = contact;
    let unit =
        Contact { k: 1.0, v_y: v_y / k, v_z: v_z / k, mu: mu.max(TINY_MU), e: e.max(TINY_E), ..*contact };
    let (path, rho) = start(&unit);
    let mut gradient = gradient::gradient(&unit, &solve(&unit, &path, rho));
    for of in [&mut gradient.normal, &mut gradient.y, &mut gradient.z] {
        for coefficient in [variable::MU, variable::M_S, variable::E] {
            of[coefficient] *= k;
        }
    }
    gradient
}

/// Of an impact that slides to its end.
#[derive(Clone, Copy, Debug)]
struct Slips {
    end: Slip,
    /// With topspin, compression took the slip to here
    compressed: Slip,
    /// and restitution from there on to this part of it.
    restored: Slip,
}

/// How an impact ends.
#[derive(Clone, Copy, Debug)]
enum End {
    /// Still sliding.
    Slide { q: f64, slips: Slips },
    /// Stuck, either before (`None`) or after the end of compression.
    Stick { q: f64, compressed: Option<Slip> },
}

impl End {
    #[inline]
    fn regime(&self) -> Regime {
        match self {
            Self::Slide { .. } => Regime::Slide,
            Self::Stick { .. } => Regime::Stick,
        }
    }

    /// J_y = (v_y(q_f) − v_y0)/2β_y, J_z = (v_z(q_f) − v_z0)/2β_z (Eq. 57).
    #[inline]
    fn impulse(&self, contact: &Contact) -> Impulse {
        let (y, z) = (contact.v_y / (2.0 * contact.beta_y()), contact.v_z / (2.0 * contact.beta_z()));
        match self {
            Self::Slide { q, slips: Slips { end, .. } } => {
                Impulse { normal: *q, y: -y * end.y_gone(), z: -z * end.gone }
            }
            Self::Stick { q, .. } => Impulse { normal: *q, y: -y, z: -z },
        }
    }
}

#[inline]
fn solve(contact: &Contact, path: &Path, rho: f64) -> End {
    if rho == 0.0 {
        return End::Stick { q: 0.5 * (1.0 + contact.e) * contact.k, compressed: None };
    }
    if contact.v_z > 0.0 { cloth::solve(contact, path, rho) } else { free::solve(contact, path, rho) }
}

/// The path of the slip and ρ.
#[inline]
fn start(contact: &Contact) -> (Path, f64) {
    let &Contact { v_y, v_z, .. } = contact;
    let (y2, z2) = (v_y * v_y, v_z * v_z);
    let square = y2 + z2;
    let p = 2.0 * contact.gamma();
    if SQUARES.contains(&square) {
        // not from ρ, for which they would wait
        return (Path { n: z2 / square, m: y2 / square, p }, square.sqrt());
    }
    let rho = length(v_y, v_z);
    let (y, z) = (v_y / rho, v_z / rho);
    (Path { n: z * z, m: y * y, p }, rho)
}

/// Speeds whose squares stay in range, with room for μ and e.
const SPEEDS: std::ops::Range<f64> = 1e-100..1e100;

#[cfg(test)]
mod tests {
    use crate::physics::ball::Ball;
    use crate::physics::collision::steps;
    use crate::physics::collision::{Fidelity, Model};

    /// The start is good to fourth order and the end is a series: usually one step, more where the contact
    /// is about to stick, where each leaves at least a tenth of the slip.
    const MOST_STEPS: usize = 20;

    #[test]
    fn hard_cases_take_few_steps() {
        // once by the polynomial of the sphere, once by quadrature
        for inertia in [Ball::POOL.inertia, 0.41] {
            let ball = Ball { inertia, ..steps::HARD };
            let (most, name) = steps::most_of_hard_cases(&Model::new(Fidelity::Full, ball));
            assert!(most <= MOST_STEPS, "{most} steps: {name} at nu {inertia}");
        }
    }
}
