//! Shots weighted down by a robust loss: their weights, and errors that do not believe the noise.

use nalgebra::DMatrix;

use super::search::Search;
use super::uncertainty::Minimum;
use crate::loss::{Loss, ShotLoss};
use crate::predict::MAX_OBSERVABLES;
use crate::residuals::Fitted;

/// Shots of a weight below this are listed in the report.
pub const DOWN_WEIGHTED: f64 = 0.5;

/// How a robust loss weighed the shots.
#[derive(Clone, Debug, PartialEq)]
pub struct Robust {
    pub loss: Loss,
    /// Weights below 1, the smallest first: shot and weight.
    pub weights: Vec<(String, f64)>,
}

/// The losses of shots with one, two, … observations.
pub(super) struct Losses([ShotLoss; MAX_OBSERVABLES + 1]);

impl Losses {
    pub(super) fn new(loss: Loss) -> Self {
        Self(std::array::from_fn(|k| loss.of_shots(k)))
    }

    pub(super) fn of(&self, shot: &Fitted) -> &ShotLoss {
        &self.0[shot.plan.rows().len().min(MAX_OBSERVABLES)]
    }
}

/// Distance of each shot, from residuals that are weighted with `weights`.
pub(super) fn distances(fitted: &[Fitted], residuals: &[f64], weights: &[f64]) -> Vec<f64> {
    let mut rest = residuals;
    let distance = |(shot, weight): (&Fitted, &f64)| {
        let (own, others) = rest.split_at(shot.plan.rows().len());
        rest = others;
        (own.iter().map(|r| r * r).sum::<f64>() / weight).sqrt()
    };
    fitted.iter().zip(weights).map(distance).collect()
}

/// Curvature of the robust cost and scatter of its gradient, for the sandwich H⁻¹ B H⁻¹ (Huber 1967): the
/// covariance of the estimates whatever the distribution of the noise.
#[derive(Clone, Debug)]
pub(super) struct Sandwich {
    curvature: DMatrix<f64>,
    scatter: DMatrix<f64>,
}

impl Sandwich {
    /// `None` for least squares, or without a degree of freedom among the shots.
    pub(super) fn new(search: &Search, minimum: &Minimum, free: usize) -> Option<Self> {
        let shots = search.fitted.len();
        if search.loss == Loss::Squares || shots <= free {
            return None;
        }
        let losses = Losses::new(search.loss);
        let Minimum { jacobian, residuals, weights, .. } = minimum;
        let s = distances(search.fitted, residuals.as_slice(), weights);
        let columns = jacobian.ncols();
        let mut curvature = DMatrix::zeros(columns, columns);
        let mut scatter = DMatrix::zeros(columns, columns);
        let mut first = 0;
        for (i, shot) in search.fitted.iter().enumerate() {
            let count = shot.plan.rows().len();
            let own = jacobian.rows(first, count);
            // of the weighted rows √w J and √w r: g = w Jᵀr, H = w JᵀJ + (w'/s)(Jᵀr)(Jᵀr)ᵀ
            let gradient = own.tr_mul(&residuals.rows(first, count));
            curvature += own.tr_mul(&own);
            if s[i] > 0.0 {
                let bend = losses.of(shot).slope(s[i]) / (s[i] * weights[i] * weights[i]);
                curvature += &gradient * gradient.transpose() * bend;
            }
            scatter += &gradient * gradient.transpose();
            first += count;
        }
        // few shots scatter less about their own fit
        scatter *= shots as f64 / (shots - free) as f64;
        let rest = jacobian.rows(first, jacobian.nrows() - first);
        curvature += rest.tr_mul(&rest);
        scatter += rest.tr_mul(&rest);
        Some(Self { curvature, scatter })
    }

    /// Covariance of some columns, within the directions `basis` of them.
    pub(super) fn covariance(&self, columns: &[usize], basis: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let pick =
            |m: &DMatrix<f64>| basis.transpose() * m.select_columns(columns).select_rows(columns) * basis;
        let bread = basis * pick(&self.curvature).cholesky()?.inverse();
        Some(&bread * pick(&self.scatter) * bread.transpose())
    }
}
