//! The fit of films of discs as a [`Fit`].

use std::sync::Arc;
use std::time::Instant;

use nalgebra::DVector;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::camera::FoundCamera;
use super::common::Common;
use super::diagnostics::goodness::normality_of;
use super::diagnostics::trends::ranked;
use super::extracted_discs::allow_friction;
use super::intervals::regions::contours;
use super::{
    Computed, Counted, Depth, Diagnostics, Estimate, Fit, FitError, FrictionCurve, Goodness, Intervals,
    Noise, NoiseVerdict, Options, Plateau, Rejected, Residual, Scatter, Status, Trend, Variable, disc_words,
    film_words, warnings,
};
use crate::measurement::dataset::{Dataset, DiscShot};
use crate::measurement::observable::Observable;
use crate::measurement::parameter::{Parameter, Settings};
use crate::physics::ball::Ball;
use crate::physics::collision::{Effects, Fidelity};
use crate::problem::{
    Component, DiscFit, DiscImpact, FilmError, Finding, Id, Policy, Quantity, Rival, Severity, ShiftScore,
    fit_discs,
};

/// Normal quantile of a one-sided interval of 95 %.
const ONE_SIDED: f64 = 1.645;

/// Shots that tell how much shots differ.
const LEAST_SHOTS: usize = 3;

/// Films of discs, and how they are fitted.
pub(super) struct Request<'a> {
    pub dataset: &'a Dataset,
    pub group: Option<&'a (String, String)>,
    pub options: &'a Options,
    pub done: &'a (dyn Fn() + Sync),
}

struct Fitted<'a> {
    request: Request<'a>,
    settings: Settings,
    found: DiscFit,
}

/// e and J_t/J_n of a shot, as measured and as the law of the fit has them.
struct Point {
    closing: f64,
    /// Slip over the closing speed; 0 if it is not known.
    slip: f64,
    residuals: Vec<Residual>,
}

/// Fits films of discs.
pub(super) fn fit(request: Request) -> Result<Fit, FitError> {
    let begun = Instant::now();
    let mut dataset = request.dataset.clone();
    allow_friction(&mut dataset.settings);
    let request = Request { dataset: &dataset, ..request };
    let found = fit_discs(&dataset, &Policy::default()).map_err(|error| match error {
        FilmError::NoImpact(reasons) => FitError::NoUsableShot {
            dataset: dataset.name.clone(),
            shots_rejected: reasons.into_iter().map(|(shot, reason)| Rejected { shot, reason }).collect(),
        },
        other => FitError::Film(dataset.name.clone(), other),
    })?;
    let fitted = Fitted { settings: dataset.settings, found, request };
    let mut fit = fitted.fit();
    fitted.comment(&mut fit);
    fit.seconds = begun.elapsed().as_secs_f64();
    Ok(fit)
}

