//! One parameter of a comparison: estimates, pairs, and "same" against "different".

use nalgebra::DMatrix;

use super::Reason;
use super::joint_fit::FitOfAll;
use super::uninformed::Says;
use super::verdict::{Tests, wald};
use super::{CompareError, Compared, Difference, LikelihoodRatio, Quantity, TestKind, Value};
use crate::fit::minimum::Minimum;
use crate::fit::robust::Sandwich;
use crate::fit::samples::Search;
use crate::fit::settled::Settled;
use crate::fit::slice::Slice;
use crate::likelihood::sample::Unknown;
use crate::measurement::parameter::Parameter;
use crate::numerics::least_squares::{Activity, Bounds};

impl<'a> FitOfAll<'a> {
    /// One parameter: its estimates, their differences, and whether one value is enough.
    pub(super) fn quantity(&self, labels: usize, parameter: Parameter) -> Result<Compared, CompareError> {
        let says = |label: usize| match self.informed.says(self.groups, &self.before, label, parameter) {
            Says::Something if !self.determines(label, parameter) => Says::Nothing(Reason::Uncertain),
            says => says,
        };
        let says: Vec<Says> = (0..labels).map(says).collect();
        let telling: Vec<usize> = (0..labels).filter(|l| says[*l] == Says::Something).collect();
        let left_out = says.iter().enumerate().filter_map(|(label, says)| match says {
            Says::Nothing(why) => Some((label, *why)),
            Says::Something | Says::Held => None,
        });
        let shared = self.before.samples.iter().all(|sample| sample.numbers[parameter as usize] == 0);
        let mut compared = Compared {
            quantity: Quantity::Parameter(parameter),
            shared,
            estimates: self.estimates(labels, parameter, shared),
            differences: Vec::new(),
            same_or_different: None,
            left_out: left_out.collect(),
        };
        if telling.len() > 1 {
            if !shared {
                compared.differences = self.differences(parameter, &telling);
            }
            compared.same_or_different = self.same_or_different(parameter, shared)?;
        }
        Ok(compared)
    }

    fn column(&self, label: usize, parameter: Parameter) -> Option<usize> {
        self.informed.column(self.groups, label, parameter)
    }

    /// Whether its value is known to less than its bounds leave open.
    fn determines(&self, label: usize, parameter: Parameter) -> bool {
        let (Some(column), Some(covariance)) = (self.column(label, parameter), &self.covariance) else {
            return true;
        };
        is_known(self.minimum(), covariance, column)
    }

    fn estimates(&self, labels: usize, parameter: Parameter, shared: bool) -> Vec<Value> {
        let settled = &self.informed.settled;
        let held = |label: Option<usize>| {
            let of_label = |place: &usize| label.is_none_or(|label| self.groups[*place].label == label);
            let edge = self.informed.plateaus.iter().find(|(unknown, _)| {
                let number = label.filter(|_| !shared).unwrap_or(0);
                (unknown.parameter, unknown.number) == (parameter, number)
            });
            let last = self.informed.places.iter().position(of_label);
            let before = (0..self.groups.len()).find(of_label);
            edge.map(|(_, plateau)| plateau.edge)
                .or(last.map(|i| settled.minimum.values[i][parameter]))
                .or(before.map(|i| self.groups[i].settings[parameter].initial))
                .unwrap_or(f64::NAN)
        };
        let value = |column: Option<usize>, label: Option<usize>| {
            let Some(column) = column else {
                return Value::held(label, held(label));
            };
            let Bounds { lower, upper } = &settled.minimum.bounds;
            let known = |c: &&DMatrix<f64>| is_known(&settled.minimum, c, column);
            let std_error = self.covariance.as_ref().filter(known).map(|c| c[(column, column)].sqrt());
            let value = settled.minimum.x[column];
            let t = self.tests.quantile();
            let interval_95 = std_error.map(|error| {
                let clamp = |end: f64| end.clamp(lower[column], upper[column]);
                [clamp(value - t * error), clamp(value + t * error)]
            });
            let at_bound = settled.minimum.active[column] != Activity::Free;
            Value { label, value, std_error, interval_95, fitted: true, at_bound }
        };
        if shared {
            let column = (0..labels).find_map(|label| self.column(label, parameter));
            return vec![value(column, None)];
        }
        (0..labels)
            .filter(|label| self.groups.iter().any(|group| group.label == *label))
            .map(|label| value(self.column(label, parameter), Some(label)))
            .collect()
    }

