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

/// What is compared: a parameter of the fit, or the cloth's sliding friction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    Parameter(Parameter),
    /// μ_k, from the paths after the impacts.
    Sliding,
}

impl Quantity {
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
    /// Of its shots, in their order.
    pub films: Vec<Option<Arc<Film>>>,
    /// What is free of the film besides μ_k and μ_r: the corrections of its camera that were adopted.
    pub unknowns: FilmUnknowns,
}

/// Choices of a comparison.
#[derive(Clone, Debug)]
pub struct Options {
    pub fidelity: Fidelity,
    /// Whether velocities are compared, or the frames of footage.
    pub method: Method,
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
        "{0}: no data set has it; a friction that falls (friction under [fit]) has mu_b and mu_c, a contact that gives way kappa, an e that falls e_slope"
    )]
    NoSuchParameter(&'static str),
    #[error(
        "observations: {observations}, for the free parameters {parameters}; expected at least as many: add shots, or share parameters"
    )]
    TooFewObservations { observations: usize, parameters: String },
    #[error(
        "{0}; a parameter that is shared must satisfy the constraints of every data set: change them, or what is fixed, under \
         [fit], or give it a value for each with --per-dataset"
    )]
    Contradiction(String),
    #[error(
        "{0}: its frames cannot be fitted: it is no footage of balls, or a shot has none; compare with --method two-stage"
    )]
    NotFilmed(String),
    #[error(
        "frames are compared by least squares; leave out the robust loss, or compare with --method two-stage"
    )]
    JointLoss,
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
    #[error(
        "{label}: {column} has a standard deviation in some data sets and none in others; expected all or none"
    )]
    MixedNoise { label: String, column: &'static str },
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

/// The result: a value, which `report` renders.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// What is told apart: cloths, data sets, or values of a label column.
    pub labels: Vec<String>,
    /// `cloth`, `data set`, or the column of `[fit] by`.
    pub told_by: String,
    pub fidelity: &'static str,
    pub method: Method,
    /// How many shots were computed at which fidelity and with which effects on.
    pub computed: Vec<Computed>,
    pub samples: Vec<SampleSummary>,
    pub quantities: Vec<Compared>,
    /// Of what was fitted.
    pub chi2: f64,
    pub dof: usize,
    /// χ² and degrees of freedom of the residuals: of frames, those of the velocities that were extracted from them.
    pub tested: (f64, usize),
    /// Whether the noise was estimated from the residuals.
    pub noise_estimated: bool,
    pub converged: bool,
    pub termination: String,
    pub residuals: Vec<LabelResidual>,
    /// Where a loss is robust.
    pub robust: Option<Robust>,
    /// Whether the contact between the balls gives way although no data set states it, as all together call for it.
    pub gives_way: bool,
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
    compare_watched(datasets, &[], options, &|_| {})
}

/// As [`compare`], with the frames of each data set for [`Method::Joint`]; `stage` is called with the name of each of the [`STAGES`]
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
