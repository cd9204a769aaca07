//! Everything that lets doubt a fit, as a list, whose severities make the verdict.

use std::cmp::Reverse;
use std::collections::HashSet;

use minijinja::context;

use super::film::FittedFilm;
use super::film_words::{self, Remark, doubt, note, of_shots, sentences};
use super::{Estimate, Fit, Noise, NoiseVerdict, Rejected, Status, Trend, check};
use crate::measurement::dataset::{Dataset, ON_REQUEST, Shot};
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;
use crate::problem::Severity::{Doubtful, Note, Unusable, Warning};
use crate::problem::{Combination, Finding, MISLEADING, POLICY, refutes};

/// Kind of what is wrong with footage or its description.
pub(super) const FOOTAGE: &str = "suspicious-footage";

/// Correlation of the noise of neighbouring frames above which tracks are filtered.
const SMOOTHED: f64 = 0.93;

/// Part of the rounding of the readings; without one, in rad, m/s, rad/s or as a ratio: smaller
/// residuals are rounding of the search.
const MIN_RESIDUAL: f64 = 1e-6;

/// Sets what is suspicious about the shots of a fit, its warnings, and its notes, among them those
/// of what was fitted; takes the errors of a model away that the data refute.
pub(super) fn comment(
    fit: &mut Fit,
    dataset: &Dataset,
    has_topspin: bool,
    own: impl IntoIterator<Item = Remark>,
) {
    if fit.is_refuted() {
        // standard errors hold if the model does
        for estimate in fit.estimates.iter_mut().filter(|e| e.status != Status::Fixed) {
            *estimate = Estimate::bare(estimate.parameter, estimate.value, estimate.status);
        }
        fit.budget.clear();
        fit.diagnostics.contours.clear();
    }
    let shots: Vec<&Shot> = match &fit.frames {
        Some(film) => film.impacts.iter().map(|impact| &impact.shot).collect(),
        None => dataset.shots.iter().collect(),
    };
    let mut all = fit.doubts(&check::suspicious(dataset, &shots, fit.sliding));
    let notes = fit.solution.record.findings.iter().filter(|finding| finding.severity() == Note);
    all.extend(notes.map(|finding| film_words::remark(finding, fit.frames.as_ref())));
    all.extend(own);
    let on_request = fit.shots_rejected.len() - fit.unwanted().len();
    all.extend(of_shots("left-out-on-request", on_request, fit.shots_rejected.len() + fit.shots_used()));
    // parameters that the data do not determine, unless it is said of a combination
    let is_combination = fit.worst_combination().is_some_and(|worst| worst.undetermined);
    for Estimate { parameter, value, status, .. } in &fit.estimates {
        let without_topspin = *parameter == Parameter::MuS && !has_topspin;
        if *status == Status::NotIdentified && (without_topspin || !is_combination) {
            let parameter = parameter.name();
            all.push(note("undetermined/not-identified", context! { parameter, value, without_topspin }));
        }
    }
    all.extend(dataset.notes().map(|text| note("data", context! { beside => text })));
    all.retain(|remark| !remark.sentence.is_empty());
    fit.remarks = all;
}

/// Returns what lets doubt the fit of a film, the worst first.
pub(crate) fn of_film(film: &FittedFilm) -> Vec<check::Finding> {
    let mut doubts: Vec<_> =
        film.solution.record.findings.iter().filter(|own| own.severity() > Warning).collect();
    doubts.sort_by_key(|own| Reverse(own.severity()));
    let sentences = doubts.into_iter().filter_map(|own| film_words::sentence(own, Some(film)));
    sentences.map(|text| check::Finding { shot: None, kind: FOOTAGE, suspicious: true, text }).collect()
}

impl Fit {
    /// Returns what a reader must know, in sentences, the most important first.
    pub fn warnings(&self) -> Vec<&str> {
        sentences(&self.remarks, |severity| severity > Note)
    }

    /// Returns what else a reader may want to know, in sentences.
    pub fn notes(&self) -> Vec<&str> {
        sentences(&self.remarks, |severity| severity == Note)
    }

