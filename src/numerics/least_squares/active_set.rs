//! Linear least squares with linear constraints, exact to rounding: a primal active-set method that
//! starts from what Clarabel suggests and so mostly has nothing left to change.
use nalgebra::{DMatrix, DVector};

use super::linear_algebra::basic_solution;
use super::working_set::WorkingSet;

/// A constraint is met when it is exceeded by no more than this share of the size of the step.
const FEASIBILITY: f64 = 1e-13;

/// A multiplier counts as negative below −this · ‖q‖, the rounding of Aᵀ(A z + q) for columns of A of
/// norm up to 1.
const MULTIPLIER: f64 = 1e-14;

/// Each constraint enters and leaves a few times at most, unless rounding makes it cycle.
const CHANGES_PER_ROW: usize = 5;

/// aᵀ z ≤ d, or = d for the equalities, which come first in every list.
#[derive(Clone, Debug)]
pub struct Row {
    /// a, of norm 1.
    pub normal: DVector<f64>,
    /// d.
    pub limit: f64,
    /// What it stands for.
    pub face: Face,
}

/// What a [`Row`] stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// A parameter with equal bounds, or an equality between parameters.
    Equality,
    /// The lower bound of a parameter.
    Lower(usize),
    /// The upper bound of a parameter.
    Upper(usize),
    /// An inequality between parameters.
    Inequality,
    /// The edge of the region in which the linear model is trusted.
    Radius,
}

/// A feasible z, and the rows that hold there with equality.
#[derive(Clone, Debug)]
pub struct Active {
    pub z: DVector<f64>,
    pub members: Vec<usize>,
}

/// min ½‖A z + q‖² over the rows, the first `equalities` of which are equalities. `start` is a point
/// that satisfies them about, `guess` the rows that may be active at the minimum; a good guess saves
/// time and changes nothing else. `size` is the size of the steps meant.
pub fn minimise(
    a: &DMatrix<f64>,
    q: &DVector<f64>,
    rows: &[Row],
    equalities: usize,
    start: DVector<f64>,
    guess: &[usize],
    size: f64,
) -> Active {
    let mut set = WorkingSet::new(a.ncols());
    for i in (0..equalities).chain(guess.iter().copied()) {
        set.push(i, &rows[i].normal);
    }
    let mut z = start;
    for _ in 0..=CHANGES_PER_ROW * rows.len() {
        let target = minimise_on(a, q, rows, &set);
        if let Some((fraction, blocking)) = first_blocking(rows, &set, &z, &target, FEASIBILITY * size) {
            z += (target - &z) * fraction;
            set.push(blocking, &rows[blocking].normal);
            continue;
        }
        z = target;
        // ∇ = Aᵀ(A z + q) = −Σ ν_i a_i.
        let multipliers = set.multipliers(&a.tr_mul(&(a * &z + q)));
        let worst = (0..multipliers.len())
            .filter(|&k| set.members()[k] >= equalities)
            .min_by(|&k, &l| multipliers[k].total_cmp(&multipliers[l]));
        match worst {
            Some(k) if multipliers[k] < -MULTIPLIER * q.norm() => {
                let kept: Vec<usize> =
                    set.members().iter().copied().filter(|&i| i != set.members()[k]).collect();
                set = WorkingSet::new(a.ncols());
                for i in kept {
                    set.push(i, &rows[i].normal);
                }
            }
            _ => break,
        }
    }
    Active { z, members: set.members().to_vec() }
}

/// The minimum where the rows of `set` hold with equality, by QR on what they leave free.
pub fn minimise_on(a: &DMatrix<f64>, q: &DVector<f64>, rows: &[Row], set: &WorkingSet) -> DVector<f64> {
    let limits: Vec<f64> = set.members().iter().map(|&i| rows[i].limit).collect();
    let particular = set.particular(&limits);
    let basis = set.null_basis();
    // z = p + N y:  min ½‖A N y + (q + A p)‖².
    let (y, _) = basic_solution(&(a * &basis), &(q + a * &particular));
    particular + basis * y
}

/// Of the rows that `target` exceeds the one met first on the way there from z, and at what fraction of it.
fn first_blocking(
    rows: &[Row],
    set: &WorkingSet,
    z: &DVector<f64>,
    target: &DVector<f64>,
    tolerance: f64,
) -> Option<(f64, usize)> {
    let mut first: Option<(f64, usize)> = None;
    for (i, row) in rows.iter().enumerate().filter(|(i, _)| !set.members().contains(i)) {
        let (here, there) = (row.normal.dot(z), row.normal.dot(target));
        if there <= row.limit + tolerance {
            continue;
        }
        let fraction = if there > here { ((row.limit - here) / (there - here)).clamp(0.0, 1.0) } else { 0.0 };
        if first.is_none_or(|(smallest, _)| fraction < smallest) {
            first = Some((fraction, i));
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::least_squares::testing::{ROUNDING, vector};

    fn row(normal: &[f64], limit: f64) -> Row {
        let normal = vector(normal);
        let norm = normal.norm();
        Row { normal: normal / norm, limit: limit / norm, face: Face::Inequality }
    }

    /// z ≥ 0, z_1 + z_2 ≤ 1.
    fn simplex() -> Vec<Row> {
        vec![row(&[1.0, 1.0], 1.0), row(&[-1.0, 0.0], 0.0), row(&[0.0, -1.0], 0.0)]
    }

    #[test]
    fn projections_onto_a_simplex_from_every_guess() {
        let cases = [
            ([0.2, 0.3], [0.2, 0.3]),
            ([2.0, 2.0], [0.5, 0.5]),
            ([0.8, 0.6], [0.6, 0.4]),
            ([5.0, 0.1], [1.0, 0.0]),
            ([-1.0, -2.0], [0.0, 0.0]),
            ([-1.0, 0.4], [0.0, 0.4]),
        ];
        for (point, nearest) in cases {
            for guess in [vec![], vec![0], vec![1, 0], vec![2], vec![1, 2], vec![2, 0, 1]] {
                let identity = DMatrix::identity(2, 2);
                let start = DVector::zeros(2);
                let found = minimise(&identity, &-vector(&point), &simplex(), 0, start, &guess, 1.0);
                assert!((found.z - vector(&nearest)).norm() < ROUNDING, "{point:?} from {guess:?}");
            }
        }
    }

    #[test]
    fn an_equality_is_kept_whatever_its_multiplier() {
        let mut rows = simplex();
        rows[0].limit *= 0.5;
        let found = minimise(
            &DMatrix::identity(2, 2),
            &vector(&[-0.1, -0.1]),
            &rows,
            1,
            vector(&[0.25, 0.25]),
            &[],
            1.0,
        );
        assert!((found.z - vector(&[0.25, 0.25])).norm() < ROUNDING);
        assert_eq!(found.members, [0]);
    }

    #[test]
    fn a_start_slightly_outside_is_brought_back() {
        let start = vector(&[-1e-9, 0.4]);
        let found = minimise(&DMatrix::identity(2, 2), &vector(&[1.0, -0.4]), &simplex(), 0, start, &[], 1.0);
        assert_eq!(found.z[0], 0.0);
        assert!((found.z[1] - 0.4).abs() < ROUNDING);
    }
}
