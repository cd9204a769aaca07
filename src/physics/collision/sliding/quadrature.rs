//! Sums along a slide whose slip decays exponentially.

use super::{Decay, Pair};

/// Calls `f` at the nodes of Gauss and Legendre's rule from 0 to `s`, with their weight, place and the parts 1 − e^(−λs) stopped
/// there; returns those at the end. Panels are so short that the rules are exact to rounding.
#[inline(always)]
pub(super) fn integrate<const FALLS: bool>(
    decay: &Decay<FALLS>,
    speed: f64,
    s: f64,
    mut f: impl FnMut(f64, f64, Pair),
) -> Pair {
    let [y, z] = decay.rates.to_array();
    let mut reach = y.max(z) * s.abs();
    if FALLS {
        reach *= 1.0 + decay.friction[2] * speed;
    }
    if reach <= MAX_TWO {
        return panel(decay.rates, 0.0, Pair::ZERO, 0.5 * s, &GAUSS_2, &mut f);
    }
    if reach <= MAX_FOUR {
        return panel(decay.rates, 0.0, Pair::ZERO, 0.5 * s, &GAUSS_4, &mut f);
    }
    let panels = (reach / MAX_SIX).ceil();
    let (half, mut stopped) = (0.5 * s / panels, Pair::ZERO);
    for i in 0..panels as usize {
        stopped = panel(decay.rates, 2.0 * half * i as f64, stopped, half, &GAUSS_6, &mut f);
    }
    stopped
}

#[inline(always)]
fn panel<const H: usize>(
    rates: Pair,
    from: f64,
    stopped: Pair,
    half: f64,
    rule: &[(f64, f64); H],
    f: &mut impl FnMut(f64, f64, Pair),
) -> Pair {
    // 1 − ab = (1 − a) + a(1 − b)
    let further = |stopped: Pair, by: Pair| stopped + (1.0 - stopped) * by;
    let rates = rates * half;
    let [to_middle, _] = fall_and_rise(rates);
    let middle = further(stopped, to_middle);
    for &(x, weight) in rule {
        let [fall, rise] = fall_and_rise(rates * x);
        f(half * weight, from + half * (1.0 + x), further(middle, fall));
        f(half * weight, from + half * (1.0 - x), further(middle, rise));
    }
    further(middle, to_middle)
}

/// Returns 1 − e^(−x) and 1 − e^x for |x| ≤ MAX_SIX/2 by Taylor's series, whose first term left out is below 3e-17.
#[inline(always)]
fn fall_and_rise(x: Pair) -> [Pair; 2] {
    let s = x * x;
    let t = s * s;
    let cosh = s
        * ((s * (1.0 / 24.0) + 0.5)
            + t * ((s * (1.0 / 40_320.0) + 1.0 / 720.0)
                + t * (s * (1.0 / 479_001_600.0) + 1.0 / 3_628_800.0)));
    let sinh = x + x
        * s
        * ((s * (1.0 / 120.0) + 1.0 / 6.0)
            + t * ((s * (1.0 / 362_880.0) + 1.0 / 5_040.0)
                + t * (s * (1.0 / 6_227_020_800.0) + 1.0 / 39_916_800.0)));
    [sinh - cosh, -sinh - cosh]
}

/// The longest panels in λs for 2, 4 and 6 nodes.
const MAX_TWO: f64 = 1e-3;
const MAX_FOUR: f64 = 0.2;
const MAX_SIX: f64 = 0.8;

/// Abscissas and weights of the positive half (Abramowitz & Stegun, Table 25.4).
const GAUSS_2: [(f64, f64); 1] = [(0.577_350_269_189_625_8, 1.0)];
const GAUSS_4: [(f64, f64); 2] = [
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];
const GAUSS_6: [(f64, f64); 3] = [
    (0.238_619_186_083_196_9, 0.467_913_934_572_691_04),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_36),
];
