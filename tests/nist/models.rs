//! The models f(x; b), of dual numbers, which carry a derivative.

use std::f64::consts::PI;

use num_dual::{Dual64, DualNum};

pub type Model = fn(&[f64], &[Dual64]) -> Dual64;

/// The 27 problems in the order of their difficulty as NIST lists it.
pub const MODELS: [(&str, Model); 27] = [
    ("Misra1a", saturation),
    ("Chwirut2", chwirut),
    ("Chwirut1", chwirut),
    ("Lanczos3", lanczos),
    ("Gauss1", gauss),
    ("Gauss2", gauss),
    ("DanWood", |x, b| b[0] * (b[1] * x[0].ln()).exp()),
    // b1 (1 − (1 + b2 x/2)⁻²)
    ("Misra1b", |x, b| -b[0] * ((b[1] * (x[0] / 2.0) + 1.0).powi(-2) - 1.0)),
    ("Kirby2", rational::<3>),
    ("Hahn1", rational::<4>),
    // b1 − b2 x1 exp(−b3 x2), of log y
    ("Nelson", |x, b| b[0] - b[1] * x[0] * (-b[2] * x[1]).exp()),
    // b1 + b2 exp(−b4 x) + b3 exp(−b5 x)
    ("MGH17", |x, b| b[0] + b[1] * (-b[3] * x[0]).exp() + b[2] * (-b[4] * x[0]).exp()),
    ("Lanczos1", lanczos),
    ("Lanczos2", lanczos),
    ("Gauss3", gauss),
    // b1 (1 − (1 + 2 b2 x)^−½)
    ("Misra1c", |x, b| -b[0] * ((b[1] * (2.0 * x[0]) + 1.0).powf(-0.5) - 1.0)),
    // b1 b2 x/(1 + b2 x)
    ("Misra1d", |x, b| b[0] * b[1] * x[0] / (b[1] * x[0] + 1.0)),
    // b1 − b2 x − arctan(b3/(x − b4))/π
    ("Roszman1", |x, b| b[0] - b[1] * x[0] - (b[2] / (-b[3] + x[0])).atan() / PI),
    ("ENSO", enso),
    ("MGH09", mgh09),
    ("Thurber", rational::<4>),
    ("BoxBOD", saturation),
    // b1/(1 + exp(b2 − b3 x))
    ("Rat42", |x, b| b[0] / ((b[1] - b[2] * x[0]).exp() + 1.0)),
    // b1 exp(b2/(x + b3))
    ("MGH10", |x, b| b[0] * (b[1] / (b[2] + x[0])).exp()),
    // (b1/b2) exp(−½((x − b3)/b2)²)
    ("Eckerle4", |x, b| b[0] / b[1] * (((-b[2] + x[0]) / b[1]).powi(2) * -0.5).exp()),
    // b1/(1 + exp(b2 − b3 x))^(1/b4)
    ("Rat43", |x, b| b[0] * (-((b[1] - b[2] * x[0]).exp().ln_1p()) / b[3]).exp()),
    // b1 (b2 + x)^(−1/b3)
    ("Bennett5", |x, b| b[0] * (-(b[1] + x[0]).ln() / b[2]).exp()),
];

/// b1 (1 − exp(−b2 x))
pub fn saturation(x: &[f64], b: &[Dual64]) -> Dual64 {
    -b[0] * ((-b[1] * x[0]).exp() - 1.0)
}

/// exp(−b1 x)/(b2 + b3 x)
fn chwirut(x: &[f64], b: &[Dual64]) -> Dual64 {
    (-b[0] * x[0]).exp() / (b[1] + b[2] * x[0])
}

/// b1 exp(−b2 x) + b3 exp(−b4 x) + b5 exp(−b6 x)
fn lanczos(x: &[f64], b: &[Dual64]) -> Dual64 {
    b[0] * (-b[1] * x[0]).exp() + b[2] * (-b[3] * x[0]).exp() + b[4] * (-b[5] * x[0]).exp()
}

/// b1 exp(−b2 x) + b3 exp(−(x − b4)²/b5²) + b6 exp(−(x − b7)²/b8²)
fn gauss(x: &[f64], b: &[Dual64]) -> Dual64 {
    let peak = |b: &[Dual64]| b[0] * (-((-b[1] + x[0]) / b[2]).powi(2)).exp();
    b[0] * (-b[1] * x[0]).exp() + peak(&b[2..]) + peak(&b[5..])
}

/// (b1 + b2 x + … + bN x^(N−1))/(1 + b(N+1) x + b(N+2) x² + …)
fn rational<const N: usize>(x: &[f64], b: &[Dual64]) -> Dual64 {
    let horner = |b: &[Dual64]| b.iter().rev().fold(Dual64::from_re(0.0), |sum, b| sum * x[0] + *b);
    horner(&b[..N]) / (horner(&b[N..]) * x[0] + 1.0)
}

/// b1 + b2 cos(2πx/12) + b3 sin(2πx/12) + b5 cos(2πx/b4) + b6 sin(2πx/b4) + b8 cos(2πx/b7) + b9 sin(2πx/b7)
fn enso(x: &[f64], b: &[Dual64]) -> Dual64 {
    let turn = 2.0 * PI * x[0];
    let wave = |period: Dual64, b: &[Dual64]| {
        let (sin, cos) = (period.recip() * turn).sin_cos();
        b[0] * cos + b[1] * sin
    };
    b[0] + wave(Dual64::from_re(12.0), &b[1..]) + wave(b[3], &b[4..]) + wave(b[6], &b[7..])
}

/// b1 (x² + b2 x)/(x² + b3 x + b4)
pub fn mgh09(x: &[f64], b: &[Dual64]) -> Dual64 {
    let x = x[0];
    b[0] * (b[1] * x + x * x) / (b[2] * x + b[3] + x * x)
}
