//! (shots, parameters) → whitened residuals and Jacobian, as the least-squares problem that
//! [`crate::numerics::least_squares`] solves.
//!
//! While the parameters move, every shot's estimated inputs ξ̂, how its differences follow from the inputs (G) and what
//! they are weighted by (C = LLᵀ) stay as a [`Whitening`] has them: the residuals are L⁻¹(f(ξ̂) + G(x − ξ̂) − measured).
//! Where the weights have come to rest, χ² and its derivative are those of a fit of parameters and all inputs at once.

use std::cell::RefCell;

use argmin::core::{Error, Jacobian, Operator};
use nalgebra::{DMatrix, DVector, SVector};
use rayon::prelude::*;

use super::fitted::{Fitted, SHARE};
use super::frames::shared_unknowns::{self, SharedUnknown};
use super::frames::{self, Reduced};
use super::prediction::{MAX_OBSERVABLES, Unpredictable, difference};
use super::whitening::{AtKinks, Whitening};
use crate::measurement::parameter::{Parameter, Prior, Settings};
use crate::measurement::values::Values;
use crate::physics::collision::Model;

/// Whether their frames are fitted.
#[must_use]
pub fn are_filmed(shots: &[Fitted]) -> bool {
    shots.first().is_some_and(|shot| shot.film.is_some())
}

/// Whether χ² is a little rough: that of frames, by landings between them, and that of collisions that are integrated to a tolerance.
#[must_use]
pub fn is_rough(fitted: &[Fitted]) -> bool {
    are_filmed(fitted) || fitted.iter().any(|shot| shot.plan.is_direct())
}

/// The least-squares problem in the free parameters.
pub struct Problem<'a> {
    pub shots: &'a [Fitted],
    pub model: &'a Model,
    pub settings: &'a Settings,
    pub free: &'a [Parameter],
    /// What all shots of a fit of frames share besides, in the order of its columns behind the free parameters.
    pub unknowns: &'a [SharedUnknown],
    /// Values of the parameters that are not free.
    pub held: Values,
    pub whitening: &'a Whitening,
    /// The last point, since the optimiser asks for the Jacobian where it just asked for residuals.
    last: RefCell<Option<Point>>,
    /// Where χ² of the frames was least so far: from there the own unknowns of the shots are looked for.
    best: RefCell<Best>,
}

