//! The comparison of velocities, angles and discs, until these are samples of the problem, too.

mod analysis;
mod balls;
mod choice;
mod discs;
mod joint_fit;
mod quantities;
mod refuted;
mod run;
mod sample;
mod sliding;
mod uninformed;

pub(super) use analysis::{analyse, are_blocks};

use super::error::CompareError;
use super::findings::{Finding, Reason};
use super::options::Options;
use super::quantity::Quantity;
use super::result::{
    Compared, Comparison, Difference, LabelResidual, LikelihoodRatio, Robust, SampleSummary, TestKind, Value,
};
use super::verdict;
use crate::fit::Method;
use crate::measurement::dataset::Dataset;
use crate::measurement::parameter::Parameter;
use crate::physics::ball::Ball;
use crate::problem::Severity;
use sample::{Apart, Gathered, gather, label_of_datasets};

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

fn note(sentence: String) -> Finding {
    Finding::Said(Severity::Note, sentence)
}

fn warning(sentence: String) -> Finding {
    Finding::Said(Severity::Doubtful, sentence)
}

/// Compares data sets that have their impacts, of footage by [`Method::Joint`] its frames; `stage` is called with the name of each of
/// the stages as it begins.
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
    let differs = |quantity| options.is_apart(quantity, cloths);
    let of_parameters: Apart = Parameter::ALL.map(|p| differs(Quantity::Parameter(p)));
    let run::Compared { mut comparison, sliding: of_frames, tested, limit } =
        run::run(&mut gathered, &of_parameters, (options, method), stage)?;
    let Gathered { told_by, summaries, .. } = gathered;
    let sliding = of_frames.unwrap_or_else(|| sliding::Known::of_impacts(&datasets));
    let own_labels = label_of_datasets(&datasets, &labels, cloths);
    sliding::compare(&sliding, (&labels, &own_labels), differs(Quantity::Sliding), &mut comparison);
    verdict::holm(&mut comparison.quantities);
    comparison.labels = labels;
    refuted::judge(&mut comparison, &summaries, tested);
    let is_refuted = comparison.is_refuted();
    comparison.findings.extend(limit.filter(|_| !is_refuted).map(note));
    let ball = datasets.first().map_or(Ball::POOL, |dataset| dataset.ball);
    verdict::describe(&mut comparison.quantities, ball);
    comparison.told_by = told_by;
    comparison.samples = summaries;
    Ok(comparison)
}
