//! The parts that every fit has: estimates with their covariance, what they rest on, and how they
//! move without a shot.

use std::sync::Arc;

use minijinja::Value as Values;
use minijinja::value::Serde;
use nalgebra::DVector;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::bootstrap;
use super::deviations::{observables, residuals, trends, whiten};
use super::film_words::words_of;
use super::goodness::normality_of;
use super::regions::contours;
use super::request::Request;
use super::{
    Computed, Contour, Counted, Depth, Diagnostics, Estimate, Fit, FoundCamera, Goodness, Identifiability,
    Influence, Noise, NoiseVerdict, Rejected, Residual, Robust, Status, Trend, Weight,
};
use crate::measurement::loss::Loss;
use crate::measurement::observable::Observable;
use crate::measurement::parameter::{Parameter, Settings};
use crate::name::ByName;
use crate::physics::collision::Fidelity;
use crate::problem::{
    Deviations, Finding, FitEnd, Id, MANY_SHOTS, POLICY, ShiftScore, ShotInfluence, Slope, Solution,
    TableNoise, worst_direction,
};

/// Shots that are listed by their influence whether they are influential or not, and at most.
const LISTED: [usize; 2] = [5, 20];

/// Part by which standard deviations may be too large, however many shots show it.
const HARMLESS: f64 = 0.05;

fn id(estimate: &Estimate) -> Id {
    Id::from(estimate.parameter)
}

impl Fit {
    /// Returns the fit of a part of a data set without its remarks; `chance` gives the probability
    /// of a trend from its slope and the scores of the shots.
    pub(super) fn new(
        request: Request,
        end: &FitEnd,
        shots: &[Option<Deviations>],
        chance: impl Fn(&Slope, &[Option<ShiftScore>]) -> Option<f64>,
    ) -> Self {
        let Request { dataset, group, options, done } = request;
        let (solution, settings) = (Arc::clone(&end.solution), dataset.settings_of_balls());
        let estimates = end.estimates(&parameters(&solution, &settings), &settings);
        let residuals = residuals(solution.names(), shots);
        let ids: Vec<Id> = estimates.iter().map(id).collect();
        let has_error = |of: &Id| estimates.iter().any(|e| id(e) == *of && e.std_error.is_some());
        let budget = Id::WANTED.into_iter().filter(has_error).filter_map(|id| solution.budget(id)).collect();
        let mut fit = Self {
            dataset: dataset.name.clone(),
            group: group.cloned(),
            cloth: dataset.cloth.clone(),
            source: dataset.source.clone(),
            ball: dataset.ball,
            object: dataset.object,
            discs: dataset.tracks.as_ref().and_then(|tracks| tracks.discs),
            sliding: solution.measured(Id::MuK).or(dataset.sliding),
            rolling: solution.measured(Id::MuR).or(dataset.rolling),
            fidelity: options.fidelity.map_or("auto", Fidelity::name),
            footage: dataset.tracks.is_some(),
            covariance: end.as_free.between(&ids),
            noise: noise_of(shots, &residuals, &end.noises),
            shots_rejected: rejected(&request, &solution),
            disc_shots: Vec::new(),
            scatter: None,
            camera: solution.is_film().then(|| FoundCamera::of_film(&solution, dataset)),
            residuals,
            frames: None,
            seconds: 0.0,
            diagnostics: Diagnostics::default(),
            budget,
            remarks: Vec::new(),
            estimates,
            solution,
        };
        let contact = fit.contact();
        let goodness = fit.goodness(shots, trends(&fit.solution, shots, chance));
        let loss = options.loss.unwrap_or(dataset.loss);
        let draws = (options.bootstrap, options.seed);
        let has_draws = options.bootstrap > 0 && !contact.is_empty();
        let bootstrap = has_draws.then(|| bootstrap::draw(&fit.solution, &contact, draws, done));
        fit.diagnostics = Diagnostics {
            computed: Computed::of(&fit.solution, options.fidelity),
            identifiability: fit.identifiability(),
            goodness,
            robust: fit.solution.problem.is_robust().then(|| fit.robust(loss)),
            bootstrap,
            contours: if options.depth >= Depth::Everything { fit.regions(end) } else { Vec::new() },
        };
        fit
    }

    /// Returns the free parameters of the contact that have a standard error.
    fn contact(&self) -> Vec<Parameter> {
        let has_error = |e: &&Estimate| self.solution.measured(id(e)).is_some();
        self.of_contact().filter(has_error).map(|e| e.parameter).collect()
    }

