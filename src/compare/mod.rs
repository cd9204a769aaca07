//! Several data sets in one fit: which parameters differ between cloths or balls, by how much, how surely.
//!
//! A comparison is a fit of several samples by the one estimator ([`crate::fit`]): here it is only said what they share. So it honours
//! what a fit does: bounds, priors and constraints of each data set, robust losses, friction that falls, a contact that gives way, frames,
//! and the choice of a fidelity for each shot, which all data sets make together.
//!
//! Each parameter is either shared by all samples or has a value for each label. "Same" is the fit in which it differs, with its
//! weights and the constraint that its values are equal, so that sums of squares are comparable.
//!
//! - Holm, S. (1979). A simple sequentially rejective multiple test procedure. Scand. J. Stat. 6, 65–70.

mod analysis;
mod choice;
mod conclusion;
mod discs;
mod effect;
mod joint_fit;
mod quantities;
mod refuted;
mod run;
mod sample;
mod sliding;
mod uninformed;
mod verdict;

pub use analysis::{Analysis, analyse};
pub use effect::effect;

use std::sync::Arc;

use sample::{Apart, Gathered, apart, gather, label_of_datasets};

use crate::fit::{Computed, FilmUnknowns, FitError, Method, Rejected, Residual};
use crate::likelihood::frames::Film;
use crate::measurement::dataset::Dataset;
use crate::measurement::loss::Loss;
use crate::measurement::parameter::Parameter;
use crate::physics::ball::Ball;
use crate::physics::collision::Fidelity;

/// A quantity that is compared: a parameter of the fit, or the cloth's sliding friction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

    /// The name on the command line and in compare.json.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.name(),
            Self::Sliding => "mu_k",
        }
    }

    /// The symbol in tables and plots.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.symbol(),
            Self::Sliding => "μ_k",
        }
    }

    /// What it is, in a line.
    #[must_use]
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.meaning(),
            Self::Sliding => "friction of the cloth on a sliding ball",
        }
    }
}

/// The parameters of a fit that are compared where data sets have them.
const COMPARED: [Parameter; 7] = [
    Parameter::Mu,
    Parameter::MuS,
    Parameter::E,
    Parameter::B,
    Parameter::C,
    Parameter::Kappa,
    Parameter::ESlope,
];

/// The frames of a data set, for [`Method::Joint`].
#[derive(Clone, Debug, Default)]
pub struct Footage {
    /// The frames of its shots, in their order; `None` for a shot without.
    pub films: Vec<Option<Arc<Film>>>,
    /// What is estimated besides μ_k and μ_r: the corrections of its camera that were adopted.
    pub unknowns: FilmUnknowns,
}

/// Choices of a comparison.
#[derive(Clone, Debug)]
pub struct Options {
    /// How closely collisions are modelled.
    pub fidelity: Fidelity,
    /// Whether velocities are compared, or the frames of footage.
    pub method: Method,
    /// Whether, in the place of `fidelity`, each shot takes the cheapest fidelity whose errors stay within a tenth of
    /// its standard errors.
    pub auto: bool,
    /// How outlying shots count; `None`: as the data sets state.
    pub loss: Option<Loss>,
    /// The quantities that have one value for all data sets, in the place of the default.
    pub share: Vec<Quantity>,
    /// The quantities that have a value for each label, in the place of the default.
    pub per_dataset: Vec<Quantity>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            fidelity: Fidelity::Full,
            method: Method::TwoStage,
            auto: false,
            loss: None,
            share: Vec::new(),
            per_dataset: Vec::new(),
        }
    }
}

