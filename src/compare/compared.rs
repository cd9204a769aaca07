//! One quantity of a comparison: estimates, pairs, and "same" against "different".

use std::collections::BTreeSet;
use std::sync::Arc;

use minijinja::context;
use nalgebra::DVector;
use statrs::distribution::{ContinuousCDF, Normal};

use super::joint::{Joint, estimate, merged, settle};
use super::result::{
    Compared, Comparison, Difference, LeftOut, LikelihoodRatio, Quantity, RATIO, Robust, SampleSummary,
    SampleWeight, Value, WALD,
};
use super::samples::Alone;
use super::{CompareError, refuse};
use crate::fit::deviations::{holm, residuals};
use crate::fit::film_words::{Remark, doubt, note, words_of};
use crate::measurement::loss::Loss;
use crate::measurement::parameter::Parameter;
use crate::problem::Severity::Unusable;
use crate::problem::{Block, Estimates, Evaluation, Id, Mode, POLICY, Problem, refutes};

impl Joint<'_> {
    /// Returns what the fit says.
    ///
    /// # Errors
    /// A quantity is asked for that no sample has.
    pub fn compared(mut self, stage: &dyn Fn(&str)) -> Result<Comparison, CompareError> {
        let options = self.samples.options;
        if let Some(absent) = options.share.iter().chain(&options.per_dataset).find(|own| !self.has(**own)) {
            let name = absent.name();
            return refuse(format!(
                "{name}: no data set has it; expected a parameter that the [fit] of one adopts"
            ));
        }
        let mut quantities = Vec::new();
        for quantity in Quantity::ALL.into_iter().filter(|quantity| self.has(*quantity)) {
            stage(&format!("one {} or several", quantity.symbol()));
            quantities.push(self.quantity(quantity));
        }
        let differences = quantities.iter_mut().flat_map(|compared| &mut compared.differences);
        holm(differences.map(|difference| &mut difference.p_holm));
        for difference in quantities.iter_mut().flat_map(|compared| &mut compared.differences) {
            difference.real = difference.p_holm < POLICY.level;
        }
        let mut remarks = std::mem::take(&mut self.samples.remarks);
        remarks.extend(quantities.iter().flat_map(find_doubts));
        remarks.extend(self.contradictions());
        let limit = Quantity::ALL.into_iter().find_map(|quantity| self.limit(quantity));
        remarks.sort_by_key(|remark| std::cmp::Reverse(remark.severity));
        let (mut losses, mut weights) = (BTreeSet::new(), Vec::new());
        for (number, alone) in self.samples.fitted.iter().enumerate() {
            let solution = self.solution.of_sample(number);
            let summary = &mut self.samples.summaries[alone.sample];
            for (shot, weight) in solution.names().iter().cloned().zip(solution.weights()) {
                let sample = summary.title.clone();
                weights.extend((weight < 1.0).then_some(SampleWeight { sample, shot, weight }));
            }
            losses.insert(options.loss.unwrap_or(alone.dataset.loss).name());
            summary.residuals = residuals(solution.names(), &solution.deviations());
        }
        weights.sort_by(|a, b| a.weight.total_cmp(&b.weight));
        losses.remove(Loss::Squares.name());
        let mut comparison = Comparison {
            told_by: self.samples.told_by.clone(),
            fidelity: options.fidelity,
            quantities,
            noise_estimated: self.tests.dof.is_some(),
            robust: self.solution.problem.is_robust().then_some(Robust { losses, weights }),
            labels: self.samples.labels,
            samples: self.samples.summaries,
            solution: Arc::new(self.solution),
            remarks,
            is_refuted: false,
        };
        judge(&mut comparison);
        comparison.remarks.extend(limit.filter(|_| !comparison.is_refuted));
        Ok(comparison)
    }

    fn has(&self, quantity: Quantity) -> bool {
        (0..self.samples.fitted.len()).any(|sample| self.sample_has(sample, quantity))
    }

    fn sample_has(&self, sample: usize, quantity: Quantity) -> bool {
        let id = quantity.id();
        let unknown = &self.solution.problem.unknowns[self.solution.column(sample, id)];
        let is_adopted = unknown.mode == Mode::Free || id == Id::Kappa && unknown.start != 0.0;
        let settings = &self.samples.fitted[sample].dataset.settings;
        // discs do not press on a cloth
        let is_open =
            id != Id::MuS || !matches!(self.solution.problem.samples[sample].block, Block::Discs(_));
        is_adopted || is_open && matches!(quantity, Quantity::Parameter(own) if settings.has(own))
    }

    /// Returns the indices of the samples of a label.
    fn of_label(&self, label: usize) -> impl Iterator<Item = usize> + Clone {
        let all = self.samples.fitted.iter().enumerate();
        all.filter(move |(_, alone)| alone.label == label).map(|(sample, _)| sample)
    }

    /// Returns the column of an unknown that a label's samples estimate.
    fn column(&self, label: usize, id: Id) -> Option<usize> {
        let is_free = |column: &usize| self.solution.problem.unknowns[*column].mode == Mode::Free;
        self.of_label(label).map(|sample| self.solution.column(sample, id)).find(is_free)
    }

    /// Returns a quantity's estimates, their differences, and whether one value is enough.
    fn quantity(&self, quantity: Quantity) -> Compared {
        let (id, is_separate) = (quantity.id(), self.samples.is_separate(quantity));
        let problem = &self.solution.problem;
        // with all columns of the unknown, even at a bound
        let estimates = estimate(problem, &self.solution.at, &problem.columns_of(id));
        let estimates = estimates.as_ref();
        let (mut determining, mut left_out) = (Vec::new(), Vec::new());
        for label in 0..self.samples.labels.len() {
            match self.column_of(label, quantity, estimates) {
                Ok(Some(column)) => determining.push((label, column)),
                Ok(None) => {}
                Err(why) => {
                    let values = context! { quantity => quantity.name(), meaning => quantity.meaning() };
                    let label = self.samples.labels[label].clone();
                    left_out.push(LeftOut { label, reason: words_of(why, values) });
                }
            }
        }
        let has_shots = |label: &usize| self.of_label(*label).next().is_some();
        let mut shown: Vec<usize> = (0..self.samples.labels.len()).filter(has_shots).collect();
        if !is_separate {
            let first = determining.first().map_or(self.samples.fitted[0].label, |(label, _)| *label);
            shown = vec![first];
        }
        let differences = estimates.filter(|_| is_separate);
        Compared {
            parameter: quantity,
            meaning: quantity.meaning(),
            shared: !is_separate,
            estimates: shown.into_iter().map(|label| self.value(label, quantity, estimates)).collect(),
            differences: differences.map_or_else(Vec::new, |all| self.differences(&determining, all)),
            same_or_different: self.test(id, &determining),
            left_out,
        }
    }

    /// Returns the column of a quantity that the samples of a label estimate; `None` if it is held.
    ///
    /// # Errors
    /// The template of the reason why they do not determine it.
    fn column_of(
        &self,
        label: usize,
        quantity: Quantity,
        estimates: Option<&Estimates>,
    ) -> Result<Option<usize>, &'static str> {
        let (id, mut own) = (quantity.id(), self.of_label(label));
        if own.clone().next().is_none() {
            return Err("left-out/no-shots");
        }
        if !own.clone().any(|sample| self.sample_has(sample, quantity)) {
            return Err("left-out/absent");
        }
        let Some(column) = self.column(label, id) else {
            let settings = |sample: usize| &self.samples.fitted[sample].dataset.settings;
            let is_held = match quantity {
                Quantity::Parameter(Parameter::Kappa) => true,
                Quantity::Parameter(parameter) => own.all(|sample| settings(sample)[parameter].fixed),
                Quantity::Sliding => false,
            };
            return if is_held { Ok(None) } else { Err("left-out/independent") };
        };
        let informs = |sample: usize| {
            let (problem, state) = (&self.solution.problem, self.solution.state());
            let reduced = |i: usize| problem.contribute(state, (sample, i)).reduced(&[id]);
            let mut shots = (0..state.own[sample].len()).filter_map(reduced);
            shots.any(|(information, _)| information[(0, 0)] > 0.0)
        };
        if !own.any(informs) {
            return Err(if id == Id::Mu { "left-out/sticks" } else { "left-out/independent" });
        }
        // without any covariance, estimates stand without errors
        let has_error = |all: &Estimates| known_error(&self.solution.problem, all, column).is_some();
        if estimates.is_none_or(has_error) { Ok(Some(column)) } else { Err("left-out/uncertain") }
    }

    /// Returns the value of an unknown that the samples of a label have.
    fn value(&self, label: usize, quantity: Quantity, estimates: Option<&Estimates>) -> Value {
        let (problem, id) = (&self.solution.problem, quantity.id());
        let fitted = self.column(label, id);
        let held = || self.of_label(label).next().map(|sample| self.solution.column(sample, id));
        let value = fitted.or_else(held).map_or(f64::NAN, |column| self.solution.at.state.shared.0[column]);
        let [low, high] = fitted.map_or([f64::NAN; 2], |column| problem.unknowns[column].bounds);
        let std_error = fitted.zip(estimates).and_then(|(column, all)| known_error(problem, all, column));
        let interval = |error: f64| {
            let half = self.tests.quantile() * error;
            [value - half, value + half].map(|end| end.max(low).min(high))
        };
        Value {
            label: self.samples.is_separate(quantity).then(|| self.samples.labels[label].clone()),
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

    /// Returns the test of one value of an unknown for all of some labels against one for each;
    /// `None` if the data determine fewer than two of the values.
    fn test(&self, id: Id, determining: &[(usize, usize)]) -> Option<LikelihoodRatio> {
        let [(label, first), others @ ..] = determining else { return None };
        let (problem, at) = match others.first()? {
            (_, other) if other == first => {
                let is_other = |own: usize| others.iter().any(|(other, _)| *other == own);
                self.freed(&[id], |alone| if is_other(alone.label) { alone.label } else { *label })?
            }
            _ => (self.solution.problem.clone(), self.solution.at.clone()),
        };
        let mut columns = problem.columns_of(id);
        let estimates = estimate(&problem, &at, &columns)?;
        columns.retain(|column| known_error(&problem, &estimates, *column).is_some());
        let extra = columns.len().checked_sub(1).filter(|extra| *extra > 0)?;
        let judged = |statistic: f64, rise: f64, test: &'static str| LikelihoodRatio {
            statistic,
            test,
            extra_parameters: extra,
            p_value: self.tests.of_rise(rise, extra),
            delta_aic: 2.0 * extra as f64 - statistic,
        };
        let places: Vec<usize> = columns.iter().filter_map(|column| estimates.position(*column)).collect();
        if problem.is_robust() {
            // Wald's statistic: the scatter of the values about their weighted mean
            let values = columns.iter().map(|column| at.state.shared.0[*column]);
            let values = DVector::from_iterator(columns.len(), values);
            let covariance = estimates.covariance.select_rows(&places).select_columns(&places);
            let weights = covariance.cholesky()?.inverse();
            let weighted = &weights * &values;
            let statistic = values.dot(&weighted) - weighted.sum().powi(2) / weights.sum();
            return Some(judged(statistic, statistic, WALD));
        }
        let same = merged(&problem, &columns);
        // if contacts stick, χ² is not a parabola: from the value of each label
        let value = |column: &usize| (columns[0], at.state.shared.0[*column]);
        let starts = columns.iter().map(|column| at.state.clone().with([value(column)]));
        let least = starts.map(|start| settle(&same, start).cost).min_by(f64::total_cmp)?;
        let rise = (least - at.cost).max(0.0);
        let (chi2, count) = self.solution.chi2_of_data();
        // Gaussian noise of unknown size: n ln of the ratio of the sums of squares
        let statistic = if self.tests.dof.is_some() { count * (rise / chi2).ln_1p() } else { rise };
        rise.is_finite().then(|| judged(statistic, rise, RATIO))
    }

    /// Returns the least χ² with a column of some unknowns for each owner of the samples that share
    /// one, at the present noise; `None` if there is one owner.
    fn freed(&self, ids: &[Id], owner: impl Fn(&Alone) -> usize) -> Option<(Problem, Evaluation)> {
        let (mut problem, mut state) = (self.solution.problem.clone(), self.solution.at.state.clone());
        let shared = problem.unknowns.len();
        let mut known: Vec<[usize; 3]> = Vec::new();
        for id in ids {
            for (sample, alone) in problem.samples.iter_mut().zip(&self.samples.fitted) {
                let column = &mut sample.columns[*id as usize];
                let own = [*column, owner(alone)];
                if let Some([.., other]) = known.iter().find(|known| known[..2] == own) {
                    *column = *other;
                } else if known.iter().any(|known| known[0] == own[0]) {
                    *column = problem.unknowns.len();
                    problem.unknowns.push(problem.unknowns[own[0]]);
                    state.shared.0.push(state.shared.0[own[0]]);
                }
                known.push([own[0], own[1], *column]);
            }
        }
        let is_freed = problem.unknowns[shared..].iter().any(|unknown| unknown.mode == Mode::Free);
        let end = is_freed.then(|| settle(&problem, state))?;
        Some((problem, end))
    }

    /// Returns that the data contradict what data sets of one label share; by a robust loss, whose
    /// rise has no known distribution, they are not asked.
    fn contradictions(&self) -> Vec<Remark> {
        let label_of = |id: Id| match Quantity::ALL.into_iter().find(|quantity| quantity.id() == id) {
            Some(quantity) if self.samples.is_separate(quantity) => "cloth",
            None if id.is_of_camera() => "camera",
            None if [Id::MassRatio, Id::RadiusRatio].contains(&id) => "balls",
            None if [Id::MuR, Id::Bounce].contains(&id) => "cloth",
            _ => "",
        };
        let labels = ["balls", "cloth", "camera"].into_iter().filter(|_| !self.solution.problem.is_robust());
        let contradiction = |label: &str| {
            let ids: Vec<Id> = Id::ALL.into_iter().filter(|id| label_of(*id) == label).collect();
            let (problem, at) = self.freed(&ids, |alone| alone.film)?;
            let extra = problem.free().len() - self.solution.problem.free().len();
            let p_value = self.tests.of_rise((self.solution.at.cost - at.cost).max(0.0), extra);
            is_improbable(p_value).then(|| doubt("not-same", context! { label, p_value }))
        };
        labels.filter_map(contradiction).collect()
    }

    /// Returns that most of the variance of a difference is due to mass ratios that the labels do
    /// not share: dᵀC⁻¹d, with d the covariances of the difference and the ratios, and C the
    /// covariance of the ratios.
    fn limit(&self, quantity: Quantity) -> Option<Remark> {
        let Estimates { columns, covariance } = &self.solution.covariance;
        let places = |id: Id| -> Vec<usize> {
            let is_of_quantity = |i: &usize| self.solution.problem.unknowns[columns[*i]].id == id;
            (0..columns.len()).filter(is_of_quantity).collect()
        };
        let (ratios, values) = (places(Id::MassRatio), places(quantity.id()));
        let [first, second, ..] = values[..] else { return None };
        let inverse = covariance.select_rows(&ratios).select_columns(&ratios).try_inverse()?;
        let difference = covariance.column(second) - covariance.column(first);
        let variance = difference[second] - difference[first];
        let by_ratios = difference.select_rows(&ratios);
        let part = by_ratios.dot(&(&inverse * &by_ratios));
        let is_most = ratios.len() > 1 && 2.0 * part > variance;
        let (quantity, std_error, part) = (quantity.name(), variance.sqrt(), part.sqrt());
        is_most.then(|| note("mass-ratios", context! { quantity, std_error, part }))
    }
}

