//! Dense linear algebra of a step: the tall Jacobian reduced to a small triangle, and linear least
//! squares within a ball. Everything after [`reduce`] is n × n, n the number of parameters.
use nalgebra::{DMatrix, DVector};

/// Below this a diagonal entry of R is rounding, the columns being of norm 1: n ε with n ≤ 10 and a factor
/// for the rounding of the Jacobian itself.
const RANK: f64 = 1e-14;

/// How far ‖y‖ may miss the radius. Finding it closer costs factorisations and saves no iterations
/// (Moré 1978 § 5).
const RADIUS_SLACK: f64 = 0.1;

/// Moré reports fewer than two factorisations a step on average; this many only in a degenerate case,
/// where the last damping is as good as any.
const MAX_DAMPINGS: usize = 30;

/// Used when the bracket of the damping has no lower end to take a geometric mean with (Moré 1978).
const SMALLEST_SHARE: f64 = 1e-3;

/// J = Q R, reduced: for every s, ‖J s + r‖² = ‖R s + q‖² + a constant.
#[derive(Clone, Debug)]
pub struct Reduced {
    /// R, n × n, upper triangular.
    pub triangle: DMatrix<f64>,
    /// q = Qᵀ r, n.
    pub residual: DVector<f64>,
    /// ‖J_j‖, n.
    pub column_norms: DVector<f64>,
}

/// Reduces `jacobian` (m × n) and `residuals` (m) by one Householder QR of [J r]; m < n is allowed.
/// `None` when something in it is not finite or overflows.
pub fn reduce(jacobian: &DMatrix<f64>, residuals: &DVector<f64>) -> Option<Reduced> {
    let n = jacobian.ncols();
    // what shots share and these do not depend on leaves rows of zeros
    let says = |i: &usize| residuals[*i] != 0.0 || (0..n).any(|j| jacobian[(*i, j)] != 0.0);
    let rows: Vec<usize> = (0..jacobian.nrows()).filter(says).collect();
    let mut stacked = DMatrix::zeros(rows.len().max(n + 1), n + 1);
    for (row, i) in rows.into_iter().enumerate() {
        stacked.view_mut((row, 0), (1, n)).copy_from(&jacobian.row(i));
        stacked[(row, n)] = residuals[i];
    }
    let factor = stacked.qr().unpack_r();
    let triangle = factor.view((0, 0), (n, n)).into_owned();
    let residual = DVector::from_iterator(n, factor.view((0, n), (n, 1)).iter().copied());
    let column_norms = DVector::from_iterator(n, triangle.column_iter().map(|column| column.norm()));
    let finite = residual.iter().chain(column_norms.iter()).all(|value| value.is_finite());
    finite.then_some(Reduced { triangle, residual, column_norms })
}

/// A least-squares step, and whether the radius kept it from the minimum.
#[derive(Clone, Debug)]
pub struct BallStep {
    pub y: DVector<f64>,
    pub limited: bool,
}

