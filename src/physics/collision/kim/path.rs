//! The path of the slip from u = 1 to 0, its inverse to fourth order, and integrals along it.

use crate::numerics::quadrature::{GAUSS_4, GAUSS_6, GAUSS_8};

/// With n + m = 1 the slip falls as v_∥ = ρ u g(u), g(u) = √(n + m u^p), p = 2γ.
///
/// A path that is entered further down, at u₀, is again such a path in u/u₀: see [`Path::from`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    pub n: f64,
    pub m: f64,
    pub p: f64,
}

/// Where the slip has come to on a [`Path`]. What is gone is kept beside what is left, so that short
/// ways keep their digits.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slip {
    /// d = 1 − u.
    pub gone: f64,
    /// 1 − u^p.
    pub power_gone: f64,
    /// u.
    pub left: f64,
    /// u^p.
    pub power: f64,
    /// τ = −ln u.
    pub tau: f64,
}

/// A [`Slip`] with the integrals up to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Descent {
    pub slip: Slip,
    /// g(u).
    pub g: f64,
    /// Q = ∫ g ds from u to 1.
    pub q: f64,
    /// R = ∫ (1 − s) g ds from u to 1.
    pub r: f64,
}

/// A node of a quadrature along the path.
pub(super) struct Node {
    /// 1 − s.
    pub gone: f64,
    pub s: f64,
    /// s^p.
    pub power: f64,
    /// −ln s.
    pub tau: f64,
    /// Weight of ds.
    pub weight: f64,
}

/// In τ the integrands are analytic up to a distance π/p. So far, times p where p > 1, 4 nodes
/// are exact to 1e-15,
const REACH_4: f64 = 0.12;
/// so far 6 nodes,
const REACH_6: f64 = 0.4;
/// and so far 8 nodes, by which the series of [`cosh_sinh`] end, too;
const REACH_8: f64 = 0.75;
/// 8 nodes in each panel of this length to 1e-17.
const PANEL: f64 = 1.0;
/// Where p·τ is beyond this, u^p and its root are nothing beside 1: e^(−40) = 4e-18.
const GONE: f64 = 80.0;

impl Path {
    /// The rest of the path from a point on, in u/u₀ and g/g₀.
    #[inline(always)]
    pub fn from(&self, start: &Slip, g: f64) -> Self {
        let g2 = g * g;
        Self { n: self.n / g2, m: self.m * start.power / g2, p: self.p }
    }

    /// g at u^p.
    #[inline(always)]
    pub fn g(&self, power: f64) -> f64 {
        (self.n + self.m * power).sqrt()
    }

    /// An approximation of τ where ∫ (g − Σ/2) ds = h(1 − Σ/2), to about h⁵; no more than 3.35, from where a search goes on.
    #[inline(always)]
    pub fn invert(&self, h: f64, sigma: f64) -> f64 {
        let (num, den) = self.inverse(h, 1.0 / (2.0 - sigma));
        // −ln(1 − d) = 2 artanh z, z = d/(2 − d)
        let z = num / (2.0 * den - num).max(LEAST_LEFT * den);
        // where h is beyond what the approximation knows, nearly all is gone
        let z = if den > 0.0 { z.min(1.0) } else { 1.0 };
        let z2 = z * z;
        2.0 * z * (1.0 + z2 * (1.0 / 3.0 + z2 * (0.2 + z2 / 7.0)))
    }

    /// The same as d = 1 − u, as a fraction, with `per` = 1/(2 − Σ):
    /// d = h + ½γm h²/(1 − x₁h − (x₂ − x₁²)h²).
    #[inline(always)]
    pub fn inverse(&self, h: f64, per: f64) -> (f64, f64) {
        let Self { p, m, .. } = *self;
        let gm = p * m * per;
        let q = 1.0 - p;
        // x₁ = [(1−p) + 4γm]/3
        let x1 = (q + 4.0 * gm) * (1.0 / 3.0);
        // x₂ = [(1−p)(2−p) + 13γm(1−p) + 28γ²m²]/12, x₂ − x₁² = [(1−p)(2+p) + 7γm(1−p) + 20γ²m²]/36
        let rest = (q * (2.0 + p) + gm * (7.0 * q + 20.0 * gm)) * (1.0 / 36.0);
        let den = 1.0 - h * (x1 + rest * h);
        (h * den + 0.5 * gm * h * h, den)
    }

