//! μ_k of the cloths, which every shot tells by itself.

use super::verdict::Tests;
use super::{Compared, Comparison, LikelihoodRatio, Quantity, TestKind, Value};
use crate::measurement::dataset::Measured;

/// μ_k is found shot by shot, when the impacts are, or with all frames: values of data sets of one label are averaged by their
/// errors, and differences are of independent numbers.
pub(super) fn compare(
    known: &[Option<Measured>],
    (labels, label_of): (&[String], &[Option<usize>]),
    apart: bool,
    comparison: &mut Comparison,
) {
    let mean = |known: Vec<Measured>| {
        let weight = |m: &Measured| m.sd.map_or(0.0, |sd| sd.powi(-2));
        let total: f64 = known.iter().map(weight).sum();
        let value = known.iter().map(|m| m.value * weight(m)).sum::<f64>() / total;
        (total > 0.0).then(|| (value, total.powf(-0.5)))
    };
    let of = |label: Option<usize>| {
        let own = known.iter().zip(label_of).filter(|(_, own)| label.is_none() || **own == label);
        mean(own.filter_map(|(known, _)| *known).collect())
    };
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
    let each: Vec<Option<(f64, f64)>> = (0..labels.len()).map(|label| of(Some(label))).collect();
    if each.iter().all(Option::is_none) {
        return;
    }
    let telling: Vec<(usize, f64, f64)> =
        each.iter().enumerate().filter_map(|(label, of)| of.map(|(value, sd)| (label, value, sd))).collect();
    let mut differences = Vec::new();
    for (i, a) in telling.iter().enumerate() {
        for b in &telling[i + 1..] {
            differences.push(tests.pair(a.0, b.0, b.1 - a.1, a.2.hypot(b.2)));
        }
    }
    let same_or_different = (telling.len() > 1).then(|| {
        let (mean, _) = of(None).unwrap_or((f64::NAN, f64::NAN));
        let statistic = telling.iter().map(|(_, value, sd)| ((value - mean) / sd).powi(2)).sum();
        let extra = telling.len() - 1;
        LikelihoodRatio {
            statistic,
            extra_parameters: extra,
            p_value: tests.of_rise(statistic, extra),
            by: TestKind::LikelihoodRatio,
            delta_aic: 2.0 * extra as f64 - statistic,
        }
    });
    let left_out = each.iter().enumerate().filter(|(_, of)| of.is_none());
    let left_out = left_out.map(|(label, _)| {
        (label, "it has no paths after the impacts that tell it: only footage does".to_string())
    });
    comparison.quantities.push(Compared {
        quantity: Quantity::Sliding,
        shared: !apart,
        estimates: if apart {
            telling.iter().map(|(label, v, sd)| value(Some(*label), (*v, *sd))).collect()
        } else {
            of(None).map(|mean| value(None, mean)).into_iter().collect()
        },
        differences: if apart { differences } else { Vec::new() },
        same_or_different,
        left_out: left_out.collect(),
    });
}