/// min ½‖B y + c‖² subject to ‖y‖ ≤ `radius`, up to [`RADIUS_SLACK`], by Moré's iteration on the
/// damping λ of min ½‖B y + c‖² + ½λ‖y‖². B is n × k with k ≤ n and finite; `radius` > 0, perhaps ∞.
pub fn ball_step(b: &DMatrix<f64>, c: &DVector<f64>, radius: f64) -> BallStep {
    let (newton, full_rank) = basic_solution(b, c);
    if newton.norm() <= (1.0 + RADIUS_SLACK) * radius {
        return BallStep { y: newton, limited: false };
    }
    // λ ≤ ‖Bᵀc‖/Δ, and for full rank λ ≥ φ(0)/(−φ′(0)), φ(λ) = ‖y(λ)‖ − Δ.
    let mut high = b.tr_mul(c).norm() / radius;
    let mut low = if full_rank {
        let (y, slope) = damped_solution(b, c, 0.0);
        ((y.norm() - radius) * y.norm() / slope).clamp(0.0, high)
    } else {
        0.0
    };
    let inside = |low: f64, high: f64| (low * high).sqrt().max(SMALLEST_SHARE * high);
    let mut damping = inside(low, high);
    let mut y = DVector::zeros(b.ncols());
    for _ in 0..MAX_DAMPINGS {
        let slope;
        (y, slope) = damped_solution(b, c, damping);
        let norm = y.norm();
        let excess = norm - radius;
        if excess.abs() <= RADIUS_SLACK * radius {
            break;
        }
        if excess > 0.0 {
            low = damping;
        } else {
            high = damping;
        }
        // Newton on 1/Δ − 1/‖y(λ)‖, nearly linear in λ:  λ ← λ + (‖y‖/Δ)(‖y‖ − Δ)‖y‖ / yᵀ(BᵀB + λ)⁻¹y.
        let next = damping + (norm / radius) * excess * norm / slope;
        damping = if next > low && next < high { next } else { inside(low, high) };
    }
    BallStep { y, limited: true }
}

/// min ½‖B y + c‖² by QR with column pivoting, and whether B has full column rank; where it has not,
/// the columns that depend on the others get 0. The columns are brought to norm 1 first: a parameter
/// that matters little is not one that cannot be told from the others.
pub fn basic_solution(b: &DMatrix<f64>, c: &DVector<f64>) -> (DVector<f64>, bool) {
    let k = b.ncols();
    if k == 0 {
        return (DVector::zeros(0), true);
    }
    let mut normed = b.clone();
    let mut norms = DVector::zeros(k);
    for (mut column, norm) in normed.column_iter_mut().zip(norms.iter_mut()) {
        *norm = column.norm();
        if *norm > 0.0 {
            column /= *norm;
        }
    }
    let factor = normed.col_piv_qr();
    let mut rotated = -c;
    factor.q_tr_mul(&mut rotated);
    let permutation = factor.p().clone();
    let triangle = factor.unpack_r();
    let rank = (0..k).take_while(|&i| triangle[(i, i)].abs() > RANK).count();
    let mut y = DVector::zeros(k);
    y.rows_mut(0, rank).copy_from(&rotated.rows(0, rank));
    // The diagonal was checked: this cannot meet a zero.
    let _ = triangle.view((0, 0), (rank, rank)).solve_upper_triangular_mut(&mut y.rows_mut(0, rank));
    permutation.inv_permute_rows(&mut y);
    (y.zip_map(&norms, |y, norm| if norm > 0.0 { y / norm } else { 0.0 }), rank == k)
}

