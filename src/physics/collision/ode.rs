//! The equations of motion of the sliding contact, integrated as they stand: the check of [`super::sliding`].
//!
//! The variable is that of [`super::sliding`], s with dq = |v| ds/m, m = μ(|v|)/μ₀. The unit of velocity is the closing speed.
//! Restitution is counted from its beginning in (q − q_c)/e, v_x/e and (W − W_c)/e², which are of order 1 however small e is. Where
//! the slip that is left cannot make a difference the contact sticks, and the rest is a quadratic in q.

use super::Regime;
use super::impact::{Impact, Impulses};
use super::integrator::{EVENTS, System, TooManySteps, integrate};

/// Places in the state: the changes of v_y and v_z, then q, v_x and W of the phase over its ε.
const CHANGE: usize = 0;
const Q: usize = 2;
const V_X: usize = 3;
const WORK: usize = 4;
const N: usize = 5;

/// A contact sticks where the slip is this part of the tolerance: friction adds no more to the outcome.
const STUCK: f64 = 0.1;

/// The event of a slip that has decayed.
const STICKS: usize = 1;

/// Steps that stop more of the slip are unstable.
const STABLE: f64 = 2.0;

struct Slide<'a> {
    impact: &'a Impact<f64>,
    /// v_y0, v_z0.
    slip: [f64; 2],
    /// μ₀, the unit of friction.
    first: f64,
    /// ε: 1 in compression, e in restitution.
    stretch: f64,
    /// The work over ε² at which restitution ends.
    target: f64,
    /// The slip of a contact that sticks.
    stuck: f64,
}

impl Slide<'_> {
    fn friction(&self, speed: f64) -> f64 {
        let &Impact { mu, fall, k, .. } = self.impact;
        mu + fall.map_or(0.0, |[b, c]| b * (-c * speed * k).exp())
    }

    fn slip(&self, y: &[f64; N]) -> [f64; 2] {
        [0, 1].map(|i| self.slip[i] + y[CHANGE + i])
    }

    fn pace(&self, y: &[f64; N]) -> f64 {
        let speed = norm(self.slip(y));
        if self.impact.fall.is_none() { speed } else { speed * self.first / self.friction(speed) }
    }

    fn is_compression(&self) -> bool {
        self.target == 0.0
    }
}

impl System<N> for Slide<'_> {
    type Mode = ();

    fn rates(&self, (): &(), y: &[f64; N]) -> [f64; N] {
        let [lever_y, lever_z] = self.impact.lever;
        let pace = self.pace(y);
        // friction's impulses per s are −μ₀v
        let [v_y, v_z] = self.slip(y);
        let [y_rate, z_rate] = [lever_y * v_y, lever_z * v_z].map(|v| -self.first * v);
        let braked = self.impact.m_s * self.first * v_z;
        [self.stretch * y_rate, self.stretch * z_rate, pace, self.impact.n * pace - braked, y[V_X] * pace]
    }

    fn events(&self, (): &(), y: &[f64; N]) -> [f64; EVENTS] {
        let end = if self.is_compression() { -y[V_X] } else { self.target - y[WORK] };
        let sticks = if self.first > 0.0 { norm(self.slip(y)) / self.stuck - 1.0 } else { 1.0 };
        [end, sticks, 1.0, 1.0]
    }

    fn prepare(&self, (): &(), y: &[f64; N]) -> ((), f64) {
        // to where the impulse would be that of the whole impact
        let whole = 1.0 / (self.pace(y) * self.impact.n);
        let [y, z] = self.impact.lever;
        ((), whole.min(STABLE / (self.stretch * self.first * y.max(z))))
    }

    fn after(&self, (): &(), _: usize) -> Option<()> {
        None
    }

    fn change(&self, (): &(), (): &(), _: &mut [f64; N]) {}
}

/// The impulses to a tolerance, of the closing speed.
pub(super) fn impulses(
    impact: &Impact<f64>,
    tolerance: f64,
) -> Result<(Impulses<f64>, Regime), TooManySteps> {
    let &Impact { k, n, e, lever: [lever_y, lever_z], .. } = impact;
    let slip = impact.slip.map(|v| v / k);
    let mut slide = Slide { impact, slip, first: 1.0, stretch: 1.0, target: 0.0, stuck: 0.0 };
    slide.first = slide.friction(norm(slip));
    slide.stuck = STUCK * tolerance;
    let mut y = [0.0, 0.0, 0.0, -1.0, 0.0];
    let mut sticks = slide.walk(&mut y, tolerance)?;
    if sticks {
        // v_x grows by N per q
        y[Q] -= y[V_X] / n;
        y[WORK] -= 0.5 * y[V_X] * y[V_X] / n;
    }
    let mut q = y[Q];
    if e > 0.0 {
        (slide.stretch, slide.target) = (e, -y[WORK]);
        (y[Q], y[V_X], y[WORK]) = (0.0, 0.0, 0.0);
        sticks = sticks || slide.walk(&mut y, (tolerance / e).min(1e-2))?;
        if sticks {
            let left = 2.0 * (slide.target - y[WORK]);
            y[Q] += left / (y[V_X] + (y[V_X] * y[V_X] + n * left).max(0.0).sqrt());
        }
        q += e * y[Q];
    }
    let [y, z] = if sticks { slip.map(|v| -v) } else { [y[CHANGE], y[CHANGE + 1]] };
    let impulses = Impulses { q: k * q, y: k * y / lever_y, z: k * z / lever_z };
    Ok((impulses, if sticks { Regime::Stick } else { Regime::Slide }))
}

impl Slide<'_> {
    /// Goes through a phase and says whether the contact has stuck.
    fn walk(&self, y: &mut [f64; N], tolerance: f64) -> Result<bool, TooManySteps> {
        let speed = norm(self.slip(y));
        if speed == 0.0 || self.first > 0.0 && speed <= 1.01 * self.stuck {
            return Ok(true);
        }
        let event;
        (*y, event) = integrate(self, (), *y, tolerance, &mut Vec::new())?;
        Ok(event == STICKS)
    }
}

fn norm(v: [f64; 2]) -> f64 {
    (v[0] * v[0] + v[1] * v[1]).sqrt()
}
