//! How far a fit can be trusted, as fit.json says it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ByName, each, finite, names, parameter_names};
use crate::fit;
use crate::measurement::parameter::Parameter;

/// Returns values by the names of their parameters.
pub(super) fn by_parameter<T, D>(values: &[(Parameter, T)], document: impl Fn(&T) -> D) -> ByName<D> {
    values.iter().map(|(parameter, value)| (parameter.name().to_owned(), document(value))).collect()
}

/// Shots that were computed with the same fidelity and effects.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Computed {
    /// elastic, inelastic, linear, full, ode or contact.
    pub fidelity: String,
    /// Names of the effects that were on.
    pub effects: Vec<String>,
    /// Number of shots.
    pub shots: usize,
}

impl From<&fit::Computed> for Computed {
    fn from(found: &fit::Computed) -> Self {
        let on = found.effects.list().into_iter().filter(|(_, on)| *on);
        Self {
            fidelity: found.fidelity.name().to_owned(),
            effects: on.map(|(name, _)| name.to_owned()).collect(),
            shots: found.shots,
        }
    }
}

/// Which combinations of parameters the data determine.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Identifiability {
    /// Names of the free parameters.
    pub parameters: Vec<String>,
    /// Singular values of the Jacobian with scaled columns, the largest first.
    pub singular_values: Vec<f64>,
    /// Largest over smallest singular value: large if parameters can hardly be distinguished; null if it is infinite.
    pub condition_number: Option<f64>,
    /// The combination of parameters that is determined worst; null if at most one parameter is free.
    pub worst: Option<Combination>,
    /// Names of parameters that change no prediction.
    pub silent: Vec<String>,
}

impl From<&fit::Identifiability> for Identifiability {
    fn from(found: &fit::Identifiability) -> Self {
        Self {
            parameters: names(&found.parameters),
            singular_values: found.singular_values.clone(),
            condition_number: finite(found.condition),
            worst: found.worst.as_ref().map(Combination::from),
            silent: names(&found.silent),
        }
    }
}

/// A combination of parameters that is determined badly.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Combination {
    /// The combination as a sentence.
    pub words: String,
    /// How each parameter moves along the combination by one standard error, in its unit.
    #[schemars(extend("propertyNames" = parameter_names()))]
    pub one_standard_error_along: ByName<Option<f64>>,
    /// Whether it is determined, but badly.
    pub weak: bool,
    /// Whether the data do not determine it.
    pub undetermined: bool,
    /// The combination that is determined instead; null if there is none.
    pub determined: Option<Determined>,
}

impl From<&fit::Combination> for Combination {
    fn from(found: &fit::Combination) -> Self {
        let determined = found.determined.as_ref().map(|(name, estimate, error)| Determined {
            name: name.clone(),
            estimate: *estimate,
            std_error: finite(*error),
        });
        Self {
            words: found.words.clone(),
            one_standard_error_along: by_parameter(&found.terms, |step| finite(*step)),
            weak: found.weak,
            undetermined: found.undetermined,
            determined,
        }
    }
}

/// A combination of parameters that is determined.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Determined {
    /// The combination, as in mu·mu_s.
    pub name: String,
    /// Its value.
    pub estimate: f64,
    /// Its standard error.
    pub std_error: Option<f64>,
}

/// Tests of the residuals.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Goodness {
    /// What is tested: angles, velocities, coordinates or impulses.
    pub counted: String,
    /// χ² of the residuals that are tested, without priors.
    pub chi2: Option<f64>,
    /// Degrees of freedom of this χ².
    pub dof: usize,
    /// Probability of a larger χ² if model and noise are right; null if the noise was estimated from the residuals.
    pub p_value: Option<f64>,
    /// Whether the stated noise explains the residuals, in a word.
    pub stated_noise: String,
    /// Factor by which the stated noise would explain the residuals; null if no noise is stated.
    pub noise_factor: Option<f64>,
    /// Whether residuals change with speed, cut angle or spin.
    pub trends: Vec<Trend>,
    /// Test of whether residuals are normally distributed; null for too few.
    pub normality: Option<Normality>,
    /// The shots that matter most, the first the most.
    pub influence: Vec<Influence>,
    /// Cook's distance from which on a shot is called influential.
    pub influential_from_cook_distance: Option<f64>,
}

impl Goodness {
    pub(super) fn of(found: &fit::Goodness, counted: fit::Counted) -> Self {
        Self {
            counted: counted.name().to_owned(),
            chi2: finite(found.chi2),
            dof: found.dof,
            p_value: found.p_value,
            stated_noise: found.noise.name().to_owned(),
            noise_factor: found.noise_factor,
            trends: each(&found.trends),
            normality: found.normality.map(|normality| Normality {
                anderson_darling: normality.statistic,
                p_value: finite(normality.p_value),
            }),
            influence: each(&found.influence),
            influential_from_cook_distance: found.influential_from,
        }
    }
}

/// A trend of residuals.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Trend {
    /// What the residuals are of, in words.
    pub residuals_of: String,
    /// What the residuals change with.
    pub against: String,
    /// Change of a residual, in its standard deviations, per unit of what it changes with.
    pub slope_sd: Option<f64>,
    /// That unit.
    pub slope_per: String,
    /// Probability of such a slope by chance.
    pub p_value: Option<f64>,
    /// p_value corrected for all trends that were tested (Holm).
    pub p_corrected: Option<f64>,
    /// Whether p_corrected is below 0.05.
    pub significant: bool,
    /// The trend as a sentence.
    pub words: String,
}