/// All shots at some shared parameters.
struct Best {
    chi2: f64,
    shared: SVector<f64, { frames::ALL_SHARED }>,
    /// None before the first evaluation.
    shots: Vec<Reduced>,
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
        (free, unknowns): (&'a [Parameter], &'a [SharedUnknown]),
        held: Values,
        whitening: &'a Whitening,
    ) -> Self {
        Self {
            shots,
            model,
            settings,
            free,
            unknowns,
            held,
            whitening,
            last: RefCell::new(None),
            best: RefCell::new(Best { chi2: f64::INFINITY, shared: SVector::zeros(), shots: Vec::new() }),
        }
    }

    fn priors(&self) -> impl Iterator<Item = (usize, Prior)> {
        let priors = self.free.iter().enumerate();
        priors.filter_map(|(column, parameter)| Some((column, self.settings[*parameter].prior?)))
    }

    /// The frames of all shots, whose own unknowns are eliminated; behind the free parameters stand the unknowns of the list.
    fn evaluate_frames(&self, x: &DVector<f64>) -> Point {
        let values = values(&self.held, self.free, x);
        let model = values.model(self.model);
        let own = self.free.len();
        let unknowns = self.unknowns.len();
        let shared = shared_unknowns::shared(&values, self.unknowns, &x.as_slice()[own..own + unknowns]);
        let frames = self.shots.len() * frames::ROWS;
        let count = frames + self.priors().count() + unknowns;
        let mut residuals = DVector::zeros(count);
        let mut jacobian = DMatrix::zeros(count, own + unknowns);
        let at = SVector::from(shared);
        let best = self.best.borrow();
        let (moved, near) = (at - best.shared, best.shots.as_slice());
        let reduced = |(i, shot): (usize, &Fitted)| {
            let film = shot.film.as_ref()?;
            let start = near.get(i).map_or(film.start, |found| film.start_after(found, &moved));
            film.reduced(&shot.plan.collision(&model), &shared, &start)
        };
        let all: Vec<Option<Reduced>> = self.shots.par_iter().enumerate().map(reduced).collect();
        let chi2: f64 = all.iter().map(|r| r.as_ref().map_or(f64::INFINITY, Reduced::chi2)).sum();
        let better = chi2 < best.chi2;
        drop(best);
        if better {
            let shots = all.iter().flatten().copied().collect();
            *self.best.borrow_mut() = Best { chi2, shared: at, shots };
        }
        let of_parameters = self.free.iter().map(|parameter| frames::place_of(*parameter));
        let places: Vec<usize> =
            of_parameters.chain(self.unknowns.iter().map(|unknown| unknown.kind.place())).collect();
        for (i, reduced) in all.iter().enumerate() {
            let mut rows = residuals.rows_mut(i * frames::ROWS, frames::ROWS);
            let Some(reduced) = reduced else {
                // the optimiser shrinks a step that ends where there is no prediction
                rows.fill(f64::NAN);
                continue;
            };
            rows.copy_from(&reduced.residuals);
            for (column, place) in places.iter().enumerate() {
                let mut block = jacobian.view_mut((i * frames::ROWS, column), (frames::ROWS, 1));
                block.copy_from(&reduced.jacobian.column(*place));
            }
        }
        let known =
            self.unknowns.iter().enumerate().map(|(i, unknown)| (own + i, unknown.prior.0, unknown.prior.1));
        let priors = self.priors().map(|(column, prior)| (column, prior.mean, prior.sd)).chain(known);
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
        let shared = self.whitening.common();
        let offsets = self.whitening.offsets();
        let own_columns = self.free.len();
        let count = observations + priors + self.whitening.unknowns() + self.whitening.kink_rows();
        let passed = self.whitening.passed(&model, &values.coefficients);
        let columns = self.free.len() + self.whitening.unknowns();
        let mut residuals = DVector::zeros(count);
        let mut jacobian = DMatrix::zeros(count, columns);
        let mut weights = self.whitening.inverse();
        let mut first = 0;
        let predictions: Vec<_> = self
            .shots
            .par_iter()
            .enumerate()
            .with_min_len(SHARE)
            .map(|(number, Fitted { plan, .. })| {
                let moved = self.whitening.moved(number, plan, &passed);
                let mut prediction = plan.predict_moved(&moved, &model, &values.coefficients)?;
                if let Some(AtKinks { inputs_by_parameters, carried, .. }) = self.whitening.kinks(number) {
                    prediction.values += carried * passed;
                    prediction.by_parameters += prediction.by_inputs * inputs_by_parameters + carried;
                }
                Ok::<_, Unpredictable>(prediction)
            })
            .collect();
        for (Fitted { plan, .. }, prediction) in self.shots.iter().zip(predictions) {
            let rows = plan.rows();
            let (own, rest) = weights.split_at(rows.len() * (rows.len() + 1) / 2);
            weights = rest;
            match prediction {
                Ok(prediction) => {
                    let mut raw = [0.0; MAX_OBSERVABLES];
                    for (i, row) in rows.iter().enumerate() {
                        let value = prediction.values[i] - offsets[first + i];
                        raw[i] = difference(row.observable, value, row.measured.value);
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
        let kinks = (0..self.shots.len()).filter_map(|number| self.whitening.kinks(number));
        let off = kinks.flat_map(|kinks| kinks.off.iter().map(|off| (kinks.root_weight, off)));
        for (k, (root_weight, (off, by_parameters))) in off.enumerate() {
            let row = count - self.whitening.kink_rows() + k;
            residuals[row] = root_weight * (off + by_parameters.dot(&passed));
            for (column, parameter) in self.free.iter().enumerate() {
                jacobian[(row, column)] = root_weight * by_parameters[*parameter as usize];
            }
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
