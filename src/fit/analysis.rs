//! Everything from a data set as it was loaded to its fits, as `caromfit fit` does it.

use std::time::Instant;

use super::extracted_discs::with_equal_discs;
use super::film::{FittedFilm, stated_scale_sd};
use super::of_discs;
use super::of_film::Fitted;
use super::{Fit, FitError, Options, Rejected, check, fit_rows};
use crate::measurement::dataset::{Dataset, Measured};
use crate::measurement::parameter::{Compliance, Parameter, Settings};
use crate::measurement::track::TrackShot;
use crate::measurement::values::Values;
use crate::physics::collision::{FidelityChoice, Model};
use crate::physics::friction_law::Law;
use crate::problem::{FilmError, Id, Impact, Modelling, Policy, fit_film};

/// A data set and its fits.
#[non_exhaustive]
pub struct Analysis {
    /// The data set with its impacts; footage of discs as it was corrected.
    pub dataset: Dataset,
    /// The fit, or one for each label that is fitted apart.
    pub fits: Result<Vec<Fit>, FitError>,
}

/// Fits a data set of any kind, as `caromfit fit` does: of films all frames at once, with the camera.
#[must_use]
pub fn analyse(dataset: &Dataset, options: &Options) -> Analysis {
    analyse_watched(dataset, options, &|| ())
}

/// As [`analyse`], for those who show how far it is: `done` is called after every shot of a film and
/// every replicate of a bootstrap, from several threads.
#[must_use]
pub fn analyse_watched(dataset: &Dataset, options: &Options, done: &(dyn Fn() + Sync)) -> Analysis {
    if let Err(error) = check(dataset, options) {
        return Analysis { dataset: dataset.clone(), fits: Err(error) };
    }
    let mut own = dataset.clone();
    own.settings = options.falling.applied(own.settings);
    if is_film_of_balls(&own) {
        return of_film(own, options, done);
    }
    if is_film_of_discs(&own) {
        let fits = labelled(&own).into_iter().map(|(group, shots)| {
            let part = with_shots(&own, shots);
            of_discs::fit(of_discs::Request { dataset: &part, group: group.as_ref(), options, done })
        });
        let fits = fits.collect();
        return Analysis { dataset: own, fits };
    }
    let (dataset, fits) = (own.clone(), fit_rows(&own, options, done));
    Analysis { dataset, fits }
}

/// Returns whether a data set is a film of discs.
fn is_film_of_discs(dataset: &Dataset) -> bool {
    dataset.shots.is_empty() && dataset.tracks.as_ref().is_some_and(|tracks| tracks.discs.is_some())
}

/// Returns a data set with these shots of its film.
fn with_shots(dataset: &Dataset, shots: Vec<TrackShot>) -> Dataset {
    let mut part = dataset.clone();
    if let Some(tracks) = &mut part.tracks {
        tracks.shots = shots;
    }
    part
}

/// Returns whether a data set is a film of balls whose impacts are to be found.
fn is_film_of_balls(dataset: &Dataset) -> bool {
    dataset.shots.is_empty()
        && dataset.tracks.as_ref().is_some_and(|tracks| tracks.discs.is_none() && !tracks.shots.is_empty())
}

/// Returns the impacts of a data set: those of footage as its frames show them whatever the law of the
/// impact, what was found on the way among its notes, and the shots without one left out; other data
/// as they are. With a film of balls and its fit.
#[must_use]
pub fn with_impacts(mut dataset: Dataset, done: &(dyn Fn() + Sync)) -> (Dataset, Option<FittedFilm>) {
    if is_film_of_discs(&dataset) {
        return (with_equal_discs(dataset), None);
    }
    if !is_film_of_balls(&dataset) {
        return (dataset, None);
    }
    let modelling = Modelling::of(&dataset);
    let solution = match fit_film(&dataset, &modelling, &Policy::default()) {
        Ok(solution) => solution,
        Err(FilmError::NoImpact(reasons)) => {
            dataset.left_out.extend(reasons);
            return (dataset, None);
        }
        Err(error) => {
            let tracks = dataset.tracks.iter().flat_map(|tracks| &tracks.shots);
            let reasons: Vec<_> = tracks.map(|shot| (shot.name.clone(), error.to_string())).collect();
            dataset.left_out.extend(reasons);
            return (dataset, None);
        }
    };
    let tracks = dataset.tracks.as_ref().map_or(&[][..], |tracks| &tracks.shots);
    let film = FittedFilm::new(solution, tracks);
    let impacts = film.impacts();
    let sentences = super::film_words::of_findings(&film, stated_scale_sd(&dataset));
    dataset.left_out.extend(film.solution.left_out.iter().cloned());
    take_impacts(&mut dataset, &film, &impacts);
    dataset.tracks.iter_mut().for_each(|tracks| tracks.notes.extend(sentences.iter().cloned()));
    for _ in &impacts {
        done();
    }
    (dataset, Some(film))
}

