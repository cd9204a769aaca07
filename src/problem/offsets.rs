//! Outcome offsets: velocities after the impact less the model's, shot by shot, to first order from
//! what the frames of the shot show. They are the residuals of a fit in the terms of the impact, and
//! how they change with speed, cut or spin tests the model.

use nalgebra::{DMatrix, DVector, Matrix4, Vector4};
use statrs::distribution::{ContinuousCDF, Normal};

use super::solution::Solution;
use super::unknowns::Id;

/// Velocities after the impact less the model's: of the cue ball along and across the line of
/// centres, and of the object ball, m/s.
#[derive(Clone, Copy, Debug)]
pub struct Offsets {
    /// The estimate.
    pub values: Vector4<f64>,
    /// Its covariance, the shared unknowns as they are.
    pub covariance: Matrix4<f64>,
}

/// How offsets change with a variable.
#[derive(Clone, Copy, Debug)]
pub struct Slope {
    /// In standard deviations of an offset per unit of the variable.
    pub value: f64,
    /// The same over its standard error.
    pub t: f64,
    /// Probability of a slope as far from 0 by chance.
    pub p_value: f64,
    /// Fall of χ² with a mean of the offsets beside it; `None` if the free unknowns take that up.
    pub level: Option<f64>,
}

/// The score of a shift of the outcome of one shot by a standard deviation.
pub(crate) struct ShiftScore {
    /// Its square.
    pub square: f64,
    /// Its product with the residuals.
    pub along: f64,
    /// Its products with the free unknowns of the sample, in the order of [`Solution::own_columns`].
    pub beside: DVector<f64>,
}

/// A slope or a level that the other unknowns take up to all but this part tells nothing.
const OWN_PART: f64 = 1e-6;

impl Solution {
    /// Returns the outcome offsets of shot `i` of a sample; `None` if its frames do not tell them.
    #[must_use]
    pub fn offsets(&self, sample: usize, i: usize) -> Option<Offsets> {
        let (information, gradient) = self.at.shots.get(sample)?.get(i)?.reduced(&Id::OFFSETS)?;
        let covariance = information.cholesky()?.inverse();
        let values = -(&covariance * gradient);
        let covariance = Matrix4::from_fn(|a, b| covariance[(a, b)]);
        let is_finite = covariance.iter().all(|c| c.is_finite());
        is_finite.then_some(Offsets { values: Vector4::from_fn(|a, _| values[a]), covariance })
    }

    /// Returns how the offsets of the first sample change with a variable along a direction each, in
    /// the collision frame of the shot, if neither their mean nor any free unknown takes it up. Shots
    /// whose variable is not finite do not count. `None` if nothing is left.
    #[must_use]
    pub fn slope(&self, variable: &[f64], directions: &[Vector4<f64>]) -> Option<Slope> {
        let own = self.own_columns();
        let ids: Vec<Id> = own.iter().map(|(_, id)| *id).chain(Id::OFFSETS).collect();
        let shared = own.len();
        let score = |(i, direction): (usize, &Vector4<f64>)| {
            let (information, slope) = self.at.shots[0][i].reduced(&ids)?;
            let of_offsets = information.view((shared, shared), (4, 4)).into_owned();
            let covariance = of_offsets.clone().try_inverse()?;
            let direction = DVector::from_iterator(4, direction.iter().copied());
            let unit = &direction * direction.dot(&(covariance * &direction)).sqrt();
            Some(ShiftScore {
                square: unit.dot(&(of_offsets * &unit)),
                along: unit.dot(&slope.rows(shared, 4)),
                beside: information.view((0, shared), (shared, 4)) * &unit,
            })
        };
        let scores: Vec<Option<ShiftScore>> = directions.iter().enumerate().map(score).collect();
        self.slope_of(variable, &scores)
    }

    /// Returns the free unknowns of the problem that the first sample has: the place of each among the
    /// estimates, in the sample's order.
    pub(crate) fn own_columns(&self) -> Vec<(usize, Id)> {
        let Some(sample) = self.problem.samples.first() else { return Vec::new() };
        let place = |id: Id| self.covariance.position(sample.columns[id as usize]);
        Id::ALL.into_iter().filter_map(|id| Some((place(id)?, id))).collect()
    }

    /// Returns how shifts change with a variable, from the score of the shift of each shot.
    pub(crate) fn slope_of(&self, variable: &[f64], scores: &[Option<ShiftScore>]) -> Option<Slope> {
        let (own, count) = (self.own_columns(), self.covariance.columns.len());
        let is_used = |i: &usize| variable[*i].is_finite() && scores[*i].is_some();
        let used: Vec<usize> = (0..variable.len()).filter(is_used).collect();
        let mean = used.iter().map(|i| variable[*i]).sum::<f64>() / used.len().max(1) as f64;
        let spread = used.iter().map(|i| (variable[*i] - mean).abs()).fold(0.0, f64::max);
        if spread <= OWN_PART * mean.abs().max(1e-3) {
            return None;
        }
        // level and slope beside the free unknowns
        let mut beside = DMatrix::<f64>::zeros(count, 2);
        let mut matrix = DMatrix::<f64>::zeros(2, 2);
        let mut gradient = DVector::<f64>::zeros(2);
        for i in used {
            let Some(score) = &scores[i] else { continue };
            let factors = [1.0, variable[i] - mean];
            for a in 0..2 {
                gradient[a] += factors[a] * score.along;
                for b in 0..2 {
                    matrix[(a, b)] += factors[a] * factors[b] * score.square;
                }
                for (row, (column, _)) in own.iter().enumerate() {
                    beside[(*column, a)] += factors[a] * score.beside[row];
                }
            }
        }
        let left = &matrix - beside.tr_mul(&(&self.covariance.covariance * &beside));
        let (level, rise) = (left[(0, 0)], left[(1, 1)]);
        if !(rise > OWN_PART * matrix[(1, 1)]) {
            return None;
        }
        // without a level that the unknowns take up, the slope stands alone
        let is_own = level > OWN_PART * matrix[(0, 0)];
        let (information, along) = if is_own {
            let factor = left[(0, 1)] / level;
            (rise - factor * left[(0, 1)], gradient[1] - factor * gradient[0])
        } else {
            (rise, gradient[1])
        };
        let level = is_own.then(|| gradient[0] * gradient[0] / level);
        if !(information > OWN_PART * matrix[(1, 1)]) {
            return None;
        }
        let t = -along / information.sqrt();
        let p_value = 2.0 * Normal::standard().sf(t.abs());
        Some(Slope { value: -along / information, t, p_value, level })
    }
}
