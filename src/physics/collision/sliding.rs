//! Coulomb friction between rigid balls, followed exactly through the impact (Kim 2024, Eqs. 10–37, with the sign of the cloth's
//! torque corrected).
//!
//! Progress s is counted with dq = |v| μ₀/μ(|v|) ds, μ₀ the friction at first contact. Both components of the slip then decay on
//! their own, friction that falls with the slip included:
//!
//! ```text
//! v_y = v_y0 e^(−λ_y s)      v_z = v_z0 e^(−λ_z s)      λ = 2μ₀β
//! v_x = −k + N q − A (1 − e^(−λ_z s))                   A = m_s v_z0/2β_z
//! W   = ∫ v_x dq = ½N q² − k q − A I                    I = ∫ (1 − e^(−λ_z s)) dq
//! J_y = −v_y0 (1 − e^(−λ_y s))/2β_y                     J_z likewise
//! ```
//!
//! Compression ends at v_x = 0, restitution where W = (1 − e²)W_c; a contact whose slip has decayed before sticks, and the rest is a
//! quadratic in q. Nothing is singular: μ = 0, v_y0 = 0 and v_z0 = 0 are ordinary. Restitution is solved as an impact of its own
//! from the slip that is left, so that a small e keeps its digits.
//!
//! Derivatives follow from those of q and W at the end, on the same nodes.

mod gradient;
mod quadrature;

use nalgebra::SVector;
use num_dual::Derivative;
use wide::f64x2;

use self::gradient::gradient;
use self::quadrature::integrate;
use super::impact::{Dual, Impact};
use super::{Number, Regime};

/// The y and the z component.
type Pair = f64x2;

/// Largest number of steps to an end; typical are two or three.
const MAX_STEPS: usize = 60;

/// The λs of a last step: it leaves an error of its third power.
const LAST_STEP: f64 = 1e-5;

/// The λs after which the slip has decayed: e^(−42) is below the rounding of 1.
const DECAYED: f64 = 42.0;

/// The numbers that a slide depends on.
#[derive(Clone, Copy)]
struct Slide<D> {
    slip: [D; 2],
    /// λ_y and λ_z.
    rates: [D; 2],
    /// The a, b, c of the friction over that at first contact, m(v) = μ(v)/μ₀ = a + b e^(−cv).
    friction: [D; 3],
    /// A, m/s.
    cloth: D,
}

impl<D: Number> Slide<D> {
    #[inline(always)]
    fn new(impact: &Impact<D>) -> Self {
        let &Impact { slip, lever, m_s, mu, fall, .. } = impact;
        let cloth = m_s * slip[1] / lever[1];
        if let Some([b, c]) = fall {
            // a unit of s, with no derivative
            let first = mu.re() + b.re() * (-c.re() * slip[0].re().hypot(slip[1].re())).exp();
            if first > 0.0 {
                let rates = lever.map(|lever| lever * first);
                return Self { slip, rates, friction: [mu / first, b / first, c], cloth };
            }
        }
        let constant = [D::from(1.0), D::from(0.0), D::from(0.0)];
        Self { slip, rates: lever.map(|lever| lever * mu), friction: constant, cloth }
    }

    fn falls(&self) -> bool {
        self.friction[1].re() != 0.0 || self.friction[2].re() != 0.0
    }

    #[inline(always)]
    fn decay<const FALLS: bool>(&self) -> Decay<FALLS> {
        Decay { rates: real(&self.rates), friction: self.friction.map(|part| part.re()) }
    }
}

/// The rates at which the slip decays, and the friction that sets the pace, if it falls.
#[derive(Clone, Copy)]
struct Decay<const FALLS: bool> {
    rates: Pair,
    friction: [f64; 3],
}

