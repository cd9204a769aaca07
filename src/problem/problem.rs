//! The whole problem: samples, and the unknowns that their shots share. The data of a sample are a
//! block; each kind predicts the numbers of its shots from unknowns of their own and those that they
//! share.

use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use super::discs::block::DiscBlock;
use super::film::filmed::{FilmBlock, ShotAt};
use super::film::impact::Contact;
use super::findings::Finding;
use super::rows::block::RowsBlock;
use super::sums::{Contribution, Variation};
use super::unknowns::{CAMERA, Id, Mode, Own, PHYSICS, SHARED, Shared, Unknown};
use crate::measurement::loss::Loss;

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

    /// Returns values of shot `i` within the bounds of its own unknowns.
    pub fn bounded(&self, i: usize, own: Own) -> Own {
        match self {
            Self::Film(film) => film.shots[i].spin.within(own),
            Self::Discs(_) | Self::Rows(_) => own,
        }
    }

    pub(crate) fn variation(&self) -> &Variation {
        match self {
            Self::Film(film) => &film.variation,
            Self::Discs(discs) => &discs.variation,
            Self::Rows(rows) => &rows.variation,
        }
    }

    pub(crate) fn variation_mut(&mut self) -> &mut Variation {
        match self {
            Self::Film(film) => &mut film.variation,
            Self::Discs(discs) => &mut discs.variation,
            Self::Rows(rows) => &mut rows.variation,
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

    /// Takes shots instead of all; one may be taken several times.
    pub fn take(&mut self, indices: &[usize]) {
        match self {
            Self::Film(film) => film.shots = pick(&film.shots, indices),
            Self::Discs(discs) => discs.take(indices),
            Self::Rows(rows) => rows.shots = pick(&rows.shots, indices),
        }
    }
}

/// Returns some of all items; one may be picked several times.
fn pick<T: Clone>(all: &[T], indices: &[usize]) -> Arc<Vec<T>> {
    Arc::new(indices.iter().map(|i| all[*i].clone()).collect())
}

/// Data whose shots share unknowns.
#[derive(Clone)]
pub(crate) struct Sample {
    pub(crate) block: Block,
    /// Names of its shots.
    pub(crate) names: Arc<Vec<String>>,
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

/// The data of one sample before they are fitted.
#[derive(Clone)]
pub(crate) struct Prepared {
    pub(crate) problem: Problem,
    /// Where the search begins.
    pub(crate) start: State,
    pub(crate) record: Record,
}

/// What is on record about data besides their problem.
#[derive(Clone)]
pub(crate) struct Record {
    /// Findings, in the order in which they were made.
    pub(crate) findings: Vec<Finding>,
    /// Names and reasons of the shots that are not in the data.
    pub(crate) left_out: Vec<(String, String)>,
    /// Metres in a unit of length of the film.
    pub(crate) unit: f64,
    /// Middle of the impacts in the film, in its unit.
    pub(crate) middle: [f64; 2],
}

impl Prepared {
    /// Leaves out the shots for which `keep` is false, and says so.
    pub(crate) fn leave_out(&mut self, keep: &[bool]) {
        let names = self.problem.retain(&mut self.start, keep);
        self.record.findings.push(Finding::LostShots { names });
    }
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

    /// Takes shots instead of all; one may be taken several times.
    pub(crate) fn take(&mut self, indices: &[usize]) {
        self.names = pick(&self.names, indices);
        self.block.take(indices);
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
    pub(crate) fn of_one(block: Block, names: impl Into<Arc<Vec<String>>>, unknowns: Vec<Unknown>) -> Self {
        let columns = std::array::from_fn(|column| column);
        let sample = Sample { block, names: names.into(), columns, noise_of: 0 };
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

    /// Keeps the shots of the only sample for which `keep` is true, here and in `state`; returns
    /// the names of the others.
    pub(crate) fn retain(&mut self, state: &mut State, keep: &[bool]) -> Vec<String> {
        let (kept, lost): (Vec<usize>, Vec<usize>) = (0..keep.len()).partition(|i| keep[*i]);
        let (sample, own) = (&mut self.samples[0], &mut state.own[0]);
        let lost = lost.into_iter().map(|i| sample.names[i].clone()).collect();
        *own = kept.iter().map(|i| own[*i].clone()).collect();
        sample.take(&kept);
        lost
    }
}
