//! Everything that lets doubt a fit, as a list: its severities make the verdict, its sentences the warnings.

use super::check::{self, Kind, capital};
use super::{Estimate, Fit, Noise, NoiseVerdict, Rejected, Status, Trend, film_words};
use crate::measurement::dataset::ON_REQUEST;
use crate::measurement::number::{count_of, plain, with_error};
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;
use crate::problem::Severity;

/// Part of all shots: with fewer used, those that were left out may be the rule.
const FEW_USED: f64 = 0.6;

/// Part of the shots: what more of them show is no accident of one.
const MANY_SUSPICIOUS: f64 = 0.5;

/// Noise whose correlation from frame to frame is above this is that of a filter: trackers that follow a ball by themselves stay below.
const SMOOTHED: f64 = 0.93;

/// Number of shots that show whether the camera looks askew.
const LEAST_SHOTS: usize = 6;

/// Ratio of a standard error to the one with other parameters exactly at their bounds, from which on it is said.
const WORTH_SAYING: f64 = 2.0;

/// Something that lets doubt a fit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Doubt {
    /// How far it affects the trust in the fit.
    pub severity: Severity,
    /// What it is, for a reader.
    pub sentence: String,
}

impl Fit {
    /// Returns everything that lets doubt the fit, the most harmful first.
    #[must_use]
    pub fn doubts(&self) -> Vec<Doubt> {
        let found = |severity: Severity| {
            let alike = self.findings.iter().filter(move |finding| finding.severity() == severity);
            alike.filter_map(|finding| film_words::sentence(finding, self.frames.as_ref()))
        };
        let mut all: Vec<Doubt> = Vec::new();
        let mut add = |severity, sentences: &mut dyn Iterator<Item = String>| {
            for sentence in sentences {
                if all.iter().all(|known| known.sentence != sentence) {
                    all.push(Doubt { severity, sentence });
                }
            }
        };
        let unusable = [self.refuted_model(), self.unfinished(), self.nothing_determined()];
        add(Severity::Unusable, &mut found(Severity::Unusable).chain(unusable.into_iter().flatten()));
        add(Severity::Doubtful, &mut found(Severity::Doubtful));
        let of_data = [self.few_used(), self.wrong_footage(), self.unexplained(), self.refuted_friction()];
        add(Severity::Doubtful, &mut of_data.into_iter().chain([self.met_exactly()]).flatten());
        add(Severity::Doubtful, &mut self.undetermined().into_iter());
        let of_errors = [self.few_shots(), self.other_values(), self.improbable_trend()];
        add(Severity::Doubtful, &mut of_errors.into_iter().flatten());
        let suspicious = check::warnings(&self.diagnostics.suspicious, self.shots_used);
        add(Severity::Warning, &mut suspicious.into_iter());
        let of_shots = [self.not_used(), self.no_errors()];
        add(Severity::Warning, &mut of_shots.into_iter().flatten());
        add(Severity::Warning, &mut self.hidden_by_bounds().iter().map(Hidden::sentence));
        add(Severity::Warning, &mut self.other_trends());
        all
    }

