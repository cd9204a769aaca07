//! The sums over frames that `moments` are made of, and what corrections of the camera add to them.

use nalgebra::{SMatrix, SVector};

use crate::measurement::correction::Correction;

/// How many corrections of the camera there are.
pub(super) const CORRECTIONS: usize = Correction::COUNT;

/// By how much each correction of the camera is off.
pub(super) type Off = [f64; CORRECTIONS];

/// The sums over some frames of one coordinate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    /// S_k = Σ w uᵏ
    pub s: [f64; 5],
    /// Y_k = Σ w (y − ŷ) uᵏ
    pub y: [f64; 3],
    /// Q = Σ w (y − ŷ)²
    pub q: f64,
}

impl Sums {
    pub(super) fn add(&mut self, u: f64, off: f64, weight: f64) {
        let mut term = weight;
        for k in 0..5 {
            self.s[k] += term;
            if k < 3 {
                self.y[k] += term * off;
            }
            term *= u;
        }
        self.q += weight * off * off;
    }

    /// What is left of these sums without the first ones.
    pub(super) fn without(&self, first: &Self) -> Self {
        Self {
            s: std::array::from_fn(|k| self.s[k] - first.s[k]),
            y: std::array::from_fn(|k| self.y[k] - first.y[k]),
            q: self.q - first.q,
        }
    }
}

/// What the corrections of the camera add to the sums over some frames of one coordinate.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraSums {
    /// B_ka = Σ w b_k uᵃ
    pub b: [[f64; 3]; CORRECTIONS],
    /// G_k = Σ w b_k (y − ŷ)
    pub g: SVector<f64, CORRECTIONS>,
    /// H_kl = Σ w b_k b_l
    pub h: SMatrix<f64, CORRECTIONS, CORRECTIONS>,
}

impl CameraSums {
    pub(super) fn zero() -> Self {
        Self { b: [[0.0; 3]; CORRECTIONS], g: SVector::zeros(), h: SMatrix::zeros() }
    }

    pub(super) fn add(&mut self, shifts: &SVector<f64, CORRECTIONS>, u: f64, off: f64, weight: f64) {
        for (k, b) in self.b.iter_mut().enumerate() {
            let term = weight * shifts[k];
            for (a, power) in b.iter_mut().zip([1.0, u, u * u]) {
                *a += term * power;
            }
        }
        self.g.axpy(weight * off, shifts, 1.0);
        self.h.ger(weight, shifts, shifts, 1.0);
    }

    /// What is left of these sums without the first ones.
    pub(super) fn without(&self, first: &Self) -> Self {
        Self {
            b: std::array::from_fn(|k| std::array::from_fn(|a| self.b[k][a] - first.b[k][a])),
            g: self.g - first.g,
            h: self.h - first.h,
        }
    }

    /// The sums of frames that are moved by corrections that are off by so much.
    pub(super) fn moved(&self, sums: &Sums, off: &Off) -> Sums {
        let delta = SVector::from(*off);
        let mut moved = *sums;
        for (k, by) in off.iter().enumerate() {
            for a in 0..3 {
                moved.y[a] += by * self.b[k][a];
            }
        }
        moved.q += 2.0 * delta.dot(&self.g) + delta.dot(&(self.h * delta));
        moved
    }
}
