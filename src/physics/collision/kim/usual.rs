//! The usual solution, without a branch and hardly a wait: the contact slides, on a way short enough that
//! the end of the impact is one step of Newton's method from where the series puts it. What is not usual is left
//! to [`super::cloth`] and [`super::free`], which solve the same equations step by step.

use wide::f64x2;

use super::free::Sphere;
use super::path::{Path, Slip, third_order};
use super::side_by_side::{descents, within_reach};
use super::{CLOSE, Slips};
use crate::physics::collision::{Contact, Impulse};

/// So near to the end of compression, in parts of the slip left, w is a parabola to rounding.
const CLOSE_TO_PARABOLA: f64 = 1e-5;

/// In restitution w sets out as a square: a step of third order of this part of the way is exact to rounding.
const CLOSE_TO_SQUARE: f64 = 1e-4;

/// So short a way is left to the branches of [`super::cloth`].
const SHORT: f64 = 1e-9;

/// Below this e the difference of w between both ends of restitution loses digits.
const LEAST_E: f64 = 0.5;

/// The series for ∛(1 − d) is good to here.
const FARTHEST: f64 = 0.62;

/// A point of the path and a step from there, of the part x = Δd/u of what is left.
#[derive(Clone, Copy, Debug)]
struct Near {
    slip: Slip,
    x: f64,
}

impl Near {
    #[inline(always)]
    fn slip(&self, path: &Path) -> Slip {
        self.slip.finish(self.x, path.p)
    }

    /// 1 − u.
    #[inline(always)]
    fn gone(&self) -> f64 {
        self.slip.gone + self.slip.left * self.x
    }

    /// 1 − u^(1+γ).
    #[inline(always)]
    fn y_gone(&self, path: &Path) -> f64 {
        let (Slip { gone, power_gone, left, power, .. }, x) = (self.slip, self.x);
        let (gamma, root) = (0.5 * path.p, power.sqrt());
        // 1 − (1 − x)^(1+γ) = (1 + γ)x[1 − γx/2 (1 + (1 − γ)x/3 …)]
        let lost = (1.0 + gamma) * x * (1.0 - 0.5 * gamma * x * (1.0 + (1.0 - gamma) * (1.0 / 3.0) * x));
        // as `Slip::y_gone`
        gone + left * (power_gone / (1.0 + root)) + left * root * lost
    }
}

/// A solution without a branch.
pub(super) struct Usual {
    /// Otherwise it is none.
    pub holds: bool,
    q: f64,
    end: Near,
    compressed: Near,
}

impl Usual {
    /// J_y = (v_y(q_f) − v_y0)/2β_y, J_z = (v_z(q_f) − v_z0)/2β_z (Eq. 57).
    #[inline(always)]
    pub fn impulse(&self, contact: &Contact, path: &Path) -> Impulse {
        let (y, z) = (contact.v_y / (2.0 * contact.beta_y()), contact.v_z / (2.0 * contact.beta_z()));
        Impulse { normal: self.q, y: -y * self.end.y_gone(path), z: -z * self.end.gone() }
    }

    #[inline(always)]
    pub fn slips(&self, path: &Path) -> Slips {
        let (end, compressed) = (self.end.slip(path), self.compressed.slip(path));
        Slips { end, compressed, restored: end.since(&compressed) }
    }
}

#[inline(always)]
pub(super) fn solve(contact: &Contact, path: &Path, rho: f64) -> Usual {
    if contact.v_z > 0.0 { with_cloth(contact, path, rho) } else { without_cloth(contact, path, rho) }
}

