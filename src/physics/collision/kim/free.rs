//! No friction of the cloth: draw, stun and side spin (case A).
//!
//! Restitution ends at q_f = (1 + e)k/2, and only Q(u) = h is left to invert.

use super::cloth::compression;
use super::path::{Path, Slip, third_order};
use super::whole::whole;
use super::{CLOSE, End, MAX_STEPS, MOST, ROUNDING, Slips};
use crate::physics::collision::Contact;
use crate::physics::collision::steps;

pub(super) fn solve(contact: &Contact, path: &Path, rho: f64) -> End {
    let &Contact { k, e, mu, .. } = contact;
    let q = 0.5 * (1.0 + e) * k;
    // h = 2μβ_z q_f/ρ
    let h = 2.0 * mu * contact.beta_z() * (q / rho);
    let slip = if h >= path.whole_at_most() {
        None
    } else if contact.levers.are_of_spheres() {
        Sphere::new(path).find(h)
    } else if h >= path.whole_at_least() && h >= whole(path).0 {
        None
    } else {
        // 2Q = 2h
        compression(path, 2.0 * h, 0.0).map(|end| end.slip)
    };
    match slip {
        Some(end) => End::Slide { q, slips: Slips { end, compressed: end, restored: Slip::START } },
        None => End::Stick { q, compressed: None },
    }
}

/// ν = 2/5 makes γ = 1/6. With s = y³ and ζ = (1 − y)/(1 + √(n + my)),
/// √(n + my) = 1 − mζ, y = 1 − 2ζ + mζ², and
///
/// Q = 6∫ f² dζ from 0 to ζ, f = y√(n + my) = 1 − (2 + m)ζ + 3mζ² − m²ζ³.
pub(super) struct Sphere<'a> {
    path: &'a Path,
    /// Coefficients of Q/ζ.
    q: [f64; 7],
}

impl<'a> Sphere<'a> {
    #[inline(always)]
    pub fn new(path: &'a Path) -> Self {
        let m = path.m;
        let [f1, f2, f3] = [-(2.0 + m), 3.0 * m, -m * m];
        let q = [
            6.0,
            6.0 * f1,
            2.0 * (f1 * f1 + 2.0 * f2),
            3.0 * (f3 + f1 * f2),
            6.0 / 5.0 * (f2 * f2 + 2.0 * f1 * f3),
            2.0 * f2 * f3,
            6.0 / 7.0 * f3 * f3,
        ];
        Self { path, q }
    }

    #[inline(always)]
    pub fn q(&self, z: f64) -> f64 {
        let [q1, q2, q3, q4, q5, q6, q7] = self.q;
        let z2 = z * z;
        z * ((q1 + z * q2) + z2 * ((q3 + z * q4) + z2 * ((q5 + z * q6) + z2 * q7)))
    }

    /// Where Q = h. `None` if it sticks before.
    #[inline]
    fn find(&self, h: f64) -> Option<Slip> {
        let &Path { n, .. } = self.path;
        let (num, den) = self.path.inverse(h, 0.5);
        let mut left = 1.0 - num / den;
        if h >= self.path.whole_at_least() {
            // y = 0 at ζ = 1/(1 + √n)
            let rest = self.q(1.0 / (1.0 + n.sqrt())) - h;
            if rest <= 0.0 {
                return None;
            }
            // rest = ∫ g ds from 0 to u, g ≤ 1
            left = left.max(rest);
        }
        for step in 0..MAX_STEPS {
            steps::record(step);
            let y = if left < HALF { left.cbrt() } else { cube_root(left) };
            let (slip, w, x) = self.at(y, h);
            left = slip.left;
            if x.abs() <= CLOSE * left {
                return Some(self.finish(&slip, w, x));
            }
            if x.abs() * w <= ROUNDING * slip.gone {
                return Some(slip);
            }
            left -= x.clamp(-MOST * slip.gone, MOST * left);
        }
        None
    }

    /// Near y, exactly at the ζ that is taken there: the slip, w and the step to where Q = h.
    #[inline(always)]
    fn at(&self, y: f64, h: f64) -> (Slip, f64, f64) {
        let &Path { n, m, .. } = self.path;
        let z = (1.0 - y) / (1.0 + (n + m * y).sqrt());
        // w = √(n + my), y, d = 1 − y³
        let w = 1.0 - m * z;
        let y_gone = z * (1.0 + w);
        let y = 1.0 - y_gone;
        let gone = y_gone * (3.0 - y_gone * (3.0 - y_gone));
        let slip = Slip { gone, power_gone: y_gone, left: y * y * y, power: y, tau: 0.0 };
        (slip, w, (h - self.q(z)) / w)
    }

    /// A small step further, to third order.
    #[inline(always)]
    fn finish(&self, slip: &Slip, w: f64, x: f64) -> Slip {
        let &Path { m, p, .. } = self.path;
        let y = slip.power;
        // t = γm u^(p−1)/g²
        let t = m / (6.0 * y * y * w * w);
        let step = third_order(x, -0.5 * t, -t * ((1.0 - p) / slip.left + t) * (1.0 / 6.0));
        slip.finish(step / slip.left, p)
    }
}

/// ∛u for u ≥ ½, to a millionth: one step of Halley's method from (1 − ⅔d)/(1 − ⅓d), d = 1 − u.
#[inline(always)]
fn cube_root(u: f64) -> f64 {
    let d = 1.0 - u;
    // y = a/b, then y (y³ + 2u)/(2y³ + u)
    let (a, b) = (1.0 - d * (2.0 / 3.0), 1.0 - d * (1.0 / 3.0));
    let (a3, b3) = (a * a * a, u * b * b * b);
    a * (a3 + 2.0 * b3) / (b * (2.0 * a3 + b3))
}

/// From so much of the slip left on [`cube_root`] holds.
const HALF: f64 = 0.5;
