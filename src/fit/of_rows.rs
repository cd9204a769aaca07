//! The fit of a table as a [`Fit`].

use std::sync::Arc;

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::common::{Fitted, Own, check_fidelity};
use super::deviations::trends;
use super::request::Request;
use super::{Depth, Estimate, Fit, FitError, Status, doubts};
use crate::measurement::dataset::Shot;
use crate::measurement::number::plain;
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;
use crate::physics::collision::{Coefficients, Fidelity};
use crate::physics::friction_law::Law;
use crate::problem::{self, Finding, Id, MANY_SHOTS, Policy, RowsChoices, RowsFit, fit_rows, predict};

/// A fit with what it was fitted to.
struct OfRows<'a> {
    common: Fitted<'a>,
    rows: RowsFit,
}

/// Fits the shots of a table.
pub(super) fn fit(request: Request) -> Result<Fit, FitError> {
    let Request { dataset, options, .. } = request;
    check_fidelity(&request)?;
    let without_profiles = options.depth < Depth::Intervals;
    let choices = RowsChoices { fidelity: options.fidelity, loss: options.loss, without_profiles };
    let rows = fit_rows(dataset, &choices, &Policy::default());
    let rows = rows.map_err(|error| request.of_rows(error))?;
    let common = Fitted {
        request,
        settings: dataset.settings_of_balls(),
        solution: Arc::new(rows.solution.clone()),
        deviations: rows.solution.deviations(),
    };
    let fitted = OfRows { common, rows };
    let mut fit = fitted.fit();
    let mut deviations = fitted.common.deviations.iter().flatten();
    let has_topspin = deviations.any(|found| found.spins[0] > 0.0);
    let shots: Vec<&Shot> = dataset.shots.iter().collect();
    doubts::comment(&mut fit, dataset, &shots, has_topspin, []);
    Ok(fit)
}

impl OfRows<'_> {
    /// Returns the fit without its remarks.
    fn fit(&self) -> Fit {
        let mut fit = self.common.fit(self.own());
        for rejected in &mut fit.shots_rejected {
            let is_lost = |finding: &Finding| matches!(finding, Finding::LostShots { names } if names.contains(&rejected.shot));
            if self.rows.solution.findings.iter().any(is_lost) {
                rejected.reason.push_str(&self.worst(&rejected.shot).unwrap_or_default());
            }
        }
        for noise in &mut fit.noise {
            let Some(found) = self.noise_of(noise.observable) else { continue };
            let rounding = found.pool.rounding;
            let is_rounding = rounding > 0.0 && found.sd <= rounding;
            noise.estimated_sd = Some(if found.is_known { found.sd } else { f64::NAN });
            noise.rounding = is_rounding.then_some(rounding);
        }
        for residual in &mut fit.residuals {
            if self.noise_of(residual.observable).is_some_and(|noise| !noise.is_known) {
                (residual.sd, residual.standardized) = (f64::NAN, f64::NAN);
            }
        }
        fit
    }

    fn own(&self) -> Own<'_> {
        let Self { common, rows: RowsFit { solution, as_free, noises, dof, estimates, .. } } = self;
        let mut estimates = estimates.clone();
        let kappa = solution.value(Id::Kappa);
        if kappa != 0.0 && estimates.iter().all(|estimate| estimate.parameter != Parameter::Kappa) {
            estimates.push(Estimate::bare(Parameter::Kappa, kappa, Status::Fixed));
            estimates.sort_by_key(|estimate| estimate.parameter as usize);
        }
        let parameters = |is_wanted: &dyn Fn(&Estimate) -> bool| -> Vec<Parameter> {
            estimates.iter().filter(|e| is_wanted(e)).map(|e| e.parameter).collect()
        };
        let is_informed = |e: &Estimate| solution.is_informed(Id::from(e.parameter));
        let is_silent = |e: &Estimate| e.status == Status::NotIdentified;
        let is_of_contact = |e: &Estimate| !e.parameter.is_of_balls();
        let has_regions = !solution.problem.is_robust()
            && !solution.is_refuted()
            && self.rows.knows_noise()
            && common.request.dataset.shots.len() <= MANY_SHOTS;
        // also those at bounds, at which their regions end
        let has_region = |e: &Estimate| has_regions && (e.std_error.is_some() || e.is_at_bound());
        Own {
            errors: as_free,
            combined: parameters(&|e| {
                is_of_contact(e) && (e.status == Status::Free || is_silent(e)) && is_informed(e)
            }),
            silent: parameters(&|e| is_silent(e) && !is_informed(e)),
            drawn: parameters(&|e| is_of_contact(e) && has_region(e)),
            dof_of_noise: *dof,
            chi2: solution.chi2_of_all(),
            dof: solution.dof() as f64,
            is_stated: noises.is_empty() && solution.weights().is_empty(),
            trends: trends(solution, &common.deviations, |slope, _| self.chance(slope)),
            estimates,
        }
    }

    /// Returns which number of a shot is farthest from what the fit of the others predicts.
    fn worst(&self, name: &str) -> Option<String> {
        let shot = self.common.request.dataset.shots.iter().find(|shot| shot.name == name)?;
        let value = |id: Id| self.rows.solution.value(id);
        let mut model = self.common.request.dataset.model(Fidelity::Full);
        if self.common.settings.falls {
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
        self.rows.noises.iter().find(|noise| noise.pool.observables.contains(&observable))
    }

    /// Returns the probability of a slope by chance; the noise that is estimated from the same
    /// numbers is less without mean and slope.
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
}
