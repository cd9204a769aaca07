//! The state of each shot whose spin is not stated exactly: the likeliest given the shared
//! unknowns.

use rayon::prelude::*;

use super::block::FilmBlock;
use super::motion::Approach;
use super::own;
use super::spins::{ShotSpin, States};
use crate::problem::unknowns::{Own, Shared};

/// Fall of χ² by which a sliding ball must be likelier than a rolling one: most cue balls roll.
const ROLL_BONUS: f64 = 9.0;

/// Topspin at which a shot's descent starts in another state, over natural roll: of shots stated as
/// stun, and of others.
const STUN_START: f64 = 0.03;
const SLIDE_START: f64 = 0.3;

/// Fall of χ² by which another state must be likelier than the present one, so that states of equal
/// likelihood do not alternate.
const CHANGE: f64 = 0.1;

/// Steps of a shot's own unknowns until a state is judged, and gain of χ² after which it is.
const STEPS: usize = 12;
const STALL: f64 = 0.01;

/// Chooses for every shot the likeliest of the states that it may be in given the shared unknowns;
/// returns whether one has changed.
pub(crate) fn choose_states(film: &mut FilmBlock, own: &mut [Own], shared: &Shared) -> bool {
    let open: Vec<usize> = (0..film.spins.len()).filter(|i| film.spins[*i].states != States::One).collect();
    let judge = |i: usize| {
        let present = film.spins[i];
        let judged = present.candidates().into_iter().map(|spin| {
            let is_same = spin.bounds == present.bounds && spin.stated.approach == present.stated.approach;
            let mut start = own[i].clone();
            if spin.states == States::Measured || spin.stated.approach == Approach::Rolls {
                start[own::TOPSPIN] = 0.0;
            } else if !is_same {
                let first = if spin.states == States::Signs { STUN_START } else { SLIDE_START };
                let topspin = if spin.bounds[0] < 0.0 { -first } else { spin.bounds[0] + first };
                start[own::TOPSPIN] = topspin - spin.mean(shared);
            }
            let (values, sums) = film.settle(i, &spin, start, (&mut shared.clone(), &[]), (STEPS, STALL));
            let bonus = if spin.stated.approach == Approach::Rolls { ROLL_BONUS } else { 0.0 };
            let inertia = if is_same { CHANGE } else { 0.0 };
            (spin, values, sums.cost - bonus - inertia)
        });
        let best = judged.min_by(|a, b| a.2.total_cmp(&b.2));
        best.map(|(spin, values, _)| (i, spin, values))
    };
    let chosen: Vec<(usize, ShotSpin, Own)> = open.into_par_iter().filter_map(judge).collect();
    let mut changed = false;
    for (i, spin, values) in chosen {
        let old = &mut film.spins[i];
        changed |= old.bounds != spin.bounds || old.stated.approach != spin.stated.approach;
        *old = spin;
        own[i] = values;
    }
    changed
}
