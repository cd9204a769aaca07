//! One quantity of a comparison: estimates, pairs, and "same" against "different".

use statrs::distribution::{ContinuousCDF, Normal};

use super::CompareError;
use super::findings::{Finding, Reason};
use super::joint::{Joint, estimate};
use super::quantity::Quantity;
use super::result::{
    Compared, Comparison, Difference, LabelResidual, LikelihoodRatio, Robust, SampleWeight, Value,
};
use super::samples::Alone;
use super::significance::known_error;
use crate::fit::Computed;
use crate::fit::deviations::residuals as residuals_of;
use crate::fit::trends::holm;
use crate::physics::collision::Fidelity;
use crate::problem::{Estimates, Id, Mode, Policy, refutes};

impl Joint<'_> {
    /// Returns what the fit says.
    ///
    /// # Errors
    /// A quantity is asked for that no sample has.
    pub fn compared(mut self, stage: &dyn Fn(&str)) -> Result<Comparison, CompareError> {
        let options = self.samples.options;
        if let Some(absent) = options.share.iter().chain(&options.per_dataset).find(|own| !self.has(**own)) {
            let name = absent.name();
            return Err(CompareError::Refused(format!(
                "{name}: no data set has it; expected a parameter that the [fit] of one adopts"
            )));
        }
        let mut quantities = Vec::new();
        for quantity in Quantity::ALL.into_iter().filter(|quantity| self.has(*quantity)) {
            stage(&format!("one {} or several", quantity.symbol()));
            quantities.push(self.quantity(quantity));
        }
        let differences = quantities.iter_mut().flat_map(|compared| &mut compared.differences);
        holm(differences.map(|difference| &mut difference.p_holm));
        for difference in quantities.iter_mut().flat_map(|compared| &mut compared.differences) {
            difference.real = difference.p_holm < Difference::LEVEL;
        }
        let mut findings = std::mem::take(&mut self.samples.findings);
        findings.extend(quantities.iter().flat_map(find_doubts));
        findings.extend(Quantity::ALL.into_iter().find_map(|quantity| self.limit(quantity)));
        findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity()));
        let chi2 = self.solution.chi2_of_data().0 + self.solution.prior_chi2();
        let (mut weights, mut residuals, mut is_filmed) = (Vec::new(), Vec::new(), false);
        for (number, alone) in self.samples.fitted.iter().enumerate() {
            let Alone { label, sample, .. } = *alone;
            let solution = self.solution.of_sample(number);
            is_filmed |= solution.is_film();
            let shots = solution.names[0].iter().cloned().zip(solution.weights());
            let title = &self.samples.summaries[sample].title;
            let weight = |(shot, weight)| SampleWeight { sample: title.clone(), shot, weight };
            weights.extend(shots.filter(|(_, weight)| *weight < 1.0).map(weight));
            let own = residuals_of(&solution.names[0], &solution.deviations(), |_| true);
            residuals.extend(own.into_iter().map(|of_shot| LabelResidual { label, sample, of_shot }));
        }
        weights.sort_by(|a, b| a.weight.total_cmp(&b.weight));
        let mut comparison = Comparison {
            told_by: self.samples.told_by.clone(),
            fidelity: options.fidelity.map_or("auto", Fidelity::name),
            is_filmed,
            computed: Computed::of(&self.solution, options.fidelity),
            quantities,
            chi2,
            dof: self.solution.dof(),
            noise_estimated: self.tests.estimated,
            converged: self.solution.converged,
            residuals,
            robust: self.solution.problem.is_robust().then(|| Robust { losses: self.losses(), weights }),
            labels: self.samples.labels,
            samples: self.samples.summaries,
            findings,
        };
        judge(&mut comparison);
        Ok(comparison)
    }

    pub(super) fn has(&self, quantity: Quantity) -> bool {
        (0..self.samples.fitted.len()).any(|sample| self.sample_has(sample, quantity))
    }

    fn sample_has(&self, sample: usize, quantity: Quantity) -> bool {
        let id = quantity.id();
        let Some(column) = self.solution.column(sample, id) else { return false };
        let unknown = &self.solution.problem.unknowns[column];
        let is_adopted = unknown.mode == Mode::Free || id == Id::Kappa && unknown.start != 0.0;
        let settings = &self.samples.fitted[sample].settings;
        is_adopted || matches!(quantity, Quantity::Parameter(own) if settings.has(own))
    }

    fn of_label(&self, label: usize) -> Vec<usize> {
        let all = self.samples.fitted.iter().enumerate();
        all.filter(|(_, alone)| alone.label == label).map(|(sample, _)| sample).collect()
    }

    /// Returns a quantity's estimates, their differences, and whether one value is enough.
    pub(super) fn quantity(&self, quantity: Quantity) -> Compared {
        let (id, is_separate) = (quantity.id(), self.samples.is_separate(quantity));
        let problem = &self.solution.problem;
        // with all columns of the unknown, even at a bound
        let estimates = estimate(problem, &self.solution.at, &problem.columns_of(id));
        let (mut determining, mut left_out) = (Vec::new(), Vec::new());
        for label in 0..self.samples.labels.len() {
            match self.column_of(label, quantity, estimates.as_ref()) {
                Ok(Some(column)) => determining.push((label, column)),
                Ok(None) => {}
                Err(reason) => left_out.push((label, reason)),
            }
        }
        let labels: Vec<usize> = determining.iter().map(|(label, _)| *label).collect();
        let shown: Vec<usize> = if is_separate {
            (0..self.samples.labels.len()).filter(|label| !self.of_label(*label).is_empty()).collect()
        } else {
            let first = self.samples.fitted.first().map(|alone| alone.label);
            labels.first().copied().or(first).into_iter().collect()
        };
        let value = |label: usize| {
            let label_of_value = is_separate.then(|| self.samples.labels[label].clone());
            Value { label: label_of_value, ..self.value(label, id, estimates.as_ref()) }
        };
        Compared {
            quantity,
            shared: !is_separate,
            estimates: shown.into_iter().map(value).collect(),
            differences: match &estimates {
                Some(estimates) if is_separate => self.differences(&determining, estimates),
                _ => Vec::new(),
            },
            same_or_different: self.test(id, &labels),
            left_out,
        }
    }

    /// Returns the column of a quantity that the samples of a label estimate; `None` if they hold
    /// it.
    ///
    /// # Errors
    /// Why they do not determine it.
    fn column_of(
        &self,
        label: usize,
        quantity: Quantity,
        estimates: Option<&Estimates>,
    ) -> Result<Option<usize>, Reason> {
        let (id, own) = (quantity.id(), self.of_label(label));
        if own.is_empty() {
            return Err(Reason::NoShots);
        }
        if !own.iter().any(|sample| self.sample_has(*sample, quantity)) {
            return Err(Reason::Absent);
        }
        let Some(column) = self.column(label, id) else {
            let is_stated = |alone: &Alone| matches!(quantity, Quantity::Parameter(parameter) if alone.settings[parameter].fixed);
            let is_held =
                id == Id::Kappa || own.iter().all(|sample| is_stated(&self.samples.fitted[*sample]));
            return if is_held { Ok(None) } else { Err(Reason::Independent) };
        };
        let informs = |sample: &usize| {
            let mut shots = self.solution.at.shots[*sample].iter().filter_map(|shot| shot.reduced(&[id]));
            shots.any(|(information, _)| information[(0, 0)] > 0.0)
        };
        if !own.iter().any(informs) {
            return Err(if id == Id::Mu { Reason::Sticks } else { Reason::Uncertain });
        }
        // without any covariance, estimates stand without errors
        let has_error = |all: &Estimates| known_error(&self.solution.problem, all, column).is_some();
        if estimates.is_none_or(has_error) { Ok(Some(column)) } else { Err(Reason::Uncertain) }
    }

    /// Returns the value of an unknown that the samples of a label have.
    fn value(&self, label: usize, id: Id, estimates: Option<&Estimates>) -> Value {
        let problem = &self.solution.problem;
        let fitted = self.column(label, id);
        let held = || self.solution.column(*self.of_label(label).first()?, id);
        let value = fitted.or_else(held).map_or(f64::NAN, |column| self.solution.at.state.shared.0[column]);
        let [low, high] = fitted.map_or([f64::NAN; 2], |column| problem.unknowns[column].bounds);
        let std_error = fitted.zip(estimates).and_then(|(column, all)| known_error(problem, all, column));
        let interval = |error: f64| {
            let half = self.tests.quantile() * error;
            [value - half, value + half].map(|end| end.max(low).min(high))
        };
        Value {
            label: None,
            estimate: value,
            std_error,
            interval_95: std_error.map(interval),
            fitted: fitted.is_some(),
            at_bound: value <= low || value >= high,
        }
    }

    /// Returns the differences of all pairs of labels, given with their columns.
    fn differences(&self, determining: &[(usize, usize)], estimates: &Estimates) -> Vec<Difference> {
        let value = |column: usize| self.solution.at.state.shared.0[column];
        let covariance = &estimates.covariance;
        let mut all = Vec::new();
        for (i, (first, a)) in determining.iter().enumerate() {
            for (second, b) in &determining[i + 1..] {
                let (Some(p), Some(q)) = (estimates.position(*a), estimates.position(*b)) else { continue };
                let variance = covariance[(p, p)] + covariance[(q, q)] - 2.0 * covariance[(p, q)];
                let labels = [first, second].map(|label| self.samples.labels[*label].as_str());
                all.push(self.tests.pair(labels, value(*b) - value(*a), variance.sqrt()));
            }
        }
        all
    }
}