/// Gives a data set the shots of a film, and what it tells of the cloth.
fn take_impacts(dataset: &mut Dataset, film: &FittedFilm, impacts: &[Impact]) {
    let measured = |id| film.shared(id).map(|(value, sd)| Measured::new(value, sd));
    dataset.sliding = measured(Id::MuK);
    dataset.rolling = measured(Id::MuR);
    dataset.shots.extend(impacts.iter().map(|impact| impact.shot.clone()));
}

/// Fits all frames of a film, or those of each label.
fn of_film(mut dataset: Dataset, options: &Options, done: &(dyn Fn() + Sync)) -> Analysis {
    let (model, settings) = match fitted_with(&dataset, options) {
        Ok(found) => found,
        Err(error) => return Analysis { dataset, fits: Err(error) },
    };
    let mut fits = Vec::new();
    for (group, shots) in labelled(&dataset) {
        let of_label = with_shots(&dataset, shots);
        let request = (&of_label, group, options);
        match of_label_fit(request, (model, settings), done) {
            Ok((fit, film, impacts)) => {
                take_impacts(&mut dataset, &film, &impacts);
                fits.push(fit);
            }
            Err(error) => return Analysis { dataset, fits: Err(error) },
        }
    }
    Analysis { dataset, fits: Ok(fits) }
}

fn of_label_fit(
    (dataset, group, options): (&Dataset, Option<(String, String)>, &Options),
    (model, settings): (Model, Settings),
    done: &(dyn Fn() + Sync),
) -> Result<(Fit, FittedFilm, Vec<Impact>), FitError> {
    let begun = Instant::now();
    let title = match &group {
        Some((column, label)) => format!("{} ({column} {label})", dataset.name),
        None => dataset.name.clone(),
    };
    let is_auto = options.fidelity == FidelityChoice::Auto;
    let loss = options.loss.unwrap_or(dataset.loss);
    let modelling = Modelling { model, settings, is_auto, loss };
    let solution = fit_film(dataset, &modelling, &Policy::default()).map_err(|error| match error {
        FilmError::NoImpact(reasons) => {
            let before = dataset.left_out.iter().cloned().chain(reasons);
            let shots_rejected = before.map(|(shot, reason)| Rejected { shot, reason }).collect();
            FitError::NoUsableShot { dataset: title, shots_rejected }
        }
        other => FitError::Film(title, other),
    })?;
    let tracks = dataset.tracks.as_ref().map_or(&[][..], |tracks| &tracks.shots);
    let film = FittedFilm::new(solution, tracks);
    let impacts = film.impacts();
    let fitted = Fitted { dataset, group, options, settings, film: film.clone(), done, impacts: &impacts };
    let fit = fitted.fit(begun.elapsed().as_secs_f64());
    for _ in &impacts {
        done();
    }
    Ok((fit, film, impacts))
}

/// A label column with one of its labels, and the films of that label.
type Labelled = (Option<(String, String)>, Vec<TrackShot>);

/// Returns the films of each label of `[fit] by`, or all of them.
fn labelled(dataset: &Dataset) -> Vec<Labelled> {
    let shots = dataset.tracks.iter().flat_map(|tracks| &tracks.shots);
    let mut groups: Vec<Labelled> = Vec::new();
    for shot in shots {
        let label = |by: &String| (by.clone(), shot.labels.get(by).cloned().unwrap_or_default());
        let own = dataset.by.as_ref().map(label);
        match groups.iter_mut().find(|(known, _)| *known == own) {
            Some((_, shots)) => shots.push(shot.clone()),
            None => groups.push((own, vec![shot.clone()])),
        }
    }
    groups
}

/// Returns the model and the settings that the shots of a data set are fitted with.
///
/// # Errors
/// A contact that is stated to give way, at a fidelity that takes it as rigid.
fn fitted_with(dataset: &Dataset, options: &Options) -> Result<(Model, Settings), FitError> {
    let mut model = dataset.model(options.fidelity.first());
    model.tolerance = options.tolerance;
    model.effects = options.effects.unwrap_or(model.effects);
    let settings = options.falling.applied(dataset.settings_of_balls());
    let initial = Values::usual(&settings);
    if settings.falls {
        model.law = Law::Exponential { b: initial[Parameter::B], c: initial[Parameter::C] };
    }
    if settings.compliance == Compliance::Stated {
        if let FidelityChoice::Of(fidelity) = options.fidelity
            && !fidelity.effects().compliance
        {
            return Err(FitError::Rigid { dataset: dataset.name.clone(), fidelity: fidelity.name() });
        }
        model.kappa = initial[Parameter::Kappa];
    }
    Ok((model, settings))
}
