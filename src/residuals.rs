//! (shots, parameters) → whitened residuals and Jacobian, as the least-squares problem that
//! [`crate::optimise`] solves.
//!
//! A shot's residuals d = predicted − measured have the covariance C = diag(σ²) + G C_in Gᵀ: its
//! observations' own variances and what the errors of the measured state before the impact add,
//! carried over by G = ∂predicted/∂inputs. With C = LLᵀ the whitened residuals are L⁻¹d.

use std::cell::RefCell;
use std::sync::Arc;

use argmin::core::{Error, Jacobian, Operator};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::collision::{Coefficients, Model};
use crate::dataset::{Joint, Shared};
use crate::impact::film::{self, Film, Reduced};
use crate::observable::Observable;
use crate::parameters::{Parameter, Prior, Settings};
use crate::predict::{MAX_OBSERVABLES, Plan, Prediction, wrap};
use crate::values::Values;

/// A shot that is fitted: which of the data set's, and what of it is compared.
#[derive(Clone, Debug)]
pub struct Fitted {
    pub index: usize,
    pub plan: Plan,
    /// Its frames, where these are fitted and not what was extracted from them.
    pub film: Option<Arc<Film>>,
}

/// How many unknowns all shots of a joint fit of frames share besides the parameters: μ_k and μ_r.
pub const CLOTH_UNKNOWNS: usize = film::CLOTH.len();

/// Standard deviations of observables for which the data give none, SI and radians.
pub type EstimatedSd = Vec<(Observable, f64)>;

/// L⁻¹ of every shot, lower triangles row by row, one after the other.
#[derive(Clone, Debug)]
pub struct Whitening {
    inverse: Vec<f64>,
    /// [`common_shifts`], one for each error that the shots share.
    common: Vec<Vec<f64>>,
}

impl Whitening {
    /// Of frames, which are weighted as they are.
    #[must_use]
    pub fn none() -> Self {
        Self { inverse: Vec::new(), common: Vec::new() }
    }

    /// With errors that all shots share, in the unit of their standard deviations: each becomes one more
    /// unknown behind the free parameters, with mean 0 and standard deviation 1.
    #[must_use]
    pub fn with_common(self, common: Vec<Vec<f64>>) -> Self {
        Self { common, ..self }
    }

    /// With a weight for each shot's part of χ².
    #[must_use]
    pub fn weighted(mut self, shots: &[Fitted], weights: &[f64]) -> Self {
        let mut rest = self.inverse.as_mut_slice();
        for (shot, weight) in shots.iter().zip(weights) {
            let rows = shot.plan.rows().len();
            let (own, others) = rest.split_at_mut(rows * (rows + 1) / 2);
            for entry in own {
                *entry *= weight.sqrt();
            }
            rest = others;
        }
        self
    }

    /// How many unknowns it adds to the free parameters.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.common.len()
    }

    /// `None` where a prediction fails or a covariance is not positive definite.
    #[must_use]
    pub fn new(
        shots: &[Fitted],
        model: &Model,
        coefficients: &Coefficients,
        estimated: &EstimatedSd,
    ) -> Option<Self> {
        let of_shot = |Fitted { plan, .. }: &Fitted| {
            let prediction = plan.predict(model, coefficients).ok()?;
            let l = covariance(plan, &prediction, estimated).cholesky()?.l();
            let inverse = l.solve_lower_triangular(&DMatrix::identity(l.nrows(), l.nrows()))?;
            let rows = (0..inverse.nrows()).flat_map(|row| (0..=row).map(move |column| (row, column)));
            Some(rows.map(|at| inverse[at]).collect::<Vec<_>>())
        };
        let all: Option<Vec<Vec<f64>>> = shots.par_iter().with_min_len(SHARE).map(of_shot).collect();
        let all = all?.concat();
        Some(Self { inverse: all, common: Vec::new() })
    }
}

/// C of one shot's observations.
#[must_use]
pub fn covariance(plan: &Plan, prediction: &Prediction, estimated: &EstimatedSd) -> DMatrix<f64> {
    let rows = plan.rows().len();
    let g = prediction.by_inputs.rows(0, rows);
    if let Some(joint) = plan.joint() {
        // d = predicted(inputs) − measured, so that C = [G, −1] Σ [G, −1]ᵀ
        let by = by_joint(prediction, rows);
        return &by * &joint.covariance * by.transpose();
    }
    let mut covariance = g
        * DMatrix::from_diagonal(&DVector::from_column_slice(plan.variance_in().as_slice()))
        * g.transpose();
    for (row, measurement) in plan.rows().iter().enumerate() {
        let sd = measurement.measured.sd.unwrap_or_else(|| {
            estimated.iter().find(|(o, _)| *o == measurement.observable).map_or(f64::NAN, |(_, sd)| *sd)
        });
        covariance[(row, row)] += sd * sd;
    }
    covariance
}

