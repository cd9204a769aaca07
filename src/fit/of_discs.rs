//! The fit of films of discs as a [`Fit`].

use std::sync::Arc;

use nalgebra::DVector;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::camera::FoundCamera;
use super::common::{Common, Tested, noise_of};
use super::diagnostics::trends::{Slope, ranked};
use super::extracted_discs::allow_friction;
use super::intervals::regions::contours;
use super::request::Request;
use super::{
    Computed, Counted, Depth, Diagnostics, Estimate, Fit, FitError, FrictionCurve, Intervals, Residual,
    Scatter, Status, Trend, Variable, notes,
};
use crate::measurement::observable::Observable;
use crate::measurement::parameter::{Parameter, Settings};
use crate::physics::ball::Ball;
use crate::physics::collision::{Effects, Fidelity};
use crate::problem::{
    Component, DiscFit, DiscImpact, Finding, Id, Policy, Quantity, Rival, ShiftScore, fit_discs,
};

/// Normal quantile of a one-sided interval of 95 %.
const ONE_SIDED: f64 = 1.645;

/// Shots that tell how much shots differ.
const LEAST_SHOTS: usize = 3;

/// A fit with what it was fitted to.
struct Fitted<'a> {
    request: Request<'a>,
    settings: Settings,
    found: DiscFit,
}

/// Fits films of discs.
pub(super) fn fit(request: Request) -> Result<Fit, FitError> {
    let mut dataset = request.dataset.clone();
    allow_friction(&mut dataset.settings);
    let request = Request { dataset: &dataset, ..request };
    let found = fit_discs(&dataset, &Policy::default()).map_err(|error| request.of_film(error))?;
    let fitted = Fitted { settings: dataset.settings, found, request };
    let mut fit = fitted.fit();
    notes::comment(&mut fit, &dataset, &[], false, fitted.notes());
    Ok(fit)
}

