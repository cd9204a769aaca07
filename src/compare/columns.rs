//! The map of columns: which samples share which unknowns.

use std::sync::Arc;

use nalgebra::Vector2;

use super::quantity::Quantity;
use super::samples::{Alone, Samples};
use crate::measurement::parameter::Compliance;
use crate::problem::own as place;
use crate::problem::{Block, Finding, Id, Mode, Own, Problem, Sample, Shared, State, Unknown};

/// The labels or samples that have columns of their own.
#[derive(Clone, Copy, PartialEq)]
struct Key {
    id: Id,
    /// Samples with the same number share the unknown.
    number: usize,
    /// Value of an unknown that is held: it is shared by samples that hold the same value.
    held: Option<f64>,
}

/// A column under construction.
struct Column {
    key: Key,
    unknown: Unknown,
    /// Sums of estimates by their information, and of the information.
    weighted: f64,
    information: f64,
    /// Whether the frames of a sample contradict its prior, which its fit then left out.
    is_contradicted: bool,
}

impl Samples<'_> {
    /// Returns the problem of all samples with its start: the columns of the first sample come
    /// first, in the order of [`Id`].
    pub fn join(&self) -> (Problem, State) {
        let mut columns: Vec<Column> = Vec::new();
        let (mut samples, mut own): (Vec<Sample>, Vec<Vec<Own>>) = (Vec::new(), Vec::new());
        for alone in &self.fitted {
            let (mut block, values, factor) = self.in_common_picture(alone);
            let of_sample = Id::ALL.map(|id| {
                let column = self.column(alone, id, factor);
                let place = columns.iter().position(|other| other.key == column.key);
                if let Some(place) = place {
                    columns[place].merge(&column);
                    return place;
                }
                columns.push(column);
                columns.len() - 1
            });
            let noise_of = self.find_table(alone, &block, &samples).unwrap_or(samples.len());
            if let Some(first) = samples.get_mut(noise_of) {
                let noises = first.block.noises_mut().to_vec();
                block.noises_mut().copy_from_slice(&noises);
            }
            samples.push(Sample { block, columns: of_sample, noise_of });
            own.push(values);
        }
        let shared = Shared(columns.iter().map(Column::start).collect());
        let unknowns = columns.iter().map(Column::unknown).collect();
        let mut problem = Problem { samples, unknowns, evaluations: Arc::default() };
        problem.refresh_contact();
        (problem, State { own, shared })
    }

    /// Returns what distinguishes the columns of an unknown: samples with the same number share
    /// one.
    fn number(&self, id: Id, alone: &Alone) -> usize {
        if let Some(quantity) = Quantity::ALL.into_iter().find(|quantity| quantity.id() == id) {
            return if self.is_separate(quantity) { alone.label } else { 0 };
        }
        match id {
            Id::MassRatio | Id::RadiusRatio => alone.balls,
            Id::MuR | Id::Bounce => alone.cloth,
            id if id.is_of_camera() => alone.camera,
            _ => alone.film,
        }
    }

    /// Returns what a sample knows of an unknown, a scale times `factor`.
    fn column(&self, alone: &Alone, id: Id, factor: f64) -> Column {
        let solution = &alone.solution;
        let mut unknown = *solution.problem.unknown(id);
        let mut value = solution.value(id) * if id == Id::Scale { factor } else { 1.0 };
        let is_adoptable = id == Id::Kappa && unknown.mode == Mode::Fixed;
        if let Some(kappa) = self.adopted_kappa().filter(|_| is_adoptable && is_auto(alone)) {
            (unknown.start, value) = (kappa, kappa);
        }
        let is_conflict =
            |finding: &Finding| matches!(finding, Finding::Conflict { id: of, .. } if *of == id);
        let is_contradicted = solution.findings.iter().any(is_conflict);
        let sd = solution.get(id).and_then(|estimate| estimate.std_error);
        let information = sd.map_or(f64::MIN_POSITIVE, |sd| sd.powi(-2));
        let held = (unknown.mode == Mode::Fixed).then_some(unknown.start);
        let key = Key { id, number: self.number(id, alone), held };
        Column { key, unknown, weighted: information * value, information, is_contradicted }
    }

    /// Returns κ of the compliant contact that the fit of a sample adopted. What one sample needs,
    /// all have.
    fn adopted_kappa(&self) -> Option<f64> {
        let all = self.fitted.iter().filter(|alone| is_auto(alone));
        let mut kappas = all.map(|alone| alone.solution.problem.unknown(Id::Kappa).start);
        kappas.find(|kappa| *kappa != 0.0)
    }

    /// Returns the first sample of the table that a sample is of: labels of one table have its
    /// noise.
    fn find_table(&self, alone: &Alone, block: &Block, samples: &[Sample]) -> Option<usize> {
        let is_of_table = |(other, sample): (&Alone, &Sample)| match (&sample.block, block) {
            (Block::Rows(of), Block::Rows(own)) => {
                other.film == alone.film && of.noises.len() == own.noises.len()
            }
            _ => false,
        };
        self.fitted.iter().zip(samples).position(is_of_table)
    }

    /// Returns the data of a sample and its own unknowns, with its picture in the unit and from the
    /// middle of the first film by the same camera, and lengths in that picture over those before.
    fn in_common_picture(&self, alone: &Alone) -> (Block, Vec<Own>, f64) {
        let solution = &alone.solution;
        let mut block = solution.problem.samples[0].block.clone();
        let mut own = solution.at.state.own[0].clone();
        let first = &self.first_film(alone).solution;
        let factor = first.unit / solution.unit;
        let by = (Vector2::from(solution.middle) - Vector2::from(first.middle)) * first.unit;
        if let Block::Film(film) = &mut block {
            film.move_picture(factor, by);
            // places on the table are from the middle, too
            let on_table = by / (factor * solution.value(Id::Scale));
            for values in &mut own {
                values[place::X] += on_table.x;
                values[place::Y] += on_table.y;
            }
        }
        (block, own, factor)
    }
}

fn is_auto(alone: &Alone) -> bool {
    alone.settings.compliance == Compliance::Auto
}

impl Column {
    /// Combines what two samples know of their common unknown: the narrower prior, and bounds of
    /// both.
    fn merge(&mut self, other: &Self) {
        let (mine, others) = (&mut self.unknown, &other.unknown);
        if others.mode == Mode::Free {
            mine.mode = Mode::Free;
        }
        mine.bounds = [mine.bounds[0].max(others.bounds[0]), mine.bounds[1].min(others.bounds[1])];
        let priors = mine.prior.into_iter().chain(others.prior);
        mine.prior = priors.min_by(|a, b| a.sd.total_cmp(&b.sd));
        self.is_contradicted |= other.is_contradicted;
        self.weighted += other.weighted;
        self.information += other.information;
    }

    fn unknown(&self) -> Unknown {
        let prior = self.unknown.prior.filter(|_| !self.is_contradicted);
        Unknown { prior, ..self.unknown }
    }

    fn start(&self) -> f64 {
        let Unknown { mode, start, bounds: [low, high], .. } = self.unknown;
        if mode == Mode::Free { (self.weighted / self.information).max(low).min(high) } else { start }
    }
}
