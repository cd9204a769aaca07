//! The true inputs of a shot that fit best at given shared unknowns.

use nalgebra::DVector;

use super::block::{AT_KINK, RowsBlock};
use super::shot::OWN;
use crate::problem::film::dual::gradient;
use crate::problem::sums::{Contribution, settle};
use crate::problem::unknowns::{Own, PHYSICS, Shared};

/// Steps of a shot's own descent, and fall of χ² after which it ends: 1e-3 standard deviations.
const STEPS: usize = 30;
const STALL: f64 = 1e-6;

/// Distance of another side of a kink, in standard errors, beyond which it is not tried.
const REACH: f64 = 6.0;

impl RowsBlock {
    /// Returns the own unknowns of shot `i` that fit best near `start`, on either side of the kink
    /// between topspin and draw or on it. Those far from the kink, which the steps of all unknowns find,
    /// stay, unless a speed is unknown: a speed afterwards determines it too well for linear steps.
    pub fn settle(&self, i: usize, start: Own, shared: &Shared) -> Own {
        let shot = &self.shots[i];
        let has_speed = shot.own_unknowns_without_prior() == 0;
        if shot.is_exact() || has_speed && self.way_to_kink(i, &start, shared).is_none() {
            return start;
        }
        let mut best = self.descend_own(i, start, shared, false);
        for on_kink in [false, true] {
            let Some(way) = self.way_to_kink(i, &best.0, shared) else { continue };
            let other =
                if on_kink { self.onto_kink(i, &best.0 + way, shared) } else { Some(&best.0 + way * 2.0) };
            if let Some(other) = other.map(|other| self.descend_own(i, other, shared, on_kink))
                && other.1.cost < best.1.cost
            {
                best = other;
            }
        }
        best.0
    }

    /// Returns topspin over closing speed of shot `i` and its derivatives by the own unknowns.
    fn topspin(&self, i: usize, own: &Own, shared: &Shared) -> (f64, DVector<f64>) {
        let (cue, _) = self.shots[i].approach(own, shared);
        let topspin = cue.spin[1] / cue.velocity.x;
        let by = gradient(&topspin);
        (topspin.re, DVector::from_fn(OWN, |place, _| by[place]))
    }

    /// Returns the shortest way to the kink; `None` if it is beyond the reach of the errors.
    fn way_to_kink(&self, i: usize, own: &Own, shared: &Shared) -> Option<DVector<f64>> {
        let (topspin, normal) = self.topspin(i, own, shared);
        let is_near = topspin.abs() < REACH * normal.norm();
        is_near.then(|| &normal * (-topspin / normal.norm_squared()))
    }

    /// Returns own unknowns moved on to the kink.
    fn onto_kink(&self, i: usize, mut own: Own, shared: &Shared) -> Option<Own> {
        for _ in 0..4 {
            let (topspin, normal) = self.topspin(i, &own, shared);
            if topspin.abs() < 0.01 * AT_KINK {
                return Some(own);
            }
            own -= &normal * (topspin / normal.norm_squared());
        }
        None
    }

    /// Descends in the own unknowns of shot `i`, along the kink if they are on it.
    fn descend_own(&self, i: usize, own: Own, shared: &Shared, on_kink: bool) -> (Own, Contribution) {
        let contribute = |own: &Own| match self.predict(i, own, shared) {
            Some(predicted) => self.add_up(i, own, &predicted, on_kink),
            None => Contribution::impossible(OWN, PHYSICS, self.noises.len()),
        };
        let bounded = |own: Own| if on_kink { self.onto_kink(i, own, shared) } else { Some(own) };
        settle(own, &[], (STEPS, STALL), contribute, bounded)
    }
}
