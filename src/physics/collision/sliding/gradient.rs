//! Derivatives of the end of an impact.

use super::{DECAYED, End, Place, Slide, TINY_E, norm};

/// Returns the derivatives of q and of the stopped parts of the slip by v_y, v_z, λ_y, λ_z, the a,
/// b, c of the friction, k, A, N and e.
///
/// At a fixed q only W, not the end of compression, depends on them, as dW/dq = v_x = 0 there: v_x
/// dq = −∂(W − (1 − e²)W_c).
#[inline(always)]
pub(super) fn gradient(slide: &Slide<f64>, inputs: &[f64; 11], end: &End) -> [[f64; 11]; 3] {
    let &[v_y, v_z, .., k, cloth, n, e] = inputs;
    let (slip, [q_c, dq]) = ([v_y, v_z], end.q);
    let (mut by_q, mut s) = ([0.0; 11], end.ways[0]);
    let mut sums = Sums::default();
    if v_z > 0.0 {
        let s_c = s.unwrap_or_else(|| DECAYED / slide.slowest(slip));
        let c = Sums::between(slide, slip, 0.0, [0.0; 2], s_c);
        let [stopped_y, stopped_c] = if s.is_some() { c.end.stopped } else { [1.0; 2] };
        let i_c = c.end.i + stopped_c * (q_c - c.end.q);
        let mut r = Sums::default();
        if s.is_some() {
            let ds = end.ways[1].unwrap_or_else(|| DECAYED / slide.slowest(slip));
            r = Sums::between(slide, slip, s_c, [stopped_y, stopped_c], ds);
        }
        s = end.ways[1].map(|ds| s_c + ds);
        // the part of v_z that restitution has stopped, and what it adds to I
        let since = (1.0 - stopped_c) * if s.is_some() { r.end.stopped[1] } else { 1.0 };
        let i =
            stopped_c * dq + (1.0 - stopped_c) * r.end.i + since * (dq - r.end.q) * f64::from(s.is_none());
        let v_x = n * dq - cloth * since;
        let e = e + TINY_E;
        for j in 0..7 {
            let at_c = c.by_i[j] - stopped_c * c.by_q[j];
            let later = r.by_i[j] - (stopped_c + since) * r.by_q[j] - since * c.by_q[j];
            by_q[j] = cloth * (later + e * e * at_c);
            sums.by_q[j] = c.by_q[j] + r.by_q[j];
        }
        by_q[7] = dq + e * e * q_c;
        by_q[8] = i + e * e * i_c;
        by_q[9] = -0.5 * (dq * (2.0 * q_c + dq) + e * e * q_c * q_c);
        by_q[10] = 2.0 * e * (0.5 * n * q_c * q_c - cloth * (stopped_c * q_c - i_c));
        by_q = by_q.map(|by| by / v_x);
    } else {
        // q = (1 + e)k/N
        [by_q[7], by_q[9], by_q[10]] = [(1.0 + e) / n, -q_c / n, k / n];
        if let Some(s) = s {
            sums = Sums::between(slide, slip, 0.0, [0.0; 2], s);
        }
    }
    let mut all = [by_q, [0.0; 11], [0.0; 11]];
    if let Some(s) = s {
        let left = end.stopped.map(|stopped| 1.0 - stopped);
        let pace = slide.pace(norm([v_y * left[0], v_z * left[1]])).max(f64::MIN_POSITIVE);
        for j in 0..7 {
            by_q[j] -= sums.by_q[j];
        }
        for i in 0..2 {
            all[1 + i] = by_q.map(|by| slide.rates[i] * left[i] / pace * by);
            all[1 + i][2 + i] += s * left[i];
        }
    }
    all
}

/// The end of a way, and the derivatives of q and I there by v_y, v_z, λ_y, λ_z and the a, b, c of
/// the friction.
#[derive(Default)]
struct Sums {
    end: Place,
    by_q: [f64; 7],
    by_i: [f64; 7],
}

impl Sums {
    /// Returns those of the way from `from`, where parts of the slip have stopped, over `ds`.
    #[inline(always)]
    fn between(slide: &Slide<f64>, slip: [f64; 2], from: f64, stopped: [f64; 2], ds: f64) -> Self {
        let (mut by_q, mut by_i) = ([0.0; 7], [0.0; 7]);
        let before = stopped.map(|stopped| 1.0 - stopped);
        let start = [slip[0] * before[0], slip[1] * before[1]];
        let end = slide.advance(start, Place::default(), ds, |t, stopped, v, dq| {
            let (t, left) = (from + t, [0, 1].map(|i| before[i] * (1.0 - stopped[i])));
            // ∂|v|/∂v_y0 = v_y e^(−λ_y s)/|v|, ∂|v|/∂λ_y = −s v_y²/|v|
            let mut per = dq / (v[0] * v[0] + v[1] * v[1]).max(f64::MIN_POSITIVE);
            let mut falling = [0.0; 3];
            if let Some([a, b, c]) = slide.falls {
                let speed = norm(v);
                let part = dq / (a + b * (-c * speed).exp());
                let fallen = part * (-c * speed).exp();
                // ∂(|v|/m)/∂|v| = (1 − |v| m'/m)/m
                per += b * c * fallen / speed.max(f64::MIN_POSITIVE);
                falling = [-part, -fallen, b * speed * fallen];
            }
            let [y, z] = v.map(|v| per * v);
            let [a, b, c] = falling;
            let by = [y * left[0], z * left[1], -t * y * v[0], -t * z * v[1], a, b, c];
            for j in 0..7 {
                by_q[j] += by[j];
                by_i[j] += by[j] * (1.0 - left[1]);
            }
            by_i[3] += dq * t * left[1];
        });
        Self { end, by_q, by_i }
    }
}
