//! Everything that lets doubt a fit, as a list, whose severities make the verdict.

use std::cmp::Reverse;
use std::collections::HashSet;

use super::check::{self, capital};
use super::{Fit, Noise, NoiseVerdict, Rejected, Status, Trend, film_words};
use crate::measurement::dataset::ON_REQUEST;
use crate::measurement::number::{count_of, plain, with_error};
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;
use crate::problem::{Finding, Policy, Severity, refutes};

/// Part of all shots: with fewer used, those that were left out may be the rule.
const FEW_USED: f64 = 0.6;

/// Part of the shots beyond which a fault is systematic.
const MANY_SUSPICIOUS: f64 = 0.5;

/// Noise whose correlation from frame to frame is above this is that of a filter: trackers that
/// follow a ball by themselves stay below.
const SMOOTHED: f64 = 0.93;

/// Ratio of a standard error to the one with other parameters exactly at their bounds, from which
/// on it is said.
const WORTH_SAYING: f64 = 2.0;

/// Part of the rounding of the readings; without one, in rad, m/s, rad/s or as a ratio: smaller
/// residuals are rounding of the search.
const MIN_RESIDUAL: f64 = 1e-6;

/// Something to know of a fit.
#[derive(Clone, Debug)]
pub(crate) struct Remark {
    pub(crate) about: About,
    /// How far it affects the trust in the fit.
    pub(crate) severity: Severity,
    pub(crate) sentence: String,
}

/// The subject of a remark, as data.
#[derive(Clone, Debug)]
pub(crate) enum About {
    Found(Finding),
    /// The kind of what follows from the results.
    Kind(&'static str),
}

impl Remark {
    pub(super) fn new(severity: Severity, kind: &'static str, sentence: String) -> Self {
        Self { about: About::Kind(kind), severity, sentence }
    }
}

fn unusable(kind: &'static str) -> impl Fn(String) -> Remark {
    move |sentence| Remark::new(Severity::Unusable, kind, sentence)
}

fn doubtful(kind: &'static str) -> impl Fn(String) -> Remark {
    move |sentence| Remark::new(Severity::Doubtful, kind, sentence)
}

fn warning(kind: &'static str) -> impl Fn(String) -> Remark {
    move |sentence| Remark::new(Severity::Warning, kind, sentence)
}

impl Fit {
    /// Returns what a reader must know, in sentences, the most important first.
    pub fn warnings(&self) -> Vec<&str> {
        self.said(|severity| severity > Severity::Note)
    }

    /// Returns what else a reader may want to know, in sentences.
    pub fn notes(&self) -> Vec<&str> {
        self.said(|severity| severity == Severity::Note)
    }

    fn said(&self, wanted: impl Fn(Severity) -> bool) -> Vec<&str> {
        let wanted = self.remarks.iter().filter(|remark| wanted(remark.severity));
        wanted.map(|remark| remark.sentence.as_str()).collect()
    }

    /// Returns everything that lets doubt the fit, the most harmful first.
    pub(super) fn doubts(&self) -> Vec<Remark> {
        let findings = self.solution.findings.iter().filter(|finding| finding.severity() > Severity::Note);
        // conflicts with what is stated may come from wrong footage
        let (conflicts, others): (Vec<&Finding>, Vec<&Finding>) =
            findings.partition(|finding| matches!(finding, Finding::Conflict { .. }));
        let remark = |finding| film_words::remark(finding, self.frames.as_ref());
        let mut all: Vec<Remark> = others.into_iter().filter_map(remark).collect();
        all.extend(self.wrong_footage().map(doubtful("suspicious-footage")));
        all.extend(conflicts.into_iter().filter_map(remark));
        all.extend(self.unfinished().map(unusable("not-converged")));
        all.extend(self.nothing_determined().map(unusable("undetermined")));
        let suspicious = check::warnings(&self.diagnostics.suspicious, self.shots_used);
        all.extend(suspicious.into_iter().map(warning("suspicious-shot")));
        all.extend(self.not_used());
        all.extend(self.unexplained());
        all.extend(self.refuted_contact().map(doubtful("refuted-contact")));
        all.extend(self.refuted_friction().map(doubtful("refuted-friction")));
        all.extend(self.unknown_errors());
        all.extend(self.undetermined().into_iter().map(doubtful("undetermined")));
        all.extend(self.few_shots().map(doubtful("few-shots")));
        if self.diagnostics.has_rival {
            let sentence = "Other values fit nearly as well: more shots, or a prior, decide between them.";
            all.push(doubtful("rival-minimum")(sentence.to_owned()));
        }
        all.extend(self.hidden_by_bounds().into_iter().map(warning("undetermined")));
        all.extend(self.changing_residuals());
        all.sort_by_key(|remark| Reverse(remark.severity));
        let mut known = HashSet::new();
        all.retain(|remark| known.insert(remark.sentence.clone()));
        all
    }

