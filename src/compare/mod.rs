//! Several data sets in one fit: which parameters differ between cloths or balls, by how much, how surely.
//!
//! What a single fit honours, this does: bounds, priors and constraints of each data set, robust losses, and the choice
//! of a fidelity for each shot, which all data sets make together. Footage is compared by the velocities extracted from
//! it; its frames are not fitted jointly.
//!
//! Each parameter is either shared by all samples or has a value for each label. All samples are minimised
//! together; the weights are those of the fit in which every parameter that can differ does, so that sums of squares
//! of different models are comparable.
//!
//! - Holm, S. (1979). A simple sequentially rejective multiple test procedure. Scand. J. Stat. 6, 65–70.

mod conclusion;
mod effect;
mod fidelity_choice;
mod global;
mod joint;
mod layout;
mod noise;
mod refuted;
mod run;
mod sample;
mod sliding;
mod uninformed;
mod verdict;

pub use effect::effect;

use sample::{Sample, gather, label_of_datasets};

use crate::fit::{Computed, Rejected, Residual};
use crate::measurement::dataset::Dataset;
use crate::measurement::loss::Loss;
use crate::measurement::parameter::Parameter;
use crate::physics::ball::Ball;
use crate::physics::collision::Fidelity;

/// What is compared: a parameter of the fit, or the cloth's sliding friction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    Parameter(Parameter),
    /// μ_k, from the paths after the impacts.
    Sliding,
}

impl Quantity {
    pub const ALL: [Self; 4] = [
        Self::Parameter(Parameter::Mu),
        Self::Parameter(Parameter::MuS),
        Self::Parameter(Parameter::E),
        Self::Sliding,
    ];

    /// As on the command line and in compare.json.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.name(),
            Self::Sliding => "mu_k",
        }
    }

    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.symbol(),
            Self::Sliding => "μ_k",
        }
    }

    #[must_use]
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.meaning(),
            Self::Sliding => "friction of the cloth on a sliding ball",
        }
    }
}

/// Choices of a comparison.
#[derive(Clone, Debug)]
pub struct Options {
    pub fidelity: Fidelity,
    /// Whether each shot takes the cheapest fidelity that keeps within a tenth of its standard errors, instead.
    pub auto: bool,
    /// How outlying shots count, in the place of what the data sets say.
    pub loss: Option<Loss>,
    /// Shared by all data sets, in the place of the default.
    pub share: Vec<Quantity>,
    /// With a value for each label, in the place of the default.
    pub per_dataset: Vec<Quantity>,
}

impl Default for Options {
    fn default() -> Self {
        Self { fidelity: Fidelity::Full, auto: false, loss: None, share: Vec::new(), per_dataset: Vec::new() }
    }
}

