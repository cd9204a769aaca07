//! The fit of a film as a [`Fit`].

use super::camera::FoundCamera;
use super::common::{Common, Tested, noise_of};
use super::deviations::{residuals, trends};
use super::film::FittedFilm;
use super::intervals::regions::contours;
use super::request::Request;
use super::{
    Bound, Computed, Counted, Depth, Diagnostics, Estimate, Fit, FitError, Intervals, JointFit, Status,
    film_words, notes,
};
use crate::measurement::dataset::{Measured, Shot};
use crate::measurement::parameter::{Compliance, Parameter, Settings};
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::measurement::values::Values;
use crate::physics::collision::{FidelityChoice, Model};
use crate::physics::friction_law::Law;
use crate::problem::{Deviations, Id, Impact, Modelling, Offsets, Policy, RowsError, Solution, fit_film};

/// Normal quantile of 95 % intervals.
const WIDE: f64 = 1.96;

/// A fit with what it was fitted to.
struct Fitted<'a> {
    request: Request<'a>,
    settings: Settings,
    film: FittedFilm,
    deviations: Vec<Option<Deviations>>,
}

/// Fits all frames of a film; returns the fit with the impacts.
pub(super) fn fit(request: Request) -> Result<(Fit, Vec<Impact>), FitError> {
    let Request { dataset, options, done, .. } = request;
    let (model, settings) = fitted_with(&request)?;
    let is_auto = options.fidelity == FidelityChoice::Auto;
    let modelling = Modelling { model, settings, is_auto, loss: options.loss.unwrap_or(dataset.loss) };
    let solution = fit_film(dataset, &modelling, &Policy::default());
    let film = FittedFilm::new(solution.map_err(|error| request.of_film(error))?, dataset);
    let impacts = film.impacts();
    let mut deviations = film.solution.deviations();
    for (found, track) in deviations.iter_mut().zip(film.tracks()) {
        if let Some(found) = found {
            found.spins[0] = stated_roll(track, found.spins[0]);
        }
    }
    let mut fit = Fitted { request, settings, film: film.clone(), deviations }.fit();
    let shots: Vec<&Shot> = impacts.iter().map(|impact| &impact.shot).collect();
    let has_topspin = film.solution.topspins().iter().any(|(_, topspin)| *topspin > 0.1);
    let of_film = notes::of_film(&fit, &film);
    notes::comment(&mut fit, dataset, &shots, has_topspin, of_film);
    for _ in &impacts {
        done();
    }
    Ok((fit, impacts))
}

/// Returns the model and the settings that the shots of a data set are fitted with.
///
/// # Errors
/// A contact that is stated to give way, at a fidelity that takes it as rigid.
fn fitted_with(request: &Request) -> Result<(Model, Settings), FitError> {
    let Request { dataset, options, .. } = *request;
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
            return Err(request.of_rows(RowsError::Rigid(fidelity.name())));
        }
        model.kappa = initial[Parameter::Kappa];
    }
    Ok((model, settings))
}