/// y(λ) = argmin ½‖B y + c‖² + ½λ‖y‖² by QR of [B; √λ I], and yᵀ(BᵀB + λ)⁻¹y = ‖R⁻ᵀy‖². B has full
/// rank or λ > 0.
fn damped_solution(b: &DMatrix<f64>, c: &DVector<f64>, damping: f64) -> (DVector<f64>, f64) {
    let (n, k) = b.shape();
    let mut stacked = DMatrix::zeros(n + k, k);
    stacked.view_mut((0, 0), (n, k)).copy_from(b);
    stacked.view_mut((n, 0), (k, k)).fill_diagonal(damping.sqrt());
    let mut y = DVector::zeros(n + k);
    y.rows_mut(0, n).copy_from(&-c);
    let factor = stacked.qr();
    factor.q_tr_mul(&mut y);
    let triangle = factor.unpack_r();
    let mut y = y.rows(0, k).into_owned();
    let _ = triangle.solve_upper_triangular_mut(&mut y);
    let mut half = y.clone();
    let _ = triangle.tr_solve_upper_triangular_mut(&mut half);
    (y, half.norm_squared())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::least_squares::testing::ROUNDING;

    fn tall() -> (DMatrix<f64>, DVector<f64>) {
        let jacobian = DMatrix::from_fn(50, 3, |i, j| ((i * (j + 1)) as f64 * 0.37).sin() + j as f64);
        let residuals = DVector::from_fn(50, |i, _| (i as f64).cos());
        (jacobian, residuals)
    }

    #[test]
    fn reduce_keeps_norms_and_products() {
        let (jacobian, residuals) = tall();
        let reduced = reduce(&jacobian, &residuals).unwrap();
        let product = jacobian.tr_mul(&residuals) - reduced.triangle.tr_mul(&reduced.residual);
        assert!(product.norm() < 100.0 * ROUNDING);
        let gram = jacobian.tr_mul(&jacobian) - reduced.triangle.tr_mul(&reduced.triangle);
        assert!(gram.norm() < 1000.0 * ROUNDING);
        for j in 0..3 {
            assert!((reduced.column_norms[j] - jacobian.column(j).norm()).abs() < 10.0 * ROUNDING);
        }
    }

    #[test]
    fn reduce_takes_fewer_residuals_than_parameters_and_no_infinity() {
        let wide = DMatrix::from_row_slice(1, 3, &[1.0, 2.0, 2.0]);
        let reduced = reduce(&wide, &DVector::from_element(1, 5.0)).unwrap();
        let product = reduced.triangle.tr_mul(&reduced.residual);
        assert!((product - DVector::from_row_slice(&[5.0, 10.0, 10.0])).norm() < 10.0 * ROUNDING);
        assert!(reduce(&wide, &DVector::from_element(1, f64::INFINITY)).is_none());
        assert!(reduce(&(wide * 1e300), &DVector::from_element(1, 1.0)).is_none());
    }

    #[test]
    fn a_large_ball_gives_the_least_squares_solution() {
        let (jacobian, residuals) = tall();
        let reduced = reduce(&jacobian, &residuals).unwrap();
        let step = ball_step(&reduced.triangle, &reduced.residual, f64::INFINITY);
        assert!(!step.limited);
        let gradient = jacobian.tr_mul(&(&jacobian * &step.y + &residuals));
        assert!(gradient.norm() < 1000.0 * ROUNDING);
    }

    #[test]
    fn a_small_ball_is_filled_and_the_damping_is_common() {
        let (jacobian, residuals) = tall();
        let reduced = reduce(&jacobian, &residuals).unwrap();
        let full = ball_step(&reduced.triangle, &reduced.residual, f64::INFINITY).y.norm();
        for radius in [1e-9 * full, 1e-3 * full, 0.5 * full] {
            let step = ball_step(&reduced.triangle, &reduced.residual, radius);
            assert!(step.limited);
            assert!((step.y.norm() / radius - 1.0).abs() <= RADIUS_SLACK);
            // The gradient is −λ y, λ > 0.
            let gradient = reduced.triangle.tr_mul(&(&reduced.triangle * &step.y + &reduced.residual));
            let cosine = gradient.dot(&step.y) / (gradient.norm() * step.y.norm());
            assert!((cosine + 1.0).abs() < 1000.0 * ROUNDING);
        }
    }

    #[test]
    fn dependent_columns_leave_a_basic_solution() {
        let b = DMatrix::from_row_slice(3, 3, &[1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let c = DVector::from_row_slice(&[-2.0, 0.0, 0.0]);
        let (y, full_rank) = basic_solution(&b, &c);
        assert!(!full_rank);
        assert!((&b * &y + &c).norm() < ROUNDING);
        assert_eq!(y[2], 0.0);
        let step = ball_step(&b, &c, 0.5);
        assert!(step.limited && (step.y.norm() / 0.5 - 1.0).abs() <= RADIUS_SLACK);
        let (none, _) = basic_solution(&DMatrix::zeros(2, 2), &DVector::from_element(2, 1.0));
        assert_eq!(none, DVector::zeros(2));
    }
}
