//! The normal equations of one shot, and its own unknowns eliminated from them.

use nalgebra::{Cholesky, Const, SMatrix, SVector};
use num_dual::DualSVec64;

use super::moments::Along;
use super::path_start::LOCAL;
use super::{ALL_SHARED, FIRST_OTHER, ROWS, SHARED};
use crate::likelihood::small_products::{add_product, add_product_with_transpose};
use crate::measurement::correction::Correction;

/// Relative to its column, a pivot below this is rounding: the shot does not depend on that parameter.
const SILENT: f64 = 1e-11;

/// The normal equations of a shot, by its own unknowns and S numbers that all shots share.
pub(super) struct Normal<const N: usize, const S: usize> {
    /// JᵀJ, lower triangle.
    matrix: SMatrix<f64, N, N>,
    /// Jᵀr.
    pub gradient: SVector<f64, N>,
    /// rᵀr.
    pub square: f64,
    /// JᵀJ between the unknowns and the corrections of the camera, and among these; and their part of Jᵀr.
    camera_coupling: SMatrix<f64, N, { Correction::COUNT }>,
    camera_matrix: SMatrix<f64, { Correction::COUNT }, { Correction::COUNT }>,
    camera_gradient: SVector<f64, { Correction::COUNT }>,
}

impl<const N: usize, const S: usize> Normal<N, S> {
    pub(super) fn zero() -> Self {
        Self {
            matrix: SMatrix::zeros(),
            gradient: SVector::zeros(),
            square: 0.0,
            camera_coupling: SMatrix::zeros(),
            camera_matrix: SMatrix::zeros(),
            camera_gradient: SVector::zeros(),
        }
    }

    pub(super) fn add(&mut self, residual: DualSVec64<N>) {
        self.square += residual.re * residual.re;
        if let Some(row) = residual.eps.0 {
            self.gradient.axpy(residual.re, &row, 1.0);
            self.matrix.syger(1.0, &row, &row, 1.0);
        }
    }

    /// Adds the sums along a path, which starts with numbers that have these derivatives.
    pub(super) fn add_path(&mut self, sums: &Along, by: &SMatrix<f64, N, LOCAL>) {
        self.square += sums.square;
        add_product(&mut self.gradient, 1.0, by, &sums.gradient);
        let mut half = SMatrix::zeros();
        add_product(&mut half, 1.0, by, &sums.matrix);
        add_product_with_transpose(&mut self.matrix, &half, by);
        if let Some(camera) = &sums.camera {
            add_product(&mut self.camera_coupling, 1.0, by, &camera.coupling);
            self.camera_matrix += camera.matrix;
            self.camera_gradient += camera.gradient;
        }
    }

    /// The largest difference of the entries of JᵀJ, as part of the largest.
    #[cfg(test)]
    pub(super) fn differs_from(&self, other: &Self) -> f64 {
        let lower = |m: &SMatrix<f64, N, N>| m.lower_triangle();
        (lower(&self.matrix) - lower(&other.matrix)).amax() / lower(&other.matrix).amax()
    }

    /// The shared parameters held, and those from `held` on: 0 in the gradient…
    pub(super) fn own_gradient(&self, held: usize) -> SVector<f64, N> {
        let from = held.min(N - S);
        let mut gradient = self.gradient;
        gradient.rows_mut(from, N - from).fill(0.0);
        gradient
    }

    /// …and 1 in the matrix.
    pub(super) fn own_part(&self, damping: f64, held: usize) -> Option<Cholesky<f64, Const<N>>> {
        let own = held.min(N - S);
        let mut matrix = self.matrix;
        for i in 0..N {
            if i >= own {
                matrix.row_mut(i).fill(0.0);
                matrix[(i, i)] = 1.0;
            } else {
                matrix[(i, i)] *= 1.0 + damping;
            }
        }
        Cholesky::new(matrix)
    }

