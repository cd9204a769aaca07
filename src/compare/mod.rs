//! Several data sets in one fit: which parameters differ between cloths or balls, by how much, how surely.
//!
//! Each parameter is either shared by all samples or has a value for each label. All samples are minimised
//! together; the weights are those of the fit in which every parameter that can differ does, so that sums of squares
//! of different models are comparable.
//!
//! - Holm, S. (1979). A simple sequentially rejective multiple test procedure. Scand. J. Stat. 6, 65–70.

mod effect;
mod joint;
mod test;

pub use effect::effect;

use crate::ball::Ball;
use crate::collision::{Coefficients, Fidelity, Model};
use crate::dataset::{Dataset, Shot};
use crate::fit::Rejected;
use crate::observable::Observable;
use crate::parameters::Parameter;
use crate::predict::Plan;
use crate::residuals::Fitted;

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
    /// Shared by all data sets, in the place of the default.
    pub share: Vec<Quantity>,
    /// With a value for each label, in the place of the default.
    pub per_dataset: Vec<Quantity>,
}

impl Default for Options {
    fn default() -> Self {
        Self { fidelity: Fidelity::Full, share: Vec::new(), per_dataset: Vec::new() }
    }
}

/// Why there is no comparison.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    #[error("{0} sample(s) with usable shots; expected two or more: data sets, or labels of [fit] by")]
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
    #[error("the observations cannot be weighted: a covariance is not positive definite")]
    NoWeights,
    #[error(
        "{label}: {column} has a standard deviation in some data sets and none in others; expected all or none"
    )]
    MixedNoise { label: String, column: &'static str },
    #[error(transparent)]
    Optimise(#[from] crate::optimise::OptimiseError),
}

/// The shots of one data set, or of one label of its `[fit] by`.
#[derive(Clone, Debug)]
pub(crate) struct Sample {
    /// Its place among the summaries.
    pub number: usize,
    pub label: usize,
    pub title: String,
    pub dataset: usize,
    pub model: Model,
    pub settings: crate::parameters::Settings,
    pub fitted: Vec<Fitted>,
    pub names: Vec<String>,
    /// Standard errors that its shots share.
    pub shared_errors: Vec<(crate::dataset::Shared, f64)>,
}

/// The result: a value, which `report` renders.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// What is told apart: cloths, data sets, or values of a label column.
    pub labels: Vec<String>,
    /// `cloth`, `data set`, or the column of `[fit] by`.
    pub told_by: String,
    pub fidelity: &'static str,
    pub samples: Vec<SampleSummary>,
    pub quantities: Vec<Compared>,
    pub chi2: f64,
    pub dof: usize,
    /// Whether the noise was estimated from the residuals.
    pub noise_estimated: bool,
    pub converged: bool,
    pub termination: String,
    pub residuals: Vec<LabelResidual>,
    /// What the reader must know, the most important first.
    pub warnings: Vec<String>,
}

#[derive(Clone, Debug)]
pub struct SampleSummary {
    pub title: String,
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

/// "One value for all" against "one for each".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LikelihoodRatio {
    /// Twice the logarithm of the ratio of likelihoods, or the rise of χ².
    pub statistic: f64,
    pub extra_parameters: usize,
    pub p_value: f64,
    /// Akaike's criterion of "different" less that of "same": negative speaks for a difference.
    pub delta_aic: f64,
}

/// A standardized residual of the joint fit.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelResidual {
    pub label: usize,
    pub sample: usize,
    pub shot: String,
    pub observable: Observable,
    /// Radians.
    pub cut: f64,
    /// m/s.
    pub speed: Option<f64>,
    pub standardized: f64,
}

/// Compares data sets, which must have their impacts extracted.
///
/// # Errors
/// See [`CompareError`].
pub fn compare(datasets: &[Dataset], options: &Options) -> Result<Comparison, CompareError> {
    if let Some(both) = options.share.iter().find(|q| options.per_dataset.contains(q)) {
        return Err(CompareError::Both(both.name()));
    }
    if let Some(falling) = datasets.iter().find(|dataset| dataset.settings.falls) {
        return Err(CompareError::Falls(falling.path.display().to_string()));
    }
    let (told_by, labels, samples, summaries) = gather(datasets, options.fidelity);
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
    let mut comparison = test::run(&labels, &kept, &differs)?;
    test::sliding(
        datasets,
        &labels,
        &label_of_datasets(datasets, &labels, cloths),
        differs(Quantity::Sliding),
        &mut comparison,
    );
    test::holm(&mut comparison.quantities);
    comparison.labels = labels;
    let ball = datasets.first().map_or(Ball::POOL, |dataset| dataset.ball);
    effect::describe(&mut comparison, ball);
    comparison.told_by = told_by;
    comparison.samples = summaries;
    Ok(comparison)
}

