//! How far a fit can be trusted: what the data determine, whether model and noise describe the
//! residuals, and the shots that matter most.

use schemars::JsonSchema;
use serde::Serialize;
use statrs::distribution::Normal;
use statrs::stats_tests::anderson_darling::anderson_darling;

use super::deviations::Trend;
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;
use crate::measurement::written::written_by_name;
use crate::name::{ByName, worded};
use crate::numerics::EXACT;
use crate::problem::Combination;

/// An Anderson-Darling statistic beyond which the formula for its probability does not hold.
const MAX_STATISTIC: f64 = 13.0;

/// Fewer residuals do not test their distribution (D'Agostino and Stephens 1986, Table 4.9).
const ENOUGH: usize = 8;

/// Tests of the residuals.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Goodness {
    /// The tested numbers: angles, velocities or impulses.
    pub(crate) counted: Counted,
    /// χ² of the residuals that are tested, without priors.
    #[schemars(with = "Option<f64>")]
    pub(crate) chi2: f64,
    /// Degrees of freedom of this χ².
    pub(crate) dof: usize,
    /// Probability of a larger χ² if model and noise are right; null if the noise was estimated
    /// from the residuals, or shots were down-weighted.
    pub(crate) p_value: Option<f64>,
    /// Whether the stated noise explains the residuals, in a word.
    pub(crate) stated_noise: NoiseVerdict,
    /// √(χ²/dof), by which the stated noise would explain the residuals; null if χ² cannot be
    /// tested.
    pub(crate) noise_factor: Option<f64>,
    /// Whether residuals change with speed, cut angle or spin, the most significant trend first.
    pub(crate) trends: Vec<Trend>,
    /// Test of whether residuals are normally distributed; null for fewer than eight.
    pub(crate) normality: Option<Normality>,
    /// The shots that matter most, the first the most.
    pub(crate) influence: Vec<Influence>,
    /// Cook's distance from which on a shot is called influential: the median of F(p, n − p).
    #[serde(rename = "influential_from_cook_distance")]
    pub(crate) influential_from: Option<f64>,
}

worded! {
    /// The kind of the measured numbers whose squared residuals are summed.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub(crate) enum Counted {
        /// Coordinates of the balls in the frames, and components of spins that markers show.
        Coordinates = "coordinates" | "the frames' coordinates",
        /// Components of velocities, and of spins, after the impact.
        Velocities = "velocities" | "the velocities",
        /// Angles, speeds and their ratios.
        #[default]
        Angles = "angles" | "the angles and speeds",
        /// The restitution and the ratio of the impulses of each shot of discs.
        Impulses = "impulses" | "e and J_t/J_n of the shots",
    }
    /// The name in fit.json.
    pub fn name;
    /// The name in a sentence.
    pub fn words;
}

written_by_name!(Counted);

impl Counted {
    /// Returns the kind of some observables.
    pub(crate) fn of<'a>(observables: impl Iterator<Item = &'a Observable> + Clone) -> Self {
        let has = |kind: &[Observable]| observables.clone().any(|observable| kind.contains(observable));
        if has(&Observable::IMPACTS) {
            Self::Velocities
        } else if has(&Observable::DISCS) {
            Self::Impulses
        } else {
            Self::Angles
        }
    }
}

/// Which combinations of parameters the data determine, at the minimum.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Identifiability {
    /// Names of the free parameters that some observation depends on.
    pub(crate) parameters: Vec<Parameter>,
    /// Singular values of the whitened Jacobian, the largest first. Its columns are scaled to
    /// length 1 (and made orthogonal to errors that the shots share), so that all are 1 if the
    /// parameters do not interfere.
    pub(crate) singular_values: Vec<f64>,
    /// Largest over smallest singular value: large if parameters are weakly distinguished; null if
    /// it is infinite.
    #[schemars(with = "Option<f64>")]
    pub(crate) condition_number: f64,
    /// The combination of parameters that is determined worst; null if at most one parameter is
    /// free.
    pub(crate) worst: Option<Combination>,
    /// Names of free parameters that change no prediction.
    pub(crate) silent: Vec<Parameter>,
}

/// How much a shot matters.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Influence {
    /// Name of the shot.
    pub(crate) shot: String,
    /// How much of its own prediction the shot decides, summed over its numbers; over all shots the
    /// number of parameters.
    #[schemars(with = "Option<f64>")]
    pub(crate) leverage: f64,
    /// Cook's distance: how far all estimates move without the shot, in their joint error, squared
    /// and per parameter; null if it is infinite, since something is then not determined.
    #[schemars(with = "Option<f64>")]
    pub(crate) cook_distance: f64,
    /// How far each estimate moves without the shot, in standard errors.
    #[serde(rename = "shift_without_it_in_std_errors")]
    #[schemars(with = "ByName<Option<f64>>")]
    pub(crate) shifts: ByName<f64>,
}

worded! {
    /// Whether the stated noise explains the residuals.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub(crate) enum NoiseVerdict {
        /// A comparison is impossible: the noise was estimated from the residuals, or no degree of
        /// freedom is left.
        #[default]
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

written_by_name!(NoiseVerdict);

/// A test of normality: of the residuals, each over its own standard deviation, against a normal
/// distribution of their mean and standard deviation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Normality {
    /// Statistic A² of Anderson and Darling.
    pub(crate) anderson_darling: f64,
    /// Probability of a larger statistic if the residuals are normally distributed.
    #[schemars(with = "Option<f64>")]
    pub(crate) p_value: f64,
}

/// Tests standardized residuals; `None` for too few.
pub(in crate::fit) fn normality_of(standardized: &[f64]) -> Option<Normality> {
    let n = standardized.len();
    if n < ENOUGH {
        return None;
    }
    let mean = standardized.iter().sum::<f64>() / n as f64;
    let variance = standardized.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1) as f64;
    let normal = Normal::new(mean, variance.sqrt()).ok().filter(|_| variance > EXACT)?;
    let (statistic, p_value) = anderson_darling(standardized, &normal).ok()?;
    let p_value = if statistic < MAX_STATISTIC { p_value.clamp(0.0, 1.0) } else { 0.0 };
    Some(Normality { anderson_darling: if statistic.is_finite() { statistic } else { f64::MAX }, p_value })
}
