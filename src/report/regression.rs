//! A fit against a stored one: what moved, and by how many standard errors. For regression tests of simulators, of data that are kept,
//! and of this program.

use super::content::Table;
use super::document::FitDocument;
use crate::fit::Fit;

/// By how much an estimate may move and still count as the same, in standard errors, of which the larger one counts; χ² in its own
/// standard deviation √(2·dof). Far below what matters in practice, far above the roundings of another machine.
pub const SAME_ERRORS: f64 = 0.01;

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

/// Returns the stored fit that belongs to a fit: of the same data set and label.
#[must_use]
pub fn find<'a>(fit: &Fit, stored: &'a [FitDocument]) -> Option<&'a FitDocument> {
    let label = fit.group.as_ref().map(|(_, label)| label);
    let is_same = |stored: &&FitDocument| {
        stored.dataset == fit.dataset && stored.group.as_ref().map(|group| &group.label) == label
    };
    stored.iter().find(is_same)
}

/// Returns what differs by more than a tolerance, which is that of [`SAME_ERRORS`]; in the order of the parameters, then χ² and the rest.
#[must_use]
pub fn moved(fit: &Fit, stored: &FitDocument, tolerance: f64) -> Vec<Moved> {
    /// The tolerance of an estimate without a standard error, as a fraction of it.
    const RELATIVE: f64 = 1e-6;
    let fit = FitDocument::new(fit);
    let mut all = Vec::new();
    let mut compare = |what: &str, [before, now]: [String; 2], standard_errors: Option<f64>| {
        if before != now {
            all.push(Moved { what: what.to_owned(), before, now, standard_errors });
        }
    };
    compare("fidelity", [stored.fidelity.clone(), fit.fidelity], None);
    for (name, now) in &fit.parameters {
        let Some(before) = stored.parameters.get(name) else {
            compare(name, ["missing".to_owned(), now.estimate.to_string()], None);
            continue;
        };
        compare(&format!("{name} status"), [before.status.clone(), now.status.clone()], None);
        let change = now.estimate - before.estimate;
        let error = before.std_error.into_iter().chain(now.std_error).fold(0.0, f64::max);
        let in_errors = (error > 0.0).then(|| change / error);
        let largest = before.estimate.abs().max(now.estimate.abs());
        let has_moved =
            in_errors.map_or(change.abs() > RELATIVE * largest, |errors| errors.abs() > tolerance);
        if has_moved {
            compare(name, [before, now].map(|own| own.estimate.to_string()), in_errors);
        }
        // an interval that widens is a change even where the estimate stays
        let widened = match [before.std_error, now.std_error] {
            [Some(old), Some(new)] => (new / old - 1.0).abs() > tolerance,
            [old, new] => old.is_some() != new.is_some(),
        };
        if widened {
            let text = |error: Option<f64>| error.map_or("none".to_owned(), |error| error.to_string());
            compare(&format!("{name} std_error"), [before, now].map(|own| text(own.std_error)), None);
        }
    }
    let [before, now] = [stored.chi2, fit.chi2].map(|chi2| chi2.unwrap_or(f64::NAN));
    let change = (now - before) / (2.0 * fit.dof.max(1) as f64).sqrt();
    if now.is_finite() != before.is_finite() || change.abs() > tolerance {
        let moved = Some(change).filter(|change| change.is_finite());
        compare("chi2", [before, now].map(|chi2| chi2.to_string()), moved);
    }
    compare("dof", [stored.dof, fit.dof].map(|dof| dof.to_string()), None);
    compare("shots_used", [stored.shots_used, fit.shots_used].map(|shots| shots.to_string()), None);
    all
}

/// Returns what moved as text: a row for each thing, with the title of its fit.
#[must_use]
pub fn table(moved: &[(String, Moved)]) -> String {
    let row = |(title, moved): &(String, Moved)| {
        let by = moved.standard_errors.map_or("–".to_owned(), |by| format!("{by:+.3} standard errors"));
        vec![title.clone(), moved.what.clone(), moved.before.clone(), moved.now.clone(), by]
    };
    Table::new(["data set", "what", "baseline", "now", "moved by"], moved.iter().map(row)).text("  ")
}
