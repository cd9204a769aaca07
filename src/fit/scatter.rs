//! Shots of discs scatter by more than the noise of their frames: surfaces differ from place to place, and no hand pushes a puck
//! twice alike. What they scatter by is estimated with the parameters and enters their errors.
//!
//! Each shot i has an e of its own, e + ε_i, and J_t/J_n(e + ε_i, …) + δ_i, with ε and δ independent, of mean 0 and of standard
//! deviations that all shots share. With f = ∂(J_t/J_n)/∂e, G the derivatives by the state before the impact and Σ the errors of the
//! frames, a shot's two residuals have the covariance
//!
//!   C = [G, −1] Σ [G, −1]ᵀ + σ_e² (1, f)(1, f)ᵀ + σ_J² diag(0, 1),
//!
//! with σ_e² and σ_J² by restricted maximum likelihood (Patterson and Thompson 1971, Biometrika 58, 545), or by maximum likelihood where
//! models are compared.

use nalgebra::{DMatrix, DVector};

use super::samples::Search;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::prediction::{Prediction, difference};
use crate::likelihood::sample::Unknown;
use crate::likelihood::whitening::{by_camera, covariance};
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;
use crate::measurement::values::Values;
use crate::physics::collision::Model;

/// Fewer shots do not tell by how much shots scatter.
const LEAST_SHOTS: usize = 3;

/// So many shots, spread evenly, tell it to some percent: the work rises with the cube of their number.
const MOST_SHOTS: usize = 150;

/// Steps towards the most likely variances.
const MOST_STEPS: usize = 200;
const STEPPED: f64 = 1e-9;

/// A scatter below this part of the errors of the frames is none.
const NONE: f64 = 1e-3;

/// A step takes no more than this part of a variance away, so that it stays positive.
const LEAST_LEFT: f64 = 0.1;

/// By how much shots of discs scatter: standard deviations between shots, beyond the errors of their frames; 0 where they show none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scatter {
    /// The standard deviation of e.
    pub restitution: f64,
    /// The standard deviation of J_t/J_n, besides what follows from that of e.
    pub impulse_ratio: f64,
    /// Whether there are enough shots to estimate it.
    pub is_estimated: bool,
}

impl Scatter {
    /// Whether the errors of the frames alone explain the residuals, so that χ² tests the model.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.variances() == [0.0; 2]
    }

    /// The larger change of a standard deviation, over both its values.
    pub(super) fn change_from(&self, before: &Self) -> f64 {
        let [from, to] = [before, self].map(|scatter| scatter.variances().map(f64::sqrt));
        (0..2).map(|k| (to[k] - from[k]).abs() / (from[k] + to[k] + NONE)).fold(0.0, f64::max)
    }

    fn variances(&self) -> [f64; 2] {
        [self.restitution.powi(2), self.impulse_ratio.powi(2)]
    }
}

/// Where the search begins: as if nothing but scatter made shots differ.
pub(super) fn spread(raw: &[Fitted]) -> Scatter {
    let of = |observable: Observable| {
        let values: Vec<f64> = raw
            .iter()
            .flat_map(|shot| shot.plan.rows())
            .filter(|row| row.observable == observable)
            .map(|row| row.measured.value)
            .collect();
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len().max(1) as f64).sqrt()
    };
    if raw.len() < LEAST_SHOTS {
        return Scatter::default();
    }
    Scatter {
        restitution: of(Observable::Restitution),
        impulse_ratio: of(Observable::ImpulseRatio),
        is_estimated: true,
    }
}

/// What is predicted of a shot, how its residuals follow from its e and from its J_t/J_n, the columns of the two scatters, and the
/// covariance of the errors of its frames.
pub(super) fn moves(
    shot: &Fitted,
    model: &Model,
    at: &Values,
) -> Option<(Prediction, [DVector<f64>; 2], DMatrix<f64>)> {
    let prediction = shot.plan.predict(&at.model(model), &at.coefficients()).ok()?;
    let rows = shot.plan.rows();
    let by_e = DVector::from_fn(rows.len(), |row, _| prediction.by_parameters[(row, Parameter::E as usize)]);
    let own = DVector::from_fn(rows.len(), |row, _| {
        f64::from(u8::from(rows[row].observable == Observable::ImpulseRatio))
    });
    let covariance = covariance(&shot.plan, &prediction, &Vec::new());
    Some((prediction, [by_e, own], covariance))
}

/// The shots with exact states before the impact, whose errors and scatter are those of what is observed after it.
pub(super) fn with_errors(raw: &[Fitted], model: &Model, at: &Values, scatter: &Scatter) -> Vec<Fitted> {
    let with = |shot: &Fitted| {
        let Some((prediction, moves, mut covariance)) = moves(shot, model, at) else { return shot.clone() };
        for (variance, by) in scatter.variances().into_iter().zip(&moves) {
            covariance += variance * by * by.transpose();
        }
        let by_camera = by_camera(&shot.plan, &prediction);
        Fitted { plan: shot.plan.with_covariance(&covariance, &by_camera), ..shot.clone() }
    };
    raw.iter().map(with).collect()
}

