//! From the Jacobian at the minimum to standard errors, intervals and what is not determined.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use super::robust::Sandwich;
use super::{Estimate, Intervals, Status};
use crate::likelihood::frames;
use crate::likelihood::whitening::Whitening;
use crate::measurement::dataset::Measured;
use crate::measurement::parameter::{Parameter, Settings};
use crate::measurement::values::Values;
use crate::numerics::least_squares::{Activity, Constraints};

/// Below this ratio of singular values of the column-scaled Jacobian a combination of parameters
/// is not determined: its standard error would be rounding.
pub(super) const RANK: f64 = 1e-8;

/// Parameters with at least this share in an undetermined direction are named.
const SHARE: f64 = 0.1;

/// Standard errors with and without a bound are both given when they differ by more than this part.
const WORTH_SAYING: f64 = 0.1;

/// A standard error of less than this part of the value is rounding: an equality holds the parameter.
const FIXED: f64 = 1e-12;

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

    /// Of all columns, within what equalities leave open: from the curvature, or from the scatter of the shots. `None` if it is singular.
    pub(crate) fn covariance(&self, sandwich: Option<&Sandwich>) -> Option<DMatrix<f64>> {
        let columns: Vec<usize> = (0..self.x.len()).collect();
        let ties = self.ties(false);
        match sandwich {
            None => covariance(&self.jacobian, &columns, &ties),
            Some(sandwich) => sandwich.covariance(&columns, &open_directions(&ties, &columns)),
        }
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

pub(super) struct Uncertainty {
    /// In the order of the free parameters.
    pub estimates: Vec<Estimate>,
    /// NaN where there is no standard error.
    pub correlation: DMatrix<f64>,
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

/// Standard errors from (JᵀJ)⁻¹. A parameter at a bound gets a one-sided interval and no error; for
/// the others it counts once as free (`std_error`) and once as exactly at its bound. Without
/// quantiles, where the noise is not known, there are no errors.
pub(super) fn of(
    minimum: &Minimum,
    free: &[Parameter],
    settings: &Settings,
    quantiles: Option<&Quantiles>,
    sandwich: Option<&Sandwich>,
) -> Uncertainty {
    let count = free.len();
    // behind the free parameters there may be errors that the shots share
    let columns = minimum.jacobian.ncols();
    let at_bound: Vec<usize> = (0..count).filter(|i| minimum.active[*i] != Activity::Free).collect();
    let inner: Vec<usize> = (0..columns).filter(|i| !at_bound.contains(i)).collect();
    let all: Vec<usize> = (0..columns).collect();
    let (tied, held) = (minimum.ties(false), minimum.ties(true));
    let covariance = |columns: &[usize], ties: &DMatrix<f64>| match sandwich {
        None => covariance(&minimum.jacobian, columns, ties),
        Some(sandwich) => sandwich.covariance(columns, &open_directions(ties, columns)),
    };
    let released = quantiles.and_then(|_| covariance(&all, &tied));
    let conditional = quantiles.and_then(|_| covariance(&inner, &held));

    let mut estimates: Vec<Estimate> = free
        .iter()
        .enumerate()
        .map(|(i, parameter)| Estimate {
            parameter: *parameter,
            value: minimum.x[i],
            std_error: None,
            interval_95: None,
            intervals: Intervals::default(),
            std_error_at_bound: None,
            status: match minimum.active[i] {
                Activity::Free => Status::Free,
                Activity::AtLower => Status::AtLowerBound,
                Activity::AtUpper => Status::AtUpperBound,
            },
        })
        .collect();
    let mut correlation = DMatrix::from_element(count, count, f64::NAN);
    let (Some(quantiles), Some(released), Some(conditional)) = (quantiles, released, conditional) else {
        return Uncertainty { estimates, correlation };
    };

    // how far the others may follow a parameter off its bound, below and above
    let mut follow = vec![[0.0_f64; 2]; columns];
    for b in &at_bound {
        let mut with_b = inner.clone();
        with_b.push(*b);
        let Some(covariance) = covariance(&with_b, &held) else { continue };
        let last = with_b.len() - 1;
        // the profile of the cost rises as g x + x²/2v from the bound; it has risen by t²/2 at
        // x = v(−g + √(g² + t²/v))
        let (g, v) = (minimum.gradient[*b].abs(), covariance[(last, last)]);
        let reach = v * (-g + (g * g + quantiles.one_sided.powi(2) / v).sqrt());
        let setting = &settings[free[*b]];
        let (value, inward) = match estimates[*b].status {
            Status::AtUpperBound => (setting.upper, -1.0),
            _ => (setting.lower, 1.0),
        };
        let end = (value + inward * reach).clamp(setting.lower, setting.upper);
        estimates[*b].interval_95 = Some([value.min(end), value.max(end)]);
        for (row, i) in inner.iter().enumerate() {
            let shift = inward * reach * covariance[(row, last)] / v;
            follow[*i][usize::from(shift > 0.0)] += shift;
        }
    }
    for (row, i) in inner.iter().enumerate().filter(|(_, i)| **i < count) {
        let (at_bound, released) = (conditional[(row, row)].sqrt(), released[(*i, *i)].sqrt());
        let setting = &settings[free[*i]];
        let value = minimum.x[*i];
        let estimate = &mut estimates[*i];
        if released <= FIXED * value.abs() {
            // an equality leaves it no room
            estimate.status = Status::Fixed;
            continue;
        }
        estimate.std_error = Some(released);
        estimate.std_error_at_bound = (released > (1.0 + WORTH_SAYING) * at_bound).then_some(at_bound);
        let half = quantiles.two_sided * at_bound;
        let [below, above] = follow[*i];
        estimate.interval_95 =
            Some([(value - half + below).max(setting.lower), (value + half + above).min(setting.upper)]);
    }
    for i in inner.iter().filter(|i| **i < count) {
        for j in inner.iter().filter(|j| **j < count) {
            correlation[(*i, *j)] = released[(*i, *j)] / (released[(*i, *i)] * released[(*j, *j)]).sqrt();
        }
    }
    Uncertainty { estimates, correlation }
}

/// Quantiles of the standard error: normal where the noise is stated, Student's t where it was
/// estimated from the residuals.
pub(super) struct Quantiles {
    /// 97.5 %.
    pub two_sided: f64,
    /// 95 %.
    pub one_sided: f64,
}

impl Quantiles {
    /// `None` without degrees of freedom.
    pub(super) fn new(estimated_dof: Option<usize>) -> Option<Self> {
        let pair = |two_sided, one_sided| Self { two_sided, one_sided };
        match estimated_dof {
            None => {
                let normal = Normal::standard();
                Some(pair(normal.inverse_cdf(0.975), normal.inverse_cdf(0.95)))
            }
            Some(dof) => {
                let t = StudentsT::new(0.0, 1.0, dof as f64).ok()?;
                Some(pair(t.inverse_cdf(0.975), t.inverse_cdf(0.95)))
            }
        }
    }
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