    /// Returns whether model and noise describe the residuals.
    fn goodness(&self, shots: &[Option<Deviations>], trends: Vec<Trend>) -> Goodness {
        let (solution, wanted) = (&self.solution, self.contact().len());
        let standardized: Vec<f64> = shots.iter().flatten().flat_map(whiten).collect();
        let is_of_discs = solution.problem.discs().is_some();
        let (chi2, dof) = if is_of_discs {
            let chi2 = standardized.iter().map(|x| x * x).sum();
            (chi2, standardized.len().saturating_sub(wanted) as f64)
        } else if solution.is_film() {
            let (chi2, observations) = solution.chi2_of_data();
            let unknowns = solution.own_count() as f64 + solution.covariance.count_data(&solution.problem);
            (chi2, (observations - unknowns).max(0.0))
        } else {
            (solution.at.cost, solution.dof() as f64)
        };
        let is_stated = solution.states_noise() && solution.weights().is_empty() && !is_of_discs;
        let chance = ChiSquared::new(dof).ok().map(|distribution| distribution.sf(chi2));
        let p_value = chance.filter(|_| is_stated);
        let noise_factor = p_value.map(|_| (chi2 / dof).sqrt());
        let improbable = POLICY.improbable;
        let stated_noise = match p_value {
            None => NoiseVerdict::NotTested,
            Some(p) if p < improbable => NoiseVerdict::TooSmall,
            Some(p) if p > 1.0 - improbable && noise_factor < Some(1.0 - HARMLESS) => NoiseVerdict::TooLarge,
            Some(_) => NoiseVerdict::Explains,
        };
        // the median of F(p, n − p)
        let wanted = wanted as f64;
        let distribution = FisherSnedecor::new(wanted, standardized.len() as f64 - wanted).ok();
        let influential_from = distribution.map(|f| f.inverse_cdf(0.5)).filter(|x| x.is_finite());
        Goodness {
            counted: if solution.problem.film().is_some() {
                Counted::Coordinates
            } else {
                Counted::of(observables(shots).iter())
            },
            chi2,
            dof: dof as usize,
            p_value,
            stated_noise,
            noise_factor,
            trends,
            normality: normality_of(&standardized),
            influence: self.influence(influential_from),
            influential_from,
        }
    }

    /// Returns the combinations of parameters of the contact that the data determine.
    fn identifiability(&self) -> Option<Identifiability> {
        let solution = &self.solution;
        let is_informed = |e: &Estimate| solution.is_informed(id(e));
        let is_open =
            |e: &&Estimate| matches!(e.status, Status::Free | Status::NotIdentified) && is_informed(e);
        let parameters = if solution.is_film() {
            self.contact()
        } else {
            self.of_contact().filter(is_open).map(|e| e.parameter).collect()
        };
        let ids: Vec<Id> = parameters.iter().map(|parameter| Id::from(*parameter)).collect();
        let mut others = solution.problem.inside(solution.state());
        others.retain(|column| ids.iter().all(|id| *id as usize != *column));
        let mut worst = worst_direction(&solution.at, &ids, others);
        if let Some(worst) = &mut worst {
            worst.words = words_of("worst", Values::from(Serde(&*worst)));
        }
        let singular_values = match &worst {
            Some(worst) => worst.singular_values.clone(),
            None if parameters.len() == 1 => vec![1.0],
            None => return None,
        };
        let is_silent = |e: &&Estimate| e.status == Status::NotIdentified && !is_informed(e);
        let silent = self.estimates.iter().filter(is_silent).map(|e| e.parameter).collect();
        let condition_number = singular_values.first()? / singular_values.last()?;
        Some(Identifiability { parameters, singular_values, condition_number, worst, silent })
    }

    /// Returns the confidence regions of all pairs of parameters of the contact, also of those at
    /// bounds, at which their regions end.
    fn regions(&self, end: &FitEnd) -> Vec<Contour> {
        let (solution, contact) = (&self.solution, self.contact());
        let has_regions = end.knows_noise()
            && !solution.problem.is_robust()
            && !solution.is_refuted()
            && solution.names().len() <= MANY_SHOTS;
        let is_drawn = |e: &&Estimate| {
            let has_region = has_regions && (e.std_error.is_some() || e.is_at_bound());
            if solution.is_film() { contact.contains(&e.parameter) } else { has_region }
        };
        let drawn: Vec<&Estimate> = self.of_contact().filter(is_drawn).collect();
        contours(solution, &end.as_free, &drawn, end.dof)
    }

