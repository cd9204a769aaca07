//! What a comparison gives: a value, which `report` renders.

use super::Quantity;
use crate::fit::{Computed, Method, Rejected, Residual};
use crate::physics::name::worded;

/// The result of a comparison: a value, which [`crate::report`] renders.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Comparison {
    /// What is distinguished: cloths, data sets, or values of a label column.
    pub labels: Vec<String>,
    /// What the labels are: `cloth`, `data set`, or the column of `[fit] by`.
    pub told_by: String,
    /// The name of the fidelity, as on the command line.
    pub fidelity: &'static str,
    /// Whether velocities or frames were compared.
    pub method: Method,
    /// How many shots were computed at which fidelity and with which effects on.
    pub computed: Vec<Computed>,
    /// The samples, in the order of the data sets and their labels.
    pub samples: Vec<SampleSummary>,
    /// The quantities that were compared.
    pub quantities: Vec<Compared>,
    /// χ² of the joint fit.
    pub chi2: f64,
    /// Its degrees of freedom.
    pub dof: usize,
    /// χ² and degrees of freedom of the residuals; where frames were compared, of the velocities that were extracted
    /// from them.
    pub tested: (f64, usize),
    /// Whether the noise was estimated from the residuals.
    pub noise_estimated: bool,
    /// Whether the optimiser stopped at a minimum.
    pub converged: bool,
    /// Why the optimiser stopped, in words.
    pub termination: String,
    /// The observations one by one.
    pub residuals: Vec<LabelResidual>,
    /// How robust losses weighted the shots, where there are any.
    pub robust: Option<Robust>,
    /// Whether the contact between the balls gives way, though no data set states it, because all together call for
    /// it.
    pub gives_way: bool,
    /// Where the data contradict the model, how, as a sentence. Only what does not rest on the model has errors then.
    pub refuted: Option<String>,
    /// What a reader must know, in sentences, the most important first.
    pub warnings: Vec<String>,
    /// What else a reader may want to know, in sentences.
    pub notes: Vec<String>,
}

impl Comparison {
    /// Spins of these data sets were found from the paths alone, whose errors a comparison of velocities cannot carry over.
    pub(super) fn warn_of_spins_from_paths(&mut self, names: &[String]) {
        self.warnings.insert(
            0,
            format!(
                "The spins of {} were found from the paths alone. Their errors are too large for a comparison of velocities: \
                 estimates may be biased, and differences with them. Tell the spins ([cue_spin], markers), or compare \
                 all frames with --method joint.",
                names.join(" and ")
            ),
        );
    }
}

/// How robust losses weighted the shots.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Robust {
    /// The name of each loss that a data set has.
    pub losses: Vec<&'static str>,
    /// The sample, the shot and its weight, for weights below 1, the smallest first.
    pub weights: Vec<(usize, String, f64)>,
}

/// One sample of a comparison: a data set, or those of its shots that have one label.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct SampleSummary {
    /// The name for a reader.
    pub title: String,
    /// The index of its data set among those compared.
    pub dataset: usize,
    /// The index of its label in [`Comparison::labels`].
    pub label: usize,
    /// How many of its shots were fitted.
    pub shots_used: usize,
    /// The shots that were left out, with the reasons.
    pub shots_rejected: Vec<Rejected>,
}

/// One quantity compared over all labels.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Compared {
    /// The quantity.
    pub quantity: Quantity,
    /// Whether it has one value for all, and not one for each label.
    pub shared: bool,
    /// Its one value, or the value for each label.
    pub estimates: Vec<Value>,
    /// The differences of all pairs of labels that determine it.
    pub differences: Vec<Difference>,
    /// The test of one value for all against one for each, over the labels that determine it.
    pub same_or_different: Option<LikelihoodRatio>,
    /// The index and the reason of each label that does not determine it.
    pub left_out: Vec<(usize, String)>,
}

/// The value of a quantity for one label, or for all.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Value {
    /// The index of the label in [`Comparison::labels`]; `None` where it is the value for all.
    pub label: Option<usize>,
    /// The value, in the unit of the quantity.
    pub value: f64,
    /// Its standard error, where it has one.
    pub std_error: Option<f64>,
    /// Its 95 % interval, where it has one.
    pub interval_95: Option<[f64; 2]>,
    /// Whether it was fitted; else it was held, or the data do not determine it.
    pub fitted: bool,
    /// Whether it ended at one of its bounds.
    pub at_bound: bool,
}

impl Value {
    /// One that was not fitted.
    pub(super) fn held(label: Option<usize>, value: f64) -> Self {
        Self { label, value, std_error: None, interval_95: None, fitted: false, at_bound: false }
    }
}

/// The difference of a quantity between two labels: the second less the first.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Difference {
    /// The index of the first label in [`Comparison::labels`].
    pub first: usize,
    /// The index of the second label.
    pub second: usize,
    /// The difference, in the unit of the quantity.
    pub value: f64,
    /// Its standard error.
    pub std_error: f64,
    /// Its 95 % interval.
    pub interval_95: [f64; 2],
    /// The two-sided probability of such a difference by chance, for this pair alone.
    pub p_value: f64,
    /// The same, corrected for all pairs of all quantities that are compared (Holm 1979).
    pub p_holm: f64,
    /// The effect of the difference on a shot, in words that a player understands.
    pub words: Option<String>,
}

impl Difference {
    /// The probability of error that is accepted.
    pub const LEVEL: f64 = 0.05;

    /// Whether the difference is no chance: `p_holm` is below [`Difference::LEVEL`].
    #[must_use]
    pub fn is_real(&self) -> bool {
        self.p_holm < Self::LEVEL
    }
}

worded! {
    /// The kind of the test of one value for all against one for each.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum TestKind {
        /// By the ratio of the likelihoods.
        LikelihoodRatio = "likelihood ratio",
        /// By the differences and their errors from the scatter of the shots, where a robust loss leaves no likelihood
        /// (Wald).
        Wald = "Wald statistic",
    }
    /// The name for a reader.
    pub fn name;
}

/// The test of one value for all against one for each label.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct LikelihoodRatio {
    /// Twice the logarithm of the ratio of likelihoods, or the rise of χ²; or Wald's statistic.
    pub statistic: f64,
    /// The kind of the test.
    pub by: TestKind,
    /// How many more parameters one value for each takes.
    pub extra_parameters: usize,
    /// The probability of a larger statistic if the value is the same for all.
    pub p_value: f64,
    /// Akaike's criterion of one value for each less that of one for all: negative speaks for a difference.
    pub delta_aic: f64,
}

/// A residual of the joint fit.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct LabelResidual {
    /// The index of the label in [`Comparison::labels`].
    pub label: usize,
    /// The index of the sample in [`Comparison::samples`].
    pub sample: usize,
    /// The observation and its residual.
    pub of_shot: Residual,
}