impl<const FALLS: bool> Decay<FALLS> {
    /// Returns m(v) and dm/dv.
    #[inline(always)]
    fn friction(&self, v: f64) -> [f64; 2] {
        if !FALLS {
            return [1.0, 0.0];
        }
        let [a, b, c] = self.friction;
        let falling = b * (-c * v).exp();
        [a + falling, -c * falling]
    }
}

#[inline(always)]
fn real<D: Number>(pair: &[D; 2]) -> Pair {
    Pair::new([pair[0].re(), pair[1].re()])
}

/// The end of an impact.
pub(super) struct End {
    /// The normal impulses of compression and of restitution, per mass of the object ball, m/s.
    q: [f64; 2],
    /// The parts of the slip's components that friction has stopped.
    stopped: Pair,
    /// s at the end of compression; `None` if the contact has stuck before, or without the cloth.
    compressed: Option<f64>,
    /// s from there, or from the beginning, to the end; `None` if the contact has stuck.
    slid: Option<f64>,
}

impl End {
    pub fn regime(&self) -> Regime {
        if self.slid.is_some() { Regime::Slide } else { Regime::Stick }
    }

    /// Returns q, J_y and J_z.
    #[inline(always)]
    pub fn impulses(&self, impact: &Impact<f64>) -> [f64; 3] {
        let [y, z] = self.stopped.to_array();
        let ([v_y, v_z], [lever_y, lever_z]) = (impact.slip, impact.lever);
        [self.q[0] + self.q[1], -v_y * y / lever_y, -v_z * z / lever_z]
    }
}

/// Returns the end of an impact.
#[inline]
pub(super) fn solve(impact: &Impact<f64>) -> End {
    let slide = Slide::new(impact);
    if slide.falls() {
        find_end(impact, &slide, &slide.decay::<true>())
    } else {
        find_end(impact, &slide, &slide.decay::<false>())
    }
}

/// Returns q, J_y and J_z with their derivatives, from the end of the impact.
pub(super) fn differentiate<const N: usize>(impact: &Impact<Dual<N>>, end: &End) -> [Dual<N>; 3] {
    let slide = Slide::new(impact);
    let ([v_y, v_z], [rate_y, rate_z], [a, b, c]) = (slide.slip, slide.rates, slide.friction);
    let inputs = [v_y, v_z, rate_y, rate_z, a, b, c, impact.k, slide.cloth, impact.n, impact.e];
    let real = inputs.map(|input| input.re);
    let topspin = v_z.re > 0.0;
    let by = if slide.falls() {
        gradient(&real, topspin, &slide.decay::<true>(), end)
    } else {
        gradient(&real, topspin, &slide.decay::<false>(), end)
    };
    let [y, z] = end.stopped.to_array();
    let [q, y, z] = [(end.q[0] + end.q[1], &by[0]), (y, &by[1]), (z, &by[2])].map(|(value, by)| {
        let mut eps = SVector::<f64, N>::zeros();
        for (input, by) in inputs.iter().zip(by) {
            if let Some(of_input) = &input.eps.0 {
                eps.axpy(*by, of_input, 1.0);
            }
        }
        Dual::new(value, Derivative::some(eps))
    });
    [q, -v_y * y / impact.lever[0], -v_z * z / impact.lever[1]]
}

/// A place on the way, counted from the beginning of compression or of restitution.
#[derive(Clone, Copy)]
struct Place {
    s: f64,
    slip: Pair,
    stopped: Pair,
    q: f64,
    /// I, m/s.
    i: f64,
}

impl Place {
    #[inline(always)]
    fn start(slip: Pair) -> Self {
        Self { s: 0.0, slip, stopped: Pair::ZERO, q: 0.0, i: 0.0 }
    }

    #[inline(always)]
    fn advanced<const FALLS: bool>(mut self, decay: &Decay<FALLS>, ds: f64) -> Self {
        let (slip, stopped_z) = (self.slip, self.stopped.as_array()[1]);
        let lost = integrate(decay, norm(slip), ds, |weight, _, lost| {
            let speed = norm(slip - slip * lost);
            let dq = weight * speed / decay.friction(speed)[0];
            self.q += dq;
            self.i += dq * (stopped_z + (1.0 - stopped_z) * lost.as_array()[1]);
        });
        self.s += ds;
        self.stopped += (1.0 - self.stopped) * lost;
        self.slip -= self.slip * lost;
        self
    }
}

