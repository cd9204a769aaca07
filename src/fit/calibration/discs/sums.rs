//! What some frames tell of the camera: sums of their residuals and of how these follow its corrections.

use nalgebra::{SMatrix, SVector};

use crate::film::camera::Camera;
use crate::measurement::correction::Correction;

/// The corrections, and behind them by which part the distance of the centres at the contacts is not as stated.
pub(super) const COLUMNS: usize = Correction::COUNT + 1;

/// A row of derivatives.
pub(super) type Row = SVector<f64, COLUMNS>;

/// Neighbouring residuals are taken to be correlated by no more than this.
const MOST_REPEATED: f64 = 0.98;

/// Residuals r with derivatives b by the corrections: Σ w b bᵀ and −Σ w b r, the matrix and the right side of the step that makes
/// Σ w (r + b·δ)² least.
#[derive(Clone, Debug)]
pub(super) struct Sums {
    pub normal: SMatrix<f64, COLUMNS, COLUMNS>,
    pub right: Row,
}

impl Sums {
    pub(super) fn zero() -> Self {
        Self { normal: SMatrix::zeros(), right: Row::zeros() }
    }

    pub(super) fn add(&mut self, by: &Row, residual: f64, weight: f64) {
        self.normal += by * by.transpose() * weight;
        self.right -= by * (residual * weight);
    }

    pub(super) fn add_all(&mut self, other: &Self) {
        self.normal += other.normal;
        self.right += other.right;
    }
}

/// How a point of the table follows the corrections, at this place and velocity, x and y.
pub(super) fn derivatives(camera: &Camera, place: [f64; 2], velocity: [f64; 2]) -> [Row; 2] {
    let by = camera.follows(place, velocity);
    [0, 1].map(|axis| Row::from_fn(|k, _| by.get(k).map_or(0.0, |by| by[axis])))
}

/// (1 + ρ)/(1 − ρ) of runs of residuals, ρ the correlation of neighbours: so much less do they tell than independent ones.
pub(super) fn repeated<'a>(runs: impl Iterator<Item = &'a [f64]>) -> f64 {
    let (mut products, mut squares) = (0.0, 0.0);
    for run in runs {
        products += run.windows(2).map(|two| two[0] * two[1]).sum::<f64>();
        squares += run.iter().map(|r| r * r).sum::<f64>();
    }
    let rho = if squares > 0.0 { (products / squares).clamp(0.0, MOST_REPEATED) } else { 0.0 };
    (1.0 + rho) / (1.0 - rho)
}
