//! The exact solution of the equations of motion in the impulse, free of singularities.
//!
//! With u the fraction of v_z still left (1 → 0), both components of the slip fall as powers of u,
//! v_z = v_z0 u, v_y = v_y0 u^(1+γ), and everything else is an integral over u. We use
//! τ = −ln u, so that a short slip keeps its digits, and scale by the first slip ρ = |v_∥0|:
//!
//! | symbol | meaning |
//! | --- | --- |
//! | n, m | v_z0²/ρ², v_y0²/ρ² |
//! | g(u) | √(n + m u^2γ), so that v_∥ = ρ u g |
//! | Q | ∫ g du from u to 1; q = (ρ/2μβ_z) Q |
//! | A | m_s v_z0/2β_z, so that v_x = −k + 2q − A(1 − u) |
//! | W | ∫ v_x dq; restitution ends where W = (1 − e²) W_c (Kim 2024, Eq. 37) |
//!
//! The paper's own form with v̄ (Eq. 24) and ₂F₁ (Eqs. 29–30) solves the same equations, but breaks
//! down where v_y0 or v_z0 is 0 and where ₂F₁ has poles.

use super::{Contact, Gradient, Impulse, ImpulseGradient, Regime, variable};
use crate::quadrature::{gauss_legendre, tanh_sinh};

/// Newton's method converges from one side; each step at least divides u or squares the error, so
/// that this many are never reached.
const MAX_NEWTON: usize = 100;

/// A Newton step of this relative size leaves an error of its square: the next is rounding.
const NEWTON_LAST_STEP: f64 = 1e-8;

/// With so little of the slip left the contact has stuck, to rounding.
const STUCK: f64 = 1e-20;

/// Stands in for μ = 0 in derivatives with respect to μ, where q and Q vanish together.
const TINY_MU: f64 = 1e-60;

/// Stands in for e = 0 in derivatives with respect to e, where restitution has no length.
const TINY_E: f64 = 1e-9;

pub(super) fn impulse(contact: &Contact) -> (Impulse, Regime) {
    let end = solve(contact);
    (end.impulse(contact), end.regime())
}

pub(super) fn impulse_and_gradient(contact: &Contact) -> ((Impulse, Regime), ImpulseGradient) {
    let solution = impulse(contact);
    let regular = Contact { mu: contact.mu.max(TINY_MU), e: contact.e.max(TINY_E), ..*contact };
    (solution, gradient(&regular, &solve(&regular)))
}

/// How an impact ends.
enum End {
    /// Still sliding, with the fraction u = exp(−τ) of v_z left.
    Slide { q: f64, tau: f64, compressed: f64 },
    /// Stuck, either before (`None`) or after the end of compression at τ.
    Stick { q: f64, compressed: Option<f64> },
}

impl End {
    fn regime(&self) -> Regime {
        match self {
            Self::Slide { .. } => Regime::Slide,
            Self::Stick { .. } => Regime::Stick,
        }
    }

    /// J_y = (v_y(q_f) − v_y0)/2β_y, J_z = (v_z(q_f) − v_z0)/2β_z (Eq. 57).
    fn impulse(&self, contact: &Contact) -> Impulse {
        let (y, z) = (contact.v_y / (2.0 * contact.beta_y()), contact.v_z / (2.0 * contact.beta_z()));
        match *self {
            Self::Slide { q, tau, .. } => {
                let gamma = contact.gamma();
                Impulse { normal: q, y: y * (-(1.0 + gamma) * tau).exp_m1(), z: z * (-tau).exp_m1() }
            }
            Self::Stick { q, .. } => Impulse { normal: q, y: -y, z: -z },
        }
    }
}

/// The way the slip takes, in the scaled quantities of the table above.
struct Path {
    n: f64,
    m: f64,
    /// 2γ.
    p: f64,
}

/// A point of the path, with integrals from the point where it was started, u₀.
#[derive(Clone, Copy)]
struct Point {
    tau: f64,
    /// u₀ − u.
    delta: f64,
    /// ∫ g du from u to u₀.
    q: f64,
    /// ∫ (u₀ − s) g ds from u to u₀.
    r: f64,
}

impl Point {
    fn start(tau: f64) -> Self {
        Self { tau, delta: 0.0, q: 0.0, r: 0.0 }
    }

    fn u(&self) -> f64 {
        (-self.tau).exp()
    }
}

impl Path {
    fn new(contact: &Contact) -> (Self, f64) {
        let rho = contact.v_y.hypot(contact.v_z);
        let (z, y) = (contact.v_z / rho, contact.v_y / rho);
        (Self { n: z * z, m: y * y, p: 2.0 * contact.gamma() }, rho)
    }

