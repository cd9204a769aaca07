//! Several data sets in one fit: which quantities differ between cloths or balls, by how much, with
//! which significance.
//!
//! Each data set, or each label of its `[fit] by`, is first fitted alone: cleaned, with its causes
//! and spins. All are then samples of one problem whose shared unknowns have a column each:
//! quantities that are compared one for each label, the others one for all; ratios of masses and
//! radii one for each set of balls, the camera one for each `camera` label or film, the cloth one
//! for each cloth. Priors count once per column.
//!
//! "Same" is the fit of the problem in which a quantity has a column for each label with the
//! columns made equal, at the noise of the larger model, so that its rise of χ² is a likelihood
//! ratio.

mod compared;
mod joint;
mod result;
mod samples;

#[cfg(feature = "report")]
pub(crate) use result::{Compared, NOT_CONVERGED, Robust, SampleSummary, Value};
pub use result::{Comparison, Options, Quantity};

use crate::fit::FitError;
use crate::measurement::dataset::Dataset;
use joint::Joint;
use samples::Samples;

/// Number of stages at most: the samples alone, all together, and a test of each quantity.
pub(crate) const STAGES: usize = 2 + Quantity::ALL.len();

/// Why data sets cannot be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// Data sets or options do not go together, as the sentence states.
    #[error("{0}")]
    Refused(String),
    /// The fit of a data set failed.
    #[error(transparent)]
    Fit(#[from] FitError),
}

impl CompareError {
    /// Returns whether the input was wrong, rather than that it could not be compared.
    pub fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Fit(error) if !error.is_bad_input())
    }
}

fn refuse<T>(why: String) -> Result<T, CompareError> {
    Err(CompareError::Refused(why))
}

/// Compares data sets of any kind, as `caromfit compare` does.
///
/// # Errors
/// See [`CompareError`].
pub fn compare(datasets: &[Dataset], options: &Options) -> Result<Comparison, CompareError> {
    compare_watched(datasets, options, &|_| ())
}

/// Compares data sets as [`compare`] does; `stage` is called with the name of each of the
/// [`STAGES`] as it begins.
pub(crate) fn compare_watched(
    datasets: &[Dataset],
    options: &Options,
    stage: &dyn Fn(&str),
) -> Result<Comparison, CompareError> {
    if let Some(both) = options.share.iter().find(|quantity| options.per_dataset.contains(quantity)) {
        let name = both.name();
        return refuse(format!("{name} is both shared and per data set; expected one of them"));
    }
    for dataset in datasets {
        let faults = dataset.faults();
        if !faults.is_empty() {
            return Err(FitError::Invalid { dataset: dataset.name.clone(), faults }.into());
        }
    }
    let datasets = share_balls(datasets)?;
    stage("each alone");
    let samples = Samples::fit(&datasets, options)?;
    stage("fitting all together");
    Joint::new(samples)?.compared(stage)
}

/// Returns the data sets, each with the object ball that any data set of the same `balls` label
/// states.
///
/// # Errors
/// Data sets of the same label that state different balls.
fn share_balls(datasets: &[Dataset]) -> Result<Vec<Dataset>, CompareError> {
    let share = |dataset: &Dataset| {
        let mut same = datasets.iter().filter(|other| other.balls.is_some() && other.balls == dataset.balls);
        let first = same.clone().find(|other| other.object.is_some()).or(same.next()).unwrap_or(dataset);
        let differs = dataset.object.is_some() && dataset.object != first.object;
        if differs || dataset.ball.radius != first.ball.radius || dataset.ball.inertia != first.ball.inertia {
            return refuse(format!(
                "{} and {}: both have balls = \"{}\", but [ball] or [object] differ; expected the same in both",
                first.name,
                dataset.name,
                dataset.balls.as_deref().unwrap_or_default()
            ));
        }
        Ok(Dataset { ball: first.ball, object: first.object, ..dataset.clone() })
    };
    datasets.iter().map(share).collect()
}
