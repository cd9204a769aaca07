//! Everything from a data set as it was loaded to its fits, as `caromfit fit` does it.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use super::camera::FoundCamera;
use super::film::FittedFilm;
use super::request::Request;
use super::{Fit, FitError, Options, film_words, of_discs, of_film, of_rows};
use crate::measurement::dataset::Dataset;
use crate::measurement::track::TrackShot;
use crate::problem::{Choices, DiscImpact, FilmError, Id, fit_film, measure_discs};

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
            true => of_film::fit(request)?,
            false => of_rows::fit(request)?,
        };
        fits.push(Fit { seconds: begun.elapsed().as_secs_f64(), ..fit });
    }
    Ok(fits)
}

/// Returns the parts of a data set, each with its label of `[fit] by`; one without a label is
/// whole.
pub(crate) fn parts(dataset: &Dataset) -> Vec<(Option<String>, Cow<'_, Dataset>)> {
    let mut labels: Vec<String> = Vec::new();
    if let Some(by) = &dataset.by {
        let tracks = dataset.tracks.iter().filter(|_| dataset.shots.is_empty());
        let filmed = tracks.flat_map(|tracks| &tracks.shots).map(|shot| &shot.labels);
        for own in filmed.chain(dataset.shots.iter().map(|shot| &shot.labels)) {
            let label = own.get(by).cloned().unwrap_or_default();
            if !labels.contains(&label) {
                labels.push(label);
            }
        }
    }
    if labels.is_empty() {
        return vec![(None, Cow::Borrowed(dataset))];
    }
    let part = |label: String| {
        let mut part = dataset.clone();
        let has_label = |own: &BTreeMap<String, String>| {
            let by = dataset.by.as_ref().and_then(|by| own.get(by));
            by.map_or("", String::as_str) == label
        };
        part.shots.retain(|shot| has_label(&shot.labels));
        if let Some(tracks) = &mut part.tracks {
            tracks.shots.retain(|shot| has_label(&shot.labels));
        }
        (Some(label), Cow::Owned(part))
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
    let findings = film.solution.record.findings.iter();
    let sentences = findings.filter_map(|finding| film_words::sentence(finding, Some(&film)));
    let spins = film_words::unknown_spins(&film).map(|remark| remark.sentence);
    let sentences: Vec<String> = sentences.chain(spins).collect();
    dataset.left_out.extend(film.solution.record.left_out.iter().cloned());
    (dataset.sliding, dataset.rolling) = (film.solution.measured(Id::MuK), film.solution.measured(Id::MuR));
    dataset.shots.extend(film.impacts.iter().map(|impact| impact.shot.clone()));
    dataset.tracks.iter_mut().for_each(|tracks| tracks.notes.extend(sentences.iter().cloned()));
    (dataset, Some(film))
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
    dataset.left_out.extend(solution.record.left_out.iter().cloned());
    let solution = Arc::new(solution);
    let camera = FoundCamera::of_film(&solution, &dataset);
    let mut shots = Vec::new();
    if let Some(tracks) = &mut dataset.tracks {
        for impact in impacts {
            let track = tracks.shots.iter().find(|track| track.name == impact.name);
            shots.extend(track.cloned().map(|track| (track, impact)));
        }
        let findings = solution.record.findings.iter();
        tracks.notes.extend(findings.filter_map(|finding| film_words::sentence(finding, None)));
        tracks.notes.extend(camera.sentence());
        tracks
            .notes
            .extend(film_words::of_discs(&solution, &shots).into_iter().map(|remark| remark.sentence));
    }
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
    let knows_rate = tracks.discs.is_none_or(|discs| discs.in_seconds);
    let unit = if knows_rate { "" } else { " The frame rate is unknown: velocities are in m per frame." };
    tracks.notes.push(format!(
        "Discs: e and J_t/J_n of every shot are fitted, which are those of equal discs with the same slip and closing speed. Their own \
         velocities are in what \"caromfit extract\" writes.{unit}"
    ));
    dataset
}
