//! Quadrature rules.

/// Abscissas and weights of the 8-point Gauss–Legendre rule on (−1, 1), positive half
/// (Abramowitz & Stegun, Table 25.4, to the digits of an `f64`).
pub const GAUSS_8: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Calls `f(x, w)` at the nodes of the 8-point Gauss–Legendre rule in each of `panels` equal parts
/// of `from..to`; Σ w·h(x) is ∫ h dx. `to` may lie below `from`.
#[inline]
pub fn gauss_legendre(from: f64, to: f64, panels: usize, mut f: impl FnMut(f64, f64)) {
    let half = 0.5 * (to - from) / panels as f64;
    for panel in 0..panels {
        let middle = from + half * (2 * panel + 1) as f64;
        for (x, w) in GAUSS_8 {
            f(middle - half * x, half * w);
            f(middle + half * x, half * w);
        }
    }
}

/// Calls `f(u, w)` at the nodes of a tanh–sinh rule on (0, 1); Σ w·h(u) is ∫₀¹ h du, to rounding
/// also where h behaves like a fractional power or a logarithm at u = 0
/// (Takahasi & Mori, Publ. RIMS 9, 721 (1974)).
pub fn tanh_sinh(mut f: impl FnMut(f64, f64)) {
    use std::f64::consts::{FRAC_PI_2, PI};
    /// Halving the step no longer changes the integrals of the collision model.
    const STEP: f64 = 0.0625;
    /// u = 1e-61 at the left end (integrable singularities), 1 − u = 1e-17 at the right.
    const NODES: std::ops::RangeInclusive<i32> = -72..=52;
    for node in NODES {
        let t = STEP * f64::from(node);
        // u = (1 + tanh(π/2 sinh t))/2, 1 − u likewise without cancellation
        let u = 1.0 / (1.0 + (-PI * t.sinh()).exp());
        let rest = 1.0 / (1.0 + (PI * t.sinh()).exp());
        // du/dt = π cosh t · u(1 − u)
        f(u, STEP * 2.0 * FRAC_PI_2 * t.cosh() * u * rest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both rules are exact to rounding on what they are tested with; sums of 16 to 125 terms.
    const ROUNDING: f64 = 2e-15;

    #[test]
    fn gauss_legendre_is_exact_for_polynomials_of_degree_15() {
        let mut sum = 0.0;
        gauss_legendre(2.0, -1.0, 1, |x, w| sum += w * x.powi(15));
        let exact = (1.0 - 2.0_f64.powi(16)) / 16.0;
        assert!((sum - exact).abs() < ROUNDING * exact.abs(), "{sum} {exact}");
    }

    #[test]
    fn tanh_sinh_integrates_powers_and_logarithms() {
        for alpha in [0.0, 1.0, 1.0 / 6.0, 0.7, -0.5] {
            let (mut power, mut log) = (0.0, 0.0);
            tanh_sinh(|u, w| {
                power += w * u.powf(alpha);
                log += w * u.powf(alpha) * u.ln();
            });
            let exact = 1.0 / (1.0 + alpha);
            assert!((power - exact).abs() < ROUNDING * exact, "u^{alpha}: {power}");
            assert!((log + exact * exact).abs() < 4.0 * ROUNDING * exact * exact, "u^{alpha} ln u: {log}");
        }
    }
}
