//! The fit of a film as a [`Fit`].

use std::sync::Arc;

use super::common::{Fitted, check_fidelity};
use super::film::FittedFilm;
use super::film_words::DIFFERS;
use super::request::Request;
use super::{Fit, FitError, doubts, film_words};
use crate::measurement::dataset::Shot;
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
    let fitted = Fitted::of_frames(request, &settings, solution, deviations, (None, &[]));
    let mut fit = Fit {
        sliding: film.shared(Id::MuK),
        rolling: film.shared(Id::MuR),
        frames: Some(film.clone()),
        ..fitted.fit()
    };
    let shots: Vec<&Shot> = film.impacts.iter().map(|impact| &impact.shot).collect();
    let has_topspin = film.solution.topspins().iter().any(|(_, topspin)| *topspin > 0.5 * DIFFERS);
    doubts::comment(&mut fit, dataset, &shots, has_topspin, film_words::of_film(&film));
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
