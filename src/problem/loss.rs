//! Robust losses of shots: the distance of a shot is the length of its residuals, whose square
//! follows χ² with one degree of freedom for each of its numbers.
//!
//! Sources: Huber, Ann. Math. Statist. 35 (1964) 73; Maronna, Ann. Statist. 4 (1976) 51.

use statrs::distribution::{ChiSquared, Continuous, ContinuousCDF};

use crate::measurement::loss::Loss;

/// A loss ρ(s) of shots of some number of measured numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShotLoss {
    loss: Loss,
    /// Distance beyond which a shot counts less: as improbable as the tuning constant is of one
    /// number.
    tuning: f64,
    /// E[(w s)²]/k of normal errors.
    pub(crate) consistency: f64,
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

#[cfg(test)]
mod tests {
    use super::ShotLoss;
    use crate::measurement::loss::Loss;

    /// Weights of shots are the slopes of their costs, and E[(w s)²] of one number is that of
    /// scipy.
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
