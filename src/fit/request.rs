//! What is fitted and how, and whether it can be.

use super::model_choice::plan;
use super::samples::Search;
use super::{FitError, Options, Rejected};
use crate::likelihood::fitted::Fitted;
use crate::measurement::dataset::{Dataset, Shot};
use crate::measurement::observable::Observable;
use crate::numerics::least_squares::OptimiseError;

/// What is fitted, all shots of a data set or those of one label, and how.
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
    /// How an error names what is fitted.
    pub(super) fn title(&self) -> String {
        match self.group {
            Some((column, label)) => format!("{} ({column} {label})", self.dataset.name),
            None => self.dataset.name.clone(),
        }
    }

    /// An error of a search, with the name of the data set.
    pub(super) fn named(&self, error: FitError) -> FitError {
        match error {
            FitError::TooFewObservations { observations, parameters, .. } => {
                FitError::TooFewObservations { dataset: self.title(), observations, parameters }
            }
            FitError::Optimise(error @ OptimiseError::NotFinite) => FitError::NoStart(self.title(), error),
            other => other,
        }
    }

    /// The shots that can be fitted, with how each is predicted; and those that cannot, with the reason.
    pub(super) fn planned(&self, stated: &Search) -> Result<(Vec<Fitted>, Vec<Rejected>), FitError> {
        let sample = stated.first();
        let (planned, unplanned) = plan(self.shots, sample.model, &sample.initial);
        let left_out = self.dataset.left_out.iter();
        let left_out = left_out.map(|(shot, reason)| Rejected { shot: shot.clone(), reason: reason.clone() });
        let shots_rejected: Vec<Rejected> = left_out.chain(unplanned).collect();
        if planned.is_empty() {
            return Err(FitError::NoUsableShot { dataset: self.title(), shots_rejected });
        }
        check_noise(self.dataset, self.shots, &planned)?;
        Ok((planned, shots_rejected))
    }
}

/// Each observable has standard deviations everywhere or nowhere.
fn check_noise(dataset: &Dataset, shots: &[&Shot], fitted: &[Fitted]) -> Result<(), FitError> {
    let mut seen: Vec<(Observable, bool, usize)> = Vec::new();
    for (index, row) in fitted.iter().flat_map(|shot| shot.plan.rows().iter().map(|row| (shot.index, row))) {
        let has = row.measured.sd.is_some();
        match seen.iter().find(|(observable, ..)| *observable == row.observable) {
            Some((_, other, first)) if *other != has => {
                let place = |index: usize| {
                    let shot = shots[index];
                    (format!("{}:{}", shot.file.display(), shot.line), shot.name.clone())
                };
                let (with, without) = if has { (index, *first) } else { (*first, index) };
                return Err(FitError::MixedNoise {
                    dataset: dataset.name.clone(),
                    column: row.observable.column(),
                    with: Box::new(place(with)),
                    without: Box::new(place(without)),
                });
            }
            Some(_) => {}
            None => seen.push((row.observable, has, index)),
        }
    }
    Ok(())
}
