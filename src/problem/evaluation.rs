//! χ² and the normal equations of a problem at a state, with the elimination of what each shot has
//! of its own.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::eliminated::Eliminated;
use super::problem::{Problem, State};
use super::sums::{Contribution, NoiseSums, ShotSums};
use super::unknowns::{Mode, Own, SHARED};

/// A state, its cost, and the normal equations there.
#[derive(Clone)]
pub(crate) struct Evaluation {
    pub(crate) state: State,
    /// χ² with Huber's loss and the priors; infinite if the state describes no collision.
    pub(crate) cost: f64,
    /// Sums of each shot of each sample.
    pub(crate) shots: Arc<Vec<Vec<ShotSums>>>,
    /// Squares of the derivatives by each unknown, added up over all numbers.
    pub(super) slopes: DVector<f64>,
    /// `None` if a shot does not determine one of its own unknowns.
    pub(super) reduced: Option<Arc<Reduced>>,
}

/// Most batches that the shots of a sample are added up in, and least number of shots of one. Batches
/// do not depend on the number of cores, so that roundings do not either.
const BATCHES: usize = 256;
const MIN_BATCH: usize = 4;

/// Normal equations of some shots of a sample.
struct Batch {
    shots: Vec<ShotSums>,
    /// `None` for a shot that does not determine one of its unknowns.
    own: Vec<Option<Eliminated>>,
    /// Squares of the derivatives by the shared unknowns, and of the residuals.
    squares: DVector<f64>,
    /// JᵀJ by the shared unknowns, and the residual as the last column (upper triangle), after
    /// elimination of the own unknowns.
    reduced: DMatrix<f64>,
}

impl Batch {
    /// Adds up the contributions of shots, which depend on `width` − 1 shared unknowns; of the
    /// responses to these and to the residuals keeps the columns `kept`.
    fn of(contributions: impl Iterator<Item = Contribution>, width: usize, kept: &[usize]) -> Self {
        let (squares, reduced) = (DVector::zeros(width), DMatrix::zeros(width, width));
        let mut batch = Self { shots: Vec::new(), own: Vec::new(), squares, reduced };
        for shot in contributions {
            batch.squares += shot.shared_products().diagonal();
            batch.reduced += shot.shared_products();
            batch.own.push(shot.eliminate(&mut batch.reduced, kept));
            batch.shots.push(shot.sums);
        }
        batch
    }
}

/// Normal equations of the shared unknowns after elimination of the own ones.
pub(crate) struct Reduced {
    /// Shared unknowns and the residual.
    products: DMatrix<f64>,
    /// Squares of the weighted residuals and of the priors' pulls before any step.
    squares: f64,
    pub(crate) own: Vec<Vec<Eliminated>>,
    /// Logarithm of the determinant of the own unknowns' normal matrices.
    pub(crate) own_ln_determinant: f64,
    pub(crate) columns: Vec<[usize; SHARED]>,
    /// Columns of the problem that those of a response are: of each sample the unknowns that are free,
    /// and the residual.
    pub(super) kept: Vec<Vec<usize>>,
}

impl Problem {
    /// Returns the contribution of shot `i` of a sample at a state.
    pub(crate) fn contribute(&self, state: &State, (number, i): (usize, usize)) -> Contribution {
        let sample = &self.samples[number];
        sample.block.contribute(i, &state.own[number][i], &sample.gather(&state.shared))
    }

    /// Returns χ² and the normal equations at `state`.
    pub fn evaluate(&self, state: State) -> Evaluation {
        self.evaluations.fetch_add(1, Ordering::Relaxed);
        let last = self.unknowns.len();
        let mut slopes = DVector::zeros(last + 1);
        let mut products = DMatrix::zeros(last + 1, last + 1);
        let (mut all, mut own, mut all_kept) = (Vec::new(), Vec::new(), Vec::new());
        for (sample, values) in self.samples.iter().zip(&state.own) {
            let shared = sample.gather(&state.shared);
            let width = sample.block.shared() + 1;
            let place = |i: usize| if i + 1 == width { last } else { sample.columns[i] };
            let is_kept = |i: &usize| self.unknowns.get(place(*i)).is_none_or(|of| of.mode == Mode::Free);
            let kept: Vec<usize> = (0..width).filter(is_kept).collect();
            let size = values.len().div_ceil(BATCHES).max(MIN_BATCH);
            let add_up = |(batch, values): (usize, &[Own])| {
                let shots = values.iter().zip(size * batch..);
                Batch::of(shots.map(|(own, i)| sample.block.contribute(i, own, &shared)), width, &kept)
            };
            let batches: Vec<Batch> = values.par_chunks(size).enumerate().map(add_up).collect();
            let (mut sums, mut eliminated) = (Vec::new(), Vec::new());
            for batch in batches {
                for j in 0..width {
                    slopes[place(j)] += batch.squares[j];
                    for i in 0..=j {
                        let (a, b) = (place(i).min(place(j)), place(i).max(place(j)));
                        products[(a, b)] += batch.reduced[(i, j)];
                    }
                }
                sums.extend(batch.shots);
                eliminated.extend(batch.own);
            }
            all.push(sums);
            all_kept.push(kept.into_iter().map(place).collect());
            own.push(eliminated.into_iter().collect::<Option<Vec<Eliminated>>>());
        }
        let mut squares = slopes[last];
        let mut cost = all.iter().flatten().map(|shot: &ShotSums| shot.cost).sum::<f64>();
        for (i, (unknown, x)) in self.unknowns.iter().zip(&state.shared.0).enumerate() {
            let Some(normal) = unknown.active_prior() else { continue };
            let pull = normal.pull(*x);
            products[(i, i)] += normal.sd.powi(-2);
            products[(i, last)] += pull / normal.sd;
            products[(last, last)] += pull * pull;
            squares += pull * pull;
            cost += pull * pull;
        }
        let is_finite = products.iter().all(|x: &f64| x.is_finite());
        let own: Option<Vec<_>> = own.into_iter().collect();
        let reduced = own.filter(|_| is_finite).map(|own| {
            let ln_determinants = own.iter().flatten().map(|own| own.factor.ln_determinant());
            let columns = self.samples.iter().map(|sample| sample.columns).collect();
            let (own_ln_determinant, kept) = (ln_determinants.sum(), all_kept);
            Arc::new(Reduced { products, squares, own, own_ln_determinant, columns, kept })
        });
        let cost = if cost.is_finite() { cost } else { f64::INFINITY };
        Evaluation { state, cost, shots: Arc::new(all), slopes, reduced }
    }