impl Fitted<'_> {
    fn common(&self) -> Common<'_> {
        let Request { dataset, group, options, done } = self.request;
        let (settings, solution) = (&self.settings, &self.found.solution);
        Common { dataset, group, options, settings, solution, done }
    }

    fn fit(&self) -> Fit {
        let DiscFit { solution, impacts, scatter, .. } = &self.found;
        let (dataset, common) = (self.request.dataset, self.common());
        let parameters = common.parameters().into_iter().filter(|p| *p != Parameter::MuS && !p.is_of_balls());
        let estimates: Vec<Estimate> = parameters.map(|p| self.estimate(p)).collect();
        let points = self.points();
        let residuals: Vec<Residual> = points.iter().flat_map(|point| point.residuals.clone()).collect();
        let discs = dataset.tracks.as_ref().and_then(|tracks| tracks.discs);
        let radius = discs.and_then(|discs| discs.radii).map_or_else(
            || 0.5 * solution.value(Id::ContactDistance),
            |[first, second]| 0.5 * (first + second),
        );
        let inertia = discs.map_or(Ball::POOL.inertia, |discs| discs.inertia);
        let sd = |component: Component| {
            scatter.iter().find(|of| of.component == component).map_or(0.0, |of| of.sd)
        };
        let is_compliant = solution.value(Id::Kappa) > 0.0;
        let effects = Effects {
            compliance: is_compliant,
            falling_friction: self.settings.falls,
            ..Fidelity::Full.effects()
        };
        let mut fit = Fit {
            ball: Ball { radius, mass: 1.0, inertia },
            object: None,
            discs,
            effects: effects.list().to_vec(),
            noise: noise(&residuals),
            disc_shots: impacts.iter().map(|impact| self.disc_shot(impact)).collect(),
            scatter: Some(Scatter {
                restitution: sd(Component::Restitution),
                impulse_ratio: sd(Component::Ratio),
                is_estimated: points.len() >= LEAST_SHOTS,
            }),
            camera: Some(FoundCamera::of_film(solution)),
            residuals,
            diagnostics: self.diagnostics(&estimates, &points),
            ..common.bare(estimates, Arc::new(solution.clone()))
        };
        if let Some(goodness) = &fit.diagnostics.goodness {
            (fit.chi2, fit.dof, fit.prior_chi2) = (goodness.chi2, goodness.dof, 0.0);
        }
        fit.diagnostics.computed =
            vec![Computed { fidelity: Fidelity::Full, effects, shots: solution.names[0].len() }];
        fit.friction_curve = FrictionCurve::of_fit(&fit);
        let is_bounded =
            |estimate: &&Estimate| estimate.status == Status::Free && estimate.std_error.is_none();
        let bounded = fit.estimates.iter().find(is_bounded).map(|estimate| Plateau {
            parameter: estimate.parameter,
            edge: estimate.value,
            bound: solution.bounds(Id::from(estimate.parameter))[1],
        });
        fit.diagnostics.plateaus.extend(bounded);
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

    /// Returns what was measured of a shot, with the reason if it is not fitted.
    fn disc_shot(&self, impact: &DiscImpact) -> DiscShot {
        let get = |quantity| impact.get(quantity);
        let why = self.found.solution.left_out.iter().find(|(name, _)| *name == impact.name);
        DiscShot {
            name: impact.name.clone(),
            restitution: get(Quantity::Restitution),
            impulse_ratio: get(Quantity::ImpulseRatio),
            momentum: [Quantity::MomentumAlong, Quantity::MomentumAcross].map(get),
            angular_momentum: get(Quantity::AngularMomentum),
            energy_lost: get(Quantity::EnergyLost),
            closing_speed: get(Quantity::ClosingSpeed),
            slip_ratio: get(Quantity::SlipRatio),
            sticks: impact.stuck.is_some(),
            doubts: why.filter(|_| impact.stuck.is_none()).map_or(String::new(), |(_, why)| why.clone()),
        }
    }

    /// Returns the shots that were fitted against the law.
    fn points(&self) -> Vec<Point> {
        let DiscFit { solution, impacts, scatter, .. } = &self.found;
        let spread = |component: Component| {
            scatter.iter().find(|of| of.component == component).map_or(0.0, |of| of.sd)
        };
        let point = |impact: &DiscImpact| {
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
            let of_e = row(Observable::Restitution, Quantity::Restitution, e, spread(Component::Restitution));
            let law = slip.and_then(|slip| solution.impulse_ratio([closing, slip * closing]));
            let of_ratio = law.and_then(|ratio| {
                row(Observable::ImpulseRatio, Quantity::ImpulseRatio, ratio, spread(Component::Ratio))
            });
            let residuals = of_e.into_iter().chain(of_ratio).collect();
            Some(Point { closing, slip: slip.unwrap_or(0.0), residuals })
        };
        let used = impacts.iter().filter(|impact| solution.names[0].contains(&impact.name));
        used.filter_map(point).collect()
    }

    fn diagnostics(&self, estimates: &[Estimate], points: &[Point]) -> Diagnostics {
        let common = self.common();
        let of_law: Vec<&Estimate> = estimates.iter().filter(|e| e.std_error.is_some()).collect();
        let parameters: Vec<Parameter> = of_law.iter().map(|e| e.parameter).collect();
        let silent = estimates.iter().filter(|e| e.status == Status::NotIdentified);
        let silent = silent.map(|e| e.parameter).collect();
        let draws = self.request.options.depth >= Depth::Everything;
        let standardized: Vec<f64> =
            points.iter().flat_map(|point| &point.residuals).map(|r| r.standardized).collect();
        let influential_from = common.influential_from(standardized.len() as f64);
        let chi2 = standardized.iter().map(|x| x * x).sum();
        Diagnostics {
            identifiability: common.identifiability(&parameters, silent),
            goodness: Some(Goodness {
                counted: Counted::Impulses,
                chi2,
                dof: standardized.len().saturating_sub(parameters.len()),
                noise_is_stated: false,
                p_value: None,
                noise: NoiseVerdict::NotTested,
                noise_factor: None,
                trends: self.trends(points),
                normality: normality_of(&standardized),
                influence: common.influence(influential_from),
                influential_from,
            }),
            bootstrap: common.bootstrap(&common.contact()),
            contours: if draws {
                contours(&self.found.solution, &self.found.solution.covariance, &of_law, Some(self.found.dof))
            } else {
                Vec::new()
            },
            has_rival: !self.found.rivals.is_empty(),
            ..Diagnostics::default()
        }
    }

    /// Returns how e and J_t/J_n less the law change with closing speed and slip.
    fn trends(&self, points: &[Point]) -> Vec<Trend> {
        let solution = &self.found.solution;
        let columns = solution.own_columns().len();
        let variables = [
            (Variable::Speed, points.iter().map(|point| point.closing).collect::<Vec<_>>()),
            (Variable::Slip, points.iter().map(|point| point.slip.abs()).collect()),
        ];
        let mut found = Vec::new();
        for observable in [Observable::Restitution, Observable::ImpulseRatio] {
            let score = |point: &Point| {
                let residual = point.residuals.iter().find(|residual| residual.observable == observable)?;
                // friction has the sign of the slip
                let side = if observable == Observable::ImpulseRatio { -point.slip.signum() } else { 1.0 };
                let along = -side * residual.standardized;
                Some(ShiftScore { square: 1.0, along, beside: DVector::zeros(columns) })
            };
            let scores: Vec<Option<ShiftScore>> = points.iter().map(score).collect();
            let along: Vec<f64> = scores.iter().flatten().map(|score| score.along).collect();
            let mean = along.iter().sum::<f64>() / along.len() as f64;
            let square = along.iter().map(|along| (along - mean).powi(2)).sum::<f64>();
            let dof = along.len() as f64 - 2.0;
            for (variable, values) in &variables {
                let Some(slope) = solution.slope_of(values, &scores) else { continue };
                let Ok(t) = StudentsT::new(0.0, 1.0, dof) else { continue };
                // the scatter that is stated includes a trend, that about the line does not
                let about_line = ((square - slope.t.powi(2)) / dof).sqrt();
                let p = 2.0 * t.sf(slope.t.abs() / about_line);
                found.push((observable.label(), *variable, slope.value, p));
            }
        }
        ranked(found)
    }

    /// Adds what is to be said of the fit.
    fn comment(&self, fit: &mut Fit) {
        let DiscFit { solution, impacts, scatter, .. } = &self.found;
        let stuck = impacts.iter().filter(|impact| impact.stuck.is_some()).count();
        let (warned, notes): (Vec<_>, Vec<_>) =
            solution.findings.iter().partition(|finding| finding.severity() > Severity::Note);
        let said = |finding: &&Finding| film_words::sentence(finding, None, 0.0);
        fit.warnings = warned.iter().filter_map(said).collect();
        fit.notes = notes.iter().filter_map(said).collect();
        warnings::add(fit, false, true);
        if stuck > 0 {
            fit.notes.push(format!(
                "In {stuck} of {} shots the discs stick together: \"caromfit extract\" gives their motion.",
                impacts.len()
            ));
        }
        let unseen = impacts.iter().filter(|impact| impact.get(Quantity::SlipBefore).is_none()).count();
        fit.notes.extend(disc_words::rotation(unseen, impacts.len()));
        fit.notes.extend(disc_words::slowing(solution));
        let others = scatter
            .iter()
            .filter(|of| !matches!(of.component, Component::Restitution | Component::Ratio) && of.sd > 0.0);
        let others: Vec<String> = others.map(|of| format!("{} {:.2e}", of.component.name(), of.sd)).collect();
        if !others.is_empty() {
            fit.notes.push(format!(
                "Beyond the noise of the frames shots differ, too, in {}; errors include it.",
                others.join(", ")
            ));
        }
        fit.notes.extend(self.request.dataset.notes().cloned());
    }
}

/// Returns a row for e and one for J_t/J_n.
fn noise(residuals: &[Residual]) -> Vec<Noise> {
    let of = |observable: Observable| {
        let own: Vec<f64> = residuals
            .iter()
            .filter(|residual| residual.observable == observable)
            .map(|residual| residual.measured - residual.predicted)
            .collect();
        let rms = (own.iter().map(|off| off * off).sum::<f64>() / own.len() as f64).sqrt();
        (!own.is_empty()).then_some(Noise {
            observable,
            count: own.len(),
            rms,
            estimated_sd: None,
            rounding: None,
        })
    };
    [Observable::Restitution, Observable::ImpulseRatio].into_iter().filter_map(of).collect()
}
