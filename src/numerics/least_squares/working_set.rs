//! The constraints that hold with equality, a_iᵀ z = d_i, as a triangular factorisation a_i = Σ L_ij y_j
//! with orthonormal y_j. A unit vector a_i (a bound) stays one exactly, so the variables that no
//! bound fixes are not disturbed by rounding.
use nalgebra::{DMatrix, DVector};

/// A constraint is dependent on the others when less than this share of it is left after projecting
/// them out: well above rounding, well below any angle meant.
const DEPENDENT: f64 = 1e-10;

#[derive(Clone, Debug)]
pub struct WorkingSet {
    variables: usize,
    members: Vec<usize>,
    directions: Vec<DVector<f64>>,
    coefficients: Vec<Vec<f64>>,
}

impl WorkingSet {
    pub fn new(variables: usize) -> Self {
        Self { variables, members: Vec::new(), directions: Vec::new(), coefficients: Vec::new() }
    }

    /// The numbers of the constraints, in the order they were pushed.
    pub fn members(&self) -> &[usize] {
        &self.members
    }

    /// Adds constraint `member`; returns false, and leaves it out, when it depends on those already in.
    pub fn push(&mut self, member: usize, normal: &DVector<f64>) -> bool {
        let mut rest = normal.clone();
        let mut coefficients = self.project_out(&mut rest);
        let norm = rest.norm();
        if norm <= DEPENDENT * normal.norm() {
            return false;
        }
        coefficients.push(norm);
        self.members.push(member);
        self.directions.push(rest / norm);
        self.coefficients.push(coefficients);
        true
    }

    /// Gram–Schmidt, twice: once loses orthogonality for nearly dependent vectors, twice does not.
    fn project_out(&self, vector: &mut DVector<f64>) -> Vec<f64> {
        let mut coefficients = vec![0.0; self.directions.len()];
        for _ in 0..2 {
            for (coefficient, direction) in coefficients.iter_mut().zip(&self.directions) {
                let share = direction.dot(vector);
                vector.axpy(-share, direction, 1.0);
                *coefficient += share;
            }
        }
        coefficients
    }

    /// An orthonormal basis of the z with a_iᵀ z = 0 for all members, n × (n − k).
    pub fn null_basis(&self) -> DMatrix<f64> {
        let n = self.variables;
        let mut complete = self.clone();
        let mut candidates = DMatrix::<f64>::identity(n, n);
        for direction in &self.directions {
            let shares = candidates.tr_mul(direction);
            candidates.ger(-1.0, direction, &shares, 1.0);
        }
        while complete.directions.len() < n {
            // The unit vector with the largest rest, so that normalising it amplifies no rounding.
            let norms: Vec<f64> = candidates.column_iter().map(|column| column.norm_squared()).collect();
            let best = (0..n).fold(0, |best, j| if norms[j] > norms[best] { j } else { best });
            let mut rest = candidates.column(best).into_owned();
            complete.project_out(&mut rest);
            let direction = rest.normalize();
            let shares = candidates.tr_mul(&direction);
            candidates.ger(-1.0, &direction, &shares, 1.0);
            complete.directions.push(direction);
        }
        let free = &complete.directions[self.directions.len()..];
        DMatrix::from_fn(n, free.len(), |i, j| free[j][i])
    }

    /// The shortest z with a_iᵀ z = d_i, `limits` being the d_i in the order of the members.
    pub fn particular(&self, limits: &[f64]) -> DVector<f64> {
        let mut z = DVector::zeros(self.variables);
        let mut shares: Vec<f64> = Vec::with_capacity(limits.len());
        for ((coefficients, direction), limit) in self.coefficients.iter().zip(&self.directions).zip(limits) {
            let known: f64 = coefficients.iter().zip(&shares).map(|(l, u)| l * u).sum();
            let share = (limit - known) / coefficients[shares.len()];
            z.axpy(share, direction, 1.0);
            shares.push(share);
        }
        z
    }

    /// ν with Σ ν_i a_i = −g on the span of the members, in their order: at a minimum over
    /// a_iᵀ z ≤ d_i every ν_i ≥ 0.
    pub fn multipliers(&self, gradient: &DVector<f64>) -> Vec<f64> {
        let k = self.members.len();
        let mut multipliers: Vec<f64> = self.directions.iter().map(|y| -y.dot(gradient)).collect();
        for i in (0..k).rev() {
            multipliers[i] /= self.coefficients[i][i];
            for j in 0..i {
                multipliers[j] -= self.coefficients[i][j] * multipliers[i];
            }
        }
        multipliers
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::least_squares::testing::ROUNDING;

    fn unit(n: usize, j: usize) -> DVector<f64> {
        DVector::from_fn(n, |i, _| if i == j { 1.0 } else { 0.0 })
    }

    #[test]
    fn bounds_leave_exact_unit_vectors() {
        let mut set = WorkingSet::new(4);
        assert!(set.push(7, &unit(4, 1)));
        assert!(set.push(3, &-unit(4, 3)));
        let basis = set.null_basis();
        assert_eq!(basis, DMatrix::from_columns(&[unit(4, 0), unit(4, 2)]));
        assert_eq!(set.members(), [7, 3]);
        let z = set.particular(&[0.25, 0.5]);
        assert_eq!(z, DVector::from_row_slice(&[0.0, 0.25, 0.0, -0.5]));
    }

    #[test]
    fn dependent_constraints_are_refused() {
        let mut set = WorkingSet::new(2);
        let diagonal = DVector::from_element(2, 1.0);
        assert!(set.push(0, &diagonal));
        assert!(!set.push(1, &(&diagonal * -3.0)));
        assert!(set.push(2, &unit(2, 0)));
        assert!(!set.push(3, &unit(2, 1)));
        assert_eq!(set.null_basis().ncols(), 0);
    }

    #[test]
    fn particular_multipliers_and_basis_satisfy_their_equations() {
        let normals = [
            DVector::from_row_slice(&[1.0, 2.0, -1.0, 0.5]),
            DVector::from_row_slice(&[1.0, 2.0, -1.0, 0.501]),
            DVector::from_row_slice(&[0.0, 1.0, 1.0, 0.0]),
        ];
        let mut set = WorkingSet::new(4);
        for (i, normal) in normals.iter().enumerate() {
            assert!(set.push(i, normal));
        }
        let limits = [0.3, -0.2, 0.7];
        let z = set.particular(&limits);
        let basis = set.null_basis();
        assert_eq!(basis.ncols(), 1);
        let wanted = [1.5, -2.5, 4.0];
        let gradient = -(&normals[0] * wanted[0] + &normals[1] * wanted[1] + &normals[2] * wanted[2]);
        let multipliers = set.multipliers(&gradient);
        for i in 0..3 {
            // The first two normals are within 1e-3 of each other, which costs three digits.
            assert!((normals[i].dot(&z) - limits[i]).abs() < 1e4 * ROUNDING);
            assert!(basis.tr_mul(&normals[i]).norm() < ROUNDING);
            assert!((multipliers[i] - wanted[i]).abs() < 1e4 * ROUNDING);
        }
    }
}
