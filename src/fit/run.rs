//! The fit itself: shots to plans, weights, the optimiser, and again until the weights rest.

use std::time::Instant;

use nalgebra::{DMatrix, DVector};

use super::uncertainty::{self, Minimum};
use super::{Estimate, Fit, FitError, Noise, Options, Rejected, Residual, Status};
use crate::collision::{Coefficients, Fidelity, Model};
use crate::dataset::{Dataset, Shot};
use crate::observable::Observable;
use crate::optimise::{self, Constraints};
use crate::parameters::{Parameter, Settings};
use crate::residuals::{
    self, EstimatedSd, Fitted, Problem, Whitening, covariance, difference, parameter_mut,
};

/// Re-weighting converges by a factor of ten or more a round.
const MAX_ROUNDS: usize = 60;

/// Weights rest when no estimated standard deviation and no parameter moves by more than this part.
const AT_REST: f64 = 1e-10;

/// An observable's variance needs at least this many degrees of freedom of its own.
const MIN_OWN_DOF: f64 = 0.5;

/// A residual standard deviation below this part of its first value is an exact fit.
const EXACT: f64 = 1e-9;

/// Fits some shots of a data set (all, or those of one label).
pub(super) fn fit_shots(
    dataset: &Dataset,
    shots: &[&Shot],
    group: Option<(String, String)>,
    options: &Options,
) -> Result<Fit, FitError> {
    let begun = Instant::now();
    let model = Model::new(options.fidelity, dataset.ball);
    let settings = &dataset.settings;
    let initial = Coefficients {
        mu: settings[Parameter::Mu].initial,
        mu_s: settings[Parameter::MuS].initial,
        e: settings[Parameter::E].initial,
    };
    let (fitted, shots_rejected) = plan(shots, &model, &initial);
    if fitted.is_empty() {
        return Err(FitError::NoUsableShot { dataset: title(dataset, group.as_ref()), shots_rejected });
    }
    check_noise(dataset, &fitted)?;

    let mut search = Search { fitted: &fitted, model: &model, settings, initial };
    let silent = search.silent(&initial);
    let mut free: Vec<Parameter> =
        Parameter::ALL.into_iter().filter(|p| !settings[*p].fixed && !silent.contains(p)).collect();
    let observations: usize = fitted.iter().map(|shot| shot.plan.rows().len()).sum();
    let priors = |free: &[Parameter]| free.iter().filter(|p| settings[**p].prior.is_some()).count();
    if observations + priors(&free) < free.len() {
        return Err(FitError::TooFewObservations {
            dataset: title(dataset, group.as_ref()),
            observations,
            parameters: free.iter().map(|p| p.name()).collect::<Vec<_>>().join(", "),
        });
    }
    let mut combination = None;
    let mut plateaus: Vec<Plateau> = Vec::new();
    let (minimum, estimated) = loop {
        let (minimum, estimated) = search.converge(&free)?;
        let Some(null) = uncertainty::null_direction(&minimum.jacobian) else {
            break (minimum, estimated);
        };
        // what the data cannot tell is left where it started, or at the edge from which on they no
        // longer tell it, and the rest fitted again
        let lost: Vec<Parameter> = null.iter().map(|(column, _)| free[*column]).collect();
        if let [parameter] = lost[..] {
            let plateau = search.plateau(parameter, &minimum.coefficients);
            *parameter_mut(&mut search.initial, parameter) = plateau.edge;
            plateaus.push(plateau);
        } else {
            let named: Vec<_> = null.iter().map(|(column, weight)| (free[*column], *weight)).collect();
            combination = Some(named);
        }
        free.retain(|p| !lost.contains(p));
    };
    let dof = observations + priors(&free) - free.len();
    let knows_noise = estimated.iter().all(|group| group.estimable);
    let estimates_noise = !estimated.is_empty();
    let uncertainty = uncertainty::of(&minimum, &free, settings, knows_noise, estimates_noise.then_some(dof));

    let reach = uncertainty::one_sided(knows_noise, estimates_noise.then_some(dof));
    let estimates = Parameter::ALL.map(|parameter| {
        let setting = &settings[parameter];
        let own = free.iter().position(|p| *p == parameter);
        let plateau = plateaus.iter().find(|plateau| plateau.parameter == parameter);
        match (own, plateau) {
            (Some(column), _) => uncertainty.estimates[column],
            (None, Some(plateau)) => Estimate {
                parameter,
                value: plateau.edge,
                std_error: None,
                interval_95: reach
                    .map(|t| search.plateau_interval(plateau, &minimum.coefficients, &estimated, t)),
                std_error_at_bound: None,
                status: Status::Free,
            },
            (None, None) => Estimate {
                parameter,
                value: setting.initial,
                std_error: None,
                interval_95: None,
                std_error_at_bound: None,
                status: if setting.fixed { Status::Fixed } else { Status::NotIdentified },
            },
        }
    });
    let mut correlation = DMatrix::from_element(3, 3, f64::NAN);
    for (i, a) in free.iter().enumerate() {
        for (j, b) in free.iter().enumerate() {
            correlation[(*a as usize, *b as usize)] = uncertainty.correlation[(i, j)];
        }
    }
    let residuals = residual_rows(shots, &fitted, &model, &minimum.coefficients, &estimated);
    let noise = noise_rows(&fitted, &residuals, &estimated);
    let mut fit = Fit {
        dataset: dataset.name.clone(),
        group,
        path: dataset.path.clone(),
        cloth: dataset.cloth.clone(),
        source: dataset.source.clone(),
        fidelity: options.fidelity.name(),
        effects: effects(options.fidelity),
        estimates,
        correlation,
        chi2: 2.0 * minimum.cost,
        dof,
        noise,
        shots_used: fitted.len(),
        shots_rejected,
        residuals,
        termination: minimum.termination.clone(),
        converged: minimum.converged,
        iterations: minimum.iterations,
        seconds: 0.0,
        warnings: Vec::new(),
        notes: Vec::new(),
    };
    super::remarks::add(&mut fit, &fitted, knows_noise, combination.as_deref());
    super::remarks::add_plateaus(&mut fit, &plateaus);
    fit.seconds = begun.elapsed().as_secs_f64();
    Ok(fit)
}

