//! μ_k of the cloths, which every data set tells by itself.

use nalgebra::{DMatrix, DVector};

use super::verdict::{Tests, wald};
use super::{Compared, Comparison, LikelihoodRatio, Quantity, Reason, TestKind, Value};
use crate::measurement::dataset::Dataset;

/// μ_k of each data set, where it is known, with the covariance of the errors.
pub(super) struct Known {
    pub values: Vec<Option<f64>>,
    pub covariance: DMatrix<f64>,
}

impl Known {
    /// As it was found shot by shot, when the impacts were.
    pub(super) fn of_impacts(datasets: &[&Dataset]) -> Self {
        let known = datasets.iter().map(|dataset| dataset.sliding.and_then(|m| Some((m.value, m.sd?))));
        let known: Vec<Option<(f64, f64)>> = known.collect();
        let variance = |of: &Option<(f64, f64)>| of.map_or(0.0, |(_, sd)| sd * sd);
        let variances = DVector::from_iterator(known.len(), known.iter().map(variance));
        Self {
            values: known.iter().map(|of| of.map(|(value, _)| value)).collect(),
            covariance: DMatrix::from_diagonal(&variances),
        }
    }

    /// The weight of each data set in the mean over some of them, by their errors; `None` where none is known.
    fn weights(&self, is_one: impl Fn(usize) -> bool) -> Option<DVector<f64>> {
        let weight = |i: usize| match self.values[i] {
            Some(_) if is_one(i) => self.covariance[(i, i)].recip(),
            _ => 0.0,
        };
        let weights = DVector::from_fn(self.values.len(), |i, _| weight(i));
        let total = weights.sum();
        (total > 0.0).then(|| weights / total)
    }

    /// A sum of these parts of the values, and its standard error.
    fn sum(&self, parts: &DVector<f64>) -> (f64, f64) {
        let terms = parts.iter().zip(&self.values).map(|(part, value)| part * value.unwrap_or(0.0));
        (terms.sum(), parts.dot(&(&self.covariance * parts)).sqrt())
    }
}

/// Values of data sets of one label are averaged by their errors.
pub(super) fn compare(
    known: &Known,
    (labels, label_of): (&[String], &[Option<usize>]),
    apart: bool,
    comparison: &mut Comparison,
) {
    let tests = Tests { dof: 0, estimated: false };
    let t = tests.quantile();
    let value = |label, (value, error): (f64, f64)| Value {
        label,
        value,
        std_error: Some(error),
        interval_95: Some([value - t * error, value + t * error]),
        fitted: true,
        at_bound: false,
    };
    let weights = |label: usize| known.weights(|i| label_of[i] == Some(label));
    let (mut telling, mut left_out) = (Vec::new(), Vec::new());
    for label in 0..labels.len() {
        match weights(label) {
            Some(weights) => telling.push((label, weights)),
            None => left_out.push((label, Reason::Independent)),
        }
    }
    if telling.is_empty() {
        return;
    }
    let mut differences = Vec::new();
    for (i, (first, a)) in telling.iter().enumerate() {
        for (second, b) in &telling[i + 1..] {
            let (value, error) = known.sum(&(b - a));
            differences.push(tests.pair(*first, *second, value, error));
        }
    }
    let columns: Vec<usize> = (0..telling.len()).collect();
    let extra = telling.len() - 1;
    let parts: Vec<DVector<f64>> = telling.iter().map(|(_, weights)| weights.clone()).collect();
    let parts = DMatrix::from_columns(&parts);
    let values: Vec<f64> = telling.iter().map(|(_, weights)| known.sum(weights).0).collect();
    let covariance = parts.tr_mul(&(&known.covariance * &parts));
    let statistic = wald(&values, &covariance, &columns, extra);
    let same_or_different = statistic.map(|statistic| LikelihoodRatio {
        statistic,
        extra_parameters: extra,
        p_value: tests.of_rise(statistic, extra),
        by: TestKind::LikelihoodRatio,
        delta_aic: 2.0 * extra as f64 - statistic,
    });
    let of_label = |(label, weights): &(usize, DVector<f64>)| value(Some(*label), known.sum(weights));
    comparison.quantities.push(Compared {
        quantity: Quantity::Sliding,
        shared: !apart,
        estimates: if apart {
            telling.iter().map(of_label).collect()
        } else {
            known.weights(|_| true).map(|all| value(None, known.sum(&all))).into_iter().collect()
        },
        differences: if apart { differences } else { Vec::new() },
        same_or_different,
        left_out,
    });
}
