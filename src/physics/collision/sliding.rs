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

use nalgebra::SVector;
use num_dual::Derivative;
use wide::f64x2;

use super::impact::{Dual, Impact};
use super::{Number, Regime};

/// The y and the z component.
type Pair = f64x2;

/// Largest number of steps to an end; typical are two or three.
const MAX_STEPS: usize = 60;

/// The λs of a last step: it leaves an error of its fourth power, and of its third at the end of compression, where it matters little.
const LAST_STEP: f64 = 5e-5;

/// The λs after which the slip has decayed: e^(−42) is below the rounding of 1.
const DECAYED: f64 = 42.0;

/// Stands in for e = 0 in derivatives, where restitution has no length.
const TINY_E: f64 = 1e-18;

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
fn find_end<const FALLS: bool>(
    impact: &Impact<f64>,
    slide: &Slide<f64>,
    decay: &Decay<FALLS>,
) -> End {
    let &Impact { k, n, e, .. } = impact;
    let cloth = slide.cloth;
    let start = Place::start(real(&slide.slip));
    if impact.slip[1] <= 0.0 {
        let q = (1.0 + e) * k / n;
        let (stopped, slid) = match slide_on(start, decay, |at, _| q - at.q) {
            Ok(end) => (end.stopped, Some(end.s)),
            Err(_) => (Pair::ONE, None),
        };
        return End { q: [q, 0.0], stopped, compressed: None, slid };
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

/// Returns the derivatives of q and of the stopped parts of the slip by v_y, v_z, λ_y, λ_z, the a, b, c of the friction, k, A, N and e.
///
/// At a fixed q only W, not the end of compression, depends on them, as dW/dq = v_x = 0 there: v_x dq = −∂(W − (1 − e²)W_c).
#[inline(always)]
fn gradient<const FALLS: bool>(
    inputs: &[f64; 11],
    topspin: bool,
    decay: &Decay<FALLS>,
    end: &End,
) -> [[f64; 11]; 3] {
    let &[v_y, v_z, .., k, cloth, n, e] = inputs;
    let slip = Pair::new([v_y, v_z]);
    let decayed = |slip: Pair| DECAYED / slowest(decay.rates, slip);
    let [q_c, mut dq] = end.q;
    let mut by_q = [0.0; 11];
    let (mut sums, mut s) = (Sums::default(), end.slid.unwrap_or(0.0));
    if !topspin {
        // q = (1 + e)k/N
        [by_q[7], by_q[9], by_q[10]] = [(1.0 + e) / n, -q_c / n, k / n];
        if end.slid.is_some() {
            sums.add(slip, decay, 0.0, s);
        }
    } else {
        let s_c = end.compressed.unwrap_or_else(|| decayed(slip));
        sums.add(slip, decay, 0.0, s_c);
        let c = sums;
        let stopped_c = if end.compressed.is_some() { c.stopped.as_array()[1] } else { 1.0 };
        let i_c = c.i[0] + stopped_c * (q_c - c.q[0]);
        let lost = 0.5 * n * q_c * q_c - cloth * (stopped_c * q_c - i_c);
        // restitution without length is the limit of a short one
        let e = e.max(TINY_E);
        let place = Place { slip: slip * (1.0 - c.stopped), ..Place::start(slip) };
        if dq == 0.0 {
            let speed = norm(place.slip).max(f64::MIN_POSITIVE);
            let [stiffness, _] = stiffness(n, cloth * (1.0 - stopped_c), decay, &place, 1.0 / speed);
            dq = e * (2.0 * lost / stiffness).sqrt();
            s = dq * decay.friction(speed)[0] / speed;
        }
        let mut restored = 0.0;
        if end.compressed.is_some() {
            restored = sums.add(slip, decay, s_c, if end.slid.is_some() { s } else { decayed(place.slip) });
            s += s_c;
        }
        if end.slid.is_none() {
            restored = 1.0;
        }
        // the part of v_z that restitution has stopped
        let since = (1.0 - stopped_c) * restored;
        let stopped = stopped_c + since;
        let v_x = n * dq - cloth * since;
        for j in 0..7 {
            let at_c = c.i[1 + j] - stopped_c * c.q[1 + j];
            let later = sums.i[1 + j] - c.i[1 + j] - stopped * (sums.q[1 + j] - c.q[1 + j]) - since * c.q[1 + j];
            by_q[j] = cloth * (later + e * e * at_c);
        }
        let i = sums.i[0] - c.i[0] + stopped * (dq - (sums.q[0] - c.q[0]));
        by_q[7] = dq + e * e * q_c;
        by_q[8] = i + e * e * i_c;
        by_q[9] = -0.5 * (dq * (2.0 * q_c + dq) + e * e * q_c * q_c);
        by_q[10] = 2.0 * e * lost;
        by_q = by_q.map(|by| by / v_x);
    }
    let mut all = [by_q, [0.0; 11], [0.0; 11]];
    if end.slid.is_some() {
        let left = 1.0 - sums.stopped;
        let speed = norm(slip * left);
        let pace = (speed / decay.friction(speed)[0]).max(f64::MIN_POSITIVE);
        let mut by_s = by_q;
        for j in 0..7 {
            by_s[j] -= sums.q[1 + j];
        }
        for i in 0..2 {
            let left = left.as_array()[i];
            all[1 + i] = by_s.map(|by| decay.rates.as_array()[i] * left / pace * by);
            all[1 + i][2 + i] += s * left;
        }
    }
    all
}

/// q and I of the way, each with its derivatives by v_y, v_z, λ_y, λ_z and the a, b, c of the friction.
#[derive(Clone, Copy, Default)]
struct Sums {
    q: [f64; 8],
    i: [f64; 8],
    /// The parts of the slip's components that are stopped at the end.
    stopped: Pair,
}

impl Sums {
    /// Adds the way from `from` over `ds`; returns the part of v_z that is stopped there, of what was left.
    #[inline(always)]
    fn add<const FALLS: bool>(&mut self, slip: Pair, decay: &Decay<FALLS>, from: f64, ds: f64) -> f64 {
        let (before, speed) = (self.stopped, norm(slip * (1.0 - self.stopped)));
        let further = |stopped: Pair| before + (1.0 - before) * stopped;
        let lost = integrate(decay, speed, ds, |weight, t, lost| {
            let stopped = further(lost);
            let (left, t) = (1.0 - stopped, from + t);
            let v = slip * left;
            let (speed, stopped, left_z) = (norm(v), stopped.as_array()[1], left.as_array()[1]);
            let [m, slope] = decay.friction(speed);
            let dq = weight * speed / m;
            // ∂|v|/∂v_y0 = v_y e^(−λ_y s)/|v|, ∂|v|/∂λ_y = −s v_y²/|v|; ∂(|v|/m)/∂|v| = (1 − |v| m'/m)/m
            let per = v * (weight * (1.0 - speed * slope / m) / (m * speed.max(f64::MIN_POSITIVE)));
            let ([v_y, v_z], [rate_y, rate_z]) = ((left * per).to_array(), (v * per * -t).to_array());
            let mut by = [dq, v_y, v_z, rate_y, rate_z, 0.0, 0.0, 0.0];
            if FALLS {
                let [_, b, c] = decay.friction;
                let falling = (-c * speed).exp() * dq / m;
                [by[5], by[6], by[7]] = [-dq / m, -falling, b * speed * falling];
            }
            for j in 0..if FALLS { 8 } else { 5 } {
                self.q[j] += by[j];
                self.i[j] += by[j] * stopped;
            }
            self.i[4] += dq * t * left_z;
        });
        self.stopped = further(lost);
        lost.as_array()[1]
    }
}

/// Calls `f` at the nodes of Gauss and Legendre's rule from 0 to `s`, with their weight, place and the parts 1 − e^(−λs) stopped
/// there; returns those at the end. Panels are so short that the rules are exact to rounding.
#[inline(always)]
fn integrate<const FALLS: bool>(
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