    fn g(&self, tau: f64) -> f64 {
        (self.n + self.m * (-self.p * tau).exp()).sqrt()
    }

    /// Panels short enough for 8 nodes: in τ, g is analytic up to a distance π/p.
    fn panels(&self, d_tau: f64) -> usize {
        (d_tau.abs() * self.p.abs().max(2.0)).ceil().max(1.0) as usize
    }

    /// The point further on by `d_tau`.
    fn advance(&self, from: &Point, d_tau: f64) -> Point {
        let u = from.u();
        let (mut dq, mut dr) = (0.0, 0.0);
        gauss_legendre(0.0, d_tau, self.panels(d_tau), |t, w| {
            let g_du = w * u * (-t).exp() * self.g(from.tau + t);
            dq += g_du;
            dr += g_du * u * -(-t).exp_m1();
        });
        Point {
            tau: from.tau + d_tau,
            delta: from.delta - u * (-d_tau).exp_m1(),
            q: from.q + dq,
            r: from.r + from.delta * dq + dr,
        }
    }

    /// Newton's method in u along the path from `start`, for a concave function of which
    /// `step(point)` is (target − value)/slope. `None` if it ends where nothing is left of the slip.
    fn find(&self, start: Point, mut d_u: f64, step: impl Fn(&Point) -> f64) -> Option<Point> {
        let mut point = start;
        for _ in 0..MAX_NEWTON {
            let u = point.u();
            if u < STUCK {
                return None;
            }
            point = self.advance(&point, -(-(d_u / u).min(0.9)).ln_1p());
            if d_u.abs() <= NEWTON_LAST_STEP * point.delta.abs() {
                return Some(point);
            }
            d_u = step(&point);
        }
        Some(point)
    }

    /// (∫₀¹ g du, ∫₀¹ u g du): the whole slip.
    fn whole(&self) -> (f64, f64) {
        let (mut q, mut uq) = (0.0, 0.0);
        tanh_sinh(|u, w| {
            let g = w * (self.n + self.m * u.powf(self.p)).sqrt();
            q += g;
            uq += g * u;
        });
        (q, uq)
    }

    /// Bounds on ∫₀¹ g du that need no integral: max(√n, √m/(1+γ)) and their sum.
    fn whole_bounds(&self) -> (f64, f64) {
        let (n, m) = (self.n.sqrt(), self.m.sqrt() / (1.0 + 0.5 * self.p));
        (n.max(m), n + m)
    }
}

fn solve(contact: &Contact) -> End {
    let &Contact { k, e, mu, .. } = contact;
    let (path, rho) = Path::new(contact);
    let q_without_cloth = 0.5 * (1.0 + e) * k;
    if rho == 0.0 {
        return End::Stick { q: q_without_cloth, compressed: None };
    }
    if mu == 0.0 {
        return End::Slide { q: q_without_cloth, tau: 0.0, compressed: 0.0 };
    }
    // q = (ρ/2μβ_z) Q
    let per_q = 2.0 * mu * contact.beta_z() / rho;
    if contact.v_z > 0.0 {
        with_cloth(contact, &path, per_q)
    } else {
        without_cloth(q_without_cloth, &path, per_q)
    }
}

/// m_s = 0: restitution ends at q_f = (1 + e)k/2, and only Q(u) = q_f is left to invert.
fn without_cloth(q: f64, path: &Path, per_q: f64) -> End {
    let target = per_q * q;
    let (at_least, at_most) = path.whole_bounds();
    if target > at_least && (target >= at_most || target >= path.whole().0) {
        return End::Stick { q, compressed: None };
    }
    let start = Point::start(0.0);
    match path.find(start, target, |x| (target - x.q) / path.g(x.tau)) {
        Some(x) => End::Slide { q, tau: x.tau, compressed: 0.0 },
        None => End::Stick { q, compressed: None },
    }
}

