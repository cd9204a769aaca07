//! Fits of balls as a [`Fit`]: of all frames of a film, or of the shots of a table.

use std::sync::Arc;

use minijinja::context;

use super::deviations::chance;
use super::film_words::{self, DIFFERS, words_of};
use super::request::Request;
use super::{Depth, Fit, FitError, FittedFilm, Options, doubts};
use crate::measurement::dataset::Dataset;
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Compliance;
use crate::measurement::spin::Spin;
use crate::physics::collision::{Coefficients, Fidelity};
use crate::physics::friction_law::Law;
use crate::problem::{
    Choices, Finding, FitEnd, Id, RowsError, Slope, TableNoise, fit_film, fit_rows, predict,
};

/// Returns the choices of a fit.
///
/// # Errors
/// A contact that is stated to be compliant, at a fidelity that takes it as rigid.
fn choices(request: &Request) -> Result<Choices, FitError> {
    let &Options { fidelity, tolerance, loss, depth, .. } = request.options;
    let is_compliant = request.dataset.settings.compliance == Compliance::Stated;
    if let Some(rigid) = fidelity.filter(|fidelity| is_compliant && !fidelity.effects().compliance) {
        return Err(request.of_rows(RowsError::Rigid(rigid.name())));
    }
    let without_profiles = depth < Depth::Intervals;
    Ok(Choices { fidelity, tolerance: Some(tolerance), loss, without_profiles })
}

/// Fits all frames of a film.
pub(super) fn film(request: Request) -> Result<Fit, FitError> {
    let dataset = request.dataset;
    let solution = fit_film(dataset, &choices(&request)?);
    let film = FittedFilm::new(solution.map_err(|error| request.of_film(error))?, dataset);
    let mut deviations = film.solution.deviations();
    for (found, track) in deviations.iter_mut().zip(film.tracks.iter()) {
        let Some(found) = found else { continue };
        // topspins that the frames determined are no variable of their own
        found.spins[0] = match track.spin {
            Spin::Stun => 0.0,
            Spin::NaturalRoll => 1.0,
            Spin::Measured { .. } => found.spins[0],
            Spin::Unknown => f64::NAN,
        };
    }
    let (settings, profiles) = (dataset.settings_of_balls(), request.options.depth >= Depth::Intervals);
    let end = FitEnd::of_frames(Arc::clone(&film.solution), &settings, (None, Vec::new()), profiles);
    let mut fit = Fit::new(request, &end, &deviations, |slope, _| Some(slope.p_value));
    fit.frames = Some(film.clone());
    let has_topspin = film.solution.topspins().iter().any(|topspin| *topspin > 0.5 * DIFFERS);
    doubts::comment(&mut fit, dataset, has_topspin, film_words::of_film(&film));
    Ok(fit)
}

/// Fits the shots of a table.
pub(super) fn table(request: Request) -> Result<Fit, FitError> {
    let dataset = request.dataset;
    let rows = fit_rows(dataset, &choices(&request)?);
    let rows = rows.map_err(|error| request.of_rows(error))?;
    let solution = &rows.solution;
    let deviations = solution.deviations();
    let has_topspin = deviations.iter().flatten().any(|found| found.spins[0] > 0.0);
    let mut fit = Fit::new(request, &rows, &deviations, |slope, _| chance_of(&rows, slope));
    for rejected in &mut fit.shots_rejected {
        let is_lost = |finding: &Finding| matches!(finding, Finding::LostShots { names } if names.contains(&rejected.shot));
        if solution.record.findings.iter().any(is_lost) {
            rejected.reason.push_str(&worst(&rows, dataset, &rejected.shot).unwrap_or_default());
        }
    }
    for residual in &mut fit.residuals {
        if noise_of(&rows, residual.observable).is_some_and(|noise| !noise.is_known) {
            (residual.sd, residual.standardized) = (f64::NAN, f64::NAN);
        }
    }
    doubts::comment(&mut fit, dataset, has_topspin, []);
    Ok(fit)
}

/// Returns which number of a shot is farthest from what the fit of the others predicts.
fn worst(rows: &FitEnd, dataset: &Dataset, name: &str) -> Option<String> {
    let shot = dataset.shots.iter().find(|shot| shot.name == name)?;
    let value = |id: Id| rows.solution.value(id);
    let mut model = dataset.model(Fidelity::Full);
    if dataset.settings.falls {
        model.law = Law::Exponential { b: value(Id::FallB), c: value(Id::FallC) };
    }
    let coefficients = Coefficients { mu: value(Id::Mu), mu_s: value(Id::MuS), e: value(Id::E) };
    let predicted = predict(shot, &model, &coefficients).ok()?;
    let off = predicted.observables.iter().zip(&predicted.values).filter_map(|(observable, value)| {
        let measured = shot.after.iter().find(|after| after.observable == *observable)?.measured;
        let sd = measured.sd.or(noise_of(rows, *observable).map(|noise| noise.sd))?;
        Some((*observable, measured.value, *value, (measured.value - value).abs() / sd))
    });
    let (observable, measured, expected, errors) = off.max_by(|a, b| a.3.total_cmp(&b.3))?;
    let [measured, expected] = [measured, expected].map(|value| value / observable.unit_si());
    let column = observable.column();
    Some(words_of("farthest", context! { column, measured, expected, errors }))
}

/// Returns the noise of an observable, if it was estimated.
fn noise_of(rows: &FitEnd, observable: Observable) -> Option<&TableNoise> {
    rows.noises.iter().find(|noise| noise.pool.observables.contains(&observable))
}

/// Returns the probability of a slope by chance; the noise that is estimated from the same
/// numbers is less without mean and slope.
fn chance_of(rows: &FitEnd, slope: &Slope) -> Option<f64> {
    let Some(dof) = rows.dof else { return Some(slope.p_value) };
    if !rows.knows_noise() {
        return None;
    }
    let all: f64 = rows.noises.iter().map(|noise| noise.square).sum();
    let dof = dof - 1.0 - f64::from(slope.level.is_some());
    chance(slope, all - slope.level.unwrap_or(0.0), dof)
}
