//! Whether one of the samples refutes the model: differences and their errors hold only if the model does.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{Comparison, Finding, Quantity, SampleSummary};
use crate::fit::Refuted;

/// Takes errors, differences and tests away where the residuals of the whole or of a sample refute the model. The cloth's
/// sliding friction, from the paths after the impacts, stays.
pub(super) fn judge(comparison: &mut Comparison, samples: &[SampleSummary], tested: (f64, usize)) {
    if comparison.noise_estimated || comparison.robust.is_some() {
        return;
    }
    let (chi2, dof) = tested;
    let mut named = Vec::new();
    for number in 0..samples.len() {
        let own = comparison.residuals.iter().filter(|residual| residual.sample == number);
        let squares: Vec<f64> = own.map(|residual| residual.of_shot.standardized.powi(2)).collect();
        // how many of the parameters a sample takes up is not told: few, of many observations
        if let Some(reduced) = refutes(squares.iter().sum(), squares.len()) {
            named.push((number, reduced));
        }
    }
    if named.is_empty() && refutes(chi2, dof).is_none() {
        return;
    }
    let by_model = |quantity: Quantity| quantity != Quantity::Sliding;
    for compared in comparison.quantities.iter_mut().filter(|compared| by_model(compared.quantity)) {
        for value in &mut compared.estimates {
            (value.std_error, value.interval_95) = (None, None);
        }
        compared.differences.clear();
        compared.same_or_different = None;
    }
    let reduced_chi2 = chi2 / dof.max(1) as f64;
    comparison.findings.insert(0, Finding::Refuted { samples: named, reduced_chi2 });
}

/// χ² per degree of freedom, where it refutes the model.
fn refutes(chi2: f64, dof: usize) -> Option<f64> {
    let dof = dof.max(1) as f64;
    let p_value = ChiSquared::new(dof).map_or(1.0, |distribution| distribution.sf(chi2));
    Refuted::is(p_value, chi2 / dof).then_some(chi2 / dof)
}