/// How an error names what is fitted.
fn title(dataset: &Dataset, group: Option<&(String, String)>) -> String {
    match group {
        Some((column, label)) => format!("{} ({column} {label})", dataset.name),
        None => dataset.name.clone(),
    }
}

/// The shots that can be predicted at the initial values, and the others with the reason.
fn plan(shots: &[&Shot], model: &Model, initial: &Coefficients) -> (Vec<Fitted>, Vec<Rejected>) {
    let (mut fitted, mut rejected) = (Vec::new(), Vec::new());
    for (index, shot) in shots.iter().enumerate() {
        let planned = crate::predict::Plan::new(shot)
            .and_then(|plan| plan.predict(model, initial).map(|_| Fitted { index, plan }));
        match planned {
            Ok(shot) => fitted.push(shot),
            Err(error) => rejected.push(Rejected { shot: shot.name.clone(), reason: error.to_string() }),
        }
    }
    (fitted, rejected)
}

/// Each observable has standard deviations everywhere or nowhere.
fn check_noise(dataset: &Dataset, fitted: &[Fitted]) -> Result<(), FitError> {
    let mut seen: Vec<(Observable, bool)> = Vec::new();
    for row in fitted.iter().flat_map(|shot| shot.plan.rows()) {
        let has = row.measured.sd.is_some();
        match seen.iter().find(|(observable, _)| *observable == row.observable) {
            Some((_, other)) if *other != has => {
                let column = row.observable.column();
                return Err(FitError::MixedNoise { dataset: dataset.name.clone(), column });
            }
            Some(_) => {}
            None => seen.push((row.observable, has)),
        }
    }
    Ok(())
}

/// The noise of an observable without stated standard deviations.
#[derive(Clone, Copy, Debug)]
struct Group {
    observable: Observable,
    sd: f64,
    /// Whether the residuals tell it.
    estimable: bool,
}

