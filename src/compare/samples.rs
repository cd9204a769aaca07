//! Every data set, or every label of its `[fit] by`, fitted alone, and the map of their columns:
//! which samples share which unknowns.

use std::sync::Arc;

use minijinja::value::Serde;
use minijinja::{Value as Values, context};
use nalgebra::Vector2;

use super::result::{Options, Quantity, SampleSummary};
use super::{CompareError, refuse};
use crate::fit::film_words::{Remark, sentence, words_of};
use crate::fit::{self, Depth, Fit, FitError};
use crate::measurement::dataset::Dataset;
use crate::measurement::number::count_of;
use crate::measurement::parameter::{Compliance, Parameter};
use crate::problem::own as place;
use crate::problem::{
    Block, Finding, Id, Mode, OTHER_UNIT, Own, Problem, Sample, Severity, Shared, Solution, State, Unknown,
};

/// A data set, or the shots of one label of its `[fit] by`, fitted alone.
pub(super) struct Alone {
    /// Its part of the data set.
    pub(crate) dataset: Dataset,
    pub(crate) solution: Arc<Solution>,
    /// Index of its sample among the summaries, and of its label.
    pub(crate) sample: usize,
    pub(crate) label: usize,
    /// Index of its data set.
    pub(crate) film: usize,
}

/// All samples fitted alone, and what they are compared by.
pub(super) struct Samples<'a> {
    pub(crate) options: &'a Options,
    pub(crate) told_by: String,
    by_cloth: bool,
    pub(crate) labels: Vec<String>,
    pub(crate) fitted: Vec<Alone>,
    pub(crate) summaries: Vec<SampleSummary>,
    pub(crate) remarks: Vec<Remark>,
}

impl<'a> Samples<'a> {
    /// Fits every sample alone: by cloth if all cloths are stated and differ, else by data set and
    /// the labels of `[fit] by`.
    ///
    /// # Errors
    /// Fewer than two labels with shots that can be fitted, or data that cannot be fitted as asked
    /// for.
    pub fn fit(datasets: &[Dataset], options: &'a Options) -> Result<Self, CompareError> {
        let by_cloth = datasets.iter().all(|dataset| dataset.cloth.is_some())
            && datasets.iter().any(|dataset| dataset.cloth != datasets[0].cloth);
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
            remarks: Vec::new(),
        };
        for (film, whole) in datasets.iter().enumerate() {
            for (group, dataset) in fit::analysis::parts(whole) {
                let title = match group {
                    Some(group) if datasets.len() > 1 => format!("{}, {group}", whole.name),
                    Some(group) => group,
                    None => whole.name.clone(),
                };
                all.add(dataset.into_owned(), title, film)?;
            }
        }
        let is_fitted = |label: &usize| all.fitted.iter().any(|alone| alone.label == *label);
        let fitted = (0..all.labels.len()).filter(is_fitted).count();
        if fitted < 2 {
            return refuse(format!(
                "{} with usable shots; expected two or more to compare: data sets, or labels of one whose [fit] by names a column",
                count_of(fitted, "sample")
            ));
        }
        Ok(all)
    }

    /// Fits a part of a data set.
    fn add(&mut self, dataset: Dataset, title: String, film: usize) -> Result<(), CompareError> {
        let name = dataset.cloth.as_ref().filter(|_| self.by_cloth).unwrap_or(&title).clone();
        let label = self.labels.iter().position(|known| *known == name).unwrap_or(self.labels.len());
        if label == self.labels.len() {
            self.labels.push(name.clone());
        }
        let sample = self.summaries.len();
        let Options { fidelity, loss, .. } = *self.options;
        let choices = fit::Options { fidelity, loss, depth: Depth::Estimates, ..fit::Options::default() };
        let (shots_used, shots_rejected) = match fit::fit(&dataset, &choices) {
            Ok(mut fits) => {
                let fit = fits.remove(0);
                let shots_used = fit.shots_used();
                let Fit { solution, frames, scatter, shots_rejected, .. } = fit;
                let mut add = |severity, sentence: String| {
                    let beside = format!("{title}: {sentence}");
                    self.remarks.push(Remark::new(severity, "of-sample", context! { beside }));
                };
                for finding in &solution.record.findings {
                    // what all samples determine together is said of their joint fit
                    let is_of_all = matches!(finding, Finding::Compliance { .. });
                    if let Some(sentence) = sentence(finding, frames.as_ref()).filter(|_| !is_of_all) {
                        add(finding.severity(), sentence);
                    }
                }
                if let Some(scatter) = scatter {
                    add(Severity::Note, words_of("scatter", Values::from(Serde(scatter))) + ".");
                }
                self.fitted.push(Alone { dataset, solution, sample, label, film });
                (shots_used, shots_rejected)
            }
            Err(FitError::NoUsableShot { shots_rejected, .. }) => (0, shots_rejected),
            Err(error) => return Err(error.into()),
        };
        let residuals = Vec::new();
        self.summaries.push(SampleSummary { title, label: name, shots_used, shots_rejected, residuals });
        Ok(())
    }

    /// Returns whether a quantity has a column for each label: as asked for, else by what the
    /// labels can differ in. A cloth has no part in what happens between the balls.
    pub(crate) fn is_separate(&self, quantity: Quantity) -> bool {
        let by_default = match quantity {
            Quantity::Parameter(Parameter::MuS) | Quantity::Sliding => self.by_cloth,
            Quantity::Parameter(Parameter::Mu | Parameter::B) => !self.by_cloth,
            Quantity::Parameter(_) => false,
        };
        let Options { share, per_dataset, .. } = self.options;
        !share.contains(&quantity) && (by_default || per_dataset.contains(&quantity))
    }
}

