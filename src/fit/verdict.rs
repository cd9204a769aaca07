//! The verdict on a fit: one word and one sentence that stand first everywhere, those of the worst
//! of its doubts.

use minijinja::value::Serde;
use minijinja::{Value as Values, context};
use schemars::JsonSchema;
use serde::Serialize;

use super::doubts::FOOTAGE;
use super::film_words::words_of;
use super::{Budget, Fit, Id, Status};
use crate::measurement::written::written_by_name;
use crate::name::{by_name, worded};
use crate::problem::Severity;
use crate::words::symbol;

/// Part of all shots of a film that may be left out as wrong ones now and then.
const SELDOM: f64 = 0.15;

/// Standard deviation of m_cue/m_object of balls of 170 g that are each weighed to 0.1 g: 0.0008.
const WEIGHED: f64 = 0.001;

worded! {
    /// Whether the numbers of a fit can be used, the best first.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    #[non_exhaustive]
    pub enum Grade {
        /// No test contradicts the numbers.
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

impl Grade {
    /// Returns the grade of numbers whose worst finding has this severity.
    pub(crate) fn of(worst: Option<Severity>) -> Self {
        match worst {
            Some(Severity::Unusable) => Self::Unusable,
            Some(Severity::Doubtful) => Self::Doubtful,
            _ => Self::Good,
        }
    }
}

/// Whether the numbers can be used.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Verdict {
    /// good: no test contradicts the numbers; doubtful: they stand, with one reservation; unusable:
    /// the numbers cannot be used.
    pub grade: Grade,
    /// The reason: what is determined, the one reason for doubt, or why the numbers cannot be used.
    pub sentence: String,
}

impl Fit {
    /// Returns whether the numbers can be used, and the one thing to know about them.
    pub fn verdict(&self) -> Verdict {
        let worst = self.remarks.first();
        let grade = Grade::of(worst.map(|worst| worst.severity));
        let mut sentence = worst.map_or_else(String::new, |worst| worst.sentence.clone());
        if grade == Grade::Good {
            sentence = self.what_is_determined();
        } else if grade == Grade::Unusable && self.is_refuted() {
            let why = self.remarks.iter().find(|remark| remark.kind == FOOTAGE);
            sentence.extend(why.map(|why| format!(" {}", why.sentence)));
        }
        Verdict { grade, sentence }
    }

    /// Returns what is determined, and what tests it.
    fn what_is_determined(&self) -> String {
        let with = |status: Status| {
            let alike = self.of_contact().filter(move |e| e.status == status);
            alike.map(|e| e.parameter.symbol()).collect::<Vec<_>>()
        };
        let goodness = &self.diagnostics.goodness;
        let is_tested = goodness.p_value.is_some() && goodness.dof > 0;
        let rejected = self.unwanted();
        let all_shots = self.shots_used() + rejected.len();
        let are_few = rejected.len() as f64 <= (SELDOM * all_shots as f64).max(1.0);
        let values = context! {
            shots => self.shots_used(),
            free => with(Status::Free),
            silent => with(Status::NotIdentified),
            counted => self.counted().words(),
            reduced_chi2 => is_tested.then(|| goodness.chi2 / goodness.dof as f64),
            scatter => self.scatter.map(|scatter| words_of("scatter", Values::from(Serde(scatter)))),
            robust => self.diagnostics.robust.is_some(),
            film => self.footage,
            of => all_shots,
            unwanted => if self.footage && are_few { 0 } else { rejected.len() },
            first => rejected.first().map(Serde),
            masses => self.limited_by_masses(),
        };
        words_of("determined", values)
    }

    /// Returns symbol and error of what unweighed masses mostly limit, and their part of it.
    fn limited_by_masses(&self) -> Option<(&'static str, f64, f64)> {
        self.solution.get(Id::MassRatio)?.prior.filter(|prior| prior.sd >= WEIGHED)?;
        let share = |budget: &Budget| {
            let (_, masses) = budget.parts.iter().find(|(source, _)| *source == Id::MassRatio.name())?;
            let all = budget.std_error();
            (masses.powi(2) > 0.5 * all.powi(2)).then_some((symbol(budget.id.name()), all, *masses))
        };
        let limited = self.budget.iter().filter_map(share);
        limited.max_by(|a, b| (a.2 / a.1).total_cmp(&(b.2 / b.1)))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::{Fit, Grade};
    use crate::fit::{self, Depth, Options};
    use crate::problem::Combination;
    use crate::simulate::{self, Spec};

    type Doubt = fn(&mut Fit);

    fn is_open(fit: &mut Fit, undetermined: bool) {
        let worst = fit.diagnostics.identifiability.as_mut().and_then(|found| found.worst.as_mut()).unwrap();
        let words = "only the product μ·μ_s is determined".to_owned();
        *worst = Combination { weak: true, undetermined, words, ..worst.clone() };
    }

    fn has_not_ended(fit: &mut Fit) {
        Arc::make_mut(&mut fit.solution).converged = false;
    }

    /// Doubts that searches of simulated shots seldom raise, the most harmful last.
    #[test]
    fn the_most_harmful_doubt_is_said_first() {
        let spec = "name = \"a\"\nkind = \"angles\"\nseed = 1\ntruth = { mu = 0.05, mu_s = 0.3, e = 0.94 }\n\
                    noise = { velocity_m_s = 0.004, angle_deg = 0.2 }\nobject = { mass_kg_sd = 0 }\n\
                    shots = { count = 10, speed_m_s = [1, 4], cut_deg = [-50, 50], cue_spin = [\"natural-roll\"] }";
        let dataset = simulate::dataset(&spec.parse::<Spec>().unwrap()).unwrap();
        let options = Options { depth: Depth::Estimates, ..Options::default() };
        let good = fit::fit(&dataset, &options).unwrap().remove(0);
        assert_eq!(good.verdict().grade, Grade::Good, "{:?}", good.verdict());
        let mut all = good.clone();
        let doubts: [(Doubt, Grade, &str); 4] = [
            (
                |fit| fit.estimates[0].includes_other_minimum = true,
                Grade::Doubtful,
                "Other values fit nearly as well",
            ),
            (|fit| is_open(fit, false), Grade::Doubtful, "Only the product μ·μ_s is determined."),
            (|fit| is_open(fit, true), Grade::Doubtful, "Only the product μ·μ_s is determined. The values"),
            (has_not_ended, Grade::Unusable, "came to no end (too many steps)"),
        ];
        for (doubt, grade, said) in doubts {
            let mut one = good.clone();
            for fit in [&mut one, &mut all] {
                doubt(fit);
                fit.remarks = fit.doubts(&[]);
                let verdict = fit.verdict();
                assert_eq!(verdict.grade, grade, "{said}");
                assert!(verdict.sentence.contains(said), "{verdict:?}");
            }
        }
    }
}
