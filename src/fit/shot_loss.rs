//! What a shot far from its prediction costs: its square, or less, so that outlying shots do not drag
//! the fit along.
//!
//! A shot's distance s is the length of its whitened residuals, whose square is χ² distributed with k
//! degrees of freedom, one for each observation. The loss ρ(s) has the weight w(s) = ρ'(s)/s: Huber's is
//! 1 up to c and c/s beyond, Cauchy's 1/(1 + (s/c)²).
//!
//! - Huber, P. J. (1964). Robust estimation of a location parameter. Ann. Math. Statist. 35, 73–101.
//! - Maronna, R. A. (1976). Robust M-estimators of multivariate location and scatter. Ann. Statist. 4, 51–67.

use std::sync::OnceLock;

use statrs::distribution::{ChiSquared, Continuous, ContinuousCDF};

use crate::measurement::loss::Loss;

/// A [`Loss`] for shots of some number of observations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ShotLoss {
    loss: Loss,
    c: f64,
    /// E[(w s)²]/k of normal errors: what a sum of weighted squares is short of.
    pub consistency: f64,
}

impl ShotLoss {
    /// For shots of `k` observations: the distance that is as improbable as the tuning constant is of one.
    pub(crate) fn of(loss: Loss, k: usize) -> Self {
        /// More observations than any shot has. A search asks for the same losses thousands of times.
        const MOST: usize = 32;
        static KNOWN: [[OnceLock<ShotLoss>; MOST]; Loss::ALL.len()] =
            [const { [const { OnceLock::new() }; MOST] }; Loss::ALL.len()];
        match KNOWN[loss as usize].get(k) {
            Some(known) => *known.get_or_init(|| Self::computed(loss, k)),
            None => Self::computed(loss, k),
        }
    }

    fn computed(loss: Loss, k: usize) -> Self {
        let squared = |k: usize| ChiSquared::new(k.max(1) as f64).ok();
        let tuning = loss.tuning();
        let c = match (loss, squared(1), squared(k)) {
            (Loss::Squares, ..) | (_, None, _) | (_, _, None) => tuning,
            (_, Some(one), Some(of_k)) => of_k.inverse_cdf(one.cdf(tuning * tuning)).sqrt(),
        };
        let mut found = Self { loss, c, consistency: 1.0 };
        if let (true, Some(density)) = (loss != Loss::Squares, squared(k)) {
            // E[(w s)²]/k by the midpoint rule in s, of density 2s f(s²)
            const STEPS: usize = 4000;
            let end = (k as f64).sqrt() + 9.0;
            let step = end / STEPS as f64;
            let term = |i: usize| {
                let s = (i as f64 + 0.5) * step;
                (found.weight(s) * s).powi(2) * 2.0 * s * density.pdf(s * s) * step
            };
            found.consistency = (0..STEPS).map(term).sum::<f64>() / k.max(1) as f64;
        }
        found
    }

    /// ρ(s), as large as s² near 0.
    #[must_use]
    pub fn cost(&self, s: f64) -> f64 {
        match self.loss {
            Loss::Huber if s > self.c => self.c * (2.0 * s - self.c),
            Loss::Squares | Loss::Huber => s * s,
            Loss::Cauchy => self.c * self.c * (s / self.c).powi(2).ln_1p(),
        }
    }

    /// w(s).
    #[must_use]
    pub fn weight(&self, s: f64) -> f64 {
        match self.loss {
            Loss::Squares => 1.0,
            Loss::Huber => {
                if s <= self.c {
                    1.0
                } else {
                    self.c / s
                }
            }
            Loss::Cauchy => (1.0 + (s / self.c).powi(2)).recip(),
        }
    }

    /// dw/ds.
    #[must_use]
    pub fn slope(&self, s: f64) -> f64 {
        match self.loss {
            Loss::Squares => 0.0,
            Loss::Huber => {
                if s <= self.c {
                    0.0
                } else {
                    -self.c / (s * s)
                }
            }
            Loss::Cauchy => -2.0 * s / (self.c * self.c) * self.weight(s).powi(2),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_observation_has_the_published_constants() {
        let huber = ShotLoss::of(Loss::Huber, 1);
        assert!((huber.c - 1.345).abs() < 1e-9);
        // E[min(|z|, c)²] = 2Φ(c) − 1 − 2cφ(c) + 2c²(1 − Φ(c)), scipy: 0.710 165 (c = 1.345)
        assert!((huber.consistency - 0.710_165).abs() < 1e-5, "{}", huber.consistency);
        assert!(huber.weight(1.0) == 1.0 && (huber.weight(2.69) - 0.5).abs() < 1e-9);
        let cauchy = ShotLoss::of(Loss::Cauchy, 1);
        assert!((cauchy.weight(2.3849) - 0.5).abs() < 1e-9);
    }

    #[test]
    fn slopes_are_those_of_the_weights_and_weights_those_of_the_costs() {
        for loss in [Loss::Huber, Loss::Cauchy] {
            let loss = ShotLoss::of(loss, 4);
            for s in [0.5, 1.5, 4.0, 9.0] {
                // ρ = s² near 0: ρ' = 2 w s
                let slope = (loss.cost(s + 1e-6) - loss.cost(s - 1e-6)) / 2e-6;
                assert!((2.0 * loss.weight(s) * s - slope).abs() < 1e-8, "{loss:?} {s}");
                let numeric = (loss.weight(s + 1e-6) - loss.weight(s - 1e-6)) / 2e-6;
                assert!((loss.slope(s) - numeric).abs() < 1e-8, "{loss:?} {s}");
            }
        }
    }

    #[test]
    fn more_observations_allow_a_larger_distance() {
        let c: Vec<f64> = [1, 2, 4].iter().map(|k| ShotLoss::of(Loss::Huber, *k).c).collect();
        assert!(c[0] < c[1] && c[1] < c[2]);
        assert_eq!(ShotLoss::of(Loss::Squares, 4).weight(100.0), 1.0);
    }
}
