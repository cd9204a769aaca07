//! Measurements as blocks: each kind predicts the numbers of its shots from unknowns of their own
//! and those that they share.

use std::sync::Arc;

use super::discs::block::DiscBlock;
use super::film::filmed::{FilmBlock, ShotAt};
use super::film::impact::Contact;
use super::rows::block::RowsBlock;
use super::sums::{Contribution, Noise, Spread};
use super::unknowns::{CAMERA, Own, PHYSICS, SHARED, Shared};

/// The data of one sample.
#[derive(Clone)]
pub(crate) enum Block {
    Film(FilmBlock),
    Discs(DiscBlock),
    Rows(RowsBlock),
}

impl Block {
    /// Returns the sums of shot `i`, what is known of its own unknowns included.
    pub(crate) fn contribute(&self, i: usize, own: &Own, shared: &Shared) -> Contribution {
        match self {
            Self::Film(film) => ShotAt { film, shot: &film.shots[i], own, shared }.contribute(),
            Self::Discs(discs) => discs.contribute(i, own, shared),
            Self::Rows(rows) => rows.contribute(i, own, shared),
        }
    }

    /// Returns the number of shared unknowns that shots may depend on, the first of the sample.
    pub(crate) fn shared(&self) -> usize {
        match self {
            Self::Film(_) => PHYSICS + CAMERA,
            Self::Discs(_) => SHARED,
            Self::Rows(rows) => rows.width,
        }
    }

    /// Returns values of shot `i` after a step, within the bounds of its own unknowns.
    pub fn bounded(&self, i: usize, from: &Own, own: Own) -> Own {
        match self {
            Self::Film(film) => film.shots[i].spin.bounded(from, own),
            Self::Discs(_) | Self::Rows(_) => own,
        }
    }

    pub(crate) fn noises_mut(&mut self) -> &mut [Noise] {
        match self {
            Self::Film(film) => &mut film.noise,
            Self::Discs(discs) => &mut discs.noise,
            Self::Rows(rows) => &mut rows.noises,
        }
    }

    /// Returns the noises, in the order of the sums of a contribution.
    pub(crate) fn noises(&self) -> &[Noise] {
        match self {
            Self::Film(film) => &film.noise,
            Self::Discs(discs) => &discs.noise,
            Self::Rows(rows) => &rows.noises,
        }
    }

    /// Returns whether noises are estimated from the residuals.
    pub(crate) fn estimates_noise(&self) -> bool {
        match self {
            Self::Film(film) => !film.states_noise,
            // what the law leaves is scatter of the shots
            Self::Discs(discs) => !discs.has_law,
            Self::Rows(rows) => !rows.noises.is_empty(),
        }
    }

    /// Returns the model of the impact; `None` of discs, whose shots scatter about a law.
    pub(crate) fn contact(&self) -> Option<&Contact> {
        match self {
            Self::Film(film) => Some(&film.contact),
            Self::Discs(_) => None,
            Self::Rows(rows) => Some(&rows.contact),
        }
    }

    /// Returns how many shots have what weight and cloth do during the contact.
    pub(crate) fn count_corrected(&self) -> usize {
        match self {
            Self::Film(film) => film.shots.iter().filter(|shot| shot.correction.is_some()).count(),
            Self::Discs(_) => 0,
            Self::Rows(rows) => rows.shots.iter().filter(|shot| shot.offset.is_some()).count(),
        }
    }

    /// Returns the spreads of own unknowns from shot to shot.
    pub(crate) fn spreads(&self) -> &[Spread] {
        match self {
            Self::Film(film) => &film.spreads,
            Self::Discs(discs) => &discs.spreads,
            Self::Rows(_) => &[],
        }
    }

    pub(crate) fn spreads_mut(&mut self) -> &mut [Spread] {
        match self {
            Self::Film(film) => &mut film.spreads,
            Self::Discs(discs) => &mut discs.spreads,
            Self::Rows(_) => &mut [],
        }
    }

    /// Takes shots instead of all; one may be taken several times.
    pub fn take(&mut self, indices: &[usize]) {
        match self {
            Self::Film(film) => {
                film.shots = Arc::new(indices.iter().map(|i| film.shots[*i].clone()).collect());
            }
            Self::Discs(discs) => discs.take(indices),
            Self::Rows(rows) => rows.take(indices),
        }
    }
}
