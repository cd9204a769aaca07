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
//! Derivatives follow from one step of Newton's method in dual numbers at the solution.

use nalgebra::SVector;
use num_dual::{Derivative, DualNum};
use wide::f64x2;

use super::impact::{Dual, Impact, Impulses};
use super::{Number, Regime};

/// The y and the z component.
type Pair = f64x2;

/// Largest number of steps to an end; typical are two or three.
const MAX_STEPS: usize = 60;

/// The λs of a last step: it leaves an error of its third power.
const LAST_STEP: f64 = 1e-5;

/// The λs after which the slip has decayed: e^(−42) is below the rounding of 1.
const DECAYED: f64 = 42.0;

/// The friction over that at first contact, μ(v)/μ₀ = a + b e^(−cv).
#[derive(Clone, Copy)]
struct Relative<D> {
    a: D,
    b: D,
    c: D,
}

impl Relative<f64> {
    /// Returns m = μ(v)/μ₀ and dm/dv.
    #[inline(always)]
    fn at<const FALLS: bool>(&self, v: f64) -> [f64; 2] {
        if !FALLS {
            return [1.0, 0.0];
        }
        let falling = self.b * (-self.c * v).exp();
        [self.a + falling, -self.c * falling]
    }
}

/// The slip's decay: λ_y, λ_z, and the pace of s.
#[derive(Clone, Copy)]
struct Decay {
    rates: Pair,
    friction: Relative<f64>,
}

/// The numbers that a slide depends on.
struct Slide<D> {
    slip: [D; 2],
    rates: [D; 2],
    friction: Relative<D>,
    /// A, m/s.
    cloth: D,
}

impl<D: Number> Slide<D> {
    #[inline(always)]
    fn new(impact: &Impact<D>) -> Self {
        let &Impact { slip, lever, m_s, mu, fall, .. } = impact;
        let constant = Relative { a: D::from(1.0), b: D::from(0.0), c: D::from(0.0) };
        let cloth = if impact.topspin { m_s * slip[1] / lever[1] } else { D::from(0.0) };
        let Some([b, c]) = fall else {
            return Self { slip, rates: [lever[0] * mu, lever[1] * mu], friction: constant, cloth };
        };
        let speed = slip[0].re().hypot(slip[1].re());
        let at_first = mu + b * (-c.re() * speed).exp();
        // a unit of s, with no derivative
        let first = at_first.re();
        if first > 0.0 {
            let friction = Relative { a: mu / first, b: b / first, c };
            return Self { slip, rates: [lever[0] * first, lever[1] * first], friction, cloth };
        }
        Self { slip, rates: [lever[0] * at_first, lever[1] * at_first], friction: constant, cloth }
    }

    #[inline(always)]
    fn decay(&self) -> Decay {
        let Relative { a, b, c } = self.friction;
        let friction = Relative { a: a.re(), b: b.re(), c: c.re() };
        Decay { rates: real(&self.rates), friction }
    }
}

#[inline(always)]
fn real<D: Number>(pair: &[D; 2]) -> Pair {
    Pair::new([pair[0].re(), pair[1].re()])
}

/// The end of an impact.
pub(super) struct End {
    /// Normal impulse per mass of the object ball, m/s.
    q: f64,
    /// The parts of the slip's components that friction has stopped.
    stopped: Pair,
    /// s at the end of compression; `None` if the contact has stuck before, or if the cloth takes no part and it does not matter.
    compressed: Option<f64>,
    /// s from there, or from the beginning, to the end; `None` if the contact has stuck.
    slid: Option<f64>,
}

impl End {
    pub fn regime(&self) -> Regime {
        if self.slid.is_some() { Regime::Slide } else { Regime::Stick }
    }
}

