//! Every data set, or every label of its `[fit] by`, fitted alone.

use std::sync::Arc;

use super::error::CompareError;
use super::findings::Finding;
use super::options::Options;
use super::result::SampleSummary;
use crate::fit::film_words::sentence;
use crate::fit::{self, Depth, FitError, analyse_watched};
use crate::measurement::dataset::Dataset;
use crate::measurement::parameter::Settings;
use crate::problem::{self, Solution};

/// A data set, or the shots of one label of its `[fit] by`, fitted alone.
pub(super) struct Alone {
    /// Its part of the data set.
    pub dataset: Dataset,
    pub settings: Settings,
    /// Its fit.
    pub solution: Arc<Solution>,
    /// Index of its sample among the summaries, and of its label.
    pub sample: usize,
    pub label: usize,
    /// Index of its data set, and of the first one with the same balls and on the same cloth.
    pub film: usize,
    pub balls: usize,
    pub cloth: usize,
}

impl Alone {
    /// Returns the fall of −2 log L with which its fit adopted a compliant contact.
    pub fn compliance(&self) -> Option<f64> {
        let fall = |finding: &problem::Finding| match finding {
            problem::Finding::Compliance { fall, adopted: true, .. } => Some(*fall),
            _ => None,
        };
        self.solution.findings.iter().find_map(fall)
    }
}

/// All samples fitted alone, and what they are compared by.
pub(super) struct Samples {
    pub told_by: String,
    pub by_cloth: bool,
    pub labels: Vec<String>,
    pub fitted: Vec<Alone>,
    pub summaries: Vec<SampleSummary>,
    pub findings: Vec<Finding>,
}

impl Samples {
    /// Fits every sample alone: by cloth if all cloths are stated and differ, else by data set and the
    /// labels of `[fit] by`. `done` is called after each shot.
    ///
    /// # Errors
    /// Fewer than two labels with shots that can be fitted, or data that cannot be fitted as asked for.
    pub fn fit(
        datasets: &[Dataset],
        options: &Options,
        done: &(dyn Fn() + Sync),
    ) -> Result<Self, CompareError> {
        let cloths: Vec<&String> = datasets.iter().filter_map(|dataset| dataset.cloth.as_ref()).collect();
        let differ = cloths.iter().any(|cloth| *cloth != cloths[0]);
        let by_cloth = cloths.len() == datasets.len() && differ;
        let told_by = match datasets {
            _ if by_cloth => "cloth",
            [Dataset { by: Some(column), .. }] => column,
            _ => "data set",
        };
        let mut all = Self {
            told_by: told_by.to_owned(),
            by_cloth,
            labels: Vec::new(),
            fitted: Vec::new(),
            summaries: Vec::new(),
            findings: Vec::new(),
        };
        let choices = fit::Options {
            fidelity: options.fidelity,
            loss: options.loss,
            depth: Depth::Estimates,
            ..fit::Options::default()
        };
        for (film, dataset) in datasets.iter().enumerate() {
            let is_same = |other: &Dataset| other.balls.is_some() && other.balls == dataset.balls;
            let balls = datasets.iter().position(is_same).unwrap_or(film);
            let cloth = datasets.iter().position(|other| other.cloth == dataset.cloth).unwrap_or(film);
            for (group, part) in fit::analysis::parts(dataset) {
                let title = match group {
                    Some(group) if datasets.len() > 1 => format!("{}, {group}", dataset.name),
                    Some(group) => group,
                    None => dataset.name.clone(),
                };
                let name = dataset.cloth.clone().filter(|_| by_cloth).unwrap_or_else(|| title.clone());
                all.add(part, [title, name], [film, balls, cloth], &choices, done)?;
            }
        }
        let mut fitted: Vec<usize> = all.fitted.iter().map(|alone| alone.label).collect();
        fitted.sort_unstable();
        fitted.dedup();
        if fitted.len() < 2 { Err(CompareError::TooFew(fitted.len())) } else { Ok(all) }
    }

    /// Fits a part of a data set.
    fn add(
        &mut self,
        dataset: Dataset,
        [title, name]: [String; 2],
        [film, balls, cloth]: [usize; 3],
        choices: &fit::Options,
        done: &(dyn Fn() + Sync),
    ) -> Result<(), CompareError> {
        let label = self.labels.iter().position(|known| *known == name).unwrap_or(self.labels.len());
        if label == self.labels.len() {
            self.labels.push(name);
        }
        let sample = self.summaries.len();
        let (shots_used, shots_rejected) = match analyse_watched(&dataset, choices, done).fits {
            Ok(mut fits) => {
                let fit = fits.remove(0);
                for finding in &fit.findings {
                    // what all samples determine together is said of their joint fit
                    let is_of_all = matches!(finding, problem::Finding::Compliance { .. });
                    if let Some(sentence) = sentence(finding, fit.frames.as_ref())
                        && !is_of_all
                    {
                        let finding = finding.clone();
                        self.findings.push(Finding::OfSample { sample, finding, sentence });
                    }
                }
                let scatter = fit.scatter.filter(|scatter| scatter.is_estimated);
                self.findings.extend(scatter.map(|scatter| Finding::Scatter { sample, scatter }));
                self.fitted.push(Alone {
                    settings: dataset.settings_of_balls(),
                    solution: fit.solution,
                    dataset,
                    sample,
                    label,
                    film,
                    balls,
                    cloth,
                });
                (fit.shots_used, fit.shots_rejected)
            }
            Err(FitError::NoUsableShot { shots_rejected, .. }) => (0, shots_rejected),
            Err(error) => return Err(error.into()),
        };
        self.summaries.push(SampleSummary { title, dataset: film, label, shots_used, shots_rejected });
        Ok(())
    }
}