impl Fitted<'_> {
    fn solution(&self) -> &Solution {
        &self.film.solution
    }

    fn common(&self) -> Common<'_> {
        Common { request: self.request, settings: &self.settings, solution: self.solution() }
    }

    /// Returns the fit without what is to be said of it.
    fn fit(&self) -> Fit {
        let (solution, common) = (self.solution(), self.common());
        let estimates: Vec<Estimate> = common.parameters().iter().map(|p| self.estimate(*p)).collect();
        let residuals = residuals(&solution.names[0], &self.deviations, |_| true);
        let measured = |id: Id| self.film.shared(id).map(|(value, sd)| Measured::new(value, sd));
        let computed = Computed::of(solution, self.request.options.fidelity);
        Fit {
            sliding: measured(Id::MuK),
            rolling: measured(Id::MuR),
            footage: true,
            effects: Computed::effects(&computed),
            chi2: solution.chi2_of_data().0 + solution.prior_chi2(),
            dof: solution.dof(),
            noise: noise_of(&residuals),
            camera: Some(FoundCamera::of_film(solution)),
            diagnostics: Diagnostics { computed, ..self.diagnostics(&estimates) },
            residuals,
            frames: Some(self.film.clone()),
            explanations: film_words::explanations(solution, Some(&self.film)),
            ..common.bare(estimates, self.film.solution.clone())
        }
    }

    fn estimate(&self, parameter: Parameter) -> Estimate {
        let (solution, id) = (self.solution(), Id::from(parameter));
        let value = solution.value(id);
        let setting = self.settings[parameter];
        let Some(found) = solution.get(id) else {
            let is_held = setting.fixed || !self.settings.has(parameter);
            let status = if is_held { Status::Fixed } else { Status::NotIdentified };
            return Estimate::bare(parameter, value, status);
        };
        let [low, high] = solution.bounds(id);
        let Some(error) = found.std_error else {
            let Some(limit) = solution.limit_at_bound(id) else {
                return Estimate::bare(parameter, setting.initial, Status::NotIdentified);
            };
            let (status, ends) = if value == low {
                (Status::AtLowerBound, [low, limit])
            } else {
                (Status::AtUpperBound, [limit, high])
            };
            let mut bare = Estimate::bare(parameter, value, status);
            bare.interval_95 = Some(ends);
            bare.intervals.hessian = Some(ends);
            return bare.unless_uninformed(&setting);
        };
        if parameter == Parameter::MuS && solution.is_undetermined(id) {
            return Estimate::bare(parameter, value, Status::NotIdentified);
        }
        let interval = Some([(value - WIDE * error).max(low), (value + WIDE * error).min(high)]);
        let looks = self.request.options.depth >= Depth::Intervals && !parameter.is_of_balls();
        let is_robust = !solution.weights().is_empty();
        let profile = (looks && !is_robust).then(|| solution.lopsided_interval(id, WIDE)).flatten();
        Estimate {
            std_error: Some(error),
            interval_95: profile.or(interval),
            intervals: Intervals { hessian: interval, profile },
            ..Estimate::bare(parameter, value, Status::Free)
        }
    }

    /// Returns the outcome offsets of all shots, whitened in the frame of their collision.
    fn whitened_offsets(&self) -> Vec<f64> {
        let of_shot = |i: usize| {
            let Offsets { values, covariance } = self.solution().offsets(0, i)?;
            covariance.cholesky()?.l().solve_lower_triangular(&values)
        };
        let shots = 0..self.solution().names[0].len();
        shots.filter_map(of_shot).flat_map(|white| white.iter().copied().collect::<Vec<_>>()).collect()
    }

    fn diagnostics(&self, estimates: &[Estimate]) -> Diagnostics {
        let (solution, common) = (self.solution(), self.common());
        let contact = common.contact();
        let parameters: Vec<Parameter> = contact.iter().map(|(p, _)| *p).collect();
        let is_silent = |e: &&Estimate| {
            e.status == Status::NotIdentified && solution.get(Id::from(e.parameter)).is_none()
        };
        let silent = estimates.iter().filter(is_silent).map(|e| e.parameter).collect();
        let drawn: Vec<&Estimate> = estimates.iter().filter(|e| parameters.contains(&e.parameter)).collect();
        let (chi2, observations) = solution.chi2_of_data();
        let unknowns = solution.own_count();
        let tested = Tested {
            counted: Counted::Velocities,
            chi2,
            dof: (observations - unknowns as f64 - solution.data_count()).max(0.0),
            is_stated: solution.states_noise(),
            standardized: self.whitened_offsets(),
            trends: trends(solution, &self.deviations, |slope| Some(slope.p_value)),
        };
        let mut diagnostics = common.diagnostics(&parameters, silent, tested);
        diagnostics.bound = Some(Bound { std_errors: contact, shots: solution.names[0].len() });
        // what is known of the contact stands among the parameters
        let shared = solution.estimates().into_iter().filter(|e| e.id > Id::RadiusRatio).collect();
        let p_value = diagnostics.goodness.as_ref().and_then(|goodness| goodness.p_value);
        let observations = observations.round() as usize;
        diagnostics.joint = Some(JointFit { p_value, observations, unknowns, shared });
        if self.request.options.depth >= Depth::Everything {
            diagnostics.contours = contours(solution, &solution.covariance, &drawn, None);
        }
        diagnostics
    }
}

/// Returns the topspin of a shot over natural roll if it is known beforehand, NaN if not: of spins that the frames
/// told, topspin is no variable of its own.
fn stated_roll(track: &TrackShot, fitted: f64) -> f64 {
    match track.spin {
        Spin::Stun => 0.0,
        Spin::NaturalRoll => 1.0,
        Spin::Measured { .. } => fitted,
        Spin::Unknown => f64::NAN,
    }
}