    /// Returns everything that lets doubt the fit, the most harmful first.
    pub(super) fn doubts(&self, suspicious: &[check::Finding]) -> Vec<Remark> {
        let mut all: Vec<Remark> = Vec::new();
        let findings = self.solution.record.findings.iter().filter(|finding| finding.severity() > Note);
        // causes and conflicts with what is stated may come from wrong footage
        let (conflicts, others): (Vec<&Finding>, Vec<&Finding>) = findings.partition(|finding| {
            matches!(finding, Finding::Conflict { .. } | Finding::Cause { .. } | Finding::SideSpins { .. })
        });
        let remark = |finding| film_words::remark(finding, self.frames.as_ref());
        all.extend(others.into_iter().map(remark));
        self.doubt_footage(&mut all, suspicious);
        all.extend(conflicts.into_iter().map(remark));
        if !self.converged() {
            let termination = self.termination();
            all.push(Remark::new(Unusable, "not-converged/search-failed", context! { termination }));
        }
        let free: Vec<&Estimate> = self.of_contact().filter(|e| e.status != Status::Fixed).collect();
        if !free.is_empty() && free.iter().all(|e| e.status == Status::NotIdentified) {
            let symbols: Vec<&str> = free.iter().map(|e| e.parameter.symbol()).collect();
            all.push(Remark::new(Unusable, "undetermined/nothing-determined", context! { symbols }));
        }
        for text in check::warnings(suspicious, self.shots_used()) {
            all.push(Remark::new(Warning, "suspicious-shot", context! { beside => text }));
        }
        let rejected = self.unwanted();
        if let Some(Rejected { shot, reason }) = rejected.first() {
            let (used, of) = (self.shots_used(), self.shots_used() + rejected.len());
            let are_few = !POLICY.are_most(used, of);
            let severity = if are_few { Doubtful } else { Warning };
            all.push(Remark::new(severity, "shots-left-out", context! { used, of, shot, reason }));
        }
        let refutes_friction = self.doubt_residuals(&mut all);
        self.doubt_errors(&mut all);
        self.doubt_values(&mut all);
        let shots = self.shots_used();
        // errors of discs are those of their frames
        if self.dof() == 0 && self.discs.is_none() {
            let has_errors = self.estimates.iter().any(|estimate| estimate.std_error.is_some());
            all.push(doubt("few-shots/no-freedom", context! { shots, has_errors }));
        } else if shots < check::FEW_SHOTS {
            all.push(doubt("few-shots", context! { shots }));
        }
        if self.estimates.iter().any(|estimate| estimate.includes_other_minimum) {
            all.push(doubt("rival-minimum", context! {}));
        }
        self.doubt_bounds(&mut all);
        // something that explains the residuals says more than how they run
        let is_unexplained = self.explanations().is_empty();
        for (place, trend) in self.diagnostics.goodness.trends.iter().enumerate() {
            let is_doubt = place == 0 && trend.is_improbable() && !refutes_friction;
            if is_doubt || trend.significant && is_unexplained {
                let severity = if is_doubt { Doubtful } else { Warning };
                all.push(Remark::new(severity, "trend", context! { beside => &trend.words }));
            }
        }
        all.sort_by_key(|remark| Reverse(remark.severity));
        let mut known = HashSet::new();
        all.retain(|remark| !remark.sentence.is_empty() && known.insert(remark.sentence.clone()));
        all
    }

    /// Returns the shots that were left out without a request.
    pub(super) fn unwanted(&self) -> Vec<&Rejected> {
        self.shots_rejected.iter().filter(|rejected| rejected.reason != ON_REQUEST).collect()
    }

    /// Returns the combination that is determined worst.
    fn worst_combination(&self) -> Option<&Combination> {
        self.diagnostics.identifiability.as_ref()?.worst.as_ref()
    }

    /// Says what paths, or most shots, show to be wrong with the footage or its description.
    fn doubt_footage(&self, all: &mut Vec<Remark>, suspicious: &[check::Finding]) {
        let is_of_most = |finding: &&check::Finding| {
            let alike = suspicious.iter().filter(|other| other.kind == finding.kind).count();
            finding.shot.is_none() || 2 * alike > self.shots_used()
        };
        let lasting = |finding: &Finding| match finding {
            Finding::NoiseLasts { rho, .. } => Some(*rho),
            _ => None,
        };
        let rho = self.solution.record.findings.iter().find_map(lasting);
        if let Some(check::Finding { shot, text, .. }) = suspicious.iter().find(is_of_most) {
            all.push(doubt(FOOTAGE, context! { shot, text }));
        } else if let Some(rho) = rho.filter(|rho| *rho > SMOOTHED) {
            all.push(doubt("suspicious-footage/smoothed", context! { rho }));
        }
    }

