//! Everything that lets doubt a fit, as a list, whose severities make the verdict.

use std::cmp::Reverse;
use std::collections::HashSet;
use std::sync::LazyLock;

use minijinja::value::{Serde, merge_maps};
use minijinja::{Value as Values, context};

use super::{Estimate, Fit, Noise, NoiseVerdict, Rejected, Status, Trend, check, film_words};
use crate::measurement::dataset::ON_REQUEST;
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;
use crate::problem::{Finding, Policy, Severity, refutes};
use crate::words::Sentences;

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

/// The words of every remark, by its kind.
static WORDS: LazyLock<Sentences> = LazyLock::new(|| Sentences::of(include_str!("words.jinja")));

/// Something to know of a fit: a finding of its problem, or what follows from its results.
#[derive(Clone, Debug)]
pub(crate) struct Remark {
    /// How far it affects the trust in the fit.
    pub(crate) severity: Severity,
    /// Its kind and its numbers.
    pub(crate) values: Values,
    pub(crate) sentence: String,
}

impl Remark {
    /// Returns a remark with these numbers; `None` if it has no words, as it stands elsewhere. The
    /// name is its kind, or its kind and behind `/` that of its words, which may take the numbers
    /// `beside`, too.
    pub(super) fn new(severity: Severity, name: &str, values: Values, beside: Values) -> Option<Self> {
        let (kind, of_words) = name.split_once('/').unwrap_or((name, name));
        let numbers = merge_maps([values.clone(), beside]);
        let words = context! { kind => of_words, severity => Serde(severity), ..numbers };
        let sentence = WORDS.sentence(words);
        let values = context! { kind, ..values };
        (!sentence.is_empty()).then_some(Self { severity, values, sentence })
    }
}

/// Returns a remark of this severity, which has all numbers of its words.
fn said(severity: Severity) -> impl Fn(&str, Values) -> Option<Remark> {
    move |name, values| Remark::new(severity, name, values, Values::default())
}

/// Returns the words of a remark alone.
pub(crate) fn words_of(name: &str, values: Values) -> String {
    Remark::new(Severity::Note, name, values, Values::default())
        .map_or_else(String::new, |remark| remark.sentence)
}

impl Fit {
    /// Returns what a reader must know, in sentences, the most important first.
    pub fn warnings(&self) -> Vec<&str> {
        self.sentences(|severity| severity > Severity::Note)
    }

    /// Returns what else a reader may want to know, in sentences.
    pub fn notes(&self) -> Vec<&str> {
        self.sentences(|severity| severity == Severity::Note)
    }

    fn sentences(&self, wanted: impl Fn(Severity) -> bool) -> Vec<&str> {
        let wanted = self.remarks.iter().filter(|remark| wanted(remark.severity));
        wanted.map(|remark| remark.sentence.as_str()).collect()
    }

    /// Returns everything that lets doubt the fit, the most harmful first.
    pub(super) fn doubts(&self) -> Vec<Remark> {
        let [doubtful, unusable] = [Severity::Doubtful, Severity::Unusable].map(said);
        let findings = self.solution.findings.iter().filter(|finding| finding.severity() > Severity::Note);
        // conflicts with what is stated may come from wrong footage
        let (conflicts, others): (Vec<&Finding>, Vec<&Finding>) =
            findings.partition(|finding| matches!(finding, Finding::Conflict { .. }));
        let remark = |finding| film_words::remark(finding, self.frames.as_ref());
        let mut all: Vec<Remark> = others.into_iter().filter_map(remark).collect();
        all.extend(self.wrong_footage());
        all.extend(conflicts.into_iter().filter_map(remark));
        if !self.converged {
            let termination = &self.termination;
            all.extend(unusable("not-converged/search-failed", context! { termination }));
        }
        all.extend(self.nothing_determined());
        for text in check::warnings(&self.diagnostics.suspicious, self.shots_used) {
            all.extend(Remark::new(Severity::Warning, "suspicious-shot", context! {}, context! { text }));
        }
        all.extend(self.not_used());
        all.extend(self.unexplained());
        all.extend(self.refuted_contact());
        all.extend(self.refuted_friction());
        all.extend(self.unknown_errors());
        all.extend(self.undetermined());
        all.extend(self.few_shots());
        if self.diagnostics.has_rival {
            all.extend(doubtful("rival-minimum", context! {}));
        }
        all.extend(self.hidden_by_bounds());
        all.extend(self.changing_residuals());
        all.sort_by_key(|remark| Reverse(remark.severity));
        let mut known = HashSet::new();
        all.retain(|remark| known.insert(remark.sentence.clone()));
        all
    }