    /// Calls `f` at the nodes of a rule that is exact to rounding between u = 1 and u = exp(−τ), and
    /// returns that end.
    #[inline]
    pub fn walk(&self, tau: f64, mut f: impl FnMut(&Node)) -> Slip {
        let reach = tau * self.p.abs().max(1.0);
        if reach <= REACH_4 {
            self.short_walk(tau, &GAUSS_4, &mut f)
        } else if reach <= REACH_6 {
            self.short_walk(tau, &GAUSS_6, &mut f)
        } else if reach <= REACH_8 {
            self.short_walk(tau, &GAUSS_8, &mut f)
        } else {
            self.long_walk(tau, &mut f)
        }
    }

    /// One panel, with exponentials from Taylor's series about its middle.
    #[inline]
    fn short_walk<const N: usize>(
        &self,
        tau: f64,
        rule: &[(f64, f64); N],
        f: &mut impl FnMut(&Node),
    ) -> Slip {
        let half = 0.5 * tau;
        let (middle, middle_p) = (Exponentials::of(half), Exponentials::of(self.p * half));
        for &(x, w) in rule {
            let (step, step_p) = (Exponentials::of(half * x), Exponentials::of(self.p * half * x));
            // e^(−τ/2 ± x), and what is gone there: 1 − ab = (1 − a) + a(1 − b)
            for (t, lost, lost_p) in [(-x, -step.rise, -step_p.rise), (x, step.fall, step_p.fall)] {
                let gone = middle.fall + (1.0 - middle.fall) * lost;
                let s = 1.0 - gone;
                let power = (1.0 - middle_p.fall) * (1.0 - lost_p);
                f(&Node { gone, s, power, tau: half + half * t, weight: half * w * s });
            }
        }
        let (a, a_p) = (1.0 - middle.fall, 1.0 - middle_p.fall);
        Slip {
            gone: middle.fall + a * middle.fall,
            power_gone: middle_p.fall + a_p * middle_p.fall,
            left: a * a,
            power: a_p * a_p,
            tau,
        }
    }

    /// As many panels as it takes: short ones while u^p falls, and where it is gone, as soon near the μ_s at which the object ball
    /// no longer leaves and p has no bound, those of u alone.
    #[cold]
    fn long_walk(&self, tau: f64, f: &mut impl FnMut(&Node)) -> Slip {
        let bend = if self.p > 1.0 { tau.min(GONE / self.p) } else { tau };
        self.panels(0.0, bend, (bend * self.p.abs().max(1.0) / PANEL).ceil(), f);
        if bend < tau {
            self.panels(bend, tau, ((tau - bend) / PANEL).ceil(), f);
        }
        Slip::at(tau, self.p)
    }

    /// So many panels between two places.
    fn panels(&self, from: f64, to: f64, panels: f64, f: &mut impl FnMut(&Node)) {
        let half = 0.5 * (to - from) / panels;
        for panel in 0..panels as usize {
            let middle = from + half * (2 * panel + 1) as f64;
            for (x, w) in GAUSS_8 {
                for t in [middle - half * x, middle + half * x] {
                    let s = (-t).exp();
                    f(&Node {
                        gone: -(-t).exp_m1(),
                        s,
                        power: (-self.p * t).exp(),
                        tau: t,
                        weight: half * w * s,
                    });
                }
            }
        }
    }

    /// The way down to τ.
    #[inline]
    pub fn descend(&self, tau: f64) -> Descent {
        let (mut q, mut r) = (0.0, 0.0);
        let slip = self.walk(tau, |node| {
            let g = node.weight * self.g(node.power);
            q += g;
            r += node.gone * g;
        });
        Descent { slip, g: self.g(slip.power), q, r }
    }

    /// t = γm u^(p−1)/g², with which dg/dd = −tg, d²g/dd² = −tg[(1 − p)/u + t].
    #[inline(always)]
    pub fn turn(&self, at: &Descent) -> f64 {
        0.5 * self.p * self.m * at.slip.power / (at.slip.left * at.g * at.g)
    }

    /// Further down by a small Δd, the integrals by Taylor's series of g.
    #[inline(always)]
    pub fn finish(&self, at: &Descent, step: f64) -> Descent {
        let Descent { slip: Slip { gone, left, .. }, g, .. } = *at;
        let t = self.turn(at);
        let curve = (1.0 - self.p) / left + t;
        let slip = at.slip.finish(step / left, self.p);
        Descent {
            slip,
            g: self.g(slip.power),
            q: at.q + g * step * (1.0 - 0.5 * t * step * (1.0 + curve * step / 3.0)),
            r: at.r
                + g * step
                    * (gone + 0.5 * step
                        - t * step * (0.5 * gone + step / 3.0 + curve * step * (gone / 6.0 + 0.125 * step))),
        }
    }
}

/// Keeps the start of an inversion off u = 0.
const LEAST_LEFT: f64 = 1e-2;

/// e^z and e^(−z) without their 1.
struct Exponentials {
    /// e^z − 1.
    rise: f64,
    /// 1 − e^(−z).
    fall: f64,
}

