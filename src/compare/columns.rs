//! The map of columns: which samples share which unknowns.

use std::sync::Arc;

use nalgebra::Vector2;

use super::quantity::Quantity;
use super::samples::{Alone, Samples};
use crate::measurement::parameter::Compliance;
use crate::problem::own as place;
use crate::problem::{Block, Finding, Id, Mode, Normal, Own, Problem, Sample, Shared, State, Unknown};

/// The data of a sample as another film's camera sees them.
struct Seen {
    block: Block,
    own: Vec<Own>,
    /// Lengths in its picture over those that it was fitted with.
    factor: f64,
}

/// A column under construction.
struct Column {
    unknown: Unknown,
    /// Distinguishes columns of the same unknown.
    number: usize,
    /// Sums of estimates by their information, and of the information.
    weighted: f64,
    information: f64,
    /// Whether the frames of a sample contradict its prior, which its fit then left out.
    is_contradicted: bool,
}

impl Samples<'_> {
    /// Returns what distinguishes the columns of an unknown: samples with the same number share one.
    fn number(&self, id: Id, alone: &Alone) -> usize {
        if let Some(quantity) = Quantity::ALL.into_iter().find(|quantity| quantity.id() == id) {
            return if self.is_apart(quantity) { alone.label } else { 0 };
        }
        match id {
            Id::MassRatio | Id::RadiusRatio => alone.balls,
            Id::MuR | Id::Bounce => alone.cloth,
            id if id.is_of_camera() => alone.camera,
            _ => alone.film,
        }
    }

    /// Returns the problem of all samples with its start: the columns of the first sample come first, in
    /// the order of [`Id`].
    pub fn join(&self) -> (Problem, State) {
        let kappa = self.adopted_kappa();
        let mut columns: Vec<Column> = Vec::new();
        let (mut samples, mut own): (Vec<Sample>, Vec<Vec<Own>>) = (Vec::new(), Vec::new());
        for alone in &self.fitted {
            let Seen { mut block, own: values, factor } = self.seen_alike(alone);
            let of_sample = Id::ALL.map(|id| {
                let mut column = Column::new(alone, id, self.number(id, alone));
                if id == Id::Scale {
                    column.weighted *= factor;
                }
                if id == Id::Kappa && alone.settings.compliance == Compliance::Auto {
                    column.adopt(kappa);
                }
                let place = columns.iter().position(|other| other.is_same(&column)).unwrap_or(columns.len());
                match columns.get_mut(place) {
                    Some(known) => known.merge(&column),
                    None => columns.push(column),
                }
                place
            });
            // labels of one table have its noise
            let number = samples.len();
            let is_of_table = |(other, sample): (&Alone, &Sample)| {
                let is_table = match (&sample.block, &block) {
                    (Block::Rows(of), Block::Rows(own)) => of.noises.len() == own.noises.len(),
                    _ => false,
                };
                is_table && other.film == alone.film
            };
            let noise_of = self.fitted.iter().zip(&samples).position(is_of_table).unwrap_or(number);
            if let Some(first) = samples.get_mut(noise_of) {
                let noises = first.block.noises_mut().to_vec();
                block.noises_mut().iter_mut().zip(noises).for_each(|(own, of_table)| *own = of_table);
            }
            samples.push(Sample { block, columns: of_sample, noise_of });
            own.push(values);
        }
        let unknowns = columns.iter().map(Column::unknown).collect();
        let shared = Shared(columns.iter().map(Column::start).collect());
        let mut problem = Problem { samples, unknowns, evaluations: Arc::default() };
        problem.refresh_contact();
        (problem, State { own, shared })
    }

    /// Returns the data of a sample and its own unknowns, with its picture in the unit and from the middle
    /// of the first film by the same camera.
    fn seen_alike(&self, alone: &Alone) -> Seen {
        let solution = &alone.solution;
        let mut block = solution.problem.samples[0].block.clone();
        let mut own = solution.at.state.own[0].clone();
        let first = &self.first_film(alone).solution;
        let factor = first.unit / solution.unit;
        let middle = |middle: [f64; 2]| Vector2::from(middle);
        let by = (middle(solution.middle) - middle(first.middle)) * first.unit;
        if let Block::Film(film) = &mut block {
            film.move_picture(factor, by);
            // places on the table are from the middle, too
            let on_table = by / (factor * solution.value(Id::Scale));
            for values in &mut own {
                values[place::X] += on_table.x;
                values[place::Y] += on_table.y;
            }
        }
        Seen { block, own, factor }
    }

    /// Returns κ of the compliant contact that the fit of a sample adopted. What one sample calls for, all have.
    fn adopted_kappa(&self) -> Option<f64> {
        let is_auto = |alone: &&Alone| alone.settings.compliance == Compliance::Auto;
        let kappas = self.fitted.iter().filter(is_auto);
        let mut kappas = kappas.map(|alone| alone.solution.problem.unknown(Id::Kappa).start);
        kappas.find(|kappa| *kappa != 0.0)
    }
}

impl Column {
    fn new(alone: &Alone, id: Id, number: usize) -> Self {
        let solution = &alone.solution;
        let unknown = *solution.problem.unknown(id);
        let sd = solution.get(id).and_then(|estimate| estimate.std_error);
        let information = sd.map_or(f64::MIN_POSITIVE, |sd| sd.powi(-2));
        let is_conflict =
            |finding: &Finding| matches!(finding, Finding::Conflict { id: of, .. } if *of == id);
        Self {
            unknown,
            number,
            weighted: information * solution.value(id),
            information,
            is_contradicted: solution.findings.iter().any(is_conflict),
        }
    }

    /// Holds κ at the value that another sample's fit adopted.
    fn adopt(&mut self, kappa: Option<f64>) {
        if let Some(kappa) = kappa.filter(|_| self.unknown.mode == Mode::Fixed) {
            self.unknown.start = kappa;
            self.weighted = kappa * self.information;
        }
    }

    /// Returns whether two samples have one unknown in common. What one of them holds is its own, unless the
    /// other holds it at the same value.
    fn is_same(&self, other: &Self) -> bool {
        let (a, b) = (&self.unknown, &other.unknown);
        let agrees = match (a.mode == Mode::Fixed, b.mode == Mode::Fixed) {
            (true, true) => a.start == b.start,
            (held, other) => held == other,
        };
        a.id == b.id && self.number == other.number && agrees
    }

    /// Combines what two samples know of their common unknown: the narrower prior, and bounds of both.
    fn merge(&mut self, other: &Self) {
        let (mine, others) = (&mut self.unknown, &other.unknown);
        if others.mode == Mode::Free {
            mine.mode = Mode::Free;
        }
        mine.bounds = [mine.bounds[0].max(others.bounds[0]), mine.bounds[1].min(others.bounds[1])];
        let priors = mine.prior.into_iter().chain(others.prior);
        mine.prior = priors.min_by(|a: &Normal, b: &Normal| a.sd.total_cmp(&b.sd));
        self.weighted += other.weighted;
        self.information += other.information;
        self.is_contradicted |= other.is_contradicted;
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
