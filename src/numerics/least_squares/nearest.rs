//! The point of a set nearest to a given one: where a start that violates constraints is moved to.
use nalgebra::{DMatrix, DVector};

use super::active_set;
use super::active_set::{Face, Row};
use super::{Constraints, Linear, qp};

impl Constraints {
    /// The point nearest to `x` that satisfies the constraints, the bounds exactly; `x` itself where it
    /// does. `None` where no point satisfies them all.
    #[must_use]
    pub fn nearest(&self, x: &DVector<f64>) -> Option<DVector<f64>> {
        let clamp =
            |x: &DVector<f64>| DVector::from_fn(x.len(), |j, _| x[j].max(self.lower[j]).min(self.upper[j]));
        let clamped = clamp(x);
        if self.check(&clamped).is_ok() {
            return Some(clamped);
        }
        if self.inequalities.is_empty() && self.equalities.is_empty() {
            return None;
        }
        // z = x − origin with an origin away from the point, so that the objective has a slope there
        let n = x.len();
        let size = 1.0 + clamped.amax();
        let origin = clamped.add_scalar(-size);
        let mut rows = Vec::new();
        let linear = |linear: &Linear, i: usize, face| {
            let normal = linear.matrix.row(i).transpose();
            let norm = normal.norm();
            let limit = (linear.limit[i] - normal.dot(&origin)) / norm;
            Row { normal: normal / norm, limit, face }
        };
        let bound = |j: usize, sign: f64, at: f64, face| {
            let mut normal = DVector::zeros(n);
            normal[j] = sign;
            Row { normal, limit: sign * (at - origin[j]), face }
        };
        let fixed = |j: &usize| self.lower[*j] == self.upper[*j];
        rows.extend((0..n).filter(fixed).map(|j| bound(j, 1.0, self.lower[j], Face::Equality)));
        rows.extend((0..self.equalities.len()).map(|i| linear(&self.equalities, i, Face::Equality)));
        let equalities = rows.len();
        for j in (0..n).filter(|j| !fixed(j)) {
            if self.lower[j].is_finite() {
                rows.push(bound(j, -1.0, self.lower[j], Face::Lower(j)));
            }
            if self.upper[j].is_finite() {
                rows.push(bound(j, 1.0, self.upper[j], Face::Upper(j)));
            }
        }
        rows.extend((0..self.inequalities.len()).map(|i| linear(&self.inequalities, i, Face::Inequality)));
        let (identity, q) = (DMatrix::identity(n, n), &origin - &clamped);
        let guess = qp::solve(&identity, &q, &rows, equalities, size)?;
        let exact = active_set::minimise(&identity, &q, &rows, equalities, guess.z, &guess.active, size);
        let near = clamp(&(origin + exact.z));
        self.check(&near).is_ok().then_some(near)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::least_squares::testing::{ROUNDING, vector};

    /// 0 ≤ x ≤ 1, x₁ ≤ 3x₀.
    fn wedge() -> Constraints {
        let mut wedge = Constraints::bounds(vector(&[0.0, 0.0]), vector(&[1.0, 1.0]));
        wedge.inequalities =
            Linear { matrix: DMatrix::from_row_slice(1, 2, &[-3.0, 1.0]), limit: vector(&[0.0]) };
        wedge
    }

    #[test]
    fn inside_stays_and_outside_goes_to_the_nearest_point() {
        let wedge = wedge();
        for (from, to) in [
            ([0.5, 0.5], [0.5, 0.5]),
            ([2.0, 0.5], [1.0, 0.5]),
            // the foot of the perpendicular on x₁ = 3x₀ is at x₀ = (x₀ + 3x₁)/10
            ([0.05, 0.3], [0.095, 0.285]),
            ([-1.0, -1.0], [0.0, 0.0]),
        ] {
            let near = wedge.nearest(&vector(&from)).unwrap();
            assert!((&near - vector(&to)).amax() < ROUNDING, "{from:?}: {near}");
        }
    }

    #[test]
    fn equalities_hold_and_what_cannot_be_is_none() {
        let mut line = wedge();
        line.equalities =
            Linear { matrix: DMatrix::from_row_slice(1, 2, &[1.0, 1.0]), limit: vector(&[1.0]) };
        let near = line.nearest(&vector(&[0.9, 0.9])).unwrap();
        assert!((near - vector(&[0.5, 0.5])).amax() < ROUNDING);
        // x₀ + x₁ = 1 meets x₁ = 3x₀ at x₀ = 1/4
        let near = line.nearest(&vector(&[0.0, 1.0])).unwrap();
        assert!((near - vector(&[0.25, 0.75])).amax() < ROUNDING);
        line.lower[0] = 0.4;
        line.upper[0] = 0.4;
        assert!((line.nearest(&vector(&[0.9, 0.9])).unwrap() - vector(&[0.4, 0.6])).amax() < ROUNDING);
        line.equalities.limit[0] = 3.0;
        assert_eq!(line.nearest(&vector(&[0.5, 0.5])), None);
    }
}
