//! The models: f(x; b) and ∂f/∂b.
use std::f64::consts::PI;

/// (x, b, ∂f/∂b) ↦ f, writing the derivatives.
pub type Model = fn(&[f64], &[f64], &mut [f64]) -> f64;

/// The 27 problems in the order of their difficulty as NIST lists it.
pub const MODELS: [(&str, Model); 27] = [
    ("Misra1a", saturation),
    ("Chwirut2", chwirut),
    ("Chwirut1", chwirut),
    ("Lanczos3", lanczos),
    ("Gauss1", gauss),
    ("Gauss2", gauss),
    ("DanWood", dan_wood),
    ("Misra1b", misra1b),
    ("Kirby2", rational::<3>),
    ("Hahn1", rational::<4>),
    ("Nelson", nelson),
    ("MGH17", mgh17),
    ("Lanczos1", lanczos),
    ("Lanczos2", lanczos),
    ("Gauss3", gauss),
    ("Misra1c", misra1c),
    ("Misra1d", misra1d),
    ("Roszman1", roszman),
    ("ENSO", enso),
    ("MGH09", mgh09),
    ("Thurber", rational::<4>),
    ("BoxBOD", saturation),
    ("Rat42", rat42),
    ("MGH10", mgh10),
    ("Eckerle4", eckerle),
    ("Rat43", rat43),
    ("Bennett5", bennett),
];

/// What is regressed on: log y for Nelson, y for the others.
pub fn response(name: &str, y: f64) -> f64 {
    if name == "Nelson" { y.ln() } else { y }
}

/// b1 (1 − exp(−b2 x))
pub fn saturation(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let e = (-b[1] * x[0]).exp();
    d.copy_from_slice(&[1.0 - e, b[0] * x[0] * e]);
    b[0] * (1.0 - e)
}

/// b1 (1 − (1 + b2 x/2)⁻²)
fn misra1b(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let u = 1.0 + b[1] * x[0] / 2.0;
    d.copy_from_slice(&[1.0 - u.powi(-2), b[0] * x[0] * u.powi(-3)]);
    b[0] * (1.0 - u.powi(-2))
}

/// b1 (1 − (1 + 2 b2 x)^−½)
fn misra1c(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let u = 1.0 + 2.0 * b[1] * x[0];
    d.copy_from_slice(&[1.0 - u.powf(-0.5), b[0] * x[0] * u.powf(-1.5)]);
    b[0] * (1.0 - u.powf(-0.5))
}

/// b1 b2 x / (1 + b2 x)
fn misra1d(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let u = 1.0 + b[1] * x[0];
    d.copy_from_slice(&[b[1] * x[0] / u, b[0] * x[0] / (u * u)]);
    b[0] * b[1] * x[0] / u
}

/// exp(−b1 x) / (b2 + b3 x)
fn chwirut(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let u = b[1] + b[2] * x[0];
    let f = (-b[0] * x[0]).exp() / u;
    d.copy_from_slice(&[-x[0] * f, -f / u, -x[0] * f / u]);
    f
}

/// b1 exp(−b2 x) + b3 exp(−b4 x) + b5 exp(−b6 x)
fn lanczos(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let mut f = 0.0;
    for k in [0, 2, 4] {
        let e = (-b[k + 1] * x[0]).exp();
        d[k] = e;
        d[k + 1] = -x[0] * b[k] * e;
        f += b[k] * e;
    }
    f
}

/// b1 exp(−b2 x) + b3 exp(−(x − b4)²/b5²) + b6 exp(−(x − b7)²/b8²)
fn gauss(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let e = (-b[1] * x[0]).exp();
    d[0] = e;
    d[1] = -x[0] * b[0] * e;
    let mut f = b[0] * e;
    for k in [2, 5] {
        let z = (x[0] - b[k + 1]) / b[k + 2];
        let e = (-z * z).exp();
        d[k] = e;
        d[k + 1] = 2.0 * b[k] * e * z / b[k + 2];
        d[k + 2] = 2.0 * b[k] * e * z * z / b[k + 2];
        f += b[k] * e;
    }
    f
}

/// b1 x^b2
fn dan_wood(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let power = x[0].powf(b[1]);
    d.copy_from_slice(&[power, b[0] * power * x[0].ln()]);
    b[0] * power
}

