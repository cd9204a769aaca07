//! Gauss–Legendre rules on (−1, 1): abscissas and weights of the positive half (Abramowitz & Stegun, Table
//! 25.4, to the digits of an `f64`). A rule of n nodes is exact to degree 2n − 1.

pub const GAUSS_4: [(f64, f64); 2] = [
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

/// The middle, at 0, has the weight [`GAUSS_5_MIDDLE`].
pub const GAUSS_5: [(f64, f64); 2] =
    [(0.538_469_310_105_683_1, 0.478_628_670_499_366_47), (0.906_179_845_938_664, 0.236_926_885_056_189_08)];
pub const GAUSS_5_MIDDLE: f64 = 0.568_888_888_888_888_9;

pub const GAUSS_6: [(f64, f64); 3] = [
    (0.238_619_186_083_196_9, 0.467_913_934_572_691_04),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_36),
];

pub const GAUSS_8: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums of 4 to 8 terms.
    const ROUNDING: f64 = 2e-15;

    #[test]
    fn rules_are_exact_to_degree_2n_less_1() {
        for rule in [&GAUSS_4[..], &GAUSS_6, &GAUSS_8] {
            let degree = 4 * rule.len() as i32 - 2;
            // an even power: ∫ x^degree dx from −1 to 1; the odd one above it vanishes by symmetry
            let sum: f64 = rule.iter().map(|(x, w)| 2.0 * w * x.powi(degree)).sum();
            let exact = 2.0 / f64::from(degree + 1);
            assert!((sum - exact).abs() < ROUNDING * exact, "{degree}: {sum} {exact}");
        }
    }
}