/// A parameter on which nothing depends any more from some value on, as μ once every shot sticks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plateau {
    pub parameter: Parameter,
    /// Where the plateau begins.
    pub edge: f64,
    /// Its other end, a bound.
    pub bound: f64,
}

struct Search<'a> {
    fitted: &'a [Fitted],
    model: &'a Model,
    settings: &'a Settings,
    initial: Coefficients,
}

impl Search<'_> {
    /// Parameters that no observation depends on at these values, and that have no prior.
    fn silent(&self, at: &Coefficients) -> Vec<Parameter> {
        let mut informed = [false; 3];
        for shot in self.fitted {
            if let Ok(prediction) = shot.plan.predict(self.model, at) {
                let by = prediction.by_coefficients.rows(0, shot.plan.rows().len());
                for (parameter, informed) in informed.iter_mut().enumerate() {
                    *informed |= by.column(parameter).iter().any(|d| *d != 0.0);
                }
            }
        }
        let silent = |p: &Parameter| !informed[*p as usize] && self.settings[*p].prior.is_none();
        Parameter::ALL.into_iter().filter(silent).collect()
    }

    /// Residuals of each observable without stated errors: root mean square at `at`.
    fn first_noise(&self, at: &Coefficients) -> Vec<Group> {
        let mut groups: Vec<(Observable, f64, usize)> = Vec::new();
        self.each_residual(at, |row, d, _| {
            if row.measured.sd.is_some() {
                return;
            }
            let known = groups.iter().position(|g| g.0 == row.observable);
            let index = known.unwrap_or_else(|| {
                groups.push((row.observable, 0.0, 0));
                groups.len() - 1
            });
            groups[index].1 += d * d;
            groups[index].2 += 1;
        });
        let sd = |sum: f64, count: usize| if sum > 0.0 { (sum / count as f64).sqrt() } else { 1.0 };
        let group = |(observable, sum, count)| Group { observable, sd: sd(sum, count), estimable: true };
        groups.into_iter().map(group).collect()
    }

    /// Calls `f(row, difference, variance from the inputs)` for every observation.
    fn each_residual(&self, at: &Coefficients, mut f: impl FnMut(&crate::dataset::Measurement, f64, f64)) {
        for shot in self.fitted {
            if let Ok(prediction) = shot.plan.predict(self.model, at) {
                for (i, row) in shot.plan.rows().iter().enumerate() {
                    let d = difference(row.observable, prediction.values[i], row.measured.value);
                    let g = prediction.by_inputs.row(i).transpose();
                    f(row, d, g.component_mul(&g).dot(shot.plan.variance_in()));
                }
            }
        }
    }

    /// All predictions, one after the other.
    fn predictions(&self, at: &Coefficients) -> Vec<f64> {
        let predicted = |shot: &Fitted| {
            let prediction = shot.plan.predict(self.model, at).ok()?;
            Some(prediction.values.rows(0, shot.plan.rows().len()).iter().copied().collect::<Vec<_>>())
        };
        self.fitted.iter().filter_map(predicted).flatten().collect()
    }

    /// From the value where the fit ended, on the plateau, back to its edge towards the start.
    fn plateau(&self, parameter: Parameter, end: &Coefficients) -> Plateau {
        /// Predictions on the plateau agree to rounding.
        const SAME: f64 = 1e-12;
        let setting = &self.settings[parameter];
        let there = self.predictions(end);
        let is_flat = |value: f64| {
            let here = self.predictions(&with(end, parameter, value));
            here.len() == there.len()
                && here.iter().zip(&there).all(|(a, b)| (a - b).abs() <= SAME * a.abs().max(b.abs()))
        };
        let mut on = *parameter_mut(&mut end.clone(), parameter);
        let mut off = setting.initial;
        let bound = if on < off { setting.lower } else { setting.upper };
        if is_flat(off) {
            return Plateau { parameter, edge: off, bound };
        }
        while (on - off).abs() > 1e-12 {
            let middle = 0.5 * (on + off);
            if middle == on || middle == off {
                break;
            }
            if is_flat(middle) { on = middle } else { off = middle }
        }
        Plateau { parameter, edge: on, bound }
    }

    /// From where χ² is t² above the plateau's to the plateau's far end, the other parameters held.
    fn plateau_interval(&self, plateau: &Plateau, at: &Coefficients, groups: &[Group], t: f64) -> [f64; 2] {
        let Plateau { parameter, edge, bound } = *plateau;
        let chi2 = |value: f64| {
            let mut sum = 0.0;
            self.each_residual(&with(at, parameter, value), |row, d, from_inputs| {
                let group = groups.iter().find(|g| g.observable == row.observable);
                let sd = row.measured.sd.or(group.map(|g| g.sd)).unwrap_or(f64::NAN);
                sum += d * d / (sd * sd + from_inputs);
            });
            sum
        };
        let top = chi2(edge) + t * t;
        let setting = &self.settings[parameter];
        let (mut inside, mut outside) = (edge, if bound > edge { setting.lower } else { setting.upper });
        if chi2(outside) > top {
            for _ in 0..60 {
                let middle = 0.5 * (inside + outside);
                if chi2(middle) > top { outside = middle } else { inside = middle }
            }
        } else {
            inside = outside;
        }
        [inside.min(bound), inside.max(bound)]
    }

    /// Fits the free parameters, the others at their initial values, until the weights rest.
    fn converge(&mut self, free: &[Parameter]) -> Result<(Minimum, Vec<Group>), FitError> {
        let bounds = |pick: fn(&crate::parameters::Setting) -> f64| {
            DVector::from_iterator(free.len(), free.iter().map(|p| pick(&self.settings[*p])))
        };
        let constraints = Constraints::bounds(bounds(|s| s.lower), bounds(|s| s.upper));
        let mut x = bounds(|s| s.initial);
        let mut coefficients = self.initial;
        let mut groups = self.first_noise(&coefficients);
        let weights_move =
            !groups.is_empty() || self.fitted.iter().any(|s| s.plan.variance_in().amax() > 0.0);
        let mut iterations = 0;
        for round in 0.. {
            let sds: EstimatedSd = groups.iter().map(|g| (g.observable, g.sd)).collect();
            let whitening =
                Whitening::new(self.fitted, self.model, &coefficients, &sds).ok_or(FitError::NoWeights)?;
            let problem =
                Problem::new(self.fitted, self.model, self.settings, free, self.initial, &whitening);
            if free.is_empty() {
                let (residuals, jacobian) = problem.evaluate_at(&x);
                self.reweigh(&mut groups, &coefficients, &jacobian);
                let minimum = Minimum {
                    coefficients,
                    cost: 0.5 * residuals.norm_squared(),
                    gradient: x.clone(),
                    x,
                    jacobian,
                    active: Vec::new(),
                    termination: "nothing to fit: every parameter is fixed or silent".to_string(),
                    converged: true,
                    iterations: 0,
                };
                return Ok((minimum, groups));
            }
            let solution = optimise::minimise(problem, &x, &constraints, &optimise::Options::default())?;
            iterations += solution.iterations as usize;
            let moved = (&solution.x - &x).amax();
            x = solution.x.clone();
            coefficients = residuals::coefficients(&self.initial, free, &x);
            let changed = self.reweigh(&mut groups, &coefficients, &solution.jacobian);
            let rest = !weights_move || (moved.max(changed) < AT_REST);
            if rest || round + 1 == MAX_ROUNDS {
                let converged = solution.termination.converged() && rest;
                let mut termination = solution.termination.to_string();
                if !rest {
                    termination =
                        format!("the weights did not come to rest in {MAX_ROUNDS} rounds; {termination}");
                }
                let minimum = Minimum {
                    coefficients,
                    x: solution.x,
                    cost: solution.cost,
                    gradient: solution.jacobian.tr_mul(&solution.residuals),
                    jacobian: solution.jacobian,
                    active: solution.active,
                    termination,
                    converged,
                    iterations,
                };
                return Ok((minimum, groups));
            }
        }
        Err(FitError::NoWeights)
    }

    /// σ² = Σd²/(n − Σh) with the leverages h of the observable's rows (restricted maximum
    /// likelihood), less what the errors of the state before the impact explain. Returns the
    /// largest relative change.
    fn reweigh(&self, groups: &mut [Group], at: &Coefficients, jacobian: &DMatrix<f64>) -> f64 {
        if groups.is_empty() {
            return 0.0;
        }
        let leverage = uncertainty::leverages(jacobian);
        let mut sums = vec![[0.0; 4]; groups.len()];
        let mut row_number = 0;
        self.each_residual(at, |row, d, from_inputs| {
            if let Some(group) =
                groups.iter().position(|g| g.observable == row.observable && row.measured.sd.is_none())
            {
                for (sum, term) in sums[group].iter_mut().zip([d * d, 1.0, leverage[row_number], from_inputs])
                {
                    *sum += term;
                }
            }
            row_number += 1;
        });
        let mut changed = 0.0_f64;
        for (group, [square, count, leverage, from_inputs]) in groups.iter_mut().zip(sums) {
            let own_dof = count - leverage;
            group.estimable = own_dof >= MIN_OWN_DOF;
            if !group.estimable {
                continue;
            }
            let variance = square / own_dof - from_inputs / count;
            let sd = variance.max((EXACT * group.sd).powi(2)).sqrt();
            changed = changed.max((sd / group.sd - 1.0).abs());
            group.sd = sd;
        }
        changed
    }
}

