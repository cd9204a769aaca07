//! Whether a sample refutes the model: differences and their errors hold only if the model does.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::findings::Finding;
use super::quantity::Quantity;
use super::result::Comparison;
use crate::fit::Refuted;

/// Takes errors, differences and tests away if the residuals of a sample or of all refute the model by
/// the errors that are stated. The sliding friction of the cloth, from the paths after the impacts, stays.
pub(super) fn judge(comparison: &mut Comparison) {
    if comparison.noise_estimated || comparison.robust.is_some() {
        return;
    }
    let reduced_chi2 = comparison.chi2 / comparison.dof.max(1) as f64;
    let of_sample = |sample: usize| {
        let own = comparison.residuals.iter().filter(|residual| residual.sample == sample);
        let squares: Vec<f64> = own.map(|residual| residual.of_shot.standardized.powi(2)).collect();
        // a sample takes up few of the parameters, of many observations
        let (chi2, count) = (squares.iter().sum::<f64>(), squares.len());
        refutes(chi2, count).then(|| (sample, chi2 / count as f64))
    };
    let samples: Vec<(usize, f64)> = (0..comparison.samples.len()).filter_map(of_sample).collect();
    if samples.is_empty() && !refutes(comparison.chi2, comparison.dof) {
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

fn refutes(chi2: f64, dof: usize) -> bool {
    let dof = dof.max(1) as f64;
    let p_value = ChiSquared::new(dof).map_or(1.0, |distribution| distribution.sf(chi2));
    Refuted::is(p_value, chi2 / dof)
}
