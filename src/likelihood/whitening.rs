//! What makes a shot's differences independent and of variance 1: the weights of a fit, at estimated inputs.
//!
//! A shot's differences d = f(ξ̂) + G(x − ξ̂) − measured, linearised at its inputs ξ̂ as [`super::errors_in_variables`] estimates them,
//! have the covariance C = diag(σ²) + G C_in Gᵀ: its observations' own variances and what the errors of the measured state
//! before the impact add, carried over by G = ∂f/∂inputs. With C = LLᵀ the whitened residuals are L⁻¹d.
//!
//! Inputs that are best at kinks ([`super::kinks`]) have, in the units t of their errors, orthonormal A and θ the parameters, the
//! constraint A(t − t̂) + B(θ − θ̂) = 0. Along the kinks they are t̂ − AᵀB(θ − θ̂); with S = ∂d/∂t, d gets S AᵀA t more and C
//! S AᵀA Sᵀ less; and what they are off along the normals, s = A t̂ − B(θ − θ̂), adds |s|² to χ².

use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use rayon::prelude::*;

use super::errors_in_variables;
use super::errors_in_variables::Estimated;
use super::fitted::{Fitted, SHARE};
use super::prediction::{INPUTS, Plan, Prediction, Unpredictable};
use super::shot_errors::{ByParameters, Errors, Units};
use crate::measurement::dataset::{Joint, Shared};
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;
use crate::measurement::values::Values;
use crate::physics::collision::{Coefficients, Model};

/// Standard deviations of observables for which the data give none, SI and radians.
pub type EstimatedSd = Vec<(Observable, f64)>;

/// Which inputs stay where they were, so that the weights come to rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Hold {
    None,
    /// They are looked for near where they were only: where a shot has several minima, they stay with one.
    Near,
    All,
}

/// What the weights are taken at.
#[derive(Clone, Copy)]
pub struct At<'a> {
    pub model: &'a Model,
    pub coefficients: &'a Coefficients,
    pub estimated: &'a EstimatedSd,
    pub hold: Hold,
    /// The errors that all shots share: standard errors, and how many of them each is taken to be.
    pub shared_errors: &'a [(Shared, f64)],
    pub shared: &'a [f64],
}

/// L⁻¹ of every shot, lower triangles row by row, one after the other; and the inputs that it is taken at. A fit of frames has the
/// default, none of these: its frames are weighted by their own standard deviations.
#[derive(Clone, Debug, Default)]
pub struct Whitening {
    pub(super) inverse: Vec<f64>,
    /// Where each shot's inputs are.
    inputs: Vec<Estimated>,
    /// G(ξ̂ − x), one number for each observation.
    pub(super) offsets: Vec<f64>,
    /// How the differences of all shots move together when what they share moves by its standard error: for each
    /// error, one number for each observation.
    pub(super) common: Vec<Vec<f64>>,
    /// Of each shot whose inputs are at kinks.
    kinks: Vec<Option<Box<AtKinks>>>,
    /// The parameters that all this is taken at.
    at: Parameters,
    /// Of shots whose frames are fitted: their weights, where these are not 1.
    of_films: Vec<f64>,
    /// What is added to the residuals of the shots, whitened ([`Problem::log_volume`](super::problem::Problem::log_volume)); empty where
    /// nothing is.
    pub(crate) shift: Vec<f64>,
}

/// Parameters in the order of [`Parameter::ALL`].
pub type Parameters = SVector<f64, { Parameter::ALL.len() }>;

/// What follows from inputs that stay on kinks while the parameters move.
#[derive(Clone, Debug)]
pub struct AtKinks {
    /// How the inputs move with the parameters.
    pub inputs_by_parameters: SMatrix<f64, INPUTS, { Parameter::ALL.len() }>,
    /// What the differences get besides, through errors that inputs and observations have together.
    pub carried: ByParameters,
    /// s at the parameters that the weights are taken at, its derivative, and the root of the shot's weight.
    pub off: Vec<(f64, Parameters)>,
    pub root_weight: f64,
}

/// A shot's part.
struct OfShot {
    inverse: Vec<f64>,
    inputs: Estimated,
    offsets: Vec<f64>,
    common: Vec<Vec<f64>>,
    kinks: Option<Box<AtKinks>>,
}

/// The parameters of a collision.
fn parameters(model: &Model, coefficients: &Coefficients) -> Parameters {
    let values = Values::of(model, *coefficients);
    Parameters::from(Parameter::ALL.map(|parameter| values[parameter]))
}

