//! What a reader must know about a fit, in sentences.

use super::check;
use super::check::capital;
use super::{DOWN_WEIGHTED, Estimate, Fit, NoiseVerdict, Plateau, Rejected, Status};
use crate::measurement::dataset::{Dataset, ON_REQUEST, Shot};
use crate::measurement::number::plain;
use crate::measurement::parameter::Parameter;

/// What is said of a fit: what the reader must know, and may want to know.
#[derive(Default)]
struct Said {
    warnings: Vec<String>,
    notes: Vec<String>,
}

/// Adds what a fit says of itself.
pub(super) fn add(fit: &mut Fit, topspin: bool, knows_noise: bool) {
    let mut said = Said::default();
    said.shots(fit, knows_noise);
    said.estimates(fit, topspin);
    said.released_bounds(fit);
    said.noise(fit);
    said.residuals(fit);
    said.search(fit);
    if let Some(refuted) = &fit.refuted {
        let measured =
            refuted.restitution.map_or(String::new(), |measured| format!(" {}", measured.sentence()));
        said.warnings.insert(0, refuted.sentence() + &measured);
    }
    fit.warnings.extend(said.warnings);
    fit.notes.extend(said.notes);
}

impl Said {
    /// Whether the fit stands, and on which shots.
    fn shots(&mut self, fit: &Fit, knows_noise: bool) {
        if !fit.converged {
            self.warnings.push(format!("The fit did not converge: {}.", fit.termination));
        }
        if !knows_noise {
            let why = if fit.is_met_exactly() {
                "every reading is met exactly: nothing is left of which an error could be told"
            } else {
                "the data state no standard deviations and leave no degrees of freedom to estimate them"
            };
            self.warnings.push(format!("No errors: {why}."));
        }
        // what was asked for is no warning
        let (on_request, others): (Vec<&Rejected>, Vec<&Rejected>) =
            fit.shots_rejected.iter().partition(|shot| shot.reason == ON_REQUEST);
        if let [first, ..] = others[..] {
            self.warnings.push(format!(
                "{} of {} shots were not used; the first is shot {}: {}.",
                others.len(),
                others.len() + fit.shots_used,
                first.shot,
                first.reason
            ));
        }
        if !on_request.is_empty() {
            let of = on_request.len() + others.len() + fit.shots_used;
            self.notes.push(format!("{} of {of} shots were left out on request.", on_request.len()));
        }
        self.warnings.extend(doubtful_shots(fit));
    }

    /// What the data do not determine, and what ends on a bound.
    fn estimates(&mut self, fit: &Fit, topspin: bool) {
        let worst = fit.diagnostics.identifiability.as_ref().and_then(|found| found.worst.as_ref());
        let undetermined = worst.is_some_and(|worst| worst.undetermined);
        if let Some(worst) = worst.filter(|worst| worst.weak) {
            let mut sentence = format!("{}.", capital(&worst.words));
            if undetermined {
                let names: Vec<_> = worst.terms.iter().map(|(p, _)| p.symbol()).collect();
                sentence += &format!(
                    " The values given for {} are some of many that fit equally; fix all but one of them.",
                    names.join(" and ")
                );
            }
            self.warnings.push(sentence);
        }
        for estimate in &fit.estimates {
            let symbol = estimate.parameter.symbol();
            match estimate.status {
                Status::NotIdentified if estimate.parameter == Parameter::MuS && !topspin => self.notes.push(format!(
                    "μ_s is not identified: no shot has topspin, so the cloth never carries the object ball. It was \
                     left at {}.",
                    plain(estimate.value, 3)
                )),
                Status::NotIdentified if !undetermined => self.notes.push(format!(
                    "{symbol} is not identified: no observation depends on it. It was left at {}.",
                    plain(estimate.value, 3)
                )),
                _ => {
                    if let Some((side, limit)) = bound_and_limit(estimate, 3) {
                        let limit = limit.map_or(String::new(), |limit| format!(", and is {limit} at 95 % confidence"));
                        self.warnings.push(format!("{symbol} ends on its {side} bound {}{limit}.", estimate.value));
                    }
                }
            }
        }
    }

    /// Parameters that are known much less where another is not exactly at its bound.
    fn released_bounds(&mut self, fit: &Fit) {
        for Hidden { parameter, errors: [released, conditional], conditions, others } in hidden_by_bounds(fit)
        {
            let symbol = parameter.symbol();
            let from =
                if others.is_empty() { String::new() } else { format!(" from {}", others.join(" and ")) };
            self.warnings.push(format!(
                "These data hardly tell {symbol}{from}: {symbol} is ± {conditional:.2e} if {} exactly, but \
                 ± {released:.2e} ({:.0} times as much) if not.",
                conditions.join(" and "),
                released / conditional
            ));
        }
    }