/// m_s > 0 (or topspin on a cloth with μ_s = 0): the end of compression v_x = 0, then restitution
/// by increments from there, since W_f − W_c = e²|W_c| is small for small e.
fn with_cloth(contact: &Contact, path: &Path, per_q: f64) -> End {
    let &Contact { k, e, .. } = contact;
    // scaled by `per_q`: K = k, Σ = A, so that v = −K + 2Q − Σ(1 − u)
    let a = contact.m_s * contact.v_z / (2.0 * contact.beta_z());
    let (kk, sigma) = (per_q * k, per_q * a);
    // q_f ≤ (1 + e)(k + A)/2 + A
    let q_bound = 0.5 * (1.0 + e) * (kk + sigma) + sigma;
    let mut stuck = None;
    if q_bound >= path.whole_bounds().0 {
        let (q_s, uq_s) = path.whole();
        let v_s = -kk + 2.0 * q_s - sigma;
        if v_s <= 0.0 {
            // stuck before the end of compression: W = q² − (k + A)q + B from there on, so that
            // q_c = (k + A)/2, q_f = q_c + e√(q_c² − B)
            let q_c = 0.5 * (kk + sigma);
            let q_f = q_c + e * (q_c * q_c - sigma * uq_s).max(0.0).sqrt();
            return End::Stick { q: q_f / per_q, compressed: None };
        }
        stuck = Some((q_s, uq_s, v_s));
    }
    let v = |x: &Point| -kk + 2.0 * x.q - sigma * x.delta;
    let slope = |tau: f64| 2.0 * path.g(tau) - sigma;
    let Some(c) = path.find(Point::start(0.0), kk / slope(0.0), |x| -v(x) / slope(x.tau)) else {
        // the end of compression and stick coincide to rounding
        return End::Stick { q: 0.5 * (1.0 + e) * (kk + sigma) / per_q, compressed: None };
    };
    // −W_c = Q_c² − Σ(δ_c Q_c − P_c), since K = 2Q_c − Σδ_c
    let w_c = c.q * c.q - sigma * (c.delta * c.q - c.r);
    let target = e * e * w_c;
    if let Some((q_s, uq_s, v_s)) = stuck {
        // W_s − W_c = (Q_s − Q_c)² − Σ∫₀^{u_c} (u_c − s) g ds
        let dq = q_s - c.q;
        let r = c.u() * dq - (uq_s - (c.q - c.r));
        let rest = target - (dq * dq - sigma * r);
        if rest >= 0.0 {
            // v_s y + y² = rest
            let y = 2.0 * rest / (v_s + (v_s * v_s + 4.0 * rest).sqrt());
            return End::Stick { q: (q_s + y) / per_q, compressed: Some(c.tau) };
        }
    }
    if e == 0.0 {
        return End::Slide { q: c.q / per_q, tau: c.tau, compressed: c.tau };
    }
    // √(W − W_c) grows almost linearly: W − W_c = ΔQ² − Σ∫(u_c − s) g ds, d(W − W_c)/du = −v g
    let start = Point::start(c.tau);
    let first = target.sqrt() / (0.5 * path.g(c.tau) * slope(c.tau)).sqrt();
    let f = path.find(start, first, |x| {
        let root = (x.q * x.q - sigma * x.r).max(0.0).sqrt();
        let v = 2.0 * x.q - sigma * x.delta;
        2.0 * root * (target.sqrt() - root) / (v * path.g(x.tau))
    });
    match f {
        Some(f) => End::Slide { q: (c.q + f.q) / per_q, tau: f.tau, compressed: c.tau },
        None => End::Stick { q: (c.q + target.sqrt()) / per_q, compressed: Some(c.tau) },
    }
}

/// Integrals over a part of the path from u₀ down to u₁, in m/s, and their derivatives at fixed u₀
/// and u₁.
struct Segment {
    /// ∫ S ds, S = ρg.
    i: f64,
    d_i: Gradient,
    /// ∫ (u₀ − s) S ds, or ∫ s S ds for the whole path.
    p: f64,
    d_p: Gradient,
}

/// Sums up a [`Segment`].
struct SegmentSum<'a> {
    path: &'a Path,
    rho: f64,
    contact: &'a Contact,
    /// ∫ of g, 1/g, s^p/g and s^p ln s/g, each with weight 1 and with the second weight.
    sums: [[f64; 4]; 2],
}

impl<'a> SegmentSum<'a> {
    fn new(path: &'a Path, rho: f64, contact: &'a Contact) -> Self {
        Self { path, rho, contact, sums: [[0.0; 4]; 2] }
    }

    /// Adds the node s = exp(−τ), with the weights of both integrals.
    fn add(&mut self, tau: f64, weights: [f64; 2]) {
        let power = (-self.path.p * tau).exp();
        let g = (self.path.n + self.path.m * power).sqrt();
        let terms = [g, 1.0 / g, power / g, -tau * power / g];
        for (sum, weight) in self.sums.iter_mut().zip(weights) {
            for (sum, term) in sum.iter_mut().zip(terms) {
                *sum += weight * term;
            }
        }
    }

