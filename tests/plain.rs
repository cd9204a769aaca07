//! The full solution as plainly as it can be written: the oracle of the fast one.
//!
//! The same equations (u, the fraction of v_z left; q = ∫S ds/2μβ_z; W = ∫ v_x dq) with 8 Gauss nodes in as
//! many panels as it takes, and Newton's method on them. Some thirty
//! times slower.

use crate::prelude::*;

/// Positive half of the 8-point Gauss–Legendre rule (Abramowitz & Stegun, Table 25.4).
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Newton's method converges from one side; so many steps are never taken.
const MAX_NEWTON: usize = 100;

/// A Newton step of this relative size leaves an error of its square.
const LAST_STEP: f64 = 1e-8;

/// With so little of the slip left the contact has stuck, to rounding.
const STUCK: f64 = 1e-20;

/// Equal balls, the object ball at rest, corrected sign.
pub fn collide(ball: &Ball, cue: &BallState, coefficients: &Coefficients) -> Outcome {
    let &Coefficients { mu, mu_s, e } = coefficients;
    let nu = ball.inertia;
    let v = slip(cue, &BallState::default(), ball.radius);
    let m_s = if v.z > 0.0 { mu_s } else { 0.0 };
    let shot = Shot {
        k: -v.x,
        v_y: v.y,
        v_z: v.z,
        mu,
        m_s,
        e,
        beta_z: (2.0 + nu - m_s) / (2.0 * nu),
        gamma: (nu + m_s) / (2.0 + nu - m_s),
    };
    let (q, tau) = shot.solve();
    let [left_y, left_z] = match tau {
        Some(tau) => [(-(1.0 + shot.gamma) * tau).exp_m1(), (-tau).exp_m1()],
        None => [-1.0, -1.0],
    };
    let j_y = v.y * left_y * nu / (2.0 * (1.0 + nu));
    let j_z = v.z * left_z / (2.0 * shot.beta_z);
    let (topspin, draw) = (f64::from(v.z > 0.0), f64::from(v.z < 0.0));
    let nu_r = nu * ball.radius;
    Outcome {
        regime: if tau.is_some() { Regime::Slide } else { Regime::Stick },
        impulse: q,
        cue: BallState {
            velocity: cue.velocity - Vec3::new(q, j_y, j_z * topspin),
            spin: cue.spin + Vec3::new(0.0, j_z, -j_y) / nu_r,
        },
        object: BallState {
            velocity: Vec3::new(q + m_s * j_z, j_y, j_z * draw),
            spin: Vec3::new(0.0, (1.0 - m_s) * j_z, -j_y) / nu_r,
        },
    }
}

struct Shot {
    k: f64,
    v_y: f64,
    v_z: f64,
    mu: f64,
    m_s: f64,
    e: f64,
    beta_z: f64,
    gamma: f64,
}

/// A point of the path at u = exp(−τ), with integrals from the point u₀ where it was started: Q = ∫ g ds,
/// R = ∫ (u₀ − s) g ds, where g = S/|v_∥0|.
#[derive(Clone, Copy)]
struct Point {
    tau: f64,
    delta: f64,
    q: f64,
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

impl Shot {
    fn g(&self, tau: f64) -> f64 {
        let rho = self.v_y.hypot(self.v_z);
        (self.v_z / rho).hypot(self.v_y / rho * (-self.gamma * tau).exp())
    }

    fn advance(&self, from: &Point, d_tau: f64) -> Point {
        let u = from.u();
        // in τ, g is analytic up to a distance π/2γ
        let panels = (d_tau.abs() * (2.0 * self.gamma).abs().max(2.0)).ceil().max(1.0) as usize;
        let half = 0.5 * d_tau / panels as f64;
        let (mut dq, mut dr) = (0.0, 0.0);
        for panel in 0..panels {
            for (x, w) in GAUSS {
                for x in [-x, x] {
                    let t = half * ((2 * panel + 1) as f64 + x);
                    let g_du = half * w * u * (-t).exp() * self.g(from.tau + t);
                    dq += g_du;
                    dr += g_du * u * -(-t).exp_m1();
                }
            }
        }
        Point {
            tau: from.tau + d_tau,
            delta: from.delta - u * (-d_tau).exp_m1(),
            q: from.q + dq,
            r: from.r + from.delta * dq + dr,
        }
    }

