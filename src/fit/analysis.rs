//! Everything from a data set as it was loaded to its fits, as `caromfit fit` does it.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use indexmap::IndexSet;
use minijinja::context;

use super::camera::FoundCamera;
use super::film::FittedFilm;
use super::request::Request;
use super::{Fit, FitError, Options, film_words, of_balls, of_discs};
use crate::measurement::dataset::Dataset;
use crate::measurement::track::TrackShot;
use crate::problem::{Choices, DiscImpact, FilmError, Id, Record, fit_film, measure_discs};

/// Fits a data set of any kind, as `caromfit fit` does, of films all frames at once, with the
/// camera: one fit, or one for each label of the column that `[fit] by` names, in the order in
/// which the labels first appear.
///
/// # Errors
/// See [`FitError`]; the first label that fails ends it.
pub fn fit(dataset: &Dataset, options: &Options) -> Result<Vec<Fit>, FitError> {
    fit_watched(dataset, options, &|| ())
}

/// Fits a data set as [`fit`] does and reports progress: `done` is called after every replicate of
/// a bootstrap, from several threads.
///
/// # Errors
/// Those of [`fit`].
pub fn fit_watched(
    dataset: &Dataset,
    options: &Options,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Fit>, FitError> {
    let faults = options.faults();
    if !faults.is_empty() {
        return Err(FitError::Options(faults));
    }
    let faults = dataset.faults();
    if !faults.is_empty() {
        return Err(FitError::Invalid { dataset: dataset.name.clone(), faults });
    }
    let mut fits = Vec::new();
    for (label, mut part) in parts(dataset) {
        let begun = Instant::now();
        let settings = options.falling.applied(part.settings);
        if settings != part.settings {
            part.to_mut().settings = settings;
        }
        let group = dataset.by.clone().zip(label);
        let request = Request { dataset: &part, group: group.as_ref(), options, done };
        let fit = match is_filmed(&part) {
            true if part.is_of_discs() => of_discs::fit(request)?,
            true => of_balls::film(request)?,
            false => of_balls::table(request)?,
        };
        fits.push(Fit { seconds: begun.elapsed().as_secs_f64(), ..fit });
    }
    Ok(fits)
}

/// Returns the parts of a data set, each with its label of `[fit] by`; one without a label is
/// whole.
pub(crate) fn parts(dataset: &Dataset) -> Vec<(Option<String>, Cow<'_, Dataset>)> {
    let by = dataset.by.as_ref();
    let label = |own: &BTreeMap<String, String>| by.and_then(|by| own.get(by)).cloned().unwrap_or_default();
    let tracks = dataset.tracks.iter().filter(|_| dataset.shots.is_empty());
    let filmed = tracks.flat_map(|tracks| &tracks.shots).map(|shot| label(&shot.labels));
    let shots = filmed.chain(dataset.shots.iter().map(|shot| label(&shot.labels)));
    let labels: IndexSet<String> = shots.filter(|_| by.is_some()).collect();
    if labels.is_empty() {
        return vec![(None, Cow::Borrowed(dataset))];
    }
    let part = |own: String| {
        let mut part = dataset.clone();
        part.shots.retain(|shot| label(&shot.labels) == own);
        if let Some(tracks) = &mut part.tracks {
            tracks.shots.retain(|shot| label(&shot.labels) == own);
        }
        (Some(own), Cow::Owned(part))
    };
    labels.into_iter().map(part).collect()
}

/// Returns whether the impacts of a data set are to be found in its frames.
fn is_filmed(dataset: &Dataset) -> bool {
    dataset.shots.is_empty() && (dataset.is_of_discs() || !dataset.names().is_empty())
}

/// Returns a data set with what its frames show independently of the law of the impact: of a film
/// of balls the impacts, of one of discs the shots that can be used. Other data are returned as
/// they are.
pub fn extract(dataset: Dataset) -> Dataset {
    with_impacts(dataset).0
}

/// Returns what [`extract`] does, with findings among its notes, and the fit of a film of balls.
pub(crate) fn with_impacts(mut dataset: Dataset) -> (Dataset, Option<FittedFilm>) {
    if !is_filmed(&dataset) {
        return (dataset, None);
    }
    if dataset.is_of_discs() {
        return (with_usable_discs(dataset), None);
    }
    let solution = match fit_film(&dataset, &Choices::default()) {
        Ok(solution) => solution,
        Err(error) => {
            leave_out(&mut dataset, error);
            return (dataset, None);
        }
    };
    let film = FittedFilm::new(solution, &dataset);
    let spins = film_words::unknown_spins(&film).map(|remark| remark.sentence);
    note(&mut dataset, &film.solution.record, Some(&film), spins);
    (dataset.sliding, dataset.rolling) = (film.solution.measured(Id::MuK), film.solution.measured(Id::MuR));
    dataset.shots.extend(film.impacts.iter().map(|impact| impact.shot.clone()));
    (dataset, Some(film))
}

/// Adds to a data set the shots that were left out of its film, findings, and other sentences.
fn note(
    dataset: &mut Dataset,
    record: &Record,
    film: Option<&FittedFilm>,
    others: impl IntoIterator<Item = String>,
) {
    dataset.left_out.extend(record.left_out.iter().cloned());
    if let Some(tracks) = &mut dataset.tracks {
        let findings = record.findings.iter();
        tracks.notes.extend(findings.filter_map(|finding| film_words::sentence(finding, film)).chain(others));
    }
}

/// A film of discs with what was measured of its shots.
#[derive(Clone, Debug)]
pub struct ExtractedDiscs {
    /// The data set, with what was found on the way among its notes, and the shots without an
    /// impact left out.
    pub dataset: Dataset,
    /// The shots with an impact.
    pub shots: Vec<(TrackShot, DiscImpact)>,
    /// The camera that the discs calibrate; `None` without an impact.
    pub camera: Option<FoundCamera>,
}

/// Measures the impacts of a film of discs: e, J_t/J_n, spins and balance of momentum of each shot
/// may be any, and all shots share the camera. Other data sets yield no impacts.
pub fn extract_discs(mut dataset: Dataset) -> ExtractedDiscs {
    let (solution, impacts) = match measure_discs(&dataset) {
        Ok(measured) => measured,
        Err(error) => {
            leave_out(&mut dataset, error);
            return ExtractedDiscs { dataset, shots: Vec::new(), camera: None };
        }
    };
    let solution = Arc::new(solution);
    let camera = FoundCamera::of_film(&solution, &dataset);
    let tracks = dataset.tracks.iter().flat_map(|tracks| &tracks.shots);
    let with_track =
        |impact: DiscImpact| Some((tracks.clone().find(|track| track.name == impact.name)?.clone(), impact));
    let shots: Vec<(TrackShot, DiscImpact)> = impacts.into_iter().filter_map(with_track).collect();
    let others = film_words::of_discs(&solution, &shots).into_iter().map(|remark| remark.sentence);
    note(&mut dataset, &solution.record, None, camera.sentence().into_iter().chain(others));
    ExtractedDiscs { dataset, shots, camera: Some(camera) }
}

/// Leaves out all shots of a film that cannot be fitted.
fn leave_out(dataset: &mut Dataset, error: FilmError) {
    let reasons = match error {
        FilmError::NoImpact(reasons) => reasons,
        other => {
            let tracks = dataset.tracks.iter().flat_map(|tracks| &tracks.shots);
            tracks.map(|shot| (shot.name.clone(), other.to_string())).collect()
        }
    };
    dataset.left_out.extend(reasons);
}

/// Returns a film of discs with the shots that a fit can use.
fn with_usable_discs(dataset: Dataset) -> Dataset {
    let ExtractedDiscs { mut dataset, shots, .. } = extract_discs(dataset);
    let Some(tracks) = &mut dataset.tracks else { return dataset };
    tracks.shots.clear();
    let mut unseen = 0;
    for (track, impact) in shots {
        let doubts = impact.doubts.iter();
        tracks.notes.extend(doubts.map(|doubt| format!("Shot {} is doubtful: {doubt}.", track.name)));
        match impact.find_fault() {
            Some(fault) => dataset.left_out.push((track.name, fault)),
            None => {
                unseen += usize::from(impact.get("slip").is_none());
                tracks.shots.push(track);
            }
        }
    }
    let unseen = film_words::of_shots("measured/unseen-rotation", unseen, tracks.shots.len());
    tracks.notes.extend(unseen.map(|remark| remark.sentence));
    let in_seconds = tracks.discs.is_none_or(|discs| discs.in_seconds);
    tracks.notes.push(film_words::words_of("discs", context! { in_seconds }));
    dataset
}
