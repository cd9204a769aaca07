//! Where a search stopped, and what its Jacobian there determines.

use nalgebra::{DMatrix, DVector};

use crate::likelihood::frames;
use crate::likelihood::whitening::Whitening;
use crate::measurement::dataset::Measured;
use crate::measurement::values::Values;
use crate::numerics::least_squares::{Activity, Constraints};

/// Below this ratio of singular values of the column-scaled Jacobian a combination of parameters
/// is not determined: its standard error would be rounding.
pub(super) const RANK: f64 = 1e-8;

/// Parameters with at least this share in an undetermined direction are named.
const SHARE: f64 = 0.1;

/// An eigenvalue below this is 0: of a few rows of length 1, no smaller one comes of rounding.
const OPEN: f64 = 1e-9;

/// Where the optimiser stopped, in whitened units.
#[derive(Clone)]
pub(crate) struct Minimum {
    /// Of each sample.
    pub values: Vec<Values>,
    pub x: DVector<f64>,
    /// How many of x, behind the free unknowns, are not parameters but what the shots of a data set share.
    pub shared: usize,
    /// Whether frames were fitted.
    pub filmed: bool,
    /// ½χ².
    pub cost: f64,
    /// Of the cost by the free parameters.
    pub gradient: DVector<f64>,
    pub residuals: DVector<f64>,
    pub jacobian: DMatrix<f64>,
    pub active: Vec<Activity>,
    /// The inequalities of `constraints` that hold with equality.
    pub active_inequalities: Vec<usize>,
    pub constraints: Constraints,
    /// Of each shot, all 1 for least squares.
    pub weights: Vec<f64>,
    /// With which it was found, of each sample.
    pub whitening: Vec<Whitening>,
    pub termination: String,
    pub converged: bool,
    pub iterations: usize,
}

impl Minimum {
    /// χ²; where side spins are integrated over ([`super::side_spin`]), the minimum is that of shifted residuals.
    pub(super) fn chi2(&self) -> f64 {
        let shifts = self.whitening.iter().flat_map(|whitening| &whitening.shift).copied();
        let shifts = shifts.chain(std::iter::repeat(0.0));
        self.residuals.iter().zip(shifts).map(|(r, shift)| (r - shift).powi(2)).sum()
    }

    /// How many parameters the equalities leave to be fitted.
    pub(crate) fn room(&self) -> usize {
        let own = self.x.len() - self.shared;
        own - self.constraints.equalities.len().min(own)
    }

    /// The values of a fit of one sample.
    pub(super) fn first(&self) -> &Values {
        &self.values[0]
    }

    /// The cloth's μ_k in a fit of one sample: as fitted, or what is assumed of it.
    pub(super) fn sliding(&self, assumed: Option<Measured>) -> f64 {
        let own = self.x.len() - self.shared;
        match assumed {
            _ if self.filmed => self.x[own],
            Some(Measured { value, sd: Some(sd) }) if self.shared > 0 => value + self.x[own] * sd,
            Some(Measured { value, .. }) => value,
            None => frames::CLOTH[0].0,
        }
    }

    /// μ_r, where it was fitted.
    pub(super) fn rolling(&self) -> Option<f64> {
        self.filmed.then(|| self.x[self.x.len() - self.shared + 1])
    }

    /// Of all columns, within what equalities leave open, from the curvature. `None` if it is singular.
    pub(crate) fn covariance(&self) -> Option<DMatrix<f64>> {
        let columns: Vec<usize> = (0..self.x.len()).collect();
        covariance(&self.jacobian, &columns, &self.ties(false))
    }

    /// The columns, with their weights, of a direction that neither the residuals nor the equalities determine.
    pub(super) fn undetermined(&self) -> Option<Vec<(usize, f64)>> {
        null_direction(&with_ties(&self.jacobian, &self.ties(false)))
    }

    pub(super) fn determines_all(&self) -> bool {
        self.undetermined().is_none()
    }

    /// What constraints hold: the equalities and, if asked for, the inequalities that hold with
    /// equality. A row each.
    pub(crate) fn ties(&self, with_inequalities: bool) -> DMatrix<f64> {
        let Constraints { equalities, inequalities, .. } = &self.constraints;
        let active = if with_inequalities { &self.active_inequalities[..] } else { &[] };
        let rows = equalities.matrix.row_iter().chain(active.iter().map(|i| inequalities.matrix.row(*i)));
        let rows: Vec<_> = rows.map(|row| row.into_owned()).collect();
        if rows.is_empty() { DMatrix::zeros(0, self.jacobian.ncols()) } else { DMatrix::from_rows(&rows) }
    }
}

/// The columns, with their weights, of a direction in which the residuals do not change: one silent
/// column, or a combination. `None` if the Jacobian has full rank.
pub(super) fn null_direction(jacobian: &DMatrix<f64>) -> Option<Vec<(usize, f64)>> {
    if jacobian.ncols() == 0 || jacobian.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let norms: Vec<f64> = jacobian.column_iter().map(|c| c.norm()).collect();
    if let Some(silent) = norms.iter().position(|norm| *norm == 0.0) {
        return Some(vec![(silent, 1.0)]);
    }
    let scaled = DMatrix::from_fn(jacobian.nrows(), jacobian.ncols(), |i, j| jacobian[(i, j)] / norms[j]);
    // R has the singular values of J, and is small
    let svd = scaled.qr().r().svd(false, true);
    let v_t = svd.v_t?;
    let (smallest, value) = svd.singular_values.argmin();
    if value > RANK * svd.singular_values.max() {
        return None;
    }
    let direction = v_t.row(smallest);
    let shares = (0..jacobian.ncols()).map(|j| (j, direction[j] / norms[j]));
    let named = shares.filter(|(j, _)| direction[*j].abs() > SHARE);
    Some(named.collect())
}