/// The coefficients with one of them changed.
fn with(coefficients: &Coefficients, parameter: Parameter, value: f64) -> Coefficients {
    let mut changed = *coefficients;
    *parameter_mut(&mut changed, parameter) = value;
    changed
}

fn residual_rows(
    shots: &[&Shot],
    fitted: &[Fitted],
    model: &Model,
    at: &Coefficients,
    groups: &[Group],
) -> Vec<Residual> {
    let sds: EstimatedSd =
        groups.iter().map(|g| (g.observable, if g.estimable { g.sd } else { f64::NAN })).collect();
    let mut rows = Vec::new();
    for Fitted { index, plan } in fitted {
        let Ok(prediction) = plan.predict(model, at) else { continue };
        let covariance = covariance(plan, &prediction, &sds);
        for (i, row) in plan.rows().iter().enumerate() {
            let sd = covariance[(i, i)].sqrt();
            let d = difference(row.observable, prediction.values[i], row.measured.value);
            rows.push(Residual {
                shot: shots[*index].name.clone(),
                observable: row.observable,
                measured: row.measured.value,
                predicted: row.measured.value + d,
                sd,
                standardized: -d / sd,
                cut: plan.cut(),
                speed: plan.knows_speed().then_some(prediction.speed),
            });
        }
    }
    rows
}

