//! One fit in words, for the terminal.

use std::fmt::Write;

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::number::{interval, plain, with_error};
use super::table::{aligned, chi2_text, estimate};
use super::trust::sections;
use super::{bodies, model, noise_estimated, reduced_chi2, title};
use crate::fit::{Estimate, Fit, Noise, Status};
use crate::parameters::Parameter;

/// What must not be overlooked of several fits, a line each.
#[must_use]
pub fn warnings(fits: &[Fit]) -> String {
    let mut text = String::new();
    for fit in fits {
        for warning in &fit.warnings {
            push(&mut text, &format!("{}: {warning}", title(fit)));
        }
    }
    if text.is_empty() { text } else { format!("\n{text}") }
}

/// The fit with what each number means: warnings, estimates, correlations, noise, shots.
#[must_use]
pub fn render(fit: &Fit) -> String {
    let mut text = title(fit);
    text.push('\n');
    for (name, value) in [("cloth", &fit.cloth), ("source", &fit.source)] {
        if let Some(value) = value {
            push(&mut text, &format!("  {name}: {value}"));
        }
    }
    if fit.discs.is_some() {
        push(&mut text, &format!("  discs: {}", bodies(fit).1));
    }
    push(&mut text, &format!("  model: {}", model(fit)));
    if !fit.converged {
        push(&mut text, &format!("\nNOT CONVERGED: {}", fit.termination));
    }
    if !fit.warnings.is_empty() {
        text.push('\n');
    }
    for warning in &fit.warnings {
        push(&mut text, &format!("Warning: {warning}"));
    }
    let profiled = fit.estimates.iter().any(Estimate::is_profiled);
    let how =
        if profiled { " (profile: where χ², least over the others, is t² above its minimum)" } else { "" };
    let has_unit = fit.estimates.iter().any(|estimate| estimate.parameter == Parameter::C);
    let unit = if has_unit { "no unit, but c in s/m" } else { "no unit" };
    let errors = if fit.refuted.is_some() { "" } else { ", ± one standard error, 95 % interval" };
    push(&mut text, &format!("\nParameters ({unit}){errors}{how}"));
    text.push_str(&aligned(&fit.estimates.iter().map(|e| parameter(fit, e)).collect::<Vec<_>>(), "  "));
    for line in fit.estimates.iter().filter_map(at_bound) {
        push(&mut text, &line);
    }
    text.push_str(&correlations(fit));
    push(&mut text, &format!("\n{}", goodness(fit)));
    if !fit.noise.is_empty() {
        push(&mut text, "\nNoise of one observation, and root mean square (rms) of the residuals");
        text.push_str(&aligned(&fit.noise.iter().map(noise).collect::<Vec<_>>(), "  "));
    }
    for (title, lines) in sections(fit) {
        push(&mut text, &format!("\n{title}"));
        for line in &lines {
            push(&mut text, &format!("  {line}"));
        }
    }
    push(&mut text, &format!("\nShots: {} used, {} rejected", fit.shots_used, fit.shots_rejected.len()));
    for rejected in &fit.shots_rejected {
        push(&mut text, &format!("  shot {}: {}", rejected.shot, rejected.reason));
    }
    for note in &fit.notes {
        push(&mut text, &format!("Note: {note}"));
    }
    let iterations = if fit.iterations == 1 { "iteration" } else { "iterations" };
    push(
        &mut text,
        &format!(
            "\nStopped after {} {iterations}, {} s: {}",
            fit.iterations,
            plain(fit.seconds, 2),
            fit.termination
        ),
    );
    text
}

fn push(text: &mut String, line: &str) {
    // Writing into a String cannot fail.
    let _ = writeln!(text, "{line}");
}

fn parameter(fit: &Fit, parameter: &Estimate) -> Vec<String> {
    let interval = match parameter.interval_95 {
        Some(ends) if ends.iter().all(|end| end.is_finite()) => {
            let how = if parameter.is_profiled() { " profile" } else { "" };
            interval(ends, parameter.std_error) + how
        }
        _ => String::new(),
    };
    let value = match parameter.status {
        Status::NotIdentified => {
            format!("{}, left at {}", estimate(fit, parameter), plain(parameter.value, 4))
        }
        _ => estimate(fit, parameter),
    };
    vec![parameter.parameter.symbol().to_owned(), value, interval, parameter.parameter.meaning().to_owned()]
}

fn at_bound(estimate: &Estimate) -> Option<String> {
    let error = estimate.std_error_at_bound.filter(|error| error.is_finite())?;
    Some(format!(
        "  {}: {} if the parameters at their bounds are truly there",
        estimate.parameter.symbol(),
        with_error(estimate.value, error)
    ))
}

/// One line, of the pairs that have a correlation.
fn correlations(fit: &Fit) -> String {
    let mut pairs = Vec::new();
    for (row, first) in fit.estimates.iter().enumerate() {
        for (column, second) in fit.estimates.iter().enumerate().skip(row + 1) {
            if let Some(value) = fit.correlation.get((row, column)).filter(|value| value.is_finite()) {
                let [first, second] = [first, second].map(|estimate| estimate.parameter.symbol());
                pairs.push(format!("{first} and {second} {value:+.3}"));
            }
        }
    }
    if pairs.is_empty() {
        String::new()
    } else {
        format!("\nCorrelation of the errors, −1 to 1: {}\n", pairs.join(", "))
    }
}

/// χ² and what it says about model and noise.
fn goodness(fit: &Fit) -> String {
    let Some(reduced) = reduced_chi2(fit) else {
        return "χ²: no degrees of freedom; the fit passes through the data and cannot be tested".to_owned();
    };
    let mut text = format!(
        "χ² = {} for {} degrees of freedom, χ²/dof = {}",
        plain(fit.chi2, 4),
        fit.dof,
        chi2_text(reduced)
    );
    if noise_estimated(fit) {
        text.push_str(": near 1 whatever the model, as noise was estimated from these residuals");
    } else if let Some(p) = exceedance(fit) {
        let p = if p < 1e-4 { "below 0.0001".to_owned() } else { plain(p, 2) };
        text.push_str(&format!(
            "; were model and noise right, chance would give a larger χ² with probability {p}"
        ));
    }
    text
}

/// Probability of a larger χ².
fn exceedance(fit: &Fit) -> Option<f64> {
    let valid = fit.chi2.is_finite() && fit.chi2 >= 0.0;
    let distribution = ChiSquared::new(fit.dof as f64).ok()?;
    valid.then(|| distribution.sf(fit.chi2)).filter(|p| p.is_finite())
}

fn noise(noise: &Noise) -> Vec<String> {
    let observable = noise.observable;
    let unit = observable.unit();
    let quantity = |si: f64| {
        let space = if unit == "°" || unit.is_empty() { "" } else { " " };
        format!("{}{space}{unit}", plain(si / observable.unit_si(), 3))
    };
    let sd = match noise.estimated_sd {
        Some(sd) => format!("sd {} estimated from the residuals", quantity(sd)),
        None => "sd given with the data".to_owned(),
    };
    let values = if noise.count == 1 { "value" } else { "values" };
    vec![
        observable.label().to_owned(),
        format!("{} {values}", noise.count),
        sd,
        format!("rms {}", quantity(noise.rms)),
    ]
}
