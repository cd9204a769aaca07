//! Everything from data sets as they were loaded to their comparison, as `caromfit compare` does it.

use super::{CompareError, Comparison, Options, balls, check, compare_prepared};
use crate::fit::analysis::state_compliance;
use crate::fit::{Method, with_impacts};
use crate::measurement::dataset::Dataset;
use crate::measurement::parameter::Compliance;

/// A comparison, and the data sets as they were compared.
#[non_exhaustive]
pub struct Analysis {
    /// The data sets as they were compared, with their impacts; empty where the comparison was refused before.
    pub datasets: Vec<Dataset>,
    /// The comparison.
    pub comparison: Result<Comparison, CompareError>,
}

/// Compares data sets of any kind, as `caromfit compare` does: footage is corrected for its cameras and its impacts are found first.
#[must_use]
pub fn analyse(datasets: &[Dataset], options: &Options) -> Analysis {
    analyse_watched(datasets, options, &|| (), &|_| ())
}

/// As [`analyse`], for those who show how far it is: `done` is called after every shot that is extracted, from several threads; `stage`
/// with the name of each of the [`STAGES`](super::STAGES) as it begins.
#[must_use]
pub fn analyse_watched(
    datasets: &[Dataset],
    options: &Options,
    done: &(dyn Fn() + Sync),
    stage: &dyn Fn(&str),
) -> Analysis {
    if let Err(error) = check(datasets, options) {
        return Analysis { datasets: Vec::new(), comparison: Err(error) };
    }
    let datasets = match balls::shared(datasets) {
        Ok(datasets) => datasets,
        Err(error) => return Analysis { datasets: Vec::new(), comparison: Err(error) },
    };
    let first = analyse_once(datasets.clone(), options, done, stage);
    let gives_way = first.comparison.as_ref().is_ok_and(|comparison| comparison.gives_way);
    if !gives_way || first.datasets.iter().all(|dataset| dataset.tracks.is_none()) {
        return first;
    }
    // films are to be corrected, and impacts extracted, with the contact that gives way, too
    let stated = datasets.into_iter().map(|mut dataset| {
        if dataset.settings.compliance == Compliance::Auto {
            state_compliance(&mut dataset);
        }
        dataset
    });
    let mut again = analyse_once(stated.collect(), options, done, &|_| {});
    if let (Ok(again), Ok(first)) = (&mut again.comparison, first.comparison) {
        again.gives_way = true;
        again.notes.extend(first.notes);
    }
    again
}

fn analyse_once(
    datasets: Vec<Dataset>,
    options: &Options,
    done: &(dyn Fn() + Sync),
    stage: &dyn Fn(&str),
) -> Analysis {
    let datasets: Vec<Dataset> = datasets.into_iter().map(|dataset| with_impacts(dataset, done).0).collect();
    let comparison = compare_prepared(&datasets, (options, Method::TwoStage), stage);
    Analysis { datasets, comparison }
}
