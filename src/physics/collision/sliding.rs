//! Coulomb friction between rigid balls, followed exactly through the impact (Kim 2024, Eqs.
//! 10–37, with the sign of the cloth's torque corrected).
//!
//! Progress s is counted with dq = |v| μ₀/μ(|v|) ds, μ₀ the friction at first contact. Both
//! components of the slip then decay by themselves, friction that decreases with the slip included:
//!
//! ```text
//! v_y = v_y0 e^(−λ_y s)      v_z = v_z0 e^(−λ_z s)      λ = 2μ₀β
//! v_x = −k + N q − A (1 − e^(−λ_z s))                   A = m_s v_z0/2β_z
//! W   = ∫ v_x dq = ½N q² − k q − A I                    I = ∫ (1 − e^(−λ_z s)) dq
//! J_y = −v_y0 (1 − e^(−λ_y s))/2β_y                     J_z likewise
//! ```
//!
//! Compression ends at v_x = 0, restitution at W = (1 − e²)W_c; a contact whose slip has decayed
//! before sticks, and the rest is a quadratic in q. No case is singular: μ = 0, v_y0 = 0 and
//! v_z0 = 0 are ordinary. Restitution is solved as an impact of its own from the slip that is left,
//! so that a small e keeps its digits. Derivatives are those of one step of Newton's method.

mod dual;

use super::impact::{Dual, Impact};
use super::{Number, Regime};

/// Largest number of steps to an end; typical are two or three.
const MAX_STEPS: usize = 60;

/// The λs of a last step, whose error is of its fourth power, of its third if friction decreases.
const LAST_STEP: f64 = 3e-5;

/// The λs after which the slip has decayed: e^(−42) is below the rounding of 1.
const DECAYED: f64 = 42.0;

/// The s at the end of both phases, of which only topspin has the second; `None` if it stuck
/// before.
pub(super) type Ways = [Option<f64>; 2];

/// Returns q, J_y and J_z, and the way to them.
#[inline]
pub(super) fn solve(impact: &Impact<f64>) -> ([f64; 3], Regime, Ways) {
    let (mut ways, mut phases) = ([None; 2], 0);
    let impulses = impulses(impact, |slide, phase| {
        let (end, way) = slide.follow(phase);
        ways[phases] = way;
        phases += 1;
        end
    });
    let regime = if ways[phases - 1].is_some() { Regime::Slide } else { Regime::Stick };
    (impulses, regime, ways)
}

/// Returns q, J_y and J_z with their derivatives, from the way to them.
pub(super) fn differentiate<const N: usize>(impact: &Impact<Dual<N>>, ways: Ways) -> [Dual<N>; 3] {
    let mut ways = ways.into_iter();
    impulses(impact, |slide, phase| match ways.next().flatten() {
        Some(s) => slide.end_near(phase, &slide.differentiate(phase, s)),
        None if phase.slip[1].re <= 0.0 => phase.stick(Place::start()),
        None => {
            phase.stick(slide.differentiate(phase, DECAYED / slide.real().slowest(phase.slip.map(|v| v.re))))
        }
    })
}

/// Returns q, J_y and J_z; `end` returns the end of a phase.
#[inline(always)]
fn impulses<D: Number>(impact: &Impact<D>, mut end: impl FnMut(&Slide<D>, &Phase<D>) -> Place<D>) -> [D; 3] {
    let &Impact { k, n, e, m_s, slip, lever, .. } = impact;
    let (slide, zero) = (Slide::new(impact), D::from(0.0));
    let (q, stopped) = if slip[1].re() > 0.0 {
        let cloth = m_s * slip[1] / lever[1];
        let compression = Phase { slip, k, n, cloth, work: None };
        let c = end(&slide, &compression);
        let left = c.stopped.map(|stopped| -stopped + 1.0);
        // at e = 0 restitution has no length: derivatives are the limit of a short one
        let (e, slip) = (e + 1e-18, [slip[0] * left[0], slip[1] * left[1]]);
        let work = Some(-e * e * compression.work(&c));
        let f = end(&slide, &Phase { slip, k: zero, n, cloth: cloth * left[1], work });
        let [y, z] = f.stopped;
        (c.q + f.q, [c.stopped[0] + left[0] * y, c.stopped[1] + left[1] * z])
    } else {
        // without the cloth W is a parabola in q
        let f = end(&slide, &Phase { slip, k: (e + 1.0) * k, n, cloth: zero, work: None });
        (f.q, f.stopped)
    };
    [q, -slip[0] * stopped[0] / lever[0], -slip[1] * stopped[1] / lever[1]]
}

