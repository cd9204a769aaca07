//! What makes a shot's differences independent and of variance 1: the weights of a fit, at estimated inputs.
//!
//! A shot's differences d = f(ξ̂) + G(x − ξ̂) − measured, linearised at its inputs ξ̂ as [`super::errors_in_variables`] estimates them,
//! have the covariance C = diag(σ²) + G C_in Gᵀ: its observations' own variances and what the errors of the measured state
//! before the impact add, carried over by G = ∂f/∂inputs. With C = LLᵀ the whitened residuals are L⁻¹d.

use nalgebra::{DMatrix, DVector, SVector};
use rayon::prelude::*;

use super::errors_in_variables;
use super::errors_in_variables::{Errors, Estimated, Units};
use super::fitted::{Fitted, SHARE};
use super::prediction::{INPUTS, Plan, Prediction, Unpredictable};
use crate::measurement::dataset::{Joint, Shared};
use crate::measurement::observable::Observable;
use crate::physics::collision::{Coefficients, Model};

/// Standard deviations of observables for which the data give none, SI and radians.
pub type EstimatedSd = Vec<(Observable, f64)>;

/// Which inputs stay where they were, so that the weights come to rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Hold {
    None,
    /// Those that were at a kink: they would go from one side to the other.
    AtKinks,
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

/// L⁻¹ of every shot, lower triangles row by row, one after the other; and the inputs that it is taken at.
#[derive(Clone, Debug)]
pub struct Whitening {
    inverse: Vec<f64>,
    /// Where each shot's inputs are.
    inputs: Vec<Estimated>,
    /// G(ξ̂ − x), one number for each observation.
    offsets: Vec<f64>,
    /// How the differences of all shots move together when what they share moves by its standard error: for each
    /// error, one number for each observation.
    common: Vec<Vec<f64>>,
}

/// As they were measured.
const MEASURED: Estimated =
    Estimated { t: Units::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), chi2: f64::INFINITY, at_kink: false };

/// A shot's part.
struct OfShot {
    inverse: Vec<f64>,
    inputs: Estimated,
    offsets: Vec<f64>,
    common: Vec<Vec<f64>>,
}

impl Whitening {
    /// Of frames, which are weighted as they are.
    #[must_use]
    pub fn none() -> Self {
        Self { inverse: Vec::new(), inputs: Vec::new(), offsets: Vec::new(), common: Vec::new() }
    }

    /// With inputs estimated anew from where they were, or from what was measured. Errors that all shots share are in
    /// the unit of their standard deviations: each is one more unknown behind the free parameters, with mean 0 and
    /// standard deviation 1. `None` where a prediction fails or a covariance is not positive definite.
    #[must_use]
    pub fn new(shots: &[Fitted], at: &At, before: Option<&Self>) -> Option<Self> {
        let of_shot = |(number, shot): (usize, &Fitted)| {
            let start = before.and_then(|before| before.inputs.get(number)).copied();
            OfShot::new(&shot.plan, at, start.unwrap_or(MEASURED))
        };
        let all: Option<Vec<OfShot>> =
            shots.par_iter().enumerate().with_min_len(SHARE).map(of_shot).collect();
        let mut whitening = Self::none();
        whitening.common = vec![Vec::new(); at.shared_errors.len()];
        for own in all? {
            whitening.inverse.extend(own.inverse);
            whitening.inputs.push(own.inputs);
            whitening.offsets.extend(own.offsets);
            for (all, own) in whitening.common.iter_mut().zip(own.common) {
                all.extend(own);
            }
        }
        Some(whitening)
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

    /// L⁻¹ of the shots.
    #[must_use]
    pub fn inverse(&self) -> &[f64] {
        &self.inverse
    }

    /// One number for each observation and shared error.
    #[must_use]
    pub fn common(&self) -> &[Vec<f64>] {
        &self.common
    }

    /// What is subtracted of the prediction at a shot's estimated inputs, for each observation.
    #[must_use]
    pub fn offsets(&self) -> &[f64] {
        &self.offsets
    }

    /// By how much a shot's inputs are moved from what was measured.
    #[must_use]
    pub fn moved(&self, number: usize, plan: &Plan) -> SVector<f64, INPUTS> {
        let estimated = self.inputs.get(number);
        estimated.map_or_else(SVector::zeros, |estimated| Errors::moved(plan, &estimated.t))
    }

    /// What is predicted of a shot at its measured inputs, linearised at those that are estimated.
    ///
    /// # Errors
    /// As [`Plan::predict`].
    pub fn predict(
        &self,
        number: usize,
        plan: &Plan,
        model: &Model,
        coefficients: &Coefficients,
    ) -> Result<Prediction, Unpredictable> {
        let moved = self.moved(number, plan);
        let mut prediction = plan.predict_moved(&moved, model, coefficients)?;
        prediction.values -= prediction.by_inputs * moved;
        Ok(prediction)
    }
}

impl OfShot {
    fn new(plan: &Plan, at: &At, start: Estimated) -> Option<Self> {
        let At { model, coefficients, estimated, shared_errors, shared, hold } = *at;
        let rows = plan.rows().len();
        let held = hold == Hold::All || hold == Hold::AtKinks && start.at_kink;
        let (inputs, prediction) = if plan.has_uncertain_inputs() && !held {
            let errors = Errors::new(plan, |row| sd(plan, row, estimated));
            let shared_shift = |prediction: &Prediction, row: usize| {
                let shift = |((which, sd), value): (&(Shared, f64), &f64)| {
                    let joint = plan.joint()?;
                    Some(by_shared(joint, prediction, row, *which) * sd * value)
                };
                shared_errors.iter().zip(shared).filter_map(shift).sum()
            };
            let from =
                |t: Units| errors_in_variables::estimate(&errors, (model, coefficients), &t, shared_shift);
            let mut best = from(start.t)?;
            if hold == Hold::None {
                let rolling = best.1.speed / model.ball.radius;
                for found in errors_in_variables::elsewhere(plan, rolling).filter_map(from) {
                    if found.0.chi2 < best.0.chi2 {
                        best = found;
                    }
                }
            }
            best
        } else {
            (start, plan.predict_moved(&Errors::moved(plan, &start.t), model, coefficients).ok()?)
        };
        let moved = Errors::moved(plan, &inputs.t);
        let l = covariance(plan, &prediction, estimated).cholesky()?.l();
        let inverse = l.solve_lower_triangular(&DMatrix::identity(rows, rows))?;
        let lower = (0..rows).flat_map(|row| (0..=row).map(move |column| (row, column)));
        let offsets = prediction.by_inputs * moved;
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
        })
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
    let by = &joint.by_shared[which as usize];
    let through_inputs: f64 = (0..INPUTS).map(|k| prediction.by_inputs[(row, k)] * by[k]).sum();
    through_inputs - by[Joint::BEFORE + row]
}

/// C of one shot's observations.
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