    /// Computes again what weight and cloth do during the contact if a sample has it.
    pub(crate) fn weigh_again(&mut self, at: &mut Evaluation) {
        if self.is_weighed() {
            self.weigh(&at.state);
            *at = self.evaluate(at.state.clone());
        }
    }
}

impl Evaluation {
    /// Returns the number of shots whose contact sticks.
    pub(crate) fn count_sticking(&self) -> usize {
        self.shots.iter().flatten().filter(|shot| shot.sticks).count()
    }

    /// Returns the sums of each noise of a sample over its shots.
    pub(crate) fn noises(&self, sample: usize) -> Vec<NoiseSums> {
        let mut shots = self.shots[sample].iter();
        let Some(first) = shots.next() else { return Vec::new() };
        let mut sums = first.noises.clone();
        for shot in shots {
            for (sum, of_shot) in sums.iter_mut().zip(&shot.noises) {
                sum.add(of_shot);
            }
        }
        sums
    }

    /// Returns whether a number depends on the shared unknown of this column.
    pub(crate) fn slopes_by(&self, column: usize) -> bool {
        self.slopes[column] > 0.0
    }

    /// Returns the normal equations after elimination of the own unknowns; `None` if a shot does not
    /// determine one of its own.
    pub(crate) fn reduced(&self) -> Option<&Reduced> {
        self.reduced.as_deref()
    }
}

impl Reduced {
    fn last(&self) -> usize {
        self.products.ncols() - 1
    }

    /// Returns whether χ² depends on an unknown: friction has no part in contacts that all stick.
    pub(crate) fn informs(&self, column: usize) -> bool {
        self.products[(column, column)] > 0.0
    }

    /// Returns half of d²χ²/dx² with respect to the unknowns `columns`.
    pub fn matrix(&self, columns: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(columns.len(), columns.len(), |i, j| {
            let (i, j) = (columns[i], columns[j]);
            self.products[(i.min(j), i.max(j))]
        })
    }

    /// Returns half of dχ²/dx with respect to the unknowns `columns`.
    pub fn gradient(&self, columns: &[usize]) -> DVector<f64> {
        DVector::from_fn(columns.len(), |i, _| self.products[(columns[i], self.last())])
    }

    /// Returns the decrease of a quadratic χ² with a step of the unknowns `columns` that the own
    /// ones follow, these by the part `follow` of their way to the minimum.
    pub fn promise(&self, columns: &[usize], step: &DVector<f64>, follow: f64) -> f64 {
        let shared = 2.0 * self.gradient(columns).dot(step) + step.dot(&(self.matrix(columns) * step));
        let own = self.squares - self.products[(self.last(), self.last())];
        follow * (2.0 - follow) * own - shared
    }

    /// Returns the state after a step of the unknowns `columns`, the own ones following by a part of
    /// their way to the minimum.
    pub fn step(
        &self,
        problem: &Problem,
        from: &State,
        (columns, by): (&[usize], &DVector<f64>),
        follow: f64,
    ) -> State {
        let mut state = from.clone();
        for (column, by) in columns.iter().zip(by.iter()) {
            state.shared.0[*column] += by;
        }
        for (s, sample) in problem.samples.iter().enumerate() {
            // the step in the order of a response
            let step_of = |column: &usize| {
                let place = columns.iter().position(|other| other == column);
                if *column == self.last() { follow } else { place.map_or(0.0, |j| by[j]) }
            };
            let step = DVector::from_iterator(self.kept[s].len(), self.kept[s].iter().map(step_of));
            state.own[s].par_iter_mut().enumerate().for_each(|(i, own)| {
                let eliminated = &self.own[s][i];
                let mut moved = own.clone();
                for (place, by) in eliminated.places.iter().zip(&(&eliminated.response * &step)) {
                    moved[*place] -= by;
                }
                *own = sample.block.bounded(i, moved);
            });
        }
        state
    }
}
