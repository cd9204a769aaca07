//! Several data sets in one fit: which parameters differ between cloths or balls, by how much, how surely.
//!
//! A comparison is a fit of several samples by the one estimator ([`crate::fit`]): here it is only said what they share. So it honours
//! what a fit does: bounds and priors of each data set, robust losses, friction that falls, a contact that gives way, frames,
//! and the choice of a fidelity for each shot, which all data sets make together.
//!
//! Each parameter is either shared by all samples or has a value for each label. "Same" is the fit in which it differs, with its
//! weights and equal values, so that sums of squares are comparable.
//!
//! - Holm, S. (1979). A simple sequentially rejective multiple test procedure. Scand. J. Stat. 6, 65–70.

mod analysis;
mod balls;
mod choice;
mod conclusion;
mod discs;
mod effect;
mod error;
mod joint_fit;
mod quantities;
mod quantity;
mod refuted;
mod result;
mod run;
mod sample;
mod sliding;
mod uninformed;
mod verdict;

pub use analysis::{Analysis, analyse, analyse_watched};
pub use effect::effect;
pub use error::CompareError;
pub use quantity::Quantity;
pub use result::{
    Compared, Comparison, Difference, LabelResidual, LikelihoodRatio, Robust, SampleSummary, TestKind, Value,
};

use sample::{Apart, Gathered, apart, gather, label_of_datasets};

use crate::fit::Method;
use crate::measurement::dataset::Dataset;
use crate::measurement::loss::Loss;
use crate::measurement::parameter::Parameter;
use crate::physics::ball::Ball;
use crate::physics::collision::FidelityChoice;

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

/// Choices of a comparison. The default is what `caromfit compare` does; state what you want, and the rest as
/// `..Options::default()`.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// How closely collisions are modelled.
    pub fidelity: FidelityChoice,
    /// Whether velocities are compared, or the frames of footage; `None`: frames where all data sets are footage of balls, else
    /// velocities.
    pub method: Option<Method>,
    /// How outlying shots count; `None`: as the data sets state.
    pub loss: Option<Loss>,
    /// The quantities that have one value for all data sets, in the place of the default.
    pub share: Vec<Quantity>,
    /// The quantities that have a value for each label, in the place of the default.
    pub per_dataset: Vec<Quantity>,
    /// Whether one camera, which did not move, filmed all data sets: its corrections are then the same. Only with the frames.
    pub same_camera: bool,
}

/// How many stages a comparison has at most.
pub const STAGES: usize = run::STAGES;

/// Compares data sets of any kind, as [`analyse`] does: footage is corrected for its cameras and its impacts are found first.
///
/// # Errors
/// See [`CompareError`].
pub fn compare(datasets: &[Dataset], options: &Options) -> Result<Comparison, CompareError> {
    analyse(datasets, options).comparison
}

/// Whether the data sets and the choices are such that a comparison can be tried.
fn check(datasets: &[Dataset], options: &Options) -> Result<(), CompareError> {
    if let Some(both) = options.share.iter().find(|q| options.per_dataset.contains(q)) {
        return Err(CompareError::Both(both.name()));
    }
    for dataset in datasets {
        let faults = dataset.faults();
        if !faults.is_empty() {
            return Err(CompareError::Invalid { dataset: dataset.name.clone(), faults });
        }
    }
    Ok(())
}

/// Compares data sets that have their impacts, of footage by [`Method::Joint`] its frames; `stage` is called with the name of each of
/// the [`STAGES`] as it begins.
fn compare_prepared(
    datasets: &[Dataset],
    (options, method): (&Options, Method),
    stage: &dyn Fn(&str),
) -> Result<Comparison, CompareError> {
    let datasets: Vec<&Dataset> = datasets.iter().collect();
    let mut gathered = gather(&datasets, options)?;
    let labels = gathered.labels.clone();
    let used = (0..labels.len()).filter(|l| gathered.groups.iter().any(|group| group.label == *l)).count();
    if used < 2 {
        return Err(CompareError::TooFew(used));
    }
    let cloths = gathered.told_by == "cloth";
    let differs = apart(cloths, options);
    let of_parameters: Apart = Parameter::ALL.map(|p| differs(Quantity::Parameter(p)));
    let run::Compared { mut comparison, sliding: of_frames, limit } =
        run::run(&mut gathered, &of_parameters, (options, method), stage)?;
    let Gathered { told_by, summaries, .. } = gathered;
    let sliding = of_frames.unwrap_or_else(|| sliding::Known::of_impacts(&datasets));
    let own_labels = label_of_datasets(&datasets, &labels, cloths);
    sliding::compare(&sliding, (&labels, &own_labels), differs(Quantity::Sliding), &mut comparison);
    verdict::holm(&mut comparison.quantities);
    comparison.labels = labels;
    refuted::judge(&mut comparison, &summaries);
    let limit = limit.filter(|_| comparison.refuted.is_none());
    comparison.notes.extend(limit);
    let ball = datasets.first().map_or(Ball::POOL, |dataset| dataset.ball);
    effect::describe(&mut comparison, ball);
    comparison.told_by = told_by;
    comparison.samples = summaries;
    Ok(comparison)
}
