//! The contact resolved in time: the balls are elastic where they touch and repel each other with
//! Hertz's force F = κ ξ^(3/2) at an overlap ξ, in restitution with e² of it, which makes e the
//! energetic coefficient of restitution. With gravity, the balls' weight on the cloth, lift-off and
//! landing; the line of centres stays as it was at first contact.
//!
//! With closing speed k the overlap reaches (5k²/8κ)^(2/5), and an elastic contact lasts
//! T = 2.9433 of that over k (H. Hertz 1882; K. L. Johnson, Contact Mechanics, § 11.4), so that
//! T ∝ k^(−1/5). Restitution takes T/2e.
//!
//! Units are k for velocities and, for times, the t₀ that makes κ = 1, so that d²ξ/dt² = −2 ξ^(3/2).
//! F is not smooth in t where the balls touch and part. So the variable is x with dt = 2r dx, where
//! r = √ξ: then dr/dx = −v_x and F dt = 2r⁴ dx.

use super::Impulses;
use super::dynamics::{Dynamics, Site, Slips, at};
use super::phase::{Model, Phase, tolerance_of_restitution, walk};
use super::solver::{GaveUp, Integrator};
use crate::physics::collision::Regime;

/// Places behind the state of [`at`]: the impulse since the phase began over its stretch, r, the
/// heights of both balls, the time.
pub(super) const IMPULSE: usize = at::COUNT;
pub(super) const ROOT: usize = at::COUNT + 1;
pub(super) const CUE_HEIGHT: usize = at::COUNT + 2;
pub(super) const OBJECT_HEIGHT: usize = at::COUNT + 3;
const TIME: usize = at::COUNT + 4;
const STATE: usize = at::COUNT + 5;

/// A ball that falls more slowly than this, in units of k, does not fall: friction may carry just its weight, and
/// roundings must not make it land again and again.
pub(in crate::physics::collision) const AT_REST: f64 = 1e-14;

/// Duration of an elastic contact in units of t₀: 4√π Γ(2/5)/(5 Γ(9/10)) · (5/8)^(2/5).
const ELASTIC: f64 = 2.438_837_564_705_526_7;

/// t₀ in seconds for an elastic contact that lasts `contact_time` at 1 m/s.
pub(in crate::physics::collision) fn time_unit(contact_time: f64, k: f64) -> f64 {
    contact_time * k.powf(-0.2) / ELASTIC
}

pub(in crate::physics::collision) fn impulses(
    dynamics: &Dynamics,
    e: f64,
    tolerance: f64,
) -> Result<(Impulses, Regime), GaveUp> {
    let (q, y, regime) = solve(dynamics, e, tolerance)?;
    Ok((dynamics.impulses(q, &y), regime))
}

fn solve(dynamics: &Dynamics, e: f64, tolerance: f64) -> Result<(f64, [f64; STATE], Regime), GaveUp> {
    let mut integrator = Integrator::new(tolerance);
    let mut phase = Phase::compression(dynamics);
    let mut y = [0.0; STATE];
    let model = InTime { dynamics };
    let mut q = walk(&mut integrator, &model, &mut phase, &mut y)?;
    if e > 0.0 {
        integrator.set_tolerance(tolerance_of_restitution(tolerance, e));
        y[IMPULSE] = 0.0;
        phase = phase.restitution(e, q, &y);
        q = walk(&mut integrator, &model, &mut phase, &mut y)?;
    }
    Ok((q, y, phase.regime()))
}

struct InTime<'a> {
    dynamics: &'a Dynamics,
}

impl Model<STATE> for InTime<'_> {
    fn impulse(&self, phase: &Phase, _: f64, y: &[f64; STATE]) -> f64 {
        phase.q + phase.stretch * y[IMPULSE]
    }

    /// F = ξ^(3/2), e² of it in restitution.
    fn normal(&self, phase: &Phase, y: &[f64; STATE]) -> f64 {
        phase.stretch * phase.stretch * y[ROOT].powi(3)
    }

    /// dt = 2r dx, over e in restitution.
    fn pace(&self, phase: &Phase, y: &[f64; STATE]) -> f64 {
        2.0 * y[ROOT] / phase.stretch
    }

    fn fastest(&self, phase: &Phase, y: &[f64; STATE], step: f64) -> [f64; STATE] {
        fastest(phase, y, step)
    }

    fn own_rates(&self, phase: &Phase, y: &[f64; STATE], _: &Slips, v_x: f64, rates: &mut [f64; STATE]) {
        let pace = self.pace(phase, y);
        // F dt = 2r⁴ dx, times e in restitution
        rates[IMPULSE] = 2.0 * y[ROOT].powi(4);
        rates[ROOT] = -v_x;
        rates[CUE_HEIGHT] = y[at::U_Z] * pace;
        rates[OBJECT_HEIGHT] = y[at::V_Z] * pace;
        rates[TIME] = pace;
    }

    fn restitution_left(&self, _: &Phase, y: &[f64; STATE]) -> f64 {
        y[ROOT]
    }

    fn above_cloth(&self, y: &[f64; STATE], site: Site) -> f64 {
        let (up, height) = vertical(site);
        if y[up] >= -AT_REST { 1.0 } else { y[height] }
    }

    fn land(&self, q: f64, y: &mut [f64; STATE], site: Site) {
        land(self.dynamics, q, y, site);
    }
}

/// dr/dx = −v_x is at most 1.
pub(super) fn fastest<const N: usize>(phase: &Phase, y: &[f64; N], step: f64) -> [f64; N] {
    let mut fastest = *y;
    if phase.is_compression() {
        fastest[ROOT] += step;
    }
    fastest
}

/// A ball that lands stays down: it falls for less than the contact lasts, far too slowly to rebound. The cloth stops it with an
/// impulse per unit mass of its speed, and friction in proportion.
pub(super) fn land(dynamics: &Dynamics, q: f64, y: &mut [f64], site: Site) {
    let (up, height) = vertical(site);
    let fallen = -y[up];
    (y[up], y[height]) = (0.0, 0.0);
    dynamics.landing_friction(q, y, site, fallen);
}

/// Places of a ball's upward velocity and height.
pub(super) fn vertical(site: Site) -> (usize, usize) {
    if site == Site::CueOnCloth { (at::U_Z, CUE_HEIGHT) } else { (at::V_Z, OBJECT_HEIGHT) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::collision::Contact;
    use crate::physics::collision::input::Levers;
    use crate::physics::friction_law::Friction;

    #[test]
    fn an_elastic_contact_lasts_as_long_as_hertz_says() {
        /// The constant and the integration to 1e-13.
        const ROUNDING: f64 = 1e-12;
        for e in [1.0, 0.5] {
            let levers = Levers::equal(0.4);
            let contact = Contact {
                k: 1.0,
                v_y: 0.0,
                v_z: 0.0,
                mu: 0.0,
                m_s: 0.0,
                e,
                nu: 0.4,
                sigma: 1.0,
                levers,
                mu_s: 0.0,
            };
            let dynamics = Dynamics::new(&contact, Friction::Constant(0.0), 1e-13);
            let (q, y, _) = solve(&dynamics, e, 1e-13).unwrap();
            assert!((y[TIME] / (0.5 * ELASTIC * (1.0 + 1.0 / e)) - 1.0).abs() < ROUNDING, "{}", y[TIME]);
            assert!((q - 0.5 * (1.0 + e)).abs() < ROUNDING, "{q}");
        }
    }
}
