//! The parts that every fit has: estimates with their correlations, what they rest on, and how
//! they move without a shot.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::bootstrap::{self, Bootstrap};
use super::deviations::{observables, residuals, trends, whiten};
use super::goodness::normality_of;
use super::regions::contours;
use super::request::{Request, rejected};
use super::{
    Computed, Counted, Depth, Diagnostics, Estimate, Fit, FitError, FoundCamera, Goodness, Identifiability,
    Influence, Noise, NoiseVerdict, Options, Rejected, Residual, Robust, Status, Trend, Weight,
};
use crate::measurement::loss::Loss;
use crate::measurement::observable::Observable;
use crate::measurement::parameter::{Compliance, Parameter, Settings};
use crate::physics::collision::Fidelity;
use crate::problem::{
    Choices, Deviations, Finding, FitEnd, Id, MANY_SHOTS, POLICY, RowsError, ShiftScore, ShotInfluence,
    Slope, Solution, TableNoise, worst_direction,
};

/// Shots that are listed by their influence whether they are influential or not, and at most.
const LISTED: [usize; 2] = [5, 20];

/// Part by which standard deviations may be too large, however many shots show it.
const HARMLESS: f64 = 0.05;

/// The end of a fit, and what follows from the kind of its data.
pub(super) struct Fitted<'a> {
    request: Request<'a>,
    end: &'a FitEnd,
    deviations: Vec<Option<Deviations>>,
    estimates: Vec<Estimate>,
    trends: Vec<Trend>,
}

/// Returns the choices of a fit of balls.
///
/// # Errors
/// A contact that is stated to be compliant, at a fidelity that takes it as rigid.
pub(super) fn choices(request: &Request) -> Result<Choices, FitError> {
    let &Options { fidelity, tolerance, loss, depth, .. } = request.options;
    let is_compliant = request.dataset.settings.compliance == Compliance::Stated;
    match fidelity.filter(|fidelity| is_compliant && !fidelity.effects().compliance) {
        Some(rigid) => Err(request.of_rows(RowsError::Rigid(rigid.name()))),
        None => {
            let without_profiles = depth < Depth::Intervals;
            Ok(Choices { fidelity, tolerance: Some(tolerance), loss, without_profiles })
        }
    }
}

