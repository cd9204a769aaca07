//! Where the unknowns of a fit may be: their bounds, and the constraints that data sets state between parameters.

use nalgebra::DVector;

use super::FitError;
use super::samples::Search;
use crate::likelihood::sample::{Sample, Unknown, shared_columns};
use crate::measurement::parameter::Parameter;
use crate::measurement::relation::{Relation, Sense};
use crate::measurement::values::Values;
use crate::numerics::least_squares::{Constraints, Linear};

/// Of a row of length 1: less than this is what rounding leaves of one that others imply.
const IMPLIED: f64 = 1e-9;

/// Decimal numbers are not exact.
const ROUNDING: f64 = 1e-12;

/// A constraint of a data set in the columns of a fit: row·x ≤ limit, or = limit.
#[derive(Clone)]
pub(crate) struct Tie {
    pub row: DVector<f64>,
    pub limit: f64,
    pub sense: Sense,
    /// As it was written, with whose it is where there are several samples.
    pub text: String,
}

impl Search<'_> {
    /// The constraints of a fit of one sample, and whether they hold with equality at some values.
    pub(super) fn relations_at(&self, values: &Values) -> Vec<(String, bool)> {
        /// Of the terms of a sum that is held exactly.
        const ROUNDING: f64 = 1e-9;
        let state = |relation: &Relation| {
            let terms = Parameter::ALL.map(|p| relation.coefficients[p as usize] * values[p]);
            let size = relation.limit.abs() + terms.iter().map(|t| t.abs()).sum::<f64>();
            let slack = relation.limit - terms.iter().sum::<f64>();
            (relation.text.clone(), slack.abs() <= ROUNDING * size)
        };
        self.first().relations.iter().map(state).collect()
    }

    /// Where a search begins, in the columns of the fit.
    pub(super) fn start(&self, free: &[Unknown]) -> DVector<f64> {
        let (shared, columns) = shared_columns(&self.samples, free.len());
        let mut start = DVector::zeros(columns);
        let initial = self.initial();
        for (column, unknown) in free.iter().enumerate() {
            start[column] = self.value(&initial, *unknown);
        }
        for (sample, own) in self.samples.iter().zip(&shared).filter(|(sample, _)| sample.is_filmed()) {
            for (column, unknown) in own.iter().zip(&sample.unknowns) {
                start[*column] = unknown.start;
            }
        }
        start
    }

    /// Bounds of the free unknowns and of what the shots share, and the constraints between them with what is not free put in.
    ///
    /// # Errors
    /// Constraints that contradict each other, or what is held.
    pub(crate) fn constraints(&self, free: &[Unknown]) -> Result<Constraints, FitError> {
        let (shared, columns) = shared_columns(&self.samples, free.len());
        let mut lower = DVector::repeat(columns, f64::NEG_INFINITY);
        let mut upper = DVector::repeat(columns, f64::INFINITY);
        for (column, unknown) in free.iter().enumerate() {
            let setting = self.setting(*unknown);
            (lower[column], upper[column]) = (setting.lower, setting.upper);
        }
        for (sample, own) in self.samples.iter().zip(&shared).filter(|(sample, _)| sample.is_filmed()) {
            for (column, unknown) in own.iter().zip(&sample.unknowns) {
                [lower[*column], upper[*column]] = unknown.bounds;
            }
        }
        let mut constraints = Constraints::bounds(lower, upper);
        for tie in self.ties(free)? {
            match tie.sense {
                Sense::AtMost => add(&mut constraints.inequalities, &tie.row, tie.limit),
                Sense::Equal => add(&mut constraints.equalities, &tie.row, tie.limit),
            }
        }
        Ok(constraints)
    }

    /// The constraints among the free unknowns; what several samples say of the same ones counts once.
    pub(crate) fn ties(&self, free: &[Unknown]) -> Result<Vec<Tie>, FitError> {
        let (_, columns) = shared_columns(&self.samples, free.len());
        let mut ties: Vec<Tie> = Vec::new();
        let mut equalities = Linear::none(columns);
        for sample in &self.samples {
            let own = sample.columns(free);
            for relation in sample.relations {
                let involves = |p: &Parameter| relation.coefficients[*p as usize] != 0.0;
                // what the data do not determine may be whatever the constraint asks for
                if relation.sense == Sense::AtMost && sample.undetermined.iter().any(involves) {
                    continue;
                }
                let is_held = |p: &Parameter| involves(p) && own.iter().all(|(_, known)| known != p);
                let held = Parameter::ALL.into_iter().filter(is_held);
                let held: f64 = held.map(|p| relation.coefficients[p as usize] * sample.initial[p]).sum();
                let mut row = DVector::zeros(columns);
                for (column, parameter) in &own {
                    row[*column] = relation.coefficients[*parameter as usize];
                }
                let (limit, sense, text) =
                    (relation.limit - held, relation.sense, self.text(sample, relation));
                if row.amax() == 0.0 {
                    let excess = if sense == Sense::Equal { limit.abs() } else { -limit };
                    if excess > ROUNDING * (1.0 + held.abs()) {
                        return Err(FitError::Relations(format!(
                            "{text} does not hold for the values at which its parameters are held"
                        )));
                    }
                    continue;
                }
                if sense == Sense::Equal {
                    let scale = row.norm();
                    let (rest, left) = beyond(&equalities, row.clone() / scale, limit / scale);
                    if rest.norm() > IMPLIED {
                        add(&mut equalities, &row, limit);
                    } else if left.abs() > IMPLIED {
                        return Err(self.contradiction());
                    } else {
                        continue;
                    }
                } else if ties.iter().any(|known| known.row == row && known.limit == limit) {
                    continue;
                }
                ties.push(Tie { row, limit, sense, text });
            }
        }
        Ok(ties)
    }

    /// A constraint as errors name it.
    fn text(&self, sample: &Sample, relation: &Relation) -> String {
        match self.samples.len() {
            1 => format!("\"{}\"", relation.text),
            _ => format!("\"{}\" ({})", relation.text, sample.title),
        }
    }

    /// That no values satisfy all constraints.
    pub(super) fn contradiction(&self) -> FitError {
        let texts = self.samples.iter().flat_map(|s| s.relations.iter().map(|r| self.text(s, r)));
        let texts: Vec<String> = texts.collect();
        FitError::Relations(format!("no values within the bounds satisfy {}", texts.join(" and ")))
    }
}

