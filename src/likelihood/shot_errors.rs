//! A shot's differences between what was predicted and what was measured, and the errors of its inputs, in units in which
//! all are independent and of variance 1.

use nalgebra::{SMatrix, SVector};

use super::joint_errors::Together;
use super::kinks::Kinks;
use super::prediction::{INPUTS, MAX_OBSERVABLES, Plan, Prediction, difference};
use crate::measurement::parameter::Parameter;
use crate::physics::collision::{Coefficients, Model};

/// Errors of a shot's inputs in units in which they are independent and of variance 1.
pub type Units = SVector<f64, INPUTS>;

/// How observations follow from the inputs in these units, and from the parameters.
pub type ByUnits = SMatrix<f64, MAX_OBSERVABLES, INPUTS>;
pub type ByParameters = SMatrix<f64, MAX_OBSERVABLES, { Parameter::ALL.len() }>;

type Observed = SVector<f64, MAX_OBSERVABLES>;

/// A shot's errors at some standard deviations of its observations.
pub struct Errors<'a> {
    pub(super) plan: &'a Plan,
    sds: Observed,
}

impl<'a> Errors<'a> {
    /// `sd` tells the standard deviation of a row's observation.
    pub fn new(plan: &'a Plan, sd: impl Fn(usize) -> f64) -> Self {
        let count = plan.rows().len();
        Self { plan, sds: Observed::from_fn(|row, _| if row < count { sd(row) } else { 1.0 }) }
    }

    /// F t, column by column: by how much inputs differ that are `t` from those that were measured.
    pub fn inputs<const C: usize>(plan: &Plan, t: &SMatrix<f64, INPUTS, C>) -> SMatrix<f64, INPUTS, C> {
        match plan.together() {
            Some(together) => together.factor * t,
            None => {
                let sds = plan.variance_in().map(f64::sqrt);
                SMatrix::from_fn(|row, column| sds[row] * t[(row, column)])
            }
        }
    }

    /// What is left of the observations over their standard errors, where inputs err by `t` and differences are d.
    fn left(&self, d: &Observed, t: &Units) -> Observed {
        let mut own = *d;
        if let Some(Together { carried, .. }) = self.plan.together() {
            for row in 0..self.plan.rows().len() {
                own[row] -= (0..INPUTS).map(|k| carried[(row, k)] * t[k]).sum::<f64>();
            }
        }
        self.whitened(&own)
    }

    /// The derivative by t of what has this derivative by the inputs.
    pub fn in_units(plan: &Plan, by_inputs: &Units) -> Units {
        match plan.together() {
            Some(together) => together.factor.tr_mul(by_inputs),
            None => plan.variance_in().map(f64::sqrt).component_mul(by_inputs),
        }
    }

    /// How the differences change with t, before they are divided by standard errors: G F − A.
    pub fn by_units(plan: &Plan, by_inputs: &ByUnits) -> ByUnits {
        let mut by = *by_inputs;
        match plan.together() {
            None => {
                for (k, variance) in plan.variance_in().iter().enumerate() {
                    by.column_mut(k).scale_mut(variance.sqrt());
                }
            }
            Some(Together { factor, .. }) => by = by * factor - Self::carried(plan),
        }
        by
    }

    /// How the observations' errors move with t: A.
    pub fn carried(plan: &Plan) -> ByUnits {
        let carried = |row: usize, k: usize| {
            plan.together()
                .filter(|_| row < plan.rows().len())
                .map_or(0.0, |together| together.carried[(row, k)])
        };
        ByUnits::from_fn(carried)
    }

    /// Differences' derivatives over the observations' own standard errors.
    fn whitened<const C: usize>(
        &self,
        by: &SMatrix<f64, MAX_OBSERVABLES, C>,
    ) -> SMatrix<f64, MAX_OBSERVABLES, C> {
        let count = self.plan.rows().len();
        let rest = self.plan.together().map(|together| &together.rest);
        SMatrix::from_fn(|row, k| match rest {
            _ if row >= count => 0.0,
            None => by[(row, k)] / self.sds[row],
            Some(rest) => (0..=row).map(|j| rest[(row, j)] * by[(j, k)]).sum(),
        })
    }

    /// How what is left changes with t.
    fn slope(&self, by_inputs: &ByUnits) -> ByUnits {
        self.whitened(&Self::by_units(self.plan, by_inputs))
    }
}

/// A shot's inputs, and what is predicted from them.
#[derive(Clone)]
pub struct Point {
    pub t: Units,
    pub prediction: Prediction,
    left: Observed,
    pub chi2: f64,
}

/// One shot at some coefficients.
pub struct OfShot<'a, S> {
    pub errors: &'a Errors<'a>,
    pub model: &'a Model,
    pub coefficients: &'a Coefficients,
    /// What the errors that all shots share add to a difference.
    pub shared: S,
}

impl<S: Fn(&Prediction, usize) -> f64> OfShot<'_, S> {
    /// `None` where there is no prediction.
    pub fn at(&self, t: Units) -> Option<Point> {
        let Self { errors, model, coefficients, .. } = *self;
        let plan = errors.plan;
        let prediction = plan.predict_moved(&Errors::inputs(plan, &t), model, coefficients).ok()?;
        let mut d = Observed::zeros();
        for (row, measurement) in plan.rows().iter().enumerate() {
            let own = difference(measurement.observable, prediction.values[row], measurement.measured.value);
            d[row] = own + (self.shared)(&prediction, row);
        }
        let left = errors.left(&d, &t);
        let chi2 = t.norm_squared() + left.norm_squared();
        chi2.is_finite().then_some(Point { t, prediction, left, chi2 })
    }

    /// How what is left changes with t and with the parameters.
    pub fn slopes(&self, at: &Point) -> (ByUnits, ByParameters) {
        (self.errors.slope(&at.prediction.by_inputs), self.errors.whitened(&at.prediction.by_parameters))
    }

    /// Gauss and Newton's step, along the kinks: min |t|² + |left + slope (t − now)|².
    pub fn step(&self, now: &Point, kinks: &Kinks) -> Option<Units> {
        let slope = self.errors.slope(&now.prediction.by_inputs);
        let normal = (SMatrix::<f64, INPUTS, INPUTS>::identity() + slope.tr_mul(&slope)).cholesky()?;
        let step = normal.solve(&slope.tr_mul(&(slope * now.t - now.left))) - now.t;
        Some(kinks.along(step, &normal))
    }
}
