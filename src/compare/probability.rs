//! Probabilities of differences and of rises of χ².

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal, StudentsT};

use super::result::Difference;
use crate::problem::Solution;

/// How sums of squares are judged.
#[derive(Clone, Copy)]
pub(super) struct Tests {
    pub dof: usize,
    /// Whether the noise was estimated from the residuals, or the errors from the scatter of the shots.
    pub estimated: bool,
}

impl Tests {
    /// Returns how sums of squares of a fit are judged. With a robust loss the scatter of the shots gives the errors.
    pub fn new(solution: &Solution) -> Self {
        let is_robust = solution.problem.is_robust();
        let count = if is_robust {
            solution.names.iter().map(Vec::len).sum::<usize>() as f64
        } else {
            solution.chi2_of_data().1 - solution.own_count() as f64
        };
        let dof = (count - solution.data_count()).max(0.0) as usize;
        let estimates = solution.problem.samples.iter().any(|sample| sample.block.estimates_noise());
        Self { dof, estimated: is_robust || estimates }
    }

    /// Returns Student's t if the scatter of the data gives the errors.
    fn student(&self) -> Option<StudentsT> {
        StudentsT::new(0.0, 1.0, self.dof.max(1) as f64).ok().filter(|_| self.estimated)
    }

    /// Returns the 97.5 % quantile.
    pub fn quantile(&self) -> f64 {
        self.student().map_or_else(|| Normal::standard().inverse_cdf(0.975), |t| t.inverse_cdf(0.975))
    }

    /// Returns the two-sided probability of a difference above `errors` standard errors; 1 if it is NaN.
    fn p_value(&self, errors: f64) -> f64 {
        if errors.is_nan() {
            return 1.0;
        }
        2.0 * self.student().map_or_else(|| Normal::standard().sf(errors.abs()), |t| t.sf(errors.abs()))
    }

    /// Returns the probability of a larger rise of χ² by `extra` parameters.
    pub(super) fn of_rise(&self, rise: f64, extra: usize) -> f64 {
        let extra = extra as f64;
        if self.estimated {
            FisherSnedecor::new(extra, self.dof.max(1) as f64).map_or(f64::NAN, |f| f.sf(rise / extra))
        } else {
            ChiSquared::new(extra).map_or(f64::NAN, |d| d.sf(rise))
        }
    }

    /// Returns the difference of two labels, `value` the second less the first.
    pub fn pair(&self, first: usize, second: usize, value: f64, std_error: f64) -> Difference {
        let t = self.quantile();
        let p_value = self.p_value(value / std_error);
        let interval_95 = [value - t * std_error, value + t * std_error];
        Difference { first, second, value, std_error, interval_95, p_value, p_holm: p_value }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One shot a label leaves no error: such labels are not told apart, and nothing panics.
    #[test]
    fn labels_without_errors_are_not_told_apart() {
        for estimated in [true, false] {
            let tests = Tests { dof: 0, estimated };
            for (value, std_error) in [(0.0, 0.0), (0.1, f64::NAN)] {
                assert!(tests.pair(0, 1, value, std_error).p_value >= 1.0);
            }
        }
    }
}