    fn differences(&self, parameter: Parameter, telling: &[usize]) -> Vec<Difference> {
        let Some(covariance) = &self.covariance else { return Vec::new() };
        let x = &self.minimum().x;
        let mut all = Vec::new();
        for (i, first) in telling.iter().enumerate() {
            for second in &telling[i + 1..] {
                let column = |label| self.column(label, parameter);
                let (Some(a), Some(b)) = (column(*first), column(*second)) else { continue };
                let variance = covariance[(a, a)] + covariance[(b, b)] - 2.0 * covariance[(a, b)];
                all.push(self.tests.pair(*first, *second, x[b] - x[a], variance.sqrt()));
            }
        }
        all
    }

    /// One value for all against one for each; `None` where fewer than two values are known.
    fn same_or_different(
        &self,
        parameter: Parameter,
        shared: bool,
    ) -> Result<Option<LikelihoodRatio>, CompareError> {
        let own;
        let different = if shared {
            own = self.apart(parameter)?;
            &own
        } else {
            &self.informed.settled
        };
        let Settled { search, free, minimum, estimated, .. } = different;
        let covariance = minimum.covariance();
        let tells = |(column, unknown): &(usize, &Unknown)| {
            let known = covariance.as_ref().is_none_or(|c| is_known(minimum, c, *column));
            unknown.parameter == parameter && known
        };
        let columns: Vec<usize> = free.iter().enumerate().filter(tells).map(|(column, _)| column).collect();
        let [first, others @ ..] = columns.as_slice() else { return Ok(None) };
        let extra = others.len();
        if extra == 0 {
            return Ok(None);
        }
        let dof = if shared { self.tests.dof.saturating_sub(extra) } else { self.tests.dof };
        let tests = Tests { dof, ..self.tests };
        let judged = |statistic: f64, rise: f64, by: TestKind| LikelihoodRatio {
            statistic,
            by,
            extra_parameters: extra,
            p_value: tests.of_rise(rise, extra),
            delta_aic: 2.0 * extra as f64 - statistic,
        };
        if search.is_robust() {
            let sandwich = Sandwich::new(search, minimum, free.len());
            let covariance = sandwich.and_then(|sandwich| sandwich.covariance_of_all());
            let statistic = covariance.and_then(|c| wald(minimum.x.as_slice(), &c, &columns, extra));
            return Ok(statistic.map(|statistic| judged(statistic, statistic, TestKind::Wald)));
        }
        // with the weights of the larger model, in which the smaller one is contained
        let slice = Slice::new(search, free, minimum.bounds.clone(), &minimum.whitening).with_equal(&columns);
        let from = |column: &usize| {
            let value = minimum.x[*column];
            let held: Vec<(usize, f64)> = others.iter().map(|other| (*other, value)).collect();
            let mut start = minimum.x.clone();
            start[*first] = value;
            Some(slice.at(&held, &start)?.1)
        };
        let Some(same) = columns.iter().filter_map(from).min_by(f64::total_cmp) else { return Ok(None) };
        let rise = (2.0 * (same - minimum.cost)).max(0.0);
        let n = search.observations() as f64;
        // Gaussian noise of unknown size: n ln of the ratio of the sums of squares
        let estimates_noise = !estimated.is_empty();
        let gain = if estimates_noise { n * (0.5 * rise / minimum.cost).ln_1p() } else { rise };
        Ok(Some(judged(gain, rise, TestKind::LikelihoodRatio)))
    }

    /// The fit with a value of a parameter for each label.
    fn apart(&self, parameter: Parameter) -> Result<Settled<'a>, CompareError> {
        let settled = &self.informed.settled;
        let search = Search {
            samples: self.informed.places.iter().map(|i| self.before.samples[*i].clone()).collect(),
            ..self.before.clone()
        };
        let label = |i: usize| self.groups[self.informed.places[i]].label;
        let search = search.with(|i, sample| sample.numbers[parameter as usize] = label(i));
        let there = settled.minimum.values.clone();
        if parameter == Parameter::Mu && !search.is_filmed() {
            // a friction of its own may lie elsewhere
            let found = Settled::near_starts(&search, &[])?;
            if found.objective <= settled.objective {
                return Ok(found);
            }
        }
        Ok(Settled::near_starts(&search, &[there])?)
    }
}

/// Whether the value of a column is known to less than its bounds leave open.
fn is_known(minimum: &Minimum, covariance: &DMatrix<f64>, column: usize) -> bool {
    let Bounds { lower, upper } = &minimum.bounds;
    covariance[(column, column)].sqrt() < upper[column] - lower[column]
}