    /// Standard deviations that were estimated.
    fn noise(&mut self, fit: &Fit) {
        let mut estimated: Vec<(String, Vec<&str>)> = Vec::new();
        let mut rounded: Vec<&str> = Vec::new();
        for noise in &fit.noise {
            let Some(sd) = noise.estimated_sd.filter(|sd| sd.is_finite()) else { continue };
            let sd = noise.in_words(sd, 3);
            match estimated.iter_mut().find(|(known, _)| *known == sd) {
                Some((_, labels)) => labels.push(noise.observable.label()),
                None => estimated.push((sd, vec![noise.observable.label()])),
            }
            rounded.extend(noise.rounding.map(|_| noise.observable.label()));
        }
        if !estimated.is_empty() {
            let estimated: Vec<String> =
                estimated.into_iter().map(|(sd, labels)| format!("{sd} of {}", labels.join(", "))).collect();
            self.notes.push(format!(
                "The data state no standard deviations: they were estimated from the residuals, one for all observables of a unit unless \
                 these are not equally good ({}). χ² then says nothing about the quality of the fit.",
                estimated.join("; ")
            ));
        }
        if !rounded.is_empty() {
            self.notes.push(format!(
                "The readings of {} are rounded to more than the residuals show: their noise is taken as that of rounding, a step over √12.",
                rounded.join(", ")
            ));
        }
    }

    /// What the residuals say of the model and of single shots.
    fn residuals(&mut self, fit: &Fit) {
        if let Some(goodness) = &fit.diagnostics.goodness {
            // of the velocities, also where frames were fitted
            let reduced = goodness.noise_factor.map_or(f64::NAN, |factor| factor * factor);
            match (goodness.noise, goodness.p_value) {
                // said first, below
                (NoiseVerdict::TooSmall, _) if fit.refuted.is_some() => {}
                (NoiseVerdict::TooSmall, Some(p)) => self.warnings.push(format!(
                    "The residuals are larger than the stated standard deviations explain (χ²/dof = {reduced:.2}, \
                     probability {p:.1e}): the model leaves something out, or the deviations are too small. The \
                     errors below trust the stated deviations."
                )),
                (NoiseVerdict::TooLarge, _) => self.warnings.push(format!(
                    "The residuals are smaller than the stated standard deviations (χ²/dof = {reduced:.2}): the \
                     deviations, and the errors below, are too large."
                )),
                _ => {}
            }
            // what explains the residuals says more than how they run
            let unexplained = fit.explanations.is_empty();
            for trend in goodness.trends.iter().filter(|trend| trend.significant && unexplained) {
                self.warnings.push(format!("{}.", capital(&trend.words)));
            }
            let influential = goodness.influence.iter();
            let influential: Vec<&str> = influential
                .filter(|shot| goodness.influential_from.is_some_and(|from| shot.cook > from))
                .map(|shot| shot.shot.as_str())
                .collect();
            match influential[..] {
                [] => {}
                [shot] => self.notes.push(format!(
                    "Shot {shot} alone moves the estimates much (Cook's distance); look at whether it can be trusted."
                )),
                [first, ..] => self.notes.push(format!(
                    "{} shots each move the estimates much (Cook's distance), first shot {first}; look at whether they \
                     can be trusted.",
                    influential.len()
                )),
            }
        }
    }

    /// Robust weights, and other minima.
    fn search(&mut self, fit: &Fit) {
        if let Some(robust) = &fit.diagnostics.robust {
            let clear: Vec<_> = robust.weights.iter().filter(|(_, weight)| *weight < DOWN_WEIGHTED).collect();
            self.notes.push(format!(
                "Outlying shots count less ({} loss); {} of {} have a weight below {DOWN_WEIGHTED}. χ² is weighted, and \
                 the errors are honest ones from the scatter of the shots (sandwich), whatever their noise.",
                robust.loss.name(),
                clear.len(),
                fit.shots_used
            ));
        }
        if fit.estimates.iter().any(|estimate| estimate.includes_other_minimum) {
            self.warnings
                .push("A second solution fits nearly as well: the 95 % intervals include it.".to_owned());
        }
    }
}

/// Shots that were used, though something about them is wrong.
fn doubtful_shots(fit: &Fit) -> Option<String> {
    let first = fit.shots_doubtful.first()?;
    let rest = match fit.shots_doubtful.len() - 1 {
        0 => String::new(),
        rest => format!(" {rest} more shots are doubtful; fit.json and the report list them."),
    };
    Some(format!(
        "Shot {} is doubtful, but was used: {}.{rest} To leave a shot out, set skip = true in the table that [tracks] shots names.",
        first.shot, first.reason
    ))
}

/// Parameters that are known only to lie on a plateau.
pub(super) fn add_plateaus(fit: &mut Fit, plateaus: &[Plateau]) {
    fit.diagnostics.plateaus = plateaus.to_vec();
    for Plateau { parameter, edge, bound } in plateaus {
        let symbol = parameter.symbol();
        let why = match parameter {
            Parameter::Mu => " (the contact then sticks)",
            _ => "",
        };
        fit.warnings.push(format!(
            "{symbol}: every value from {edge:.4} to the bound {bound} fits equally{why}; {edge:.4} is given."
        ));
    }
}

/// What the tracks told besides the parameters, and what was done to them on reading.
pub(super) fn add_tracks(fit: &mut Fit, dataset: &Dataset, shots: &[&Shot]) {
    // first, since what else is wrong may follow from it
    let suspicious = check::suspicious(dataset, shots, [dataset.sliding, dataset.rolling]);
    fit.warnings.splice(0..0, check::warnings(&suspicious, shots.len()));
    fit.diagnostics.suspicious = suspicious;
    fit.notes.extend(dataset.notes().cloned());
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