    /// The own unknowns eliminated: [R r] with RᵀR the Schur complement S = A_pp − A_py A_yy⁻¹ A_yp of JᵀJ, Jᵀr and rᵀr; and
    /// where that puts the own unknowns: the step that is left to their minimum, −A_yy⁻¹g_y, and how this follows the shared
    /// parameters, −A_yy⁻¹A_yp.
    pub(super) fn reduce(&self, held: usize) -> Option<Eliminated<N>> {
        let own = N - S;
        let cholesky = self.own_part(0.0, held)?;
        // what the shot does not depend on, as the corrections of a camera that is known, has zeros everywhere
        let mut used = [0; ALL_SHARED];
        let mut count = 0;
        for i in (0..ALL_SHARED).filter(|i| self.shared_entry(*i, *i) != 0.0) {
            used[count] = i;
            count += 1;
        }
        let used = &used[..count];
        let mut coupling = SMatrix::<f64, N, ALL_SHARED>::zeros();
        let mut carried = SMatrix::<f64, N, ALL_SHARED>::zeros();
        for j in used {
            let mut column = SVector::<f64, N>::zeros();
            for i in 0..own.min(held) {
                column[i] = match Of::place(*j) {
                    Of::Motion(j) => self.matrix[(own + j, i)],
                    Of::Camera(j) => self.camera_coupling[(i, j)],
                };
            }
            coupling.set_column(*j, &column);
            cholesky.solve_mut(&mut column);
            carried.set_column(*j, &column);
        }
        let inner = self.own_gradient(held);
        let step = cholesky.solve(&inner);
        let mut schur = SMatrix::<f64, ROWS, ROWS>::zeros();
        let mut scale = [0.0; ROWS];
        for (n, i) in used.iter().enumerate() {
            let of_own = coupling.column(*i);
            for j in &used[..=n] {
                schur[(*i, *j)] = self.shared_entry(*i, *j) - of_own.dot(&carried.column(*j));
            }
            let gradient = match Of::place(*i) {
                Of::Motion(i) => self.gradient[own + i],
                Of::Camera(i) => self.camera_gradient[i],
            };
            schur[(ALL_SHARED, *i)] = gradient - carried.column(*i).dot(&inner);
            scale[*i] = self.shared_entry(*i, *i);
        }
        schur[(ALL_SHARED, ALL_SHARED)] = self.square - inner.dot(&step);
        scale[ALL_SHARED] = self.square;
        semidefinite(&mut schur, &scale, used);
        let jacobian = schur.fixed_view::<ALL_SHARED, ROWS>(0, 0).transpose();
        let residuals = schur.row(ALL_SHARED).transpose();
        Some(Eliminated { residuals, jacobian, step: -step, by_shared: -carried })
    }

    /// JᵀJ among what all shots share.
    fn shared_entry(&self, i: usize, j: usize) -> f64 {
        let own = N - S;
        match (Of::place(i), Of::place(j)) {
            (Of::Motion(i), Of::Motion(j)) if i.max(j) < S => self.matrix[(own + i.max(j), own + i.min(j))],
            (Of::Camera(i), Of::Motion(j)) | (Of::Motion(j), Of::Camera(i)) if j < S => {
                self.camera_coupling[(own + j, i)]
            }
            (Of::Camera(i), Of::Camera(j)) => self.camera_matrix[(i, j)],
            // of numbers that the outcome does not depend on
            _ => 0.0,
        }
    }
}

/// What a number that all shots share belongs to, and its place there.
enum Of {
    Motion(usize),
    Camera(usize),
}

impl Of {
    fn place(shared: usize) -> Self {
        match shared {
            0..SHARED => Self::Motion(shared),
            SHARED..FIRST_OTHER => Self::Camera(shared - SHARED),
            _ => Self::Motion(shared - Correction::COUNT),
        }
    }
}

/// The place among all that shots share of a number of the motion.
pub(super) fn place(of_motion: usize) -> usize {
    if of_motion < SHARED { of_motion } else { of_motion + Correction::COUNT }
}

/// What is left of a shot's normal equations without its own unknowns.
pub(super) struct Eliminated<const N: usize> {
    pub residuals: SVector<f64, ROWS>,
    pub jacobian: SMatrix<f64, ROWS, ALL_SHARED>,
    /// 0 where there is no own unknown, or it is held.
    pub step: SVector<f64, N>,
    pub by_shared: SMatrix<f64, N, ALL_SHARED>,
}

/// L of a positive semidefinite LLᵀ in the place of its lower triangle, of which only the rows and columns `used`, and the last ones, are
/// not 0; a column is 0 whose pivot is rounding beside `scale`.
fn semidefinite(a: &mut SMatrix<f64, ROWS, ROWS>, scale: &[f64; ROWS], used: &[usize]) {
    let mut rows = [ALL_SHARED; ROWS];
    rows[..used.len()].copy_from_slice(used);
    let rows = &rows[..=used.len()];
    for (n, &k) in rows.iter().enumerate() {
        let pivot = a[(k, k)];
        if pivot <= SILENT * scale[k] {
            a.column_mut(k).fill(0.0);
            continue;
        }
        let root = pivot.sqrt();
        for &i in &rows[n..] {
            a[(i, k)] /= root;
        }
        for (m, &j) in rows.iter().enumerate().skip(n + 1) {
            for &i in &rows[m..] {
                a[(i, j)] -= a[(i, k)] * a[(j, k)];
            }
        }
    }
}
