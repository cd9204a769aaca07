//! The quantities of a comparison, its choices, and its result.

use std::collections::BTreeSet;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Serialize;

use crate::fit::film_words::{Remark, sentences};
use crate::fit::{Grade, Rejected, Residual};
use crate::measurement::loss::Loss;
use crate::measurement::parameter::Parameter;
use crate::measurement::written::written_by_name;
use crate::name::by_name;
use crate::physics::collision::Fidelity;
use crate::problem::{Id, Severity, Solution};
use crate::words::symbol;

/// A quantity that is compared: a parameter of the fit, or the cloth's sliding friction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Quantity {
    /// A parameter of the fit.
    Parameter(Parameter),
    /// The cloth's sliding friction μ_k, from the paths after the impacts.
    Sliding,
}

impl Quantity {
    /// All that can be compared, in the order in which they are reported.
    pub const ALL: [Self; 8] = [
        Self::Parameter(Parameter::Mu),
        Self::Parameter(Parameter::MuS),
        Self::Parameter(Parameter::E),
        Self::Sliding,
        Self::Parameter(Parameter::B),
        Self::Parameter(Parameter::C),
        Self::Parameter(Parameter::Kappa),
        Self::Parameter(Parameter::ESlope),
    ];

    /// Returns the unknown of a fit.
    pub(crate) fn id(self) -> Id {
        match self {
            Self::Sliding => Id::MuK,
            Self::Parameter(parameter) => Id::from(parameter),
        }
    }

    /// Returns the name on the command line and in compare.json.
    pub fn name(self) -> &'static str {
        self.id().name()
    }

    /// Returns the symbol in tables and plots.
    pub fn symbol(self) -> &'static str {
        symbol(self.name())
    }

    /// Returns what it is, in a line.
    pub(crate) fn meaning(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.meaning(),
            Self::Sliding => "friction of the cloth on a sliding ball",
        }
    }
}

// By its name or its symbol.
by_name!(Quantity, "quantity", ALL, name, symbol);
written_by_name!(Quantity);

/// Choices of a comparison. The default is what `caromfit compare` does; state what you want, and
/// the rest as `..Options::default()`.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// How closely collisions are modelled; `None` as of a fit.
    pub fidelity: Option<Fidelity>,
    /// How outlying shots count; `None`: as the data sets state.
    pub loss: Option<Loss>,
    /// The quantities that have one value for all data sets instead of the default.
    pub share: Vec<Quantity>,
    /// The quantities that have a value for each label instead of the default.
    pub per_dataset: Vec<Quantity>,
}

/// Why a search that did not converge stopped.
pub(crate) const NOT_CONVERGED: &str =
    "no step lowered χ² though one was promised to, or there were too many steps";

/// The result of a comparison: a value, which [`crate::report`] renders.
#[derive(Clone, Debug)]
pub struct Comparison {
    pub(crate) labels: Vec<String>,
    /// Kind of the labels: `cloth`, `data set`, or the column of `[fit] by`.
    pub(crate) told_by: String,
    /// The fidelity that was asked for; `None`: chosen by the data.
    pub(crate) fidelity: Option<Fidelity>,
    pub(crate) samples: Vec<SampleSummary>,
    pub(crate) quantities: Vec<Compared>,
    pub(crate) solution: Arc<Solution>,
    pub(crate) noise_estimated: bool,
    /// How robust losses weighted the shots, if data sets have any.
    pub(crate) robust: Option<Robust>,
    /// Everything that a reader should know, the most important first.
    pub(crate) remarks: Vec<Remark>,
    /// Whether the data rule out the model.
    pub(super) is_refuted: bool,
}

impl Comparison {
    /// Returns whether the numbers can be used, with a reservation or without.
    pub fn grade(&self) -> Grade {
        let compares = self.quantities.iter().any(|quantity| !quantity.differences.is_empty());
        let least = if compares { Grade::Good } else { Grade::Doubtful };
        Grade::of(self.remarks.iter().map(|remark| remark.severity).max()).max(least)
    }

    /// Returns whether the data rule out the model: only what does not rest on it has errors.
    pub fn is_refuted(&self) -> bool {
        self.is_refuted
    }

    /// Returns what a reader must know, in sentences, the most important first.
    pub fn warnings(&self) -> Vec<&str> {
        sentences(&self.remarks, |severity| severity > Severity::Note)
    }

    /// Returns what else a reader may want to know, in sentences.
    pub fn notes(&self) -> Vec<&str> {
        sentences(&self.remarks, |severity| severity == Severity::Note)
    }

    /// Returns χ² of the joint fit, priors included.
    pub(crate) fn chi2(&self) -> f64 {
        self.solution.chi2_of_data().0 + self.solution.prior_chi2()
    }

    /// Returns the residuals of the joint fit, each with its sample.
    pub(crate) fn residuals(&self) -> impl Iterator<Item = (&SampleSummary, &Residual)> + Clone {
        self.samples.iter().flat_map(|sample| sample.residuals.iter().map(move |own| (sample, own)))
    }
}

/// How robust losses weighted the shots.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Robust {
    /// Names of the losses of the data sets.
    pub(crate) losses: BTreeSet<&'static str>,
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
    /// Residuals of the joint fit.
    #[serde(skip)]
    pub(crate) residuals: Vec<Residual>,
}

/// A parameter over all labels.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Compared {
    /// Its name.
    pub(crate) parameter: Quantity,
    /// The meaning in words.
    pub(crate) meaning: &'static str,
    /// Whether it has one value for all labels.
    pub(crate) shared: bool,
    /// One value for all, or one for each label.
    pub(crate) estimates: Vec<Value>,
    /// The differences of all pairs of labels that determine it.
    pub(crate) differences: Vec<Difference>,
    /// Test of one value for all against one for each label; null if fewer than two labels
    /// determine it.
    pub(crate) same_or_different: Option<LikelihoodRatio>,
    /// Labels that do not determine it.
    pub(crate) left_out: Vec<LeftOut>,
}

/// A label that does not determine a parameter.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct LeftOut {
    /// The label.
    pub(crate) label: String,
    /// Why it does not.
    pub(crate) reason: String,
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

/// The test by likelihoods, and the one by errors from the scatter of the shots of a robust loss.
pub(super) const RATIO: &str = "likelihood ratio";
pub(super) const WALD: &str = "Wald statistic";

/// A test of one value for all against one for each label.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct LikelihoodRatio {
    /// The statistic: twice the logarithm of the ratio of likelihoods, or the rise of χ²; or
    /// Wald's.
    #[serde(rename = "likelihood_ratio")]
    #[schemars(with = "Option<f64>")]
    pub(crate) statistic: f64,
    /// Kind of the test.
    #[schemars(extend("enum" = [RATIO, WALD]))]
    pub(crate) test: &'static str,
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
