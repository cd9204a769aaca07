//! The verdict on a fit: one word and one sentence that stand first everywhere.
//!
//! It is a pure function of the [`Fit`]. What rules the numbers out comes first, then what lets doubt them, the most harmful
//! first; the first that holds is the verdict.

use schemars::JsonSchema;
use serde::Serialize;

use super::check;
use super::check::capital;
use super::diagnostics::goodness::IMPROBABLE;
use super::film_words;
use super::warnings::{Hidden, bound_and_limit, hidden_by_bounds};
use super::{Estimate, Fit, Noise, NoiseVerdict, Status, Trend};
use crate::measurement::dataset::{ON_REQUEST, ObjectBall};
use crate::measurement::number::{self, plain, with_error};
use crate::measurement::observable::Observable;
use crate::measurement::parameter::{Parameter, Prior};
use crate::measurement::written::written_by_name;
use crate::physics::name::{by_name, worded};
use crate::problem::Severity;

/// Of the shots that were used: more doubtful ones than this part decide the result.
const MANY_DOUBTFUL: f64 = 0.1;

worded! {
    /// Whether the numbers of a fit can be used, the best first.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    #[non_exhaustive]
    pub enum Grade {
        /// Nothing that was tested speaks against the numbers.
        Good = "good",
        /// The numbers stand, with one reservation that the sentence states.
        Doubtful = "doubtful",
        /// There are no numbers to use.
        Unusable = "unusable",
    }
    /// The name in fit.json.
    pub fn name;
}

by_name!(Grade, "grade", ALL, name);
written_by_name!(Grade);

/// Whether the numbers can be used.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Verdict {
    /// good: nothing that was tested contradicts the numbers; doubtful: they stand, with one reservation; unusable: there is no
    /// number to use.
    pub grade: Grade,
    /// The reason: what is determined, the one reason for doubt, or why there is nothing to use.
    pub sentence: String,
}

