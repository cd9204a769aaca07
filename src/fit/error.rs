//! Why a data set cannot be fitted.

use super::Rejected;
use crate::measurement::dataset::ON_REQUEST;
use crate::problem::{FilmError, RowsError};

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
    /// A table cannot be fitted; with the name of the data set.
    #[error("{0}: {1}")]
    Rows(String, #[source] RowsError),
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
    /// The frames of a film cannot be fitted.
    #[error(
        "{0}: {1}. Check that the object ball lies still before the impact and the camera does not move, the radius, capture_fps \
             and which track is which ball"
    )]
    Film(String, #[source] FilmError),
}

impl FitError {
    /// Whether the input was wrong, rather than that it could not be fitted.
    #[must_use]
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::Invalid { .. } | Self::Options(_) => true,
            Self::Rows(_, error) => !matches!(error, RowsError::NoShot { .. } | RowsError::NoStart),
            Self::NoUsableShot { .. } | Self::Film(..) => false,
        }
    }
}

fn first_reason(rejected: &[Rejected]) -> String {
    // what was asked for is no news
    let told = rejected.iter().find(|r| r.reason != ON_REQUEST).or(rejected.first());
    told.map_or(String::new(), |r| format!(": shot {}: {}", r.shot, r.reason))
}