impl Whitening {
    /// With inputs estimated anew from where they were, or from what was measured. Errors that all shots share are in
    /// the unit of their standard deviations: each is one more unknown behind the free parameters, with mean 0 and
    /// standard deviation 1. `None` where a prediction fails or a covariance is not positive definite.
    pub fn new(shots: &[Fitted], at: &At, before: Option<&Self>) -> Option<Self> {
        let now = parameters(at.model, at.coefficients);
        let of_shot = |(number, shot): (usize, &Fitted)| {
            let start = before.and_then(|before| before.followed(number, &now));
            OfShot::new(&shot.plan, at, &start.unwrap_or_default())
        };
        let all: Option<Vec<OfShot>> =
            shots.par_iter().enumerate().with_min_len(SHARE).map(of_shot).collect();
        let common = vec![Vec::new(); at.shared_errors.len()];
        let mut whitening = Self { common, at: now, ..Self::default() };
        for own in all? {
            whitening.inverse.extend(own.inverse);
            whitening.inputs.push(own.inputs);
            whitening.offsets.extend(own.offsets);
            whitening.kinks.push(own.kinks);
            for (all, own) in whitening.common.iter_mut().zip(own.common) {
                all.extend(own);
            }
        }
        Some(whitening)
    }

    /// With a weight for each shot's part of χ².
    pub fn weighted(mut self, shots: &[Fitted], weights: &[f64]) -> Self {
        if shots.first().is_some_and(|shot| shot.film.is_some()) {
            self.of_films = weights.to_vec();
            return self;
        }
        let mut rest = self.inverse.as_mut_slice();
        for (shot, weight) in shots.iter().zip(weights) {
            let rows = shot.plan.rows().len();
            let (own, others) = rest.split_at_mut(rows * (rows + 1) / 2);
            for entry in own {
                *entry *= weight.sqrt();
            }
            rest = others;
        }
        for (kinks, weight) in self.kinks.iter_mut().zip(weights) {
            if let Some(kinks) = kinks {
                kinks.root_weight = weight.sqrt();
            }
        }
        self
    }

    /// The weight of a shot whose frames are fitted.
    pub fn of_film(&self, number: usize) -> f64 {
        self.of_films.get(number).copied().unwrap_or(1.0)
    }

    /// What the inputs of a shot are at, if that is kinks.
    pub fn kinks(&self, number: usize) -> Option<&AtKinks> {
        self.kinks.get(number)?.as_deref()
    }

    /// How many residuals the kinks of all shots add.
    pub fn kink_rows(&self) -> usize {
        self.kinks.iter().flatten().map(|kinks| kinks.off.len()).sum()
    }

    /// By how much the parameters have moved from where the weights are taken.
    pub fn passed(&self, model: &Model, coefficients: &Coefficients) -> Parameters {
        parameters(model, coefficients) - self.at
    }

    /// A shot's inputs at some parameters.
    fn followed(&self, number: usize, parameters: &Parameters) -> Option<Estimated> {
        let estimated = *self.inputs.get(number)?;
        let t = estimated.kinks.followed(&estimated.t, &(parameters - self.at));
        Some(Estimated { t, ..estimated })
    }

    /// By how much a shot's inputs are moved from what was measured, when the parameters have passed this.
    pub fn moved(&self, number: usize, plan: &Plan, passed: &Parameters) -> SVector<f64, INPUTS> {
        let estimated = self.inputs.get(number);
        estimated.map_or_else(SVector::zeros, |estimated| {
            Errors::inputs(plan, &estimated.kinks.followed(&estimated.t, passed))
        })
    }

    /// What is predicted of a shot at its measured inputs, linearised at those that are estimated.
    pub fn predict(
        &self,
        number: usize,
        plan: &Plan,
        model: &Model,
        coefficients: &Coefficients,
    ) -> Result<Prediction, Unpredictable> {
        let passed = self.passed(model, coefficients);
        let moved = self.moved(number, plan, &passed);
        let mut prediction = plan.predict_moved(&moved, model, coefficients)?;
        prediction.values -= prediction.by_inputs * moved;
        if let Some(AtKinks { inputs_by_parameters, carried, .. }) = self.kinks(number) {
            let estimated = &self.inputs[number];
            let t = estimated.kinks.followed(&estimated.t, &passed);
            let by_units = Errors::by_units(plan, &prediction.by_inputs);
            for (a, _) in estimated.kinks.orthonormal() {
                prediction.values += by_units * a * a.dot(&t);
            }
            prediction.by_parameters += prediction.by_inputs * inputs_by_parameters + carried;
        }
        Ok(prediction)
    }
}

