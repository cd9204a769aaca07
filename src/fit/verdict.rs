//! The verdict on a fit: one word and one sentence that stand first everywhere, those of the worst
//! of its doubts.

use schemars::JsonSchema;
use serde::Serialize;

use super::doubts::listed;
use super::{Budget, Fit, Id, Remark, Status, film_words};
use crate::measurement::number::{self, plain};
use crate::measurement::parameter::Parameter;
use crate::measurement::written::written_by_name;
use crate::physics::name::{by_name, worded};
use crate::problem::Severity;

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
        match self.doubts().into_iter().next() {
            Some(Remark { severity: Severity::Unusable, sentence, .. }) => {
                Verdict { grade: Grade::Unusable, sentence }
            }
            Some(Remark { severity: Severity::Doubtful, sentence, .. }) => {
                Verdict { grade: Grade::Doubtful, sentence }
            }
            _ => Verdict { grade: Grade::Good, sentence: self.what_is_determined() },
        }
    }

    /// Returns that more shots were left out than are wrong now and then; of a table, any.
    fn many_left_out(&self) -> Option<String> {
        /// Part of all shots.
        const SELDOM: f64 = 0.15;
        let rejected = self.unwanted();
        let (first, unwanted) = (rejected.first()?, rejected.len());
        let all = self.shots_used + unwanted;
        if self.footage {
            let is_often = unwanted as f64 > (SELDOM * all as f64).max(1.0);
            return is_often
                .then(|| format!(" {unwanted} of {all} shots were left out: the report says why."));
        }
        let others =
            if unwanted == 1 { String::new() } else { format!(", the first of {unwanted} of {all},") };
        Some(format!(" Shot {}{others} was left out: {}.", first.shot, first.reason))
    }

    /// Returns what is determined, and what tests it.
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
            None => "; the noise was estimated from the residuals, so that χ² is not a test".to_owned(),
        };
        let open = if silent.is_empty() {
            String::new()
        } else {
            format!(". They do not determine {}", listed(silent.into_iter()))
        };
        let others = self.many_left_out().into_iter().chain(self.limited_by_masses());
        format!("{what}{test}{open}.{}", others.collect::<String>())
    }

    /// Returns that most of the variance of a parameter is due to masses that were not weighed.
    fn limited_by_masses(&self) -> Option<String> {
        /// The standard deviation of m_cue/m_object of balls of 170 g that are each weighed to 0.1
        /// g is 0.0008.
        const WEIGHED: f64 = 0.001;
        /// Part of a variance.
        const LARGE_MASS_PART: f64 = 0.5;
        self.solution.get(Id::MassRatio)?.prior.filter(|prior| prior.sd >= WEIGHED)?;
        let share = |budget: &Budget| {
            let masses = budget.shares.iter().find(|share| share.nuisance == Id::MassRatio)?.variance;
            let all = budget.shares.iter().map(|share| share.variance).sum::<f64>() + budget.noise;
            let parameter = Parameter::COEFFICIENTS.into_iter().find(|p| Id::from(*p) == budget.id)?;
            (masses > LARGE_MASS_PART * all).then_some((parameter.symbol(), all, masses))
        };
        let limited = self.budget.iter().filter_map(share);
        let (symbol, all, masses) = limited.max_by(|a, b| (a.2 / a.1).total_cmp(&(b.2 / b.1)))?;
        Some(format!(
            " Of the error of {symbol}, ± {}, {} is the mass ratio: weigh both balls to 0.1 g.",
            plain(all.sqrt(), 2),
            plain(masses.sqrt(), 2)
        ))
    }
}

#[cfg(test)]
mod tests {
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

    /// Doubts that searches of simulated shots seldom raise, the most harmful last: each is said
    /// whichever others stand beside it.
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
            (|fit| fit.diagnostics.has_rival = true, Grade::Doubtful, "Other values fit nearly as well"),
            (|fit| is_open(fit, false), Grade::Doubtful, "Only the product μ·μ_s is determined."),
            (|fit| is_open(fit, true), Grade::Doubtful, "Only the product μ·μ_s is determined. The values"),
            (|fit| fit.converged = false, Grade::Unusable, "came to no end (χ² has settled)"),
        ];
        for (doubt, grade, said) in doubts {
            let mut one = good.clone();
            for fit in [&mut one, &mut all] {
                doubt(fit);
                let verdict = fit.verdict();
                assert_eq!(verdict.grade, grade, "{said}");
                assert!(verdict.sentence.contains(said), "{verdict:?}");
            }
        }
    }
}
