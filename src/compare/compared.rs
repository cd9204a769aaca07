//! One quantity of a comparison: estimates, pairs, and "same" against "different".

use super::alone::Alone;
use super::findings::Reason;
use super::joint::{Joint, estimate};
use super::quantity::Quantity;
use super::result::{Compared, Difference, Value};
use crate::problem::{Estimates, Id, Mode};

/// What the samples of a label say about a quantity.
enum Says {
    /// They estimate the unknown of this column.
    Value(usize),
    /// They hold it.
    Held,
    Nothing(Reason),
}

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
        let (id, is_apart) = (quantity.id(), self.sharing.is_apart(quantity));
        let estimates = self.estimates_of(id);
        let labels = 0..self.samples.labels.len();
        let says: Vec<Says> = labels.map(|label| self.says(label, quantity, estimates.as_ref())).collect();
        let mut telling = Vec::new();
        let mut left_out = Vec::new();
        for (label, says) in says.iter().enumerate() {
            match says {
                Says::Value(column) => telling.push((label, *column)),
                Says::Nothing(reason) => left_out.push((label, *reason)),
                Says::Held => {}
            }
        }
        let value = |label| self.value(label, id, estimates.as_ref());
        let has_shots = |label: &usize| self.samples.fitted.iter().any(|alone| alone.label == *label);
        let labels: Vec<usize> = telling.iter().map(|(label, _)| *label).collect();
        Compared {
            quantity,
            shared: !is_apart,
            estimates: if is_apart {
                let all = (0..says.len()).filter(has_shots);
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

    fn says(&self, label: usize, quantity: Quantity, estimates: Option<&Estimates>) -> Says {
        let id = quantity.id();
        let own: Vec<(usize, &Alone)> =
            self.samples.fitted.iter().enumerate().filter(|(_, alone)| alone.label == label).collect();
        if own.is_empty() {
            return Says::Nothing(Reason::NoShots);
        }
        if !own.iter().any(|(sample, alone)| self.sample_has(*sample, alone, quantity)) {
            return Says::Nothing(Reason::Absent);
        }
        let Some(column) = self.column(label, id) else {
            let is_stated = |alone: &Alone| matches!(quantity, Quantity::Parameter(parameter) if alone.settings[parameter].fixed);
            let is_adopted = id == Id::Kappa;
            let is_held = is_adopted || own.iter().all(|(_, alone)| is_stated(alone));
            return if is_held { Says::Held } else { Says::Nothing(Reason::Independent) };
        };
        if !own.iter().any(|(sample, _)| self.informs(*sample, id)) {
            return Says::Nothing(if id == Id::Mu { Reason::Sticks } else { Reason::Vanishes });
        }
        // without any covariance, estimates stand without errors
        let is_known = estimates.is_none_or(|estimates| self.known_error(column, estimates).is_some());
        if is_known { Says::Value(column) } else { Says::Nothing(Reason::Uncertain) }
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
        let value = &self.solution.at.state.shared.0;
        let Some(column) = self.column(label, id) else {
            let sample = self.samples.fitted.iter().position(|alone| alone.label == label);
            let column = sample.and_then(|sample| self.solution.column(sample, id));
            return Value::held(None, column.map_or(f64::NAN, |column| value[column]));
        };
        let (value, [low, high]) = (value[column], self.solution.problem.unknowns[column].bounds);
        let std_error = estimates.and_then(|estimates| self.known_error(column, estimates));
        let within = |end: f64| end.max(low).min(high);
        let interval = |error: f64| {
            let half = self.tests.quantile() * error;
            [within(value - half), within(value + half)]
        };
        Value {
            label: None,
            value,
            std_error,
            interval_95: std_error.map(interval),
            fitted: true,
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