    fn unfinished(&self) -> Option<String> {
        (!self.converged).then(|| {
            format!(
                "The search for the best values came to no end ({}): fix parameters under [fit].",
                self.termination
            )
        })
    }

    fn nothing_determined(&self) -> Option<String> {
        let free: Vec<_> = self.of_contact().filter(|e| e.status != Status::Fixed).collect();
        let is_silent = free.iter().all(|e| e.status == Status::NotIdentified);
        let symbols = free.iter().map(|e| e.parameter.symbol());
        (is_silent && !free.is_empty()).then(|| format!("These shots determine none of {}.", listed(symbols)))
    }

    /// Returns the shots that were left out without a request.
    pub(super) fn unwanted(&self) -> Vec<&Rejected> {
        self.shots_rejected.iter().filter(|rejected| rejected.reason != ON_REQUEST).collect()
    }

    /// Returns the shots that were left out: a doubt if most shots may be like them.
    fn not_used(&self) -> Option<Remark> {
        let rejected = self.unwanted();
        let Rejected { shot, reason } = rejected.first()?;
        let (used, left_out) = (self.shots_used, rejected.len());
        let all = used + left_out;
        Some(if (used as f64) < FEW_USED * all as f64 {
            doubtful("shots-left-out")(format!(
                "Only {used} of {all} shots could be used; the first that was left out is shot {shot}: {reason}."
            ))
        } else {
            warning("shots-left-out")(format!(
                "{left_out} of {all} shots were not used; the first is shot {shot}: {reason}."
            ))
        })
    }

    /// Returns what the paths of the balls, or most shots, show to be wrong with the footage or its
    /// description.
    fn wrong_footage(&self) -> Option<String> {
        let suspicious = &self.diagnostics.suspicious;
        let is_of_most = |finding: &&check::Finding| {
            let alike = suspicious.iter().filter(|other| other.kind == finding.kind).count();
            finding.shot.is_none() || alike as f64 > MANY_SUSPICIOUS * self.shots_used as f64
        };
        if let Some(check::Finding { shot, text, .. }) = suspicious.iter().find(is_of_most) {
            let whose = shot.as_ref().map_or(String::new(), |shot| format!("in most shots, as in {shot}, "));
            return Some(format!("{}.", capital(&format!("{whose}{text}"))));
        }
        let noise = self.camera.as_ref()?.noise_correlation.filter(|noise| *noise > SMOOTHED)?;
        Some(format!(
            "The errors of neighbouring frames are correlated by {}, as in tracks that were smoothed, and determine little: export \
             the positions as they were measured.",
            plain(noise, 2)
        ))
    }

    /// Returns how residuals differ from the stated noise.
    fn unexplained(&self) -> Option<Remark> {
        let goodness = self.diagnostics.goodness.as_ref().filter(|_| !self.is_refuted())?;
        let times = plain(goodness.noise_factor?, 2);
        let noise = if self.footage { "the noise of the frames" } else { "the stated noise" };
        match goodness.noise {
            NoiseVerdict::TooSmall => Some(doubtful("noise")(format!(
                "The residuals are {times} times as large as {noise}: the model leaves something out, or the noise and with it the \
                 errors are larger."
            ))),
            // claims that do not hold are left out
            NoiseVerdict::TooLarge => Some(warning("noise")(format!(
                "The residuals are only {times} times as large as {noise}: the stated errors are too large."
            ))),
            NoiseVerdict::NotTested | NoiseVerdict::Explains => None,
        }
    }