impl<'a> Fitted<'a> {
    /// Returns the fit without its remarks.
    pub fn fit(self) -> Fit {
        let Request { dataset, group, options, .. } = self.request;
        let goodness = self.goodness();
        let (rejected, robust, bootstrap) = (self.rejected(), self.robust(), self.bootstrap());
        let solution = Arc::clone(&self.end.solution);
        let id = |estimate: &Estimate| Id::from(estimate.parameter);
        let is_open = |e: &Estimate| {
            matches!(e.status, Status::Free | Status::NotIdentified) && solution.is_informed(id(e))
        };
        // also those at bounds, at which their regions end
        let has_region = |e: &Estimate| e.std_error.is_some() || e.is_at_bound();
        let has_regions = self.end.knows_noise()
            && !solution.problem.is_robust()
            && !solution.is_refuted()
            && solution.names().len() <= MANY_SHOTS;
        // combinations may be undetermined, and regions are drawn, of these parameters
        let (combined, drawn) = if solution.is_film() {
            (self.contact(), self.contact())
        } else {
            (self.of_contact(is_open), self.of_contact(|e| has_regions && has_region(e)))
        };
        let Self { end, estimates, .. } = self;
        let covariance = end.as_free.between(&estimates.iter().map(id).collect::<Vec<_>>());
        let ids: Vec<Id> = combined.iter().map(|parameter| Id::from(*parameter)).collect();
        let mut others = solution.problem.inside(solution.state());
        others.retain(|column| ids.iter().all(|id| *id as usize != *column));
        let worst = worst_direction(&solution.at, &ids, others);
        let is_silent = |e: &&Estimate| e.status == Status::NotIdentified && !solution.is_informed(id(e));
        let silent = estimates.iter().filter(is_silent).map(|e| e.parameter).collect();
        let has_error = |of: &Id| estimates.iter().any(|e| id(e) == *of && e.std_error.is_some());
        let budget = Id::WANTED.into_iter().filter(has_error).filter_map(|id| solution.budget(id)).collect();
        let drawn = estimates.iter().filter(|estimate| drawn.contains(&estimate.parameter));
        let drawn: Vec<&Estimate> = drawn.filter(|_| options.depth >= Depth::Everything).collect();
        let residuals = residuals(solution.names(), &self.deviations);
        let is_of_discs = solution.problem.discs().is_some();
        Fit {
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
            correlation: correlation(&estimates, &covariance),
            chi2: if is_of_discs { goodness.chi2 } else { solution.chi2_of_data().0 + solution.prior_chi2() },
            dof: if is_of_discs { goodness.dof } else { solution.dof() },
            noise: noise_of(observables(&self.deviations), &residuals, &end.noises),
            shots_rejected: rejected,
            disc_shots: Vec::new(),
            scatter: None,
            camera: solution.is_film().then(|| FoundCamera::of_film(&solution, dataset)),
            residuals,
            frames: None,
            seconds: 0.0,
            diagnostics: Diagnostics {
                computed: Computed::of(&solution, options.fidelity),
                identifiability: Identifiability::new(combined, worst, silent),
                goodness: Some(goodness),
                robust,
                bootstrap,
                contours: contours(&solution, &end.as_free, &drawn, end.dof),
                has_rival: estimates.iter().any(|estimate| estimate.includes_other_minimum),
                suspicious: Vec::new(),
            },
            budget,
            remarks: Vec::new(),
            estimates,
            solution,
        }
    }