    /// (∫₀¹ g du, ∫₀¹ u g du).
    fn whole(&self) -> (f64, f64) {
        /// Nothing is left of u = exp(−τ).
        const ALL: f64 = 60.0;
        let end = self.advance(&Point::start(0.0), ALL);
        (end.q, end.q - end.r)
    }

    /// Newton's method in u from `start`; `step(point)` is (target − value)/slope. `None` if it ends where
    /// nothing is left of the slip.
    fn find(&self, start: Point, mut d_u: f64, step: impl Fn(&Point) -> f64) -> Option<Point> {
        let mut point = start;
        for _ in 0..MAX_NEWTON {
            let u = point.u();
            if u < STUCK {
                return None;
            }
            point = self.advance(&point, -(-(d_u / u).min(0.9)).ln_1p());
            if d_u.abs() <= LAST_STEP * point.delta.abs() {
                return Some(point);
            }
            d_u = step(&point);
        }
        Some(point)
    }

    /// q_f, and τ at the end unless it sticks.
    fn solve(&self) -> (f64, Option<f64>) {
        let &Self { k, e, mu, v_y, v_z, m_s, beta_z, .. } = self;
        let rho = v_y.hypot(v_z);
        let free = 0.5 * (1.0 + e) * k;
        if rho == 0.0 {
            return (free, None);
        }
        if mu == 0.0 {
            return (free, Some(0.0));
        }
        // in units of ρ/2μβ_z: K, Σ, v = −K + 2Q − Σ(1 − u)
        let unit = rho / (2.0 * mu * beta_z);
        let (q_s, uq_s) = self.whole();
        if m_s == 0.0 {
            if free / unit >= q_s {
                return (free, None);
            }
            let start = Point::start(0.0);
            let end = self.find(start, free / unit, |x| (free / unit - x.q) / self.g(x.tau));
            return (free, end.map(|x| x.tau));
        }
        let (kk, sigma) = (k / unit, m_s * v_z / (2.0 * beta_z) / unit);
        let v_s = -kk + 2.0 * q_s - sigma;
        if v_s <= 0.0 {
            // W = q² − (k + A)q + B once stuck
            let q_c = 0.5 * (kk + sigma);
            return (unit * (q_c + e * (q_c * q_c - sigma * uq_s).max(0.0).sqrt()), None);
        }
        let slope = |tau: f64| 2.0 * self.g(tau) - sigma;
        let v = |x: &Point| -kk + 2.0 * x.q - sigma * x.delta;
        let compressed = self.find(Point::start(0.0), kk / slope(0.0), |x| -v(x) / slope(x.tau));
        let Some(c) = compressed else {
            return (unit * 0.5 * (1.0 + e) * (kk + sigma), None);
        };
        // −W_c, and W − W_c at the end
        let w_c = c.q * c.q - sigma * (c.delta * c.q - c.r);
        let target = e * e * w_c;
        let dq = q_s - c.q;
        let r = c.u() * dq - (uq_s - (c.q - c.r));
        let rest = target - (dq * dq - sigma * r);
        if rest >= 0.0 {
            let y = 2.0 * rest / (v_s + (v_s * v_s + 4.0 * rest).sqrt());
            return (unit * (q_s + y), None);
        }
        if e == 0.0 {
            return (unit * c.q, Some(c.tau));
        }
        let first = target.sqrt() / (0.5 * self.g(c.tau) * slope(c.tau)).sqrt();
        let restored = self.find(Point::start(c.tau), first, |x| {
            let root = (x.q * x.q - sigma * x.r).max(0.0).sqrt();
            let v = 2.0 * x.q - sigma * x.delta;
            2.0 * root * (target.sqrt() - root) / (v * self.g(x.tau))
        });
        match restored {
            Some(f) => (unit * (c.q + f.q), Some(f.tau)),
            None => (unit * q_s, None),
        }
    }
}

/// The largest difference of two outcomes, m/s; spins times R.
pub fn difference(a: &Outcome, b: &Outcome, radius: f64) -> f64 {
    [(&a.cue, &b.cue), (&a.object, &b.object)]
        .map(|(a, b)| (a.velocity - b.velocity).amax().max(radius * (a.spin - b.spin).amax()))
        .into_iter()
        .fold(0.0, |worst, off| if off >= worst || off.is_nan() { off } else { worst })
}
