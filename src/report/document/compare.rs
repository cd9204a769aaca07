//! compare.json: a comparison for programs.

use super::{Made, document, each};
use crate::compare::{Compared, Comparison, Robust, SampleSummary};
use crate::fit::{Computed, Counted, Verdict};
use crate::physics::collision::Fidelity;
use crate::report::compare as words;

document! {
    /// compare.json of caromfit
    ///
    /// A comparison of data sets. Numbers are SI and radians except where a unit stands beside
    /// them; null stands for what is not known.
    CompareDocument(comparison: &Comparison) [made: Made, of Comparison] {
        /// Whether the numbers can be used.
        verdict: Verdict = words::verdict(comparison),
        /// Collision model.
        fidelity: &'static str = comparison.fidelity.map_or("auto", Fidelity::name),
        /// joint: all frames of films of balls at once; direct: the numbers of tables.
        #[schemars(extend("enum" = ["joint", "direct"]))]
        method: &'static str = if words::counted(comparison) == Counted::Coordinates { "joint" } else { "direct" },
        /// How many shots were computed at which fidelity.
        computed: Vec<Computed> = Computed::of(&comparison.solution, comparison.fidelity),
        /// Shots that count less under a robust loss.
        robust: Option<Robust> = comparison.robust.clone(),
        /// Notes, in sentences.
        notes: Vec<String> = each(&comparison.notes(), |note| (*note).to_owned()),
        /// The distinction of the labels: cloth, data set, or a column.
        told_by: String = comparison.told_by.clone(),
        /// The compared quantities.
        labels: Vec<String> = comparison.labels.clone(),
        /// Warnings, in sentences, the most important first.
        warnings: Vec<String> = each(&comparison.warnings(), |warning| (*warning).to_owned()),
        /// The data sets or labels, with their shots.
        samples: Vec<SampleSummary> = comparison.samples.clone(),
        /// The parameters.
        parameters: Vec<Compared> = comparison.quantities.clone(),
        /// The numbers that chi2 and dof count: angles (and speeds), velocities, coordinates of
        /// frames, or impulses of discs.
        counted: Counted = words::counted(comparison),
        /// Sum of the squared standardized residuals, priors included.
        #[schemars(with = "Option<f64>")]
        chi2: f64 = comparison.chi2(),
        /// Degrees of freedom.
        dof: usize = comparison.solution.dof(),
        /// Whether the noise was estimated from the residuals.
        noise_estimated: bool = comparison.noise_estimated,
        /// Whether the search ended at a minimum.
        converged: bool = comparison.solution.converged,
        /// Why the search ended.
        termination: &'static str = words::termination(comparison),
    }
}