    fn nothing_determined(&self) -> Option<Remark> {
        let free: Vec<_> = self.of_contact().filter(|e| e.status != Status::Fixed).collect();
        let is_silent = free.iter().all(|e| e.status == Status::NotIdentified);
        let symbols: Vec<&str> = free.iter().map(|e| e.parameter.symbol()).collect();
        let is_wanted = is_silent && !free.is_empty();
        is_wanted
            .then(|| said(Severity::Unusable)("undetermined/nothing-determined", context! { symbols }))
            .flatten()
    }

    /// Returns the shots that were left out without a request.
    pub(super) fn unwanted(&self) -> Vec<&Rejected> {
        self.shots_rejected.iter().filter(|rejected| rejected.reason != ON_REQUEST).collect()
    }

    /// Returns the shots that were left out: a doubt if most shots may be like them.
    fn not_used(&self) -> Option<Remark> {
        let rejected = self.unwanted();
        let Rejected { shot, reason } = rejected.first()?;
        let (used, of) = (self.shots_used, self.shots_used + rejected.len());
        let is_doubt = (used as f64) < FEW_USED * of as f64;
        let severity = if is_doubt { Severity::Doubtful } else { Severity::Warning };
        said(severity)("shots-left-out", context! { used, of, shot, reason })
    }

    /// Returns what the paths of the balls, or most shots, show to be wrong with the footage or its
    /// description.
    pub(super) fn wrong_footage(&self) -> Option<Remark> {
        let suspicious = &self.diagnostics.suspicious;
        let is_of_most = |finding: &&check::Finding| {
            let alike = suspicious.iter().filter(|other| other.kind == finding.kind).count();
            finding.shot.is_none() || alike as f64 > MANY_SUSPICIOUS * self.shots_used as f64
        };
        if let Some(check::Finding { shot, text, .. }) = suspicious.iter().find(is_of_most) {
            return said(Severity::Doubtful)("suspicious-footage", context! { shot, text });
        }
        let rho = self.camera.as_ref()?.noise_correlation.filter(|rho| *rho > SMOOTHED)?;
        said(Severity::Doubtful)("suspicious-footage/smoothed", context! { rho })
    }

    /// Returns how residuals differ from the stated noise.
    fn unexplained(&self) -> Option<Remark> {
        let goodness = self.diagnostics.goodness.as_ref().filter(|_| !self.is_refuted())?;
        let times = goodness.noise_factor?;
        let noise = if self.footage { "the noise of the frames" } else { "the stated noise" };
        let values = context! { times, noise };
        match goodness.noise {
            NoiseVerdict::TooSmall => said(Severity::Doubtful)("noise/noise-too-small", values),
            // claims that do not hold are left out
            NoiseVerdict::TooLarge => said(Severity::Warning)("noise/noise-too-large", values),
            NoiseVerdict::NotTested | NoiseVerdict::Explains => None,
        }
    }

    /// Returns, of discs, that e and J_t/J_n together are not those of the contact that is fitted.
    fn refuted_contact(&self) -> Option<Remark> {
        self.discs.as_ref()?;
        let reduced_chi2 = refutes(self.chi2, self.dof as f64, &Policy::default())?;
        said(Severity::Doubtful)("refuted-contact", context! { reduced_chi2 })
    }