    /// Returns, of discs, that e and J_t/J_n together are not those of the contact that is fitted.
    fn refuted_contact(&self) -> Option<String> {
        self.discs.as_ref()?;
        let reduced_chi2 = refutes(self.chi2, self.dof as f64, &Policy::default())?;
        Some(format!(
            "χ²/dof of e and J_t/J_n is {}, where 1 is expected: the contact that is fitted does not describe these discs, and e may be \
             off by more than its error. caromfit extract measures e without a law of friction.",
            plain(reduced_chi2, 3)
        ))
    }

    /// Returns, of discs, that J_t/J_n does not follow the slip as it should. e is not affected.
    fn refuted_friction(&self) -> Option<String> {
        self.scatter?;
        let is_of_friction =
            |trend: &&Trend| trend.is_improbable() && trend.quantity == Observable::ImpulseRatio.label();
        let trend = self.trends().iter().find(is_of_friction)?;
        let e = self.get(Parameter::E).and_then(|e| Some(with_error(e.value, e.std_error?)));
        let free = e.map_or(String::new(), |e| format!(" e = {e} does not rest on it."));
        Some(format!(
            "The shots refute the friction that is fitted: what it leaves of J_t/J_n changes with {}, which chance rarely does.{free}",
            trend.variable.name()
        ))
    }

    /// Returns that residuals from which the noise was to be estimated are all 0, or absent.
    fn unknown_errors(&self) -> Option<Remark> {
        let mut estimated = self.noise.iter().filter(|noise| noise.estimated_sd.is_some()).peekable();
        estimated.peek().filter(|_| self.dof > 0)?;
        let is_exact = |noise: &Noise| {
            let size = noise.rounding.or(noise.is_unknown().then_some(1.0));
            size.is_some_and(|size| noise.rms <= MIN_RESIDUAL * size)
        };
        if estimated.all(is_exact) {
            let rounding = self.noise.iter().find_map(|noise| Some(noise.in_words(noise.rounding?, 2)));
            let errors = match rounding {
                None => "state the standard deviations of the readings.".to_owned(),
                Some(sd) => format!(
                    "the errors are those of readings that are rounded (± {sd}): read more digits, or state standard deviations."
                ),
            };
            return Some(doubtful("exact")(format!(
                "Every reading is met exactly, so that no residual is left from which an error follows; {errors}"
            )));
        }
        self.noise.iter().any(Noise::is_unknown).then(|| {
            warning("no-errors")(
                "No errors: the data state no standard deviations and leave no degrees of freedom to estimate them.".to_owned(),
            )
        })
    }

    /// Returns the values that these data leave open, and those that end on a bound.
    fn undetermined(&self) -> Vec<String> {
        let mut all = Vec::new();
        for estimate in &self.estimates {
            let Some([edge, _]) = self.plateau(estimate.parameter) else { continue };
            let why = match estimate.parameter {
                Parameter::Mu if self.discs.is_some() => {
                    ": the discs stick together where they touch. Thinner hits determine it"
                }
                Parameter::Mu => {
                    ": the balls stick together where they touch. Thinner cuts, or faster shots, determine it"
                }
                _ => ": beyond, the data do not depend on it",
            };
            let symbol = estimate.parameter.symbol();
            all.push(format!("{symbol} is known to be at least {} only{why}.", plain(edge, 3)));
        }
        let worst = self.diagnostics.identifiability.as_ref().and_then(|found| found.worst.as_ref());
        if let Some(open) = worst.filter(|worst| worst.undetermined) {
            all.push(format!(
                "{}. The values given are some of many that fit equally: fix all but one.",
                capital(&open.words)
            ));
        }
        for estimate in &self.estimates {
            let (side, word, end) = match estimate.status {
                Status::AtLowerBound => ("lower", "at most", 1),
                Status::AtUpperBound => ("upper", "at least", 0),
                _ => continue,
            };
            let limit = estimate.interval_95.map(|ends| format!(" ({word} {} at 95 %)", plain(ends[end], 2)));
            all.push(format!(
                "{} ends on its {side} bound {}{}.",
                estimate.parameter.symbol(),
                plain(estimate.value, 3),
                limit.unwrap_or_default()
            ));
        }
        let weak = worst.filter(|worst| worst.weak && !worst.undetermined);
        all.extend(weak.map(|worst| format!("{}.", capital(&worst.words))));
        all
    }

