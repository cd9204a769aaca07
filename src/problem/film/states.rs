//! The state of each shot whose spin is not stated exactly: the likeliest given the shared
//! unknowns.

use rayon::prelude::*;

use super::block::FilmBlock;
use super::own;
use super::spins::{ShotSpin, States};
use crate::problem::unknowns::{Own, Shared};

/// Decrease of χ² by which a sliding ball must be likelier than a rolling one: most cue balls roll.
const ROLL_BONUS: f64 = 9.0;

/// Topspin at which a shot's descent starts in another state, over natural roll: of shots stated as
/// stun, and of others.
const STUN_START: f64 = 0.03;
const SLIDE_START: f64 = 0.3;

/// Decrease of χ² by which another state must be likelier than the present one, so that states of equal
/// likelihood do not alternate.
const CHANGE: f64 = 0.1;

/// Steps of a shot's own unknowns until a state is judged, and gain of χ² after which it is.
const JUDGED: (usize, f64) = (12, 0.01);

/// A state of a shot with the values of its own unknowns there, and its χ².
struct Judged {
    spin: ShotSpin,
    own: Own,
    cost: f64,
}

impl FilmBlock {
    /// Chooses for every shot the likeliest of the states that it may be in given the shared
    /// unknowns; returns whether one has changed.
    pub fn choose_states(&mut self, own: &mut [Own], shared: &Shared) -> bool {
        let film = &*self;
        let judge = |(i, own): (usize, &Own)| {
            let candidates = film.spins[i].candidates();
            if candidates.len() == 1 {
                return None;
            }
            let judged = candidates.into_iter().map(|spin| film.judge_state(i, spin, own, shared));
            judged.min_by(|a, b| a.cost.total_cmp(&b.cost))
        };
        let best: Vec<Option<Judged>> = own.par_iter().enumerate().map(judge).collect();
        let mut changed = false;
        for (i, best) in best.into_iter().enumerate() {
            let Some(Judged { spin, own: values, .. }) = best else { continue };
            changed |= !spin.is_same_state(&self.spins[i]);
            self.spins[i] = spin;
            own[i] = values;
        }
        changed
    }

    fn judge_state(&self, i: usize, spin: ShotSpin, own: &Own, shared: &Shared) -> Judged {
        let is_same = spin.is_same_state(&self.spins[i]);
        let mut start = own.clone();
        if spin.states == States::Measured || spin.rolls_now() {
            start[own::TOPSPIN] = 0.0;
        } else if !is_same {
            let first = if spin.states == States::Signs { STUN_START } else { SLIDE_START };
            let topspin = if spin.bounds[0] < 0.0 { -first } else { spin.bounds[0] + first };
            start[own::TOPSPIN] = topspin - spin.mean(shared);
        }
        let (own, sums) = self.settle(i, &spin, start, (&mut shared.clone(), &[]), JUDGED);
        let bonus = if spin.rolls_now() { ROLL_BONUS } else { 0.0 };
        let inertia = if is_same { CHANGE } else { 0.0 };
        Judged { spin, own, cost: sums.cost - bonus - inertia }
    }
}
