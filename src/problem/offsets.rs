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
    /// Probability of a slope as far from 0 by chance.
    pub p_value: f64,
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
        let sample = self.problem.samples.first()?;
        // free unknowns of the problem that the sample has, in its own order
        let free = &self.covariance.columns;
        let own: Vec<(usize, Id)> = Id::ALL
            .into_iter()
            .filter_map(|id| Some((free.iter().position(|c| *c == sample.columns[id as usize])?, id)))
            .collect();
        let ids: Vec<Id> = own.iter().map(|(_, id)| *id).chain(Id::OFFSETS).collect();
        let shared = own.len();
        let used: Vec<usize> = (0..variable.len()).filter(|i| variable[*i].is_finite()).collect();
        let mean = used.iter().map(|i| variable[*i]).sum::<f64>() / used.len().max(1) as f64;
        let spread = used.iter().map(|i| (variable[*i] - mean).abs()).fold(0.0, f64::max);
        if spread <= OWN_PART * mean.abs().max(1e-3) {
            return None;
        }
        // level and slope beside the free unknowns
        let mut beside = DMatrix::<f64>::zeros(free.len(), 2);
        let mut matrix = DMatrix::<f64>::zeros(2, 2);
        let mut gradient = DVector::<f64>::zeros(2);
        for i in used {
            let Some((information, slope)) = self.at.shots[0][i].reduced(&ids) else { continue };
            let of_offsets = information.view((shared, shared), (4, 4)).into_owned();
            let Some(covariance) = of_offsets.clone().try_inverse() else { continue };
            let direction = DVector::from_iterator(4, directions[i].iter().copied());
            let unit = &direction * direction.dot(&(covariance * &direction)).sqrt();
            let with_shared = information.view((0, shared), (shared, 4)) * &unit;
            let (square, along) = (unit.dot(&(of_offsets * &unit)), unit.dot(&slope.rows(shared, 4)));
            let factors = [1.0, variable[i] - mean];
            for a in 0..2 {
                gradient[a] += factors[a] * along;
                for b in 0..2 {
                    matrix[(a, b)] += factors[a] * factors[b] * square;
                }
                for (row, (column, _)) in own.iter().enumerate() {
                    beside[(*column, a)] += factors[a] * with_shared[row];
                }
            }
        }
        let left = &matrix - beside.tr_mul(&(&self.covariance.covariance * &beside));
        let (level, rise) = (left[(0, 0)], left[(1, 1)]);
        if !(rise > OWN_PART * matrix[(1, 1)]) {
            return None;
        }
        // without a level that the unknowns take up, the slope stands alone
        let (information, along) = if level > OWN_PART * matrix[(0, 0)] {
            let factor = left[(0, 1)] / level;
            (rise - factor * left[(0, 1)], gradient[1] - factor * gradient[0])
        } else {
            (rise, gradient[1])
        };
        if !(information > OWN_PART * matrix[(1, 1)]) {
            return None;
        }
        let p_value = 2.0 * Normal::standard().sf(along.abs() / information.sqrt());
        Some(Slope { value: -along / information, p_value })
    }
}