impl OfShot {
    fn new(plan: &Plan, at: &At, start: &Estimated) -> Option<Self> {
        let At { model, coefficients, estimated, shared_errors, shared, hold } = *at;
        let rows = plan.rows().len();
        let (inputs, prediction) = if plan.has_uncertain_inputs() && hold != Hold::All {
            let errors = Errors::new(plan, |row| sd(plan, row, estimated));
            let shared_shift = |prediction: &Prediction, row: usize| {
                let shift = |((which, sd), value): (&(Shared, f64), &f64)| {
                    let joint = plan.joint()?;
                    Some(by_shared(joint, prediction, row, *which) * sd * value)
                };
                shared_errors.iter().zip(shared).filter_map(shift).sum()
            };
            let from = (&start.t, hold == Hold::None);
            errors_in_variables::estimate(&errors, (model, coefficients), from, shared_shift)?
        } else {
            (*start, plan.predict_moved(&Errors::inputs(plan, &start.t), model, coefficients).ok()?)
        };
        let moved = Errors::inputs(plan, &inputs.t);
        let mut covariance = covariance(plan, &prediction, estimated);
        let mut offsets = prediction.by_inputs * moved;
        let kinks = inputs.kinks.orthonormal();
        let by_units = Errors::by_units(plan, &prediction.by_inputs);
        for (a, _) in &kinks {
            let along = (by_units * a).rows(0, rows).into_owned();
            covariance.syger(-1.0, &along, &along, 1.0);
            offsets -= by_units * a * a.dot(&inputs.t);
        }
        let l = covariance.cholesky()?.l();
        let inverse = l.solve_lower_triangular(&DMatrix::identity(rows, rows))?;
        let lower = (0..rows).flat_map(|row| (0..=row).map(move |column| (row, column)));
        let common = |(which, sd): &(Shared, f64)| {
            let shift =
                |row| plan.joint().map_or(0.0, |joint| by_shared(joint, &prediction, row, *which) * sd);
            (0..rows).map(shift).collect()
        };
        Some(Self {
            inverse: lower.map(|place| inverse[place]).collect(),
            inputs,
            offsets: offsets.iter().take(rows).copied().collect(),
            common: shared_errors.iter().map(common).collect(),
            kinks: (!kinks.is_empty()).then(|| Box::new(AtKinks::new(plan, &inputs.t, &kinks))),
        })
    }
}

impl AtKinks {
    fn new(plan: &Plan, t: &Units, kinks: &[(Units, Parameters)]) -> Self {
        // AᵀB
        let by = kinks.iter().fold(SMatrix::zeros(), |sum, (a, b)| sum + a * b.transpose());
        Self {
            inputs_by_parameters: -Errors::inputs(plan, &by),
            carried: Errors::carried(plan) * by,
            off: kinks.iter().map(|(a, b)| (a.dot(t), -b)).collect(),
            root_weight: 1.0,
        }
    }
}

/// The standard deviation of an observation, given or estimated.
fn sd(plan: &Plan, row: usize, estimated: &EstimatedSd) -> f64 {
    let measurement = plan.rows()[row];
    let of_all = || estimated.iter().find(|(o, _)| *o == measurement.observable).map(|(_, sd)| *sd);
    measurement.measured.sd.or_else(of_all).unwrap_or(f64::NAN)
}

/// How a difference moves with something shared: d = predicted(inputs) − measured, both of which move.
fn by_shared(joint: &Joint, prediction: &Prediction, row: usize, which: Shared) -> f64 {
    let Some(by) = joint.by_shared.get(which.place()) else { return 0.0 };
    let through_inputs: f64 = (0..INPUTS).map(|k| prediction.by_inputs[(row, k)] * by[k]).sum();
    through_inputs - by[Joint::BEFORE + row]
}

/// How the differences of a shot move with each way in which the camera may be off.
#[must_use]
pub fn by_camera(plan: &Plan, prediction: &Prediction) -> Vec<DVector<f64>> {
    let Some(joint) = plan.joint() else { return Vec::new() };
    let ways = Shared::Camera(0).place()..joint.by_shared.len();
    let of = |row: usize, way: usize| by_shared(joint, prediction, row, Shared::Camera(way));
    (0..ways.len()).map(|way| DVector::from_fn(plan.rows().len(), |row, _| of(row, way))).collect()
}

/// The covariance of one shot's differences between prediction and measurement, of which the state before the impact has its
/// part: diag(σ²) + G C_in Gᵀ, in SI units and radians, in the order of [`Plan::rows`].
#[must_use]
pub fn covariance(plan: &Plan, prediction: &Prediction, estimated: &EstimatedSd) -> DMatrix<f64> {
    let rows = plan.rows().len();
    let g = prediction.by_inputs.rows(0, rows);
    if let Some(joint) = plan.joint() {
        // d = predicted(inputs) − measured, so that C = [G, −1] Σ [G, −1]ᵀ
        let mut by = DMatrix::zeros(rows, Joint::BEFORE + rows);
        by.columns_mut(0, Joint::BEFORE).copy_from(&g);
        for row in 0..rows {
            by[(row, Joint::BEFORE + row)] = -1.0;
        }
        return &by * &joint.covariance * by.transpose();
    }
    let mut covariance = g
        * DMatrix::from_diagonal(&DVector::from_column_slice(plan.variance_in().as_slice()))
        * g.transpose();
    for row in 0..rows {
        covariance[(row, row)] += sd(plan, row, estimated).powi(2);
    }
    covariance
}