/// Returns a shared quantity that the data contradict as doubtful fits do, and estimates at a
/// bound.
fn find_doubts(Compared { parameter, shared, estimates, same_or_different, .. }: &Compared) -> Vec<Remark> {
    let quantity = parameter.name();
    let p_value = same_or_different.map(|test| test.p_value).filter(|p| *shared && is_improbable(*p));
    let not_shared = p_value.map(|p_value| doubt("not-shared", context! { quantity, p_value }));
    let at_bound =
        estimates.iter().filter(|value| value.at_bound).map(|Value { label, estimate, .. }| {
            let values = context! { quantity, label, bound => estimate };
            doubt("at-bound/label-at-bound", values)
        });
    not_shared.into_iter().chain(at_bound).collect()
}

/// Returns whether data contradict a statement by this probability, as doubtful fits do.
fn is_improbable(p_value: f64) -> bool {
    p_value < 2.0 * Normal::standard().sf(POLICY.conflict)
}

/// Takes errors, differences and tests away if residuals refute the model by the errors that are
/// stated. The sliding friction of the cloth, from the paths after the impacts, stays.
fn judge(comparison: &mut Comparison) {
    if comparison.noise_estimated || comparison.robust.is_some() {
        return;
    }
    let (chi2, dof) = (comparison.chi2(), comparison.solution.dof());
    let mut samples = Vec::new();
    for SampleSummary { title, residuals, .. } in &comparison.samples {
        let chi2 = residuals.iter().map(|residual| residual.standardized.powi(2)).sum();
        // a sample takes up few of the parameters, of many observations
        samples.extend(refutes(chi2, residuals.len() as f64).map(|reduced| (title.clone(), reduced)));
    }
    if samples.is_empty() && refutes(chi2, dof as f64).is_none() {
        return;
    }
    let values = context! { samples, reduced_chi2 => chi2 / dof.max(1) as f64 };
    let refuted = Remark::new(Unusable, "refuted", values);
    for compared in comparison.quantities.iter_mut().filter(|own| own.parameter != Quantity::Sliding) {
        for value in &mut compared.estimates {
            (value.std_error, value.interval_95) = (None, None);
        }
        compared.differences.clear();
        compared.same_or_different = None;
    }
    comparison.is_refuted = true;
    comparison.remarks.insert(0, refuted);
}

/// Returns the standard error of a column if it is less than its bounds leave open.
fn known_error(problem: &Problem, estimates: &Estimates, column: usize) -> Option<f64> {
    let [low, high] = problem.unknowns[column].bounds;
    estimates.sd(column).filter(|sd| *sd < high - low)
}
