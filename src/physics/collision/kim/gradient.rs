//! The derivatives of the impulses, with respect to the variables of [`Contact`].
//!
//! The end of the impact is an equation for q_f. We differentiate it at fixed q, not at fixed u: no
//! terms of order 1/μ cancel then, and by dW/dq = v_x = 0 the end of compression need not be moved at all.
//! With c = 1/2μβ_z, S = ρg, A = m_s v_z0/2β_z,
//!
//! ```text
//! q = c ∫ S ds          W = −kq + q² − AP,  P = ∫ (1 − u) dq
//! ∂P = −∂[c ∫ (s − u) S ds]  at fixed q on the left, at fixed u on the right
//! ```

use wide::f64x2;

use super::path::{Node, Path, Slip};
use super::side_by_side::{Stretches, within_reach};
use super::{End, Slips, start};
use crate::numerics::quadrature::GAUSS_4;
use crate::physics::collision::{Contact, Gradient, ImpulseGradient, variable};

pub(super) fn gradient(contact: &Contact, end: &End) -> ImpulseGradient {
    let (path, rho) = start(contact);
    // J_y = v_y0 Y/2β_y, J_z = v_z0 Z/2β_z with Y = u^(1+γ) − 1, Z = u − 1
    let (per_y, per_z) = (0.5 / contact.beta_y(), 0.5 / contact.beta_z());
    match end {
        End::Stick { q, compressed } => {
            let scales = Scales::new(contact, rho);
            let normal = scales.stuck(&path, *q, compressed.as_ref());
            let mut y = Gradient::zeros();
            y[variable::V_Y] = -per_y;
            let mut z = Gradient::zeros();
            z[variable::V_Z] = -per_z;
            z[variable::M_S] = contact.v_z * per_z * scales.ln_beta_z;
            ImpulseGradient { normal, y, z }
        }
        End::Slide { slips, .. } => of_slide(contact, &path, rho, slips),
    }
}

/// Of an impact that slides to its end.
#[inline]
pub(super) fn of_slide(contact: &Contact, path: &Path, rho: f64, slips: &Slips) -> ImpulseGradient {
    let &Contact { v_y, v_z, .. } = contact;
    let scales = Scales::new(contact, rho);
    let (per_y, per_z) = (0.5 / contact.beta_y(), 0.5 / contact.beta_z());
    let slip = &slips.end;
    let (normal, d_u) =
        if v_z > 0.0 { scales.with_cloth(path, slips) } else { scales.without_cloth(path, slip) };
    // dY = (1 + γ)u^γ du + u^(1+γ) ln u dγ
    let gamma_power = slip.power.sqrt();
    let mut y = v_y * per_y * (1.0 + contact.gamma()) * gamma_power * d_u;
    y[variable::V_Y] -= per_y * slip.y_gone();
    y[variable::M_S] -= v_y * per_y * slip.left * gamma_power * slip.tau * scales.gamma;
    let mut z = v_z * per_z * d_u;
    z[variable::V_Z] -= per_z * slip.gone;
    z[variable::M_S] += v_z * per_z * slip.gone * scales.ln_beta_z;
    ImpulseGradient { normal, y, z }
}

/// What the integrals are multiplied with, and its derivatives.
struct Scales<'a> {
    contact: &'a Contact,
    rho: f64,
    c: f64,
    a: f64,
    d_a: Gradient,
    /// ln β_z and γ by m_s.
    ln_beta_z: f64,
    gamma: f64,
}

/// ∫ wS ds over a part of the path, in m/s, and what its derivatives need: ∫ w/g ds, ∫ w s^p/g ds and
/// ∫ w s^p ln s/g ds.
#[derive(Clone, Copy, Default)]
struct Integral {
    g: f64,
    inverse: f64,
    power: f64,
    log: f64,
}

impl Integral {
    #[inline]
    fn add(&mut self, weight: f64, [g, inverse, power, log]: [f64; 4]) {
        self.g += weight * g;
        self.inverse += weight * inverse;
        self.power += weight * power;
        self.log += weight * log;
    }

    /// self + by·other.
    #[inline]
    fn plus(&self, by: f64, other: &Self) -> Self {
        Self {
            g: self.g + by * other.g,
            inverse: self.inverse + by * other.inverse,
            power: self.power + by * other.power,
            log: self.log + by * other.log,
        }
    }
}

/// g, 1/g, s^p/g and s^p ln s/g at a node.
#[inline]
fn terms(path: &Path, power: f64, tau: f64) -> [f64; 4] {
    let g = path.g(power);
    let inverse = 1.0 / g;
    let over = power * inverse;
    [g, inverse, over, -tau * over]
}