/// (b1 + b2 x + … + bN x^(N−1)) / (1 + b(N+1) x + b(N+2) x² + …)
pub fn rational<const N: usize>(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let horner = |coefficients: &[f64]| coefficients.iter().rev().fold(0.0, |sum, c| sum * x[0] + c);
    let below = 1.0 + x[0] * horner(&b[N..]);
    let f = horner(&b[..N]) / below;
    for (k, derivative) in d.iter_mut().enumerate() {
        *derivative =
            if k < N { x[0].powi(k as i32) / below } else { -f * x[0].powi((k - N + 1) as i32) / below };
    }
    f
}

/// b1 − b2 x1 exp(−b3 x2)
fn nelson(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let e = x[0] * (-b[2] * x[1]).exp();
    d.copy_from_slice(&[1.0, -e, b[1] * x[1] * e]);
    b[0] - b[1] * e
}

/// b1 + b2 exp(−b4 x) + b3 exp(−b5 x)
fn mgh17(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let (e, g) = ((-b[3] * x[0]).exp(), (-b[4] * x[0]).exp());
    d.copy_from_slice(&[1.0, e, g, -x[0] * b[1] * e, -x[0] * b[2] * g]);
    b[0] + b[1] * e + b[2] * g
}

/// b1 − b2 x − arctan(b3/(x − b4))/π
fn roszman(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let u = x[0] - b[3];
    let z = b[2] / u;
    let slope = 1.0 / (PI * (1.0 + z * z) * u);
    d.copy_from_slice(&[1.0, -x[0], -slope, -z * slope]);
    b[0] - b[1] * x[0] - z.atan() / PI
}

/// b1 + b2 cos(2πx/12) + b3 sin(2πx/12) + b5 cos(2πx/b4) + b6 sin(2πx/b4) + b8 cos(2πx/b7) + b9 sin(2πx/b7)
fn enso(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let turn = 2.0 * PI * x[0];
    d[0] = 1.0;
    (d[2], d[1]) = (turn / 12.0).sin_cos();
    let mut f = b[0] + b[1] * d[1] + b[2] * d[2];
    for k in [3, 6] {
        let (sin, cos) = (turn / b[k]).sin_cos();
        d[k] = (b[k + 1] * sin - b[k + 2] * cos) * turn / (b[k] * b[k]);
        d[k + 1] = cos;
        d[k + 2] = sin;
        f += b[k + 1] * cos + b[k + 2] * sin;
    }
    f
}

/// b1 (x² + b2 x) / (x² + b3 x + b4)
pub fn mgh09(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let x = x[0];
    let below = x * x + b[2] * x + b[3];
    let ratio = (x * x + b[1] * x) / below;
    let f = b[0] * ratio;
    d.copy_from_slice(&[ratio, b[0] * x / below, -f * x / below, -f / below]);
    f
}

/// b1 / (1 + exp(b2 − b3 x))
fn rat42(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let e = (b[1] - b[2] * x[0]).exp();
    let f = b[0] / (1.0 + e);
    d.copy_from_slice(&[1.0 / (1.0 + e), -f * e / (1.0 + e), f * x[0] * e / (1.0 + e)]);
    f
}

/// b1 / (1 + exp(b2 − b3 x))^(1/b4)
fn rat43(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let e = (b[1] - b[2] * x[0]).exp();
    let power = (1.0 + e).powf(-1.0 / b[3]);
    let f = b[0] * power;
    let slope = f * e / (b[3] * (1.0 + e));
    d.copy_from_slice(&[power, -slope, x[0] * slope, f * e.ln_1p() / (b[3] * b[3])]);
    f
}

/// b1 exp(b2/(x + b3))
fn mgh10(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let u = x[0] + b[2];
    let e = (b[1] / u).exp();
    d.copy_from_slice(&[e, b[0] * e / u, -b[0] * e * b[1] / (u * u)]);
    b[0] * e
}

/// (b1/b2) exp(−½((x − b3)/b2)²)
fn eckerle(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let z = (x[0] - b[2]) / b[1];
    let e = (-0.5 * z * z).exp() / b[1];
    let f = b[0] * e;
    d.copy_from_slice(&[e, f * (z * z - 1.0) / b[1], f * z / b[1]]);
    f
}

/// b1 (b2 + x)^(−1/b3)
fn bennett(x: &[f64], b: &[f64], d: &mut [f64]) -> f64 {
    let u = b[1] + x[0];
    let power = u.powf(-1.0 / b[2]);
    let f = b[0] * power;
    d.copy_from_slice(&[power, -f / (b[2] * u), f * u.ln() / (b[2] * b[2])]);
    f
}
