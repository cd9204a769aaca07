//! The elimination of what a shot has of its own from its normal equations.

use nalgebra::{Cholesky, DMatrix, DMatrixView, DVector, Dyn};

use super::sums::Contribution;
use super::unknowns::Id;

/// Own unknowns of a shot after elimination, without those that are held.
pub(crate) struct Eliminated {
    /// Their places among all.
    pub(crate) places: Vec<usize>,
    /// Number of all.
    pub(crate) count: usize,
    /// Their response to the shared unknowns that are free, and in the last column to the residuals.
    pub(super) response: DMatrix<f64>,
    /// Factor of their normal matrix.
    pub(super) factor: Cholesky<f64, Dyn>,
}

impl Eliminated {
    /// Returns the variance at given shared unknowns of a number with these derivatives.
    pub(crate) fn variance(&self, by: &DVector<f64>) -> f64 {
        let by = by.select_rows(&self.places);
        by.dot(&self.factor.solve(&by))
    }
}

/// Velocities of a shot after the impact less the model's: of the cue ball along and across the line
/// of centres, and of the object ball, m/s.
pub(crate) struct Offsets {
    pub(crate) values: DVector<f64>,
    /// Its covariance, the shared unknowns as they are.
    pub(crate) covariance: DMatrix<f64>,
    /// Distance of the values from 0 in their standard deviations.
    pub(crate) distance: f64,
}

impl Contribution {
    /// Eliminates the own unknowns that are not held: takes what they explain away from `left`, the
    /// products by the shared unknowns and the residual, and keeps some columns of their response.
    /// `None` if the shot does not determine one of them.
    pub(crate) fn eliminate(&self, left: &mut DMatrix<f64>, kept: &[usize]) -> Option<Eliminated> {
        let count = self.sums.held.len();
        let places: Vec<usize> = (0..count).filter(|place| !self.sums.held[*place]).collect();
        let own = self.products.select_rows(&places);
        let beside = own.columns_range(count..);
        // products are an upper triangle
        let factor = own.select_columns(&places).transpose().cholesky()?;
        let response = factor.solve(&beside);
        left.gemm(-1.0, &beside.transpose(), &response, 1.0);
        Some(Eliminated { places, count, response: response.select_columns(kept), factor })
    }

    /// Returns the products by the shared unknowns and the residual.
    pub(crate) fn shared_products(&self) -> DMatrixView<'_, f64> {
        let first = self.sums.held.len();
        self.products.view_range(first.., first..)
    }

    /// Returns the normal matrix and the gradient of the own unknowns and some shared ones of the
    /// sample. Held unknowns are decoupled.
    pub fn system(&self, ids: &[Id]) -> (DMatrix<f64>, DVector<f64>) {
        let first = self.sums.held.len();
        let n = first + ids.len();
        let place = |i: usize| if i < first { i } else { first + ids[i - first] as usize };
        let is_held = |i: usize| i < first && self.sums.held[i];
        let matrix = DMatrix::from_fn(n, n, |i, j| {
            let (a, b) = (place(i).min(place(j)), place(i).max(place(j)));
            if is_held(i) || is_held(j) { f64::from(i == j) } else { self.products[(a, b)] }
        });
        let gradient = DVector::from_fn(n, |i, _| if is_held(i) { 0.0 } else { self.slope(place(i)) });
        (matrix, gradient)
    }

    /// Returns the shot's part of the normal matrix and gradient of the shared unknowns `ids` of
    /// its sample, after elimination of its own.
    pub fn reduced(&self, ids: &[Id]) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let mut products = self.shared_products().into_owned();
        self.eliminate(&mut products, &[])?;
        let shared = self.shared();
        let product = |a: Option<usize>, b: Option<usize>| match (a, b) {
            (Some(a), Some(b)) => products[(a.min(b), a.max(b))],
            _ => 0.0,
        };
        let place = |i: usize| Some(ids[i] as usize).filter(|place| *place < shared);
        Some((
            DMatrix::from_fn(ids.len(), ids.len(), |i, j| product(place(i), place(j))),
            DVector::from_fn(ids.len(), |i, _| product(place(i), Some(shared))),
        ))
    }

    /// Returns the outcome offsets of the shot; `None` if its numbers do not determine them.
    pub(crate) fn offsets(&self) -> Option<Offsets> {
        let (information, gradient) = self.reduced(&Id::OFFSETS)?;
        let covariance = information.cholesky()?.inverse();
        let values = -(&covariance * &gradient);
        let distance = (-gradient.dot(&values)).max(0.0).sqrt();
        let is_finite = covariance.iter().chain([&distance]).all(|c| c.is_finite());
        is_finite.then_some(Offsets { values, covariance, distance })
    }
}
