//! What is fitted together: the unknowns of all samples, their bounds, and the constraints between them.

use nalgebra::DVector;

use super::{CompareError, Sample};
use crate::measurement::parameter::{Parameter, Settings};
use crate::measurement::relation::Sense;
use crate::measurement::values::Values;
use crate::numerics::least_squares::{Constraints, Linear};
use crate::physics::collision::Coefficients;

/// Which unknown a sample's parameter is; `None`: held at its initial value.
pub(super) type Columns = [Option<usize>; Parameter::COEFFICIENTS.len()];

/// Of a row of length 1: less than this is what rounding leaves of one that others imply.
const IMPLIED: f64 = 1e-9;

/// Decimal numbers are not exact.
const ROUNDING: f64 = 1e-12;

/// A constraint of `[fit] constraints` in the unknowns: row·x ≤ limit, or = limit.
#[derive(Clone)]
pub(super) struct Tie {
    pub row: DVector<f64>,
    pub limit: f64,
    /// As it was written.
    pub text: String,
    /// Whose.
    pub title: String,
}

#[derive(Clone)]
pub(super) struct Layout {
    /// For each sample.
    pub columns: Vec<Columns>,
    pub start: Vec<f64>,
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    /// The settings of each sample, a prior only where it counts.
    pub settings: Vec<Settings>,
    /// Independent of each other.
    pub equalities: Vec<Tie>,
    pub inequalities: Vec<Tie>,
}

impl Layout {
    pub(super) fn new(samples: &[Sample]) -> Self {
        Self {
            columns: vec![[None; 3]; samples.len()],
            start: Vec::new(),
            lower: Vec::new(),
            upper: Vec::new(),
            settings: samples.iter().map(|sample| sample.settings).collect(),
            equalities: Vec::new(),
            inequalities: Vec::new(),
        }
    }

    /// One unknown for a parameter of some samples. A prior that they share counts once.
    pub(super) fn add(&mut self, parameter: Parameter, members: &[usize]) {
        let Some(first) = members.first() else { return };
        let column = self.start.len();
        let setting = |i: &usize| self.settings[*i][parameter];
        let lower = members.iter().map(|i| setting(i).lower).fold(f64::NEG_INFINITY, f64::max);
        let upper = members.iter().map(|i| setting(i).upper).fold(f64::INFINITY, f64::min).max(lower);
        let start = setting(first).initial.clamp(lower, upper);
        self.start.push(start);
        self.lower.push(lower);
        self.upper.push(upper);
        for member in members {
            self.columns[*member][parameter as usize] = Some(column);
        }
        for member in &members[1..] {
            self.settings[*member][parameter].prior = None;
        }
    }

    /// Puts the constraints of all samples into the unknowns, once all are there. What several samples say of the same
    /// unknowns counts once.
    pub(super) fn relate(&mut self, samples: &[Sample]) -> Result<(), CompareError> {
        for (i, sample) in samples.iter().enumerate() {
            for relation in &sample.relations {
                let mut row = DVector::zeros(self.start.len());
                let (mut held, mut untold) = (0.0, false);
                for parameter in Parameter::ALL {
                    let factor = relation.coefficients[parameter as usize];
                    if factor == 0.0 {
                        continue;
                    }
                    match self.columns[i].get(parameter as usize).copied().flatten() {
                        Some(column) => row[column] += factor,
                        None => {
                            held += factor * self.settings[i][parameter].initial;
                            untold |= !self.settings[i][parameter].fixed;
                        }
                    }
                }
                // what the data do not tell may be whatever the constraint asks for
                if relation.sense == Sense::AtMost && untold {
                    continue;
                }
                let tie = Tie {
                    row,
                    limit: relation.limit - held,
                    text: relation.text.clone(),
                    title: sample.title.clone(),
                };
                if tie.row.amax() == 0.0 {
                    let excess = if relation.sense == Sense::Equal { tie.limit.abs() } else { -tie.limit };
                    if excess > ROUNDING * (1.0 + held.abs()) {
                        return Err(CompareError::Broken { title: tie.title, text: tie.text });
                    }
                } else if relation.sense == Sense::Equal {
                    self.equate(tie)?;
                } else {
                    let same = |known: &&Tie| known.row == tie.row && known.limit == tie.limit;
                    if self.inequalities.iter().find(same).is_none() {
                        self.inequalities.push(tie);
                    }
                }
            }
        }
        Ok(())
    }

    fn equate(&mut self, tie: Tie) -> Result<(), CompareError> {
        let scale = tie.row.norm();
        let (row, limit) = self.beyond_equalities(tie.row.clone() / scale, tie.limit / scale);
        if row.norm() > IMPLIED {
            self.equalities.push(tie);
        } else if limit.abs() > IMPLIED {
            return Err(self.contradiction(Some(&tie)));
        }
        Ok(())
    }

