//! From the Jacobian at the minimum to standard errors, intervals and what is not determined.

use nalgebra::DMatrix;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use super::minimum::{Minimum, covariance};
use super::robust::Sandwich;
use super::{Estimate, Status};
use crate::measurement::parameter::{Parameter, Settings};
use crate::numerics::least_squares::Activity;

/// Standard errors with and without a bound are both given when they differ by more than this part.
const WORTH_SAYING: f64 = 0.1;

pub(super) struct Uncertainty {
    /// In the order of the free parameters.
    pub estimates: Vec<Estimate>,
    /// NaN where there is no standard error.
    pub correlation: DMatrix<f64>,
}

/// Standard errors from (JᵀJ)⁻¹. A parameter at a bound gets a one-sided interval and no error; for
/// the others it counts once as free (`std_error`) and once as exactly at its bound. Without
/// quantiles, where the noise is not known, there are no errors.
pub(super) fn of(
    minimum: &Minimum,
    free: &[Parameter],
    settings: &Settings,
    quantiles: Option<&Quantiles>,
    sandwich: Option<&Sandwich>,
) -> Uncertainty {
    let count = free.len();
    // behind the free parameters there may be errors that the shots share
    let columns = minimum.jacobian.ncols();
    let at_bound: Vec<usize> = (0..count).filter(|i| minimum.active[*i] != Activity::Free).collect();
    let inner: Vec<usize> = (0..columns).filter(|i| !at_bound.contains(i)).collect();
    let all: Vec<usize> = (0..columns).collect();
    let covariance = |columns: &[usize]| match sandwich {
        None => covariance(&minimum.jacobian.select_columns(columns)),
        Some(sandwich) => sandwich.covariance(columns),
    };
    let released = quantiles.and_then(|_| covariance(&all));
    let conditional = quantiles.and_then(|_| covariance(&inner));

    let mut estimates: Vec<Estimate> = free
        .iter()
        .enumerate()
        .map(|(i, parameter)| Estimate::bare(*parameter, minimum.x[i], minimum.active[i].into()))
        .collect();
    let mut correlation = DMatrix::from_element(count, count, f64::NAN);
    let (Some(quantiles), Some(released), Some(conditional)) = (quantiles, released, conditional) else {
        return Uncertainty { estimates, correlation };
    };

    // how far the others may follow a parameter off its bound, below and above
    let mut follow = vec![[0.0_f64; 2]; columns];
    for b in &at_bound {
        let mut with_b = inner.clone();
        with_b.push(*b);
        let Some(covariance) = covariance(&with_b) else { continue };
        let last = with_b.len() - 1;
        // the profile of the cost rises as g x + x²/2v from the bound; it has risen by t²/2 at
        // x = v(−g + √(g² + t²/v))
        let (g, v) = (minimum.gradient[*b].abs(), covariance[(last, last)]);
        let reach = v * (-g + (g * g + quantiles.one_sided.powi(2) / v).sqrt());
        let setting = &settings[free[*b]];
        let (value, inward) = match estimates[*b].status {
            Status::AtUpperBound => (setting.upper, -1.0),
            _ => (setting.lower, 1.0),
        };
        let end = (value + inward * reach).clamp(setting.lower, setting.upper);
        estimates[*b].interval_95 = Some([value.min(end), value.max(end)]);
        for (row, i) in inner.iter().enumerate() {
            let shift = inward * reach * covariance[(row, last)] / v;
            follow[*i][usize::from(shift > 0.0)] += shift;
        }
    }
    for (row, i) in inner.iter().enumerate().filter(|(_, i)| **i < count) {
        let (at_bound, released) = (conditional[(row, row)].sqrt(), released[(*i, *i)].sqrt());
        let setting = &settings[free[*i]];
        let value = minimum.x[*i];
        let estimate = &mut estimates[*i];
        estimate.std_error = Some(released);
        estimate.std_error_at_bound = (released > (1.0 + WORTH_SAYING) * at_bound).then_some(at_bound);
        let half = quantiles.two_sided * at_bound;
        let [below, above] = follow[*i];
        estimate.interval_95 =
            Some([(value - half + below).max(setting.lower), (value + half + above).min(setting.upper)]);
    }
    for i in inner.iter().filter(|i| **i < count) {
        for j in inner.iter().filter(|j| **j < count) {
            correlation[(*i, *j)] = released[(*i, *j)] / (released[(*i, *i)] * released[(*j, *j)]).sqrt();
        }
    }
    Uncertainty { estimates, correlation }
}

/// Quantiles of the standard error: normal where the noise is stated, Student's t where it was
/// estimated from the residuals.
pub(super) struct Quantiles {
    /// 97.5 %.
    pub two_sided: f64,
    /// 95 %.
    pub one_sided: f64,
}

impl Quantiles {
    /// `None` without degrees of freedom.
    pub(super) fn new(estimated_dof: Option<usize>) -> Option<Self> {
        let pair = |two_sided, one_sided| Self { two_sided, one_sided };
        match estimated_dof {
            None => {
                let normal = Normal::standard();
                Some(pair(normal.inverse_cdf(0.975), normal.inverse_cdf(0.95)))
            }
            Some(dof) => {
                let t = StudentsT::new(0.0, 1.0, dof as f64).ok()?;
                Some(pair(t.inverse_cdf(0.975), t.inverse_cdf(0.95)))
            }
        }
    }
}
