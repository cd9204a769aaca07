//! The fit of a table as a [`Fit`].

use std::sync::Arc;

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::common::{Common, Tested, correlation, ids, noise_of};
use super::deviations::{residuals, trends, whiten};
use super::diagnostics::{other_models, refuted};
use super::intervals::regions;
use super::request::Request;
use super::{
    Computed, Depth, Diagnostics, Estimate, Fit, FitError, Intervals, Noise, Profile, Status, check, notes,
};
use crate::measurement::dataset::Shot;
use crate::measurement::number::plain;
use crate::measurement::observable::Observable;
use crate::measurement::parameter::{Parameter, Settings};
use crate::physics::collision::{Coefficients, Fidelity, FidelityChoice};
use crate::physics::friction_law::Law;
use crate::problem::{self, Determined, Deviations, Id, Policy, RowsChoices, RowsFit, fit_rows, predict};

/// With more shots than this the regions of pairs of parameters and other models, some hundred fits, take
/// longer than reading, and are parabolas to the eye.
const MANY_SHOTS: usize = 5_000;

/// A fit with what it was fitted to.
struct Fitted<'a> {
    request: Request<'a>,
    shots: &'a [&'a Shot],
    settings: Settings,
    depth: Depth,
    rows: RowsFit,
    deviations: Vec<Option<Deviations>>,
}

/// Fits the shots of a table.
pub(super) fn fit(request: Request) -> Result<Fit, FitError> {
    let Request { dataset, options, .. } = request;
    let shots: Vec<&Shot> = dataset.shots.iter().collect();
    let depth = if shots.len() > MANY_SHOTS { options.depth.min(Depth::Intervals) } else { options.depth };
    // what no model describes is not worth more
    let is_light = options.fidelity == FidelityChoice::Auto && check::are_mixed_up(&shots);
    let fidelity = if is_light { FidelityChoice::Of(Fidelity::Full) } else { options.fidelity };
    let depth = if is_light { Depth::Estimates } else { depth };
    let without_profiles = depth < Depth::Intervals;
    let choices = RowsChoices { fidelity, loss: options.loss, without_profiles, near: None };
    let rows = fit_rows(dataset, &shots, &choices, &Policy::default());
    let rows = rows.map_err(|error| request.of_rows(error))?;
    let deviations = rows.solution.deviations();
    let settings = dataset.settings_of_balls();
    let fitted = Fitted { request, shots: &shots, settings, depth, rows, deviations };
    let mut fit = fitted.fit();
    let topspin = fitted.deviations.iter().flatten().any(|found| found.spins[0] > 0.0);
    notes::comment(&mut fit, dataset, &shots, topspin, fitted.notes());
    Ok(fit)
}