/// Slides on until the impulse that is `left` is 0. `Err`: the slip decays before.
#[inline(always)]
fn slide_on<const FALLS: bool>(
    mut at: Place,
    decay: &Decay<FALLS>,
    left: impl Fn(&Place, f64) -> f64,
) -> Result<Place, Place> {
    let [y, z] = decay.rates.to_array();
    for _ in 0..MAX_STEPS {
        let [y2, z2] = (at.slip * at.slip).to_array();
        let speed = (y2 + z2).sqrt();
        if speed == 0.0 {
            return Err(Place { stopped: Pair::ONE, ..at });
        }
        let per_speed = 1.0 / speed;
        let dq = left(&at, per_speed);
        let [m, slope] = decay.friction(speed);
        // q grows by |v|(1 − e^(−rate ds))/(m rate) at first
        let per_pace = m * per_speed;
        let mut rate = (y * y2 + z * z2) * (per_speed * per_speed);
        if FALLS {
            rate *= 1.0 - speed * slope / m;
        }
        let mut part = rate * dq * per_pace;
        if !(part < 0.7) {
            // and by no more than with the slowest rate
            let slowest = slowest(decay.rates, at.slip);
            part = slowest * dq * per_pace;
            if part >= 1.0 {
                let end = at.advanced(decay, DECAYED / slowest);
                if left(&end, 1.0 / norm(end.slip)) >= 0.0 {
                    return Err(Place { stopped: Pair::ONE, slip: Pair::ZERO, ..end });
                }
            }
            part = part.min(0.9);
        }
        // ds = −ln(1 − part)/rate, as a series in part/(2 − part)…
        let per = 1.0 / (2.0 - part);
        let x2 = (part * per) * (part * per);
        let ds = dq * per_pace * 2.0 * per * (1.0 + x2 * (1.0 / 3.0 + x2 * (0.2 + x2 * (1.0 / 7.0))));
        // …less what the rate falls by: d(rate)/ds = −2(λ_y − λ_z)² v_y² v_z²/|v|⁴
        let turned = (y - z) * ds * (per_speed * per_speed);
        let ds = ds * (1.0 - (turned * turned * y2 * z2 * (1.0 / 3.0)).min(0.5));
        at = at.advanced(decay, ds);
        if ds.abs() * y.max(z) <= LAST_STEP {
            break;
        }
    }
    Ok(at)
}

/// The smaller rate of those components that are not 0.
fn slowest(rates: Pair, slip: Pair) -> f64 {
    let ([y, z], [v_y, v_z]) = (rates.to_array(), slip.to_array());
    match (v_y == 0.0, v_z == 0.0) {
        (true, _) => z,
        (_, true) => y,
        _ => y.min(z),
    }
}

