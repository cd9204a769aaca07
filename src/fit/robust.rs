//! Shots weighted down by a robust loss: their weights, and errors that do not believe the noise.

use nalgebra::DMatrix;

use super::minimum::Minimum;
use super::samples::Search;
use super::shot_loss::ShotLoss;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::prediction::MAX_OBSERVABLES;
use crate::measurement::dataset::Shot;
use crate::measurement::loss::Loss;

/// Shots of a weight below this are listed in the report.
pub const DOWN_WEIGHTED: f64 = 0.5;

/// How a robust loss weighted the shots.
#[derive(Clone, Debug, PartialEq)]
pub struct Robust {
    /// The loss.
    pub loss: Loss,
    /// The name and the weight of each shot whose weight is below 1, the smallest first.
    pub weights: Vec<(String, f64)>,
}

impl Robust {
    pub(super) fn of(search: &Search, shots: &[&Shot], minimum: &Minimum) -> Self {
        let weights = search.shots().zip(&minimum.weights);
        let mut weights: Vec<(String, f64)> = weights
            .filter(|(_, weight)| **weight < 1.0)
            .map(|(shot, weight)| (shots[shot.index].name.clone(), *weight))
            .collect();
        weights.sort_by(|a, b| a.1.total_cmp(&b.1));
        Self { loss: search.first().loss, weights }
    }
}

/// The losses of shots with one, two, … observations.
pub(crate) struct Losses([ShotLoss; MAX_OBSERVABLES + 1]);

impl Losses {
    pub(crate) fn new(loss: Loss) -> Self {
        Self(std::array::from_fn(|k| ShotLoss::of(loss, k)))
    }

    pub(crate) fn of(&self, shot: &Fitted) -> &ShotLoss {
        &self.0[shot.plan.rows().len().min(MAX_OBSERVABLES)]
    }
}

/// Distance of each shot, from residuals that are weighted with `weights`. That of frames is the root of what the collision adds to
/// the χ² of the motion, as the distance of the velocities that are extracted from them is.
pub(crate) fn distances<'a>(
    fitted: impl Iterator<Item = &'a Fitted>,
    residuals: &[f64],
    weights: &[f64],
) -> Vec<f64> {
    let mut rest = residuals;
    let distance = |(shot, weight): (&Fitted, &f64)| {
        let (own, others) = rest.split_at(shot.rows());
        rest = others;
        (own.iter().map(|r| r * r).sum::<f64>() / weight - shot.least_chi2()).max(0.0).sqrt()
    };
    fitted.zip(weights).map(distance).collect()
}

/// Curvature of the robust cost and scatter of its gradient, for the sandwich H⁻¹ B H⁻¹ (Huber 1967): the
/// covariance of the estimates whatever the distribution of the noise.
#[derive(Clone, Debug)]
pub(crate) struct Sandwich {
    curvature: DMatrix<f64>,
    scatter: DMatrix<f64>,
    /// How many unknowns the shots determine.
    pub unknowns: f64,
}

impl Sandwich {
    /// `None` for least squares, or without a degree of freedom among the shots.
    pub(crate) fn new(search: &Search, minimum: &Minimum, free: usize) -> Option<Self> {
        if !search.is_robust() {
            return None;
        }
        let losses: Vec<Losses> = search.samples.iter().map(|sample| Losses::new(sample.loss)).collect();
        let of_samples = search.samples.iter().zip(&losses);
        let shots =
            of_samples.flat_map(|(sample, losses)| sample.fitted.iter().map(move |s| (s, losses.of(s))));
        if minimum.weights.len() <= free {
            return None;
        }
        let jacobian = &minimum.jacobian;
        let columns = jacobian.ncols();
        let mut curvature = DMatrix::zeros(columns, columns);
        let mut bends = DMatrix::zeros(columns, columns);
        let mut scatter = DMatrix::zeros(columns, columns);
        let mut done = 0;
        for ((shot, loss), weight) in shots.zip(&minimum.weights) {
            let rows = shot.rows();
            let own = jacobian.rows(done, rows);
            let of_shot = minimum.residuals.rows(done, rows);
            done += rows;
            // of the weighted rows √w J and √w r: g = w Jᵀr, H = w JᵀJ + (w'/s)(Jᵀr)(Jᵀr)ᵀ
            let gradient = own.tr_mul(&of_shot);
            curvature += own.tr_mul(&own);
            let distance = (of_shot.norm_squared() / weight - shot.least_chi2()).max(0.0).sqrt();
            if distance > 0.0 {
                let bend = loss.slope(distance) / (distance * weight * weight);
                bends += &gradient * gradient.transpose() * bend;
            }
            scatter += &gradient * gradient.transpose();
        }
        // what belongs to no shot: priors
        let rest = jacobian.rows(done, jacobian.nrows() - done);
        let others = rest.tr_mul(&rest);
        let count = minimum.weights.len() as f64;
        let unknowns = if search.is_filmed() {
            // of what frames share besides, priors tell a part
            let told = (&curvature + &others).cholesky().map_or(0.0, |all| all.solve(&curvature).trace());
            // no more than leave a degree of freedom
            told.clamp(free as f64, count - 1.0)
        } else {
            free as f64
        };
        // few shots scatter less about their own fit
        scatter *= count / (count - unknowns);
        Some(Self { curvature: curvature + bends + &others, scatter: scatter + others, unknowns })
    }

    /// Returns the covariance of all columns; `None` if the curvature is not positive definite.
    pub(crate) fn covariance_of_all(&self) -> Option<DMatrix<f64>> {
        self.covariance(&(0..self.curvature.ncols()).collect::<Vec<_>>())
    }

    /// Returns the covariance of some columns, the others held.
    pub(crate) fn covariance(&self, columns: &[usize]) -> Option<DMatrix<f64>> {
        let pick = |m: &DMatrix<f64>| m.select_columns(columns).select_rows(columns);
        let bread = pick(&self.curvature).cholesky()?.inverse();
        Some(&bread * pick(&self.scatter) * bread.transpose())
    }
}
