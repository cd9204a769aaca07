//! compare.json: a comparison for programs.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};

use super::{Computed, Made, ShotReason, Verdict, each, finite};
use crate::compare::{self, Comparison};
use crate::fit::Counted;
use crate::report::compare::counted;
use crate::report::compare_words as words;

/// compare.json of caromfit
///
/// A comparison of data sets. Keys may be added; none is renamed or dropped. Numbers are SI and radians except where a unit stands
/// beside them; null stands for what is not known.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct CompareDocument {
    /// What made it.
    #[serde(flatten)]
    pub made: Made,
    /// Whether the numbers can be used.
    pub verdict: Verdict,
    /// Collision model.
    pub fidelity: String,
    /// joint: all frames of films of balls at once; direct: the numbers of tables.
    #[schemars(extend("enum" = ["joint", "direct"]))]
    pub method: String,
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
    #[schemars(extend("enum" = Counted::ALL.map(Counted::name)))]
    pub counted: String,
    /// Sum of the squared standardized residuals, priors included.
    pub chi2: Option<f64>,
    /// Degrees of freedom.
    pub dof: usize,
    /// Whether the noise was estimated from the residuals.
    pub noise_estimated: bool,
    /// Whether the search ended at a minimum.
    pub converged: bool,
    /// Why the search ended.
    pub termination: String,
}

/// Shots that count less.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ComparedRobust {
    /// Names of the losses of the data sets.
    pub losses: Vec<String>,
    /// The shots that count less, the least first.
    pub weights: Vec<SampleWeight>,
}

/// The weight of a shot.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SampleWeight {
    /// Title of the sample.
    pub sample: String,
    /// Name of the shot.
    pub shot: String,
    /// Its weight, 0 to 1.
    pub weight: f64,
}

/// A data set, or those of its shots that have one label.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Sample {
    /// The name for a reader.
    pub title: String,
    /// The label that it belongs to.
    pub label: String,
    /// Number of shots that were fitted.
    pub shots_used: usize,
    /// Shots that were left out.
    pub shots_rejected: Vec<ShotReason>,
}

/// A parameter over all labels.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ComparedParameter {
    /// Its name.
    pub parameter: String,
    /// The meaning in words.
    pub meaning: String,
    /// Whether it has one value for all labels.
    pub shared: bool,
    /// One value for all, or one for each label.
    pub estimates: Vec<LabelEstimate>,
    /// The differences of all pairs of labels that determine it.
    pub differences: Vec<LabelDifference>,
    /// Test of one value for all against one for each label; null if fewer than two labels determine it.
    pub same_or_different: Option<SameOrDifferent>,
    /// Labels that do not determine it.
    pub left_out: Vec<LeftOutLabel>,
}

/// The value of a parameter.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LabelEstimate {
    /// The label whose value it is; null: of all.
    pub label: Option<String>,
    /// The value, in the unit of the parameter.
    pub estimate: Option<f64>,
    /// Its standard error, same unit.
    pub std_error: Option<f64>,
    /// Its 95 % interval: lower and upper end.
    pub interval_95: Option<[Option<f64>; 2]>,
    /// Whether it was fitted; else it was held, or the data do not determine it.
    pub fitted: bool,
    /// Whether it ended at a bound.
    pub at_bound: bool,
}

/// The difference between two labels.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LabelDifference {
    /// The first label.
    pub first: String,
    /// The second label.
    pub second: String,
    /// Value of the second label less that of the first, in the unit of the parameter.
    pub difference: Option<f64>,
    /// Its standard error.
    pub std_error: Option<f64>,
    /// Its 95 % interval: lower and upper end.
    pub interval_95: [Option<f64>; 2],
    /// Two-sided probability of such a difference by chance, for this pair alone.
    pub p_value: Option<f64>,
    /// p_value corrected for all pairs of all parameters (Holm).
    pub p_holm: Option<f64>,
    /// Whether p_holm is below 0.05.
    pub real: bool,
    /// What the difference means on the table, in words.
    pub effect: Option<String>,
}