    /// S = √(v_z0² + v_y0² s^2γ): ∂S/∂v_z0 = v_z0/S, ∂S/∂v_y0 = v_y0 s^2γ/S,
    /// ∂S/∂γ = v_y0² s^2γ ln s/S.
    fn finish(self) -> Segment {
        let (z, y) = (self.contact.v_z / self.rho, self.contact.v_y / self.rho);
        let gradient = |sum: [f64; 4]| {
            let mut gradient = Gradient::zeros();
            gradient[variable::V_Z] = z * sum[1];
            gradient[variable::V_Y] = y * sum[2];
            gradient[variable::M_S] = self.rho * y * y * sum[3] * self.contact.d_gamma();
            gradient
        };
        let [first, second] = self.sums;
        Segment {
            i: self.rho * first[0],
            d_i: gradient(first),
            p: self.rho * second[0],
            d_p: gradient(second),
        }
    }
}

impl Path {
    /// From τ₀ to τ₁, second weight u₀ − s.
    fn segment(&self, rho: f64, contact: &Contact, from: f64, to: f64) -> Segment {
        let u = (-from).exp();
        let mut sum = SegmentSum::new(self, rho, contact);
        gauss_legendre(0.0, to - from, self.panels(to - from), |t, w| {
            let du = w * u * (-t).exp();
            sum.add(from + t, [du, du * u * -(-t).exp_m1()]);
        });
        sum.finish()
    }

    /// From u = 1 to 0, second weight s.
    fn whole_segment(&self, rho: f64, contact: &Contact) -> Segment {
        let mut sum = SegmentSum::new(self, rho, contact);
        tanh_sinh(|u, w| sum.add(-u.ln(), [w, w * u]));
        sum.finish()
    }
}

impl Contact {
    /// dβ_z/dm_s.
    fn d_beta_z(&self) -> f64 {
        -self.sigma / (2.0 * self.nu)
    }

    /// dγ/dm_s.
    fn d_gamma(&self) -> f64 {
        self.sigma * 2.0 * (1.0 + self.nu) / (2.0 + self.nu - self.sigma * self.m_s).powi(2)
    }
}

/// d(variable)/d(variables).
fn unit(variable: usize) -> Gradient {
    let mut unit = Gradient::zeros();
    unit[variable] = 1.0;
    unit
}

/// Derivatives by the implicit function theorem: of u from the equation that ends the impact, then
/// of q_f, J_y and J_z at that u.
fn gradient(contact: &Contact, end: &End) -> ImpulseGradient {
    let &Contact { v_y, v_z, .. } = contact;
    let (beta_y, beta_z) = (contact.beta_y(), contact.beta_z());
    let d_beta_z = contact.d_beta_z() * unit(variable::M_S);
    match *end {
        End::Stick { q, compressed } => {
            // J_y = −v_y0/2β_y, J_z = −v_z0/2β_z
            let y = -unit(variable::V_Y) / (2.0 * beta_y);
            let z = (-unit(variable::V_Z) + v_z / beta_z * d_beta_z) / (2.0 * beta_z);
            ImpulseGradient { normal: stuck_normal(contact, q, compressed), y, z }
        }
        End::Slide { tau, compressed, .. } => {
            let (normal, d_u) = sliding_end(contact, tau, compressed);
            // J_y = v_y0 (u^(1+γ) − 1)/2β_y, J_z = v_z0 (u − 1)/2β_z
            let (gamma, u) = (contact.gamma(), (-tau).exp());
            let power = (-(1.0 + gamma) * tau).exp();
            let d_power = power * ((1.0 + gamma) / u * d_u - tau * contact.d_gamma() * unit(variable::M_S));
            let y = ((-(1.0 + gamma) * tau).exp_m1() * unit(variable::V_Y) + v_y * d_power) / (2.0 * beta_y);
            let left = (-tau).exp_m1();
            let z =
                (left * unit(variable::V_Z) + v_z * d_u - v_z * left / beta_z * d_beta_z) / (2.0 * beta_z);
            ImpulseGradient { normal, y, z }
        }
    }
}

/// What the integrals are multiplied with: c = 1/2μβ_z so that q = c∫S ds, and A = m_s v_z0/2β_z.
struct Scales {
    c: f64,
    d_c: Gradient,
    a: f64,
    d_a: Gradient,
}

impl Scales {
    fn new(contact: &Contact) -> Self {
        let &Contact { mu, m_s, v_z, .. } = contact;
        let beta_z = contact.beta_z();
        let d_ln_beta_z = contact.d_beta_z() / beta_z * unit(variable::M_S);
        let c = 1.0 / (2.0 * mu * beta_z);
        let d_c = -c * (unit(variable::MU) / mu + d_ln_beta_z);
        let a = m_s * v_z / (2.0 * beta_z);
        let d_a = (v_z * unit(variable::M_S) + m_s * unit(variable::V_Z)) / (2.0 * beta_z) - a * d_ln_beta_z;
        Self { c, d_c, a, d_a }
    }
}

