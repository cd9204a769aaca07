//! One quantity of a comparison: estimates, pairs, and "same" against "different".

use super::findings::Reason;
use super::joint::{Joint, estimate};
use super::quantity::Quantity;
use super::result::{Compared, Difference, Value};
use super::samples::Alone;
use crate::problem::{Estimates, Id, Mode};

impl Joint<'_> {
    /// Returns whether a sample has a quantity.
    pub(super) fn has(&self, quantity: Quantity) -> bool {
        self.samples.fitted.iter().enumerate().any(|(sample, alone)| self.sample_has(sample, alone, quantity))
    }

    fn sample_has(&self, sample: usize, alone: &Alone, quantity: Quantity) -> bool {
        let id = quantity.id();
        let Some(column) = self.solution.column(sample, id) else { return false };
        let unknown = &self.solution.problem.unknowns[column];
        let is_adopted = unknown.mode == Mode::Free || id == Id::Kappa && unknown.start != 0.0;
        is_adopted || matches!(quantity, Quantity::Parameter(own) if alone.settings.has(own))
    }

    /// Returns a quantity's estimates, their differences, and whether one value is enough.
    pub(super) fn quantity(&self, quantity: Quantity) -> Compared {
        let (id, is_apart) = (quantity.id(), self.samples.is_apart(quantity));
        let estimates = self.estimates_of(id);
        let labels = 0..self.samples.labels.len();
        let columns: Vec<Result<Option<usize>, Reason>> =
            labels.map(|label| self.column_of(label, quantity, estimates.as_ref())).collect();
        let all = || columns.iter().enumerate();
        let telling: Vec<(usize, usize)> =
            all().filter_map(|(label, column)| Some((label, (*column).ok()??))).collect();
        let left_out = all().filter_map(|(label, column)| Some((label, (*column).err()?))).collect();
        let value = |label| self.value(label, id, estimates.as_ref());
        let has_shots = |label: &usize| self.samples.fitted.iter().any(|alone| alone.label == *label);
        let labels: Vec<usize> = telling.iter().map(|(label, _)| *label).collect();
        Compared {
            quantity,
            shared: !is_apart,
            estimates: if is_apart {
                let all = (0..columns.len()).filter(has_shots);
                all.map(|label| Value { label: Some(label), ..value(label) }).collect()
            } else {
                let first = labels.first().or(self.samples.fitted.first().map(|alone| &alone.label));
                first.map(|label| value(*label)).into_iter().collect()
            },
            differences: match &estimates {
                Some(estimates) if is_apart => self.differences(&telling, estimates),
                _ => Vec::new(),
            },
            same_or_different: self.test(id, &labels),
            left_out,
        }
    }

    /// Returns the estimates with all columns of an unknown, even at a bound.
    fn estimates_of(&self, id: Id) -> Option<Estimates> {
        let problem = &self.solution.problem;
        estimate(problem, &self.solution.at, &problem.columns_of(id))
    }

    /// Returns the column of a quantity that the samples of a label estimate; `None` if they hold it.
    ///
    /// # Errors
    /// Why they do not determine it.
    fn column_of(
        &self,
        label: usize,
        quantity: Quantity,
        estimates: Option<&Estimates>,
    ) -> Result<Option<usize>, Reason> {
        let id = quantity.id();
        let own: Vec<(usize, &Alone)> =
            self.samples.fitted.iter().enumerate().filter(|(_, alone)| alone.label == label).collect();
        if own.is_empty() {
            return Err(Reason::NoShots);
        }
        if !own.iter().any(|(sample, alone)| self.sample_has(*sample, alone, quantity)) {
            return Err(Reason::Absent);
        }
        let Some(column) = self.column(label, id) else {
            let is_stated = |alone: &Alone| matches!(quantity, Quantity::Parameter(parameter) if alone.settings[parameter].fixed);
            let is_adopted = id == Id::Kappa;
            let is_held = is_adopted || own.iter().all(|(_, alone)| is_stated(alone));
            return if is_held { Ok(None) } else { Err(Reason::Independent) };
        };
        if !own.iter().any(|(sample, _)| self.informs(*sample, id)) {
            return Err(if id == Id::Mu { Reason::Sticks } else { Reason::Vanishes });
        }
        // without any covariance, estimates stand without errors
        let is_known = estimates.is_none_or(|estimates| self.known_error(column, estimates).is_some());
        if is_known { Ok(Some(column)) } else { Err(Reason::Uncertain) }
    }

    /// Returns whether an unknown affects χ² of a sample.
    fn informs(&self, sample: usize, id: Id) -> bool {
        let shots = self.solution.at.shots[sample].iter();
        shots.filter_map(|shot| shot.reduced(&[id])).any(|(information, _)| information[(0, 0)] > 0.0)
    }

    /// Returns the standard error of a column if it is less than its bounds leave open.
    fn known_error(&self, column: usize, estimates: &Estimates) -> Option<f64> {
        let [low, high] = self.solution.problem.unknowns[column].bounds;
        estimates.sd(column).filter(|sd| *sd < high - low)
    }

    /// Returns the value of an unknown that the samples of a label have.
    fn value(&self, label: usize, id: Id, estimates: Option<&Estimates>) -> Value {
        let sample = self.samples.fitted.iter().position(|alone| alone.label == label);
        let fitted = self.column(label, id);
        let column = fitted.or_else(|| self.solution.column(sample?, id));
        let value = column.map_or(f64::NAN, |column| self.solution.at.state.shared.0[column]);
        let [low, high] =
            fitted.map_or([f64::NAN; 2], |column| self.solution.problem.unknowns[column].bounds);
        let std_error = fitted.zip(estimates).and_then(|(column, all)| self.known_error(column, all));
        let interval = |error: f64| {
            let half = self.tests.quantile() * error;
            [value - half, value + half].map(|end| end.max(low).min(high))
        };
        Value {
            label: None,
            value,
            std_error,
            interval_95: std_error.map(interval),
            fitted: fitted.is_some(),
            at_bound: value <= low || value >= high,
        }
    }

    /// Returns the differences of all pairs of labels, given with their columns.
    fn differences(&self, telling: &[(usize, usize)], estimates: &Estimates) -> Vec<Difference> {
        let value = |column: usize| self.solution.at.state.shared.0[column];
        let covariance = &estimates.covariance;
        let mut all = Vec::new();
        for (i, (first, a)) in telling.iter().enumerate() {
            for (second, b) in &telling[i + 1..] {
                let (Some(p), Some(q)) = (estimates.position(*a), estimates.position(*b)) else { continue };
                let variance = covariance[(p, p)] + covariance[(q, q)] - 2.0 * covariance[(p, q)];
                all.push(self.tests.pair(*first, *second, value(*b) - value(*a), variance.sqrt()));
            }
        }
        all
    }
}
