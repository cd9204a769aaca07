//! Data sets → samples, each with the label that it is told apart by.

use super::SampleSummary;
use crate::fit::Rejected;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::prediction::Plan;
use crate::measurement::dataset::{Dataset, Shared, Shot};
use crate::measurement::loss::Loss;
use crate::measurement::parameter::Settings;
use crate::measurement::relation::Relation;
use crate::measurement::values::Values;
use crate::physics::collision::{Coefficients, Fidelity, Model};

/// The shots of one data set, or of one label of its `[fit] by`.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    /// Its place among the summaries.
    pub number: usize,
    pub label: usize,
    pub title: String,
    pub dataset: usize,
    pub model: Model,
    pub settings: Settings,
    pub fitted: Vec<Fitted>,
    pub names: Vec<String>,
    /// Constraints between its parameters.
    pub relations: Vec<Relation>,
    /// How outlying shots count.
    pub loss: Loss,
    /// Whether the balls lie on a cloth, rather than that discs slide.
    pub on_cloth: bool,
    /// Standard errors that its shots share.
    pub shared_errors: Vec<(Shared, f64)>,
}

impl Sample {
    /// Usual values, with which its shots are first looked at.
    pub(super) fn usual(&self) -> Coefficients {
        Values::usual(&self.settings).coefficients
    }
}

/// The label of each data set, where it has one for all its shots.
pub(super) fn label_of_datasets(datasets: &[Dataset], labels: &[String], cloths: bool) -> Vec<Option<usize>> {
    let of = |dataset: &Dataset| {
        let own = if cloths { dataset.cloth.as_ref() } else { Some(&dataset.name) };
        labels.iter().position(|label| Some(label) == own)
    };
    datasets.iter().map(of).collect()
}

/// Told apart by cloth where the cloths differ, else by data set and the labels of `[fit] by`.
pub(super) fn gather(
    datasets: &[Dataset],
    fidelity: Fidelity,
    loss: Option<Loss>,
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
            let model = dataset.model(fidelity);
            let usual = Values::usual(&dataset.settings).coefficients;
            let (mut fitted, mut names) = (Vec::new(), Vec::new());
            let mut rejected: Vec<Rejected> = dataset
                .left_out
                .iter()
                .map(|(shot, reason)| Rejected { shot: shot.clone(), reason: reason.clone() })
                .collect();
            for shot in shots {
                let planned = Plan::new(shot).and_then(|plan| plan.predict(&model, &usual).map(|_| plan));
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
                dataset: number,
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
                relations: dataset.relations.clone(),
                loss: loss.unwrap_or(dataset.loss),
                on_cloth: dataset.tracks.as_ref().is_none_or(|tracks| tracks.discs.is_none()),
                fitted,
                names,
                shared_errors: dataset.shared_errors(),
            });
        }
    }
    (told_by, labels, samples, summaries)
}