impl Path {
    /// From u₀ to u₁ (`way` counts from u₀ = 1): ∫ S ds and ∫ (s − u₁) S ds.
    #[inline]
    fn integrals(&self, from: &Slip, way: &Slip) -> [Integral; 2] {
        let mut all = [Integral::default(); 2];
        self.walk(way.tau, |node| {
            let terms = terms(self, from.power * node.power, from.tau + node.tau);
            let weight = from.left * node.weight;
            all[0].add(weight, terms);
            all[1].add(weight * from.left * (way.gone - node.gone), terms);
        });
        all
    }

    /// [`Path::integrals`] of compression and restitution, side by side.
    #[inline(always)]
    fn two_integrals(&self, compressed: &Slip, restored: &Slip) -> [[Integral; 2]; 2] {
        let stretches = Stretches::new(self, f64x2::new([compressed.tau, restored.tau]));
        let (m, half) = (stretches.m(self), stretches.half());
        let [from, from_power, from_tau] = [
            f64x2::new([1.0, compressed.left]),
            f64x2::new([1.0, compressed.power]),
            f64x2::new([0.0, compressed.tau]),
        ];
        let gone = stretches.gone();
        let mut all = [[f64x2::ZERO; 4]; 2];
        stretches.walk(|x, nodes| {
            let g = (m * nodes.power + self.n).sqrt();
            let inverse = nodes.weight / g;
            let over = from_power * nodes.power * inverse;
            let terms = [nodes.weight * g, inverse, over, -(from_tau + half * (1.0 + x)) * over];
            for i in 0..4 {
                all[0][i] += terms[i];
                all[1][i] += (gone - nodes.gone) * terms[i];
            }
        });
        let integral = |arm: usize, i: usize| {
            let scale = if arm == 0 { half * from } else { half * from * from };
            let of = |k: usize| (all[arm][k] * scale).as_array()[i];
            Integral { g: of(0), inverse: of(1), power: of(2), log: of(3) }
        };
        [[integral(0, 0), integral(1, 0)], [integral(0, 1), integral(1, 1)]]
    }

    /// The whole slip: ∫ s S ds.
    fn whole_integral(&self) -> Integral {
        let mut all = Integral::default();
        self.walk_whole(|&Node { s, power, tau, weight, .. }| all.add(weight * s, terms(self, power, tau)));
        all
    }
}

impl<'a> Scales<'a> {
    #[inline(always)]
    fn new(contact: &'a Contact, rho: f64) -> Self {
        let &Contact { mu, m_s, v_z, sigma, levers, .. } = contact;
        // β_z = (2 + ν − σm_s)/2ν, γ = (ν + σm_s)/(2 + ν − σm_s)
        let twice = levers.z - sigma * m_s;
        let ln_beta_z = -sigma / twice;
        let gamma = sigma * 2.0 * levers.y / (twice * twice);
        let beta_z = contact.beta_z();
        let c = 1.0 / (2.0 * mu * beta_z);
        let a = m_s * v_z / (2.0 * beta_z);
        let mut d_a = Gradient::zeros();
        d_a[variable::M_S] = v_z / (2.0 * beta_z) - a * ln_beta_z;
        d_a[variable::V_Z] = m_s / (2.0 * beta_z);
        Self { contact, rho, c, a, d_a, ln_beta_z, gamma }
    }

    /// c∫wS ds.
    #[inline]
    fn value(&self, integral: &Integral) -> f64 {
        self.c * self.rho * integral.g
    }

    /// ∂(c∫wS ds), with S = √(v_z0² + v_y0² s^2γ): ∂S/∂v_z0 = v_z0/S, ∂S/∂v_y0 = v_y0 s^2γ/S,
    /// ∂S/∂γ = v_y0² s^2γ ln s/S.
    #[inline]
    fn derivative(&self, integral: &Integral) -> Gradient {
        let (z, y) = (self.contact.v_z / self.rho, self.contact.v_y / self.rho);
        let value = self.value(integral);
        let mut d = Gradient::zeros();
        d[variable::V_Y] = self.c * y * integral.power;
        d[variable::V_Z] = self.c * z * integral.inverse;
        d[variable::MU] = -value / self.contact.mu;
        d[variable::M_S] = self.c * self.rho * y * y * integral.log * self.gamma - value * self.ln_beta_z;
        d
    }

    /// du from q = c∫S ds: dq = ∂(c∫S ds) − cS du.
    #[inline]
    fn d_u(&self, path: &Path, slip: &Slip, whole: &Integral, d_q: &Gradient) -> Gradient {
        (self.derivative(whole) - d_q) / (self.c * self.rho * path.g(slip.power))
    }

    /// q_f = (1 + e)k/2.
    #[inline]
    fn d_free(&self) -> Gradient {
        let mut d = Gradient::zeros();
        d[variable::K] = 0.5 * (1.0 + self.contact.e);
        d[variable::E] = 0.5 * self.contact.k;
        d
    }

    /// dq_f and du_f of a shot without topspin.
    fn without_cloth(&self, path: &Path, slip: &Slip) -> (Gradient, Gradient) {
        let d_q = self.d_free();
        let whole = if self.contact.levers.are_of_spheres() {
            of_sphere(path, slip)
        } else {
            path.integrals(&Slip::START, slip)[0]
        };
        (d_q, self.d_u(path, slip, &whole, &d_q))
    }