    /// Returns how the data contradict the model, and what else is wrong, as that is why.
    fn refuted_model(&self) -> Option<String> {
        let refuted = self.refuted.as_ref()?;
        let (what, see) = match self.discs {
            Some(_) => (
                "two rigid discs with constant friction",
                " caromfit extract lists what was measured in every shot.",
            ),
            None if self.object.is_some() => {
                ("two balls of the stated masses and sizes with constant friction", "")
            }
            None => ("two equal balls with constant friction", ""),
        };
        let radius = self.diagnostics.suspicious.iter().find(|finding| finding.kind == Kind::Radius);
        let why = radius.map(|odd| format!(" {}.", capital(&odd.text))).or_else(|| {
            Some(format!(" {}", self.few_used().or(self.unseen_tilt()).or(self.wrong_footage())?))
        });
        // any other is of balls that are confused
        let measured = refuted
            .restitution
            .filter(|e| (0.0..=1.0).contains(&e.value))
            .map(|e| format!(" Measured without the model: e = {}.{see}", with_error(e.value, e.std_error)));
        Some(format!(
            "No collision of {what} describes these shots: χ²/dof is {}, where 1 is expected.{}{}",
            plain(refuted.reduced_chi2, 3),
            why.unwrap_or_default(),
            measured.unwrap_or_default()
        ))
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

    /// Returns the shots that were left out though nobody asked for it.
    pub(super) fn unwanted(&self) -> Vec<&Rejected> {
        self.shots_rejected.iter().filter(|rejected| rejected.reason != ON_REQUEST).collect()
    }

    fn few_used(&self) -> Option<String> {
        let rejected = self.unwanted();
        let (used, all) = (self.shots_used, self.shots_used + rejected.len());
        let first = rejected.first().filter(|_| (used as f64) < FEW_USED * all as f64)?;
        Some(format!(
            "Only {used} of {all} shots could be used; the first that was left out is shot {}: {}.",
            first.shot, first.reason
        ))
    }

    fn not_used(&self) -> Option<String> {
        let rejected = self.unwanted();
        let first = rejected.first().filter(|_| self.few_used().is_none())?;
        Some(format!(
            "{} of {} shots were not used; the first is shot {}: {}.",
            rejected.len(),
            rejected.len() + self.shots_used,
            first.shot,
            first.reason
        ))
    }

    /// Returns that these shots are too few to show whether the camera looks askew, which other causes then seem
    /// to explain.
    fn unseen_tilt(&self) -> Option<String> {
        let shots = self.shots_used + self.shots_rejected.len();
        (self.footage && self.discs.is_none() && shots < LEAST_SHOTS).then(|| {
            format!(
                "{} cannot show whether the camera looks askew, and that may be the reason: film at least {LEAST_SHOTS}, or \
                 straight from above.",
                count_of(shots, "shot")
            )
        })
    }

    /// Returns what the paths of the balls, or most shots, show to be wrong with the footage or its description.
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
            "The errors of neighbouring frames are correlated by {}, as in tracks that were smoothed, and tell little: export \
             the positions as they were measured.",
            plain(noise, 2)
        ))
    }

    /// Returns how residuals differ from the stated noise.
    fn unexplained(&self) -> Option<String> {
        let goodness = self.diagnostics.goodness.as_ref().filter(|_| self.refuted.is_none())?;
        let times = plain(goodness.noise_factor?, 2);
        let noise = if self.footage { "the noise of the frames" } else { "the stated noise" };
        match goodness.noise {
            NoiseVerdict::TooSmall => Some(format!(
                "The residuals are {times} times as large as {noise}: the model leaves something out, or the noise and with it the \
                 errors are larger."
            )),
            NoiseVerdict::TooLarge => Some(format!(
                "The residuals are only {times} times as large as {noise}: the stated errors are too large."
            )),
            NoiseVerdict::NotTested | NoiseVerdict::Explains => None,
        }
    }

    /// Returns, of discs, that J_t/J_n does not follow the slip as it should. e is free of it.
    fn refuted_friction(&self) -> Option<String> {
        self.scatter?;
        let is_of_friction =
            |trend: &&Trend| trend.is_improbable() && trend.quantity == Observable::ImpulseRatio.label();
        let trend = self.trends().iter().find(is_of_friction)?;
        let e = self.get(Parameter::E).and_then(|e| Some(with_error(e.value, e.std_error?)));
        let free = e.map_or(String::new(), |e| format!(" e = {e} does not rest on it."));
        Some(format!(
            "The shots refute the friction that is fitted: what it leaves of J_t/J_n changes with {}, which chance hardly does.{free}",
            trend.variable.name()
        ))
    }

    /// Returns whether residuals from which the noise was to be estimated are all 0.
    fn is_met_exactly(&self) -> bool {
        /// Part of the rounding of the readings; without one, in rad, m/s, rad/s or as a ratio: smaller residuals are rounding of the search.
        const EXACT: f64 = 1e-6;
        let mut estimated = self.noise.iter().filter(|noise| noise.estimated_sd.is_some()).peekable();
        let is_exact = |noise: &Noise| {
            let size = noise.rounding.or(noise.is_unknown().then_some(1.0));
            size.is_some_and(|size| noise.rms <= EXACT * size)
        };
        self.dof > 0 && estimated.peek().is_some() && estimated.all(is_exact)
    }

    fn met_exactly(&self) -> Option<String> {
        if !self.is_met_exactly() {
            return None;
        }
        let rounding = self.noise.iter().find_map(|noise| Some(noise.in_words(noise.rounding?, 2)));
        let errors = rounding.map_or_else(
            || "state the standard deviations of the readings.".to_owned(),
            |sd| {
                format!(
                    "the errors are those of readings that are rounded (± {sd}): read more digits, or state standard deviations."
                )
            },
        );
        Some(format!(
            "Every reading is met exactly, so that nothing is left of which an error could be told; {errors}"
        ))
    }

    /// Returns that errors cannot be stated, if nothing else says so.
    fn no_errors(&self) -> Option<String> {
        let is_unknown = self.noise.iter().any(Noise::is_unknown);
        (is_unknown && self.dof > 0 && !self.is_met_exactly()).then(|| {
            "No errors: the data state no standard deviations and leave no degrees of freedom to estimate them.".to_owned()
        })
    }

    /// Returns the values that these data leave open, and those that end on a bound.
    fn undetermined(&self) -> Vec<String> {
        let plateaus = self.estimates.iter().filter_map(|estimate| {
            let [edge, _] = self.plateau(estimate.parameter)?;
            let why = match estimate.parameter {
                Parameter::Mu if self.discs.is_some() => {
                    ": the discs stick together where they touch. Thinner hits determine it"
                }
                Parameter::Mu => {
                    ": the balls stick together where they touch. Thinner cuts, or faster shots, determine it"
                }
                _ => ": beyond, nothing depends on it",
            };
            Some(format!(
                "{} is known to be at least {} only{why}.",
                estimate.parameter.symbol(),
                plain(edge, 3)
            ))
        });
        let worst = self.diagnostics.identifiability.as_ref().and_then(|found| found.worst.as_ref());
        let open = worst.filter(|worst| worst.undetermined).map(|worst| {
            format!(
                "{}. The values given are some of many that fit equally: fix all but one.",
                capital(&worst.words)
            )
        });
        let hidden = self.hidden_by_bounds();
        let hides = hidden.first().map_or(String::new(), |hidden| {
            format!(", and these shots hardly tell {} from {}", hidden.symbol, hidden.others.join(" and "))
        });
        let at_bounds = self.estimates.iter().filter_map(|estimate| {
            let (side, word, end) = match estimate.status {
                Status::AtLowerBound => ("lower", "at most", 1),
                Status::AtUpperBound => ("upper", "at least", 0),
                _ => return None,
            };
            let limit = estimate.interval_95.map(|ends| format!(" ({word} {} at 95 %)", plain(ends[end], 2)));
            Some(format!(
                "{} ends on its {side} bound {}{}{hides}.",
                estimate.parameter.symbol(),
                plain(estimate.value, 3),
                limit.unwrap_or_default()
            ))
        });
        let weak = worst.filter(|worst| worst.weak && !worst.undetermined);
        let weak = weak.map(|worst| format!("{}.", capital(&worst.words)));
        plateaus.chain(open).chain(at_bounds).chain(weak).collect()
    }

    /// Returns the parameters that are known much less if others are not exactly at their bounds.
    fn hidden_by_bounds(&self) -> Vec<Hidden> {
        let is_at_bound = |e: &&Estimate| matches!(e.status, Status::AtLowerBound | Status::AtUpperBound);
        let at_bounds = || self.estimates.iter().filter(is_at_bound);
        // with μ_s the data determine only its product with μ
        let name =
            |e: &Estimate| if e.parameter == Parameter::MuS { "μ·μ_s" } else { e.parameter.symbol() };
        let hidden = |estimate: &Estimate| {
            let errors @ [released, conditional] = [estimate.std_error?, estimate.std_error_at_bound?];
            let hides = released >= WORTH_SAYING * conditional && at_bounds().next().is_some();
            hides.then(|| Hidden {
                symbol: estimate.parameter.symbol(),
                errors,
                conditions: at_bounds()
                    .map(|e| format!("{} = {} holds", e.parameter.symbol(), e.value))
                    .collect(),
                others: at_bounds().map(name).collect(),
            })
        };
        self.estimates.iter().filter_map(hidden).collect()
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
                "There are as many unknown values as measured ones ({shots}): {errors}nothing tests the model."
            ));
        }
        let verb = if used == 1 { "is" } else { "are" };
        (used < check::FEW_SHOTS).then(|| format!("{shots} {verb} not enough to show how much shots differ."))
    }

    fn other_values(&self) -> Option<String> {
        self.diagnostics.has_rival.then(|| {
            "Other values fit nearly as well: more shots, or a prior, decide between them.".to_owned()
        })
    }

    fn trends(&self) -> &[Trend] {
        self.diagnostics.goodness.as_ref().map_or(&[], |goodness| &goodness.trends)
    }

    fn improbable_trend(&self) -> Option<String> {
        let trend = self.trends().first().filter(|trend| trend.is_improbable())?;
        self.refuted_friction().is_none().then(|| {
            format!(
                "The residuals of {} change with {}, which chance hardly does: {}.",
                trend.quantity,
                trend.variable.name(),
                trend.meaning()
            )
        })
    }

    /// Returns the other trends that are significant; what explains the residuals says more than how they run.
    fn other_trends(&self) -> impl Iterator<Item = String> {
        let is_unexplained = self.explanations.is_empty();
        let said = usize::from(self.improbable_trend().is_some());
        let others = self.trends().iter().skip(said);
        let significant = others.filter(move |trend| trend.significant && is_unexplained);
        significant.map(|trend| format!("{}.", capital(&trend.words)))
    }
}

/// A parameter that is known much less where others are not exactly at their bounds.
struct Hidden {
    symbol: &'static str,
    /// Its standard error, and what that would be if the conditions held.
    errors: [f64; 2],
    conditions: Vec<String>,
    /// Symbols of the others that are involved.
    others: Vec<&'static str>,
}

impl Hidden {
    fn sentence(&self) -> String {
        let Self { symbol, errors: [released, conditional], conditions, others } = self;
        format!(
            "These data hardly tell {symbol} from {}: {symbol} is ± {conditional:.2e} if {} exactly, but ± {released:.2e} ({:.0} \
             times as much) if not.",
            others.join(" and "),
            conditions.join(" and "),
            released / conditional
        )
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
