//! Everything from data sets as they were loaded to their comparison, as `caromfit compare` does it.

use super::alone::Samples;
use super::error::CompareError;
use super::joint::Joint;
use super::options::Options;
use super::quantity::Quantity;
use super::result::Comparison;
use crate::fit::FittedFilm;
use crate::measurement::dataset::Dataset;

/// Number of stages of a comparison at most: the samples alone, all together, and a test of each quantity.
pub const STAGES: usize = 2 + Quantity::ALL.len();

/// A comparison, and the samples as they were compared.
#[non_exhaustive]
pub struct Analysis {
    /// The films as all samples fit them, with the index of the sample of each.
    pub films: Vec<(usize, FittedFilm)>,
    /// The comparison.
    pub comparison: Result<Comparison, CompareError>,
}

/// Compares data sets of any kind, as [`analyse`] does.
///
/// # Errors
/// See [`CompareError`].
pub fn compare(datasets: &[Dataset], options: &Options) -> Result<Comparison, CompareError> {
    analyse(datasets, options).comparison
}

/// Compares data sets of any kind, as `caromfit compare` does.
#[must_use]
pub fn analyse(datasets: &[Dataset], options: &Options) -> Analysis {
    analyse_watched(datasets, options, &|| (), &|_| ())
}

/// Compares data sets as [`analyse`] does and reports progress: `done` is called after every shot that is
/// fitted, from several threads; `stage` with the name of each of the [`STAGES`] as it begins.
#[must_use]
pub fn analyse_watched(
    datasets: &[Dataset],
    options: &Options,
    done: &(dyn Fn() + Sync),
    stage: &dyn Fn(&str),
) -> Analysis {
    let refused = |error| Analysis { films: Vec::new(), comparison: Err(error) };
    if let Err(error) = check(datasets, options) {
        return refused(error);
    }
    let datasets = match share_balls(datasets) {
        Ok(datasets) => datasets,
        Err(error) => return refused(error),
    };
    stage("each alone");
    let joint = Samples::fit(&datasets, options, done).and_then(|samples| {
        stage("fitting all together");
        Joint::new(samples, options)
    });
    match joint.and_then(|joint| joint.compared(stage)) {
        Ok((comparison, films)) => Analysis { films, comparison: Ok(comparison) },
        Err(error) => refused(error),
    }
}

/// Checks that a comparison can be tried.
fn check(datasets: &[Dataset], options: &Options) -> Result<(), CompareError> {
    if let Some(both) = options.share.iter().find(|quantity| options.per_dataset.contains(quantity)) {
        return Err(CompareError::Both(both.name()));
    }
    let is_film = |dataset: &&Dataset| dataset.tracks.as_ref().is_some_and(|tracks| tracks.discs.is_none());
    if let Some(other) = datasets.iter().find(|dataset| options.same_camera && !is_film(dataset)) {
        return Err(CompareError::NoCamera(other.name.clone()));
    }
    for dataset in datasets {
        let faults = dataset.faults();
        if !faults.is_empty() {
            return Err(CompareError::Invalid { dataset: dataset.name.clone(), faults });
        }
    }
    Ok(())
}

/// Returns the data sets, those of the same `balls` label with the object ball that one of them states.
///
/// # Errors
/// Data sets of the same label that state different balls.
fn share_balls(datasets: &[Dataset]) -> Result<Vec<Dataset>, CompareError> {
    let share = |dataset: &Dataset| {
        let mut same = datasets.iter().filter(|other| other.balls.is_some() && other.balls == dataset.balls);
        let first = same.clone().find(|other| other.object.is_some()).or(same.next()).unwrap_or(dataset);
        let differs = dataset.object.is_some() && dataset.object != first.object;
        if differs || dataset.ball.radius != first.ball.radius || dataset.ball.inertia != first.ball.inertia {
            return Err(CompareError::OtherBalls {
                label: dataset.balls.clone().unwrap_or_default(),
                first: first.name.clone(),
                other: dataset.name.clone(),
            });
        }
        Ok(Dataset { ball: first.ball, object: first.object, ..dataset.clone() })
    };
    datasets.iter().map(share).collect()
}