/// Differences by what was extracted together, in the order of [`Joint`].
fn by_joint(prediction: &Prediction, rows: usize) -> DMatrix<f64> {
    let mut by = DMatrix::zeros(rows, Joint::BEFORE + rows);
    by.columns_mut(0, Joint::BEFORE).copy_from(&prediction.by_inputs.rows(0, rows));
    for row in 0..rows {
        by[(row, Joint::BEFORE + row)] = -1.0;
    }
    by
}

/// How the differences of all shots move together when what they share moves by its standard error: for each
/// error, one number for each observation.
#[must_use]
pub fn common_shifts(
    shots: &[Fitted],
    model: &Model,
    coefficients: &Coefficients,
    errors: &[(Shared, f64)],
) -> Option<Vec<Vec<f64>>> {
    let mut shifts = vec![Vec::new(); errors.len()];
    if errors.is_empty() {
        return Some(shifts);
    }
    for Fitted { plan, .. } in shots {
        let rows = plan.rows().len();
        let prediction = plan.predict(model, coefficients).ok()?;
        let by = plan.joint().map(|joint| (joint, by_joint(&prediction, rows)));
        for (shift, (shared, sd)) in shifts.iter_mut().zip(errors) {
            match &by {
                Some((joint, by)) => shift.extend((by * &joint.by_shared[*shared as usize] * *sd).iter()),
                None => shift.extend(std::iter::repeat_n(0.0, rows)),
            }
        }
    }
    Some(shifts)
}

/// Predicted less measured; an angle's difference is brought to (−π, π].
#[must_use]
pub fn difference(observable: Observable, predicted: f64, measured: f64) -> f64 {
    let difference = predicted - measured;
    if observable.is_angle() { wrap(difference) } else { difference }
}

/// Whether their frames are fitted.
#[must_use]
pub fn are_filmed(shots: &[Fitted]) -> bool {
    shots.first().is_some_and(|shot| shot.film.is_some())
}

/// Fewer shots than this are not worth a second core.
const SHARE: usize = 512;

/// The least-squares problem in the free parameters.
pub struct Problem<'a> {
    pub shots: &'a [Fitted],
    pub model: &'a Model,
    pub settings: &'a Settings,
    pub free: &'a [Parameter],
    /// Values of the parameters that are not free.
    pub held: Values,
    pub whitening: &'a Whitening,
    /// The last point, since the optimiser asks for the Jacobian where it just asked for residuals.
    last: RefCell<Option<Point>>,
}

struct Point {
    x: DVector<f64>,
    residuals: DVector<f64>,
    jacobian: DMatrix<f64>,
}

impl<'a> Problem<'a> {
    #[must_use]
    pub fn new(
        shots: &'a [Fitted],
        model: &'a Model,
        settings: &'a Settings,
        free: &'a [Parameter],
        held: Values,
        whitening: &'a Whitening,
    ) -> Self {
        Self { shots, model, settings, free, held, whitening, last: RefCell::new(None) }
    }

    fn priors(&self) -> impl Iterator<Item = (usize, Prior)> {
        let priors = self.free.iter().enumerate();
        priors.filter_map(|(column, parameter)| Some((column, self.settings[*parameter].prior?)))
    }

    /// The frames of all shots, whose own unknowns are eliminated; behind the free parameters stand μ_k and μ_r.
    fn evaluate_frames(&self, x: &DVector<f64>) -> Point {
        let values = values(&self.held, self.free, x);
        let (model, Coefficients { mu, mu_s, e }) = (values.model(self.model), values.coefficients);
        let own = self.free.len();
        let shared = [mu, mu_s, e, x[own], x[own + 1]];
        let frames = self.shots.len() * film::ROWS;
        let count = frames + self.priors().count() + CLOTH_UNKNOWNS;
        let mut residuals = DVector::zeros(count);
        let mut jacobian = DMatrix::zeros(count, own + CLOTH_UNKNOWNS);
        let reduced = |shot: &Fitted| shot.film.as_ref()?.reduced(&shot.plan.collision(&model), &shared);
        let all: Vec<Option<Reduced>> = self.shots.par_iter().map(reduced).collect();
        let columns = self.free.iter().map(|parameter| *parameter as usize);
        let columns: Vec<usize> = columns.chain([film::SHARED - 2, film::SHARED - 1]).collect();
        for (i, reduced) in all.iter().enumerate() {
            let mut rows = residuals.rows_mut(i * film::ROWS, film::ROWS);
            let Some(reduced) = reduced else {
                // the optimiser shrinks a step that ends where there is no prediction
                rows.fill(f64::NAN);
                continue;
            };
            rows.copy_from(&reduced.residuals);
            for (column, of) in columns.iter().enumerate() {
                let mut block = jacobian.view_mut((i * film::ROWS, column), (film::ROWS, 1));
                block.copy_from(&reduced.jacobian.column(*of));
            }
        }
        let cloth = film::CLOTH.iter().enumerate().map(|(i, (mean, sd))| (own + i, *mean, *sd));
        let priors = self.priors().map(|(column, prior)| (column, prior.mean, prior.sd)).chain(cloth);
        for (row, (column, mean, sd)) in priors.enumerate() {
            residuals[frames + row] = (x[column] - mean) / sd;
            jacobian[(frames + row, column)] = 1.0 / sd;
        }
        Point { x: x.clone(), residuals, jacobian }
    }

