//! Robust losses of shots: the distance of a shot is the length of its residuals, whose square
//! follows χ² with one degree of freedom for each of its numbers.
//!
//! Sources: Huber, Ann. Math. Statist. 35 (1964) 73; Maronna, Ann. Statist. 4 (1976) 51.

use nalgebra::DMatrix;
use statrs::distribution::{ChiSquared, Continuous, ContinuousCDF};

use super::block::Block;
use super::film::block::FilmBlock;
use super::problem::{Evaluation, Problem, Sample};
use super::sums::Contribution;
use super::uncertainty::Estimates;
use super::unknowns::Id;
use crate::measurement::loss::Loss;

/// A loss ρ(s) of shots of some number of measured numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShotLoss {
    loss: Loss,
    /// Distance beyond which a shot counts less: as improbable as the tuning constant is of one number.
    tuning: f64,
    /// E[(w s)²]/k of normal errors.
    pub consistency: f64,
}

impl ShotLoss {
    pub fn new(loss: Loss, numbers: usize) -> Self {
        /// Midpoints of the integral over s.
        const STEPS: usize = 4000;
        let plain = Self { loss, tuning: loss.tuning(), consistency: 1.0 };
        let (Ok(one), Ok(all)) = (ChiSquared::new(1.0), ChiSquared::new(numbers.max(1) as f64)) else {
            return plain;
        };
        if loss == Loss::Squares {
            return plain;
        }
        let tuning = all.inverse_cdf(one.cdf(plain.tuning.powi(2))).sqrt();
        let made = Self { tuning, ..plain };
        let count = numbers.max(1) as f64;
        let step = (count.sqrt() + 9.0) / STEPS as f64;
        // E[(w s)²]/k, s of density 2s f(s²)
        let term = |i: usize| {
            let s = (i as f64 + 0.5) * step;
            (made.weight(s) * s).powi(2) * 2.0 * s * all.pdf(s * s) * step
        };
        Self { consistency: (0..STEPS).map(term).sum::<f64>() / count, ..made }
    }

    /// Returns ρ(s), which is s² near 0.
    pub fn cost(&self, s: f64) -> f64 {
        match self.loss {
            Loss::Huber if s > self.tuning => self.tuning * (2.0 * s - self.tuning),
            Loss::Squares | Loss::Huber => s * s,
            Loss::Cauchy => self.tuning.powi(2) * (s / self.tuning).powi(2).ln_1p(),
        }
    }

    /// Returns the weight w(s) = ρ'(s)/2s.
    pub fn weight(&self, s: f64) -> f64 {
        match self.loss {
            Loss::Huber if s > self.tuning => self.tuning / s,
            Loss::Squares | Loss::Huber => 1.0,
            Loss::Cauchy => (1.0 + (s / self.tuning).powi(2)).recip(),
        }
    }

    /// Returns dw/ds.
    pub fn slope(&self, s: f64) -> f64 {
        match self.loss {
            Loss::Huber if s > self.tuning => -self.tuning / (s * s),
            Loss::Squares | Loss::Huber => 0.0,
            Loss::Cauchy => -2.0 * s / self.tuning.powi(2) * self.weight(s).powi(2),
        }
    }
}

/// Returns the covariance of estimates by the losses of the films; `None` if all are least squares, or
/// there are too few shots.
pub(crate) fn robust_covariance(
    problem: &Problem,
    at: &Evaluation,
    estimates: &Estimates,
) -> Option<DMatrix<f64>> {
    if !problem.is_robust() {
        return None;
    }
    let of_sample = |(sample, shots): (&Sample, &Vec<Contribution>)| match &sample.block {
        Block::Film(film @ FilmBlock { loss: Some(loss), .. }) => {
            film.distances(shots).into_iter().map(|distance| (*loss, distance)).collect()
        }
        _ => vec![(ShotLoss::new(Loss::Squares, 1), 0.0); shots.len()],
    };
    let losses: Vec<_> = problem.samples.iter().zip(&at.shots).map(of_sample).collect();
    sandwich(problem, at, estimates, &losses)
}

/// Returns the covariance H⁻¹BH⁻¹ of estimates by a robust loss, whatever the noise is, with the
/// curvature H and the scatter B of the slopes of the shots (Huber 1967); `losses` has the loss and the
/// distance of each shot of each sample.
pub(crate) fn sandwich(
    problem: &Problem,
    at: &Evaluation,
    estimates: &Estimates,
    losses: &[Vec<(ShotLoss, f64)>],
) -> Option<DMatrix<f64>> {
    let n = estimates.columns.len();
    let count = losses.iter().map(Vec::len).sum::<usize>() as f64;
    // of unknowns with priors the shots tell a part
    let prior = |column: &usize| problem.unknowns[*column].active_prior();
    let told = estimates.columns.iter().zip(0..).map(|(column, i)| match prior(column) {
        Some(prior) => 1.0 - estimates.covariance[(i, i)] / (prior.sd * prior.sd),
        None => 1.0,
    });
    let told: f64 = told.sum();
    if count <= told {
        return None;
    }
    let (mut curvature, mut scatter) = (DMatrix::<f64>::zeros(n, n), DMatrix::<f64>::zeros(n, n));
    for ((sample, shots), losses) in problem.samples.iter().zip(&at.shots).zip(losses) {
        let local = |id: &Id| estimates.position(sample.columns[*id as usize]);
        let (ids, places): (Vec<Id>, Vec<usize>) =
            Id::ALL.into_iter().filter_map(|id| Some((id, local(&id)?))).unzip();
        for (shot, (loss, distance)) in shots.iter().zip(losses) {
            // of the weighted sums: g = w Jᵀr, H = w JᵀJ + (w'/s)(Jᵀr)(Jᵀr)ᵀ
            let (matrix, slope) = shot.reduced(&ids)?;
            let weight = loss.weight(*distance);
            let outer = &slope * slope.transpose();
            let bend =
                if *distance > 0.0 { loss.slope(*distance) / (distance * weight * weight) } else { 0.0 };
            for (i, a) in places.iter().enumerate() {
                for (j, b) in places.iter().enumerate() {
                    curvature[(*a, *b)] += matrix[(i, j)] + outer[(i, j)] * bend;
                    // few shots scatter less about their own fit
                    scatter[(*a, *b)] += outer[(i, j)] * (count / (count - told));
                }
            }
        }
    }
    for (i, column) in estimates.columns.iter().enumerate() {
        if let Some(prior) = prior(column) {
            curvature[(i, i)] += prior.sd.powi(-2);
            scatter[(i, i)] += prior.sd.powi(-2);
        }
    }
    let inverse = curvature.cholesky()?.inverse();
    Some(&inverse * scatter * &inverse)
}

#[cfg(test)]
mod tests {
    use super::ShotLoss;
    use crate::measurement::loss::Loss;

    /// Weights of shots are the slopes of their costs, and E[(w s)²] of one number is that of scipy.
    #[test]
    fn losses_have_their_weights() {
        assert!((ShotLoss::new(Loss::Huber, 1).consistency - 0.710_165).abs() < 1e-5);
        for loss in [Loss::Huber, Loss::Cauchy] {
            let loss = ShotLoss::new(loss, 4);
            for s in [0.5, 1.5, 4.0, 9.0] {
                let slope = |of: &dyn Fn(f64) -> f64| (of(s + 1e-6) - of(s - 1e-6)) / 2e-6;
                assert!((2.0 * loss.weight(s) * s - slope(&|s| loss.cost(s))).abs() < 1e-8);
                assert!((loss.slope(s) - slope(&|s| loss.weight(s))).abs() < 1e-8);
            }
        }
    }
}
