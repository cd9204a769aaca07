//! compare.json: a comparison for programs.

use super::{Made, document, each};
use crate::compare::{
    Compared, Comparison, Difference, LikelihoodRatio, Reason, Robust, SampleSummary, Value,
};
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
        notes: Vec<String> = words::notes(comparison),
        /// The distinction of the labels: cloth, data set, or a column.
        told_by: String = comparison.told_by.clone(),
        /// The compared quantities.
        labels: Vec<String> = comparison.labels.clone(),
        /// Warnings, in sentences, the most important first.
        warnings: Vec<String> = words::warnings(comparison),
        /// The data sets or labels, with their shots.
        samples: Vec<SampleSummary> = comparison.samples.clone(),
        /// The parameters.
        parameters: Vec<ComparedParameter> = each(&comparison.quantities, |found| ComparedParameter::new(comparison, found)),
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

    /// A parameter over all labels.
    ComparedParameter(comparison: &Comparison, found: &Compared) {
        /// Its name.
        parameter: &'static str = found.quantity.name(),
        /// The meaning in words.
        meaning: &'static str = found.quantity.meaning(),
        /// Whether it has one value for all labels.
        shared: bool = found.shared,
        /// One value for all, or one for each label.
        estimates: Vec<Value> = found.estimates.clone(),
        /// The differences of all pairs of labels that determine it.
        differences: Vec<Difference> = found.differences.clone(),
        /// Test of one value for all against one for each label; null if fewer than two labels
        /// determine it.
        same_or_different: Option<LikelihoodRatio> = found.same_or_different,
        /// Labels that do not determine it.
        left_out: Vec<LeftOutLabel> = each(&found.left_out, |own| LeftOutLabel::new(comparison, found, own)),
    }

    /// A label that does not determine a parameter.
    LeftOutLabel(comparison: &Comparison, compared: &Compared, found: &(usize, Reason)) {
        /// The label.
        label: String = comparison.labels[found.0].clone(),
        /// Why it does not.
        reason: String = words::reason(found.1, compared.quantity),
    }
}
