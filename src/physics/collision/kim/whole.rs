//! The whole slip, u from 1 to 0: what it takes to stick (case C).
//!
//! F = ∫₀¹ √(n + m s^p) ds = ₂F₁(−½, 1; 1 + 1/p; m) has no poles, but its series in m and 1 − m
//! converge slowly or cancel. As an integral over x = s^(1/8) it is smooth enough for a fixed rule.

use std::sync::LazyLock;

use super::path::{Node, Path};
use crate::numerics::quadrature::GAUSS_8;

/// Nodes s, −ln s and weights.
static RULE: LazyLock<[[f64; 3]; 8 * PANELS]> = LazyLock::new(|| {
    let mut rule = [[0.0; 3]; 8 * PANELS];
    let half = 0.5 / PANELS as f64;
    for (i, node) in rule.iter_mut().enumerate() {
        let (x, w) = GAUSS_8[i % 4];
        let side = if i % 8 < 4 { -1.0 } else { 1.0 };
        let x = half * (1.0 + 2.0 * (i / 8) as f64 + side * x);
        // s = x⁸, ds = 8x⁷ dx
        *node = [x.powi(8), -8.0 * x.ln(), 8.0 * x.powi(7) * half * w];
    }
    rule
});
const PANELS: usize = 6;

/// The rule holds for these p, that is for μ_s to 0.46; others take the long way.
const RANGE: std::ops::RangeInclusive<f64> = 0.3..=0.9;

/// exp(−τ) is nothing beside 1.
const FAR: f64 = 40.0;

impl Path {
    /// Calls `f` at the nodes of a rule for the whole slip.
    pub fn walk_whole(&self, mut f: impl FnMut(&Node)) {
        if !RANGE.contains(&self.p) {
            // g s falls as s^(1+γ)
            self.walk(FAR / (1.0 + 0.5 * self.p).min(1.0), f);
            return;
        }
        for &[s, tau, weight] in RULE.iter() {
            f(&Node { gone: 1.0 - s, s, power: (-self.p * tau).exp(), tau, weight });
        }
    }

    /// ∫ g ds ≥ n + m/(1 + γ), since the root is concave.
    pub fn whole_at_least(&self) -> f64 {
        self.n + self.m / (1.0 + 0.5 * self.p)
    }

    /// ∫ g ds ≤ √(n + m/(1 + p)), for the same reason.
    pub fn whole_at_most(&self) -> f64 {
        (self.n + self.m / (1.0 + self.p)).sqrt()
    }
}

/// (∫₀¹ g ds, ∫₀¹ s g ds).
pub(super) fn whole(path: &Path) -> (f64, f64) {
    let (mut q, mut sq) = (0.0, 0.0);
    path.walk_whole(|node| {
        let g = node.weight * path.g(node.power);
        q += g;
        sq += node.s * g;
    });
    (q, sq)
}
