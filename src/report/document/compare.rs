//! compare.json: a comparison for programs.

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::Made;
use crate::compare::{Compared, Comparison, Difference, LikelihoodRatio, Reason, SampleSummary, Value};
use crate::fit::{Computed, Counted, Rejected, Verdict};
use crate::report::compare::counted;
use crate::report::compare_words as words;

/// compare.json of caromfit
///
/// A comparison of data sets. Keys may be added; none is renamed or dropped. Numbers are SI and radians except where a unit stands
/// beside them; null stands for what is not known.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CompareDocument {
    /// What made it.
    #[serde(flatten)]
    pub made: Made,
    /// Whether the numbers can be used.
    pub verdict: Verdict,
    /// Collision model.
    pub fidelity: &'static str,
    /// joint: all frames of films of balls at once; direct: the numbers of tables.
    #[schemars(extend("enum" = ["joint", "direct"]))]
    pub method: &'static str,
    /// How many shots were computed at which fidelity.
    pub computed: Vec<Computed>,
    /// Shots that count less under a robust loss.
    pub robust: Option<ComparedRobust>,
    /// What else a reader may want to know, in sentences.
    pub notes: Vec<String>,
    /// What distinguishes the labels: cloth, data set, or a column.
    pub told_by: String,
    /// What is compared.
    pub labels: Vec<String>,
    /// What a reader must know, in sentences, the most important first.
    pub warnings: Vec<String>,
    /// How the data contradict the model; null if they do not.
    pub refuted: Option<String>,
    /// The data sets or labels, with their shots.
    pub samples: Vec<Sample>,
    /// The parameters.
    pub parameters: Vec<ComparedParameter>,
    /// What chi2 and dof count: angles (and speeds), velocities, coordinates of frames, or impulses of discs.
    pub counted: Counted,
    /// Sum of the squared standardized residuals, priors included.
    #[schemars(with = "Option<f64>")]
    pub chi2: f64,
    /// Degrees of freedom.
    pub dof: usize,
    /// Whether the noise was estimated from the residuals.
    pub noise_estimated: bool,
    /// Whether the search ended at a minimum.
    pub converged: bool,
    /// Why the search ended.
    pub termination: &'static str,
}

/// Shots that count less.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ComparedRobust {
    /// Names of the losses of the data sets.
    pub losses: Vec<&'static str>,
    /// The shots that count less, the least first.
    pub weights: Vec<SampleWeight>,
}

/// The weight of a shot.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SampleWeight {
    /// Title of the sample.
    pub sample: String,
    /// Name of the shot.
    pub shot: String,
    /// Its weight, 0 to 1.
    pub weight: f64,
}

/// A data set, or those of its shots that have one label.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Sample {
    /// The name for a reader.
    pub title: String,
    /// The label that it belongs to.
    pub label: String,
    /// Number of shots that were fitted.
    pub shots_used: usize,
    /// Shots that were left out.
    pub shots_rejected: Vec<Rejected>,
}

/// A parameter over all labels.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ComparedParameter {
    /// Its name.
    pub parameter: &'static str,
    /// The meaning in words.
    pub meaning: &'static str,
    /// Whether it has one value for all labels.
    pub shared: bool,
    /// One value for all, or one for each label.
    pub estimates: Vec<LabelEstimate>,
    /// The differences of all pairs of labels that determine it.
    pub differences: Vec<LabelDifference>,
    /// Test of one value for all against one for each label; null if fewer than two labels determine it.
    pub same_or_different: Option<LikelihoodRatio>,
    /// Labels that do not determine it.
    pub left_out: Vec<LeftOutLabel>,
}

/// The value of a parameter.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LabelEstimate {
    /// The label whose value it is; null: of all.
    pub label: Option<String>,
    /// The value with its error.
    #[serde(flatten)]
    pub value: Value,
}

/// The difference between two labels.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LabelDifference {
    /// The first label.
    pub first: String,
    /// The second label.
    pub second: String,
    /// The difference with its error.
    #[serde(flatten)]
    pub value: Difference,
    /// Whether p_holm is below 0.05.
    pub real: bool,
    /// What the difference means on the table, in words.
    pub effect: Option<String>,
}

/// A label that does not determine a parameter.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LeftOutLabel {
    /// The label.
    pub label: String,
    /// Why it does not.
    pub reason: String,
}

/// As compare.json.
impl Serialize for Comparison {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        CompareDocument::from(self).serialize(serializer)
    }
}

impl From<&Comparison> for CompareDocument {
    fn from(comparison: &Comparison) -> Self {
        let sample = |sample: &SampleSummary| Sample {
            title: sample.title.clone(),
            label: comparison.labels[sample.label].clone(),
            shots_used: sample.shots_used,
            shots_rejected: sample.shots_rejected.clone(),
        };
        let weight = |(sample, shot, weight): &(usize, String, f64)| SampleWeight {
            sample: comparison.samples[*sample].title.clone(),
            shot: shot.clone(),
            weight: *weight,
        };
        let robust = comparison.robust.as_ref().map(|robust| ComparedRobust {
            losses: robust.losses.clone(),
            weights: robust.weights.iter().map(weight).collect(),
        });
        Self {
            made: Made::default(),
            verdict: words::verdict(comparison),
            fidelity: comparison.fidelity,
            method: if comparison.is_filmed { "joint" } else { "direct" },
            computed: comparison.computed.clone(),
            robust,
            notes: words::notes(comparison),
            told_by: comparison.told_by.clone(),
            labels: comparison.labels.clone(),
            warnings: words::warnings(comparison),
            refuted: words::refuted(comparison),
            samples: comparison.samples.iter().map(sample).collect(),
            parameters: comparison.quantities.iter().map(|found| parameter(comparison, found)).collect(),
            counted: counted(comparison),
            chi2: comparison.chi2,
            dof: comparison.dof,
            noise_estimated: comparison.noise_estimated,
            converged: comparison.converged,
            termination: words::termination(comparison),
        }
    }
}

fn parameter(comparison: &Comparison, compared: &Compared) -> ComparedParameter {
    let label = |index: usize| comparison.labels[index].clone();
    let estimate = |value: &Value| LabelEstimate { label: value.label.map(label), value: *value };
    let difference = |difference: &Difference| LabelDifference {
        first: label(difference.first),
        second: label(difference.second),
        real: difference.is_real(),
        effect: words::effect(comparison, difference),
        value: difference.clone(),
    };
    let left_out = |(index, reason): &(usize, Reason)| LeftOutLabel {
        label: label(*index),
        reason: words::reason(*reason, compared.quantity),
    };
    ComparedParameter {
        parameter: compared.quantity.name(),
        meaning: compared.quantity.meaning(),
        shared: compared.shared,
        estimates: compared.estimates.iter().map(estimate).collect(),
        differences: compared.differences.iter().map(difference).collect(),
        same_or_different: compared.same_or_different,
        left_out: compared.left_out.iter().map(left_out).collect(),
    }
}
