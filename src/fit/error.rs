//! Why a data set cannot be fitted.

use super::Rejected;
use crate::measurement::dataset::ON_REQUEST;
use crate::measurement::number::count_of;

/// Why a data set cannot be fitted. A search that does not converge is not an error: [`Fit::converged`](super::Fit::converged) states it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// No shot can be used.
    #[error("{dataset}: no shot can be used{}", first_reason(.shots_rejected))]
    NoUsableShot {
        /// The name of the data set.
        dataset: String,
        /// Its shots with the reasons.
        shots_rejected: Vec<Rejected>,
    },
    /// There are fewer observations than free parameters.
    #[error(
        "{dataset}: {} for the free parameters {parameters}; expected at least as \
         many observations as parameters: add shots, or fix parameters under [fit]",
        count_of(*observations, "observation")
    )]
    TooFewObservations {
        /// The name of the data set.
        dataset: String,
        /// The number of observations.
        observations: usize,
        /// The names of the free parameters.
        parameters: String,
    },
    /// Some observations of a column have a standard deviation and others none.
    #[error(
        "{dataset}: {column} has a standard deviation in {} (shot {}), but none in {} (shot {}); give all or none",
        .with.0, .with.1, .without.0, .without.1
    )]
    MixedNoise {
        /// The name of the data set.
        dataset: String,
        /// The column.
        column: &'static str,
        /// Place (`file:line`) and name of a shot that has one.
        with: Box<(String, String)>,
        /// Place (`file:line`) and name of a shot that has none.
        without: Box<(String, String)>,
    },
    /// The data set is wrong, as [`Dataset::faults`](crate::measurement::dataset::Dataset::faults) states it.
    #[error("{dataset}: {}", .faults.join("\n"))]
    Invalid {
        /// The name of the data set.
        dataset: String,
        /// What is wrong, in sentences.
        faults: Vec<String>,
    },
    /// A choice of the fit is wrong, as [`Options::faults`](super::Options::faults) states it.
    #[error("options of the fit: {}", .0.join("\n"))]
    Options(Vec<String>),
    /// κ is stated, but the fidelity has a contact that is rigid along its surface.
    #[error(
        "{dataset}: kappa stands in [fit], but with the fidelity {fidelity} a contact is rigid along its surface; expected the fidelity \
         auto, ode or contact with it"
    )]
    Rigid {
        /// The name of the data set.
        dataset: String,
        /// The name of the fidelity.
        fidelity: &'static str,
    },
    /// No search can begin, since no collision can be computed that is like those of the data set, whose name is given.
    #[error(
        "{0}: no collision is like these shots, so that no search can begin. Check that the object ball lies still before the \
         impact and the camera does not move, the radius, capture_fps and which track is which ball"
    )]
    NoStart(String),
    /// The frames of a film cannot be fitted.
    #[error(
        "{0}: {1}. Check that the object ball lies still before the impact and the camera does not move, the radius, capture_fps \
             and which track is which ball"
    )]
    Film(String, #[source] crate::problem::FilmError),
}

impl FitError {
    /// Whether the input was wrong, rather than that it could not be fitted.
    #[must_use]
    pub fn is_bad_input(&self) -> bool {
        matches!(
            self,
            Self::TooFewObservations { .. }
                | Self::MixedNoise { .. }
                | Self::Invalid { .. }
                | Self::Options(_)
                | Self::Rigid { .. }
        )
    }
}

fn first_reason(rejected: &[Rejected]) -> String {
    // what was asked for is no news
    let told = rejected.iter().find(|r| r.reason != ON_REQUEST).or(rejected.first());
    told.map_or(String::new(), |r| format!(": shot {}: {}", r.shot, r.reason))
}
