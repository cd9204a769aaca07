//! (samples, unknowns) → whitened residuals and Jacobian, as the least-squares problem that
//! [`crate::numerics::least_squares`] solves.
//!
//! While the parameters move, every shot's estimated inputs ξ̂, how its differences follow from the inputs (G) and what
//! they are weighted by (C = LLᵀ) stay as a [`Whitening`] has them: the residuals are L⁻¹(f(ξ̂) + G(x − ξ̂) − measured).
//! Where the weights have come to rest, χ² and its derivative are those of a fit of parameters and all inputs at once.
//!
//! Residuals stand in this order: those of the shots, sample by sample; the priors of the free unknowns; what is known of what the shots
//! of each data set share; and of each sample what keeps inputs at kinks.

use std::cell::RefCell;
use std::sync::Arc;

use argmin::core::{Error, Jacobian, Operator};
use nalgebra::{DMatrix, DVector, SVector};
use rayon::prelude::*;

use super::fitted::{Fitted, SHARE};
use super::frames::shared_unknowns;
use super::frames::{self, Reduced};
use super::prediction::{MAX_OBSERVABLES, Unpredictable, difference};
use super::sample::{Sample, Unknown, offsets, shared_columns};
use super::whitening::{AtKinks, EstimatedSd, Whitening, covariance};
use crate::measurement::parameter::{Parameter, Prior};
use crate::measurement::values::Values;
use crate::physics::collision::Model;

/// The place of ω_z among the inputs.
const SIDE_SPIN: usize = 5;

/// The least-squares problem in the columns of [`super::sample`].
pub struct Problem<'a> {
    parts: Vec<Part<'a>>,
    /// Of the free unknowns, by column.
    priors: Vec<(usize, Prior)>,
    columns: usize,
    /// Columns that take the value of the first of them.
    equal: Vec<usize>,
    /// The last point, since the optimiser asks for the Jacobian where it just asked for residuals.
    last: RefCell<Option<Point>>,
}

/// What one sample adds.
struct Part<'a> {
    sample: &'a Sample<'a>,
    whitening: &'a Whitening,
    /// The columns that are its parameters.
    own: Vec<(usize, Parameter)>,
    /// The columns of what its shots share besides, by how much more each is off than its column says, and whether another sample before
    /// has it.
    shared: Vec<usize>,
    offsets: Vec<f64>,
    is_known: Vec<bool>,
    /// Where χ² of the frames was least so far: from there the own unknowns of the shots are looked for.
    best: RefCell<Best>,
}

/// All shots of a sample at some shared unknowns.
#[derive(Clone)]
pub(crate) struct Best {
    chi2: f64,
    shared: SVector<f64, { frames::ALL_SHARED }>,
    /// None before the first evaluation.
    shots: Arc<[Arc<Reduced>]>,
}

impl Default for Best {
    fn default() -> Self {
        Self { chi2: f64::INFINITY, shared: SVector::zeros(), shots: Arc::default() }
    }
}

struct Point {
    x: DVector<f64>,
    residuals: DVector<f64>,
    jacobian: DMatrix<f64>,
}

