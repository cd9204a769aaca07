//! What was measured: each kind predicts the numbers of its shots from unknowns of their own and
//! those that they share.

use super::film::block::FilmBlock;
use super::film::states::choose_states;
use super::sums::{Contribution, Noise, OwnPrior, Spread};
use super::unknowns::{Own, Shared};

/// The data of one sample.
#[derive(Clone)]
pub(crate) enum Block {
    /// Frames of balls.
    Film(FilmBlock),
}

impl Block {
    /// Returns the sums of shot `i`, what is known of its own unknowns included.
    pub fn contribute(&self, i: usize, own: &Own, shared: &Shared) -> Contribution {
        match self {
            Self::Film(film) => film.contribute(i, own, shared),
        }
    }

    /// Returns values of shot `i` within the bounds of its own unknowns.
    pub fn bounded(&self, i: usize, own: Own, shared: &Shared) -> Own {
        match self {
            Self::Film(film) => film.spins[i].bounded(own, shared),
        }
    }

    /// Returns what is known of own unknowns of shot `i`, each with its place; of all others nothing
    /// is known.
    pub fn own_priors(&self, i: usize) -> Vec<(usize, OwnPrior)> {
        match self {
            Self::Film(film) => film.spins[i].priors().to_vec(),
        }
    }

    /// Returns the noises that are estimated, in the order of the sums of a contribution.
    pub fn noises_mut(&mut self) -> &mut [Noise] {
        match self {
            Self::Film(film) if film.states_noise => &mut [],
            Self::Film(film) => &mut film.world.noise,
        }
    }

    /// Returns the spreads of own unknowns from shot to shot.
    pub fn spreads(&self) -> &[Spread] {
        match self {
            Self::Film(film) => &film.spreads,
        }
    }

    pub fn spreads_mut(&mut self) -> &mut [Spread] {
        match self {
            Self::Film(film) => &mut film.spreads,
        }
    }

    /// Raises the noises for first descents to what first guesses miss the data by.
    pub fn coarsen(&mut self) {
        match self {
            Self::Film(film) => film.coarsen(),
        }
    }

    /// Returns the data with all shots in the other discrete state that they may all be in.
    pub fn in_other_state(&self) -> Option<Self> {
        match self {
            Self::Film(film) => film.all_sliding().map(Self::Film),
        }
    }

    /// Chooses the likeliest of the discrete states that each shot may be in given the shared
    /// unknowns; returns whether one has changed.
    pub fn choose_states(&mut self, own: &mut [Own], shared: &Shared) -> bool {
        match self {
            Self::Film(film) => choose_states(film, own, shared),
        }
    }

    /// Keeps the shots for which `keep` is true.
    pub fn retain(&mut self, keep: &[bool]) {
        match self {
            Self::Film(film) => film.retain(keep),
        }
    }
}
