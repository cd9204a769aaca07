//! The equations of `full` to 30 digits: by power series in τ = −ln u over the whole slip, with
//! numbers of twice the precision. Only the equations are those of [`crate::physics::collision`].
//! Valid for μ_s up to 1 and speeds whose squares neither overflow nor vanish.
//!
//! | symbol | meaning |
//! | --- | --- |
//! | u, τ | part of v_z that is left, −ln u |
//! | n, m, p | v_z0²/ρ², v_y0²/ρ², 2γ, with ρ² = v_y0² + v_z0² |
//! | g | √(n + m e^(−pτ)): the slip is ρug |
//! | Q, R | ∫ g e^(−τ) dτ, ∫ (1 − e^(−τ)) g e^(−τ) dτ |
//! | v, w | −K + 2Q − Σ(1 − u), ∫ v dQ = Q² − KQ − ΣR |
//!
//! Compression ends at v = 0, restitution at w = (1 − e²)w_c (Kim 2024, Eqs. 14–16 and 37, with 1 −
//! μ_s in Eq. 10).

use twofloat::TwoFloat;

use super::Shot;
use crate::physics::ball::{Ball, BallState, Vec3};
use crate::physics::collision::{Outcome, Regime};

/// Length of a panel in τ. The nearest singularity is at |τ| = π/p, beyond 2 for all μ_s below 1:
/// the remainder of a series is (1/16)^TERMS.
const PANEL: f64 = 0.125;
const TERMS: usize = 26;

/// Number of panels after which the remaining slip is below 1e-31.
const PANELS: usize = 576;

type Series = [TwoFloat; TERMS];

fn number(x: f64) -> TwoFloat {
    TwoFloat::from(x)
}

/// Returns a/b to full precision; the library's quotient of two `TwoFloat` has 16 digits (0.8.4).
fn over(a: TwoFloat, b: TwoFloat) -> TwoFloat {
    let first = a.hi() / b.hi();
    let rest = a - b * first;
    let second = rest.hi() / b.hi();
    let third = (rest - b * second).hi() / b.hi();
    TwoFloat::new_add(first, second) + third
}

fn sum(terms: impl Iterator<Item = TwoFloat>) -> TwoFloat {
    terms.fold(number(0.0), |sum, term| sum + term)
}

fn product(a: &Series, b: &Series) -> Series {
    std::array::from_fn(|k| sum((0..=k).map(|i| a[i] * b[k - i])))
}

fn root(a: &Series) -> Series {
    let mut root = [number(0.0); TERMS];
    root[0] = a[0].sqrt();
    for k in 1..TERMS {
        let inner = sum((1..k).map(|i| root[i] * root[k - i]));
        root[k] = over(a[k] - inner, 2.0 * root[0]);
    }
    root
}

/// Returns the integral that has the value `start` at 0.
fn integral(a: &Series, start: TwoFloat) -> Series {
    std::array::from_fn(|k| if k == 0 { start } else { a[k - 1] / k as f64 })
}

/// Returns start·e^(−at).
fn decaying(start: TwoFloat, a: TwoFloat) -> Series {
    let mut term = start;
    std::array::from_fn(|k| {
        if k > 0 {
            term = -term * a / k as f64;
        }
        term
    })
}

fn at(series: &Series, t: TwoFloat) -> TwoFloat {
    series.iter().rev().fold(number(0.0), |sum, &term| sum * t + term)
}

