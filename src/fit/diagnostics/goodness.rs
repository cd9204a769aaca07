//! Do model and noise describe the residuals? χ² and normality here, `trends` and `influence` in their own files.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal};
use statrs::stats_tests::anderson_darling::anderson_darling;

use super::basis::{Basis, OWN};
use super::influence::{Influence, influence};
use super::trends::{ROUNDING, Trend, trends};
use crate::physics::name::worded;

pub(in crate::fit) use super::basis::Context;

/// A χ² this improbable, at either end, means that the stated noise does not describe the residuals.
pub(in crate::fit) const IMPROBABLE: f64 = 0.001;

/// Standard deviations that are too large by less than this do no harm, however many shots show it.
const HARMLESS: f64 = 0.05;

/// An Anderson-Darling statistic beyond which the formula for its probability no longer holds: there is none.
const HOPELESS: f64 = 13.0;

/// Fewer residuals say nothing of their distribution (D'Agostino and Stephens 1986, Table 4.9).
const ENOUGH: usize = 8;

/// How well model and noise describe the residuals.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Goodness {
    /// χ² of what is tested, see [`Fit::tested`](crate::fit::Fit::tested). That of the frames, where they agree with the model
    /// though what was extracted from them does not.
    pub chi2: f64,
    /// Its degrees of freedom.
    pub dof: usize,
    /// Whether χ² can be tested: the noise is stated, and no shot is down-weighted.
    pub noise_is_stated: bool,
    /// The probability of a larger χ² if model and stated noise were right; `None` where the noise was estimated from
    /// these residuals, or shots were down-weighted.
    pub p_value: Option<f64>,
    /// Whether the stated noise explains the residuals.
    pub noise: NoiseVerdict,
    /// √(χ²/dof): the factor by which the stated standard deviations are too small; `None` where χ² cannot be tested.
    pub noise_factor: Option<f64>,
    /// All trends that were looked for, the most significant first; none where what was extracted from frames is off.
    pub trends: Vec<Trend>,
    /// Whether the residuals are normally distributed; `None` with fewer than eight residuals.
    pub normality: Option<Normality>,
    /// The most influential shots, in descending order.
    pub influence: Vec<Influence>,
    /// Cook's distance above which a shot is influential: the median of F(p, n − p).
    pub influential_from: Option<f64>,
}

worded! {
    /// Whether the stated noise explains the residuals.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum NoiseVerdict {
        /// There is nothing to compare: the noise was estimated from the residuals, or no degree of freedom is left.
        NotTested = "not-tested",
        /// The residuals are as large as the stated noise.
        Explains = "explains-residuals",
        /// The stated noise is too small: the residuals are larger.
        TooSmall = "too-small",
        /// The stated noise is too large: the residuals are smaller.
        TooLarge = "too-large",
    }
    /// The name in fit.json.
    pub fn name;
}

/// Anderson and Darling's test of the residuals, each over its own standard deviation, against a normal
/// distribution of their mean and standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normality {
    /// Anderson and Darling's statistic A².
    pub statistic: f64,
    /// The probability of a larger one if the residuals are normally distributed.
    pub p_value: f64,
}

/// Tests the residuals of a fit.
pub(in crate::fit) fn goodness(context: &Context) -> Goodness {
    let of = |chi2: f64, dof: usize| ChiSquared::new(dof as f64).ok().map(|d| d.sf(chi2));
    let (chi2, dof) = (2.0 * context.minimum.cost, context.dof);
    let p_value = of(chi2, dof).filter(|_| context.tests_noise);
    let noise_factor = p_value.map(|_| (chi2 / dof as f64).sqrt());
    let noise = match p_value {
        None => NoiseVerdict::NotTested,
        Some(p) if p < IMPROBABLE => NoiseVerdict::TooSmall,
        Some(p) if context.states_noise && p > 1.0 - IMPROBABLE && noise_factor < Some(1.0 - HARMLESS) => {
            NoiseVerdict::TooLarge
        }
        Some(_) => NoiseVerdict::Explains,
    };
    let basis = Basis::new(context);
    let parameters = basis.fitted as f64;
    let influential_from = FisherSnedecor::new(parameters, context.dof as f64)
        .ok()
        .map(|f| f.inverse_cdf(0.5))
        .filter(|x| x.is_finite());
    Goodness {
        chi2,
        dof,
        noise_is_stated: context.tests_noise,
        p_value,
        noise,
        noise_factor,
        trends: trends(context, &basis),
        normality: normality(context, &basis),
        influence: influence(context, &basis, influential_from),
        influential_from,
    }
}

fn normality(context: &Context, basis: &Basis) -> Option<Normality> {
    let observations: usize = basis.rows.iter().map(|(_, count)| count).sum();
    let standardized: Vec<f64> = (0..observations)
        .filter_map(|row| {
            let left = 1.0 - basis.q.row(row).norm_squared();
            (left > OWN).then(|| context.minimum.residuals[row] / left.sqrt())
        })
        .filter(|value| value.is_finite())
        .collect();
    normality_of(&standardized)
}

/// Tests standardized residuals; `None` for too few.
pub(in crate::fit) fn normality_of(standardized: &[f64]) -> Option<Normality> {
    let n = standardized.len();
    if n < ENOUGH {
        return None;
    }
    let mean = standardized.iter().sum::<f64>() / n as f64;
    let variance = standardized.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1) as f64;
    let normal = Normal::new(mean, variance.sqrt()).ok().filter(|_| variance > ROUNDING)?;
    let (statistic, p_value) = anderson_darling(standardized, &normal).ok()?;
    let p_value = if statistic < HOPELESS { p_value.clamp(0.0, 1.0) } else { 0.0 };
    Some(Normality { statistic: if statistic.is_finite() { statistic } else { f64::MAX }, p_value })
}
