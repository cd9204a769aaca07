//! Intervals and regions that need more than the minimum, as fit.json holds them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ByName, finite, names, parameter_names};
use crate::fit;

/// Intervals from resampled shots.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Bootstrap {
    /// Number of samples.
    pub replicates: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of samples that could not be fitted or do not determine a parameter.
    pub failed: usize,
    /// By the name of the parameter, in its unit.
    #[schemars(extend("propertyNames" = parameter_names()))]
    pub parameters: ByName<Resampled>,
}

impl From<&fit::Bootstrap> for Bootstrap {
    fn from(found: &fit::Bootstrap) -> Self {
        let parameters = found.estimates.iter().map(|one| {
            let resampled = Resampled {
                std_error: one.std_error,
                bias: one.bias,
                interval_95_percentile: one.percentile.map(finite),
                interval_95_bca: one.bca.map(finite),
            };
            (one.parameter.name().to_owned(), resampled)
        });
        Self {
            replicates: found.replicates,
            seed: found.seed,
            failed: found.failed,
            parameters: parameters.collect(),
        }
    }
}

/// A parameter over the samples of a bootstrap.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Resampled {
    /// Standard deviation of the estimates.
    pub std_error: f64,
    /// Mean of the estimates less the estimate of all shots.
    pub bias: f64,
    /// 95 % interval between percentiles of the estimates: lower and upper end.
    pub interval_95_percentile: [Option<f64>; 2],
    /// 95 % interval, bias-corrected and accelerated: lower and upper end.
    pub interval_95_bca: [Option<f64>; 2],
}

/// The confidence regions of a pair of parameters.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Contour {
    /// Names of both parameters.
    pub parameters: Vec<String>,
    /// Estimates of both parameters, in their units.
    pub centre: [f64; 2],
    /// One region for each probability.
    pub levels: Vec<Level>,
}

impl From<&fit::Contour> for Contour {
    fn from(found: &fit::Contour) -> Self {
        let level = |level: &fit::Level| Level {
            probability: level.probability,
            chi2_rise: level.rise,
            edge: level.edge.clone(),
        };
        Self {
            parameters: names(&found.parameters),
            centre: found.centre,
            levels: found.levels.iter().map(level).collect(),
        }
    }
}

/// A confidence region.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Level {
    /// Probability that the region holds both true values, as 0.68 or 0.95.
    pub probability: f64,
    /// Rise of χ² above its minimum at the edge.
    pub chi2_rise: f64,
    /// Points of the closed edge: values of the first and of the second parameter.
    pub edge: Vec<[f64; 2]>,
}

/// The profile of a parameter.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Profile {
    /// Name of the parameter.
    pub parameter: String,
    /// Values of the parameter, in its unit, ascending.
    pub value: Vec<f64>,
    /// χ², least over all other parameters, above its minimum, for each value.
    pub chi2_rise: Vec<f64>,
}

impl From<&fit::Profile> for Profile {
    fn from(found: &fit::Profile) -> Self {
        let (value, chi2_rise) = found.points.iter().map(|[value, rise]| (*value, *rise)).unzip();
        Self { parameter: found.parameter.name().to_owned(), value, chi2_rise }
    }
}
