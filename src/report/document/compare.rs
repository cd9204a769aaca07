//! compare.json: a comparison for programs.

use super::{Made, document, each};
use crate::compare::{
    Compared, Comparison, Difference, LikelihoodRatio, Reason, Robust, SampleSummary, Value,
};
use crate::fit::{Computed, Counted, Rejected, Verdict};
use crate::report::compare as words;

document! {
    /// compare.json of caromfit
    ///
    /// A comparison of data sets. Numbers are SI and radians except where a unit stands beside them; null stands for what is not known.
    CompareDocument(comparison: &Comparison) [made: Made] {
        /// Whether the numbers can be used.
        verdict: Verdict = words::verdict(comparison),
        /// Collision model.
        fidelity: &'static str = comparison.fidelity,
        /// joint: all frames of films of balls at once; direct: the numbers of tables.
        #[schemars(extend("enum" = ["joint", "direct"]))]
        method: &'static str = if comparison.is_filmed { "joint" } else { "direct" },
        /// How many shots were computed at which fidelity.
        computed: Vec<Computed> = comparison.computed.clone(),
        /// Shots that count less under a robust loss.
        robust: Option<ComparedRobust> = comparison.robust.as_ref().map(|robust| ComparedRobust::new(comparison, robust)),
        /// Notes, in sentences.
        notes: Vec<String> = words::notes(comparison),
        /// The distinction of the labels: cloth, data set, or a column.
        told_by: String = comparison.told_by.clone(),
        /// The compared quantities.
        labels: Vec<String> = comparison.labels.clone(),
        /// Warnings, in sentences, the most important first.
        warnings: Vec<String> = words::warnings(comparison),
        /// The data sets or labels, with their shots.
        samples: Vec<Sample> = each(&comparison.samples, |sample| Sample::new(comparison, sample)),
        /// The parameters.
        parameters: Vec<ComparedParameter> = each(&comparison.quantities, |found| ComparedParameter::new(comparison, found)),
        /// The numbers that chi2 and dof count: angles (and speeds), velocities, coordinates of frames, or impulses of discs.
        counted: Counted = words::counted(comparison),
        /// Sum of the squared standardized residuals, priors included.
        #[schemars(with = "Option<f64>")]
        chi2: f64 = comparison.chi2,
        /// Degrees of freedom.
        dof: usize = comparison.dof,
        /// Whether the noise was estimated from the residuals.
        noise_estimated: bool = comparison.noise_estimated,
        /// Whether the search ended at a minimum.
        converged: bool = comparison.converged,
        /// Why the search ended.
        termination: &'static str = words::termination(comparison),
    }

    /// Shots that count less.
    ComparedRobust(comparison: &Comparison, robust: &Robust) {
        /// Names of the losses of the data sets.
        losses: Vec<&'static str> = robust.losses.clone(),
        /// The shots that count less, the least first.
        weights: Vec<SampleWeight> = each(&robust.weights, |own| SampleWeight::new(comparison, own)),
    }

    /// The weight of a shot.
    SampleWeight(comparison: &Comparison, found: &(usize, String, f64)) {
        /// Title of the sample.
        sample: String = comparison.samples[found.0].title.clone(),
        /// Name of the shot.
        shot: String = found.1.clone(),
        /// Its weight, 0 to 1.
        weight: f64 = found.2,
    }

    /// A data set, or those of its shots that have one label.
    Sample(comparison: &Comparison, sample: &SampleSummary) {
        /// The name for a reader.
        title: String = sample.title.clone(),
        /// The label that it belongs to.
        label: String = comparison.labels[sample.label].clone(),
        /// Number of shots that were fitted.
        shots_used: usize = sample.shots_used,
        /// Shots that were left out.
        shots_rejected: Vec<Rejected> = sample.shots_rejected.clone(),
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
        estimates: Vec<LabelEstimate> = each(&found.estimates, |own| LabelEstimate::new(comparison, own)),
        /// The differences of all pairs of labels that determine it.
        differences: Vec<LabelDifference> = each(&found.differences, |own| LabelDifference::new(comparison, own)),
        /// Test of one value for all against one for each label; null if fewer than two labels determine it.
        same_or_different: Option<LikelihoodRatio> = found.same_or_different,
        /// Labels that do not determine it.
        left_out: Vec<LeftOutLabel> = each(&found.left_out, |own| LeftOutLabel::new(comparison, found, own)),
    }

    /// The value of a parameter.
    LabelEstimate(comparison: &Comparison, found: &Value) {
        /// The label whose value it is; null: of all.
        label: Option<String> = found.label.map(|label| comparison.labels[label].clone()),
        /// The value with its error.
        #[serde(flatten)]
        value: Value = *found,
    }

    /// The difference between two labels.
    LabelDifference(comparison: &Comparison, found: &Difference) {
        /// The first label.
        first: String = comparison.labels[found.first].clone(),
        /// The second label.
        second: String = comparison.labels[found.second].clone(),
        /// The difference with its error.
        #[serde(flatten)]
        value: Difference = found.clone(),
        /// Whether p_holm is below 0.05.
        real: bool = found.is_real(),
    }

    /// A label that does not determine a parameter.
    LeftOutLabel(comparison: &Comparison, compared: &Compared, found: &(usize, Reason)) {
        /// The label.
        label: String = comparison.labels[found.0].clone(),
        /// Why it does not.
        reason: String = words::reason(found.1, compared.quantity),
    }
}
