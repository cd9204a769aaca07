//! Shots of a table, and how they are fitted.

use super::{FitError, Options, Rejected};
use crate::measurement::dataset::{Dataset, Shot};
use crate::problem::RowsError;

/// Shots of a table, and how they are fitted.
#[derive(Clone, Copy)]
pub(super) struct Request<'a> {
    pub dataset: &'a Dataset,
    pub shots: &'a [&'a Shot],
    /// Column and label.
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

    /// Returns the error of a fit with the names of the data set and its places.
    pub fn named(&self, error: RowsError) -> FitError {
        let dataset = self.title();
        let place = |name: String| {
            let shot = self.shots.iter().find(|shot| shot.name == name);
            let place = shot.map(|shot| format!("{}:{}", shot.file.display(), shot.line));
            Box::new((place.unwrap_or_default(), name))
        };
        match error {
            RowsError::NoShot { left_out } => {
                let of = |(shot, reason)| Rejected { shot, reason };
                FitError::NoUsableShot { dataset, shots_rejected: left_out.into_iter().map(of).collect() }
            }
            RowsError::TooFewNumbers { numbers, unknowns } => {
                let names: Vec<&str> = unknowns.iter().map(|id| id.name()).collect();
                FitError::TooFewObservations { dataset, observations: numbers, parameters: names.join(", ") }
            }
            RowsError::MixedNoise { column, with, without } => {
                FitError::MixedNoise { dataset, column, with: place(with), without: place(without) }
            }
            RowsError::Rigid(fidelity) => FitError::Rigid { dataset, fidelity },
            RowsError::NoStart => FitError::NoStart(dataset),
        }
    }
}