/// A test of one value for all against one for each label.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SameOrDifferent {
    /// The statistic: twice the logarithm of the ratio of likelihoods, or the rise of χ²; or Wald's statistic.
    pub likelihood_ratio: Option<f64>,
    /// Kind of the test: likelihood ratio, or Wald statistic.
    pub test: String,
    /// How many more parameters one value for each takes.
    pub extra_parameters: usize,
    /// Probability of a larger statistic if the value is the same for all.
    pub p_value: Option<f64>,
    /// Akaike's criterion of one value for each less that of one for all: negative favours a difference.
    pub delta_aic: Option<f64>,
}

/// A label that does not determine a parameter.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
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
        let sample = |sample: &compare::SampleSummary| Sample {
            title: sample.title.clone(),
            label: comparison.labels[sample.label].clone(),
            shots_used: sample.shots_used,
            shots_rejected: each(&sample.shots_rejected),
        };
        let weight = |(sample, shot, weight): &(usize, String, f64)| SampleWeight {
            sample: comparison.samples[*sample].title.clone(),
            shot: shot.clone(),
            weight: *weight,
        };
        let robust = comparison.robust.as_ref().map(|robust| ComparedRobust {
            losses: robust.losses.iter().map(|loss| (*loss).to_owned()).collect(),
            weights: robust.weights.iter().map(weight).collect(),
        });
        Self {
            made: Made::default(),
            verdict: words::verdict(comparison),
            fidelity: comparison.fidelity.to_owned(),
            method: if comparison.is_filmed { "joint" } else { "direct" }.to_owned(),
            computed: each(&comparison.computed),
            robust,
            notes: words::notes(comparison),
            told_by: comparison.told_by.clone(),
            labels: comparison.labels.clone(),
            warnings: words::warnings(comparison),
            refuted: words::refuted(comparison),
            samples: comparison.samples.iter().map(sample).collect(),
            parameters: comparison
                .quantities
                .iter()
                .map(|compared| parameter(comparison, compared))
                .collect(),
            counted: counted(comparison).name().to_owned(),
            chi2: finite(comparison.chi2),
            dof: comparison.dof,
            noise_estimated: comparison.noise_estimated,
            converged: comparison.converged,
            termination: words::termination(comparison).to_owned(),
        }
    }
}

fn parameter(comparison: &Comparison, compared: &compare::Compared) -> ComparedParameter {
    let label = |index: usize| comparison.labels[index].clone();
    let estimate = |value: &compare::Value| LabelEstimate {
        label: value.label.map(label),
        estimate: finite(value.value),
        std_error: value.std_error.and_then(finite),
        interval_95: value.interval_95.map(|ends| ends.map(finite)),
        fitted: value.fitted,
        at_bound: value.at_bound,
    };
    let difference = |difference: &compare::Difference| LabelDifference {
        first: label(difference.first),
        second: label(difference.second),
        difference: finite(difference.value),
        std_error: finite(difference.std_error),
        interval_95: difference.interval_95.map(finite),
        p_value: finite(difference.p_value),
        p_holm: finite(difference.p_holm),
        real: difference.is_real(),
        effect: words::effect(comparison, difference),
    };
    let same_or_different = compared.same_or_different.map(|test| SameOrDifferent {
        likelihood_ratio: finite(test.statistic),
        test: test.by.name().to_owned(),
        extra_parameters: test.extra_parameters,
        p_value: finite(test.p_value),
        delta_aic: finite(test.delta_aic),
    });
    let left_out = |(index, reason): &(usize, compare::Reason)| LeftOutLabel {
        label: label(*index),
        reason: words::reason(*reason, compared.quantity),
    };
    ComparedParameter {
        parameter: compared.quantity.name().to_owned(),
        meaning: compared.quantity.meaning().to_owned(),
        shared: compared.shared,
        estimates: compared.estimates.iter().map(estimate).collect(),
        differences: compared.differences.iter().map(difference).collect(),
        same_or_different,
        left_out: compared.left_out.iter().map(left_out).collect(),
    }
}