/// Returns the τ at which a series passes `target` from below, between `low` and the end of a
/// panel, by halving to below 1e-32.
fn passes(series: &Series, target: TwoFloat, mut low: TwoFloat) -> TwoFloat {
    let mut high = number(PANEL);
    for _ in 0..110 {
        let middle = 0.5 * (low + high);
        if at(series, middle) < target { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The end of an impact, in scaled units.
struct End {
    q: TwoFloat,
    /// 1 − u and 1 − u^(1+γ).
    z_gone: TwoFloat,
    y_gone: TwoFloat,
    regime: Regime,
}

/// An impact in scaled units.
struct Scaled {
    kk: TwoFloat,
    sigma: TwoFloat,
    e: TwoFloat,
    n: TwoFloat,
    m: TwoFloat,
    p: TwoFloat,
}

impl Scaled {
    fn end(&self) -> End {
        let (zero, one, panel) = (number(0.0), number(1.0), number(PANEL));
        let (mut s, mut power, mut q, mut r) = (one, one, zero, zero);
        let mut compressed: Option<TwoFloat> = None;
        for _ in 0..PANELS {
            let left = decaying(s, one);
            let powers = decaying(power, self.p);
            let mut under = powers.map(|term| term * self.m);
            under[0] += self.n;
            let rate = product(&left, &root(&under));
            let mut gone = left.map(|term| -term);
            gone[0] += one;
            let q_along = integral(&rate, q);
            let r_along = integral(&product(&gone, &rate), r);
            let mut v: Series = std::array::from_fn(|k| 2.0 * q_along[k] - self.sigma * gone[k]);
            v[0] -= self.kk;
            let square = product(&q_along, &q_along);
            let w: Series =
                std::array::from_fn(|k| square[k] - self.kk * q_along[k] - self.sigma * r_along[k]);
            let mut from = zero;
            if compressed.is_none() && at(&v, panel) >= zero {
                from = passes(&v, zero, zero);
                compressed = Some(at(&w, from));
            }
            if let Some(least) = compressed {
                let target = (one - self.e * self.e) * least;
                if at(&w, panel) >= target {
                    let t = if self.e == zero { from } else { passes(&w, target, from) };
                    let u = at(&left, t);
                    let y_gone = one - u * at(&powers, t).sqrt();
                    return End { q: at(&q_along, t), z_gone: one - u, y_gone, regime: Regime::Slide };
                }
            }
            (s, power, q, r) =
                (at(&left, panel), at(&powers, panel), at(&q_along, panel), at(&r_along, panel));
        }
        // stuck: w = Q² − (K + Σ)Q + B from here on, B = Σ(Q_s − R_s)
        let middle = 0.5 * (self.kk + self.sigma);
        let depth = middle * middle - self.sigma * (q - r);
        let rest = match compressed {
            None => self.e * self.e * depth,
            Some(least) => depth + (one - self.e * self.e) * least,
        };
        End { q: middle + rest.sqrt(), z_gone: one, y_gone: one, regime: Regime::Stick }
    }
}

/// Returns the outcome of a shot, each component rounded once.
#[must_use]
pub fn collide(shot: &Shot, ball: Ball) -> Outcome {
    let Shot { cue, coefficients } = shot;
    let [mu, mu_s, e, nu, radius] =
        [coefficients.mu, coefficients.mu_s, coefficients.e, ball.inertia, ball.radius].map(number);
    let (zero, one) = (number(0.0), number(1.0));
    let (u_x, u_y) = (number(cue.velocity.x), number(cue.velocity.y));
    // v_y0 = −U_y − Rω_z, v_z0 = Rω_y
    let v_y = -u_y - radius * number(cue.spin.z);
    let v_z = radius * number(cue.spin.y);
    let topspin = v_z > zero;
    let m_s = if topspin { mu_s } else { zero };
    let beta_y = over(one + nu, nu);
    let beta_z = over(2.0 + nu - m_s, 2.0 * nu);
    let square = v_y * v_y + v_z * v_z;
    let (mut q, mut j_y, mut j_z) = (0.5 * (one + e) * u_x, zero, zero);
    let mut regime = if square > zero { Regime::Slide } else { Regime::Stick };
    if square > zero && mu > zero {
        let rho = square.sqrt();
        let unit = over(rho, 2.0 * mu * beta_z);
        let end = Scaled {
            kk: over(u_x, unit),
            sigma: over(m_s * mu * v_z, rho),
            e,
            n: over(v_z * v_z, square),
            m: over(v_y * v_y, square),
            p: 2.0 * (over(beta_y, beta_z) - one),
        }
        .end();
        q = end.q * unit;
        j_y = over(-v_y * end.y_gone, 2.0 * beta_y);
        j_z = over(-v_z * end.z_gone, 2.0 * beta_z);
        regime = end.regime;
    }
    // U_f = U_i − (q, J_y, J_z [topspin]), V_f = (q + m_s J_z, J_y, J_z [draw]); spins by the
    // torques of J and cloth
    let per = over(one, nu * radius);
    let (up, down) = if topspin { (j_z, zero) } else { (zero, j_z) };
    let round = |x: TwoFloat| x.hi();
    let side = round(-j_y * per);
    Outcome {
        regime,
        impulse: round(q),
        cue: BallState {
            velocity: Vec3::new(round(u_x - q), round(u_y - j_y), round(-up)),
            spin: Vec3::new(
                cue.spin.x,
                round(number(cue.spin.y) + j_z * per),
                round(number(cue.spin.z) - j_y * per),
            ),
        },
        object: BallState {
            velocity: Vec3::new(round(q + m_s * j_z), round(j_y), round(down)),
            spin: Vec3::new(0.0, round((one - m_s) * j_z * per), side),
        },
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::physics::collision::Coefficients;

    /// tests/reference/hard_cases.json was computed with 40 digits in another language.
    #[test]
    fn agrees_with_25_digits_to_the_last_of_16() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/hard_cases.json");
        let cases: Vec<Value> = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        let ball = Ball { radius: 1.0 / 32.0, ..Ball::POOL };
        let mut compared = 0;
        for case in &cases {
            let number = |value: &Value| value.as_f64().unwrap();
            let cue = BallState {
                velocity: Vec3::new(number(&case["velocity"][0]), number(&case["velocity"][1]), 0.0),
                spin: Vec3::from([0, 1, 2].map(|i| number(&case["spin"][i]))),
            };
            let [mu, mu_s, e] = ["mu", "mu_s", "e"].map(|key| number(&case[key]));
            let Some(expected) = case["outcome"]["full"].as_array() else { continue };
            let speed = cue.velocity.norm().max(ball.radius * cue.spin.norm());
            // twice the precision has the range of f64: squares must not leave it
            let mut speeds = [speed, cue.velocity.x].into_iter();
            if !speeds.all(|speed| (1e-60..1e60).contains(&speed)) {
                continue;
            }
            compared += 1;
            let found = collide(&Shot { cue, coefficients: Coefficients { mu, mu_s, e } }, ball).components();
            for (found, expected) in found.iter().zip(expected) {
                let expected: f64 = expected.as_str().unwrap().parse().unwrap();
                // a unit in the last place, since the reference is rounded, too, and e^(−72), which
                // is taken for 0
                let most = 2.3e-16 * expected.abs() + 1e-29 * speed / ball.radius;
                let name = &case["name"];
                assert!((found - expected).abs() <= most, "{name}: {found:e} for {expected:e}");
            }
        }
        assert!(2 * compared > cases.len(), "only {compared} compared");
    }
}