/// A place on the way, counted from the beginning of a phase.
#[derive(Clone, Copy)]
struct Place<D> {
    /// The parts of the slip's components that friction has stopped.
    stopped: [D; 2],
    q: D,
    i: D,
}

impl<D: Number> Place<D> {
    fn start() -> Self {
        Self { stopped: [D::from(0.0); 2], q: D::from(0.0), i: D::from(0.0) }
    }
}

/// A phase of the impact, with the slip, k, A and W from its beginning.
struct Phase<D> {
    slip: [D; 2],
    k: D,
    n: D,
    cloth: D,
    /// W at its end; `None` for a phase that ends at v_x = 0.
    work: Option<D>,
}

impl<D: Number> Phase<D> {
    #[inline(always)]
    fn v_x(&self, at: &Place<D>) -> D {
        at.q * self.n - self.k - self.cloth * at.stopped[1]
    }

    #[inline(always)]
    fn work(&self, at: &Place<D>) -> D {
        (at.q * self.n * 0.5 - self.k) * at.q - self.cloth * at.i
    }

    /// Returns the end of the phase from a place whose slip has decayed: v_x grows by N per q.
    fn stick(&self, at: Place<D>) -> Place<D> {
        let stuck = Place { stopped: [D::from(1.0); 2], ..at };
        let v_x = self.v_x(&stuck);
        let dq = match self.work {
            None => -v_x / self.n,
            Some(work) => rise(work - self.work(&stuck), v_x, self.n)[0],
        };
        Place { q: at.q + dq, i: at.i + dq, ..stuck }
    }
}

/// The rates at which friction slows the slip.
struct Slide<D> {
    /// λ_y and λ_z.
    rates: [D; 2],
    /// The a, b, c of falling friction, over that at first contact: μ(v)/μ₀ = a + b e^(−cv).
    falls: Option<[D; 3]>,
}

impl<D: Number> Slide<D> {
    #[inline(always)]
    fn new(impact: &Impact<D>) -> Self {
        let &Impact { slip, lever, mu, fall, .. } = impact;
        if let Some([b, c]) = fall {
            // a unit of s, with no derivative
            let first = mu.re() + b.re() * (-c.re() * slip[0].re().hypot(slip[1].re())).exp();
            if first > 0.0 {
                let falls = Some([mu / first, b / first, c]);
                return Self { rates: lever.map(|lever| lever * first), falls };
            }
        }
        Self { rates: lever.map(|lever| lever * mu), falls: None }
    }

    /// Returns dq/ds.
    #[inline(always)]
    fn pace(&self, speed: D) -> D {
        self.friction(speed).map_or(speed, |friction| speed / friction)
    }

    /// Returns the friction over that at first contact, if it decreases.
    #[inline(always)]
    fn friction(&self, speed: D) -> Option<D> {
        self.falls.map(|[a, b, c]| a + b * (-c * speed).exp())
    }
}

impl Slide<f64> {
    /// Returns the smaller rate of the components that are not 0.
    fn slowest(&self, slip: [f64; 2]) -> f64 {
        let [y, z] = self.rates;
        match slip.map(|v| v == 0.0) {
            [true, _] => z,
            [_, true] => y,
            _ => y.min(z),
        }
    }