/// An unknown, and the samples that share it: those of the same number, and value if they hold it.
struct Column<'a> {
    id: Id,
    number: usize,
    held: Option<f64>,
    of: Vec<&'a Alone>,
}

impl Samples<'_> {
    /// Returns the problem of all samples with its start: the columns of the first sample come
    /// first, in the order of [`Id`].
    ///
    /// # Errors
    /// Films that are not by one camera though they are said to be.
    pub fn join(&self) -> Result<(Problem, State), CompareError> {
        let mut columns: Vec<Column> = Vec::new();
        let (mut samples, mut own): (Vec<Sample>, Vec<Vec<Own>>) = (Vec::new(), Vec::new());
        for alone in &self.fitted {
            let (mut block, values) = self.in_common_picture(alone)?;
            let columns_of_sample = Id::ALL.map(|id| {
                let (number, unknown) = (self.number(id, alone), self.unknown(id, alone));
                let held = (unknown.mode == Mode::Fixed).then_some(unknown.start);
                let is_same = |other: &Column| (other.id, other.number, other.held) == (id, number, held);
                let place = columns.iter().position(is_same).unwrap_or(columns.len());
                if place == columns.len() {
                    columns.push(Column { id, number, held, of: Vec::new() });
                }
                columns[place].of.push(alone);
                place
            });
            let noise_of = self.find_table(alone, &block, &samples).unwrap_or(samples.len());
            if let Some(first) = samples.get_mut(noise_of) {
                block.variation_mut().noises.clone_from(&first.block.variation().noises);
            }
            let names = Arc::clone(&alone.solution.problem.samples[0].names);
            samples.push(Sample { block, names, columns: columns_of_sample, noise_of });
            own.push(values);
        }
        let unknowns: Vec<Unknown> = columns.iter().map(|column| self.combine(column)).collect();
        let shared = Shared::starts(&unknowns);
        let mut problem = Problem { samples, unknowns, evaluations: Arc::default() };
        problem.refresh_contact();
        Ok((problem, State { own, shared }))
    }

    /// Returns the number of a column of an unknown, which samples with the same number share.
    fn number(&self, id: Id, alone: &Alone) -> usize {
        if let Some(quantity) = Quantity::ALL.into_iter().find(|quantity| quantity.id() == id) {
            return if self.is_separate(quantity) { alone.label } else { 0 };
        }
        let first = |is_same: &dyn Fn(&Dataset) -> bool| {
            let is_same = |other: &Alone| other.film == alone.film || is_same(&other.dataset);
            self.fitted.iter().position(is_same).unwrap_or(0)
        };
        let Dataset { balls, cloth, camera, .. } = &alone.dataset;
        match id {
            Id::MassRatio | Id::RadiusRatio => first(&|other| balls.is_some() && other.balls == *balls),
            Id::MuR | Id::Bounce => first(&|other| other.cloth == *cloth),
            id if id.is_of_camera() => first(&|other| camera.is_some() && other.camera == *camera),
            _ => first(&|_| false),
        }
    }

    /// Returns what a sample knows of an unknown; all decide together if the contact is compliant.
    fn unknown(&self, id: Id, alone: &Alone) -> Unknown {
        let unknown = *alone.solution.problem.unknown(id);
        let is_auto =
            alone.dataset.settings.compliance == Compliance::Auto && self.options.fidelity.is_none();
        let is_open = id == Id::Kappa && unknown.mode == Mode::Fixed && is_auto;
        Unknown { start: if is_open { 0.0 } else { unknown.start }, ..unknown }
    }

    /// Combines what samples know of their common unknown: the narrower prior, unless the frames of
    /// one contradict it, bounds of all, and as start the mean of the estimates.
    fn combine(&self, Column { id, of, .. }: &Column) -> Unknown {
        let mut all = self.unknown(*id, of[0]);
        let (mut weighted, mut sum, mut is_contradicted) = (0.0, 0.0, false);
        for alone in of {
            let Unknown { mode, prior, bounds: [low, high], .. } = self.unknown(*id, alone);
            all.mode = if mode == Mode::Free { mode } else { all.mode };
            all.bounds = [all.bounds[0].max(low), all.bounds[1].min(high)];
            all.prior = all.prior.into_iter().chain(prior).min_by(|a, b| a.sd.total_cmp(&b.sd));
            let conflict = |own: &Finding| matches!(own, Finding::Conflict { id: own, .. } if own == id);
            is_contradicted |= alone.solution.record.findings.iter().any(conflict);
            let factor = if *id == Id::Scale {
                self.first_film(alone).solution.record.unit / alone.solution.record.unit
            } else {
                1.0
            };
            let sd = alone.solution.get(*id).and_then(|estimate| estimate.std_error);
            let information = sd.map_or(f64::MIN_POSITIVE, |sd| sd.powi(-2));
            weighted += information * alone.solution.value(*id) * factor;
            sum += information;
        }
        if all.mode == Mode::Free {
            all.start = (weighted / sum).max(all.bounds[0]).min(all.bounds[1]);
        }
        Unknown { prior: all.prior.filter(|_| !is_contradicted), ..all }
    }

    /// Returns the first sample of the table that a sample is of, which have one noise.
    fn find_table(&self, alone: &Alone, block: &Block, samples: &[Sample]) -> Option<usize> {
        let Block::Rows(own) = block else { return None };
        let is_of_table = |(other, sample): (&Alone, &Sample)| {
            matches!(&sample.block, Block::Rows(of) if of.variation.noises.len() == own.variation.noises.len())
                && other.film == alone.film
        };
        self.fitted.iter().zip(samples).position(is_of_table)
    }

    /// Returns the first sample by the same camera.
    fn first_film(&self, alone: &Alone) -> &Alone {
        &self.fitted[self.number(Id::Scale, alone)]
    }

    /// Returns the data of a sample and its own unknowns, with its picture in the unit and from the
    /// middle of the first film by the same camera.
    fn in_common_picture(&self, alone: &Alone) -> Result<(Block, Vec<Own>), CompareError> {
        let (own, first) = (&alone.solution, self.first_film(alone));
        let first_solution = &first.solution;
        if first.film != alone.film && [own, first_solution].iter().any(|of| of.problem.film().is_none()) {
            return refuse(format!(
                "{}: camera names that of another data set, too; expected it of films of balls, whose shots calibrate their camera",
                alone.dataset.name
            ));
        }
        let factor = first_solution.record.unit / own.record.unit;
        let lengths = own.value(Id::Scale) * factor / first_solution.value(Id::Scale);
        if (lengths - 1.0).abs() > OTHER_UNIT {
            return refuse(format!(
                "{} and {}: lengths in their films differ by a factor of {lengths:.2}, but camera has the same label in both; \
                 expected it of one camera that was not moved",
                first.dataset.name, alone.dataset.name
            ));
        }
        let by = (Vector2::from(own.record.middle) - Vector2::from(first_solution.record.middle))
            * first_solution.record.unit;
        let (mut block, mut values) = (own.problem.samples[0].block.clone(), own.at.state.own[0].clone());
        if let Block::Film(film) = &mut block {
            film.move_picture(factor, by);
            // places on the table are from the middle, too
            let on_table = by / (factor * own.value(Id::Scale));
            for values in &mut values {
                values[place::X] += on_table.x;
                values[place::Y] += on_table.y;
            }
        }
        Ok((block, values))
    }
}
