//! The whole problem: normal equations of all shots, priors, and the elimination of what each shot
//! has of its own.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SMatrix};
use rayon::prelude::*;

use super::frames::{BodySums, COLUMNS, Contribution, ShotFrames, World};
use super::spins::ShotSpin;
use super::unknowns::{Id, Mode, Normal, OWN, Own, SHARED, Shared, Unknown};

/// Shared unknowns and the residual.
const BORDERED: usize = SHARED + 1;

/// A film as one least-squares problem.
#[derive(Clone)]
pub(crate) struct Problem {
    pub shots: Arc<Vec<ShotFrames>>,
    /// The spin of each shot.
    pub spins: Vec<ShotSpin>,
    /// Means and spreads from shot to shot, in the order of [`super::spins::Spread`].
    pub spreads: [Normal; 2],
    pub unknowns: [Unknown; SHARED],
    pub world: World,
}

/// Values of all unknowns.
#[derive(Clone)]
pub(crate) struct State {
    pub own: Vec<Own>,
    pub shared: Shared,
}

/// A state, its cost, and the normal equations there.
#[derive(Clone)]
pub(crate) struct Evaluation {
    pub state: State,
    /// χ² with Huber's loss and the priors; infinite if the state describes no collision.
    pub cost: f64,
    /// Sums over the frames of the cue balls and of the object balls.
    pub bodies: [BodySums; 2],
    pub shots: Vec<Contribution>,
    priors: [Option<Normal>; SHARED],
}

/// Normal equations of the shared unknowns after elimination of the own ones.
pub(crate) struct Reduced {
    /// Shared unknowns and the residual.
    products: SMatrix<f64, BORDERED, BORDERED>,
    /// Squares of the weighted residuals and of the priors' pulls before any step.
    squares: f64,
    /// Response of each shot's own unknowns to the shared ones, and in the last column to the
    /// residuals.
    responses: Vec<SMatrix<f64, OWN, BORDERED>>,
    /// Covariance of each shot's own unknowns at given shared ones.
    pub own_covariance: Vec<SMatrix<f64, OWN, OWN>>,
    /// Logarithm of the determinant of the own unknowns' normal matrices.
    pub own_ln_determinant: f64,
}

impl Contribution {
    /// Returns the normal matrix of the own unknowns, its diagonal raised by `damping`, and `N`
    /// columns beside it from `first` on. Held unknowns are decoupled.
    pub fn own_system<const N: usize>(
        &self,
        damping: f64,
        first: usize,
    ) -> (SMatrix<f64, OWN, OWN>, SMatrix<f64, OWN, N>) {
        let mut matrix = SMatrix::<f64, OWN, OWN>::from_fn(|i, j| {
            let held = self.held[i] || self.held[j];
            if held { f64::from(i == j) } else { self.products[(i.min(j), i.max(j))] }
        });
        for i in 0..OWN {
            matrix[(i, i)] *= 1.0 + damping;
        }
        let beside =
            SMatrix::<f64, OWN, N>::from_fn(
                |i, j| {
                    if self.held[i] { 0.0 } else { self.products[(i, first + j)] }
                },
            );
        (matrix, beside)
    }
}

impl Contribution {
    /// Returns the shot's part of the normal matrix and gradient of these shared unknowns, after
    /// elimination of its own.
    pub fn reduced(&self, ids: &[Id]) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let (matrix, beside) = self.own_system::<BORDERED>(0.0, OWN);
        let response = matrix.cholesky()?.solve(&beside);
        let products =
            self.products.fixed_view::<BORDERED, BORDERED>(OWN, OWN) - beside.transpose() * response;
        let of = |i: usize, j: usize| products[(i.min(j), i.max(j))];
        let place = |i: usize| ids[i] as usize;
        Some((
            DMatrix::from_fn(ids.len(), ids.len(), |i, j| of(place(i), place(j))),
            DVector::from_fn(ids.len(), |i, _| of(place(i), SHARED)),
        ))
    }
}

impl Problem {
    /// Returns χ² and the normal equations at `state`.
    pub fn evaluate(&self, state: State) -> Evaluation {
        let contribute = |(i, own): (usize, &Own)| {
            let spin = &self.spins[i];
            let mut sums = self.shots[i].contribute(own, &state.shared, &spin.stated, &self.world);
            spin.constrain(own, &state.shared, &self.spreads, &mut sums);
            sums
        };
        let shots: Vec<Contribution> = state.own.par_iter().enumerate().map(contribute).collect();
        let priors = self.unknowns.map(|unknown| unknown.active_prior());
        let pulls = priors.iter().zip(state.shared.0).filter_map(|(prior, x)| prior.map(|p| p.pull(x)));
        let cost =
            shots.iter().map(|shot| shot.cost).sum::<f64>() + pulls.map(|pull| pull * pull).sum::<f64>();
        let mut bodies = [BodySums::default(); 2];
        for (sum, i) in bodies.iter_mut().zip(0..) {
            for shot in &shots {
                let of_shot: &BodySums = &shot.bodies[i];
                sum.weighted += of_shot.weighted;
                sum.lagged += of_shot.lagged;
                sum.square += of_shot.square;
                sum.count += of_shot.count;
                sum.ln_determinant += of_shot.ln_determinant;
            }
        }
        let cost = if cost.is_finite() { cost } else { f64::INFINITY };
        Evaluation { state, cost, bodies, shots, priors }
    }

    /// Returns the unknowns that are estimated.
    pub fn free(&self) -> Vec<Id> {
        self.unknowns.iter().filter(|unknown| unknown.mode == Mode::Free).map(|unknown| unknown.id).collect()
    }