    /// Returns the place that is further by `ds`, by Gauss and Legendre's rules in panels so short
    /// that they are exact to rounding; `visit` gets s, the stopped parts and dq of each node.
    #[inline(always)]
    fn advance(
        &self,
        slip: [f64; 2],
        mut at: Place<f64>,
        ds: f64,
        mut visit: impl FnMut(f64, [f64; 2], f64),
    ) -> Place<f64> {
        let [y, z] = self.rates;
        let mut reach = y.max(z) * ds.abs();
        if let Some([_, _, c]) = self.falls {
            reach *= 1.0 + c * norm(slip);
        }
        let (mut panels, mut half) = (1, 0.5 * ds);
        if reach > MAX_PANEL {
            panels = usize::from((reach / MAX_PANEL) as u16) + 1;
            half /= panels as f64;
        }
        let rates = self.rates.map(|rate| rate * half);
        let [to_middle, _] = fall_and_rise(rates);
        for panel in 0..panels {
            let middle = further(at.stopped, to_middle);
            let slip = remaining(slip, middle);
            for &(x, weight) in &GAUSS {
                let [fall, rise] = fall_and_rise([rates[0] * x, rates[1] * x]);
                for (x, part) in [(x, fall), (-x, rise)] {
                    let dq = self.pace(norm(remaining(slip, part))) * (half * weight);
                    let stopped = further(middle, part);
                    at.q += dq;
                    at.i += dq * stopped[1];
                    visit(half * (2.0 * panel as f64 + 1.0 + x), stopped, dq);
                }
            }
            at.stopped = further(middle, to_middle);
        }
        at
    }

    /// Returns the dq from a place to the end of a phase, with an error of its third power; the
    /// pace decreases by `rate` per s.
    #[inline(always)]
    fn left(&self, phase: &Phase<f64>, at: &Place<f64>, per_pace: f64, rate: f64) -> f64 {
        // dv_x/dq = N − A λ_z e^(−λ_z s)/pace, and its derivative by q
        let held = phase.cloth * self.rates[1] * (1.0 - at.stopped[1]) * per_pace;
        let (first, second) = (phase.n - held, held * (self.rates[1] - rate) * per_pace);
        let v_x = phase.v_x(at);
        let Some(work) = phase.work else {
            // −v_x = dv_x/dq dq + ½ d²v_x/dq² dq²
            let per_first = 1.0 / first;
            let dq = -v_x * per_first;
            return dq - 0.5 * second * dq * dq * per_first;
        };
        // W = v_x dq + ½ dv_x/dq dq² + ⅙ d²v_x/dq² dq³
        let [dq, v_x] = rise(work - phase.work(at), v_x, first);
        dq - second * dq * dq * dq / (6.0 * v_x)
    }

    /// Returns the end of a phase, and the s there unless the slip has decayed before.
    #[inline(always)]
    fn follow(&self, phase: &Phase<f64>) -> (Place<f64>, Option<f64>) {
        let ([y, z], mut s, mut at) = (self.rates, 0.0, Place::start());
        for _ in 0..MAX_STEPS {
            let slip = remaining(phase.slip, at.stopped);
            let [y2, z2] = [slip[0] * slip[0], slip[1] * slip[1]];
            let (square, speed) = (y2 + z2, norm(slip));
            if square < f64::MIN_POSITIVE {
                return (phase.stick(at), None);
            }
            let per_square = 1.0 / square;
            let ([y2, z2], per_speed) = ([y2 * per_square, z2 * per_square], speed * per_square);
            // −d ln(pace)/ds, and a third of its decrease: (λ_y − λ_z)² v_y² v_z²/|v|⁴
            let (mut rate, mut per_pace) = (y * y2 + z * z2, per_speed);
            let turn = (y - z) * (y - z) * y2 * z2 * (1.0 / 3.0);
            if let (Some([a, _, c]), Some(friction)) = (self.falls, self.friction(speed)) {
                per_pace *= friction;
                rate *= 1.0 + c * speed * (1.0 - a / friction);
            }
            let dq = self.left(phase, &at, per_pace, rate);
            let dq_s = dq * per_pace;
            if dq_s.abs() * y.max(z) <= LAST_STEP {
                let ds = dq_s * (1.0 + dq_s * (0.5 * rate + dq_s * (rate * rate * (1.0 / 3.0) - turn)));
                let part = self.rates.map(|rate| rate * ds);
                let part = part.map(|part| part * (1.0 - part * (0.5 - part * (1.0 / 6.0))));
                let stopped = further(at.stopped, part);
                let lost = stopped[1] - at.stopped[1];
                let i = at.i + dq * (at.stopped[1] + lost * (0.5 + (z - rate) * ds * (1.0 / 12.0)));
                return (Place { stopped, q: at.q + dq, i }, Some(s + ds));
            }
            // q grows by pace (1 − e^(−rate ds))/rate at first
            let mut part = rate * dq_s;
            if !(part < 0.7) {
                // and by no more than with the slowest rate
                let slowest = self.slowest(phase.slip);
                part = slowest * dq_s;
                if part >= 1.0 {
                    // a friction that does not rise with the slip stops it by |v|/λ at the latest
                    let falls = self.falls.is_none_or(|[_, b, _]| b >= 0.0);
                    if phase.slip[1] <= 0.0 && falls {
                        return (phase.stick(at), None);
                    }
                    let end = self.advance(phase.slip, at, DECAYED / slowest, |_, _, _| {});
                    let stuck = phase.stick(end);
                    if stuck.q >= end.q {
                        return (stuck, None);
                    }
                }
                part = part.min(0.9);
            }
            // ds = −ln(1 − part)/rate, as a series in part/(2 − part), less the rate's decrease
            let per = 1.0 / (2.0 - part);
            let x2 = (part * per) * (part * per);
            let ds = dq_s * 2.0 * per * (1.0 + x2 * (1.0 / 3.0 + x2 * (0.2 + x2 * (1.0 / 7.0))));
            let ds = ds * (1.0 - (turn * ds * ds).min(0.5));
            s += ds;
            at = self.advance(phase.slip, at, ds, |_, _, _| {});
        }
        (at, Some(s))
    }
}