/// Case B: both ends of restitution from one pair of stretches.
#[inline(always)]
fn with_cloth(contact: &Contact, path: &Path, rho: f64) -> Usual {
    let &Contact { k, e, mu, m_s, v_z, .. } = contact;
    let &Path { m, p, .. } = path;
    // K = 2μβ_z k/ρ, Σ = m_s μ v_z0/ρ, as in `cloth::solve`
    let twice = 2.0 * mu * contact.beta_z();
    let slope = m_s * mu * v_z;
    let per_rho = 1.0 / rho;
    let (kk, sigma) = (k * twice * per_rho, slope * per_rho);
    let per = 1.0 / (2.0 * rho - slope);
    let slides = 0.5 * (1.0 + e) * (kk + sigma) + sigma < path.whole_at_least();
    // v = 0 at ∫ (g − Σ/2) ds = h(1 − Σ/2). Then w = ∫ v/2 · g/(g − Σ/2) dv, and since 1/g ≈ 1 + γmd, restitution
    // ends at v = eK(1 − Σγm d_f/6), d_f ≈ (1 + e)h
    let h = k * twice * per;
    let (num_c, den_c) = path.inverse(h, rho * per);
    let (num_f, den_f) =
        path.inverse(h * (1.0 + e) * (1.0 - (e * sigma * p * m * (1.0 / 12.0)) * h), rho * per);
    // τ = 2 artanh (u₀ − u)/(u₀ + u)
    let (u_c, u_f) = ((den_c - num_c) * den_f, (den_f - num_f) * den_c);
    let z = f64x2::new([num_c, u_c - u_f]) / f64x2::new([2.0 * den_c - num_c, u_c + u_f]);
    let z2 = z * z;
    let tau = z * (z2 * (2.0 / 3.0) + 2.0 + z2 * z2 * (z2 * (2.0 / 7.0) + 0.4));
    let [c, f] = descents(path, tau);
    // the end of compression, to second order
    let per_c = 1.0 / (c.slip.left * c.g);
    let slope = 2.0 * c.g - sigma;
    let x = (kk - 2.0 * c.q + sigma * c.slip.gone) / slope;
    let turn = 0.5 * p * m * (c.slip.power * c.slip.left) * (per_c * per_c);
    let to_c = x * (1.0 + turn * c.g / slope * x);
    let close_c = x.abs() <= CLOSE_TO_PARABOLA * c.slip.left;
    // w = Q² − KQ − ΣR is least there: dw/dd = vg, d²w/dd² = (2g − Σ)g
    let lost = c.q * (kk - c.q) + sigma * c.r + 0.5 * slope * c.g * x * x;
    // both stretches together
    let u = c.slip.left;
    let slip = c.slip.then(&f.slip);
    let (q, r) = (c.q + u * f.q, c.r + u * (c.slip.gone * f.q + u * f.r));
    // and from there to the end of restitution, as in `cloth::restitution`
    let per_f = 1.0 / (slip.left * f.g);
    let v = 2.0 * q - kk - sigma * slip.gone;
    let per_vg = 1.0 / (v * f.g);
    let x = (q * (kk - q) + sigma * r - (1.0 - e) * (1.0 + e) * lost) * per_vg;
    let close_f = x.abs() <= CLOSE_TO_SQUARE * (u * f.slip.gone).min(slip.left);
    let turn = 0.5 * p * m * (slip.power * slip.left) * (per_f * per_f);
    let curve = (1.0 - p) * f.g * per_f + turn;
    let slope = 2.0 * f.g - sigma;
    let per_v = per_vg * f.g;
    let a = 0.5 * (slope * per_v - turn);
    let b = -turn * (2.0 * (f.g + slope) * per_v + curve) * (1.0 / 6.0);
    let to_f = third_order(x, a, b);
    let q = q + f.g * to_f * (1.0 - 0.5 * turn * to_f * (1.0 + curve * to_f * (1.0 / 3.0)));
    let long = (kk >= SHORT) & (e >= LEAST_E);
    Usual {
        holds: slides & close_c & close_f & long & within_reach(path, c.slip.tau.max(f.slip.tau)),
        q: q * (rho / twice),
        end: Near { slip, x: to_f * f.g * per_f },
        compressed: Near { slip: c.slip, x: to_c * c.g * per_c },
    }
}