/// The most likely scatter with the parameters where a fit ended, by Fisher's scoring: with V the covariance of all residuals r, X their
/// derivatives by the free parameters, P = V⁻¹ − V⁻¹X(XᵀV⁻¹X)⁻¹XᵀV⁻¹ and B_k what a variance s_k multiplies, the score is
/// ½(rᵀP B_k P r − tr P B_k) and the information ½ tr P B_k P B_l; for maximum likelihood V⁻¹ in the place of P in the traces.
pub(super) fn estimate(
    raw: &[Fitted],
    search: &Search,
    free: &[Unknown],
    at: &Values,
    before: &Scatter,
) -> Scatter {
    let sample: Vec<&Fitted> = raw.iter().step_by(raw.len().div_ceil(MOST_SHOTS).max(1)).collect();
    let count: usize = sample.iter().map(|shot| shot.plan.rows().len()).sum();
    if raw.len() < LEAST_SHOTS || count <= free.len() {
        return Scatter::default();
    }
    let (mut residuals, mut by) = (DVector::zeros(count), DMatrix::zeros(count, free.len()));
    let mut of_frames = DMatrix::zeros(count, count);
    let mut of_scatter = [DMatrix::zeros(count, count), DMatrix::zeros(count, count)];
    let mut of_camera: Vec<DVector<f64>> = Vec::new();
    let mut first = 0;
    for shot in sample {
        let rows = shot.plan.rows();
        let Some((prediction, moves, covariance)) = moves(shot, search.first().model, at) else {
            return *before;
        };
        for (i, row) in rows.iter().enumerate() {
            residuals[first + i] = difference(row.observable, prediction.values[i], row.measured.value);
            for (column, unknown) in free.iter().enumerate() {
                by[(first + i, column)] = prediction.by_parameters[(i, unknown.parameter as usize)];
            }
        }
        let block = (rows.len(), rows.len());
        of_frames.view_mut((first, first), block).copy_from(&covariance);
        for (all, by) in of_scatter.iter_mut().zip(&moves) {
            all.view_mut((first, first), block).copy_from(&(by * by.transpose()));
        }
        for (way, by) in by_camera(&shot.plan, &prediction).into_iter().enumerate() {
            if way == of_camera.len() {
                of_camera.push(DVector::zeros(count));
            }
            of_camera[way].rows_mut(first, rows.len()).copy_from(&by);
        }
        first += rows.len();
    }
    let noise = of_frames.trace() / count as f64;
    for by in &of_camera {
        of_frames += by * by.transpose();
    }
    // as large as the errors of the frames where the last round left none, since more may be needed now
    let mut variances = before.variances().map(|variance| variance.max(noise));
    let present: Vec<usize> = (0..2).filter(|k| of_scatter[*k].trace() > 0.0).collect();
    for _ in 0..MOST_STEPS {
        let v = variances.iter().zip(&of_scatter).fold(of_frames.clone(), |v, (s, b)| v + b * *s);
        let Some(inverse) = v.cholesky().map(|v| v.inverse()) else { return *before };
        let x = &inverse * &by;
        let Some(middle) = pseudo_inverse(by.tr_mul(&x)) else { return *before };
        let p = &inverse - &x * middle * x.transpose();
        let traced = if search.maximum_likelihood { &inverse } else { &p };
        let pulled = &p * &residuals;
        let products: Vec<DMatrix<f64>> = present.iter().map(|k| traced * &of_scatter[*k]).collect();
        let trace = |a: &DMatrix<f64>, b: &DMatrix<f64>| a.component_mul(&b.transpose()).sum();
        let n = present.len();
        let score = DVector::from_fn(n, |k, _| {
            pulled.dot(&(&of_scatter[present[k]] * &pulled)) - products[k].trace()
        });
        let information = DMatrix::from_fn(n, n, |k, l| trace(&products[k], &products[l]));
        let Some(step) = information.lu().solve(&score) else { break };
        let mut changed = 0.0_f64;
        for (k, place) in present.iter().enumerate() {
            let old = variances[*place];
            variances[*place] = (old + step[k]).max(LEAST_LEFT * old);
            if variances[*place] > NONE * NONE * noise {
                changed = changed.max((variances[*place] / old - 1.0).abs());
            }
        }
        if changed < STEPPED {
            break;
        }
    }
    let sd = |k: usize| {
        let told = present.contains(&k) && variances[k] > NONE * NONE * noise;
        if told { variances[k].sqrt() } else { 0.0 }
    };
    Scatter { restitution: sd(0), impulse_ratio: sd(1), is_estimated: true }
}

/// Of a positive matrix, without the directions that nothing depends on.
fn pseudo_inverse(matrix: DMatrix<f64>) -> Option<DMatrix<f64>> {
    /// Of the largest singular value.
    const RANK: f64 = 1e-12;
    if matrix.is_empty() {
        return Some(matrix);
    }
    let least = RANK * matrix.norm();
    if least.is_finite() { matrix.pseudo_inverse(least).ok() } else { None }
}