/// Why there is no comparison.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    #[error(
        "{0} sample(s) with usable shots; expected two or more to compare: data sets, or labels of one whose [fit] by names \
         a column"
    )]
    TooFew(usize),
    #[error("{0} is both shared and per data set; expected one of them")]
    Both(&'static str),
    #[error(
        "{observations} observations for {parameters} parameters; expected more observations: add shots, or share parameters"
    )]
    TooFewObservations { observations: usize, parameters: usize },
    #[error(
        "{0}: its friction falls with the slip; a comparison takes a constant one: leave out friction under [fit]"
    )]
    Falls(String),
    #[error(
        "{title}: the constraint \"{text}\" does not hold for the values at which its parameters are held; change it, or \
         what is fixed, under [fit]"
    )]
    Broken { title: String, text: String },
    #[error(
        "no values within the bounds satisfy {0} together; a parameter that is shared must satisfy the constraints of every \
         data set: change them under [fit], or give it a value for each with --per-dataset"
    )]
    Contradiction(String),
    #[error(
        "the constraint \"{text}\" leaves {parameter} no room to differ: leave it out under [fit], take one {parameter} for \
         all with --share {parameter}{others}"
    )]
    Pinned { text: String, parameter: &'static str, others: String },
    /// What is wrong with a data set, as [`Dataset::faults`] says it.
    #[error("{dataset}: {}", .faults.join("\n"))]
    Invalid { dataset: String, faults: Vec<String> },
    #[error(
        "{0}: its impacts have not been extracted from the tracks; call footage::with_impacts before comparing it"
    )]
    NotExtracted(String),
    #[error("the observations cannot be weighted: a covariance is not positive definite")]
    NoWeights,
    #[error(
        "{label}: {column} has a standard deviation in some data sets and none in others; expected all or none"
    )]
    MixedNoise { label: String, column: &'static str },
    #[error(transparent)]
    Optimise(#[from] crate::numerics::least_squares::OptimiseError),
}

/// The result: a value, which `report` renders.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// What is told apart: cloths, data sets, or values of a label column.
    pub labels: Vec<String>,
    /// `cloth`, `data set`, or the column of `[fit] by`.
    pub told_by: String,
    pub fidelity: &'static str,
    /// How many shots were computed at which fidelity and with which effects on.
    pub computed: Vec<Computed>,
    pub samples: Vec<SampleSummary>,
    pub quantities: Vec<Compared>,
    pub chi2: f64,
    pub dof: usize,
    /// Whether the noise was estimated from the residuals.
    pub noise_estimated: bool,
    pub converged: bool,
    pub termination: String,
    pub residuals: Vec<LabelResidual>,
    /// Where a loss is robust.
    pub robust: Option<Robust>,
    /// Where χ² rules the model out: how, for a reader. Nothing but what does not rest on the model has errors then.
    pub refuted: Option<String>,
    /// The constraints between parameters, each with whose it is, and whether they hold with equality.
    pub relations: Vec<(String, bool)>,
    /// What the reader must know, the most important first.
    pub warnings: Vec<String>,
    /// What the reader may want to know.
    pub notes: Vec<String>,
}

impl Comparison {
    /// Spins of these data sets were found from the paths alone, whose errors a comparison of velocities cannot carry over.
    pub fn warn_of_spins_from_paths(&mut self, names: &[String]) {
        self.warnings.insert(
            0,
            format!(
                "The spins of {} were found from the paths alone. Their errors are too large for a comparison of velocities: \
                 estimates may be biased, and differences with them. Tell the spins ([cue_spin], markers), or fit each data \
                 set alone with --method joint.",
                names.join(" and ")
            ),
        );
    }
}

/// How robust losses weighed the shots.
#[derive(Clone, Debug)]
pub struct Robust {
    /// The names of the losses, one for each that a data set has.
    pub losses: Vec<&'static str>,
    /// Weights below 1, the smallest first: sample, shot and weight.
    pub weights: Vec<(usize, String, f64)>,
}

#[derive(Clone, Debug)]
pub struct SampleSummary {
    pub title: String,
    /// The place of its data set among those compared.
    pub dataset: usize,
    pub label: usize,
    pub source: Option<String>,
    pub shots_used: usize,
    pub shots_rejected: Vec<Rejected>,
}

/// One quantity over all labels.
#[derive(Clone, Debug)]
pub struct Compared {
    pub quantity: Quantity,
    /// One value for all, rather than one for each label.
    pub shared: bool,
    /// One, or one for each label.
    pub estimates: Vec<Value>,
    /// Of all pairs of labels that tell it.
    pub differences: Vec<Difference>,
    /// Same against different, over the labels that tell it.
    pub same_or_different: Option<LikelihoodRatio>,
    /// Labels that say nothing about it, and why.
    pub left_out: Vec<(usize, String)>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value {
    /// `None`: of all.
    pub label: Option<usize>,
    pub value: f64,
    pub std_error: Option<f64>,
    pub interval_95: Option<[f64; 2]>,
    /// It was held, or told nothing: where it stays.
    pub fitted: bool,
    pub at_bound: bool,
}

/// Of two labels: second less first.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    pub first: usize,
    pub second: usize,
    pub value: f64,
    pub std_error: f64,
    pub interval_95: [f64; 2],
    /// Two-sided, of this pair alone.
    pub p_value: f64,
    /// Corrected for all pairs of all quantities that are compared (Holm).
    pub p_holm: f64,
    /// What a player would see of it.
    pub words: Option<String>,
}

