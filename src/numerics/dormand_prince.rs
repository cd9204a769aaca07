//! Steps of Dormand and Prince's pair of order 5(4) (J. Comput. Appl. Math. 6, 19 (1980)).

/// Halvings of a step in search of a root.
const HALVINGS: usize = 10;

/// A state after a step.
pub(crate) struct Step<const N: usize> {
    pub(crate) state: [f64; N],
    /// The rates there.
    pub(crate) rates: [f64; N],
    /// The largest error of a component; NaN if one is.
    pub(crate) error: f64,
}

/// Returns the step of length `h` from a state with the rates `k1`, of order 5.
#[inline(always)]
pub(crate) fn step<const N: usize>(
    rates: impl Fn(&[f64; N]) -> [f64; N],
    y: &[f64; N],
    k1: &[f64; N],
    h: f64,
) -> Step<N> {
    let k2 = rates(&ahead(y, h, [k1], A2));
    let k3 = rates(&ahead(y, h, [k1, &k2], A3));
    let k4 = rates(&ahead(y, h, [k1, &k2, &k3], A4));
    let k5 = rates(&ahead(y, h, [k1, &k2, &k3, &k4], A5));
    let k6 = rates(&ahead(y, h, [k1, &k2, &k3, &k4, &k5], A6));
    let state = ahead(y, h, [k1, &k3, &k4, &k5, &k6], B);
    let k7 = rates(&state);
    let errors = ahead(&[0.0; N], h, [k1, &k3, &k4, &k5, &k6, &k7], E);
    // also finds a NaN
    let error = errors.iter().fold(0.0, |most, e| if e.abs() <= most { most } else { e.abs() });
    Step { state, rates: k7, error }
}

/// Returns y + h Σ by·rates.
#[inline(always)]
pub(crate) fn ahead<const N: usize, const M: usize>(
    y: &[f64; N],
    h: f64,
    rates: [&[f64; N]; M],
    by: [f64; M],
) -> [f64; N] {
    let mut there = *y;
    for (rates, by) in rates.into_iter().zip(by) {
        let by = by * h;
        for i in 0..N {
            there[i] += by * rates[i];
        }
    }
    there
}

/// Returns the state at `at` on the cubic through both ends of a step, with the rates there.
pub(crate) fn cubic<const N: usize>(
    [y, k]: [&[f64; N]; 2],
    [y1, k1]: [&[f64; N]; 2],
    h: f64,
    at: f64,
) -> [f64; N] {
    let (t, rest) = (at / h, 1.0 - at / h);
    std::array::from_fn(|i| {
        let d = y1[i] - y[i];
        rest * y[i] + t * y1[i] + t * rest * (rest * (k[i] * h - d) + t * (d - k1[i] * h))
    })
}

/// Returns the root of a decreasing function between 0 and `h`, to a few thousandths of `h`.
pub(crate) fn root(f: impl Fn(f64) -> f64, h: f64) -> f64 {
    let (mut low, mut high) = (0.0, h);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if f(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

const A2: [f64; 1] = [1.0 / 5.0];
const A3: [f64; 2] = [3.0 / 40.0, 9.0 / 40.0];
const A4: [f64; 3] = [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0];
const A5: [f64; 4] = [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0];
const A6: [f64; 5] = [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0];
const B: [f64; 5] = [35.0 / 384.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0];
const E: [f64; 6] =
    [71.0 / 57600.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339_200.0, 22.0 / 525.0, -1.0 / 40.0];