impl Exponentials {
    /// For |z| ≤ REACH_8/2: the first term left out of the series is below 2e-17.
    #[inline(always)]
    fn of(z: f64) -> Self {
        let x = z * z;
        // cosh z − 1 = z²/2! + z⁴/4! + …, sinh z = z + z³/3! + …
        let cosh = x
            * (1.0 / 2.0
                + x * (1.0 / 24.0
                    + x * (1.0 / 720.0
                        + x * (1.0 / 40_320.0 + x * (1.0 / 3_628_800.0 + x * (1.0 / 479_001_600.0))))));
        let sinh = z + z
            * x
            * (1.0 / 6.0
                + x * (1.0 / 120.0
                    + x * (1.0 / 5_040.0
                        + x * (1.0 / 362_880.0 + x * (1.0 / 39_916_800.0 + x * (1.0 / 6_227_020_800.0))))));
        Self { rise: sinh + cosh, fall: sinh - cosh }
    }
}

impl Slip {
    /// Nothing is gone yet.
    pub const START: Self = Self { gone: 0.0, power_gone: 0.0, left: 1.0, power: 1.0, tau: 0.0 };

    /// u = exp(−τ).
    pub fn at(tau: f64, p: f64) -> Self {
        Self {
            gone: -(-tau).exp_m1(),
            power_gone: -(-p * tau).exp_m1(),
            left: (-tau).exp(),
            power: (-p * tau).exp(),
            tau,
        }
    }

    /// After a way so short that u^p is linear in it.
    #[inline]
    pub fn short(gone: f64, p: f64) -> Self {
        Self { gone, power_gone: p * gone, left: 1.0 - gone, power: 1.0 - p * gone, tau: gone }
    }

    /// Further down by a small part x = Δd/u: (1 − x)^p and ln(1 − x) by their series to x⁵.
    #[inline(always)]
    pub fn finish(&self, x: f64, p: f64) -> Self {
        let step = x * self.left;
        let lost =
            p * x * (1.0 + 0.5 * (1.0 - p) * x * (1.0 + (2.0 - p) / 3.0 * x * (1.0 + 0.25 * (3.0 - p) * x)));
        Self {
            gone: self.gone + step,
            left: self.left - step,
            power_gone: self.power_gone + self.power * lost,
            power: self.power - self.power * lost,
            tau: self.tau + x * (1.0 + x * (0.5 + x * (1.0 / 3.0 + 0.25 * x))),
        }
    }

    /// What comes of this slip behind `before`, counted from there.
    #[inline(always)]
    pub fn since(&self, before: &Self) -> Self {
        Self {
            gone: (self.gone - before.gone) / before.left,
            power_gone: (self.power_gone - before.power_gone) / before.power,
            left: self.left / before.left,
            power: self.power / before.power,
            tau: self.tau - before.tau,
        }
    }

    /// This slip with another behind it, which is counted from here.
    #[inline(always)]
    pub fn then(&self, next: &Self) -> Self {
        Self {
            gone: self.gone + self.left * next.gone,
            left: self.left * next.left,
            power_gone: self.power_gone + self.power * next.power_gone,
            power: self.power * next.power,
            tau: self.tau + next.tau,
        }
    }

    /// 1 − u^(1+γ), for v_y = v_y0 u^(1+γ); u^γ = √(u^p).
    #[inline(always)]
    pub fn y_gone(&self) -> f64 {
        // 1 − u^γ = (1 − u^p)/(1 + u^γ)
        let gamma_gone = self.power_gone / (1.0 + self.power.sqrt());
        self.gone + self.left * gamma_gone
    }
}

/// Third-order step to the root of f from f, f', f''/2f', f'''/6f' (reversion of Taylor's series).
#[inline(always)]
pub(super) fn third_order(x: f64, a: f64, b: f64) -> f64 {
    x * (1.0 - x * (a - x * (2.0 * a * a - b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ g ds = √n(1 − e^(−τ)) + [2(1 − √n) − 2√n ln((1 + √n)/2√n)]/p + O(1/p²).
    #[test]
    fn a_path_that_bends_at_its_very_start_takes_few_nodes() {
        let (p, tau) = (1e9, 2.0);
        let path = Path { n: 0.25, m: 0.75, p };
        let (mut nodes, mut q) = (0, 0.0);
        path.walk(tau, |node| {
            nodes += 1;
            q += node.weight * path.g(node.power);
        });
        let expected = 0.5 * -f64::exp_m1(-tau) + (1.0 - f64::ln(1.5)) / p;
        assert!((q - expected).abs() < 16.0 * f64::EPSILON, "{q} in place of {expected}");
        assert!(nodes < 2000, "{nodes}");
    }
}