/// Returns that the data contradict a shared quantity at the level at which a fit becomes doubtful,
/// and the estimates that are at a bound.
fn find_doubts(compared: &Compared) -> Vec<Finding> {
    let quantity = compared.quantity;
    let level = 2.0 * Normal::standard().sf(Policy::default().conflict);
    let mut doubts = Vec::new();
    if let Some(LikelihoodRatio { p_value, .. }) = compared.same_or_different
        && compared.shared
        && p_value < level
    {
        doubts.push(Finding::NotShared { quantity, p_value });
    }
    for Value { label, estimate, .. } in compared.estimates.iter().filter(|value| value.at_bound) {
        doubts.push(Finding::AtBound { quantity, label: label.clone(), bound: *estimate });
    }
    doubts
}

/// Takes errors, differences and tests away if the residuals of a sample or of all refute the model
/// by the errors that are stated. The sliding friction of the cloth, from the paths after the
/// impacts, stays.
fn judge(comparison: &mut Comparison) {
    if comparison.noise_estimated || comparison.robust.is_some() {
        return;
    }
    let policy = Policy::default();
    let reduced_chi2 = comparison.chi2 / comparison.dof.max(1) as f64;
    let of_sample = |sample: usize| {
        let own = comparison.residuals.iter().filter(|residual| residual.sample == sample);
        let squares: Vec<f64> = own.map(|residual| residual.of_shot.standardized.powi(2)).collect();
        // a sample takes up few of the parameters, of many observations
        let (chi2, count) = (squares.iter().sum::<f64>(), squares.len());
        refutes(chi2, count as f64, &policy).map(|reduced| (sample, reduced))
    };
    let samples: Vec<(usize, f64)> = (0..comparison.samples.len()).filter_map(of_sample).collect();
    if samples.is_empty() && refutes(comparison.chi2, comparison.dof as f64, &policy).is_none() {
        return;
    }
    let rests_on_model = |quantity: Quantity| quantity != Quantity::Sliding;
    for compared in comparison.quantities.iter_mut().filter(|compared| rests_on_model(compared.quantity)) {
        for value in &mut compared.estimates {
            (value.std_error, value.interval_95) = (None, None);
        }
        compared.differences.clear();
        compared.same_or_different = None;
    }
    comparison.findings.retain(|finding| !matches!(finding, Finding::MassRatios { .. }));
    comparison.findings.insert(0, Finding::Refuted { samples, reduced_chi2 });
}
