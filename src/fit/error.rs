//! The request of a fit, and why it cannot be met.

use super::{Options, Rejected};
use crate::measurement::dataset::{Dataset, ON_REQUEST};
use crate::problem::{FilmError, RowsError};

/// Why a data set cannot be fitted. A search that does not converge is not an error:
/// [`Fit::converged`](super::Fit::converged) states it.
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
    /// The data set is wrong, as [`Dataset::faults`](crate::measurement::dataset::Dataset::faults)
    /// states it.
    #[error("{dataset}: {}", .faults.join("\n"))]
    Invalid {
        /// The name of the data set.
        dataset: String,
        /// The faults, in sentences.
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
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::Invalid { .. } | Self::Options(_) => true,
            Self::Rows(_, error) => !matches!(error, RowsError::NoShot { .. } | RowsError::NoStart),
            Self::NoUsableShot { .. } | Self::Film(..) => false,
        }
    }
}

fn first_reason(rejected: &[Rejected]) -> String {
    // a shot that was left out on request needs no reason
    let told = rejected.iter().find(|r| r.reason != ON_REQUEST).or(rejected.first());
    told.map_or(String::new(), |r| format!(": shot {}: {}", r.shot, r.reason))
}

/// A data set, and how it is fitted.
#[derive(Clone, Copy)]
pub(super) struct Request<'a> {
    pub(crate) dataset: &'a Dataset,
    /// Column and label of the shots, if they are fitted separately.
    pub(crate) group: Option<&'a (String, String)>,
    pub(crate) options: &'a Options,
    /// Called after each sample of the bootstrap.
    pub(crate) done: &'a (dyn Fn() + Sync),
}

impl Request<'_> {
    /// Returns how an error names what is fitted.
    fn title(&self) -> String {
        match self.group {
            Some((column, label)) => format!("{} ({column} {label})", self.dataset.name),
            None => self.dataset.name.clone(),
        }
    }

    /// Returns the error of the fit of a table with the name of the data set.
    pub(crate) fn of_rows(&self, error: RowsError) -> FitError {
        let dataset = self.title();
        match error {
            RowsError::NoShot { left_out } => {
                FitError::NoUsableShot { dataset, shots_rejected: rejected(left_out) }
            }
            other => FitError::Rows(dataset, other),
        }
    }

    /// Returns the error of the fit of a film with the name of the data set.
    pub(crate) fn of_film(&self, error: FilmError) -> FitError {
        match error {
            FilmError::NoImpact(reasons) => {
                let stated = &self.dataset.left_out;
                let own = reasons.into_iter().filter(|reason| !stated.contains(reason));
                let all = stated.iter().cloned().chain(own);
                FitError::NoUsableShot { dataset: self.title(), shots_rejected: rejected(all) }
            }
            other => FitError::Film(self.title(), other),
        }
    }
}

/// Returns shots that were left out, from names and reasons.
pub(super) fn rejected(all: impl IntoIterator<Item = (String, String)>) -> Vec<Rejected> {
    all.into_iter().map(|(shot, reason)| Rejected { shot, reason }).collect()
}
