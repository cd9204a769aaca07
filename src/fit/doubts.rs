//! Why the errors of a fit may not be what they seem, in sentences: errors below what is possible, other minima, and
//! active bounds.

use super::estimates::Rival;
use super::{Estimate, Fit, Method, Status};
use crate::measurement::number::plain;
use crate::measurement::parameter::Parameter;

/// Two stages know how high the balls jump from what a first fit of the same shots says of μ. On rough footage, whose frames
/// hardly show it, that counts the same shots twice, and errors come out below what the frames can tell at best: each such
/// parameter with its error and the least that is possible.
pub(super) fn below_bound(fit: &Fit) -> Vec<(Parameter, f64, f64)> {
    /// Of the bound. In two stages errors are 1.06 of it at 1000 frames/s and 0.1 mm, and 0.91 at 240 frames/s and 0.5 mm, where
    /// their standardized errors have a root mean square of 1.4.
    const BELOW: f64 = 0.97;
    let Some(bound) = fit.diagnostics.bound.as_ref().filter(|_| fit.method == Method::TwoStage) else {
        return Vec::new();
    };
    let below = |(parameter, least): &(Parameter, f64)| {
        let error = fit.estimates.iter().find(|e| e.parameter == *parameter)?.std_error?;
        (error < BELOW * least).then_some((*parameter, error, *least))
    };
    bound.std_errors.iter().filter_map(below).collect()
}

/// Says so.
pub(super) fn add_below_bound(fit: &mut Fit) {
    let below: Vec<String> = below_bound(fit)
        .into_iter()
        .map(|(parameter, error, least)| {
            format!("{} ± {error:.2e}, where the frames tell ± {least:.2e} at best", parameter.symbol())
        })
        .collect();
    if !below.is_empty() {
        fit.warnings.push(format!(
            "The errors stated are too small ({}): this footage is too rough for two stages. Its frames hardly show how high the \
             balls jump, and what a first fit of the same shots says of it is counted twice. Fit all frames with --method joint.",
            below.join("; ")
        ));
    }
}

/// Other minima that fit nearly as well, with how much higher what is minimised is there.
pub(super) fn add_rivals(fit: &mut Fit, rivals: &[Rival]) {
    for Rival { values, higher, is_included } in rivals {
        let is_estimated = |(p, _): &&(Parameter, f64)| {
            fit.get(*p).is_some_and(|estimate| estimate.status != Status::NotIdentified)
        };
        let there: Vec<String> = values
            .iter()
            .filter(is_estimated)
            .map(|(parameter, value)| format!("{} = {value:.4}", parameter.symbol()))
            .collect();
        if there.is_empty() {
            continue;
        }
        fit.diagnostics.has_rival = true;
        fit.warnings.push(format!(
            "A second solution ({}) fits nearly as well (χ² is higher by {higher:.1}): the 95 % intervals {}.",
            there.join(", "),
            if *is_included { "include it" } else { "do not include it" }
        ));
    }
}

/// Releasing a bound is worth saying when it makes an error this many times as large.
const WORTH_SAYING: f64 = 2.0;

/// Of an estimate that ends at one of its bounds: which, and how far it may be from there, to so many digits.
pub(super) fn bound_and_limit(estimate: &Estimate, digits: usize) -> Option<(&'static str, Option<String>)> {
    let (side, word, end) = match estimate.status {
        Status::AtLowerBound => ("lower", "at most", 1),
        Status::AtUpperBound => ("upper", "at least", 0),
        _ => return None,
    };
    Some((side, estimate.interval_95.map(|ends| format!("{word} {}", plain(ends[end], digits)))))
}

/// A parameter that is known much less where others are not exactly at their bounds.
pub(super) struct Hidden {
    pub parameter: Parameter,
    /// Its standard error, and what that would be if the conditions held.
    pub errors: [f64; 2],
    pub conditions: Vec<String>,
    /// Which others are involved.
    pub others: Vec<&'static str>,
}

/// All of them.
pub(super) fn hidden_by_bounds(fit: &Fit) -> impl Iterator<Item = Hidden> {
    fit.estimates.iter().filter_map(|estimate| {
        let errors @ [released, conditional] = [estimate.std_error?, estimate.std_error_at_bound?];
        let (conditions, others) = active_bounds(fit);
        let hides = released >= WORTH_SAYING * conditional && !conditions.is_empty();
        hides.then_some(Hidden { parameter: estimate.parameter, errors, conditions, others })
    })
}

/// Returns the active bounds as conditions of a standard error, and the names of their parameters. With μ_s the data
/// determine only its product with μ.
fn active_bounds(fit: &Fit) -> (Vec<String>, Vec<&'static str>) {
    let is_at_bound = |status| matches!(status, Status::AtLowerBound | Status::AtUpperBound);
    let (mut conditions, mut others) = (Vec::new(), Vec::new());
    for bound in fit.estimates.iter().filter(|e| is_at_bound(e.status)) {
        conditions.push(format!("{} = {} holds", bound.parameter.symbol(), bound.value));
        others.push(if bound.parameter == Parameter::MuS { "μ·μ_s" } else { bound.parameter.symbol() });
    }
    (conditions, others)
}
