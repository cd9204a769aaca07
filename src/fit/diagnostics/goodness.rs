//! Do model and noise describe the residuals? χ², normality, and the shots that matter most.

use statrs::distribution::Normal;
use statrs::stats_tests::anderson_darling::anderson_darling;

use super::trends::Trend;
use crate::measurement::parameter::Parameter;
use crate::physics::name::worded;

/// The mean square of standardized residuals below which they are rounding of the search.
const ROUNDING: f64 = 1e-12;

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

/// How much a fit depends on one shot.
#[derive(Clone, Debug, PartialEq)]
pub struct Influence {
    /// The name of the shot.
    pub shot: String,
    /// The leverage of all its observations together; over all shots, leverages sum to the number of parameters.
    pub leverage: f64,
    /// Cook's distance: how far the estimates move without the shot, in units of their joint error, squared and per
    /// parameter. Infinite for a shot without which something is not determined.
    pub cook: f64,
    /// How far each parameter would move without the shot, in its standard errors.
    pub shifts: Vec<(Parameter, f64)>,
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
