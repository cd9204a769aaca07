//! The fit of a film as a [`Fit`].

use std::sync::Arc;

use super::common::{Fitted, choices};
use super::film::FittedFilm;
use super::film_words::DIFFERS;
use super::request::Request;
use super::{Depth, Fit, FitError, doubts, film_words};
use crate::measurement::dataset::Shot;
use crate::measurement::spin::Spin;
use crate::problem::{FitEnd, fit_film};

/// Fits all frames of a film.
pub(super) fn fit(request: Request) -> Result<Fit, FitError> {
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
    let settings = dataset.settings_of_balls();
    let profiles = request.options.depth >= Depth::Intervals;
    let end = FitEnd::of_frames(Arc::clone(&film.solution), &settings, (None, Vec::new()), profiles);
    let fitted = Fitted::new(request, &settings, &end, deviations, |slope, _| Some(slope.p_value));
    let mut fit = Fit { frames: Some(film.clone()), ..fitted.fit() };
    let shots: Vec<&Shot> = film.impacts.iter().map(|impact| &impact.shot).collect();
    let has_topspin = film.solution.topspins().iter().any(|topspin| *topspin > 0.5 * DIFFERS);
    doubts::comment(&mut fit, dataset, &shots, has_topspin, film_words::of_film(&film));
    Ok(fit)
}