/// dq_f and du_f of an impact that ends sliding.
fn sliding_end(contact: &Contact, tau: f64, compressed: f64) -> (Gradient, Gradient) {
    let &Contact { k, e, v_z, .. } = contact;
    let (path, rho) = Path::new(contact);
    let Scales { c, d_c, a, d_a } = Scales::new(contact);
    let s_f = rho * path.g(tau);
    if v_z <= 0.0 {
        // c∫S ds = (1 + e)k/2
        let whole = path.segment(rho, contact, 0.0, tau);
        let d_q = 0.5 * ((1.0 + e) * unit(variable::K) + k * unit(variable::E));
        let d_u = (c * whole.d_i + whole.i * d_c - d_q) / (c * s_f);
        return (d_q, d_u);
    }
    // compression, at fixed u_c: W_c = −kq_c + q_c² − A c∫(1 − s)S ds
    let first = path.segment(rho, contact, 0.0, compressed);
    let (q_c, d_q_c) = (c * first.i, c * first.d_i + first.i * d_c);
    let (p_c, d_p_c) = (c * first.p, c * first.d_p + first.p * d_c);
    let w_c = -k * q_c + q_c * q_c - a * p_c;
    let d_w_c = -q_c * unit(variable::K) + (2.0 * q_c - k) * d_q_c - p_c * d_a - a * d_p_c;
    // v_x(u_c) = −k + 2q_c − A(1 − u_c), which is 0, but varies at fixed u_c
    let d_v_c = -unit(variable::K) + 2.0 * d_q_c + (-compressed).exp_m1() * d_a;
    // restitution, by increments: W_f − W_c = v_x(u_c) Δq + Δq² − A c∫(u_c − s)S ds
    let second = path.segment(rho, contact, compressed, tau);
    let (dq, d_dq) = (c * second.i, c * second.d_i + second.i * d_c);
    let (dp, d_dp) = (c * second.p, c * second.d_p + second.p * d_c);
    let d_gain = dq * d_v_c + 2.0 * dq * d_dq - dp * d_a - a * d_dp;
    let v_f = 2.0 * dq + a * (-compressed).exp() * (compressed - tau).exp_m1();
    // d(W_f − W_c) − v_x(u_f) c S_f du = −d(e² W_c)
    let excess = d_gain + e * e * d_w_c + 2.0 * e * w_c * unit(variable::E);
    let d_u = excess / (c * s_f * v_f);
    let d_q_f = c * (first.d_i + second.d_i) + (first.i + second.i) * d_c - excess / v_f;
    (d_q_f, d_u)
}

/// dq_f of an impact that ends stuck.
fn stuck_normal(contact: &Contact, q_f: f64, compressed: Option<f64>) -> Gradient {
    let &Contact { k, e, v_z, .. } = contact;
    if v_z <= 0.0 {
        return 0.5 * ((1.0 + e) * unit(variable::K) + k * unit(variable::E));
    }
    let (path, rho) = Path::new(contact);
    let Scales { c, d_c, a, d_a } = Scales::new(contact);
    // once stuck, W = q² − (k + A)q + B, B = A c∫₀¹ sS ds
    let whole = path.whole_segment(rho, contact);
    let (b, d_b) = (a * c * whole.p, c * whole.p * d_a + a * (c * whole.d_p + whole.p * d_c));
    let d_ka = unit(variable::K) + d_a;
    match compressed {
        None => {
            // q_f = q_c + e√(q_c² − B), q_c = (k + A)/2
            let (q_c, d_q_c) = (0.5 * (k + a), 0.5 * d_ka);
            let root = (q_c * q_c - b).max(0.0).sqrt();
            d_q_c + root * unit(variable::E) + e * (2.0 * q_c * d_q_c - d_b) / (2.0 * root)
        }
        Some(tau) => {
            // q_f² − (k + A)q_f + B = (1 − e²)W_c
            let first = path.segment(rho, contact, 0.0, tau);
            let (q_c, d_q_c) = (c * first.i, c * first.d_i + first.i * d_c);
            let (p_c, d_p_c) = (c * first.p, c * first.d_p + first.p * d_c);
            let w_c = -k * q_c + q_c * q_c - a * p_c;
            let d_w_c = -q_c * unit(variable::K) + (2.0 * q_c - k) * d_q_c - p_c * d_a - a * d_p_c;
            let right = q_f * d_ka - d_b + (1.0 - e * e) * d_w_c - 2.0 * e * w_c * unit(variable::E);
            right / (2.0 * q_f - k - a)
        }
    }
}