impl<'a> Problem<'a> {
    /// `free`: unknowns with their priors; `whitening`: of each sample.
    #[must_use]
    pub fn new(
        samples: &'a [Sample<'a>],
        free: &[(Unknown, Option<Prior>)],
        whitening: &'a [Whitening],
    ) -> Self {
        let unknowns: Vec<Unknown> = free.iter().map(|(unknown, _)| *unknown).collect();
        let (of_samples, columns) = shared_columns(samples, free.len());
        let part = |(i, (sample, whitening)): (usize, (&'a Sample<'a>, &'a Whitening))| Part {
            sample,
            whitening,
            own: sample.columns(&unknowns),
            shared: of_samples[i].clone(),
            offsets: offsets(samples, sample),
            is_known: of_samples[i]
                .iter()
                .map(|column| of_samples[..i].iter().any(|other| other.contains(column)))
                .collect(),
            best: RefCell::default(),
        };
        let priors = free.iter().enumerate().filter_map(|(column, (_, prior))| Some((column, (*prior)?)));
        Self {
            parts: samples.iter().zip(whitening).enumerate().map(part).collect(),
            priors: priors.collect(),
            columns,
            equal: Vec::new(),
            last: RefCell::new(None),
        }
    }

    /// Where the shots of each sample are at a point, to begin with in problems that are minimised near it.
    pub(crate) fn found_at(self, x: &DVector<f64>) -> Vec<Best> {
        self.evaluate(x);
        // the first point there is better
        let found = |part: Part| Best { chi2: f64::INFINITY, ..part.best.take() };
        self.parts.into_iter().map(found).collect()
    }

    /// The own unknowns of the shots are first looked for from there; nowhere in particular without any.
    pub(crate) fn beginning(self, best: &[Best]) -> Self {
        for (part, best) in self.parts.iter().zip(best) {
            *part.best.borrow_mut() = best.clone();
        }
        self
    }

    /// Gives several columns the value of the first of them, which alone changes the residuals.
    pub(crate) fn with_equal(self, columns: &[usize]) -> Self {
        Self { equal: columns.to_vec(), ..self }
    }

    fn evaluate(&self, x: &DVector<f64>) -> Point {
        let Some((&first, others)) = self.equal.split_first() else { return self.evaluate_all(x) };
        let mut all = x.clone();
        for &other in others {
            all[other] = x[first];
        }
        let mut point = Point { x: x.clone(), ..self.evaluate_all(&all) };
        for &other in others {
            let column = point.jacobian.column(other).into_owned();
            point.jacobian.column_mut(first).axpy(1.0, &column, 1.0);
            point.jacobian.column_mut(other).fill(0.0);
        }
        point
    }

    fn evaluate_all(&self, x: &DVector<f64>) -> Point {
        let rows: usize = self.parts.iter().map(|part| part.rows().iter().sum::<usize>()).sum();
        let count = rows + self.priors.len();
        let mut point = Point {
            x: x.clone(),
            residuals: DVector::zeros(count),
            jacobian: DMatrix::zeros(count, self.columns),
        };
        let mut row = 0;
        for part in &self.parts {
            if part.sample.is_filmed() {
                part.frames(&mut point, row);
            } else {
                part.velocities(&mut point, row);
            }
            for (i, shift) in part.whitening.shift.iter().enumerate() {
                point.residuals[row + i] += shift;
            }
            row += part.rows()[0];
        }
        for (column, prior) in &self.priors {
            point.residuals[row] = (x[*column] - prior.mean) / prior.sd;
            point.jacobian[(row, *column)] = 1.0 / prior.sd;
            row += 1;
        }
        for part in &self.parts {
            part.shared(&mut point, row);
            row += part.rows()[1];
        }
        for part in &self.parts {
            part.kinks(&mut point, row);
            row += part.rows()[2];
        }
        point
    }

    /// What −2 log L has besides χ² where shots have side spins that nobody saw: Σ ln(σ²/p) of their prior variance σ² and posterior
    /// variance p. They are integrated over (by Laplace's method): every shot has its own, and the friction at which they are best known
    /// would be preferred if they were only minimised over. `noise`: what was estimated of each sample.
    pub(crate) fn log_volume(&self, x: &DVector<f64>, noise: &[EstimatedSd]) -> f64 {
        self.parts.iter().zip(noise).map(|(part, noise)| part.log_volume(x, noise)).sum()
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

impl Part<'_> {
    /// How many residuals its shots have, what they share, and its kinks.
    fn rows(&self) -> [usize; 3] {
        let shared = self.is_known.iter().filter(|known| !**known).count();
        [self.sample.rows(), shared, self.whitening.kink_rows()]
    }

    fn model(&self, x: &DVector<f64>) -> (Values, Model) {
        let set =
            |values: Values, (column, parameter): &(usize, Parameter)| values.with(*parameter, x[*column]);
        let values = self.own.iter().fold(self.sample.initial, set);
        (values, values.model(self.sample.model))
    }

    /// All shots, whose own unknowns are eliminated, and what they share.
    fn reduced(&self, x: &DVector<f64>) -> (Vec<Option<Arc<Reduced>>>, SVector<f64, { frames::ALL_SHARED }>) {
        let (values, model) = self.model(x);
        let of_film: Vec<f64> =
            self.shared.iter().zip(&self.offsets).map(|(column, offset)| x[*column] + offset).collect();
        let shared = shared_unknowns::shared(&values, &self.sample.unknowns, &of_film);
        let at = SVector::from(shared);
        let best = self.best.borrow();
        let (moved, near) = (at - best.shared, &best.shots);
        let reduced = |(i, shot): (usize, &Fitted)| {
            let film = shot.film.as_ref()?;
            let start = near.get(i).map_or(film.start, |found| film.start_after(found, &moved));
            film.reduced(&shot.plan.collision(&model), &shared, &start)
        };
        (self.sample.fitted.par_iter().enumerate().map(reduced).collect(), at)
    }

    /// Its part of [`Problem::log_volume`].
    fn log_volume(&self, x: &DVector<f64>, noise: &EstimatedSd) -> f64 {
        if self.sample.is_filmed() {
            let of = |(i, reduced): (usize, &Option<Arc<Reduced>>)| {
                self.whitening.of_film(i) * reduced.as_ref().map_or(f64::NAN, |reduced| reduced.log_volume)
            };
            return self.reduced(x).0.iter().enumerate().map(of).sum();
        }
        let (values, model) = self.model(x);
        let of = |(number, Fitted { plan, .. }): (usize, &Fitted)| {
            if plan.side_sd() == 0.0 {
                return Some(0.0);
            }
            let prediction = self.whitening.predict(number, plan, &model, &values.coefficients()).ok()?;
            let rows = plan.rows().len();
            let covariance = covariance(plan, &prediction, noise);
            let by_side = prediction.by_inputs.column(SIDE_SPIN).rows(0, rows) * plan.side_sd();
            // ln(σ²/p) = ln det C − ln det(C − σ² g gᵀ)
            let known = by_side.dot(&covariance.cholesky()?.solve(&by_side));
            Some(-(-known).ln_1p())
        };
        self.sample.fitted.iter().enumerate().map(|shot| of(shot).unwrap_or(f64::NAN)).sum()
    }

    /// The frames of all shots.
    fn frames(&self, point: &mut Point, first: usize) {
        let unknowns = &self.sample.unknowns;
        let (all, at) = self.reduced(&point.x);
        let chi2: f64 = all.iter().map(|r| r.as_ref().map_or(f64::INFINITY, |r| r.chi2())).sum();
        if chi2 < self.best.borrow().chi2 {
            let shots = all.iter().flatten().cloned().collect();
            *self.best.borrow_mut() = Best { chi2, shared: at, shots };
        }
        let of_parameters =
            self.own.iter().map(|(column, parameter)| (*column, frames::place_of(*parameter)));
        let of_film =
            self.shared.iter().zip(unknowns).map(|(column, unknown)| (*column, unknown.kind.place()));
        let places: Vec<(usize, usize)> = of_parameters.chain(of_film).collect();
        for (i, reduced) in all.iter().enumerate() {
            let row = first + i * frames::ROWS;
            let mut rows = point.residuals.rows_mut(row, frames::ROWS);
            let Some(reduced) = reduced else {
                // the optimiser shrinks a step that ends where there is no prediction
                rows.fill(f64::NAN);
                continue;
            };
            let root = self.whitening.of_film(i).sqrt();
            rows.copy_from(&(reduced.residuals * root));
            for (column, place) in &places {
                let mut block = point.jacobian.view_mut((row, *column), (frames::ROWS, 1));
                block.copy_from(&(reduced.jacobian.column(*place) * root));
            }
        }
    }

    /// What was measured of all shots: velocities, or angles.
    fn velocities(&self, point: &mut Point, start: usize) {
        let Point { x, residuals, jacobian } = point;
        let (values, model) = self.model(x);
        let passed = self.whitening.passed(&model, &values.coefficients());
        let shared = &self.whitening.common;
        let offsets = &self.whitening.offsets;
        let mut weights = self.whitening.inverse.as_slice();
        let shots = self.sample.fitted;
        let predictions: Vec<_> = shots
            .par_iter()
            .enumerate()
            .with_min_len(SHARE)
            .map(|(number, Fitted { plan, .. })| {
                let moved = self.whitening.moved(number, plan, &passed);
                let mut prediction = plan.predict_moved(&moved, &model, &values.coefficients())?;
                if let Some(AtKinks { inputs_by_parameters, carried, .. }) = self.whitening.kinks(number) {
                    prediction.values += carried * passed;
                    prediction.by_parameters += prediction.by_inputs * inputs_by_parameters + carried;
                }
                Ok::<_, Unpredictable>(prediction)
            })
            .collect();
        let mut first = 0;
        for (Fitted { plan, .. }, prediction) in shots.iter().zip(predictions) {
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
                            raw[i] += shift[first + i] * x[self.shared[k]];
                        }
                    }
                    let mut own = own.iter();
                    for i in 0..rows.len() {
                        let place = start + first + i;
                        for j in 0..=i {
                            let weight = own.next().copied().unwrap_or(f64::NAN);
                            residuals[place] += weight * raw[j];
                            for (k, shift) in shared.iter().enumerate() {
                                jacobian[(place, self.shared[k])] += weight * shift[first + j];
                            }
                            for (column, parameter) in &self.own {
                                jacobian[(place, *column)] +=
                                    weight * prediction.by_parameters[(j, *parameter as usize)];
                            }
                        }
                    }
                }
                // the optimiser shrinks a step that ends where there is no prediction
                Err(_) => residuals.rows_mut(start + first, rows.len()).fill(f64::NAN),
            }
            first += rows.len();
        }
    }

    /// What is known of what the shots of a data set share.
    fn shared(&self, point: &mut Point, first: usize) {
        let filmed = self.sample.is_filmed();
        let new = (0..self.shared.len()).filter(|k| !self.is_known[*k]);
        for (row, k) in (first..).zip(new) {
            let (mean, sd) = if filmed { self.sample.unknowns[k].prior } else { (0.0, 1.0) };
            let column = self.shared[k];
            point.residuals[row] = (point.x[column] + self.offsets[k] - mean) / sd;
            point.jacobian[(row, column)] = 1.0 / sd;
        }
    }

    /// What keeps the inputs of shots at kinks.
    fn kinks(&self, point: &mut Point, first: usize) {
        if self.rows()[2] == 0 {
            return;
        }
        let (values, model) = self.model(&point.x);
        let passed = self.whitening.passed(&model, &values.coefficients());
        let kinks = (0..self.sample.fitted.len()).filter_map(|number| self.whitening.kinks(number));
        let off = kinks.flat_map(|kinks| kinks.off.iter().map(|off| (kinks.root_weight, off)));
        for (k, (root_weight, (off, by_parameters))) in off.enumerate() {
            point.residuals[first + k] = root_weight * (off + by_parameters.dot(&passed));
            for (column, parameter) in &self.own {
                point.jacobian[(first + k, *column)] = root_weight * by_parameters[*parameter as usize];
            }
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