/// The Jacobian with what constraints hold as observations that are as good as exact.
fn with_ties(jacobian: &DMatrix<f64>, ties: &DMatrix<f64>) -> DMatrix<f64> {
    /// So much surer than the data.
    const EXACT: f64 = 1e4;
    if ties.nrows() == 0 {
        return jacobian.clone();
    }
    let mut all = DMatrix::zeros(jacobian.nrows() + ties.nrows(), jacobian.ncols());
    all.rows_mut(0, jacobian.nrows()).copy_from(jacobian);
    all.rows_mut(jacobian.nrows(), ties.nrows()).copy_from(&(ties * (EXACT * jacobian.norm())));
    all
}

/// Leverages: squared row norms of Q in J = QR.
pub(super) fn leverages(jacobian: &DMatrix<f64>) -> Vec<f64> {
    if jacobian.ncols() == 0 {
        return vec![0.0; jacobian.nrows()];
    }
    jacobian.clone().qr().q().row_iter().map(|row| row.norm_squared()).collect()
}

/// (JᵀJ)⁻¹ of some columns by QR: R⁻¹R⁻ᵀ, within the directions that the ties leave open.
pub(crate) fn covariance(
    jacobian: &DMatrix<f64>,
    columns: &[usize],
    ties: &DMatrix<f64>,
) -> Option<DMatrix<f64>> {
    let own = jacobian.select_columns(columns);
    if ties.nrows() == 0 {
        let inverse = inverse(&own.qr().r())?;
        return Some(&inverse * inverse.transpose());
    }
    let basis = open_directions(ties, columns);
    let inverse = &basis * inverse(&(own * &basis).qr().r())?;
    Some(&inverse * inverse.transpose())
}

fn inverse(r: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    r.solve_upper_triangular(&DMatrix::identity(r.ncols(), r.ncols()))
}

/// An orthonormal basis of what `ties`·x = 0 leaves of some columns.
pub(crate) fn open_directions(ties: &DMatrix<f64>, columns: &[usize]) -> DMatrix<f64> {
    let count = columns.len();
    let ties = ties.select_columns(columns);
    if ties.iter().all(|a| *a == 0.0) {
        return DMatrix::identity(count, count);
    }
    // eigenvalues of AᵀA of rows of length 1: 0 along what is open
    let rows: Vec<_> =
        ties.row_iter().filter(|row| row.norm() > 0.0).map(|row| row.into_owned() / row.norm()).collect();
    let rows = DMatrix::from_rows(&rows);
    let eigen = (rows.tr_mul(&rows)).symmetric_eigen();
    let open: Vec<usize> = (0..count).filter(|i| eigen.eigenvalues[*i] < OPEN).collect();
    eigen.eigenvectors.select_columns(&open)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_the_silent_and_the_combined() {
        let silent = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 2.0, 0.0, 3.0, 0.0]);
        assert_eq!(null_direction(&silent), Some(vec![(1, 1.0)]));
        // only x₀ + 2x₂ is determined, and x₁
        let combined = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 2.0, 1.0, 5.0, 2.0, 3.0, 1.0, 6.0]);
        let direction = null_direction(&combined).unwrap();
        assert_eq!(direction.iter().map(|(j, _)| *j).collect::<Vec<_>>(), [0, 2]);
        assert!((direction[0].1 / direction[1].1 + 2.0).abs() < 1e-9);
        assert_eq!(null_direction(&DMatrix::identity(3, 3)), None);
    }

    #[test]
    fn leverages_sum_to_the_number_of_parameters() {
        let jacobian = DMatrix::from_fn(7, 2, |i, j| (i as f64).powi(j as i32) + 1.0);
        assert!((leverages(&jacobian).iter().sum::<f64>() - 2.0).abs() < 1e-12);
    }

    /// A straight line a + b x with unit noise: textbook standard errors.
    #[test]
    fn a_straight_line() {
        let x = [0.0, 1.0, 2.0, 3.0];
        let jacobian = DMatrix::from_fn(4, 2, |i, j| if j == 0 { 1.0 } else { x[i] });
        let covariance = covariance(&jacobian, &[0, 1], &DMatrix::zeros(0, 2)).unwrap();
        // var b = 1/Σ(x − x̄)² = 1/5, var a = Σx²/(nΣ(x − x̄)²) = 14/20
        assert!((covariance[(1, 1)] - 0.2).abs() < 1e-14 && (covariance[(0, 0)] - 0.7).abs() < 1e-14);
    }

    /// The same with a = 2b: one parameter b(2 + x), var b = 1/Σ(2 + x)² = 1/54.
    #[test]
    fn an_equality_leaves_one_direction() {
        let jacobian = DMatrix::from_fn(4, 2, |i, j| if j == 0 { 1.0 } else { i as f64 });
        let tie = DMatrix::from_row_slice(1, 2, &[1.0, -2.0]);
        let covariance = covariance(&jacobian, &[0, 1], &tie).unwrap();
        assert!((covariance[(1, 1)] - 1.0 / 54.0).abs() < 1e-14);
        assert!((covariance[(0, 1)] - 2.0 / 54.0).abs() < 1e-14);
    }
}