/// The impulses of an impact, and its end.
#[inline]
pub(super) fn solve(impact: &Impact<f64>) -> (Impulses<f64>, End) {
    let slide = Slide::new(impact);
    let falls = slide.friction.b != 0.0;
    let end = if falls { find_end::<true>(impact, &slide) } else { find_end::<false>(impact, &slide) };
    let [y, z] = end.stopped.to_array();
    let ([v_y, v_z], [lever_y, lever_z]) = (slide.slip, impact.lever);
    let impulses = Impulses { q: end.q, y: -v_y * y / lever_y, z: -v_z * z / lever_z };
    (impulses, end)
}

/// The impulses with their derivatives, from the end of the impact.
pub(super) fn differentiate<const N: usize>(impact: &Impact<Dual<N>>, end: &End) -> Impulses<Dual<N>> {
    let slide = Slide::new(impact);
    let (q, stopped) = newton_step(impact, &slide, end);
    let parts = end.stopped.to_array();
    let [y, z] = [0, 1].map(|i| -slide.slip[i] * with_value(stopped[i], parts[i]) / impact.lever[i]);
    Impulses { q: with_value(q, end.q), y, z }
}

fn with_value<const N: usize>(mut number: Dual<N>, value: f64) -> Dual<N> {
    number.re = value;
    number
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
    fn advanced<const FALLS: bool>(mut self, decay: &Decay, ds: f64) -> Self {
        let (slip, stopped_z) = (self.slip, self.stopped.as_array()[1]);
        let lost = integrate::<FALLS>(decay, norm(slip), ds, |weight, _, lost| {
            let speed = norm(slip - slip * lost);
            let dq = weight * speed / decay.friction.at::<FALLS>(speed)[0];
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
    decay: &Decay,
    left: impl Fn(&Place) -> f64,
) -> Result<Place, Place> {
    let [y, z] = decay.rates.to_array();
    for _ in 0..MAX_STEPS {
        let [y2, z2] = (at.slip * at.slip).to_array();
        let speed = (y2 + z2).sqrt();
        let dq = left(&at);
        if speed == 0.0 {
            return Err(Place { stopped: Pair::ONE, ..at });
        }
        let [m, slope] = decay.friction.at::<FALLS>(speed);
        // q grows by |v|(1 − e^(−rate ds))/(m rate) at first
        let per_pace = m / speed;
        let rate = (y * y2 + z * z2) / (y2 + z2) * (1.0 - speed * slope / m);
        let mut part = rate * dq * per_pace;
        if !(part < 0.7) {
            // and by no more than with the slowest rate
            let slowest = slowest(decay, at.slip);
            part = slowest * dq * per_pace;
            if part >= 1.0 {
                let end = at.advanced::<FALLS>(decay, DECAYED / slowest);
                if left(&end) >= 0.0 {
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
        let turned = (y - z) * ds / (speed * speed);
        let ds = ds * (1.0 - (turned * turned * y2 * z2 * (1.0 / 3.0)).min(0.5));
        at = at.advanced::<FALLS>(decay, ds);
        if ds.abs() * y.max(z) <= LAST_STEP {
            break;
        }
    }
    Ok(at)
}

/// The smaller rate of those components that are not 0.
fn slowest(decay: &Decay, slip: Pair) -> f64 {
    let ([y, z], [v_y, v_z]) = (decay.rates.to_array(), slip.to_array());
    match (v_y == 0.0, v_z == 0.0) {
        (true, _) => z,
        (_, true) => y,
        _ => y.min(z),
    }
}

#[inline(always)]
fn find_end<const FALLS: bool>(impact: &Impact<f64>, slide: &Slide<f64>) -> End {
    let &Impact { k, n, e, .. } = impact;
    let cloth = slide.cloth;
    let decay = &slide.decay();
    let start = Place::start(real(&slide.slip));
    if !impact.topspin {
        let q = (1.0 + e) * k / n;
        let (stopped, slid) = match slide_on::<FALLS>(start, decay, |at| q - at.q) {
            Ok(end) => (end.stopped, Some(end.s)),
            Err(_) => (Pair::ONE, None),
        };
        return End { q, stopped, compressed: None, slid };
    }
    // −v_x = dv_x/dq dq + ½ d²v_x/dq² dq²
    let to_compressed = |at: &Place| {
        let approach = k - n * at.q + cloth * at.stopped.as_array()[1];
        let [first, second] = stiffness::<FALLS>(n, cloth, decay, at);
        let dq = approach / first;
        dq - 0.5 * second * dq * dq / first
    };
    let c = match slide_on::<FALLS>(start, decay, to_compressed) {
        Ok(c) => c,
        Err(stuck) => {
            // W = ½N q² − (k + A) q + A (q_s − I_s) from there on
            let q_c = (k + cloth) / n;
            let lost = 0.5 * n * q_c * q_c - cloth * (stuck.q - stuck.i);
            let q = q_c + e * (2.0 * lost.max(0.0) / n).sqrt();
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
    let to_restored = |at: &Place| {
        let [v_x, w] = gained(at);
        let [first, second] = stiffness::<FALLS>(n, cloth, decay, at);
        let dq = rise(target - w, v_x, first);
        let v_x = (v_x + first * dq).max(f64::MIN_POSITIVE);
        dq - second * dq * dq * dq / (6.0 * v_x)
    };
    match slide_on::<FALLS>(Place::start(c.slip), decay, to_restored) {
        Ok(f) => {
            let stopped = c.stopped + (1.0 - c.stopped) * f.stopped;
            End { q: c.q + f.q, stopped, compressed: Some(c.s), slid: Some(f.s) }
        }
        Err(stuck) => {
            // stuck, v_x grows by N per q
            let [v_x, w] = gained(&stuck);
            let q = c.q + stuck.q + rise(target - w, v_x, n);
            End { q, stopped: Pair::ONE, compressed: Some(c.s), slid: None }
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
fn stiffness<const FALLS: bool>(n: f64, cloth: f64, decay: &Decay, at: &Place) -> [f64; 2] {
    let [y2, z2] = (at.slip * at.slip).to_array();
    let [y, z] = decay.rates.to_array();
    let square = y2 + z2;
    if square == 0.0 {
        return [n, 0.0];
    }
    let speed = square.sqrt();
    let held = cloth * z * (1.0 - at.stopped.as_array()[1]) * decay.friction.at::<FALLS>(speed)[0] / speed;
    // |v| falls by (λ_y v_y² + λ_z v_z²)/|v| per s
    [n - held, -held * (y - z) * y2 / (square * speed)]
}

#[inline(always)]
fn norm(v: Pair) -> f64 {
    let [y2, z2] = (v * v).to_array();
    (y2 + z2).sqrt()
}

/// One step of Newton's method from the end of the impact: q and the stopped parts of the slip.
fn newton_step<const N: usize>(
    impact: &Impact<Dual<N>>,
    slide: &Slide<Dual<N>>,
    end: &End,
) -> (Dual<N>, [Dual<N>; 2]) {
    let &Impact { k, n, e, .. } = impact;
    let one = Dual::from(1.0);
    let cloth = slide.cloth;
    if !impact.topspin {
        let q = (e + 1.0) * k / n;
        let Some(s) = end.slid else { return (q, [one; 2]) };
        let at = DualPlace::new(slide, slide.slip, s);
        let ds = (q - at.q) / at.pace;
        return (q, at.moved(slide, ds));
    }
    let Some(s_c) = end.compressed else {
        let stuck = DualPlace::new(slide, slide.slip, DECAYED / slowest(&slide.decay(), real(&slide.slip)));
        let q_c = (k + cloth) / n;
        let lost = q_c * q_c * n * 0.5 - cloth * (stuck.q - stuck.i);
        return (q_c + e * (lost * 2.0 / n).sqrt(), [one; 2]);
    };
    let c = DualPlace::new(slide, slide.slip, s_c);
    let work = c.q * c.q * n * 0.5 - k * c.q - cloth * c.i;
    // 0 but for its derivative
    let v_c = with_value(c.q * n - k - cloth * c.stopped[1], 0.0);
    let left = c.stopped.map(|stopped| -stopped + 1.0);
    let cloth = cloth * left[1];
    let slip = [0, 1].map(|i| slide.slip[i] * left[i]);
    // dW/dq = v_x = 0 at the end of compression: W_c does not depend on where that is
    let e = if e.re == 0.0 { with_value(e, TINY_E) } else { e };
    let target = -e * e * work;
    let gained = |at: &DualPlace<N>| {
        let v_x = at.q * n + v_c - cloth * at.stopped[1];
        [v_x, v_c * at.q + at.q * at.q * n * 0.5 - cloth * at.i]
    };
    let Some(s) = end.slid else {
        let slowest = slowest(&slide.decay(), real(&slip));
        let mut at = DualPlace::new(slide, slip, DECAYED / slowest);
        at.stopped = [one; 2];
        let [v_x, w] = gained(&at);
        let root = (v_x * v_x + (target - w) * n * 2.0).sqrt();
        return (c.q + at.q + (root - v_x) / n, [one; 2]);
    };
    // the shortest restitution whose derivatives keep their digits
    let s = if s == 0.0 { TINY_E * (k.re / n.re) / norm(real(&slip)).max(f64::MIN_POSITIVE) } else { s };
    let at = DualPlace::new(slide, slip, s);
    let [v_x, w] = gained(&at);
    let dq = (target - w) / v_x.re;
    let restored = at.moved(slide, dq / at.pace);
    let stopped = [0, 1].map(|i| -left[i] * (-restored[i] + 1.0) + 1.0);
    (c.q + at.q + dq, stopped)
}

/// Stands in for e = 0 in derivatives, where restitution has no length.
const TINY_E: f64 = 1e-18;

/// A place at a fixed s, with derivatives.
struct DualPlace<const N: usize> {
    q: Dual<N>,
    i: Dual<N>,
    stopped: [Dual<N>; 2],
    /// dq/ds.
    pace: f64,
}

impl<const N: usize> DualPlace<N> {
    fn new(slide: &Slide<Dual<N>>, slip: [Dual<N>; 2], s: f64) -> Self {
        let decay = slide.decay();
        let falls = slide.friction.b.eps.0.is_some();
        let over = if falls { Sums::over::<true> } else { Sums::over::<false> };
        let sums = over(real(&slip), &decay, s);
        let Relative { a, b, c } = slide.friction;
        let inputs = [slip[0], slip[1], slide.rates[0], slide.rates[1], a, b, c];
        let inputs = if falls { &inputs[..] } else { &inputs[..4] };
        let end = sums.stopped.to_array();
        let stopped = [0, 1].map(|i| (slide.rates[i] - slide.rates[i].re) * (s * (1.0 - end[i])) + end[i]);
        let speed = norm(real(&slip) * (1.0 - sums.stopped));
        let m = if falls { decay.friction.at::<true>(speed)[0] } else { 1.0 };
        let pace = (speed / m).max(f64::MIN_POSITIVE);
        Self { q: chain(sums.q, &sums.dq, inputs), i: chain(sums.i, &sums.di, inputs), stopped, pace }
    }

    /// The stopped parts a little later.
    fn moved(&self, slide: &Slide<Dual<N>>, ds: Dual<N>) -> [Dual<N>; 2] {
        [0, 1].map(|i| self.stopped[i] + ds * (slide.rates[i].re * (1.0 - self.stopped[i].re)))
    }
}

/// A number from its derivatives by numbers that have derivatives.
fn chain<const N: usize>(value: f64, by: &[f64; 7], inputs: &[Dual<N>]) -> Dual<N> {
    let mut eps = SVector::<f64, N>::zeros();
    for (input, by) in inputs.iter().zip(by) {
        if let Some(of_input) = &input.eps.0 {
            eps.axpy(*by, of_input, 1.0);
        }
    }
    Dual::new(value, Derivative::some(eps))
}

/// q and I of a part of the way, and their derivatives by v_y, v_z, λ_y, λ_z and the a, b, c of the friction.
#[derive(Default)]
struct Sums {
    q: f64,
    i: f64,
    /// The parts of the slip's components that are stopped at the end.
    stopped: Pair,
    dq: [f64; 7],
    di: [f64; 7],
}

impl Sums {
    #[inline(always)]
    fn over<const FALLS: bool>(slip: Pair, decay: &Decay, s: f64) -> Self {
        let (mut sums, speed) = (Self::default(), norm(slip));
        if speed == 0.0 {
            sums.stopped = Pair::ONE;
            return sums;
        }
        let [mut by_v, mut by_rate, mut i_by_v, mut i_by_rate] = [Pair::ZERO; 4];
        sums.stopped = integrate::<FALLS>(decay, speed, s, |weight, t, stopped| {
            let left = 1.0 - stopped;
            let v = slip * left;
            let (speed, stopped, left_z) = (norm(v), stopped.as_array()[1], left.as_array()[1]);
            let [m, slope] = decay.friction.at::<FALLS>(speed);
            let dq = weight * speed / m;
            // ∂|v|/∂v_y0 = v_y e^(−λ_y s)/|v|, ∂|v|/∂λ_y = −s v_y²/|v|; ∂(|v|/m)/∂|v| = (1 − |v| m'/m)/m
            let per = v * (weight * (1.0 - speed * slope / m) / (m * speed.max(f64::MIN_POSITIVE)));
            let (v_part, rate_part) = (left * per, v * per * -t);
            sums.q += dq;
            sums.i += dq * stopped;
            sums.di[3] += dq * t * left_z;
            by_v += v_part;
            by_rate += rate_part;
            i_by_v += v_part * stopped;
            i_by_rate += rate_part * stopped;
            if FALLS {
                let falling = (-decay.friction.c * speed).exp();
                let by = [-dq / m, -dq / m * falling, dq / m * decay.friction.b * speed * falling];
                for (j, by) in by.into_iter().enumerate() {
                    sums.dq[4 + j] += by;
                    sums.di[4 + j] += by * stopped;
                }
            }
        });
        for (sums, v, rate) in [(&mut sums.dq, by_v, by_rate), (&mut sums.di, i_by_v, i_by_rate)] {
            for j in 0..2 {
                sums[j] += v.as_array()[j];
                sums[2 + j] += rate.as_array()[j];
            }
        }
        sums
    }
}

/// Calls `f` at the nodes of Gauss and Legendre's rule from 0 to `s`, with their weight, place and the parts 1 − e^(−λs) stopped
/// there; returns those at the end. Panels are so short that the rules are exact to rounding.
#[inline(always)]
fn integrate<const FALLS: bool>(
    decay: &Decay,
    speed: f64,
    s: f64,
    mut f: impl FnMut(f64, f64, Pair),
) -> Pair {
    let [y, z] = decay.rates.to_array();
    let mut reach = y.max(z) * s.abs();
    if FALLS {
        reach *= 1.0 + decay.friction.c * speed;
    }
    if reach <= MAX_TWO {
        return panel(decay, 0.0, Pair::ZERO, 0.5 * s, &GAUSS_2, &mut f);
    }
    if reach <= MAX_FOUR {
        return panel(decay, 0.0, Pair::ZERO, 0.5 * s, &GAUSS_4, &mut f);
    }
    let panels = (reach / MAX_SIX).ceil();
    let (half, mut stopped) = (0.5 * s / panels, Pair::ZERO);
    for i in 0..panels as usize {
        stopped = panel(decay, 2.0 * half * i as f64, stopped, half, &GAUSS_6, &mut f);
    }
    stopped
}

#[inline(always)]
fn panel<const H: usize>(
    decay: &Decay,
    from: f64,
    stopped: Pair,
    half: f64,
    rule: &[(f64, f64); H],
    f: &mut impl FnMut(f64, f64, Pair),
) -> Pair {
    // 1 − ab = (1 − a) + a(1 − b)
    let further = |stopped: Pair, by: Pair| stopped + (1.0 - stopped) * by;
    let rates = decay.rates * half;
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
