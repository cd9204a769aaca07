//! Contacts that begin to slide.
//!
//! Coulomb's friction F turns towards the slip s at the rate βF/|s|, with β the contact's lever: next to no slip,
//! far faster than anything else happens, and an explicit method would need steps as short as that. (With slip that
//! grows as the square of the time, thousands of them; more where three contacts stick and slide by turns, as of slow
//! balls on a rough cloth.) While a contact starts, its friction is therefore against the slip a short time τ ahead,
//! s + τ ds/dt, as in an implicit step. The rate is then βF/(|s| + τβF), at most 1/τ. Until the slip has grown to τβF, where
//! this ends, the impulse is off by about τ² times the rate at which the forces turn.

use super::dynamics::{Dynamics, Forces, Grip, Grips, Pair, Site, Slips, norm, unit};

/// Directions of contacts that start are found by Newton's method, in turn: with a slope from so large a turn (rad)…
const PROBE: f64 = 1e-6;
/// …to so small a one, some roundings…
const TURNED: f64 = 1e-14;
/// …in so many rounds: three for one contact, some more where two depend on each other…
const MAX_TURNS: usize = 20;
/// …and by at most this at a time.
const MAX_TURN: f64 = 0.5;

pub(super) fn turn([x, y]: Pair, angle: f64) -> Pair {
    let (sin, cos) = angle.sin_cos();
    [cos * x - sin * y, sin * x + cos * y]
}

impl Dynamics {
    /// Whether a contact slides from rest: its slip does not yet have a direction of its own.
    pub(in crate::physics::collision) fn is_starting(
        &self,
        site: Site,
        grips: &Grips,
        slips: &Slips,
    ) -> bool {
        let i = site as usize;
        match grips[site] {
            Grip::Starts => true,
            Grip::Creeps => norm(slips.0[i]) <= self.no_slip[i],
            Grip::Slides | Grip::Sticks | Grip::Open | Grip::Springs | Grip::Yields => false,
        }
    }

    /// The direction of the friction of every contact that starts.
    pub(in crate::physics::collision) fn start(
        &self,
        grips: &Grips,
        slips: &Slips,
        normal: f64,
        along: &mut [Pair; 3],
    ) {
        let starts = |site: &Site| self.is_starting(*site, grips, slips);
        let mut held = *grips;
        for site in Site::ALL.into_iter().filter(starts) {
            held[site] = Grip::Sticks;
        }
        let holding = self.forces_along(&held, slips, normal, along).friction;
        for site in Site::ALL.into_iter().filter(starts) {
            along[site as usize] = unit(holding[site as usize]);
        }
        for _ in 0..MAX_TURNS {
            let mut turned: f64 = 0.0;
            for site in Site::ALL.into_iter().filter(starts) {
                let i = site as usize;
                // the slip ahead, across the friction
                let across = |d: Pair| {
                    let mut along = *along;
                    along[i] = d;
                    let rate = self.slip_rates(grips, &self.forces_along(grips, slips, normal, &along))[i];
                    let [x, y] = [0, 1].map(|j| slips.0[i][j] + self.ahead * rate[j]);
                    d[0] * y - d[1] * x
                };
                let d = along[i];
                let value = across(d);
                let slope = (across(turn(d, PROBE)) - value) / PROBE;
                // otherwise the slip would not turn there
                if slope > 0.0 {
                    let angle = (-value / slope).clamp(-MAX_TURN, MAX_TURN);
                    along[i] = turn(d, angle);
                    turned = turned.max(angle.abs());
                }
            }
            if turned <= TURNED {
                break;
            }
        }
    }

    /// Slip that friction turns in the time that is looked ahead.
    pub(in crate::physics::collision) fn turned_by(&self, site: Site, forces: &Forces) -> f64 {
        self.ahead * self.lever(site) * forces.most[site as usize]
    }

    /// A contact starts while this is positive: until friction turns the slip quickly enough, or it stops within the
    /// time that is looked ahead.
    pub(in crate::physics::collision) fn starts_for(
        &self,
        site: Site,
        grips: &Grips,
        slips: &Slips,
        forces: &Forces,
    ) -> f64 {
        let i = site as usize;
        let (slip, rate, d) = (slips.0[i], self.slip_rates(grips, forces)[i], unit(forces.friction[i]));
        if d == [0.0; 2] {
            return -1.0;
        }
        let growing = -[0, 1].map(|j| (slip[j] + self.ahead * rate[j]) * d[j]).iter().sum::<f64>();
        (growing + self.no_slip[i]).min(self.turned_by(site, forces) - norm(slip))
    }
}
