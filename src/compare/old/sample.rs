//! Data sets → samples, each with the label by which it is compared.

use super::{COMPARED, CompareError, Options, Quantity, SampleSummary};
use crate::fit;
use crate::fit::Rejected;
use crate::fit::model_choice::{fitted_with, plan};
use crate::fit::samples::Search;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::sample::{Numbers, Sample};
use crate::measurement::dataset::{Dataset, Shot};
use crate::measurement::loss::Loss;
use crate::measurement::parameter::{Compliance, Parameter, Settings};
use crate::measurement::values::Values;
use crate::physics::collision::Model;

/// The shots of one data set, or of one label of its `[fit] by`.
#[derive(Clone)]
pub(super) struct Group<'a> {
    /// Its place among the summaries.
    pub number: usize,
    pub label: usize,
    pub title: String,
    pub dataset: &'a Dataset,
    /// Its number among those compared.
    pub dataset_number: usize,
    /// The number of the first data set with the same balls.
    pub balls_number: usize,
    pub model: Model,
    pub settings: Settings,
    pub initial: Values,
    /// How outlying shots count.
    pub loss: Loss,
    /// Whether the errors of its shots include what they scatter by beyond their own.
    pub scatters: bool,
}

/// What is compared.
pub(super) struct Gathered<'a> {
    pub told_by: String,
    pub labels: Vec<String>,
    /// Those with shots that can be used, and their shots; `index`: the place of a shot in its data set.
    pub groups: Vec<Group<'a>>,
    pub shots: Vec<Vec<Fitted>>,
    pub summaries: Vec<SampleSummary>,
}

/// Which parameters have a value for each label, in the order of [`Parameter::ALL`].
pub(super) type Apart = [bool; Parameter::ALL.len()];

impl Group<'_> {
    /// With a contact that gives way, unless its data set states otherwise.
    pub(super) fn give_way(&mut self) {
        if self.settings.compliance == Compliance::Auto {
            self.settings.compliance = Compliance::Stated;
            self.model.kappa = self.initial[Parameter::Kappa];
        }
    }

    fn numbers(&self, apart: &Apart) -> Numbers {
        Parameter::ALL.map(|parameter| match parameter {
            Parameter::MassRatio | Parameter::RadiusRatio => self.balls_number,
            _ if apart[parameter as usize] => self.label,
            _ => 0,
        })
    }
}

/// The shots of all groups with what is shared and what is apart.
pub(super) fn search<'a>(groups: &'a [Group], shots: &'a [Vec<Fitted>], apart: &Apart) -> Search<'a> {
    let sample = |(group, fitted): (&'a Group, &'a Vec<Fitted>)| Sample {
        title: &group.title,
        dataset: group.dataset_number,
        loss: group.loss,
        numbers: group.numbers(apart),
        ..Sample::of(group.dataset, fitted, (&group.model, &group.settings, group.initial))
    };
    Search { samples: groups.iter().zip(shots).map(sample).collect(), maximum_likelihood: false }
}

/// The label of each data set, where it has one for all its shots.
pub(super) fn label_of_datasets(
    datasets: &[&Dataset],
    labels: &[String],
    cloths: bool,
) -> Vec<Option<usize>> {
    let of = |dataset: &&Dataset| {
        let own = if cloths { dataset.cloth.as_ref() } else { Some(&dataset.name) };
        labels.iter().position(|label| Some(label) == own)
    };
    datasets.iter().map(of).collect()
}

/// Told apart by cloth where the cloths differ, else by data set and the labels of `[fit] by`.
///
/// # Errors
/// A data set that cannot be fitted as asked for, or a parameter that none has.
pub(super) fn gather<'a>(datasets: &[&'a Dataset], options: &Options) -> Result<Gathered<'a>, CompareError> {
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
    let (mut labels, mut summaries): (Vec<String>, Vec<SampleSummary>) = Default::default();
    let (mut groups, mut of_groups) = (Vec::new(), Vec::new());
    let of_fit = fit::Options { fidelity: options.fidelity, ..fit::Options::default() };
    for (dataset_number, dataset) in datasets.iter().copied().enumerate() {
        let (model, settings, initial) = fitted_with(dataset, &of_fit)?;
        let shares = |first: &&Dataset| dataset.balls.is_some() && first.balls == dataset.balls;
        let balls_number = datasets.iter().position(shares).unwrap_or(dataset_number);
        for (group, places) in dataset.labelled() {
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
            let shots: Vec<&Shot> = places.iter().map(|place| &dataset.shots[*place]).collect();
            let (mut fitted, unusable) = plan(&shots, &model, &initial);
            for shot in &mut fitted {
                shot.index = places[shot.index];
            }
            let left_out = dataset.left_out.iter();
            let left_out =
                left_out.map(|(shot, reason)| Rejected { shot: shot.clone(), reason: reason.clone() });
            summaries.push(SampleSummary {
                title: title.clone(),
                dataset: dataset_number,
                label,
                shots_used: fitted.len(),
                shots_rejected: left_out.chain(unusable).collect(),
            });
            if fitted.is_empty() {
                continue;
            }
            let loss = options.loss.unwrap_or(dataset.loss);
            let number = summaries.len() - 1;
            groups.push(Group {
                number,
                label,
                title,
                dataset,
                dataset_number,
                balls_number,
                model,
                settings,
                initial,
                loss,
                scatters: false,
            });
            of_groups.push(fitted);
        }
    }
    for quantity in options.share.iter().chain(&options.per_dataset) {
        if let Quantity::Parameter(parameter) = quantity
            && COMPARED.contains(parameter)
            && !groups.iter().any(|group: &Group| group.settings.has(*parameter))
        {
            return Err(CompareError::NoSuchParameter(parameter.name()));
        }
    }
    Ok(Gathered { told_by, labels, groups, shots: of_groups, summaries })
}
