//! Where the parameters may be: bounds, and linear constraints between them.
use nalgebra::{DMatrix, DVector, RowDVector};

use super::{Activity, OptimiseError};

/// A linear constraint is held to this share of |b| + Σ|a_j x_j|: the rounding of its terms, with room
/// for a start that was itself computed. Bounds are held exactly.
const FEASIBILITY: f64 = 1e-12;

/// The set the parameters stay in: lower ≤ x ≤ upper, A x ≤ b, A x = b. Every point at which the
/// residuals are evaluated lies in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Constraints {
    /// n lower bounds; −∞ for none.
    pub lower: DVector<f64>,
    /// n upper bounds; ∞ for none. Equal to the lower bound fixes the parameter.
    pub upper: DVector<f64>,
    /// The inequalities A x ≤ b.
    pub inequalities: Linear,
    /// The equalities A x = b.
    pub equalities: Linear,
}

/// The rows of A x ≤ b or A x = b.
#[derive(Clone, Debug, PartialEq)]
pub struct Linear {
    /// A, k × n; no row is zero.
    pub matrix: DMatrix<f64>,
    /// The limits b, of length k.
    pub limit: DVector<f64>,
}

impl Linear {
    /// No constraint on `n` parameters.
    #[must_use]
    pub fn none(n: usize) -> Self {
        Self { matrix: DMatrix::zeros(0, n), limit: DVector::zeros(0) }
    }

    /// The number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.limit.len()
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.limit.is_empty()
    }

    /// b_i − a_i x.
    pub(in crate::numerics) fn slack(&self, row: usize, x: &DVector<f64>) -> f64 {
        self.limit[row] - self.matrix.row(row).transpose().dot(x)
    }

    /// What the rounding of its terms may make of a slack of zero.
    pub(in crate::numerics) fn tolerance(&self, row: usize, x: &DVector<f64>) -> f64 {
        let terms: f64 = self.matrix.row(row).iter().zip(x.iter()).map(|(a, x)| (a * x).abs()).sum();
        FEASIBILITY * (self.limit[row].abs() + terms)
    }

    fn check(&self, what: &'static str, n: usize) -> Result<(), OptimiseError> {
        super::expect_length(what, n, self.matrix.ncols())?;
        super::expect_length(what, self.matrix.nrows(), self.limit.len())?;
        let usable =
            |row: RowDVector<f64>| row.iter().all(|a| a.is_finite()) && row.iter().any(|a| *a != 0.0);
        for row in 0..self.len() {
            if !(usable(self.matrix.row(row).into_owned()) && self.limit[row].is_finite()) {
                return Err(OptimiseError::Row { what, row });
            }
        }
        Ok(())
    }
}

impl Constraints {
    /// `n` parameters that may take any value.
    #[must_use]
    pub fn none(n: usize) -> Self {
        Self::bounds(DVector::repeat(n, f64::NEG_INFINITY), DVector::repeat(n, f64::INFINITY))
    }

    /// lower ≤ x ≤ upper. The two are compared only when a minimisation starts.
    #[must_use]
    pub fn bounds(lower: DVector<f64>, upper: DVector<f64>) -> Self {
        let n = lower.len();
        Self { lower, upper, inequalities: Linear::none(n), equalities: Linear::none(n) }
    }

    /// Checks the constraints themselves and that `start` satisfies them.
    pub(in crate::numerics) fn check(&self, start: &DVector<f64>) -> Result<(), OptimiseError> {
        let n = start.len();
        super::expect_length("lower bounds", n, self.lower.len())?;
        super::expect_length("upper bounds", n, self.upper.len())?;
        self.inequalities.check("inequality", n)?;
        self.equalities.check("equality", n)?;
        for index in 0..n {
            let (lower, upper, value) = (self.lower[index], self.upper[index], start[index]);
            // Written so that a NaN fails.
            if !(lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY) {
                return Err(OptimiseError::Bounds { index, lower, upper });
            }
            if !value.is_finite() {
                return Err(OptimiseError::StartNotFinite { index, value });
            }
            if value < lower || value > upper {
                return Err(OptimiseError::StartOutside { index, value, lower, upper });
            }
        }
        for (what, rows, sides) in
            [("inequality", &self.inequalities, 1.0), ("equality", &self.equalities, 2.0)]
        {
            for row in 0..rows.len() {
                let slack = rows.slack(row, start);
                let excess = if sides > 1.0 { slack.abs() } else { -slack };
                if excess > rows.tolerance(row, start) {
                    return Err(OptimiseError::StartViolates { what, row, excess });
                }
            }
        }
        Ok(())
    }