    pub fn unknown(&self, id: Id) -> &Unknown {
        &self.unknowns[id as usize]
    }

    pub fn unknown_mut(&mut self, id: Id) -> &mut Unknown {
        &mut self.unknowns[id as usize]
    }

    /// Keeps the shots for which `keep` is true, here and in `state`.
    pub fn retain(&mut self, state: &mut State, keep: &[bool]) {
        let kept = |i: &usize| keep.get(*i).copied().unwrap_or(true);
        let indices: Vec<usize> = (0..self.shots.len()).filter(kept).collect();
        self.shots = Arc::new(indices.iter().map(|i| self.shots[*i].clone()).collect());
        self.spins = indices.iter().map(|i| self.spins[*i]).collect();
        state.own = indices.iter().map(|i| state.own[*i]).collect();
    }
}

impl Evaluation {
    /// Eliminates the own unknowns, their diagonals and those of the shared ones raised by
    /// `damping`. `None` if a shot does not determine one of its unknowns.
    pub fn eliminate(&self, damping: f64) -> Option<Reduced> {
        let mut products = SMatrix::<f64, BORDERED, BORDERED>::zeros();
        let mut squares = 0.0;
        let mut responses = Vec::with_capacity(self.shots.len());
        let mut own_covariance = Vec::with_capacity(self.shots.len());
        let mut own_ln_determinant = 0.0;
        for shot in &self.shots {
            let (matrix, beside) = shot.own_system::<BORDERED>(damping, OWN);
            let cholesky = matrix.cholesky()?;
            let response = cholesky.solve(&beside);
            products +=
                shot.products.fixed_view::<BORDERED, BORDERED>(OWN, OWN) - beside.transpose() * response;
            squares += shot.products[(COLUMNS - 1, COLUMNS - 1)];
            responses.push(response);
            own_covariance.push(cholesky.inverse());
            own_ln_determinant += 2.0 * cholesky.l_dirty().diagonal().iter().map(|l| l.ln()).sum::<f64>();
        }
        for (i, prior) in self.priors.iter().enumerate() {
            if let Some(normal) = prior {
                let pull = normal.pull(self.state.shared.0[i]);
                products[(i, i)] += normal.sd.powi(-2);
                products[(i, SHARED)] += pull / normal.sd;
                products[(SHARED, SHARED)] += pull * pull;
                squares += pull * pull;
            }
        }
        for i in 0..SHARED {
            products[(i, i)] *= 1.0 + damping;
        }
        let is_finite = products.iter().all(|x| x.is_finite());
        is_finite.then_some(Reduced { products, squares, responses, own_covariance, own_ln_determinant })
    }
}

impl Reduced {
    /// Returns whether χ² depends on an unknown: friction has no part in contacts that all stick.
    pub fn informs(&self, id: Id) -> bool {
        self.products[(id as usize, id as usize)] > 0.0
    }

    /// Returns half of d²χ²/dx² of these unknowns.
    pub fn matrix(&self, ids: &[Id]) -> DMatrix<f64> {
        DMatrix::from_fn(ids.len(), ids.len(), |i, j| {
            let (i, j) = (ids[i] as usize, ids[j] as usize);
            self.products[(i.min(j), i.max(j))]
        })
    }

    /// Returns half of dχ²/dx of these unknowns.
    pub fn gradient(&self, ids: &[Id]) -> DVector<f64> {
        DVector::from_fn(ids.len(), |i, _| self.products[(ids[i] as usize, SHARED)])
    }

    /// Returns the fall of a quadratic χ² with a step of these unknowns that the own ones follow.
    pub fn promise(&self, ids: &[Id], step: &DVector<f64>) -> f64 {
        let shared = 2.0 * self.gradient(ids).dot(step) + step.dot(&(self.matrix(ids) * step));
        self.squares - self.products[(SHARED, SHARED)] - shared
    }

    /// Returns the least value of a quadratic χ² over these unknowns and all own ones, and the
    /// logarithm of the determinant of their normal matrix.
    pub fn least(&self, ids: &[Id]) -> Option<(f64, f64)> {
        let cholesky = self.matrix(ids).cholesky()?;
        let gradient = self.gradient(ids);
        let least = self.products[(SHARED, SHARED)] - gradient.dot(&cholesky.solve(&gradient));
        let of_shared = 2.0 * cholesky.l_dirty().diagonal().iter().map(|l| l.ln()).sum::<f64>();
        Some((least, self.own_ln_determinant + of_shared))
    }

    /// Returns the derivatives of own unknown `place` of shot `i` by these shared unknowns.
    pub fn response(&self, i: usize, place: usize, ids: &[Id]) -> DVector<f64> {
        DVector::from_fn(ids.len(), |j, _| -self.responses[i][(place, ids[j] as usize)])
    }

    /// Returns the state after a step of these unknowns, the own ones following.
    pub fn step(
        &self,
        problem: &Problem,
        from: &State,
        ids: &[Id],
        by: &DVector<f64>,
        with_residuals: bool,
    ) -> State {
        let mut state = from.clone();
        for (id, by) in ids.iter().zip(by.iter()) {
            state.shared[*id] += by;
        }
        for (i, (own, response)) in state.own.iter_mut().zip(&self.responses).enumerate() {
            for (id, by) in ids.iter().zip(by.iter()) {
                *own -= response.column(*id as usize) * *by;
            }
            if with_residuals {
                *own -= response.column(SHARED);
            }
            *own = problem.spins[i].bounded(*own, &state.shared);
        }
        state
    }
}