/// Returns the dq over which W rises by `w`, from v_x and dv_x/dq, and v_x after it.
#[inline(always)]
fn rise<D: Number>(w: D, v_x: D, stiffness: D) -> [D; 2] {
    let square = v_x * v_x + w * stiffness * 2.0;
    let after = if square.re() > 0.0 { square.sqrt() } else { D::from(f64::MIN_POSITIVE) };
    [w * 2.0 / (v_x + after), after]
}

#[inline(always)]
fn norm([y, z]: [f64; 2]) -> f64 {
    (y * y + z * z).sqrt()
}

/// Returns 1 − ab = (1 − a) + a(1 − b) for both components, from 1 − a and 1 − b.
#[inline(always)]
fn further([y, z]: [f64; 2], by: [f64; 2]) -> [f64; 2] {
    [y + (1.0 - y) * by[0], z + (1.0 - z) * by[1]]
}

/// Returns the slip that is left after its parts `stopped`.
#[inline(always)]
fn remaining([y, z]: [f64; 2], stopped: [f64; 2]) -> [f64; 2] {
    [y * (1.0 - stopped[0]), z * (1.0 - stopped[1])]
}

/// Returns 1 − e^(−x) and 1 − e^x of both components for |x| ≤ MAX_PANEL/2 by Taylor's series,
/// whose first term left out is below 3e-17.
#[inline(always)]
fn fall_and_rise([y, z]: [f64; 2]) -> [[f64; 2]; 2] {
    let (sinh_y, cosh_y) = series(y);
    let (sinh_z, cosh_z) = series(z);
    [[sinh_y - cosh_y, sinh_z - cosh_z], [-sinh_y - cosh_y, -sinh_z - cosh_z]]
}

/// Returns sinh x and cosh x − 1.
#[inline(always)]
fn series(x: f64) -> (f64, f64) {
    let (s, t) = (x * x, x * x * x * x);
    let cosh = s
        * ((s * (1.0 / 24.0) + 0.5)
            + t * ((s * (1.0 / 40_320.0) + 1.0 / 720.0)
                + t * (s * (1.0 / 479_001_600.0) + 1.0 / 3_628_800.0)));
    let sinh = x + x
        * s
        * ((s * (1.0 / 120.0) + 1.0 / 6.0)
            + t * ((s * (1.0 / 362_880.0) + 1.0 / 5_040.0)
                + t * (s * (1.0 / 6_227_020_800.0) + 1.0 / 39_916_800.0)));
    (sinh, cosh)
}

/// The longest panel in λs.
const MAX_PANEL: f64 = 0.8;

/// Abscissas and weights of the positive half of six nodes (Abramowitz & Stegun, Table 25.4).
const GAUSS: [(f64, f64); 3] = [
    (0.238_619_186_083_196_9, 0.467_913_934_572_691_04),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_36),
];