    /// Whether x satisfies the bounds, exactly, and the inequalities, to rounding. Equalities are not
    /// looked at: no step leaves them.
    pub(in crate::numerics) fn allow(&self, x: &DVector<f64>) -> bool {
        let within = (0..x.len()).all(|j| self.lower[j] <= x[j] && x[j] <= self.upper[j]);
        let inequalities = &self.inequalities;
        within && (0..inequalities.len()).all(|i| -inequalities.slack(i, x) <= inequalities.tolerance(i, x))
    }

    /// Where each parameter of x is within its bounds.
    #[must_use]
    pub fn activity(&self, x: &DVector<f64>) -> Vec<Activity> {
        let of = |j: usize| {
            if x[j] == self.lower[j] {
                Activity::AtLower
            } else if x[j] == self.upper[j] {
                Activity::AtUpper
            } else {
                Activity::Free
            }
        };
        (0..x.len()).map(of).collect()
    }

    /// The inequalities that hold with equality at x, to rounding.
    #[must_use]
    pub fn active_inequalities(&self, x: &DVector<f64>) -> Vec<usize> {
        let rows = &self.inequalities;
        (0..rows.len()).filter(|&i| rows.slack(i, x) <= rows.tolerance(i, x)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::least_squares::testing::vector;

    fn triangle() -> Constraints {
        let mut constraints = Constraints::bounds(vector(&[0.0, 0.0]), vector(&[f64::INFINITY; 2]));
        constraints.inequalities =
            Linear { matrix: DMatrix::from_row_slice(1, 2, &[1.0, 1.0]), limit: vector(&[1.0]) };
        constraints
    }

    #[test]
    fn a_start_inside_is_accepted_and_one_outside_named() {
        let triangle = triangle();
        assert!(triangle.check(&vector(&[0.5, 0.5])).is_ok());
        assert!(matches!(
            triangle.check(&vector(&[-1.0, 0.5])),
            Err(OptimiseError::StartOutside { index: 0, .. })
        ));
        assert!(matches!(
            triangle.check(&vector(&[0.5, f64::NAN])),
            Err(OptimiseError::StartNotFinite { index: 1, .. })
        ));
        assert!(matches!(
            triangle.check(&vector(&[0.6, 0.5])),
            Err(OptimiseError::StartViolates { what: "inequality", row: 0, .. })
        ));
        assert!(matches!(triangle.check(&vector(&[0.5])), Err(OptimiseError::Length { .. })));
    }

    #[test]
    fn unusable_constraints_are_named() {
        let start = vector(&[0.0, 0.0]);
        for (lower, upper) in [
            (1.0, -1.0),
            (f64::NAN, 1.0),
            (f64::INFINITY, f64::INFINITY),
            (f64::NEG_INFINITY, f64::NEG_INFINITY),
        ] {
            let bounds = Constraints::bounds(vector(&[-1.0, lower]), vector(&[1.0, upper]));
            assert!(matches!(bounds.check(&start), Err(OptimiseError::Bounds { index: 1, .. })));
        }
        for row in [[0.0, 0.0], [1.0, f64::INFINITY]] {
            let mut constraints = Constraints::none(2);
            constraints.equalities =
                Linear { matrix: DMatrix::from_row_slice(1, 2, &row), limit: vector(&[0.0]) };
            assert!(matches!(
                constraints.check(&start),
                Err(OptimiseError::Row { what: "equality", row: 0 })
            ));
        }
    }

    #[test]
    fn bounds_are_exact_and_rows_hold_to_rounding() {
        let triangle = triangle();
        assert!(triangle.allow(&vector(&[0.3, 0.7 + 1e-15])));
        assert!(!triangle.allow(&vector(&[0.3, 0.7 + 1e-9])));
        assert!(!triangle.allow(&vector(&[-1e-300, 0.5])));
        assert_eq!(triangle.active_inequalities(&vector(&[0.3, 0.7])), [0]);
        assert!(triangle.active_inequalities(&vector(&[0.3, 0.6])).is_empty());
    }
}
