//! e and J_t/J_n of shots and of the law, and the errors of what follows from them.

use nalgebra::DMatrix;

use super::block::DiscBlock;
use super::motion::{Gradient, InputCovariance, MOVING, law_of};
use super::own::{self, CORE};
use crate::problem::film::dual::gradient;
use crate::problem::solution::Solution;
use crate::problem::unknowns::{Id, Own, SHARED, Shared};

/// Returns the covariance of the inputs of the motion of a shot in that of its own unknowns and the shared
/// ones.
pub(super) fn input_covariance(all: &DMatrix<f64>) -> InputCovariance {
    let own = all.nrows() - SHARED;
    let place = |input: usize| input.checked_sub(CORE).map_or(input, |moving| own + MOVING[moving] as usize);
    InputCovariance::from_fn(|a, b| all[(place(a), place(b))])
}

impl DiscBlock {
    /// Returns e and J_t/J_n of shot `i`; `None` if its discs do not approach.
    pub(super) fn outcome(&self, i: usize, own: &Own, shared: &Shared) -> Option<[f64; 2]> {
        let paths = self.shots[i].follow(own, shared, &self.discs)?;
        Some(self.shots[i].known(&paths.impact, &self.discs).outcome().map(|value| value.re))
    }

    /// Returns the own unknowns of shot `i` after a step with the e and J_t/J_n that derivatives predict:
    /// the law has corners, which else would throw the discs off their paths.
    pub fn with_even_outcome(
        &self,
        i: usize,
        (own, shared): (&Own, &Shared),
        mut moved: Own,
        shared_after: &Shared,
    ) -> Own {
        let shot = &self.shots[i];
        let paths = shot.follow(own, shared, &self.discs);
        let Some(paths) = paths.filter(|_| shot.flat.is_none() && shot.stuck.is_none()) else {
            return moved;
        };
        let step = Gradient::from_fn(|input, _| match input.checked_sub(CORE) {
            None => moved[input] - own[input],
            Some(moving) => shared_after[MOVING[moving]] - shared[MOVING[moving]],
        });
        let outcome = shot.known(&paths.impact, &self.discs).outcome();
        let predicted = outcome.map(|value| value.re + gradient(&value).dot(&step));
        self.set_outcome(i, &mut moved, shared_after, predicted);
        moved
    }

    /// Sets the offsets of shot `i` so that its discs part with this e and J_t/J_n, as far as they are
    /// unknowns.
    pub(super) fn set_outcome(&self, i: usize, own: &mut Own, shared: &Shared, [e, ratio]: [f64; 2]) {
        let shot = &self.shots[i];
        (own[own::RESTITUTION], own[own::RATIO]) = (0.0, 0.0);
        if shot.stuck.is_some() {
            return;
        }
        let Some([law, _]) = self.outcome(i, own, shared) else { return };
        own[own::RESTITUTION] = e - law;
        let Some([_, law]) = self.outcome(i, own, shared) else { return };
        own[own::RATIO] = if shot.flat.is_some() { 0.0 } else { ratio - law };
    }
}

impl Solution {
    /// Returns J_t/J_n on the second of two discs of a fit of discs that close and slip with these
    /// velocities, m/s.
    pub(crate) fn impulse_ratio(&self, [closing, slip]: [f64; 2]) -> Option<f64> {
        let inertia = self.problem.discs()?.discs.inertia;
        let value = |id: Id| self.value(id);
        let mu = value(Id::Mu) + value(Id::FallB) * (-value(Id::FallC) * slip.abs()).exp();
        let e = value(Id::E) - value(Id::ESlope) * closing;
        law_of([closing, slip, e], mu, value(Id::Kappa), inertia)
    }
}
