//! Why there is no fit.

use super::Rejected;
use crate::numerics::least_squares::OptimiseError;

/// Why there is no fit. What a fit ran into numerically is not an error but stands in [`Fit`].
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    #[error("{dataset}: no shot can be used{}", first_reason(.shots_rejected))]
    NoUsableShot { dataset: String, shots_rejected: Vec<Rejected> },
    #[error(
        "{dataset}: {observations} observation(s) for the free parameters {parameters}; expected at least as \
         many observations as parameters: add shots, or fix parameters under [fit]"
    )]
    TooFewObservations { dataset: String, observations: usize, parameters: String },
    #[error(
        "{dataset}: {column} has a standard deviation in {} (shot {}), but none in {} (shot {}); give all or none",
        .with.0, .with.1, .without.0, .without.1
    )]
    MixedNoise {
        dataset: String,
        column: &'static str,
        /// Place (file:line) and shot that has one, and that has none.
        with: Box<(String, String)>,
        without: Box<(String, String)>,
    },
    #[error("the observations cannot be weighted: a covariance is not positive definite")]
    NoWeights,
    /// What is wrong with the data set, as [`Dataset::faults`] says it.
    #[error("{dataset}: {}", .faults.join("\n"))]
    Invalid { dataset: String, faults: Vec<String> },
    #[error(
        "{0}: its impacts have not been extracted from the tracks; call footage::with_impacts before fitting it"
    )]
    NotExtracted(String),
    #[error("{0}: a joint fit needs the frames of every shot, as data sets of kind \"tracks\" have them")]
    NotFilmed(String),
    #[error(
        "{0}: a joint fit takes least squares; leave out the robust loss, or fit with --method two-stage"
    )]
    JointLoss(String),
    #[error(
        "{dataset}: kappa stands in [fit], but with the fidelity {fidelity} a contact is rigid along its surface; expected the fidelity \
         auto, ode or contact with it"
    )]
    Rigid { dataset: String, fidelity: &'static str },
    #[error("{0}")]
    Relations(String),
    #[error(transparent)]
    Optimise(#[from] OptimiseError),
}

impl FitError {
    /// Whether the input was wrong, rather than that it could not be fitted.
    #[must_use]
    pub fn is_bad_input(&self) -> bool {
        matches!(
            self,
            Self::TooFewObservations { .. }
                | Self::MixedNoise { .. }
                | Self::Relations(_)
                | Self::Invalid { .. }
                | Self::NotExtracted(_)
                | Self::NotFilmed(_)
                | Self::JointLoss(_)
                | Self::Rigid { .. }
        )
    }
}

fn first_reason(rejected: &[Rejected]) -> String {
    rejected.first().map_or(String::new(), |r| format!(": shot {}: {}", r.shot, r.reason))
}