impl Fitted<'_> {
    fn common(&self) -> Common<'_> {
        Common { request: self.request, settings: &self.settings, solution: &self.found.solution }
    }

    /// Returns the scatter of a quantity from shot to shot.
    fn scatter(&self, component: Component) -> f64 {
        let mut all = self.found.scatter.iter();
        all.find(|of| of.component == component).map_or(0.0, |of| of.sd)
    }

    fn fit(&self) -> Fit {
        let DiscFit { solution, impacts, .. } = &self.found;
        let (dataset, common) = (self.request.dataset, self.common());
        let parameters = common.parameters().into_iter().filter(|p| *p != Parameter::MuS && !p.is_of_balls());
        let estimates: Vec<Estimate> = parameters.map(|p| self.estimate(p)).collect();
        let residuals = self.residuals();
        let discs = dataset.tracks.as_ref().and_then(|tracks| tracks.discs);
        let radius = discs.and_then(|discs| discs.radii).map_or_else(
            || 0.5 * solution.value(Id::ContactDistance),
            |[first, second]| 0.5 * (first + second),
        );
        let inertia = discs.map_or(Ball::POOL.inertia, |discs| discs.inertia);
        let effects = Effects {
            compliance: solution.value(Id::Kappa) > 0.0,
            falling_friction: self.settings.falls,
            ..Fidelity::Full.effects()
        };
        let mut fit = Fit {
            ball: Ball { radius, mass: 1.0, inertia },
            object: None,
            discs,
            effects: effects.list().to_vec(),
            noise: noise_of(&residuals),
            disc_shots: impacts.clone(),
            scatter: Some(Scatter {
                restitution: self.scatter(Component::Restitution),
                impulse_ratio: self.scatter(Component::Ratio),
                is_estimated: solution.names[0].len() >= LEAST_SHOTS,
            }),
            camera: Some(FoundCamera::of_film(solution)),
            diagnostics: self.diagnostics(&estimates, &residuals),
            residuals,
            ..common.bare(estimates, Arc::new(solution.clone()))
        };
        if let Some(goodness) = &fit.diagnostics.goodness {
            (fit.chi2, fit.dof, fit.prior_chi2) = (goodness.chi2, goodness.dof, 0.0);
        }
        fit.diagnostics.computed =
            vec![Computed { fidelity: Fidelity::Full, effects, shots: solution.names[0].len() }];
        fit.friction_curve = FrictionCurve::of_fit(&fit);
        fit
    }

    fn estimate(&self, parameter: Parameter) -> Estimate {
        let (solution, id) = (&self.found.solution, Id::from(parameter));
        let value = solution.value(id);
        let is_undetermined =
            |finding: &Finding| matches!(finding, Finding::Undetermined { id: open, .. } if *open == id);
        let is_determined = !solution.findings.iter().any(is_undetermined);
        let Some(found) = solution.get(id).filter(|_| is_determined) else {
            let is_fixed = self.settings[parameter].fixed;
            if parameter == Parameter::Mu && !is_fixed {
                return self.bounded_friction(solution.bounds(id)[1]);
            }
            let status = if is_fixed { Status::Fixed } else { Status::NotIdentified };
            return Estimate::bare(parameter, value, status);
        };
        let [low, high] = solution.bounds(id);
        let Some(error) = found.std_error else {
            let status = match value {
                x if x == low => Status::AtLowerBound,
                x if x == high => Status::AtUpperBound,
                _ => {
                    return Estimate::bare(
                        parameter,
                        self.settings[parameter].initial,
                        Status::NotIdentified,
                    );
                }
            };
            return Estimate::bare(parameter, value, status);
        };
        let interval = self.found.interval_95(id);
        let of_contact = matches!(id, Id::Mu | Id::Kappa);
        let includes_other_minimum = of_contact && self.found.rivals.iter().any(Rival::is_within_95);
        Estimate {
            std_error: Some(error),
            interval_95: interval,
            intervals: Intervals { hessian: interval, profile: interval.filter(|_| includes_other_minimum) },
            includes_other_minimum,
            ..Estimate::bare(parameter, value, Status::Free)
        }
    }

    /// Returns the estimate of a friction on which nothing depends since all discs stick together where they
    /// touch: it is at least the largest J_t/J_n.
    fn bounded_friction(&self, upper: f64) -> Estimate {
        let DiscFit { solution, impacts, .. } = &self.found;
        let used = impacts.iter().filter(|impact| solution.names[0].contains(&impact.name));
        let known = used.filter(|impact| impact.get(Quantity::SlipBefore).is_some());
        let ratios: Vec<_> = known.filter_map(|impact| impact.get(Quantity::ImpulseRatio)).collect();
        let largest = ratios.iter().max_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
        // of a single shot it is not known whether the discs stick together
        let Some(ratio) = largest.filter(|_| ratios.len() > 1) else {
            let initial = self.settings[Parameter::Mu].initial;
            return Estimate::bare(Parameter::Mu, initial, Status::NotIdentified);
        };
        let low = ratio.value.abs() - ONE_SIDED * ratio.sd.unwrap_or(0.0);
        Estimate {
            interval_95: Some([low.max(0.0), upper]),
            ..Estimate::bare(Parameter::Mu, ratio.value.abs(), Status::Free)
        }
    }

    /// Returns e and J_t/J_n of the shots that were fitted, against the law; the tangent of a cut angle is the slip over
    /// the closing speed, 0 if that is not known.
    fn residuals(&self) -> Vec<Residual> {
        let DiscFit { solution, impacts, .. } = &self.found;
        let of_shot = |impact: &DiscImpact| -> Option<Vec<Residual>> {
            let closing = impact.get(Quantity::ClosingSpeed)?.value;
            let slip = impact.get(Quantity::SlipRatio).map(|slip| slip.value);
            let cut = slip.unwrap_or(0.0).atan();
            let row = |observable, quantity, predicted: f64, spread: f64| {
                let measured = impact.get(quantity)?;
                let sd = measured.sd?.hypot(spread);
                Some(Residual {
                    shot: impact.name.clone(),
                    observable,
                    measured: measured.value,
                    predicted,
                    sd,
                    standardized: (measured.value - predicted) / sd,
                    cut,
                    speed: Some(closing / cut.cos()),
                })
            };
            let e = solution.value(Id::E) - solution.value(Id::ESlope) * closing;
            let of_e =
                row(Observable::Restitution, Quantity::Restitution, e, self.scatter(Component::Restitution));
            let law = slip.and_then(|slip| solution.impulse_ratio([closing, slip * closing]));
            let of_ratio = law.and_then(|ratio| {
                row(Observable::ImpulseRatio, Quantity::ImpulseRatio, ratio, self.scatter(Component::Ratio))
            });
            Some(of_e.into_iter().chain(of_ratio).collect())
        };
        let used = impacts.iter().filter(|impact| solution.names[0].contains(&impact.name));
        used.filter_map(of_shot).flatten().collect()
    }

    fn diagnostics(&self, estimates: &[Estimate], residuals: &[Residual]) -> Diagnostics {
        let common = self.common();
        let of_law: Vec<&Estimate> = estimates.iter().filter(|e| e.std_error.is_some()).collect();
        let parameters: Vec<Parameter> = of_law.iter().map(|e| e.parameter).collect();
        let silent = estimates.iter().filter(|e| e.status == Status::NotIdentified);
        let silent = silent.map(|e| e.parameter).collect();
        let standardized: Vec<f64> = residuals.iter().map(|residual| residual.standardized).collect();
        let tested = Tested {
            counted: Counted::Impulses,
            chi2: standardized.iter().map(|x| x * x).sum(),
            dof: standardized.len().saturating_sub(parameters.len()) as f64,
            is_stated: false,
            standardized,
            trends: self.trends(residuals),
        };
        let has_rival = !self.found.rivals.is_empty();
        let diagnostics = common.diagnostics(&parameters, silent, tested);
        let mut diagnostics = Diagnostics { robust: None, has_rival, ..diagnostics };
        if self.request.options.depth >= Depth::Everything {
            let solution = &self.found.solution;
            diagnostics.contours = contours(solution, &solution.covariance, &of_law, Some(self.found.dof));
        }
        diagnostics
    }

    /// Returns how e and J_t/J_n less the law change with closing speed and slip.
    fn trends(&self, residuals: &[Residual]) -> Vec<Trend> {
        let solution = &self.found.solution;
        let columns = solution.own_columns().len();
        let shots: Vec<&[Residual]> = residuals.chunk_by(|one, next| one.shot == next.shot).collect();
        let closing = |own: &&[Residual]| own[0].speed.unwrap_or(f64::NAN) * own[0].cut.cos();
        let variables = [
            (Variable::Speed, shots.iter().map(closing).collect::<Vec<_>>()),
            (Variable::Slip, shots.iter().map(|own| own[0].cut.tan().abs()).collect()),
        ];
        let mut found = Vec::new();
        for observable in [Observable::Restitution, Observable::ImpulseRatio] {
            let score = |own: &&[Residual]| {
                let residual = own.iter().find(|residual| residual.observable == observable)?;
                // friction has the sign of the slip
                let side = if observable == Observable::ImpulseRatio { -residual.cut.signum() } else { 1.0 };
                let along = -side * residual.standardized;
                Some(ShiftScore { square: 1.0, along, beside: DVector::zeros(columns) })
            };
            let scores: Vec<Option<ShiftScore>> = shots.iter().map(score).collect();
            let along: Vec<f64> = scores.iter().flatten().map(|score| score.along).collect();
            let mean = along.iter().sum::<f64>() / along.len() as f64;
            let square = along.iter().map(|along| (along - mean).powi(2)).sum::<f64>();
            let dof = along.len() as f64 - 2.0;
            for (variable, values) in &variables {
                let Some(slope) = solution.slope_of(values, &scores) else { continue };
                let Ok(t) = StudentsT::new(0.0, 1.0, dof) else { continue };
                // the scatter that is stated includes a trend, that about the line does not
                let about_line = ((square - slope.t.powi(2)) / dof).sqrt();
                let p_value = 2.0 * t.sf(slope.t.abs() / about_line);
                let quantity = observable.label();
                found.push(Slope { quantity, variable: *variable, value: slope.value, p_value });
            }
        }
        ranked(found)
    }

    /// Returns what is good to know of the fit of discs.
    fn notes(&self) -> Vec<String> {
        let DiscFit { solution, impacts, scatter, .. } = &self.found;
        let count = |is: &dyn Fn(&DiscImpact) -> bool| impacts.iter().filter(|impact| is(impact)).count();
        let stuck = count(&|impact| impact.stuck.is_some());
        let unseen = count(&|impact| impact.get(Quantity::SlipBefore).is_none());
        let stuck = (stuck > 0).then(|| {
            format!(
                "In {stuck} of {} shots the discs stick together: \"caromfit extract\" gives their motion.",
                impacts.len()
            )
        });
        let is_other = |component| !matches!(component, Component::Restitution | Component::Ratio);
        let others = scatter.iter().filter(|of| is_other(of.component) && of.sd > 0.0);
        let others: Vec<String> = others.map(|of| format!("{} {:.2e}", of.component.name(), of.sd)).collect();
        let others = (!others.is_empty()).then(|| {
            format!(
                "Beyond the noise of the frames shots differ, too, in {}; errors include it.",
                others.join(", ")
            )
        });
        let rotation = notes::rotation(unseen, impacts.len());
        [stuck, rotation, notes::slowing(solution), others].into_iter().flatten().collect()
    }
}
