//! Every data set, or every label of its `[fit] by`, fitted alone.

use std::sync::Arc;

use minijinja::Value as Values;
use minijinja::value::Serde;

use super::CompareError;
use super::findings::Finding;
use super::quantity::{Options, Quantity};
use super::result::SampleSummary;
use crate::fit::film_words::sentence;
use crate::fit::{self, Depth, FitError, words_of};
use crate::measurement::dataset::Dataset;
use crate::measurement::number::count_of;
use crate::measurement::parameter::Settings;
use crate::problem::{self, Severity, Solution};

/// A data set, or the shots of one label of its `[fit] by`, fitted alone.
pub(super) struct Alone {
    /// Its part of the data set.
    pub(crate) dataset: Dataset,
    pub(crate) settings: Settings,
    pub(crate) solution: Arc<Solution>,
    /// Index of its sample among the summaries, and of its label.
    pub(crate) sample: usize,
    pub(crate) label: usize,
    /// Index of its data set, and of the first one with the same balls, on the same cloth and by
    /// the same camera.
    pub(crate) film: usize,
    pub(crate) balls: usize,
    pub(crate) cloth: usize,
    pub(crate) camera: usize,
}

/// All samples fitted alone, and what they are compared by.
pub(super) struct Samples<'a> {
    pub(crate) options: &'a Options,
    pub(crate) told_by: String,
    pub(crate) by_cloth: bool,
    pub(crate) labels: Vec<String>,
    pub(crate) fitted: Vec<Alone>,
    pub(crate) summaries: Vec<SampleSummary>,
    pub(crate) findings: Vec<Finding>,
}

impl<'a> Samples<'a> {
    /// Fits every sample alone: by cloth if all cloths are stated and differ, else by data set and
    /// the labels of `[fit] by`. `done` is called after each shot.
    ///
    /// # Errors
    /// Fewer than two labels with shots that can be fitted, or data that cannot be fitted as asked
    /// for.
    pub fn fit(
        datasets: &[Dataset],
        options: &'a Options,
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
            options,
            told_by: told_by.to_owned(),
            by_cloth,
            labels: Vec::new(),
            fitted: Vec::new(),
            summaries: Vec::new(),
            findings: Vec::new(),
        };
        for (film, dataset) in datasets.iter().enumerate() {
            let first = |label: fn(&Dataset) -> Option<&String>| {
                let own = label(dataset);
                let is_same = |other: &Dataset| own.is_some() && label(other) == own;
                datasets.iter().position(is_same).unwrap_or(film)
            };
            let balls = first(|dataset| dataset.balls.as_ref());
            let camera = first(|dataset| dataset.camera.as_ref());
            let cloth = datasets.iter().position(|other| other.cloth == dataset.cloth).unwrap_or(film);
            for (group, part) in fit::analysis::parts(dataset) {
                let title = match group {
                    Some(group) if datasets.len() > 1 => format!("{}, {group}", dataset.name),
                    Some(group) => group,
                    None => dataset.name.clone(),
                };
                all.add(part, title, [film, balls, cloth, camera], done)?;
            }
        }
        let mut fitted: Vec<usize> = all.fitted.iter().map(|alone| alone.label).collect();
        fitted.sort_unstable();
        fitted.dedup();
        if fitted.len() < 2 {
            return Err(CompareError::Refused(format!(
                "{} with usable shots; expected two or more to compare: data sets, or labels of one whose [fit] by names a column",
                count_of(fitted.len(), "sample")
            )));
        }
        Ok(all)
    }

    /// Fits a part of a data set.
    fn add(
        &mut self,
        dataset: Dataset,
        title: String,
        [film, balls, cloth, camera]: [usize; 4],
        done: &(dyn Fn() + Sync),
    ) -> Result<(), CompareError> {
        let name = dataset.cloth.as_ref().filter(|_| self.by_cloth).unwrap_or(&title);
        let label = self.labels.iter().position(|known| known == name).unwrap_or(self.labels.len());
        if label == self.labels.len() {
            self.labels.push(name.clone());
        }
        let sample = self.summaries.len();
        let Options { fidelity, loss, .. } = *self.options;
        let choices = fit::Options { fidelity, loss, depth: Depth::Estimates, ..fit::Options::default() };
        let (shots_used, shots_rejected) = match fit::fit_watched(&dataset, &choices, done) {
            Ok(mut fits) => {
                let fit = fits.remove(0);
                for finding in &fit.solution.findings {
                    // what all samples determine together is said of their joint fit
                    let is_of_all = matches!(finding, problem::Finding::Compliance { .. });
                    if let Some(sentence) = sentence(finding, fit.frames.as_ref())
                        && !is_of_all
                    {
                        let severity = finding.severity();
                        self.findings.push(Finding::OfSample { sample, severity, sentence });
                    }
                }
                let scatter = fit.scatter.filter(|scatter| scatter.is_estimated);
                self.findings.extend(scatter.map(|scatter| Finding::OfSample {
                    sample,
                    severity: Severity::Note,
                    sentence: words_of("scatter", Values::from(Serde(scatter))) + ".",
                }));
                let (settings, solution) = (dataset.settings_of_balls(), fit.solution);
                let alone = Alone { dataset, settings, solution, sample, label, film, balls, cloth, camera };
                self.fitted.push(alone);
                (fit.shots_used, fit.shots_rejected)
            }
            Err(FitError::NoUsableShot { shots_rejected, .. }) => (0, shots_rejected),
            Err(error) => return Err(error.into()),
        };
        let label = self.labels[label].clone();
        self.summaries.push(SampleSummary { title, label, shots_used, shots_rejected });
        Ok(())
    }

    /// Returns whether a quantity has a column for each label.
    pub(crate) fn is_separate(&self, quantity: Quantity) -> bool {
        self.options.is_separate(quantity, self.by_cloth)
    }

    /// Returns the first sample that the same camera filmed.
    pub(crate) fn first_film(&'a self, alone: &'a Alone) -> &'a Alone {
        self.fitted.iter().find(|other| other.camera == alone.camera).unwrap_or(alone)
    }
}