    /// The same with topspin.
    #[inline]
    fn with_cloth(&self, path: &Path, slips: &Slips) -> (Gradient, Gradient) {
        let &Contact { e, .. } = self.contact;
        let Slips { end: slip, compressed, restored } = slips;
        let [[first, first_arm], [second, second_arm]] =
            if within_reach(path, compressed.tau.max(restored.tau)) {
                path.two_integrals(compressed, restored)
            } else {
                [path.integrals(&Slip::START, compressed), path.integrals(compressed, restored)]
            };
        let compression = self.compression(compressed, &first, &first_arm);
        // restitution by increments: Δu, Δq, ΔP = (1 − u_c)Δq + c∫(u_c − s)S ds, v_f = 2Δq − AΔu
        let d_u = compressed.left * restored.gone;
        let dq = self.value(&second);
        let dp = compressed.gone * dq + d_u * dq - self.value(&second_arm);
        let v_f = 2.0 * dq - self.a * d_u;
        // W_f − W_c = −e²W_c: v_f dq_f = Δq dk + ΔP dA − A∂[c(Δu∫S ds + ∫(s − u_f)S ds)] − e²dW_c − 2eW_c de
        let mut right =
            dp * self.d_a - self.a * self.derivative(&second_arm.plus(d_u, &first)) - e * e * compression.d_w;
        right[variable::K] += dq;
        right[variable::E] -= 2.0 * e * compression.w;
        let d_q = right / v_f;
        (d_q, self.d_u(path, slip, &first.plus(1.0, &second), &d_q))
    }

    /// W_c = −kq_c + q_c² − AP_c with k = 2q_c − A(1 − u_c); dW_c = −q_c dk − P_c dA + A∂[c∫(s − u_c)S ds].
    #[inline]
    fn compression(&self, compressed: &Slip, whole: &Integral, arm: &Integral) -> Compression {
        let q = self.value(whole);
        let p = compressed.gone * q - self.value(arm);
        let w = -q * q + self.a * (compressed.gone * q - p);
        let mut d_w = self.a * self.derivative(arm) - p * self.d_a;
        d_w[variable::K] -= q;
        Compression { w, d_w }
    }

    /// dq_f of an impact that ends stuck.
    fn stuck(&self, path: &Path, q_f: f64, compressed: Option<&Slip>) -> Gradient {
        let &Contact { k, e, v_z, .. } = self.contact;
        if v_z <= 0.0 {
            return self.d_free();
        }
        // once stuck, W = q² − (k + A)q + B, B = A c∫₀¹ sS ds
        let whole = path.whole_integral();
        let b = self.a * self.value(&whole);
        let d_b = self.value(&whole) * self.d_a + self.a * self.derivative(&whole);
        let mut d_ka = self.d_a;
        d_ka[variable::K] += 1.0;
        match compressed {
            None => {
                // q_f = q_c + e√(q_c² − B), q_c = (k + A)/2
                let q_c = 0.5 * (k + self.a);
                let root = (q_c * q_c - b).max(0.0).sqrt();
                let mut d = 0.5 * d_ka + e / (2.0 * root) * (q_c * d_ka - d_b);
                d[variable::E] += root;
                d
            }
            Some(compressed) => {
                // q_f² − (k + A)q_f + B = (1 − e²)W_c
                let [first, arm] = path.integrals(&Slip::START, compressed);
                let Compression { w, d_w } = self.compression(compressed, &first, &arm);
                let mut right = q_f * d_ka - d_b + (1.0 - e * e) * d_w;
                right[variable::E] -= 2.0 * e * w;
                right / (2.0 * q_f - k - self.a)
            }
        }
    }
}

/// W_c and its derivative.
struct Compression {
    w: f64,
    d_w: Gradient,
}

/// With γ = 1/6, as in [`super::free`]: ∫ ds/g = 6∫ y² dζ, ∫ s^p ds/g = 6∫ y³ dζ, polynomials of degree 5
/// and 7, for which 4 nodes are exact.
#[inline]
fn of_sphere(path: &Path, slip: &Slip) -> Integral {
    // ζ = (1 − y)/(1 + √(n + my)), y = u^p
    let zeta = slip.power_gone / (1.0 + path.g(slip.power));
    let mut sum = Integral::default();
    for (x, w) in GAUSS_4 {
        for x in [-x, x] {
            // y = 1 − 2ζ + mζ²
            let z = 0.5 * zeta * (1.0 + x);
            let y = 1.0 - z * (2.0 - path.m * z);
            let weight = 3.0 * zeta * w;
            sum.inverse += weight * y * y;
            sum.power += weight * y * y * y;
        }
    }
    sum.g = path.n * sum.inverse + path.m * sum.power;
    sum
}
