//! The whole problem: samples, and the unknowns that their shots share.

use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use super::block::Block;
use super::discs::block::DiscBlock;
use super::film::filmed::FilmBlock;
use super::film::impact::Contact;
use super::rows::block::RowsBlock;
use super::unknowns::{Id, Mode, Own, SHARED, Shared, Unknown};
use crate::measurement::loss::Loss;

/// Data whose shots share unknowns.
#[derive(Clone)]
pub(crate) struct Sample {
    pub(crate) block: Block,
    /// Column of the problem of each shared unknown, in the order of [`Id`].
    pub(crate) columns: [usize; SHARED],
    /// Samples of the same number have the noises of tables in common.
    pub(crate) noise_of: usize,
}

/// One least-squares problem: samples that may have unknowns in common.
#[derive(Clone)]
pub(crate) struct Problem {
    pub(crate) samples: Vec<Sample>,
    pub(crate) unknowns: Vec<Unknown>,
    /// Number of evaluations of this problem and of the problems made from it.
    pub(crate) evaluations: Arc<AtomicUsize>,
}

/// Values of all unknowns.
#[derive(Clone)]
pub(crate) struct State {
    /// Own unknowns of each shot of each sample.
    pub(crate) own: Vec<Vec<Own>>,
    pub(crate) shared: Shared,
}

impl State {
    /// Returns the state with these values of some shared unknowns, given by their columns.
    pub(crate) fn with(mut self, values: impl IntoIterator<Item = (usize, f64)>) -> Self {
        for (column, value) in values {
            self.shared.0[column] = value;
        }
        self
    }
}

impl Sample {
    /// Returns the shared unknowns of the sample.
    pub(crate) fn gather(&self, shared: &Shared) -> Shared {
        Shared(self.columns.iter().map(|column| shared.0[*column]).collect())
    }
}

/// Defines access to the block of a problem of one sample, if it is of this kind.
macro_rules! block {
    ($kind:ident, $block:ty, $get:ident, $get_mut:ident) => {
        pub fn $get(&self) -> Option<&$block> {
            if let Block::$kind(block) = &self.samples.first()?.block { Some(block) } else { None }
        }

        pub fn $get_mut(&mut self) -> Option<&mut $block> {
            if let Block::$kind(block) = &mut self.samples.first_mut()?.block { Some(block) } else { None }
        }
    };
}

impl Problem {
    block!(Film, FilmBlock, film, film_mut);
    block!(Discs, DiscBlock, discs, discs_mut);
    block!(Rows, RowsBlock, rows, rows_mut);

    /// Returns the problem of one sample; its columns are the shared unknowns in the order of
    /// [`Id`].
    pub(crate) fn of_one(block: Block, unknowns: Vec<Unknown>) -> Self {
        let sample = Sample { block, columns: std::array::from_fn(|column| column), noise_of: 0 };
        Self { samples: vec![sample], unknowns, evaluations: Arc::default() }
    }

    /// Returns the columns of the unknowns that are estimated.
    pub fn free(&self) -> Vec<usize> {
        (0..self.unknowns.len()).filter(|column| self.unknowns[*column].mode == Mode::Free).collect()
    }

    /// Returns the columns of the unknowns that are estimated and not at a bound.
    pub fn inside(&self, state: &State) -> Vec<usize> {
        let at_bound = |column: &usize| self.unknowns[*column].bounds.contains(&state.shared.0[*column]);
        self.free().into_iter().filter(|column| !at_bound(column)).collect()
    }

    /// Returns the columns of an unknown: one, or several if samples have values of their own.
    pub(crate) fn columns_of(&self, id: Id) -> Vec<usize> {
        (0..self.unknowns.len()).filter(|column| self.unknowns[*column].id == id).collect()
    }

    /// Returns an unknown of the first sample.
    pub fn unknown(&self, id: Id) -> &Unknown {
        &self.unknowns[id as usize]
    }

    pub(crate) fn unknown_mut(&mut self, id: Id) -> &mut Unknown {
        &mut self.unknowns[id as usize]
    }

    /// Gives the contacts of all samples the effects that the unknowns have.
    pub(crate) fn refresh_contact(&mut self) {
        let all = &self.unknowns;
        for sample in &mut self.samples {
            let unknowns: Vec<Unknown> = sample.columns.iter().map(|column| all[*column]).collect();
            match &mut sample.block {
                Block::Discs(_) => {}
                Block::Film(film) => film.contact = film.contact.with(&unknowns),
                Block::Rows(rows) => *rows = rows.clone().with_unknowns(&unknowns),
            }
        }
    }

    /// Returns whether outlying shots of a film count less.
    pub(crate) fn is_robust(&self) -> bool {
        self.samples.iter().any(|sample| match &sample.block {
            Block::Film(film) => film.loss.is_some(),
            Block::Rows(rows) => rows.loss != Loss::Squares,
            Block::Discs(_) => false,
        })
    }

    /// Returns whether a sample has what weight and cloth do during the contact.
    pub(crate) fn is_weighed(&self) -> bool {
        self.samples.iter().filter_map(|sample| sample.block.contact()).any(Contact::is_corrected)
    }

    /// Computes what weight and cloth do during the contact for the shots of all samples.
    pub fn weigh(&mut self, state: &State) {
        for (sample, own) in self.samples.iter_mut().zip(&state.own) {
            let shared = sample.gather(&state.shared);
            match &mut sample.block {
                Block::Film(film) => film.weigh(own, &shared),
                Block::Rows(rows) => rows.weigh(own, &shared),
                Block::Discs(_) => {}
            }
        }
    }

    /// Chooses the likeliest of the discrete states that each shot may be in given the shared
    /// unknowns; returns whether one has changed.
    pub(crate) fn choose_states(&mut self, state: &mut State) -> bool {
        let mut changed = false;
        for (sample, own) in self.samples.iter_mut().zip(&mut state.own) {
            let shared = sample.gather(&state.shared);
            if let Block::Film(film) = &mut sample.block {
                changed |= film.choose_states(own, &shared);
            }
        }
        changed
    }

    /// Keeps the shots of a sample for which `keep` is true, here and in `state`.
    pub fn retain(&mut self, sample: usize, state: &mut State, keep: &[bool]) {
        let kept: Vec<usize> = (0..keep.len()).filter(|i| keep[*i]).collect();
        state.own[sample] = kept.iter().map(|i| state.own[sample][*i].clone()).collect();
        self.samples[sample].block.take(&kept);
    }
}

/// Keeps the names of the shots for which `keep` is true; returns the others.
pub(crate) fn split_names(names: &mut Vec<String>, keep: &[bool]) -> Vec<String> {
    let (kept, lost): (Vec<_>, Vec<_>) =
        std::mem::take(names).into_iter().zip(keep).partition(|(_, keep)| **keep);
    *names = kept.into_iter().map(|(name, _)| name).collect();
    lost.into_iter().map(|(name, _)| name).collect()
}
