//! Where a search stopped, and what its Jacobian there determines.

use nalgebra::{DMatrix, DVector};

use crate::likelihood::frames;
use crate::likelihood::whitening::Whitening;
use crate::measurement::dataset::Measured;
use crate::measurement::values::Values;
use crate::numerics::least_squares::{Activity, Bounds};

/// Below this ratio of singular values of the column-scaled Jacobian a combination of parameters
/// is not determined: its standard error would be rounding.
pub(super) const RANK: f64 = 1e-8;

/// Parameters with at least this share in an undetermined direction are named.
const SHARE: f64 = 0.1;

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
    pub bounds: Bounds,
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

    /// Returns the number of parameters fitted, without what shots share.
    pub(crate) fn parameters(&self) -> usize {
        self.x.len() - self.shared
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

    /// Returns the covariance of all columns from the curvature; `None` if it is singular.
    pub(crate) fn covariance(&self) -> Option<DMatrix<f64>> {
        covariance(&self.jacobian)
    }

    /// The columns, with their weights, of a direction that the residuals do not determine.
    pub(super) fn undetermined(&self) -> Option<Vec<(usize, f64)>> {
        null_direction(&self.jacobian)
    }

    pub(super) fn determines_all(&self) -> bool {
        self.undetermined().is_none()
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

/// Leverages: squared row norms of Q in J = QR.
pub(super) fn leverages(jacobian: &DMatrix<f64>) -> Vec<f64> {
    if jacobian.ncols() == 0 {
        return vec![0.0; jacobian.nrows()];
    }
    jacobian.clone().qr().q().row_iter().map(|row| row.norm_squared()).collect()
}

/// Returns (JᵀJ)⁻¹ by QR: R⁻¹R⁻ᵀ; `None` if it is singular.
pub(crate) fn covariance(jacobian: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let r = jacobian.clone().qr().r();
    let inverse = r.solve_upper_triangular(&DMatrix::identity(r.ncols(), r.ncols()))?;
    Some(&inverse * inverse.transpose())
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
        let covariance = covariance(&jacobian).unwrap();
        // var b = 1/Σ(x − x̄)² = 1/5, var a = Σx²/(nΣ(x − x̄)²) = 14/20
        assert!((covariance[(1, 1)] - 0.2).abs() < 1e-14 && (covariance[(0, 0)] - 0.7).abs() < 1e-14);
    }
}