    /// Returns whether model and noise describe the residuals.
    fn goodness(&self) -> Goodness {
        let (solution, wanted) = (&self.end.solution, self.contact().len());
        let standardized: Vec<f64> = self.deviations.iter().flatten().flat_map(whiten).collect();
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
        let noise = match p_value {
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
                Counted::of(observables(&self.deviations).iter())
            },
            chi2,
            dof: dof as usize,
            p_value,
            noise,
            noise_factor,
            trends: self.trends.clone(),
            normality: normality_of(&standardized),
            influence: self.influence(influential_from),
            influential_from,
        }
    }

    /// Returns the end of a fit; `chance` gives the probability of a trend from its slope and the
    /// scores of the shots.
    pub fn new(
        request: Request<'a>,
        settings: &Settings,
        end: &'a FitEnd,
        deviations: Vec<Option<Deviations>>,
        chance: impl Fn(&Slope, &[Option<ShiftScore>]) -> Option<f64>,
    ) -> Self {
        let estimates = end.estimates(&parameters(&end.solution, settings), settings);
        let trends = trends(&end.solution, &deviations, chance);
        Self { request, end, deviations, estimates, trends }
    }

    fn rejected(&self) -> Vec<Rejected> {
        let stated = &self.request.dataset.left_out;
        let what = if self.request.dataset.tracks.is_some() { "its frames do" } else { "it does" };
        let lost = self.end.solution.record.findings.iter().filter_map(|finding| match finding {
            Finding::LostShots { names } => Some(names),
            _ => None,
        });
        let reason = format!("{what} not fit the collision that the other shots fit");
        let lost = lost.flatten().map(|name| (name.clone(), reason.clone()));
        let unstated = self.end.solution.record.left_out.iter().filter(|one| !stated.contains(one));
        rejected(stated.iter().chain(unstated).cloned().chain(lost))
    }

    /// Returns the parameters of the contact whose estimates meet a condition.
    fn of_contact(&self, meets: impl Fn(&Estimate) -> bool) -> Vec<Parameter> {
        let some = self.estimates.iter().filter(|e| !e.parameter.is_of_balls() && meets(e));
        some.map(|e| e.parameter).collect()
    }

    /// Returns the free parameters of the contact that have a standard error.
    pub fn contact(&self) -> Vec<Parameter> {
        let found = |e: &Estimate| self.end.solution.get(Id::from(e.parameter));
        self.of_contact(|e| found(e).is_some_and(|own| own.std_error.is_some()))
    }

    /// Returns how the estimates scatter if shots are drawn again, if that is asked for.
    fn bootstrap(&self) -> Option<Bootstrap> {
        let free = self.contact();
        let Request { options: Options { bootstrap: replicates, seed, .. }, done, .. } = self.request;
        let is_asked = *replicates > 0 && !free.is_empty();
        is_asked.then(|| bootstrap::draw(&self.end.solution, &free, (*replicates, *seed), done))
    }

    /// Returns how a robust loss weighted the shots; `None` by least squares.
    fn robust(&self) -> Option<Robust> {
        let weights = self.end.solution.weights();
        let weights = self.end.solution.names().iter().cloned().zip(weights);
        let weights = weights.map(|(shot, weight)| Weight { shot, weight });
        let mut weights: Vec<Weight> = weights.filter(|shot| shot.weight < 1.0).collect();
        weights.sort_by(|a, b| a.weight.total_cmp(&b.weight));
        let loss = self.request.options.loss.unwrap_or(self.request.dataset.loss);
        let (tuning_constant, covariance) = (loss.tuning(), "sandwich");
        (loss != Loss::Squares).then_some(Robust { loss, tuning_constant, covariance, weights })
    }

    /// Returns the shots that move the estimates most.
    fn influence(&self, influential_from: Option<f64>) -> Vec<Influence> {
        let solution = &self.end.solution;
        let wanted: Vec<Id> = self.contact().into_iter().map(Id::from).collect();
        let covariance = solution.covariance.between(&wanted);
        let Some(information) = covariance.cholesky().map(|factor| factor.inverse()) else {
            return Vec::new();
        };
        let measure = |(name, found): (&String, Option<ShotInfluence>)| {
            let shot = name.clone();
            let Some(found) = found else {
                return Influence { shot, leverage: 1.0, cook: f64::INFINITY, shifts: Vec::new() };
            };
            let changes = wanted.iter().map(|id| found.change(*id));
            let changes = DVector::from_iterator(wanted.len(), changes);
            let cook = changes.dot(&(&information * &changes)) / wanted.len() as f64;
            let shift = |estimate: &Estimate| {
                let id = Id::from(estimate.parameter);
                Some((estimate.parameter, found.change(id) / solution.get(id)?.std_error?))
            };
            let shifts = self.estimates.iter().filter_map(shift).collect();
            Influence { shot, leverage: found.leverage, cook, shifts }
        };
        let mut all: Vec<Influence> =
            solution.names().iter().zip(solution.influence()).map(measure).collect();
        all.sort_by(|a, b| b.cook.total_cmp(&a.cook));
        let influential = all.iter().filter(|shot| influential_from.is_some_and(|from| shot.cook > from));
        let count = influential.count().clamp(LISTED[0], LISTED[1]);
        all.truncate(count);
        all
    }
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

/// Returns a row for each of some observables, with the noises that were estimated.
fn noise_of(observables: Vec<Observable>, residuals: &[Residual], estimated: &[TableNoise]) -> Vec<Noise> {
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
    observables.into_iter().map(noise).collect()
}

/// Returns the correlations of estimates from their covariance, NaN for those without an error.
fn correlation(estimates: &[Estimate], covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let has = |i: usize| estimates[i].std_error.is_some();
    DMatrix::from_fn(estimates.len(), estimates.len(), |i, j| {
        let scale = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
        if has(i) && has(j) { covariance[(i, j)] / scale } else { f64::NAN }
    })
}
