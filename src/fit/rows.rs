//! Residuals and noise of a fit, a row each.

use super::minimum::Minimum;
use super::noise::Group;
use super::samples::Search;
use super::{Noise, Residual};
use crate::likelihood::fitted::Fitted;
use crate::likelihood::prediction::difference;
use crate::likelihood::whitening::{EstimatedSd, covariance};

/// One row for each observation of a sample, whose shots have these names.
pub(crate) fn residual_rows<'n>(
    (search, number): (&Search, usize),
    name: impl Fn(usize) -> &'n String,
    at: &Minimum,
    groups: &[Group],
) -> Vec<Residual> {
    let sample = &search.samples[number];
    let (whitening, values) = (&at.whitening[number], &at.values[number]);
    let model = values.model(sample.model);
    let own = groups.iter().filter(|group| group.dataset == sample.dataset);
    let sds: EstimatedSd = own.map(|g| (g.observable, if g.is_known() { g.sd } else { f64::NAN })).collect();
    let mut rows = Vec::new();
    for (number, Fitted { index, plan, .. }) in sample.fitted.iter().enumerate() {
        let predicted = whitening.predict(number, plan, &model, &values.coefficients());
        let Ok(prediction) = predicted else { continue };
        let covariance = covariance(plan, &prediction, &sds);
        for (i, row) in plan.rows().iter().enumerate() {
            let sd = covariance[(i, i)].sqrt();
            let d = difference(row.observable, prediction.values[i], row.measured.value);
            rows.push(Residual {
                shot: name(*index).clone(),
                observable: row.observable,
                measured: row.measured.value,
                predicted: row.measured.value + d,
                sd,
                standardized: -d / sd,
                cut: plan.cut(),
                speed: plan.knows_speed().then_some(prediction.speed),
            });
        }
    }
    rows
}

/// One row for each observable.
pub(super) fn noise_rows(fitted: &[Fitted], residuals: &[Residual], groups: &[Group]) -> Vec<Noise> {
    let mut rows: Vec<Noise> = Vec::new();
    for measurement in fitted.iter().flat_map(|shot| shot.plan.rows()) {
        let observable = measurement.observable;
        if rows.iter().any(|row| row.observable == observable) {
            continue;
        }
        let own = residuals.iter().filter(|r| r.observable == observable);
        let (sum, count) =
            own.fold((0.0, 0), |(sum, count), r| (sum + (r.measured - r.predicted).powi(2), count + 1));
        let group = groups.iter().find(|g| g.observable == observable);
        rows.push(Noise {
            observable,
            count,
            rms: (sum / count as f64).sqrt(),
            estimated_sd: group.map(|g| if g.is_known() { g.sd } else { f64::NAN }),
            rounding: group.filter(|g| g.is_rounding()).map(|g| g.rounding),
        });
    }
    rows
}