impl Fit {
    /// Whether the numbers can be used, and the one thing to know about them.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        if let Some(sentence) = self.found(Severity::Unusable).or_else(|| self.ruled_out()) {
            return Verdict { grade: Grade::Unusable, sentence };
        }
        if let Some(sentence) = self.found(Severity::Doubtful).or_else(|| self.first_doubt()) {
            return Verdict { grade: Grade::Doubtful, sentence };
        }
        Verdict { grade: Grade::Good, sentence: self.what_is_determined() }
    }

    /// What was found of a film with this severity, the first of all.
    fn found(&self, severity: Severity) -> Option<String> {
        let mut alike = self.findings.iter().filter(|finding| finding.severity() == severity);
        alike.find_map(|finding| film_words::sentence(finding, self.frames.as_ref(), self.stated_scale_sd))
    }

    /// Why no number can be used.
    fn ruled_out(&self) -> Option<String> {
        if let Some(refuted) = &self.refuted {
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
            // where something else is wrong, that is why
            let why = self
                .odd_radius()
                .or_else(|| self.few_used())
                .or_else(|| self.unseen_tilt())
                .or_else(|| self.wrong_footage())
                .or_else(|| self.doubtful_shots());
            // any other is of balls that are confused
            let measured = refuted.restitution.filter(|e| (0.0..=1.0).contains(&e.value)).map(|e| {
                format!("Measured without the model: e = {}.{see}", with_error(e.value, e.std_error))
            });
            let said: Vec<String> = why.into_iter().chain(measured).collect();
            let sentence = format!(
                "No collision of {what} describes these shots: χ²/dof is {}, where 1 is expected. {}",
                plain(refuted.reduced_chi2, 3),
                said.join(" ")
            );
            return Some(sentence.trim_end().to_owned());
        }
        if !self.converged {
            return Some(format!(
                "The search for the best values came to no end ({}): fix parameters under [fit].",
                self.termination
            ));
        }
        let free: Vec<_> = self.of_contact().filter(|e| e.status != Status::Fixed).collect();
        let silent = free.iter().all(|e| e.status == Status::NotIdentified);
        (silent && !free.is_empty()).then(|| {
            format!("These shots determine none of {}.", listed(free.iter().map(|e| e.parameter.symbol())))
        })
    }

    /// The most harmful reason for doubt.
    fn first_doubt(&self) -> Option<String> {
        let found = &self.diagnostics;
        self.few_used()
            .or_else(|| self.wrong_footage())
            .or_else(|| self.unexplained())
            .or_else(|| self.refuted_friction())
            .or_else(|| self.doubtful_shots())
            .or_else(|| self.met_exactly())
            .or_else(|| self.undetermined())
            .or_else(|| self.few_shots())
            .or_else(|| self.untrue_errors())
            .or_else(|| {
                let trend =
                    found.goodness.as_ref()?.trends.iter().find(|trend| trend.p_corrected < IMPROBABLE)?;
                Some(format!(
                    "The residuals of {} change with {}, which chance hardly does: {}.",
                    trend.quantity,
                    trend.variable.name(),
                    trend.meaning()
                ))
            })
    }

    /// Whether residuals from which the noise was to be estimated are all 0.
    pub(super) fn is_met_exactly(&self) -> bool {
        /// Of the rounding of the readings; without one, in rad, m/s, rad/s or as a ratio: smaller residuals are rounding of the search.
        const EXACT: f64 = 1e-6;
        let mut estimated = self.noise.iter().filter(|noise| noise.estimated_sd.is_some()).peekable();
        let is_exact = |noise: &Noise| {
            let is_unknown = noise.estimated_sd.is_some_and(f64::is_nan);
            noise.rounding.or(is_unknown.then_some(1.0)).is_some_and(|size| noise.rms <= EXACT * size)
        };
        self.dof > 0 && estimated.peek().is_some() && estimated.all(is_exact)
    }

    /// Readings that the fit meets exactly.
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

    /// Residuals that the stated noise does not explain.
    fn unexplained(&self) -> Option<String> {
        let goodness = self.diagnostics.goodness.as_ref()?;
        let times = goodness.noise_factor?;
        let noise = if self.footage { "the noise of the frames" } else { "the stated noise" };
        match goodness.noise {
            NoiseVerdict::TooSmall => Some(format!(
                "The residuals are {} times as large as {noise}: the model leaves something out, or the noise and with it the errors are \
                 larger.",
                plain(times, 2)
            )),
            NoiseVerdict::TooLarge => Some(format!(
                "The residuals are only {} times as large as {noise}: the stated errors are too large.",
                plain(times, 2)
            )),
            NoiseVerdict::NotTested | NoiseVerdict::Explains => None,
        }
    }

    /// Of discs that scatter: J_t/J_n that does not follow the slip as it should. e is free of it.
    fn refuted_friction(&self) -> Option<String> {
        self.scatter?;
        let trends = &self.diagnostics.goodness.as_ref()?.trends;
        let of_friction = |trend: &&Trend| {
            trend.p_corrected < IMPROBABLE && trend.quantity == Observable::ImpulseRatio.label()
        };
        let trend = trends.iter().find(of_friction)?;
        let e = self.get(Parameter::E).and_then(|e| Some(with_error(e.value, e.std_error?)));
        let free = e.map_or(String::new(), |e| format!(" e = {e} does not rest on it."));
        Some(format!(
            "The shots refute the friction that is fitted: what it leaves of J_t/J_n changes with {}, which chance hardly does.{free}",
            trend.variable.name()
        ))
    }

    /// Too many of the shots that were used are doubtful themselves.
    fn doubtful_shots(&self) -> Option<String> {
        let first = self.shots_doubtful.first()?;
        let count = self.shots_doubtful.len();
        (count as f64 > MANY_DOUBTFUL * self.shots_used as f64).then(|| {
            format!(
                "{count} of the {} shots that were used are doubtful; the first is shot {}: {}.",
                self.shots_used,
                first.shot,
                // the details stand in the report
                first.reason.split([':', ';', '(']).next().unwrap_or_default().trim_end()
            )
        })
    }

    /// A value that these data leave open.
    fn undetermined(&self) -> Option<String> {
        let found = &self.diagnostics;
        if let Some(plateau) = found.plateaus.first() {
            let symbol = plateau.parameter.symbol();
            let why = match plateau.parameter {
                Parameter::Mu if self.discs.is_some() => {
                    ": the discs stick together where they touch. Thinner hits determine it"
                }
                Parameter::Mu => {
                    ": the balls stick together where they touch. Thinner cuts, or faster shots, determine it"
                }
                _ => ": beyond, nothing depends on it",
            };
            let side = if plateau.bound >= plateau.edge { "at least" } else { "at most" };
            return Some(format!("{symbol} is known to be {side} {} only{why}.", plain(plateau.edge, 3)));
        }
        let worst = found.identifiability.as_ref().and_then(|found| found.worst.as_ref());
        if let Some(worst) = worst.filter(|worst| worst.undetermined) {
            return Some(format!("{}.", capital(&worst.words)));
        }
        let at_bound = self.estimates.iter().find_map(|estimate| {
            let (side, limit) = bound_and_limit(estimate, 2)?;
            let limit = limit.map_or(String::new(), |limit| format!(" ({limit} at 95 %)"));
            let symbol = estimate.parameter.symbol();
            Some(format!(
                "{symbol} ends on its {side} bound {}{limit}{}.",
                plain(estimate.value, 3),
                self.bound_hides()
            ))
        });
        at_bound.or_else(|| {
            let worst = worst.filter(|worst| worst.weak)?;
            Some(format!("{}.", capital(&worst.words)))
        })
    }

    /// Which parameter is known only if a bound is the truth.
    fn bound_hides(&self) -> String {
        let hidden = hidden_by_bounds(self).find(|hidden| !hidden.others.is_empty());
        hidden.map_or(String::new(), |Hidden { parameter, others, .. }| {
            format!(", and these shots hardly tell {} from {}", parameter.symbol(), others.join(" and "))
        })
    }

    /// Too few shots to believe what they agree on.
    fn few_shots(&self) -> Option<String> {
        let used = self.shots_used;
        let shots = number::count_of(used, "shot");
        // errors of discs are those of their frames
        if self.dof == 0 && self.discs.is_none() {
            let has_errors = self.estimates.iter().any(|estimate| estimate.std_error.is_some());
            let errors = if has_errors { "" } else { "no error can be stated, and " };
            return Some(format!(
                "There are as many unknown values as measured ones ({shots}): {errors}nothing tests the model."
            ));
        }
        (used < check::FEW_SHOTS).then(|| {
            format!(
                "{} not enough to show how much shots differ.",
                if used == 1 { "1 shot is".to_owned() } else { format!("{shots} are") }
            )
        })
    }

    /// Errors that are smaller than they should be.
    fn untrue_errors(&self) -> Option<String> {
        self.diagnostics.has_rival.then(|| {
            "Other values fit nearly as well: more shots, or a prior, decide between them.".to_owned()
        })
    }

    /// That more shots were left out than are wrong now and then; of a table, any.
    fn many_left_out(&self) -> Option<String> {
        /// Of all shots.
        const SELDOM: f64 = 0.15;
        let rejected = self.shots_rejected.iter().filter(|shot| shot.reason != ON_REQUEST);
        let unwanted = rejected.clone().count();
        let all = self.shots_used + unwanted;
        if let Some(first) = rejected.clone().next().filter(|_| !self.footage) {
            let others =
                if unwanted == 1 { String::new() } else { format!(", the first of {unwanted} of {all},") };
            return Some(format!(" Shot {}{others} was left out: {}.", first.shot, first.reason));
        }
        (unwanted as f64 > (SELDOM * all as f64).max(1.0))
            .then(|| format!(" {unwanted} of {all} shots were left out: the report says why."))
    }

    /// What is determined, and what tests it.
    fn what_is_determined(&self) -> String {
        let with = |status: Status| {
            let alike = self.of_contact().filter(move |e| e.status == status);
            alike.map(|e| e.parameter.symbol()).collect::<Vec<_>>()
        };
        let (free, silent) = (with(Status::Free), with(Status::NotIdentified));
        let shots = number::count_of(self.shots_used, "shot");
        let verb = if self.shots_used == 1 { "determines" } else { "determine" };
        let what = if free.is_empty() {
            format!("All parameters were held, and compared with {shots}")
        } else {
            format!("{shots} {verb} {}", listed(free.into_iter()))
        };
        let goodness = self.diagnostics.goodness.as_ref();
        let test = match goodness.filter(|goodness| goodness.p_value.is_some() && goodness.dof > 0) {
            Some(found) => {
                format!(
                    "; the noise explains the residuals of {} (χ²/dof = {:.2})",
                    self.counted().words(),
                    found.chi2 / found.dof as f64
                )
            }
            None if self.scatter.is_some_and(|scatter| scatter.is_estimated) => {
                format!("; {}", film_words::scatter(&self.scatter.unwrap_or_default()))
            }
            None if self.diagnostics.robust.is_some() => "; outlying shots count less".to_owned(),
            None => "; the noise was estimated from the residuals, so that χ² tests nothing".to_owned(),
        };
        let open = if silent.is_empty() {
            String::new()
        } else {
            format!(". They say nothing about {}", listed(silent.into_iter()))
        };
        let others = self.many_left_out().into_iter().chain(self.limited_by_masses());
        format!("{what}{test}{open}.{}", others.collect::<String>())
    }

    /// Returns what was known of m_cue/m_object before the fit; `None` of exact masses and of discs.
    fn stated_mass_ratio(&self) -> Option<Prior> {
        let object = self.object.unwrap_or(ObjectBall::unweighed(self.ball));
        let sd = object.mass_ratio_sd(self.ball).filter(|_| self.discs.is_none())?;
        Some(Prior { mean: self.ball.mass / object.ball.mass, sd })
    }

    /// That most of an error is due to masses that were not weighed: of the variance of a parameter, what would be gained by knowing
    /// m_cue/m_object = r exactly is Cov²/Var(r).
    fn limited_by_masses(&self) -> Option<String> {
        /// The standard deviation of m_cue/m_object of balls of 170 g that are each weighed to 0.1 g is 0.0008.
        const WEIGHED: f64 = 0.001;
        /// Of a variance.
        const MOST: f64 = 0.5;
        if self.stated_mass_ratio()?.sd < WEIGHED {
            return None;
        }
        let ratio = self.estimates.iter().position(|e| e.parameter == Parameter::MassRatio)?;
        let share = |(i, estimate): (usize, &Estimate)| {
            let error = estimate.std_error.filter(|_| estimate.parameter != Parameter::MassRatio)?;
            let correlation = self.correlation[(i, ratio)];
            (correlation.powi(2) > MOST).then_some((estimate.parameter.symbol(), error, correlation.abs()))
        };
        let limited = self.estimates.iter().enumerate().filter_map(share);
        let (symbol, error, part) = limited.max_by(|a, b| a.2.total_cmp(&b.2))?;
        Some(format!(
            " Of the error of {symbol}, ± {}, {} is the mass ratio: weigh both balls to 0.1 g.",
            plain(error, 2),
            plain(part * error, 2)
        ))
    }
}

/// `μ`, `μ and e`, `μ, μ_s and e`.
fn listed<'a>(symbols: impl Iterator<Item = &'a str>) -> String {
    let symbols: Vec<&str> = symbols.collect();
    match symbols.as_slice() {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [others @ .., last] => format!("{} and {last}", others.join(", ")),
    }
}