    fn evaluate(&self, x: &DVector<f64>) -> Point {
        if are_filmed(self.shots) {
            return self.evaluate_frames(x);
        }
        let values = values(&self.held, self.free, x);
        let model = values.model(self.model);
        let observations: usize = self.shots.iter().map(|shot| shot.plan.rows().len()).sum();
        let priors = self.priors().count();
        let shared = &self.whitening.common;
        let own_columns = self.free.len();
        let count = observations + priors + self.whitening.unknowns();
        let columns = self.free.len() + self.whitening.unknowns();
        let mut residuals = DVector::zeros(count);
        let mut jacobian = DMatrix::zeros(count, columns);
        let mut weights = self.whitening.inverse.as_slice();
        let mut first = 0;
        let predictions: Vec<_> = self
            .shots
            .par_iter()
            .with_min_len(SHARE)
            .map(|shot| shot.plan.predict(&model, &values.coefficients))
            .collect();
        for (Fitted { plan, .. }, prediction) in self.shots.iter().zip(predictions) {
            let rows = plan.rows();
            let (own, rest) = weights.split_at(rows.len() * (rows.len() + 1) / 2);
            weights = rest;
            match prediction {
                Ok(prediction) => {
                    let mut raw = [0.0; MAX_OBSERVABLES];
                    for (i, row) in rows.iter().enumerate() {
                        raw[i] = difference(row.observable, prediction.values[i], row.measured.value);
                        for (k, shift) in shared.iter().enumerate() {
                            raw[i] += shift[first + i] * x[own_columns + k];
                        }
                    }
                    let mut own = own.iter();
                    for i in 0..rows.len() {
                        for j in 0..=i {
                            let weight = own.next().copied().unwrap_or(f64::NAN);
                            residuals[first + i] += weight * raw[j];
                            for (k, shift) in shared.iter().enumerate() {
                                jacobian[(first + i, own_columns + k)] += weight * shift[first + j];
                            }
                            for (column, parameter) in self.free.iter().enumerate() {
                                jacobian[(first + i, column)] +=
                                    weight * prediction.by_parameters[(j, *parameter as usize)];
                            }
                        }
                    }
                }
                // the optimiser shrinks a step that ends where there is no prediction
                Err(_) => residuals.rows_mut(first, rows.len()).fill(f64::NAN),
            }
            first += rows.len();
        }
        for (row, (column, prior)) in self.priors().enumerate() {
            residuals[observations + row] = (x[column] - prior.mean) / prior.sd;
            jacobian[(observations + row, column)] = 1.0 / prior.sd;
        }
        for k in 0..shared.len() {
            residuals[observations + priors + k] = x[own_columns + k];
            jacobian[(observations + priors + k, own_columns + k)] = 1.0;
        }
        Point { x: x.clone(), residuals, jacobian }
    }

    /// Residuals and Jacobian without minimising.
    #[must_use]
    pub fn evaluate_at(&self, x: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let point = self.evaluate(x);
        (point.residuals, point.jacobian)
    }

    fn at<T>(&self, x: &DVector<f64>, read: impl Fn(&Point) -> T) -> T {
        let mut last = self.last.borrow_mut();
        match last.as_ref() {
            Some(point) if point.x == *x => read(point),
            _ => read(last.insert(self.evaluate(x))),
        }
    }
}

impl Operator for Problem<'_> {
    type Param = DVector<f64>;
    type Output = DVector<f64>;

    fn apply(&self, x: &DVector<f64>) -> Result<DVector<f64>, Error> {
        Ok(self.at(x, |point| point.residuals.clone()))
    }
}

impl Jacobian for Problem<'_> {
    type Param = DVector<f64>;
    type Jacobian = DMatrix<f64>;

    fn jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, Error> {
        Ok(self.at(x, |point| point.jacobian.clone()))
    }
}

/// The values with the free parameters at `x`, the others as in `held`.
#[must_use]
pub fn values(held: &Values, free: &[Parameter], x: &DVector<f64>) -> Values {
    let mut values = *held;
    for (parameter, value) in free.iter().zip(x.iter()) {
        values[*parameter] = *value;
    }
    values
}