    /// Returns how a robust loss weighted the shots.
    fn robust(&self, loss: Loss) -> Robust {
        let weights = self.solution.names().iter().cloned().zip(self.solution.weights());
        let weights = weights.map(|(shot, weight)| Weight { shot, weight });
        let mut weights: Vec<Weight> = weights.filter(|shot| shot.weight < 1.0).collect();
        weights.sort_by(|a, b| a.weight.total_cmp(&b.weight));
        Robust { loss, tuning_constant: loss.tuning(), covariance: "sandwich", weights_below_1: weights }
    }

    /// Returns the shots that move the estimates most.
    fn influence(&self, influential_from: Option<f64>) -> Vec<Influence> {
        let solution = &self.solution;
        let wanted: Vec<Id> = self.contact().into_iter().map(Id::from).collect();
        let covariance = solution.covariance.between(&wanted);
        let Some(information) = covariance.cholesky().map(|factor| factor.inverse()) else {
            return Vec::new();
        };
        let measure = |(name, found): (&String, Option<ShotInfluence>)| {
            let shot = name.clone();
            let Some(found) = found else {
                return Influence {
                    shot,
                    leverage: 1.0,
                    cook_distance: f64::INFINITY,
                    shifts: ByName::new(),
                };
            };
            let changes = wanted.iter().map(|id| found.change(*id));
            let changes = DVector::from_iterator(wanted.len(), changes);
            let cook_distance = changes.dot(&(&information * &changes)) / wanted.len() as f64;
            let shift = |estimate: &Estimate| {
                let error = solution.measured(id(estimate))?.sd?;
                Some((estimate.parameter.name().to_owned(), found.change(id(estimate)) / error))
            };
            let shifts = self.estimates.iter().filter_map(shift).collect();
            Influence { shot, leverage: found.leverage, cook_distance, shifts }
        };
        let mut all: Vec<Influence> =
            solution.names().iter().zip(solution.influence()).map(measure).collect();
        all.sort_by(|a, b| b.cook_distance.total_cmp(&a.cook_distance));
        let influential =
            all.iter().filter(|shot| influential_from.is_some_and(|from| shot.cook_distance > from));
        let count = influential.count().clamp(LISTED[0], LISTED[1]);
        all.truncate(count);
        all
    }
}

/// Returns the shots that were left out, with the reasons.
fn rejected(request: &Request, solution: &Solution) -> Vec<Rejected> {
    let lost = solution.record.findings.iter().filter_map(|finding| match finding {
        Finding::LostShots { names } => Some(names),
        _ => None,
    });
    let what = if request.dataset.tracks.is_some() { "its frames do" } else { "it does" };
    let reason = format!("{what} not fit the collision that the other shots fit");
    let lost = lost.flatten().map(|name| (name.clone(), reason.clone()));
    request.rejected(solution.record.left_out.iter().cloned().chain(lost))
}

/// Returns the parameters that a fit has, in their order.
fn parameters(solution: &Solution, settings: &Settings) -> Vec<Parameter> {
    let extra = |p: &Parameter| {
        // c has no meaning without b
        let decides = if *p == Parameter::C { Parameter::B } else { *p };
        solution.value(Id::from(decides)) != 0.0 && !p.is_of_balls()
    };
    let is_of_discs = solution.problem.discs().is_some();
    let is_absent = |p: &Parameter| is_of_discs && (*p == Parameter::MuS || p.is_of_balls());
    Parameter::ALL.into_iter().filter(|p| (settings.has(*p) || extra(p)) && !is_absent(p)).collect()
}

/// Returns the noise of each observable of some shots, with the noises that were estimated.
fn noise_of(shots: &[Option<Deviations>], residuals: &[Residual], estimated: &[TableNoise]) -> Vec<Noise> {
    let noise = |observable: Observable| {
        let alike = residuals.iter().filter(|other| other.observable == observable);
        let squares: Vec<f64> = alike.map(|own| (own.measured - own.predicted).powi(2)).collect();
        let found = estimated.iter().find(|noise| noise.pool.observables.contains(&observable));
        let is_rounding = |noise: &&TableNoise| noise.pool.rounding > 0.0 && noise.sd <= noise.pool.rounding;
        Noise {
            observable,
            count: squares.len(),
            rms: (squares.iter().sum::<f64>() / squares.len() as f64).sqrt(),
            estimated_sd: found.map(|noise| if noise.is_known { noise.sd } else { f64::NAN }),
            rounding: found.filter(is_rounding).map(|noise| noise.pool.rounding),
        }
    };
    observables(shots).into_iter().map(noise).collect()
}
