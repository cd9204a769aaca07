//! Why there is no comparison.

use crate::fit::FitError;

/// Why data sets cannot be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// Data sets or options do not go together, as the sentence states.
    #[error("{0}")]
    Refused(String),
    /// A data set is wrong, as [`Dataset::faults`](crate::measurement::dataset::Dataset::faults) states it.
    #[error("{dataset}: {}", .faults.join("\n"))]
    Invalid {
        /// The name of the data set.
        dataset: String,
        /// The faults, in sentences.
        faults: Vec<String>,
    },
    /// The fit of a data set failed.
    #[error(transparent)]
    Fit(#[from] FitError),
}

impl CompareError {
    /// Whether the input was wrong, rather than that it could not be compared.
    pub fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Fit(error) if !error.is_bad_input())
    }
}