    /// What the equalities leave of a row and its limit.
    fn beyond_equalities(&self, mut row: DVector<f64>, mut limit: f64) -> (DVector<f64>, f64) {
        let mut basis: Vec<(DVector<f64>, f64)> = Vec::new();
        let less = |row: &mut DVector<f64>, limit: &mut f64, basis: &[(DVector<f64>, f64)]| {
            for (known, of_known) in basis {
                let part = known.dot(row);
                *row -= known * part;
                *limit -= of_known * part;
            }
        };
        for tie in &self.equalities {
            let (mut own, mut of_own) = (tie.row.clone(), tie.limit);
            less(&mut own, &mut of_own, &basis);
            let norm = own.norm();
            basis.push((own / norm, of_own / norm));
        }
        less(&mut row, &mut limit, &basis);
        (row, limit)
    }

    /// Whether the equalities say how much two unknowns differ.
    pub(super) fn pins(&self, first: usize, second: usize) -> bool {
        let mut row = DVector::zeros(self.start.len());
        (row[first], row[second]) = (1.0, -1.0);
        !self.equalities.is_empty() && self.beyond_equalities(row, 0.0).0.norm() < IMPLIED
    }

    /// The layout of some of the samples alone: their unknowns, and the constraints between these.
    pub(super) fn part(&self, members: &[usize]) -> Self {
        let mut kept: Vec<usize> =
            members.iter().flat_map(|i| self.columns[*i].iter().copied().flatten()).collect();
        kept.sort_unstable();
        kept.dedup();
        let pick = |all: &[f64]| kept.iter().map(|column| all[*column]).collect::<Vec<_>>();
        let among = |ties: &[Tie]| {
            let own = |tie: &&Tie| (0..tie.row.len()).all(|j| tie.row[j] == 0.0 || kept.contains(&j));
            let tie = |tie: &Tie| Tie { row: DVector::from_vec(pick(tie.row.as_slice())), ..tie.clone() };
            ties.iter().filter(own).map(tie).collect()
        };
        let place = |column: usize| kept.iter().position(|known| *known == column);
        Self {
            columns: members.iter().map(|i| self.columns[*i].map(|c| c.and_then(place))).collect(),
            start: pick(&self.start),
            lower: pick(&self.lower),
            upper: pick(&self.upper),
            settings: members.iter().map(|i| self.settings[*i]).collect(),
            equalities: among(&self.equalities),
            inequalities: among(&self.inequalities),
        }
    }

    /// With an unknown held at a value, from which the search also starts.
    pub(super) fn holding(&self, column: usize, value: f64) -> Self {
        let mut held = self.starting(column, value);
        (held.lower[column], held.upper[column]) = (value, value);
        held
    }

    /// With another start of an unknown.
    pub(super) fn starting(&self, column: usize, value: f64) -> Self {
        let mut layout = self.clone();
        layout.start[column] = value;
        layout
    }

    /// How many unknowns the equalities leave to be fitted.
    pub(super) fn room(&self) -> usize {
        self.start.len() - self.equalities.len()
    }

    pub(super) fn contradiction(&self, last: Option<&Tie>) -> CompareError {
        let mut texts: Vec<String> = Vec::new();
        for tie in self.equalities.iter().chain(&self.inequalities).chain(last) {
            let text = format!("\"{}\" ({})", tie.text, tie.title);
            if !texts.contains(&text) {
                texts.push(text);
            }
        }
        CompareError::Contradiction(texts.join(" and "))
    }

    /// Bounds and constraints, with `others` more unknowns behind that may be anything.
    pub(super) fn constraints(&self, others: usize) -> Constraints {
        let pad = |values: &[f64], other: f64| {
            DVector::from_iterator(
                values.len() + others,
                values.iter().copied().chain(std::iter::repeat_n(other, others)),
            )
        };
        let mut constraints =
            Constraints::bounds(pad(&self.lower, f64::NEG_INFINITY), pad(&self.upper, f64::INFINITY));
        let add = |linear: &mut Linear, ties: &[Tie]| {
            for tie in ties {
                let rows = linear.matrix.nrows();
                linear.matrix = linear.matrix.clone().insert_row(rows, 0.0);
                linear.matrix.set_row(rows, &pad(tie.row.as_slice(), 0.0).transpose());
                linear.limit = linear.limit.clone().push(tie.limit);
            }
        };
        add(&mut constraints.equalities, &self.equalities);
        add(&mut constraints.inequalities, &self.inequalities);
        constraints
    }

    /// The coefficients of a sample.
    pub(super) fn coefficients(&self, sample: usize, x: &[f64]) -> Coefficients {
        let mut values = Values::initial(&self.settings[sample]);
        for parameter in Parameter::COEFFICIENTS {
            if let Some(column) = self.columns[sample][parameter as usize] {
                values[parameter] = x[column];
            }
        }
        values.coefficients
    }

    /// How many priors there are.
    pub(super) fn priors(&self) -> usize {
        (0..self.columns.len()).map(|sample| self.priors_of(sample)).sum()
    }

    pub(super) fn priors_of(&self, sample: usize) -> usize {
        let (settings, columns) = (&self.settings[sample], &self.columns[sample]);
        let counts = |p: &&Parameter| columns[**p as usize].is_some() && settings[**p].prior.is_some();
        Parameter::COEFFICIENTS.iter().filter(counts).count()
    }
}
