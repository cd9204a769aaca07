//! What every fit of one problem says: estimates with their correlations, what they rest on, and how
//! they move without a shot.

use std::sync::Arc;

use nalgebra::DMatrix;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::diagnostics::identifiability::{Identifiability, identify};
use super::intervals::bootstrap::{self, Bootstrap};
use super::{Diagnostics, Estimate, Fit, Influence, Options, Rejected, Robust, film_words};
use crate::measurement::dataset::Dataset;
use crate::measurement::loss::Loss;
use crate::measurement::parameter::{Parameter, Settings};
use crate::problem::{Finding, Id, ShotInfluence, Solution};

/// Shots that are listed by their influence whether they are influential or not, and at most.
const LISTED: [usize; 2] = [5, 20];

/// A fit of one sample.
#[derive(Clone, Copy)]
pub(super) struct Common<'a> {
    pub dataset: &'a Dataset,
    /// Column and label of the shots, if they were fitted apart.
    pub group: Option<&'a (String, String)>,
    pub options: &'a Options,
    pub settings: &'a Settings,
    pub solution: &'a Solution,
    /// Called after each sample of the bootstrap.
    pub done: &'a (dyn Fn() + Sync),
}

impl Common<'_> {
    /// Returns the fit as far as data set and minimum tell it, without residuals and diagnostics.
    pub fn bare(&self, estimates: Vec<Estimate>, minimum: Arc<Solution>) -> Fit {
        let Self { dataset, options, solution, .. } = *self;
        Fit {
            dataset: dataset.name.clone(),
            group: self.group.cloned(),
            path: dataset.path.clone(),
            cloth: dataset.cloth.clone(),
            source: dataset.source.clone(),
            ball: dataset.ball,
            object: dataset.object,
            discs: None,
            sliding: dataset.sliding,
            rolling: dataset.rolling,
            fidelity: options.fidelity.name(),
            footage: dataset.tracks.is_some(),
            effects: Vec::new(),
            correlation: correlation(&estimates, &solution.covariance(&ids(&estimates))),
            estimates,
            chi2: solution.chi2_of_all(),
            prior_chi2: solution.prior_chi2(),
            dof: 0,
            noise: Vec::new(),
            shots_used: solution.names[0].len(),
            shots_rejected: self.rejected(),
            shots_doubtful: Vec::new(),
            disc_shots: Vec::new(),
            scatter: None,
            friction_curve: None,
            camera: None,
            refuted: None,
            explanations: film_words::explanations(solution, None, 0.0),
            residuals: Vec::new(),
            frames: None,
            solution: minimum,
            termination: if solution.converged { "χ² has settled" } else { "too many steps" }.to_owned(),
            converged: solution.converged,
            iterations: solution.evaluations,
            seconds: 0.0,
            diagnostics: Diagnostics::default(),
            findings: solution.findings.clone(),
            stated_scale_sd: 0.0,
            unknowns: solution.estimates(),
            budget: Id::WANTED.into_iter().filter_map(|id| solution.budget(id)).collect(),
            warnings: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Returns the parameters that the fit has, in their order.
    pub fn parameters(&self) -> Vec<Parameter> {
        let extra = |p: &Parameter| {
            // c means nothing without b
            let decides = if *p == Parameter::C { Parameter::B } else { *p };
            self.solution.value(Id::from(decides)) != 0.0 && !p.is_of_balls()
        };
        Parameter::ALL.into_iter().filter(|p| self.settings.has(*p) || extra(p)).collect()
    }

    fn rejected(&self) -> Vec<Rejected> {
        let of = |(shot, reason): &(String, String)| Rejected { shot: shot.clone(), reason: reason.clone() };
        let what = if self.dataset.tracks.is_some() { "its frames do" } else { "it does" };
        let lost = self.solution.findings.iter().filter_map(|finding| match finding {
            Finding::LostShots { names } => Some(names),
            _ => None,
        });
        let lost = lost.flatten().map(|name| Rejected {
            shot: name.clone(),
            reason: format!("{what} not fit the collision that the other shots fit"),
        });
        let stated = self.dataset.left_out.iter().map(of);
        let own = self.solution.left_out.iter().filter(|one| !self.dataset.left_out.contains(one));
        stated.chain(own.map(of)).chain(lost).collect()
    }

    /// Returns the free parameters of the contact with their standard errors.
    pub fn contact(&self) -> Vec<(Parameter, f64)> {
        let error = |p: Parameter| Some((p, self.solution.get(Id::from(p))?.std_error?));
        self.parameters().into_iter().filter_map(error).filter(|(p, _)| !p.is_of_balls()).collect()
    }

    /// Returns what the data determine of some parameters; `silent` are those that no number depends on.
    pub fn identifiability(
        &self,
        parameters: &[Parameter],
        silent: Vec<Parameter>,
    ) -> Option<Identifiability> {
        let unknowns: Vec<(Id, f64)> =
            parameters.iter().map(|p| (Id::from(*p), self.solution.value(Id::from(*p)))).collect();
        let combination = self.solution.worst_direction(&unknowns);
        identify(parameters, combination.as_ref(), silent)
    }

    /// Returns how the estimates scatter in fits of shots that are drawn anew, if that is asked for.
    pub fn bootstrap(&self, contact: &[(Parameter, f64)]) -> Option<Bootstrap> {
        let free: Vec<(Parameter, Id)> = contact.iter().map(|(p, _)| (*p, Id::from(*p))).collect();
        let Options { bootstrap: replicates, seed, .. } = *self.options;
        let asked = replicates > 0 && !free.is_empty();
        asked.then(|| bootstrap::draw(self.solution, &free, (replicates, seed), self.done))
    }

    /// Returns how a robust loss weighted the shots; `None` by least squares.
    pub fn robust(&self) -> Option<Robust> {
        let weights = self.solution.weights();
        let names = self.solution.names[0].iter();
        let mut weights: Vec<(String, f64)> =
            names.cloned().zip(weights).filter(|(_, weight)| *weight < 1.0).collect();
        weights.sort_by(|a, b| a.1.total_cmp(&b.1));
        let loss = self.options.loss.unwrap_or(self.dataset.loss);
        (loss != Loss::Squares).then_some(Robust { loss, weights })
    }

    /// Returns Cook's distance above which a shot is influential: the median of F(p, n − p) of `n` numbers.
    pub fn influential_from(&self, numbers: f64) -> Option<f64> {
        let wanted = self.wanted().len() as f64;
        let f = FisherSnedecor::new(wanted, numbers - wanted).ok()?;
        Some(f.inverse_cdf(0.5)).filter(|x| x.is_finite())
    }

    fn wanted(&self) -> Vec<Id> {
        let has_error = |id: &Id| self.solution.get(*id).is_some_and(|found| found.std_error.is_some());
        self.parameters().into_iter().filter(|p| !p.is_of_balls()).map(Id::from).filter(has_error).collect()
    }

    /// Returns the shots that move the estimates most.
    pub fn influence(&self, influential_from: Option<f64>) -> Vec<Influence> {
        let solution = self.solution;
        let wanted = self.wanted();
        let Some(information) = solution.information(&wanted) else { return Vec::new() };
        let of_shot = |(name, found): (&String, Option<ShotInfluence>)| {
            let Some(found) = found else {
                let nowhere =
                    Influence { shot: name.clone(), leverage: 1.0, cook: f64::INFINITY, shifts: Vec::new() };
                return nowhere;
            };
            let change = |id: &Id| found.changes.iter().find(|(of, _)| of == id).map_or(0.0, |(_, by)| *by);
            let changes = nalgebra::DVector::from_iterator(wanted.len(), wanted.iter().map(change));
            let cook = changes.dot(&(&information * &changes)) / wanted.len() as f64;
            let shift = |p: Parameter| {
                let error = solution.get(Id::from(p))?.std_error?;
                Some((p, change(&Id::from(p)) / error))
            };
            let shifts = self.parameters().into_iter().filter_map(shift).collect();
            Influence { shot: name.clone(), leverage: found.leverage, cook, shifts }
        };
        let mut all: Vec<Influence> =
            solution.names[0].iter().zip(solution.influence()).map(of_shot).collect();
        all.sort_by(|a, b| b.cook.total_cmp(&a.cook));
        let influential = all.iter().filter(|shot| influential_from.is_some_and(|from| shot.cook > from));
        let count = influential.count().clamp(LISTED[0], LISTED[1]);
        all.truncate(count);
        all
    }
}

/// Returns the correlations of estimates from their covariance, NaN for those without an error.
pub fn correlation(estimates: &[Estimate], covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let has = |i: usize| estimates[i].std_error.is_some();
    DMatrix::from_fn(estimates.len(), estimates.len(), |i, j| {
        let scale = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
        if has(i) && has(j) { covariance[(i, j)] / scale } else { f64::NAN }
    })
}

/// Returns the unknowns of estimates.
pub(super) fn ids(estimates: &[Estimate]) -> Vec<Id> {
    estimates.iter().map(|estimate| Id::from(estimate.parameter)).collect()
}
