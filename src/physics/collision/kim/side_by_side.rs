//! Two stretches of a path at a time, one in each half of a vector: the second need not wait for the first.

use wide::f64x2;

use super::path::{Descent, Path, Slip};
use crate::numerics::quadrature::{GAUSS_5, GAUSS_5_MIDDLE};

/// So far in τ, times p where p > 1, the 5 nodes are exact to rounding, and so are the series of [`Exponentials`].
const REACH: f64 = 0.37;

/// Whether two stretches of this length in τ can be taken.
#[inline(always)]
pub(super) fn within_reach(path: &Path, tau: f64) -> bool {
    tau * path.p.max(1.0) <= REACH
}

/// Two stretches of a path, each counted from where it begins.
pub(super) struct Stretches {
    p: f64,
    tau: f64x2,
    half: f64x2,
    /// 1 − s and s in their middles, 1 − s^p and s^p.
    middle_gone: f64x2,
    middle: f64x2,
    middle_power_gone: f64x2,
    middle_power: f64x2,
}

/// Nodes of a quadrature, one on each stretch.
pub(super) struct Nodes {
    /// 1 − s.
    pub gone: f64x2,
    /// s^p.
    pub power: f64x2,
    /// Weight of ds, in units of half τ.
    pub weight: f64x2,
}

impl Stretches {
    /// Of these lengths in τ.
    #[inline(always)]
    pub fn new(path: &Path, tau: f64x2) -> Self {
        let (p, half) = (path.p, tau * 0.5);
        let [middle, middle_p] = [Exponentials::of(half), Exponentials::of(half * p)];
        Self {
            p,
            tau,
            half,
            middle_gone: middle.fall,
            middle: 1.0 - middle.fall,
            middle_power_gone: middle_p.fall,
            middle_power: 1.0 - middle_p.fall,
        }
    }

    /// u at their ends.
    #[inline(always)]
    pub fn left(&self) -> f64x2 {
        self.middle * self.middle
    }

    /// 1 − u at their ends.
    #[inline(always)]
    pub fn gone(&self) -> f64x2 {
        self.middle_gone + self.middle * self.middle_gone
    }

    /// u^p at their ends.
    #[inline(always)]
    pub fn power(&self) -> f64x2 {
        self.middle_power * self.middle_power
    }

    /// Half of τ.
    #[inline(always)]
    pub fn half(&self) -> f64x2 {
        self.half
    }

    /// m of a path that has the second stretch as its beginning but g as it is.
    #[inline(always)]
    pub fn m(&self, path: &Path) -> f64x2 {
        f64x2::new([path.m, path.m * self.power().as_array()[0]])
    }

    /// The ends, with g and integrals up to there.
    #[inline(always)]
    fn descents(&self, g: f64x2, q: f64x2, r: f64x2) -> [Descent; 2] {
        let power_gone = self.middle_power_gone + self.middle_power * self.middle_power_gone;
        let (gone, left, power) = (self.gone(), self.left(), self.power());
        let descent = |i: usize| {
            let of = |pair: f64x2| pair.as_array()[i];
            let slip = Slip {
                gone: of(gone),
                power_gone: of(power_gone),
                left: of(left),
                power: of(power),
                tau: of(self.tau),
            };
            Descent { slip, g: of(g), q: of(q), r: of(r) }
        };
        [descent(0), descent(1)]
    }

    /// Calls `f` at the nodes, with x of τ = half(1 + x).
    #[inline(always)]
    pub fn walk(&self, mut f: impl FnMut(f64, &Nodes)) {
        let &Self { p, half, middle_gone, middle, middle_power, .. } = self;
        f(0.0, &Nodes { gone: middle_gone, power: middle_power, weight: middle * GAUSS_5_MIDDLE });
        for (x, weight) in GAUSS_5 {
            // e^(−τ/2 ± x), and what is gone there: 1 − ab = (1 − a) + a(1 − b)
            let [step, step_p] = [Exponentials::of(half * x), Exponentials::of(half * (p * x))];
            let mut node = |x: f64, gone: f64x2, power: f64x2| {
                f(x, &Nodes { gone, power, weight: (1.0 - gone) * weight });
            };
            node(-x, middle_gone - middle * step.rise, middle_power * (1.0 + step_p.rise));
            node(x, middle_gone + middle * step.fall, middle_power * (1.0 - step_p.fall));
        }
    }
}

/// The way down to τ₁ and the one from there on, τ₂ further. The second is in u/u₁, but its g is that of the
/// whole path.
#[inline(always)]
pub(super) fn descents(path: &Path, tau: f64x2) -> [Descent; 2] {
    let stretches = Stretches::new(path, tau);
    let m = stretches.m(path);
    let g = |power: f64x2| (m * power + path.n).sqrt();
    let end = g(stretches.power());
    let [mut q, mut r] = [f64x2::ZERO; 2];
    stretches.walk(|_, nodes| {
        let g = nodes.weight * g(nodes.power);
        q += g;
        r += nodes.gone * g;
    });
    stretches.descents(end, q * stretches.half(), r * stretches.half())
}

/// e^z and e^(−z) without their 1.
struct Exponentials {
    /// e^z − 1.
    rise: f64x2,
    /// 1 − e^(−z).
    fall: f64x2,
}

impl Exponentials {
    /// For |z| ≤ REACH/2: the first term left out of the series is below 4e-18.
    #[inline(always)]
    fn of(z: f64x2) -> Self {
        let x = z * z;
        let x2 = x * x;
        // cosh z − 1 = z²/2! + z⁴/4! + …, sinh z = z + z³/3! + …, in pairs that need not wait for each other
        let cosh = x
            * (x * (1.0 / 24.0) + 0.5 + x2 * (x * (1.0 / 40_320.0) + 1.0 / 720.0 + x2 * (1.0 / 3_628_800.0)));
        let sinh = z + z
            * x
            * (x * (1.0 / 120.0)
                + 1.0 / 6.0
                + x2 * (x * (1.0 / 362_880.0) + 1.0 / 5_040.0 + x2 * (1.0 / 39_916_800.0)));
        Self { rise: sinh + cosh, fall: sinh - cosh }
    }
}
