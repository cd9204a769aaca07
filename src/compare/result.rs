//! The result of a comparison.

use schemars::JsonSchema;
use serde::Serialize;

use super::findings::{Finding, Reason};
use super::quantity::Quantity;
use crate::fit::{Computed, Grade, Rejected, Residual};
use crate::measurement::written::written_by_name;
use crate::physics::name::worded;
use crate::problem::Severity;

/// The result of a comparison: a value, which [`crate::report`] renders.
#[derive(Clone, Debug)]
pub struct Comparison {
    pub(crate) labels: Vec<String>,
    /// Kind of the labels: `cloth`, `data set`, or the column of `[fit] by`.
    pub(crate) told_by: String,
    pub(crate) fidelity: &'static str,
    /// Whether films were compared, by all their frames.
    pub(crate) is_filmed: bool,
    /// How many shots were computed at which fidelity and with which effects on.
    pub(crate) computed: Vec<Computed>,
    /// The samples, in the order of the data sets and their labels.
    pub(crate) samples: Vec<SampleSummary>,
    /// The quantities that were compared.
    pub(crate) quantities: Vec<Compared>,
    /// χ² of the joint fit.
    pub(crate) chi2: f64,
    /// Its degrees of freedom.
    pub(crate) dof: usize,
    pub(crate) noise_estimated: bool,
    /// Whether the search ended at a minimum.
    pub(crate) converged: bool,
    pub(crate) residuals: Vec<LabelResidual>,
    /// How robust losses weighted the shots, if data sets have any.
    pub(crate) robust: Option<Robust>,
    /// The findings, the most important first.
    pub(crate) findings: Vec<Finding>,
}

impl Comparison {
    /// Returns whether the numbers can be used, with a reservation or without.
    pub fn grade(&self) -> Grade {
        let compares = self.quantities.iter().any(|quantity| !quantity.differences.is_empty());
        match self.findings.iter().map(Finding::severity).max() {
            Some(Severity::Unusable) => Grade::Unusable,
            Some(Severity::Doubtful) => Grade::Doubtful,
            _ if !compares => Grade::Doubtful,
            _ => Grade::Good,
        }
    }

    /// Returns whether the data rule out the model, so that only what does not rest on it has
    /// errors.
    pub fn is_refuted(&self) -> bool {
        self.findings.iter().any(|finding| matches!(finding, Finding::Refuted { .. }))
    }

    /// Returns the name of a residual's shot in reports: its sample and its own name.
    pub(crate) fn shot_name(&self, residual: &LabelResidual) -> String {
        format!("{}, {}", self.samples[residual.sample].title, residual.of_shot.shot)
    }
}

/// How robust losses weighted the shots.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Robust {
    /// Names of the losses of the data sets.
    pub(crate) losses: Vec<&'static str>,
    /// The shots that count less, the least first.
    pub(crate) weights: Vec<SampleWeight>,
}

/// The weight of a shot.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct SampleWeight {
    /// Title of the sample.
    pub(crate) sample: String,
    /// Name of the shot.
    pub(crate) shot: String,
    /// Its weight, 0 to 1.
    pub(crate) weight: f64,
}

/// One sample of a comparison: a data set, or those of its shots that have one label.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct SampleSummary {
    /// The name for a reader.
    pub(crate) title: String,
    /// The label that it belongs to.
    pub(crate) label: String,
    /// Number of shots that were fitted.
    pub(crate) shots_used: usize,
    /// Shots that were left out.
    pub(crate) shots_rejected: Vec<Rejected>,
}

/// One quantity compared over all labels.
#[derive(Clone, Debug)]
pub(crate) struct Compared {
    /// The quantity.
    pub(crate) quantity: Quantity,
    /// Whether it has one value for all, and not one for each label.
    pub(crate) shared: bool,
    /// Its one value, or the value for each label.
    pub(crate) estimates: Vec<Value>,
    /// The differences of all pairs of labels that determine it.
    pub(crate) differences: Vec<Difference>,
    /// The test of one value for all against one for each, over the labels that determine it.
    pub(crate) same_or_different: Option<LikelihoodRatio>,
    /// The index and the reason of each label that does not determine it.
    pub(crate) left_out: Vec<(usize, Reason)>,
}

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Value {
    /// The label whose value it is; null: of all.
    pub(crate) label: Option<String>,
    /// The value, in the unit of the parameter.
    #[schemars(with = "Option<f64>")]
    pub(crate) estimate: f64,
    /// Its standard error, same unit.
    pub(crate) std_error: Option<f64>,
    /// Its 95 % interval: lower and upper end.
    #[schemars(with = "Option<[Option<f64>; 2]>")]
    pub(crate) interval_95: Option<[f64; 2]>,
    /// Whether it was fitted; else it was held, or the data do not determine it.
    pub(crate) fitted: bool,
    /// Whether it ended at a bound.
    pub(crate) at_bound: bool,
}

/// The difference of a quantity between two labels: the second less the first.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Difference {
    /// The first label.
    pub(crate) first: String,
    /// The second label.
    pub(crate) second: String,
    /// Value of the second label less that of the first, in the unit of the parameter.
    #[serde(rename = "difference")]
    #[schemars(with = "Option<f64>")]
    pub(crate) value: f64,
    /// Its standard error.
    #[schemars(with = "Option<f64>")]
    pub(crate) std_error: f64,
    /// Its 95 % interval: lower and upper end.
    #[schemars(with = "[Option<f64>; 2]")]
    pub(crate) interval_95: [f64; 2],
    /// Two-sided probability of such a difference by chance, for this pair alone.
    #[schemars(with = "Option<f64>")]
    pub(crate) p_value: f64,
    /// p_value corrected for all pairs of all parameters (Holm 1979).
    #[schemars(with = "Option<f64>")]
    pub(crate) p_holm: f64,
    /// Whether p_holm is below 0.05.
    pub(crate) real: bool,
}

impl Difference {
    /// The probability of error that is accepted.
    pub(crate) const LEVEL: f64 = 0.05;
}

worded! {
    /// The kind of the test of one value for all against one for each.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(crate) enum TestKind {
        /// The ratio of the likelihoods.
        LikelihoodRatio = "likelihood ratio",
        /// The differences and their errors from the scatter of the shots, if a robust loss
        /// leaves no likelihood (Wald).
        Wald = "Wald statistic",
    }
    /// The name for a reader.
    pub fn name;
}

written_by_name!(TestKind);

/// A test of one value for all against one for each label.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct LikelihoodRatio {
    /// The statistic: twice the logarithm of the ratio of likelihoods, or the rise of χ²; or Wald's
    /// statistic.
    #[serde(rename = "likelihood_ratio")]
    #[schemars(with = "Option<f64>")]
    pub(crate) statistic: f64,
    /// Kind of the test.
    #[serde(rename = "test")]
    pub(crate) by: TestKind,
    /// How many more parameters one value for each takes.
    pub(crate) extra_parameters: usize,
    /// Probability of a larger statistic if the value is the same for all.
    #[schemars(with = "Option<f64>")]
    pub(crate) p_value: f64,
    /// Akaike's criterion of one value for each less that of one for all: negative favours a
    /// difference.
    #[schemars(with = "Option<f64>")]
    pub(crate) delta_aic: f64,
}

/// A residual of the joint fit, with the indices of its label and its sample.
#[derive(Clone, Debug)]
pub(crate) struct LabelResidual {
    pub(crate) label: usize,
    pub(crate) sample: usize,
    pub(crate) of_shot: Residual,
}
