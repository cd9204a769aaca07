//! Dense linear algebra of a step: the reduction of a tall Jacobian to a small triangle, and linear
//! least squares within a ball. After [`reduce`] all matrices are n × n, n the number of
//! parameters.
use nalgebra::{DMatrix, DVector};

/// Diagonal entry of R below which a column depends on those before it, for columns of norm 1: n ε
/// with n ≤ 10 and a factor for the rounding of the Jacobian itself.
const RANK: f64 = 1e-14;

/// Share of the radius by which ‖y‖ may miss it. A closer root costs factorisations and saves no
/// iterations (Moré 1978 § 5).
const RADIUS_SLACK: f64 = 0.1;

/// Maximum number of factorisations of a step. Moré reports fewer than two on average; only
/// degenerate cases reach it, in which the last damping is as good as any.
const MAX_DAMPINGS: usize = 30;

/// Share of the upper end of the bracket of the damping that is tried if the lower end is 0 (Moré
/// 1978).
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
/// Returns `None` if an element is not finite or overflows.
pub fn reduce(jacobian: &DMatrix<f64>, residuals: &DVector<f64>) -> Option<Reduced> {
    let n = jacobian.ncols();
    // Rows of zeros add nothing; frames that do not depend on a shared unknown have many.
    let is_zero = |i: usize| residuals[i] == 0.0 && jacobian.row(i).iter().all(|value| *value == 0.0);
    let rows: Vec<usize> = (0..jacobian.nrows()).filter(|&i| !is_zero(i)).collect();
    let mut stacked = DMatrix::zeros(rows.len().max(n + 1), n + 1);
    for (row, i) in rows.into_iter().enumerate() {
        stacked.view_mut((row, 0), (1, n)).copy_from(&jacobian.row(i));
        stacked[(row, n)] = residuals[i];
    }
    let factor = stacked.qr().unpack_r();
    let triangle = factor.view((0, 0), (n, n)).into_owned();
    let residual = DVector::from_iterator(n, factor.view((0, n), (n, 1)).iter().copied());
    let column_norms = DVector::from_iterator(n, triangle.column_iter().map(|column| column.norm()));
    let is_finite = residual.iter().chain(column_norms.iter()).all(|value| value.is_finite());
    is_finite.then_some(Reduced { triangle, residual, column_norms })
}

/// A least-squares step within a ball.
#[derive(Clone, Debug)]
pub struct BallStep {
    /// The step.
    pub y: DVector<f64>,
    /// Whether the radius kept it from the minimum.
    pub is_limited: bool,
}

/// Minimises ½‖B y + c‖² subject to ‖y‖ ≤ `radius`, up to [`RADIUS_SLACK`], by Moré's iteration on
/// the damping λ of ½‖B y + c‖² + ½λ‖y‖². B is n × k with k ≤ n and finite; `radius` > 0, perhaps
/// ∞.
pub fn ball_step(b: &DMatrix<f64>, c: &DVector<f64>, radius: f64) -> BallStep {
    let (full_step, has_full_rank) = basic_solution(b, c);
    if full_step.norm() <= (1.0 + RADIUS_SLACK) * radius {
        return BallStep { y: full_step, is_limited: false };
    }
    // λ ≤ ‖Bᵀc‖/Δ, and for full rank λ ≥ φ(0)/(−φ′(0)), φ(λ) = ‖y(λ)‖ − Δ.
    let mut high = b.tr_mul(c).norm() / radius;
    let mut low = 0.0;
    if has_full_rank {
        let (y, slope) = damped_solution(b, c, 0.0);
        low = ((y.norm() - radius) * y.norm() / slope).clamp(0.0, high);
    }
    let between = |low: f64, high: f64| (low * high).sqrt().max(SMALLEST_SHARE * high);
    let mut damping = between(low, high);
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
        // Newton on 1/Δ − 1/‖y(λ)‖, nearly linear in λ:  λ ← λ + (‖y‖/Δ)(‖y‖ − Δ)‖y‖ / yᵀ(BᵀB +
        // λ)⁻¹y.
        let next = damping + (norm / radius) * excess * norm / slope;
        damping = if next > low && next < high { next } else { between(low, high) };
    }
    BallStep { y, is_limited: true }
}

/// Minimises ½‖B y + c‖² by QR with column pivoting; also returns whether B has full column rank.
/// If it has not, the columns that depend on the others get 0. The rank is that of columns of norm
/// 1: a parameter with little effect can still be determined.
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

/// Returns y(λ) = argmin ½‖B y + c‖² + ½λ‖y‖² by QR of [B; √λ I], and yᵀ(BᵀB + λ)⁻¹y = ‖R⁻ᵀy‖². B
/// has full rank or λ > 0.
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

    /// Rounding of a handful of operations on numbers of order 1.
    const FEW_ROUNDINGS: f64 = 1e-14;

    fn reduced() -> Reduced {
        let jacobian = DMatrix::from_fn(50, 3, |i, j| ((i * (j + 1)) as f64 * 0.37).sin() + j as f64);
        let residuals = DVector::from_fn(50, |i, _| (i as f64).cos());
        let reduced = reduce(&jacobian, &residuals).unwrap();
        let product = jacobian.tr_mul(&residuals) - reduced.triangle.tr_mul(&reduced.residual);
        assert!(product.norm() < 100.0 * FEW_ROUNDINGS);
        let gram = jacobian.tr_mul(&jacobian) - reduced.triangle.tr_mul(&reduced.triangle);
        assert!(gram.norm() < 1000.0 * FEW_ROUNDINGS);
        reduced
    }

    #[test]
    fn a_large_ball_gives_the_minimum_and_a_small_one_a_damped_step_to_its_edge() {
        let Reduced { triangle, residual, .. } = reduced();
        let gradient = |y: &DVector<f64>| triangle.tr_mul(&(&triangle * y + &residual));
        let full = ball_step(&triangle, &residual, f64::INFINITY);
        assert!(!full.is_limited && gradient(&full.y).norm() < 1000.0 * FEW_ROUNDINGS);
        for share in [1e-9, 1e-3, 0.5] {
            let radius = share * full.y.norm();
            let step = ball_step(&triangle, &residual, radius);
            assert!(step.is_limited && (step.y.norm() / radius - 1.0).abs() <= RADIUS_SLACK);
            // The gradient is −λ y, λ > 0.
            let gradient = gradient(&step.y);
            let cosine = gradient.dot(&step.y) / (gradient.norm() * step.y.norm());
            assert!((cosine + 1.0).abs() < 1000.0 * FEW_ROUNDINGS);
        }
    }

    #[test]
    fn dependent_columns_leave_a_basic_solution() {
        let b = DMatrix::from_row_slice(3, 3, &[1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let c = DVector::from_row_slice(&[-2.0, 0.0, 0.0]);
        let (y, has_full_rank) = basic_solution(&b, &c);
        assert!(!has_full_rank);
        assert!((&b * &y + &c).norm() < FEW_ROUNDINGS);
        assert_eq!(y[2], 0.0);
        let step = ball_step(&b, &c, 0.5);
        assert!(step.is_limited && (step.y.norm() / 0.5 - 1.0).abs() <= RADIUS_SLACK);
    }
}
