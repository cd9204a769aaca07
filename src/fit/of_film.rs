//! The fit of a film as a [`Fit`].

use std::sync::Arc;

use super::camera::FoundCamera;
use super::common::{Fitted, Own, check_fidelity};
use super::deviations::trends;
use super::film::FittedFilm;
use super::film_words::DIFFERS;
use super::request::Request;
use super::{Estimate, Fit, FitError, Status, doubts, film_words};
use crate::measurement::dataset::{Measured, Shot};
use crate::measurement::parameter::{Compliance, Parameter, Setting, Settings};
use crate::measurement::spin::Spin;
use crate::physics::collision::{Fidelity, Model};
use crate::problem::{Id, Modelling, Policy, fit_film};

/// Fits all frames of a film.
pub(super) fn fit(request: Request) -> Result<Fit, FitError> {
    let Request { dataset, options, .. } = request;
    check_fidelity(&request)?;
    let (model, settings) = fitted_with(&request);
    let is_auto = options.fidelity.is_none();
    let modelling = Modelling { model, settings, is_auto, loss: options.loss.unwrap_or(dataset.loss) };
    let solution = fit_film(dataset, &modelling, &Policy::default());
    let film = FittedFilm::new(solution.map_err(|error| request.of_film(error))?, dataset);
    let mut deviations = film.solution.deviations();
    for (found, track) in deviations.iter_mut().zip(film.tracks()) {
        let Some(found) = found else { continue };
        // topspins that the frames determined are no variable of their own
        found.spins[0] = match track.spin {
            Spin::Stun => 0.0,
            Spin::NaturalRoll => 1.0,
            Spin::Measured { .. } => found.spins[0],
            Spin::Unknown => f64::NAN,
        };
    }
    let solution = Arc::clone(&film.solution);
    let fitted = Fitted { request, settings, solution, deviations };
    let solution = &film.solution;
    let estimates = fitted.estimates_of_film(None, &[]);
    let is_silent =
        |e: &&Estimate| e.status == Status::NotIdentified && solution.get(Id::from(e.parameter)).is_none();
    let (chi2, observations) = solution.chi2_of_data();
    let unknowns = solution.own_count() as f64 + solution.covariance.count_data(&solution.problem);
    let parts = Own {
        errors: &solution.covariance,
        combined: fitted.contact(),
        silent: estimates.iter().filter(is_silent).map(|e| e.parameter).collect(),
        drawn: fitted.contact(),
        dof_of_noise: None,
        chi2,
        dof: (observations - unknowns).max(0.0),
        is_stated: solution.states_noise(),
        trends: trends(solution, &fitted.deviations, |slope, _| Some(slope.p_value)),
        estimates,
    };
    let measured = |id: Id| film.shared(id).map(|(value, sd)| Measured::new(value, sd));
    let mut fit = Fit {
        sliding: measured(Id::MuK),
        rolling: measured(Id::MuR),
        chi2: chi2 + solution.prior_chi2(),
        camera: Some(FoundCamera::of_film(solution)),
        frames: Some(film.clone()),
        ..fitted.fit(parts)
    };
    let shots: Vec<&Shot> = film.impacts.iter().map(|impact| &impact.shot).collect();
    let has_topspin = film.solution.topspins().iter().any(|(_, topspin)| *topspin > 0.5 * DIFFERS);
    let remarks = film_words::of_film(&film);
    doubts::comment(&mut fit, dataset, &shots, has_topspin, remarks);
    Ok(fit)
}

/// Returns the model and the settings that the shots of a data set are fitted with.
fn fitted_with(request: &Request) -> (Model, Settings) {
    let Request { dataset, options, .. } = *request;
    let mut model = dataset.model(options.fidelity.unwrap_or(Fidelity::Full));
    model.tolerance = options.tolerance;
    let settings = dataset.settings_of_balls();
    if settings.compliance == Compliance::Stated {
        // a search does not depend on the initial value
        let Setting { initial, lower, upper, fixed, .. } = settings[Parameter::Kappa];
        let typical = Parameter::Kappa.default_setting().initial.clamp(lower, upper);
        model.kappa = if fixed { initial } else { typical };
    }
    (model, settings)
}