/// One more row.
pub(crate) fn add(linear: &mut Linear, row: &DVector<f64>, limit: f64) {
    let rows = linear.matrix.nrows();
    linear.matrix = linear.matrix.clone().insert_row(rows, 0.0);
    linear.matrix.set_row(rows, &row.transpose());
    linear.limit = linear.limit.clone().push(limit);
}

/// What equalities that are independent leave of a row and its limit.
fn beyond(equalities: &Linear, mut row: DVector<f64>, mut limit: f64) -> (DVector<f64>, f64) {
    let mut basis: Vec<(DVector<f64>, f64)> = Vec::new();
    let less = |row: &mut DVector<f64>, limit: &mut f64, basis: &[(DVector<f64>, f64)]| {
        for (known, of_known) in basis {
            let part = known.dot(row);
            *row -= known * part;
            *limit -= of_known * part;
        }
    };
    for i in 0..equalities.len() {
        let (mut own, mut of_own) = (equalities.matrix.row(i).transpose(), equalities.limit[i]);
        less(&mut own, &mut of_own, &basis);
        let norm = own.norm();
        basis.push((own / norm, of_own / norm));
    }
    less(&mut row, &mut limit, &basis);
    (row, limit)
}

/// Whether equalities prescribe how much two columns differ.
pub(crate) fn pins(constraints: &Constraints, first: usize, second: usize) -> bool {
    let mut row = DVector::zeros(constraints.lower.len());
    (row[first], row[second]) = (1.0, -1.0);
    beyond(&constraints.equalities, row, 0.0).0.norm() < IMPLIED
}