/// Why data sets cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// Fewer than two samples have usable shots; with their number.
    #[error(
        "{0} sample(s) with usable shots; expected two or more to compare: data sets, or labels of one whose [fit] by names \
         a column"
    )]
    TooFew(usize),
    /// A quantity, whose name is given, was asked to be both shared and per data set.
    #[error("{0} is both shared and per data set; expected one of them")]
    Both(&'static str),
    /// No data set has the parameter whose name is given.
    #[error(
        "{0}: no data set has it; a friction that falls (friction under [fit]) has mu_b and mu_c, a contact that gives way kappa, an e that falls e_slope"
    )]
    NoSuchParameter(&'static str),
    /// There are fewer observations than free parameters.
    #[error(
        "observations: {observations}, for the free parameters {parameters}; expected at least as many: add shots, or share parameters"
    )]
    TooFewObservations {
        /// The number of observations.
        observations: usize,
        /// The names of the free parameters.
        parameters: String,
    },
    /// The constraints of the data sets contradict each other; with the reason.
    #[error(
        "{0}; a parameter that is shared must satisfy the constraints of every data set: change them, or what is fixed, under \
         [fit], or give it a value for each with --per-dataset"
    )]
    Contradiction(String),
    /// The frames of a data set, whose name is given, cannot be fitted.
    #[error(
        "{0}: its frames cannot be fitted: it is no footage of balls, or a shot has none; compare with --method two-stage"
    )]
    NotFilmed(String),
    /// Frames were to be compared with a robust loss.
    #[error(
        "frames are compared by least squares; leave out the robust loss, or compare with --method two-stage"
    )]
    JointLoss,
    /// A constraint leaves a parameter no room to differ.
    #[error(
        "the constraint \"{text}\" leaves {parameter} no room to differ: leave it out under [fit], take one {parameter} for \
         all with --share {parameter}{others}"
    )]
    Pinned {
        /// The constraint as it was written.
        text: String,
        /// The name of the parameter.
        parameter: &'static str,
        /// What else could be done, as the rest of the sentence.
        others: String,
    },
    /// A data set is wrong, as [`Dataset::faults`] states it.
    #[error("{dataset}: {}", .faults.join("\n"))]
    Invalid {
        /// The name of the data set.
        dataset: String,
        /// What is wrong, in sentences.
        faults: Vec<String>,
    },
    /// The impacts of a data set, whose name is given, have not been extracted from its tracks yet.
    #[error(
        "{0}: its impacts have not been extracted from the tracks; call footage::with_impacts before comparing it"
    )]
    NotExtracted(String),
    /// Some observations of a column have a standard deviation and others none.
    #[error(
        "{label}: {column} has a standard deviation in some data sets and none in others; expected all or none"
    )]
    MixedNoise {
        /// The label.
        label: String,
        /// The column.
        column: &'static str,
    },
    /// The joint fit failed.
    #[error(transparent)]
    Fit(FitError),
}

impl From<FitError> for CompareError {
    fn from(error: FitError) -> Self {
        match error {
            FitError::Relations(what) => Self::Contradiction(what),
            FitError::TooFewObservations { observations, parameters, .. } => {
                Self::TooFewObservations { observations, parameters }
            }
            other => Self::Fit(other),
        }
    }
}

impl CompareError {
    /// Whether the input was wrong, rather than that it could not be compared.
    #[must_use]
    pub fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Fit(error) if !error.is_bad_input())
    }
}

/// The result of a comparison: a value, which [`crate::report`] renders.
#[derive(Clone, Debug)]
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
    /// The constraints between parameters, each with the sample that it belongs to, and whether each holds with
    /// equality.
    pub relations: Vec<(String, bool)>,
    /// What a reader must know, in sentences, the most important first.
    pub warnings: Vec<String>,
    /// What else a reader may want to know, in sentences.
    pub notes: Vec<String>,
}

