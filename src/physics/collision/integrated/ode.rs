//! The equations of motion in the impulse, integrated as they stand: no closed form, no change of
//! variables. Slower than [`crate::physics::collision::kim`] and less exact, but it also takes what that cannot: the
//! cloth's friction on both balls along their true slip, and a friction that falls with the slip.
//!
//! The variable is q, in units of k. Compression ends where v_x = 0. Restitution ends where
//! W = ∫ v_x dq has won back e² of what compression cost (Kim 2024, Eq. 37). It is integrated over
//! x = (q − q_c)/e with w = (W − W_c)/e², which are of order 1 however small e is.

use super::Impulses;
use super::dynamics::{Dynamics, Site, Slips, at};
use super::phase::{Model, Phase, tolerance_of_restitution, walk};
use super::solver::{GaveUp, Integrator};
use crate::physics::collision::Regime;

/// Place of w in the state.
const WORK: usize = at::COUNT;
const STATE: usize = at::COUNT + 1;

pub(in crate::physics::collision) fn impulses(
    dynamics: &Dynamics,
    e: f64,
    tolerance: f64,
) -> Result<(Impulses, Regime), GaveUp> {
    let mut integrator = Integrator::new(tolerance);
    let mut phase = Phase::compression(dynamics);
    let mut y = [0.0; STATE];
    let mut q = walk(&mut integrator, &InImpulse { work: f64::NAN }, &mut phase, &mut y)?;
    if e > 0.0 {
        let work = -y[WORK];
        integrator.set_tolerance(tolerance_of_restitution(tolerance, e));
        y[WORK] = 0.0;
        phase = phase.restitution(e, q, &y);
        q = walk(&mut integrator, &InImpulse { work }, &mut phase, &mut y)?;
    }
    Ok((dynamics.impulses(q, &y), phase.regime()))
}

struct InImpulse {
    /// |W_c|: restitution ends where w has reached it.
    work: f64,
}

impl Model<STATE> for InImpulse {
    fn impulse(&self, phase: &Phase, x: f64, _: &[f64; STATE]) -> f64 {
        phase.q + phase.stretch * x
    }

    fn normal(&self, _: &Phase, _: &[f64; STATE]) -> f64 {
        1.0
    }

    fn pace(&self, phase: &Phase, _: &[f64; STATE]) -> f64 {
        phase.stretch
    }

    fn fastest(&self, _: &Phase, y: &[f64; STATE], _: f64) -> [f64; STATE] {
        *y
    }

    fn own_rates(&self, _: &Phase, _: &[f64; STATE], _: &Slips, v_x: f64, rates: &mut [f64; STATE]) {
        // dw/dx = v_x/e
        rates[WORK] = v_x;
    }

    fn restitution_left(&self, _: &Phase, y: &[f64; STATE]) -> f64 {
        self.work - y[WORK]
    }

    /// Without gravity nothing lands.
    fn above_cloth(&self, _: &[f64; STATE], _: Site) -> f64 {
        f64::NAN
    }

    fn land(&self, _: f64, _: &mut [f64; STATE], _: Site) {}
}
