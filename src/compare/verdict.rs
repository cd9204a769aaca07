//! How surely: p-values of pairs and of "same" against "different", corrected for their number.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal, StudentsT};

use super::effect::Effect;
use super::findings::Finding;
use super::quantity::Quantity;
use super::result::{Compared, Difference};
use crate::measurement::parameter::Parameter;
use crate::physics::ball::Ball;
use crate::physics::collision::Coefficients;
use crate::problem::{Policy, Solution};

/// How sums of squares are judged.
#[derive(Clone, Copy)]
pub(super) struct Tests {
    pub dof: usize,
    /// The noise was estimated from the residuals, or the errors from the scatter of the shots.
    pub estimated: bool,
}

impl Tests {
    /// Returns those of a fit. By a robust loss the scatter of the shots gives the errors.
    pub(super) fn new(solution: &Solution) -> Self {
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
    pub(super) fn quantile(&self) -> f64 {
        self.student().map_or_else(|| Normal::standard().inverse_cdf(0.975), |t| t.inverse_cdf(0.975))
    }

    /// Returns the two-sided probability of a difference of so many standard errors; 1 where neither is known.
    fn p_value(&self, errors: f64) -> f64 {
        if errors.is_nan() {
            return 1.0;
        }
        2.0 * self.student().map_or_else(|| Normal::standard().sf(errors.abs()), |t| t.sf(errors.abs()))
    }

    /// Probability of a larger rise of χ² by `extra` parameters.
    pub(super) fn of_rise(&self, rise: f64, extra: usize) -> f64 {
        let extra = extra as f64;
        if self.estimated {
            FisherSnedecor::new(extra, self.dof.max(1) as f64).map_or(f64::NAN, |f| f.sf(rise / extra))
        } else {
            ChiSquared::new(extra).map_or(f64::NAN, |d| d.sf(rise))
        }
    }

    /// Of two labels, `value` the second less the first.
    pub(super) fn pair(&self, first: usize, second: usize, value: f64, std_error: f64) -> Difference {
        let t = self.quantile();
        let p_value = self.p_value(value / std_error);
        let interval_95 = [value - t * std_error, value + t * std_error];
        Difference { first, second, value, std_error, interval_95, p_value, p_holm: p_value, effect: None }
    }
}

/// Wald's statistic dᵀV⁻¹d of the differences d of some unknowns from the first of them, with V the covariance of d within
/// its `rank` largest directions. `None` of fewer than two, or where an error is missing.
pub(super) fn wald(x: &[f64], covariance: &DMatrix<f64>, columns: &[usize], rank: usize) -> Option<f64> {
    let [first, others @ ..] = columns else { return None };
    if others.is_empty() {
        return None;
    }
    let d = DVector::from_iterator(others.len(), others.iter().map(|c| x[*c] - x[*first]));
    let v = DMatrix::from_fn(others.len(), others.len(), |i, j| {
        let (i, j) = (others[i], others[j]);
        covariance[(i, j)] - covariance[(i, *first)] - covariance[(*first, j)] + covariance[(*first, *first)]
    });
    if v.iter().any(|entry| !entry.is_finite()) {
        return None;
    }
    let eigen = v.symmetric_eigen();
    let mut order: Vec<usize> = (0..others.len()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let term = |i: &usize| eigen.eigenvectors.column(*i).dot(&d).powi(2) / eigen.eigenvalues[*i];
    Some(order.iter().take(rank).map(term).sum())
}

/// Returns that the data contradict a shared quantity at the level at which a fit becomes doubtful.
pub(super) fn contradiction(compared: &Compared) -> Option<Finding> {
    let p_value = compared.same_or_different.filter(|_| compared.shared)?.p_value;
    let level = 2.0 * Normal::standard().sf(Policy::default().conflict);
    (p_value < level).then_some(Finding::NotShared { quantity: compared.quantity, p_value })
}

/// Returns the estimates of a quantity that are at a bound.
pub(super) fn at_bounds(compared: &Compared) -> impl Iterator<Item = Finding> {
    let quantity = compared.quantity;
    let at_bound = compared.estimates.iter().filter(|value| value.at_bound);
    at_bound.map(move |value| Finding::AtBound { quantity, label: value.label, bound: value.value })
}

/// Sets the effect of every difference.
pub(super) fn describe(quantities: &mut [Compared], ball: Ball) {
    let typical = |parameter: Parameter| {
        let own = quantities.iter().find(|compared| compared.quantity == Quantity::Parameter(parameter));
        let known: Vec<f64> = own.iter().flat_map(|own| &own.estimates).map(|value| value.value).collect();
        let mean = known.iter().sum::<f64>() / known.len() as f64;
        if known.is_empty() { parameter.default_setting().initial } else { mean }
    };
    let [mu, mu_s, e] = Parameter::COEFFICIENTS.map(typical);
    for Compared { quantity, estimates, differences, .. } in quantities {
        let value = |label: usize| estimates.iter().find(|v| v.label == Some(label)).map(|v| v.value);
        for Difference { first, second, effect, .. } in differences {
            let values = value(*first).zip(value(*second));
            let at = Coefficients { mu, mu_s, e };
            *effect = values.and_then(|(a, b)| Effect::new(*quantity, ball, &at, [a, b]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of independent numbers.
    #[test]
    fn wald_is_the_scatter_about_the_weighted_mean() {
        let (x, sd) = ([0.0_f64, 1.0, 2.0 / 3.0], [1.0_f64, 1.0, 2.0]);
        let covariance = DMatrix::from_fn(3, 3, |i, j| if i == j { sd[i] * sd[i] } else { 0.0 });
        let weight: f64 = sd.iter().map(|s| s.powi(-2)).sum();
        let mean = x.iter().zip(sd).map(|(x, s)| x * s.powi(-2)).sum::<f64>() / weight;
        let scatter: f64 = x.iter().zip(sd).map(|(x, s)| ((x - mean) / s).powi(2)).sum();
        let found = wald(&x, &covariance, &[0, 1, 2], 2).unwrap();
        assert!((found - scatter).abs() < 1e-12, "{found} {scatter}");
    }

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
