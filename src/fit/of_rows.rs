//! The fit of a table as a [`Fit`].

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::common::{Fitted, choices};
use super::request::Request;
use super::{Fit, FitError, doubts};
use crate::measurement::dataset::{Dataset, Shot};
use crate::measurement::number::plain;
use crate::measurement::observable::Observable;
use crate::physics::collision::{Coefficients, Fidelity};
use crate::physics::friction_law::Law;
use crate::problem::{Finding, FitEnd, Id, Slope, TableNoise, fit_rows, predict};

/// Fits the shots of a table.
pub(super) fn fit(request: Request) -> Result<Fit, FitError> {
    let dataset = request.dataset;
    let rows = fit_rows(dataset, &choices(&request)?);
    let rows = rows.map_err(|error| request.of_rows(error))?;
    let solution = &rows.solution;
    let deviations = solution.deviations();
    let has_topspin = deviations.iter().flatten().any(|found| found.spins[0] > 0.0);
    let settings = dataset.settings_of_balls();
    let fitted = Fitted::new(request, &settings, &rows, deviations, |slope, _| chance(&rows, slope));
    let mut fit = fitted.fit();
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
    let shots: Vec<&Shot> = dataset.shots.iter().collect();
    doubts::comment(&mut fit, dataset, &shots, has_topspin, []);
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
    let in_unit = |value: f64| plain(value / observable.unit_si(), 4);
    Some(format!(
        ": most of all its {} is {}, where {} is expected ({} standard deviations off)",
        observable.column(),
        in_unit(measured),
        in_unit(expected),
        plain(errors, 2)
    ))
}

/// Returns the noise of an observable, if it was estimated.
fn noise_of(rows: &FitEnd, observable: Observable) -> Option<&TableNoise> {
    rows.noises.iter().find(|noise| noise.pool.observables.contains(&observable))
}

/// Returns the probability of a slope by chance; the noise that is estimated from the same
/// numbers is less without mean and slope.
fn chance(rows: &FitEnd, slope: &Slope) -> Option<f64> {
    let Some(dof) = rows.dof else { return Some(slope.p_value) };
    if !rows.knows_noise() {
        return None;
    }
    let all: f64 = rows.noises.iter().map(|noise| noise.square).sum();
    let square = slope.t * slope.t;
    let left = (all - slope.level.unwrap_or(0.0) - square).max(f64::MIN_POSITIVE);
    let dof = dof - 1.0 - f64::from(slope.level.is_some());
    let t = (square * dof / left).sqrt();
    Some(2.0 * StudentsT::new(0.0, 1.0, dof).ok()?.sf(t.min(f64::MAX)))
}