impl Difference {
    /// Probability of error that is accepted.
    pub const LEVEL: f64 = 0.05;

    /// Whether it is told from nothing.
    #[must_use]
    pub fn is_real(&self) -> bool {
        self.p_holm < Self::LEVEL
    }
}

/// What "same" is held against "different" by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TestKind {
    LikelihoodRatio,
    /// By the differences and their errors from the scatter of the shots, where a robust loss leaves no likelihood.
    Wald,
}

impl TestKind {
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::LikelihoodRatio => "likelihood ratio",
            Self::Wald => "Wald statistic",
        }
    }
}

/// "One value for all" against "one for each".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LikelihoodRatio {
    /// Twice the logarithm of the ratio of likelihoods, or the rise of χ²; or Wald's statistic.
    pub statistic: f64,
    pub by: TestKind,
    pub extra_parameters: usize,
    pub p_value: f64,
    /// Akaike's criterion of "different" less that of "same": negative speaks for a difference.
    pub delta_aic: f64,
}

/// A residual of the joint fit.
#[derive(Clone, Debug)]
pub struct LabelResidual {
    pub label: usize,
    pub sample: usize,
    pub of_shot: Residual,
}

/// How many stages a comparison has at most.
pub const STAGES: usize = run::STAGES;

/// Compares data sets, which must have their impacts extracted.
///
/// # Errors
/// See [`CompareError`].
pub fn compare(datasets: &[Dataset], options: &Options) -> Result<Comparison, CompareError> {
    compare_watched(datasets, options, &|_| {})
}

/// As [`compare`]; `stage` is called with the name of each of the [`STAGES`] as it begins.
///
/// # Errors
/// See [`CompareError`].
pub fn compare_watched(
    datasets: &[Dataset],
    options: &Options,
    stage: &dyn Fn(&str),
) -> Result<Comparison, CompareError> {
    if let Some(both) = options.share.iter().find(|q| options.per_dataset.contains(q)) {
        return Err(CompareError::Both(both.name()));
    }
    for dataset in datasets {
        if dataset.awaits_extraction() {
            return Err(CompareError::NotExtracted(dataset.name.clone()));
        }
        let faults = dataset.faults();
        if !faults.is_empty() {
            return Err(CompareError::Invalid { dataset: dataset.name.clone(), faults });
        }
    }
    if let Some(falling) = datasets.iter().find(|dataset| dataset.settings.falls) {
        return Err(CompareError::Falls(falling.path.display().to_string()));
    }
    let (told_by, labels, samples, summaries) = gather(datasets, options.fidelity, options.loss);
    let kept: Vec<Sample> = samples.into_iter().filter(|sample| !sample.fitted.is_empty()).collect();
    let used: Vec<usize> = (0..labels.len()).filter(|l| kept.iter().any(|s| s.label == *l)).collect();
    if used.len() < 2 {
        return Err(CompareError::TooFew(used.len()));
    }
    let cloths = told_by == "cloth";
    let differs = |quantity: Quantity| {
        if options.share.contains(&quantity) {
            return false;
        }
        // a cloth has no part in what happens between the balls
        let by_default = match quantity {
            Quantity::Parameter(Parameter::MuS) | Quantity::Sliding => cloths,
            Quantity::Parameter(Parameter::Mu) => !cloths,
            Quantity::Parameter(_) => false,
        };
        by_default || options.per_dataset.contains(&quantity)
    };
    let apart = Parameter::COEFFICIENTS.map(|p| differs(Quantity::Parameter(p)));
    let mut comparison = run::run(&labels, kept, apart, options.auto, stage)?;
    sliding::compare(
        datasets,
        &labels,
        &label_of_datasets(datasets, &labels, cloths),
        differs(Quantity::Sliding),
        &mut comparison,
    );
    verdict::holm(&mut comparison.quantities);
    comparison.labels = labels;
    refuted::judge(&mut comparison, &summaries);
    let ball = datasets.first().map_or(Ball::POOL, |dataset| dataset.ball);
    effect::describe(&mut comparison, ball);
    comparison.told_by = told_by;
    comparison.samples = summaries;
    Ok(comparison)
}
