//! A fit against a stored one: what moved, and by how many standard errors. For regression tests of
//! simulators, of data that are kept, and of this program.

use super::content::Table;
use super::document::FitDocument;
use super::text;
use crate::fit::Fit;

/// By how much an estimate may move and still count as the same, in standard errors, of which the larger one counts; χ² in its own
/// standard deviation √(2·dof). Far below what matters in practice, far above the roundings of another machine.
pub const TOLERANCE: f64 = 0.01;

/// The same of an estimate without a standard error, as a fraction of it.
const RELATIVE: f64 = 1e-6;

/// A result that changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Moved {
    /// Which one: `mu`, `mu status`, `chi2`, …
    pub what: String,
    /// The stored value, as text.
    pub before: String,
    /// The present value, as text.
    pub now: String,
    /// By how many standard errors it moved, where it has one.
    pub standard_errors: Option<f64>,
}

/// The stored fit that belongs to a fit: of the same data set and label.
#[must_use]
pub fn find<'a>(fit: &Fit, stored: &'a [FitDocument]) -> Option<&'a FitDocument> {
    let label = fit.group.as_ref().map(|(_, label)| label.as_str());
    stored.iter().find(|stored| {
        stored.dataset == fit.dataset && stored.group.as_ref().map(|group| group.label.as_str()) == label
    })
}

/// What differs by more than a tolerance, which is that of [`TOLERANCE`]; in the order of the parameters, then χ² and the rest.
#[must_use]
pub fn moved(fit: &Fit, stored: &FitDocument, tolerance: f64) -> Vec<Moved> {
    let mut all = Vec::new();
    let mut compare = |what: &str, before: String, now: String, standard_errors| {
        if before != now {
            all.push(Moved { what: what.to_owned(), before, now, standard_errors });
        }
    };
    compare("fidelity", stored.fidelity.clone(), fit.fidelity.to_owned(), None);
    for estimate in &fit.estimates {
        let name = estimate.parameter.name();
        let Some(before) = stored.parameters.get(name) else {
            compare(name, "missing".to_owned(), estimate.value.to_string(), None);
            continue;
        };
        let status = estimate.status.name().to_owned();
        compare(&format!("{name} status"), before.status.clone(), status, None);
        let change = estimate.value - before.estimate;
        let error = before.std_error.into_iter().chain(estimate.std_error).fold(0.0, f64::max);
        let in_errors = (error > 0.0).then(|| change / error);
        let same = match in_errors {
            Some(errors) => errors.abs() <= tolerance,
            None => change.abs() <= RELATIVE * before.estimate.abs().max(estimate.value.abs()),
        };
        if !same {
            compare(name, before.estimate.to_string(), estimate.value.to_string(), in_errors);
        }
        // an interval that widens is a change even where the estimate stays
        let widened = match (before.std_error, estimate.std_error) {
            (Some(old), Some(new)) => (new / old - 1.0).abs() > tolerance,
            (old, new) => old.is_some() != new.is_some(),
        };
        if widened {
            let [old, new] = [before.std_error, estimate.std_error]
                .map(|error| error.map_or("none".to_owned(), |error| error.to_string()));
            compare(&format!("{name} std_error"), old, new, None);
        }
    }
    let chi2 = stored.chi2.unwrap_or(f64::NAN);
    let change = (fit.chi2 - chi2) / (2.0 * fit.dof.max(1) as f64).sqrt();
    if fit.chi2.is_finite() != chi2.is_finite() || change.abs() > tolerance {
        let change = Some(change).filter(|change| change.is_finite());
        compare("chi2", chi2.to_string(), fit.chi2.to_string(), change);
    }
    compare("dof", stored.dof.to_string(), fit.dof.to_string(), None);
    compare("shots_used", stored.shots_used.to_string(), fit.shots_used.to_string(), None);
    all
}

/// What moved as text: a row for each thing, with the title of its fit.
#[must_use]
pub fn table(moved: &[(String, Moved)]) -> String {
    let row = |(title, moved): &(String, Moved)| {
        let by = moved.standard_errors.map_or("–".to_owned(), |by| format!("{by:+.3} standard errors"));
        vec![title.clone(), moved.what.clone(), moved.before.clone(), moved.now.clone(), by]
    };
    let head = ["data set", "what", "baseline", "now", "moved by"];
    text::table(&Table::new(head, moved.iter().map(row)), "  ")
}
