//! Places on the way of a slide with their derivatives.

use super::{Dual, Phase, Place, Slide, norm};

impl<const N: usize> Slide<Dual<N>> {
    pub fn real(&self) -> Slide<f64> {
        Slide { rates: self.rates.map(|x| x.re), falls: self.falls.map(|law| law.map(|x| x.re)) }
    }

    /// Returns the place of the end of `phase`, by a step of Newton's from its real part.
    pub fn end_near(&self, phase: &Phase<Dual<N>>, at: &Place<Dual<N>>) -> Place<Dual<N>> {
        let real = self.real();
        let left = at.stopped.map(|stopped| 1.0 - stopped.re);
        let per_pace = 1.0 / real.pace(norm([0, 1].map(|i| phase.slip[i].re * left[i])));
        let dq = match phase.work {
            None => -phase.v_x(at) / (phase.n.re - phase.cloth.re * real.rates[1] * left[1] * per_pace),
            Some(work) => (work - phase.work(at)) / phase.v_x(at).re,
        };
        let stopped = [0, 1].map(|i| at.stopped[i] + dq * (real.rates[i] * left[i] * per_pace));
        Place { stopped, q: at.q + dq, i: at.i + dq * at.stopped[1].re }
    }

    /// Returns the place at `s`: q and I have derivatives by the slip, λ, and the a, b, c of the
    /// friction, which have theirs.
    pub fn differentiate(&self, phase: &Phase<Dual<N>>, s: f64) -> Place<Dual<N>> {
        let real = self.real();
        let (mut by_q, mut by_i) = ([0.0; 7], [0.0; 7]);
        let real_slip = phase.slip.map(|v| v.re);
        let at = real.advance(real_slip, Place::start(), s, |t, stopped, dq| {
            let left = stopped.map(|stopped| 1.0 - stopped);
            let slip = [0, 1].map(|i| real_slip[i] * left[i]);
            let speed = norm(slip).max(f64::MIN_POSITIVE);
            // by |v|²/2
            let mut per = dq / (speed * speed).max(f64::MIN_POSITIVE);
            let mut by = [0.0; 7];
            if let Some([a, b, c]) = real.falls {
                let falling = (-c * speed).exp();
                let part = dq / (a + b * falling);
                // ∂(|v|/m)/∂|v| = (1 − |v| m'/m)/m
                per += part * b * c * falling / speed;
                [by[4], by[5], by[6]] = [-part, -part * falling, part * b * speed * falling];
            }
            for i in 0..2 {
                // ∂|v|²/2 = v_y e^(−λ_y s) ∂v_y0 − s v_y² ∂λ_y
                let by_slip = per * slip[i];
                (by[i], by[2 + i]) = (by_slip * left[i], -by_slip * slip[i] * t);
            }
            for j in 0..7 {
                by_q[j] += by[j];
                by_i[j] += by[j] * stopped[1];
            }
            by_i[3] += dq * t * left[1];
        });
        let ([y, z], [rate_y, rate_z]) = (&phase.slip, &self.rates);
        let chain = |value: f64, by: [f64; 7]| {
            let mut sum = Dual::<N>::from(value);
            for (input, by) in [y, z, rate_y, rate_z].into_iter().chain(self.falls.iter().flatten()).zip(by) {
                sum.eps += input.eps * by;
            }
            sum
        };
        // 1 − e^(−λs) changes by s e^(−λs) ∂λ
        let stopped =
            [0, 1].map(|i| (self.rates[i] - real.rates[i]) * (s * (1.0 - at.stopped[i])) + at.stopped[i]);
        Place { stopped, q: chain(at.q, by_q), i: chain(at.i, by_i) }
    }
}