    /// Returns, of discs, that J_t/J_n does not follow the slip as it should. e is not affected.
    fn refuted_friction(&self) -> Option<Remark> {
        self.scatter?;
        let is_of_friction =
            |trend: &&Trend| trend.is_improbable() && trend.quantity == Observable::ImpulseRatio.label();
        let variable = self.trends().iter().find(is_of_friction)?.variable.name();
        let (e, sd) = self.get(Parameter::E).and_then(|e| Some((e.value, e.std_error?))).unzip();
        said(Severity::Doubtful)("refuted-friction", context! { variable, e, sd })
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
            return said(Severity::Doubtful)("exact", context! { rounding });
        }
        let is_unknown = self.noise.iter().any(Noise::is_unknown);
        is_unknown.then(|| said(Severity::Warning)("no-errors", context! {})).flatten()
    }

    /// Returns the values that these data leave open, and those that end on a bound.
    fn undetermined(&self) -> Vec<Remark> {
        let doubtful = said(Severity::Doubtful);
        let mut all = Vec::new();
        for Estimate { parameter, .. } in &self.estimates {
            if let Some([edge, _]) = self.plateau(*parameter) {
                let (parameter, discs) = (parameter.name(), self.discs.is_some());
                all.push(doubtful("undetermined/saturated", context! { parameter, edge, discs }));
            }
        }
        let worst = self.diagnostics.identifiability.as_ref().and_then(|found| found.worst.as_ref());
        let combination = |undetermined: bool| {
            let worst = worst.filter(|worst| worst.weak && worst.undetermined == undetermined)?;
            let words = context! { words => &worst.words, undetermined };
            Remark::new(Severity::Doubtful, "undetermined/combination", context! {}, words)
        };
        all.push(combination(true));
        for estimate in self.estimates.iter().filter(|estimate| estimate.is_at_bound()) {
            let (parameter, bound) = (estimate.parameter.name(), estimate.value);
            let is_lower = estimate.status == Status::AtLowerBound;
            let limit = estimate.interval_95.map(|ends| ends[usize::from(is_lower)]);
            all.push(doubtful("undetermined/on-bound", context! { parameter, bound, is_lower, limit }));
        }
        all.push(combination(false));
        all.into_iter().flatten().collect()
    }

    /// Returns the parameters that are known much less if others are not exactly at their bounds.
    fn hidden_by_bounds(&self) -> Vec<Remark> {
        let bounds = || self.estimates.iter().filter(|estimate| estimate.is_at_bound());
        let condition = |bound: &Estimate| format!("{} = {} holds", bound.parameter.symbol(), bound.value);
        let conditions: Vec<String> = bounds().map(condition).collect();
        // with μ_s the data determine only its product with μ
        let other = |bound: &Estimate| match bound.parameter {
            Parameter::MuS => "μ·μ_s",
            parameter => parameter.symbol(),
        };
        let others: Vec<&str> = bounds().map(other).collect();
        let remark = |estimate: &Estimate| {
            let (released, held) = estimate.std_error.zip(estimate.std_error_at_bound)?;
            let parameter = estimate.parameter.name();
            let is_wanted = !others.is_empty() && released / held >= WORTH_SAYING;
            let values = context! { parameter, others => &others, conditions => &conditions, released, held };
            is_wanted.then(|| said(Severity::Warning)("undetermined/hidden-by-bound", values)).flatten()
        };
        self.estimates.iter().filter_map(remark).collect()
    }

    /// Returns that the shots are too few to believe what they agree on.
    fn few_shots(&self) -> Option<Remark> {
        let shots = self.shots_used;
        // errors of discs are those of their frames
        if self.dof == 0 && self.discs.is_none() {
            let has_errors = self.estimates.iter().any(|estimate| estimate.std_error.is_some());
            return said(Severity::Doubtful)("few-shots/no-freedom", context! { shots, has_errors });
        }
        (shots < check::FEW_SHOTS)
            .then(|| said(Severity::Doubtful)("few-shots", context! { shots }))
            .flatten()
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
            let words = &trend.words;
            is_wanted.then(|| Remark::new(severity, "trend", context! {}, context! { words })).flatten()
        };
        self.trends().iter().enumerate().filter_map(remark).collect()
    }
}
