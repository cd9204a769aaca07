//! What is fitted, and how; what an error says of it.

use super::{FitError, Options, Rejected};
use crate::measurement::dataset::Dataset;
use crate::problem::{FilmError, RowsError};

/// What is fitted, and how.
#[derive(Clone, Copy)]
pub(super) struct Request<'a> {
    pub dataset: &'a Dataset,
    /// Column and label of the shots, if they are fitted apart.
    pub group: Option<&'a (String, String)>,
    pub options: &'a Options,
    /// Called after each sample of the bootstrap.
    pub done: &'a (dyn Fn() + Sync),
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
    pub fn of_rows(&self, error: RowsError) -> FitError {
        let dataset = self.title();
        match error {
            RowsError::NoShot { left_out } => {
                FitError::NoUsableShot { dataset, shots_rejected: rejected(left_out) }
            }
            other => FitError::Rows(dataset, other),
        }
    }

    /// Returns the error of the fit of a film with the name of the data set.
    pub fn of_film(&self, error: FilmError) -> FitError {
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