fn noise_rows(fitted: &[Fitted], residuals: &[Residual], groups: &[Group]) -> Vec<Noise> {
    let mut rows: Vec<Noise> = Vec::new();
    for measurement in fitted.iter().flat_map(|shot| shot.plan.rows()) {
        let observable = measurement.observable;
        if rows.iter().any(|row| row.observable == observable) {
            continue;
        }
        let own = residuals.iter().filter(|r| r.observable == observable);
        let (sum, count) =
            own.fold((0.0, 0), |(sum, count), r| (sum + (r.measured - r.predicted).powi(2), count + 1));
        let group = groups.iter().find(|g| g.observable == observable);
        rows.push(Noise {
            observable,
            count,
            rms: (sum / count as f64).sqrt(),
            estimated_sd: group.map(|g| if g.estimable { g.sd } else { f64::NAN }),
        });
    }
    rows
}

/// What each fidelity contains.
fn effects(fidelity: Fidelity) -> Vec<(&'static str, bool)> {
    let (inelastic, friction, full) = (
        fidelity != Fidelity::Elastic,
        matches!(fidelity, Fidelity::Linear | Fidelity::Full),
        fidelity == Fidelity::Full,
    );
    vec![
        ("inelasticity", inelastic),
        ("friction", friction),
        ("stick", full),
        ("turning", full),
        ("cloth", friction),
    ]
}