#[inline(always)]
fn find_end<const FALLS: bool>(impact: &Impact<f64>, slide: &Slide<f64>, decay: &Decay<FALLS>) -> End {
    let &Impact { k, n, e, .. } = impact;
    let cloth = slide.cloth;
    let start = Place::start(real(&slide.slip));
    if impact.slip[1] <= 0.0 {
        let q = (1.0 + e) * k / n;
        let stuck = End { q: [q, 0.0], stopped: Pair::ONE, compressed: None, slid: None };
        // a friction that does not rise with the slip stops it by |v|/λ at the latest
        if decay.friction[1] >= 0.0 && slowest(decay.rates, start.slip) * q >= norm(start.slip) {
            return stuck;
        }
        return match slide_on(start, decay, |at, _| q - at.q) {
            Ok(end) => End { stopped: end.stopped, slid: Some(end.s), ..stuck },
            Err(_) => stuck,
        };
    }
    // −v_x = dv_x/dq dq + ½ d²v_x/dq² dq²
    let to_compressed = |at: &Place, per_speed: f64| {
        let approach = k - n * at.q + cloth * at.stopped.as_array()[1];
        let [first, second] = stiffness(n, cloth, decay, at, per_speed);
        let per_first = 1.0 / first;
        let dq = approach * per_first;
        dq - 0.5 * second * dq * dq * per_first
    };
    let c = match slide_on(start, decay, to_compressed) {
        Ok(c) => c,
        Err(stuck) => {
            // W = ½N q² − (k + A) q + A (q_s − I_s) from there on
            let q_c = (k + cloth) / n;
            let lost = 0.5 * n * q_c * q_c - cloth * (stuck.q - stuck.i);
            let q = [q_c, e * (2.0 * lost.max(0.0) / n).sqrt()];
            return End { q, stopped: Pair::ONE, compressed: None, slid: None };
        }
    };
    // −e² W_c, with k = N q_c − A (1 − e^(−λ_z s_c))
    let stopped = c.stopped.as_array()[1];
    let target = e * e * (0.5 * n * c.q * c.q - cloth * (stopped * c.q - c.i));
    let cloth = cloth * (1.0 - stopped);
    let gained =
        |at: &Place| [n * at.q - cloth * at.stopped.as_array()[1], 0.5 * n * at.q * at.q - cloth * at.i];
    // W = v_x dq + ½ dv_x/dq dq² + ⅙ d²v_x/dq² dq³
    let to_restored = |at: &Place, per_speed: f64| {
        let [v_x, w] = gained(at);
        let [first, second] = stiffness(n, cloth, decay, at, per_speed);
        let dq = rise(target - w, v_x, first);
        let v_x = (v_x + first * dq).max(f64::MIN_POSITIVE);
        dq - second * dq * dq * dq / (6.0 * v_x)
    };
    match slide_on(Place::start(c.slip), decay, to_restored) {
        Ok(f) => {
            let stopped = c.stopped + (1.0 - c.stopped) * f.stopped;
            End { q: [c.q, f.q], stopped, compressed: Some(c.s), slid: Some(f.s) }
        }
        Err(stuck) => {
            // stuck, v_x grows by N per q
            let [v_x, w] = gained(&stuck);
            let q = stuck.q + rise(target - w, v_x, n);
            End { q: [c.q, q], stopped: Pair::ONE, compressed: Some(c.s), slid: None }
        }
    }
}

/// The dq over which W rises by `w`, from v_x and dv_x/dq.
#[inline(always)]
fn rise(w: f64, v_x: f64, stiffness: f64) -> f64 {
    let root = (v_x * v_x + 2.0 * stiffness * w).max(0.0).sqrt();
    2.0 * w / (v_x + root).max(f64::MIN_POSITIVE)
}

/// Returns dv_x/dq = N − A λ_z e^(−λ_z s) m/|v|, and its derivative by q.
#[inline(always)]
fn stiffness<const FALLS: bool>(
    n: f64,
    cloth: f64,
    decay: &Decay<FALLS>,
    at: &Place,
    per_speed: f64,
) -> [f64; 2] {
    let ([y2, _], [y, z]) = ((at.slip * at.slip).to_array(), decay.rates.to_array());
    let m = if FALLS { decay.friction(1.0 / per_speed)[0] } else { 1.0 };
    let held = cloth * z * (1.0 - at.stopped.as_array()[1]) * m * per_speed;
    // |v| falls by (λ_y v_y² + λ_z v_z²)/|v| per s
    [n - held, -held * (y - z) * y2 * (per_speed * per_speed * per_speed)]
}

#[inline(always)]
fn norm(v: Pair) -> f64 {
    let [y2, z2] = (v * v).to_array();
    (y2 + z2).sqrt()
}