/// The label of each data set, where it has one for all its shots.
fn label_of_datasets(datasets: &[Dataset], labels: &[String], cloths: bool) -> Vec<Option<usize>> {
    let of = |dataset: &Dataset| {
        let own = if cloths { dataset.cloth.as_ref() } else { Some(&dataset.name) };
        labels.iter().position(|label| Some(label) == own)
    };
    datasets.iter().map(of).collect()
}

/// Told apart by cloth where the cloths differ, else by data set and the labels of `[fit] by`.
fn gather(
    datasets: &[Dataset],
    fidelity: Fidelity,
) -> (String, Vec<String>, Vec<Sample>, Vec<SampleSummary>) {
    let mut cloths: Vec<&String> = datasets.iter().filter_map(|dataset| dataset.cloth.as_ref()).collect();
    let all_have = cloths.len() == datasets.len();
    cloths.sort();
    cloths.dedup();
    let by_cloth = all_have && cloths.len() > 1;
    let columns: Vec<&String> = datasets.iter().filter_map(|dataset| dataset.by.as_ref()).collect();
    let told_by = match (by_cloth, columns.as_slice()) {
        (true, _) => "cloth".to_string(),
        (false, [column]) if datasets.len() == 1 => (*column).clone(),
        _ => "data set".to_string(),
    };
    let (mut labels, mut samples, mut summaries): (Vec<String>, Vec<Sample>, Vec<SampleSummary>) =
        Default::default();
    for (number, dataset) in datasets.iter().enumerate() {
        let mut groups: Vec<(Option<String>, Vec<&Shot>)> = Vec::new();
        for shot in &dataset.shots {
            let own = dataset.by.as_ref().map(|by| shot.labels.get(by).cloned().unwrap_or_default());
            match groups.iter_mut().find(|(known, _)| *known == own) {
                Some((_, shots)) => shots.push(shot),
                None => groups.push((own, vec![shot])),
            }
        }
        if groups.is_empty() {
            groups.push((None, Vec::new()));
        }
        for (group, shots) in groups {
            let title = match &group {
                Some(group) if datasets.len() > 1 => format!("{}, {group}", dataset.name),
                Some(group) => group.clone(),
                None => dataset.name.clone(),
            };
            let name = match &dataset.cloth {
                Some(cloth) if by_cloth => cloth.clone(),
                _ => title.clone(),
            };
            let label = labels.iter().position(|known| *known == name).unwrap_or_else(|| {
                labels.push(name);
                labels.len() - 1
            });
            let model = Model::new(fidelity, dataset.ball);
            let initial = Parameter::COEFFICIENTS.map(|p| dataset.settings[p].initial);
            let initial = Coefficients { mu: initial[0], mu_s: initial[1], e: initial[2] };
            let (mut fitted, mut names) = (Vec::new(), Vec::new());
            let mut rejected: Vec<Rejected> = dataset
                .left_out
                .iter()
                .map(|(shot, reason)| Rejected { shot: shot.clone(), reason: reason.clone() })
                .collect();
            for shot in shots {
                let planned = Plan::new(shot).and_then(|plan| plan.predict(&model, &initial).map(|_| plan));
                match planned {
                    Ok(plan) => {
                        fitted.push(Fitted { index: names.len(), plan, film: None });
                        names.push(shot.name.clone());
                    }
                    Err(error) => {
                        rejected.push(Rejected { shot: shot.name.clone(), reason: error.to_string() });
                    }
                }
            }
            summaries.push(SampleSummary {
                title: title.clone(),
                label,
                source: dataset.source.clone(),
                shots_used: fitted.len(),
                shots_rejected: rejected,
            });
            samples.push(Sample {
                number: summaries.len() - 1,
                label,
                title,
                dataset: number,
                model,
                settings: dataset.settings,
                fitted,
                names,
                shared_errors: dataset.shared_errors(),
            });
        }
    }
    (told_by, labels, samples, summaries)
}