impl From<&fit::Trend> for Trend {
    fn from(found: &fit::Trend) -> Self {
        Self {
            residuals_of: found.quantity.to_owned(),
            against: found.variable.name().to_owned(),
            slope_sd: finite(found.slope),
            slope_per: found.variable.unit().to_owned(),
            p_value: finite(found.p_value),
            p_corrected: finite(found.p_corrected),
            significant: found.significant,
            words: found.words.clone(),
        }
    }
}

/// A test of normality.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Normality {
    /// Statistic of Anderson and Darling.
    pub anderson_darling: f64,
    /// Probability of a larger statistic if the residuals are normally distributed.
    pub p_value: Option<f64>,
}

/// How much a shot matters.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Influence {
    /// Name of the shot.
    pub shot: String,
    /// How much of its own prediction the shot decides, summed over its numbers.
    pub leverage: Option<f64>,
    /// Cook's distance: how far all estimates move without the shot, in their errors; null if it is infinite.
    pub cook_distance: Option<f64>,
    /// How far each estimate moves without the shot, in standard errors.
    #[schemars(extend("propertyNames" = parameter_names()))]
    pub shift_without_it_in_std_errors: ByName<Option<f64>>,
}

impl From<&fit::Influence> for Influence {
    fn from(found: &fit::Influence) -> Self {
        Self {
            shot: found.shot.clone(),
            leverage: finite(found.leverage),
            cook_distance: finite(found.cook),
            shift_without_it_in_std_errors: by_parameter(&found.shifts, |shift| finite(*shift)),
        }
    }
}

/// Shots that count less under a robust loss.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Robust {
    /// huber or cauchy.
    pub loss: String,
    /// Distance from which on an observation counts less, in standard deviations.
    pub tuning_constant: Option<f64>,
    /// How the errors were found.
    pub covariance: String,
    /// The shots that count less, the least first.
    pub weights_below_1: Vec<Weight>,
}

impl From<&fit::Robust> for Robust {
    fn from(found: &fit::Robust) -> Self {
        let weight = |(shot, weight): &(String, f64)| Weight { shot: shot.clone(), weight: *weight };
        Self {
            loss: found.loss.name().to_owned(),
            tuning_constant: finite(found.loss.tuning()),
            covariance: "sandwich".to_owned(),
            weights_below_1: found.weights.iter().map(weight).collect(),
        }
    }
}

/// The weight of a shot.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Weight {
    /// Name of the shot.
    pub shot: String,
    /// Its weight, 0 to 1.
    pub weight: f64,
}

/// Another model on the same data.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Alternative {
    /// What is different, in words.
    pub model: String,
    /// Why it could not be fitted; null if it was.
    pub failed: Option<String>,
    /// Its estimates by parameter, in its unit; empty if the data contradict the fit.
    #[schemars(extend("propertyNames" = parameter_names()))]
    pub values: ByName<Option<f64>>,
    /// Number of parameters and noises that were estimated.
    pub fitted_parameters: usize,
    /// Akaike's criterion of this model less that of the fit: negative favours this model.
    pub delta_aic: Option<f64>,
    /// Bayesian criterion of this model less that of the fit: negative favours this model.
    pub delta_bic: Option<f64>,
    /// Test of the simpler of two models if one contains the other.
    pub likelihood_ratio: Option<LikelihoodRatio>,
}

impl From<&fit::Alternative> for Alternative {
    fn from(found: &fit::Alternative) -> Self {
        Self {
            model: found.name.to_owned(),
            failed: found.failed.clone(),
            values: by_parameter(&found.values, |value| finite(*value)),
            fitted_parameters: found.parameters,
            delta_aic: finite(found.delta_aic),
            delta_bic: finite(found.delta_bic),
            likelihood_ratio: found.likelihood_ratio.map(|ratio| LikelihoodRatio {
                statistic: finite(ratio.statistic),
                p_value: finite(ratio.p_value),
            }),
        }
    }
}

/// A likelihood-ratio test.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LikelihoodRatio {
    /// By how much −2 log L of the larger model is lower.
    pub statistic: Option<f64>,
    /// Probability of a larger statistic if the simpler model is right.
    pub p_value: Option<f64>,
}

/// The smallest errors that the frames allow (Cramér–Rao).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Bound {
    /// The smallest standard error by parameter, in its unit.
    #[schemars(extend("propertyNames" = parameter_names()))]
    pub std_errors: ByName<f64>,
    /// Number of shots.
    pub shots: usize,
}

impl From<&fit::Bound> for Bound {
    fn from(found: &fit::Bound) -> Self {
        Self { std_errors: by_parameter(&found.std_errors, |error| *error), shots: found.shots }
    }
}

/// What the shots of a film share.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Joint {
    /// Probability of a larger χ² if model and noise are right; null if the noise was estimated from the frames.
    pub p_value: Option<f64>,
    /// Number of coordinates, and components of spins that markers show, that were fitted.
    pub observations: usize,
    /// Number of unknowns that the shots have of their own, together.
    pub shot_unknowns: usize,
    /// The unknowns.
    #[serde(flatten)]
    pub shared: ByName<SharedUnknown>,
}

/// An unknown of cloth, spin or time that all shots share.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SharedUnknown {
    /// Estimate from all frames, in the unit at the end of its name, else a ratio.
    pub value: f64,
    /// Its standard error, same unit.
    pub std_error: f64,
    /// 95 % interval: lower and upper end.
    pub interval_95: [f64; 2],
}