impl Comparison {
    /// Spins of these data sets were found from the paths alone, whose errors a comparison of velocities cannot carry over.
    fn warn_of_spins_from_paths(&mut self, names: &[String]) {
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
pub struct Robust {
    /// The name of each loss that a data set has.
    pub losses: Vec<&'static str>,
    /// The sample, the shot and its weight, for weights below 1, the smallest first.
    pub weights: Vec<(usize, String, f64)>,
}

/// One sample of a comparison: a data set, or those of its shots that have one label.
#[derive(Clone, Debug)]
pub struct SampleSummary {
    /// The name for a reader.
    pub title: String,
    /// The index of its data set among those compared.
    pub dataset: usize,
    /// The index of its label in [`Comparison::labels`].
    pub label: usize,
    /// Who measured it, how and when.
    pub source: Option<String>,
    /// How many of its shots were fitted.
    pub shots_used: usize,
    /// The shots that were left out, with the reasons.
    pub shots_rejected: Vec<Rejected>,
}

/// One quantity compared over all labels.
#[derive(Clone, Debug)]
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

/// The difference of a quantity between two labels: the second less the first.
#[derive(Clone, Debug, PartialEq)]
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

/// The kind of the test of one value for all against one for each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TestKind {
    /// By the ratio of the likelihoods.
    LikelihoodRatio,
    /// By the differences and their errors from the scatter of the shots, where a robust loss leaves no likelihood
    /// (Wald).
    Wald,
}

impl TestKind {
    /// The name for a reader.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::LikelihoodRatio => "likelihood ratio",
            Self::Wald => "Wald statistic",
        }
    }
}

/// The test of one value for all against one for each label.
#[derive(Clone, Copy, Debug, PartialEq)]
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
pub struct LabelResidual {
    /// The index of the label in [`Comparison::labels`].
    pub label: usize,
    /// The index of the sample in [`Comparison::samples`].
    pub sample: usize,
    /// The observation and its residual.
    pub of_shot: Residual,
}

/// How many stages a comparison has at most.
pub const STAGES: usize = run::STAGES;

/// Compares data sets, which must have their impacts extracted.
///
/// # Errors
/// See [`CompareError`].
pub fn compare(datasets: &[Dataset], options: &Options) -> Result<Comparison, CompareError> {
    compare_watched(datasets, &[], options, &|_| {})
}

/// Compares data sets as [`compare`] does, with the frames of each for [`Method::Joint`]; `stage` is called with the name of each of the [`STAGES`]
/// as it begins.
///
/// # Errors
/// See [`CompareError`].
pub fn compare_watched(
    datasets: &[Dataset],
    footage: &[Footage],
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
    let loss = |dataset: &Dataset| options.loss.unwrap_or(dataset.loss);
    if options.method == Method::Joint && datasets.iter().any(|dataset| loss(dataset) != Loss::Squares) {
        return Err(CompareError::JointLoss);
    }
    let mut gathered = gather(datasets, options)?;
    let labels = gathered.labels.clone();
    let used = (0..labels.len()).filter(|l| gathered.groups.iter().any(|group| group.label == *l)).count();
    if used < 2 {
        return Err(CompareError::TooFew(used));
    }
    let cloths = gathered.told_by == "cloth";
    let differs = apart(cloths, options);
    let of_parameters: Apart = Parameter::ALL.map(|p| differs(Quantity::Parameter(p)));
    let (mut comparison, of_frames) = run::run(&mut gathered, footage, &of_parameters, options, stage)?;
    let Gathered { told_by, summaries, .. } = gathered;
    let sliding = of_frames.unwrap_or_else(|| sliding::Known::of_impacts(datasets));
    let own_labels = label_of_datasets(datasets, &labels, cloths);
    sliding::compare(&sliding, (&labels, &own_labels), differs(Quantity::Sliding), &mut comparison);
    verdict::holm(&mut comparison.quantities);
    comparison.labels = labels;
    refuted::judge(&mut comparison, &summaries);
    let ball = datasets.first().map_or(Ball::POOL, |dataset| dataset.ball);
    effect::describe(&mut comparison, ball);
    comparison.told_by = told_by;
    comparison.samples = summaries;
    Ok(comparison)
}