    /// Says how residuals differ from the noise, and of discs that e and J_t/J_n together are not
    /// those of the contact that is fitted, or that J_t/J_n does not follow the slip as it should,
    /// which does not affect e; returns whether this is so.
    fn doubt_residuals(&self, all: &mut Vec<Remark>) -> bool {
        let goodness = &self.diagnostics.goodness;
        if let Some(times) = goodness.noise_factor.filter(|_| !self.is_refuted()) {
            let noise = if self.footage { "the noise of the frames" } else { "the stated noise" };
            let values = context! { times, noise };
            match goodness.stated_noise {
                NoiseVerdict::TooSmall => all.push(doubt("noise/noise-too-small", values)),
                // claims that do not hold are left out
                NoiseVerdict::TooLarge => all.push(Remark::new(Warning, "noise/noise-too-large", values)),
                NoiseVerdict::NotTested | NoiseVerdict::Explains => {}
            }
        }
        let is_of_discs = self.discs.is_some();
        if let Some(reduced_chi2) = refutes(self.chi2(), self.dof() as f64)
            && is_of_discs
        {
            all.push(doubt("refuted-contact", context! { reduced_chi2 }));
        }
        let is_of_friction =
            |trend: &&Trend| trend.is_improbable() && trend.residuals_of == Observable::ImpulseRatio.label();
        let trend = goodness.trends.iter().find(is_of_friction).filter(|_| is_of_discs);
        if let Some(trend) = trend {
            let variable = trend.against;
            let (e, sd) = self.get(Parameter::E).and_then(|e| Some((e.value, e.std_error?))).unzip();
            all.push(doubt("refuted-friction", context! { variable, e, sd }));
        }
        trend.is_some()
    }

    /// Says that residuals from which the noise was to be estimated are all 0, or absent.
    fn doubt_errors(&self, all: &mut Vec<Remark>) {
        let mut estimated = self.noise.iter().filter(|noise| noise.estimated_sd.is_some()).peekable();
        if self.dof() == 0 || estimated.peek().is_none() {
            return;
        }
        let is_exact = |noise: &Noise| {
            let size = noise.rounding.or(noise.is_unknown().then_some(1.0));
            size.is_some_and(|size| noise.rms <= MIN_RESIDUAL * size)
        };
        if estimated.all(is_exact) {
            let rounding = self.noise.iter().find_map(|noise| Some(noise.in_words(noise.rounding?, 2)));
            all.push(doubt("exact", context! { rounding }));
        } else if self.noise.iter().any(Noise::is_unknown) {
            all.push(Remark::new(Warning, "no-errors", context! {}));
        }
    }

    /// Says the values that these data leave open, and those that end on a bound.
    fn doubt_values(&self, all: &mut Vec<Remark>) {
        for parameter in self.estimates.iter().map(|estimate| estimate.parameter) {
            if let Some([edge, _]) = self.plateau(parameter) {
                let (parameter, discs) = (parameter.name(), self.discs.is_some());
                all.push(doubt("undetermined/saturated", context! { parameter, edge, discs }));
            }
        }
        let worst = self.worst_combination().filter(|worst| worst.weak);
        let combination = worst.map(|worst| {
            let beside = context! { words => &worst.words, undetermined => worst.undetermined };
            doubt("undetermined/combination", context! { beside })
        });
        all.extend(combination.clone().filter(|_| worst.is_some_and(|worst| worst.undetermined)));
        for estimate in self.estimates.iter().filter(|estimate| estimate.is_at_bound()) {
            let (parameter, bound) = (estimate.parameter.name(), estimate.value);
            let is_lower = estimate.status == Status::AtLowerBound;
            let limit = estimate.interval_95.map(|ends| ends[usize::from(is_lower)]);
            all.push(doubt("undetermined/on-bound", context! { parameter, bound, is_lower, limit }));
        }
        // what was said already is not repeated
        all.extend(combination);
    }

    /// Says the parameters that are known much less if others are not exactly at their bounds.
    fn doubt_bounds(&self, all: &mut Vec<Remark>) {
        let (mut conditions, mut others) = (Vec::new(), Vec::new());
        for Estimate { parameter, value, .. } in self.estimates.iter().filter(|e| e.is_at_bound()) {
            conditions.push(format!("{} = {value} holds", parameter.symbol()));
            // with μ_s the data determine only its product with μ
            others.push(if *parameter == Parameter::MuS { "μ·μ_s" } else { parameter.symbol() });
        }
        for estimate in &self.estimates {
            let parameter = estimate.parameter.name();
            if let Some((released, held)) = estimate.std_error.zip(estimate.std_error_at_bound)
                && released / held >= MISLEADING
                && !others.is_empty()
            {
                let values =
                    context! { parameter, others => &others, conditions => &conditions, released, held };
                all.push(Remark::new(Warning, "undetermined/hidden-by-bound", values));
            }
        }
    }
}