/// Case A, for a uniform sphere.
#[inline(always)]
fn without_cloth(contact: &Contact, path: &Path, rho: f64) -> Usual {
    let &Contact { k, e, mu, .. } = contact;
    let &Path { n: _, m, p } = path;
    // q_f = (1 + e)k/2, h = 2μβ_z q_f/ρ
    let q = 0.5 * (1.0 + e) * k;
    let h = 2.0 * mu * contact.beta_z() * q / rho;
    let (num, den) = path.inverse(h, 0.5);
    // x = 1 − ∛(1 − d) = (27d − 27d² + 5d³)/(81 − 108d + 36d² − 2d³) (Padé) and the same for √(1 − mx) give
    // ζ = x/(1 + √(1 − mx)) = x(16 − 12mx + m²x²)/2(4 − mx)(4 − 3mx)
    let (num2, den2) = (num * num, den * den);
    let above = num * (27.0 * den * (den - num) + 5.0 * num2);
    let below = den2 * (81.0 * den - 108.0 * num) + num2 * (36.0 * den - 2.0 * num);
    let mx = m * above;
    let z = above * (below * (16.0 * below - 12.0 * mx) + mx * mx)
        / (2.0 * below * ((4.0 * below - mx) * (4.0 * below - 3.0 * mx)));
    // w = √(n + my), y, d = 1 − y³
    let w = 1.0 - m * z;
    let y_gone = z * (1.0 + w);
    let y = 1.0 - y_gone;
    let gone = y_gone * (3.0 - y_gone * (3.0 - y_gone));
    let left = y * y * y;
    let per = 1.0 / (left * w);
    let x = (h - Sphere::new(path).q(z)) * (left * per);
    // t = γm u^(p−1)/g²
    let turn = m * (1.0 / 6.0) * (per * y * y) * (per * y * y);
    let step = third_order(x, -0.5 * turn, -turn * ((1.0 - p) * w * per + turn) * (1.0 / 6.0));
    let slip = Slip { gone, power_gone: y_gone, left, power: y, tau: 0.0 };
    let close = (num <= FARTHEST * den) & (x.abs() <= CLOSE * left);
    Usual {
        holds: close & (h < path.whole_at_least()) & contact.levers.are_of_spheres(),
        q,
        end: Near { slip, x: step * w * per },
        compressed: Near { slip: Slip::START, x: 0.0 },
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::physics::ball::UNIFORM_SPHERE;
    use crate::physics::collision::input::Levers;
    use crate::physics::collision::kim::{End, Slips, gradient, solve, start};
    use crate::physics::collision::{Gradient, variable};

    /// Some ten roundings, of 1 and of what has gone in all.
    const ROUNDING: f64 = 4e-15;

    /// The gradient divides by the way of restitution, which is as long as e.
    const OF_GRADIENT: f64 = 1e-12;

    /// Or the fast way would be no use.
    const USUAL: f64 = 0.6;

    #[test]
    fn is_the_solution_step_by_step() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let (mut held, shots) = ([0_u32; 2], 20_000_u32);
        for i in 0..shots {
            let topspin = i % 2 == 0;
            let v_z = rng.random_range(0.0..5.0) * if topspin { 1.0 } else { -1.0 };
            let contact = Contact {
                k: rng.random_range(0.2..5.0),
                v_y: rng.random_range(-5.0..5.0),
                v_z,
                mu: rng.random_range(0.01..0.12),
                m_s: if topspin { rng.random_range(0.0..0.6) } else { 0.0 },
                e: rng.random_range(0.4..1.0),
                nu: UNIFORM_SPHERE,
                sigma: 1.0,
                levers: Levers::equal(UNIFORM_SPHERE),
                mu_s: 0.0,
            };
            let (path, rho) = start(&contact);
            let usual = super::solve(&contact, &path, rho);
            if !usual.holds {
                continue;
            }
            held[usize::from(topspin)] += 1;
            let end = solve(&contact, &path, rho);
            let End::Slide { slips: Slips { end: slip, .. }, .. } = end else {
                panic!("sticks: {contact:?}");
            };
            let (found, expected) = (usual.impulse(&contact, &path), end.impulse(&contact));
            let same = |a: f64, b: f64, unit: f64| {
                assert!((a - b).abs() <= ROUNDING * unit.abs(), "{a} for {b}: {contact:?}");
            };
            same(found.normal, expected.normal, contact.k);
            same(found.y, expected.y, contact.v_y);
            same(found.z, expected.z, contact.v_z);
            same(usual.end.slip(&path).tau.exp() * slip.left, 1.0, if topspin { 1.0 } else { f64::INFINITY });
            let found = gradient::of_slide(&contact, &path, rho, &usual.slips(&path));
            let expected = gradient::gradient(&contact, &end);
            let same = |mut a: Gradient, b: Gradient| {
                // without topspin nothing depends on m_s, and its derivative is not computed
                a[variable::M_S] = if topspin { a[variable::M_S] } else { b[variable::M_S] };
                assert!((a - b).amax() <= OF_GRADIENT * b.amax(), "{a} for {b}: {contact:?}");
            };
            same(found.normal, expected.normal);
            same(found.y, expected.y);
            same(found.z, expected.z);
        }
        let usual = held.map(|held| 2.0 * f64::from(held) / f64::from(shots));
        assert!(usual.iter().all(|usual| *usual > USUAL), "{usual:?}");
    }
}
