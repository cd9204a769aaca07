//! Derivatives of the end of an impact.

use super::quadrature::integrate;
use super::{DECAYED, Decay, End, Pair, Place, norm, slowest, stiffness};

/// Stands in for e = 0 in derivatives, where restitution has no length.
const TINY_E: f64 = 1e-18;

/// Returns the derivatives of q and of the stopped parts of the slip by v_y, v_z, λ_y, λ_z, the a,
/// b, c of the friction, k, A, N and e.
///
/// At a fixed q only W, not the end of compression, depends on them, as dW/dq = v_x = 0 there: v_x
/// dq = −∂(W − (1 − e²)W_c).
#[inline(always)]
pub(super) fn gradient<const FALLS: bool>(
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
    if topspin {
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
            let later =
                sums.i[1 + j] - c.i[1 + j] - stopped * (sums.q[1 + j] - c.q[1 + j]) - since * c.q[1 + j];
            by_q[j] = cloth * (later + e * e * at_c);
        }
        let i = sums.i[0] - c.i[0] + stopped * (dq - (sums.q[0] - c.q[0]));
        by_q[7] = dq + e * e * q_c;
        by_q[8] = i + e * e * i_c;
        by_q[9] = -0.5 * (dq * (2.0 * q_c + dq) + e * e * q_c * q_c);
        by_q[10] = 2.0 * e * lost;
        by_q = by_q.map(|by| by / v_x);
    } else {
        // q = (1 + e)k/N
        [by_q[7], by_q[9], by_q[10]] = [(1.0 + e) / n, -q_c / n, k / n];
        if end.slid.is_some() {
            sums.add(slip, decay, 0.0, s);
        }
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

/// q and I of the way, each with its derivatives by v_y, v_z, λ_y, λ_z and the a, b, c of the
/// friction.
#[derive(Clone, Copy, Default)]
struct Sums {
    q: [f64; 8],
    i: [f64; 8],
    /// The parts of the slip's components that are stopped at the end.
    stopped: Pair,
}

impl Sums {
    /// Adds the way from `from` over `ds`; returns the part of v_z that is stopped there, of what
    /// was left.
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
            // ∂|v|/∂v_y0 = v_y e^(−λ_y s)/|v|, ∂|v|/∂λ_y = −s v_y²/|v|; ∂(|v|/m)/∂|v| = (1 − |v|
            // m'/m)/m
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