impl Fitted<'_> {
    fn common(&self) -> Common<'_> {
        Common { request: self.request, settings: &self.settings, solution: &self.rows.solution }
    }

    /// Returns the fit without what is to be said of it.
    fn fit(&self) -> Fit {
        let RowsFit { solution, estimates, as_free, .. } = &self.rows;
        let mut estimates: Vec<Estimate> = estimates.iter().map(estimate_of).collect();
        let kappa = solution.value(Id::Kappa);
        if kappa != 0.0 && estimates.iter().all(|estimate| estimate.parameter != Parameter::Kappa) {
            estimates.push(Estimate::bare(Parameter::Kappa, kappa, Status::Fixed));
            estimates.sort_by_key(|estimate| estimate.parameter as usize);
        }
        let covariance = solution.covariance_in(as_free, &ids(&estimates));
        let correlation = correlation(&estimates, &covariance);
        let mut fit = Fit { correlation, ..self.common().bare(estimates, Arc::new(solution.clone())) };
        for rejected in &mut fit.shots_rejected {
            let is_lost = |finding: &problem::Finding| matches!(finding, problem::Finding::LostShots { names } if names.contains(&rejected.shot));
            if solution.findings.iter().any(is_lost) {
                rejected.reason.push_str(&self.worst(&rejected.shot).unwrap_or_default());
            }
        }
        fit.dof = solution.dof();
        let is_known = |observable| self.noise_of(observable).is_none_or(|noise| noise.is_known);
        fit.residuals = residuals(&solution.names[0], &self.deviations, is_known);
        fit.noise = noise_of(&fit.residuals).into_iter().map(|noise| self.estimated(noise)).collect();
        let computed = Computed::of(solution, self.request.options.fidelity);
        fit.effects = Computed::effects(&computed);
        fit.diagnostics = self.diagnostics(&fit);
        fit.diagnostics.computed = computed;
        refuted::judge(&mut fit, self.shots);
        fit
    }

    /// Returns which number of a shot is farthest from what the fit of the others predicts.
    fn worst(&self, name: &str) -> Option<String> {
        let shot = self.shots.iter().find(|shot| shot.name == name)?;
        let value = |id: Id| self.rows.solution.value(id);
        let mut model = self.request.dataset.model(Fidelity::Full);
        if self.settings.falls {
            model.law = Law::Exponential { b: value(Id::FallB), c: value(Id::FallC) };
        }
        let coefficients = Coefficients { mu: value(Id::Mu), mu_s: value(Id::MuS), e: value(Id::E) };
        let predicted = predict(shot, &model, &coefficients).ok()?;
        let off = predicted.observables.iter().zip(&predicted.values).filter_map(|(observable, value)| {
            let measured = shot.after.iter().find(|after| after.observable == *observable)?.measured;
            let sd = measured.sd.or(self.noise_of(*observable).map(|noise| noise.sd))?;
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
    fn noise_of(&self, observable: Observable) -> Option<&problem::TableNoise> {
        self.rows.noises.iter().find(|noise| noise.observables.contains(&observable))
    }

    /// Returns the noise of an observable with what was estimated of it.
    fn estimated(&self, noise: Noise) -> Noise {
        let Some(found) = self.noise_of(noise.observable) else { return noise };
        let is_rounding = found.rounding > 0.0 && found.sd <= found.rounding;
        Noise {
            estimated_sd: Some(if found.is_known { found.sd } else { f64::NAN }),
            rounding: is_rounding.then_some(found.rounding),
            ..noise
        }
    }

    fn diagnostics(&self, fit: &Fit) -> Diagnostics {
        let Self { rows: RowsFit { solution, as_free, noises, dof, .. }, depth, request, .. } = self;
        let common = self.common();
        let is_of_contact = |estimate: &&Estimate| !estimate.parameter.is_of_balls();
        let of_contact = || fit.estimates.iter().filter(is_of_contact);
        let is_informed = |estimate: &Estimate| solution.is_informed(Id::from(estimate.parameter));
        let is_silent = |estimate: &&Estimate| estimate.status == Status::NotIdentified;
        let free =
            of_contact().filter(|e| e.status == Status::Free || is_silent(e)).filter(|e| is_informed(e));
        let free: Vec<Parameter> = free.map(|e| e.parameter).collect();
        let silent = fit.estimates.iter().filter(is_silent).filter(|e| !is_informed(e));
        let silent = silent.map(|e| e.parameter).collect();
        let tested = Tested {
            counted: fit.tested(),
            chi2: solution.chi2_of_all(),
            dof: fit.dof as f64,
            is_stated: noises.is_empty() && solution.weights().is_empty(),
            standardized: self.deviations.iter().flatten().flat_map(whiten).collect(),
            trends: trends(solution, &self.deviations, |slope| self.chance(slope)),
        };
        let mut diagnostics = common.diagnostics(&free, silent, tested);
        diagnostics.has_rival = fit.estimates.iter().any(|estimate| estimate.includes_other_minimum);
        let refutes =
            |finding: &problem::Finding| matches!(finding, problem::Finding::Misfit { refutes: true, .. });
        let is_refuted = solution.findings.iter().any(refutes);
        let everything = *depth >= Depth::Everything && !is_refuted;
        let has_error = |estimate: &&Estimate| estimate.std_error.is_some();
        // also those at bounds, at which their regions end
        let is_drawn = |estimate: &&Estimate| has_error(estimate) || estimate.is_at_bound();
        let drawn: Vec<&Estimate> = of_contact().filter(is_drawn).collect();
        if everything && diagnostics.robust.is_none() && self.rows.knows_noise() {
            diagnostics.contours = regions::contours(solution, as_free, &drawn, *dof);
            diagnostics.profiles = of_contact().filter(has_error).filter_map(|e| self.profile(e)).collect();
        }
        if everything {
            diagnostics.alternatives = other_models::compare(*request, &self.rows, &self.deviations);
        }
        diagnostics
    }

    /// Returns how χ² rises along a parameter.
    fn profile(&self, estimate: &Estimate) -> Option<Profile> {
        let ends = estimate.intervals.profile?;
        let points = self.rows.solution.curve(Id::from(estimate.parameter) as usize, ends);
        let (value, chi2_rise) = points.into_iter().map(|[value, rise]| (value, rise)).unzip();
        Some(Profile { parameter: estimate.parameter, value, chi2_rise })
    }

    /// Returns the probability of a slope by chance; the noise that is estimated from the same numbers is less without
    /// mean and slope.
    fn chance(&self, slope: &problem::Slope) -> Option<f64> {
        let Some(dof) = self.rows.dof else { return Some(slope.p_value) };
        if !self.rows.knows_noise() {
            return None;
        }
        let all: f64 = self.rows.noises.iter().map(|noise| noise.square).sum();
        let square = slope.t * slope.t;
        let left = (all - slope.level.unwrap_or(0.0) - square).max(f64::MIN_POSITIVE);
        let dof = dof - 1.0 - f64::from(slope.level.is_some());
        let t = (square * dof / left).sqrt();
        Some(2.0 * StudentsT::new(0.0, 1.0, dof).ok()?.sf(t.min(f64::MAX)))
    }

    /// Returns what is good to know of the fit of a table.
    fn notes(&self) -> impl Iterator<Item = String> {
        let has_no_speed = self.deviations.iter().flatten().any(|found| found.speed.is_none());
        let speed = has_no_speed.then_some(
            "Some shots have no speed. Only angles and ratios were asked of them, which do not depend on it.",
        );
        let regions = (self.depth < self.request.options.depth).then_some(
            "With so many shots the regions of pairs of parameters and other models are left out.",
        );
        speed.into_iter().chain(regions).map(str::to_owned)
    }
}

/// Returns the estimate of a parameter as fits state it.
fn estimate_of(found: &Determined) -> Estimate {
    let Some(parameter) = Parameter::ALL.into_iter().find(|p| Id::from(*p) == found.id) else {
        unreachable!("estimates are of parameters")
    };
    let profile = found.profile.map(|ends| ends.map(|end| end.value));
    let is_own = [found.of_error, profile].contains(&found.interval);
    let differs = |of_bounds: &f64| found.std_error.is_some_and(|error| error != *of_bounds);
    Estimate {
        std_error: found.std_error,
        interval_95: found.interval,
        intervals: Intervals {
            hessian: found.of_error,
            profile: if is_own { profile } else { found.interval },
        },
        std_error_at_bound: found.std_error_at_bounds.filter(differs),
        includes_other_minimum: !is_own,
        ..Estimate::bare(parameter, found.value, found.status)
    }
}
