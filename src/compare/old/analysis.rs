//! Everything from data sets as they were loaded to their comparison, as `caromfit compare` does it.

use super::{CompareError, Comparison, Finding, Options, compare_prepared};
use crate::fit::analysis::state_compliance;
use crate::fit::{Method, with_impacts};
use crate::measurement::dataset::Dataset;
use crate::measurement::parameter::Compliance;

/// Returns whether all data sets are films of balls.
pub(in super::super) fn are_blocks(datasets: &[Dataset]) -> bool {
    let is_film = |dataset: &Dataset| {
        let tracks = dataset.tracks.as_ref().filter(|tracks| tracks.discs.is_none());
        tracks.is_some_and(|tracks| !tracks.shots.is_empty()) && dataset.shots.is_empty()
    };
    datasets.iter().all(is_film)
}

/// Compares tables and discs, and films with these by the velocities that their frames show.
pub(in super::super) fn analyse(
    datasets: Vec<Dataset>,
    options: &Options,
    done: &(dyn Fn() + Sync),
    stage: &dyn Fn(&str),
) -> Result<Comparison, CompareError> {
    if options.method == Some(Method::Joint) || options.same_camera {
        let name = datasets.first().map_or(String::new(), |dataset| dataset.name.clone());
        let error =
            if options.same_camera { CompareError::NoCamera(name) } else { CompareError::NotFilmed(name) };
        return Err(error);
    }
    analyse_datasets(datasets, options, done, stage).1
}

/// Data sets with their impacts, and their comparison.
type Compared = (Vec<Dataset>, Result<Comparison, CompareError>);

fn analyse_datasets(
    datasets: Vec<Dataset>,
    options: &Options,
    done: &(dyn Fn() + Sync),
    stage: &dyn Fn(&str),
) -> Compared {
    let first = analyse_once(datasets.clone(), options, done, stage);
    let gives_way = first.1.as_ref().is_ok_and(gives_way);
    if !gives_way || first.0.iter().all(|dataset| dataset.tracks.is_none()) {
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
    if let (Ok(again), Ok(first)) = (&mut again.1, first.1) {
        again.findings.extend(first.findings);
    }
    again
}

fn analyse_once(
    datasets: Vec<Dataset>,
    options: &Options,
    done: &(dyn Fn() + Sync),
    stage: &dyn Fn(&str),
) -> Compared {
    let datasets: Vec<Dataset> = datasets.into_iter().map(|dataset| with_impacts(dataset, done).0).collect();
    let comparison = compare_prepared(&datasets, (options, Method::TwoStage), stage);
    (datasets, comparison)
}

fn gives_way(comparison: &Comparison) -> bool {
    comparison.findings.iter().any(|finding| matches!(finding, Finding::Compliance { .. }))
}