    /// Returns the parameters that are known much less if others are not exactly at their bounds.
    fn hidden_by_bounds(&self) -> Vec<String> {
        let (mut others, mut conditions) = (Vec::new(), Vec::new());
        for bound in self.estimates.iter().filter(|estimate| estimate.is_at_bound()) {
            let symbol = bound.parameter.symbol();
            // with μ_s the data determine only its product with μ
            others.push(if bound.parameter == Parameter::MuS { "μ·μ_s" } else { symbol });
            conditions.push(format!("{symbol} = {} holds", bound.value));
        }
        let (others, conditions) = (others.join(" and "), conditions.join(" and "));
        let mut all = Vec::new();
        for estimate in self.estimates.iter().filter(|_| !others.is_empty()) {
            let errors = estimate.std_error.zip(estimate.std_error_at_bound);
            let Some((released, conditional)) = errors else { continue };
            let (symbol, times) = (estimate.parameter.symbol(), released / conditional);
            if times >= WORTH_SAYING {
                all.push(format!(
                    "These data poorly distinguish {symbol} from {others}: {symbol} is ± {conditional:.2e} if {conditions} exactly, but \
                     ± {released:.2e} ({times:.0} times as much) if not."
                ));
            }
        }
        all
    }

    /// Returns that the shots are too few to believe what they agree on.
    fn few_shots(&self) -> Option<String> {
        let used = self.shots_used;
        let shots = count_of(used, "shot");
        // errors of discs are those of their frames
        if self.dof == 0 && self.discs.is_none() {
            let has_errors = self.estimates.iter().any(|estimate| estimate.std_error.is_some());
            let errors = if has_errors { "" } else { "no error can be stated, and " };
            return Some(format!(
                "There are as many unknown values as measured ones ({shots}): {errors}the model is not tested."
            ));
        }
        let verb = if used == 1 { "is" } else { "are" };
        (used < check::FEW_SHOTS).then(|| format!("{shots} {verb} not enough to show how much shots differ."))
    }

    fn trends(&self) -> &[Trend] {
        self.diagnostics.goodness.as_ref().map_or(&[], |goodness| &goodness.trends)
    }

    /// Returns the trends of residuals: a doubt of the first if it is significant at the level of a
    /// family, and the others that are significant unless something explains the residuals, which
    /// says more than how they run.
    fn changing_residuals(&self) -> Vec<Remark> {
        let is_refuted = self.refuted_friction().is_some();
        let remark = |(place, trend): (usize, &Trend)| {
            let is_doubt = place == 0 && trend.is_improbable() && !is_refuted;
            let severity = if is_doubt { Severity::Doubtful } else { Severity::Warning };
            let is_wanted = is_doubt || trend.significant && self.explanations.is_empty();
            is_wanted.then(|| Remark::new(severity, "trend", format!("{}.", capital(&trend.words))))
        };
        self.trends().iter().enumerate().filter_map(remark).collect()
    }
}

/// Returns `μ`, `μ and e`, `μ, μ_s and e`.
pub(super) fn listed<'a>(symbols: impl Iterator<Item = &'a str>) -> String {
    let symbols: Vec<&str> = symbols.collect();
    match symbols.as_slice() {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [others @ .., last] => format!("{} and {last}", others.join(", ")),
    }
}
